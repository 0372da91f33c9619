//! Waveform files: their ends and their errors.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

use hpu_datapath::{HybridLoop, LoopConfig, Wiring};
use hpu_signal::{Clock, Cycle, Observe, Real};
use hpu_wave::{Fst, Layout, Recording, Sink, Source, Vcd};

use crate::read_back;

const REALS: [Real; 2] = [Real { name: "angle_rad", doc: "angle" }, Real { name: "current_a", doc: "current" }];

fn wiring() -> HybridLoop {
    HybridLoop::new(LoopConfig::default()).expect("the default is valid")
}

fn clock() -> Clock {
    Clock::new(50_000_000).expect("valid")
}

/// Returns words of all nets in which every bit equals bit 0 of `edge`: each net changes at each edge.
fn alternating(edge: u64) -> Vec<i64> {
    let word = if edge.is_multiple_of(2) { 0 } else { u64::MAX };
    wiring().nets().iter().map(|net| net.format.from_bits(word)).collect()
}

/// A disk with room for a limited number of bytes.
#[derive(Default)]
struct Disk {
    room: usize,
    refusals: usize,
    position: u64,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() > self.room {
            self.refusals += 1;
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.room -= bytes.len();
        self.position += bytes.len() as u64;
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset).ok_or(io::ErrorKind::InvalidInput)?,
            SeekFrom::End(_) => return Err(io::ErrorKind::Unsupported.into()),
        };
        Ok(self.position)
    }
}

/// Records two thousand edges; every net changes at each of them.
fn record<S: Sink>(mut recording: Recording<S>) -> io::Result<S::Out> {
    let words = [alternating(0), alternating(1)];
    (0..2_000).for_each(|edge| recording.nets(Cycle(edge), &words[(edge % 2) as usize]));
    recording.finish(Cycle(2_000))
}

/// Tries many sizes of disk. A write that the disk refuses must be an error, and must not be repeated for ever.
fn tells_that_the_disk_is_full(record: impl Fn(&mut Disk) -> io::Result<()>) {
    let results = (0..1_000_000).step_by(9_973).map(|room| {
        let mut disk = Disk { room, ..Disk::default() };
        let result = record(&mut disk);
        // A buffer writes once more when it is dropped.
        assert!(disk.refusals <= 2, "{} refusals with room for {room} bytes", disk.refusals);
        assert_eq!(
            result.as_ref().map_err(io::Error::kind),
            match disk.refusals {
                0 => Ok(&()),
                _ => Err(io::ErrorKind::StorageFull),
            }
        );
        result.is_ok()
    });
    let fitted: Vec<bool> = results.collect();
    assert!(fitted.is_sorted() && !fitted[0] && fitted[fitted.len() - 1], "{fitted:?}");
}

#[test]
fn a_full_disk_is_an_error_of_the_vcd() {
    let layout = Layout::new(&wiring(), &REALS);
    tells_that_the_disk_is_full(|disk| record(Vcd::new(disk, &layout, clock())?).map(drop));
}

#[test]
fn a_full_disk_is_an_error_of_the_fst() {
    let layout = Layout::new(&wiring(), &REALS);
    tells_that_the_disk_is_full(|disk| record(Fst::new(disk, &layout, clock())?).map(drop));
}

#[test]
fn going_back_in_time_is_an_error_and_nothing_more_is_written() {
    let layout = Layout::new(&wiring(), &[]);
    let mut vcd = Vcd::new(Vec::new(), &layout, clock()).expect("memory");
    vcd.nets(Cycle(7), &alternating(0));
    vcd.nets(Cycle(6), &alternating(1));
    vcd.nets(Cycle(8), &alternating(0));
    let error = vcd.finish(Cycle(9)).expect_err("edge 6 is before edge 7");
    assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
    assert_eq!(error.to_string(), "a waveform at edge 7 cannot go back to edge 6");
}

#[test]
fn a_file_lasts_until_the_end_of_the_run_though_nothing_changes() {
    let layout = Layout::new(&wiring(), &[]);
    for (end, times) in [(0, vec![0, 20_000]), (50, vec![0, 1_000_000])] {
        let mut vcd = Vcd::new(Vec::new(), &layout, clock()).expect("memory");
        let mut fst = Fst::new(Cursor::new(Vec::new()), &layout, clock()).expect("memory");
        vcd.nets(Cycle(0), &alternating(0));
        fst.nets(Cycle(0), &alternating(0));
        let vcd = vcd.finish(Cycle(end)).expect("memory");
        let fst = fst.finish(Cycle(end)).expect("memory").into_inner();
        for file in [vcd, fst] {
            let read = read_back::waveform(file);
            let unit_ps = read_back::unit_ps(&read);
            assert!(read.time_table().iter().map(|time| time * unit_ps).eq(times.clone()), "end {end}");
        }
    }
}

#[test]
fn an_fst_of_several_sections_is_read_back_whole() {
    // 24 nets take 2 bytes or more each in memory, so 500 000 edges are well over ten sections.
    let edges = 500_000;
    let layout = Layout::new(&wiring(), &[]);
    let mut fst = Fst::new(Cursor::new(Vec::new()), &layout, clock()).expect("memory");
    let words = [alternating(0), alternating(1)];
    (0..edges).for_each(|edge| fst.nets(Cycle(edge), &words[(edge % 2) as usize]));
    let file = fst.finish(Cycle(edges)).expect("memory").into_inner();
    let mut read = read_back::waveform(file);
    let unit_ps = read_back::unit_ps(&read);
    let position = read.hierarchy().lookup_var(&["hybrid_loop"], "position").expect("a net");
    let position = read.hierarchy()[position].signal_ref();
    read.load_signals(&[position]);
    let changes = read.get_signal(position).expect("just loaded").iter_changes();
    let changes: Vec<_> =
        changes.map(|(time, word)| (read.time_table()[time as usize] * unit_ps, word.to_bit_string())).collect();
    let put = (0..edges).map(|edge| (edge * 20_000, Some(["0", "1"][(edge % 2) as usize].repeat(12))));
    assert!(changes.iter().cloned().eq(put));
}

#[test]
fn an_fst_can_be_read_from_the_middle() {
    // Each net changes at a different interval of edges; the last net never changes.
    let nets = wiring().nets();
    let bits = |net: usize, edge: u64| match edge / (net as u64 + 3) % 2 {
        1 if net + 1 < nets.len() => u64::MAX,
        _ => 0,
    };
    let values = |edge: u64| [edge as f64, -0.5];
    let edges = 200_000;
    let mut fst = Fst::new(Cursor::new(Vec::new()), &Layout::new(&wiring(), &REALS), clock()).expect("memory");
    for edge in 0..edges {
        let words: Vec<i64> = nets.iter().enumerate().map(|(n, net)| net.format.from_bits(bits(n, edge))).collect();
        fst.nets(Cycle(edge), &words);
        fst.reals(Cycle(edge), &values(edge));
    }
    let file = fst.finish(Cycle(edges)).expect("memory").into_inner();
    let mut read = fst_reader::FstReader::open(Cursor::new(file)).expect("a readable waveform");
    let signals = read.get_header().max_handle as usize;
    let mut starts = std::collections::BTreeSet::new();
    for from in (0..2 * edges).step_by(9_973) {
        // The first values that a reader receives are those of all signals at the start of the section.
        let mut stand = vec![None; signals];
        let mut start = None;
        let section = fst_reader::FstFilter::filter_time(from, from);
        let told = read.read_signals(&section, |time, signal, value| {
            if *start.get_or_insert(time) == time {
                stand[signal.get_index()].get_or_insert(match value {
                    fst_reader::FstSignalValue::String(digits) => String::from_utf8_lossy(digits).into_owned(),
                    fst_reader::FstSignalValue::Real(value) => format!("{value:?}"),
                });
            }
            Ok::<(), ()>(())
        });
        assert!(told.is_ok());
        let start = start.expect("a value");
        starts.insert(start);
        // An edge is two units. The reset is the first signal; the nets follow, and the reals are last.
        let edge = start / 2;
        for (n, net) in nets.iter().enumerate() {
            let digit = if bits(n, edge) == 0 { "0" } else { "1" };
            assert_eq!(stand[1 + n], Some(digit.repeat(net.format.width() as usize)), "{} at edge {edge}", net.name);
        }
        for (value, stand) in values(edge).iter().zip(&stand[signals - 2..]) {
            assert_eq!(*stand, Some(format!("{value:?}")), "at edge {edge}");
        }
    }
    assert!(starts.len() > 10, "{starts:?}");
}

#[test]
fn a_layout_without_the_clock_differs_in_nothing_but_the_clock() {
    let without = Layout::new(&wiring(), &REALS);
    let with = without.clone().with_clock();
    let names: Vec<String> = with.names().into_iter().filter(|name| !name.ends_with(".clk")).collect();
    assert_eq!(names, without.names());
    assert!(with.shows(Source::Clock) && !without.shows(Source::Clock) && without.shows(Source::Reset));
}

#[test]
fn ports_of_instances_share_the_code_of_their_net() {
    let wiring = wiring();
    let layout = Layout::new(&wiring, &[]);
    let file = Vcd::new(Vec::new(), &layout, clock()).and_then(|vcd| vcd.finish(Cycle(1)));
    let text = String::from_utf8(file.expect("memory")).expect("ASCII");
    let vars = text.lines().filter_map(|line| line.strip_prefix("$var reg "));
    let codes: Vec<&str> = vars.filter_map(|var| var.split(' ').nth(1)).collect();
    let signals: std::collections::BTreeSet<&str> = codes.iter().copied().collect();
    assert_eq!(codes.len(), layout.names().len());
    assert_eq!(signals.len(), wiring.nets().len() + 1, "every net, and the reset");
}
