//! The waveform files of a run.

use std::io;

use hpu_cosim::Rig;
use hpu_rtl::Around;
use hpu_rtl::wave::{Layout, WaveFile, fst_aside, gtkw, mismatch_gtkw, mismatch_vcd, vcd_aside};
use hpu_signal::{Cycle, Observe};

use crate::exit::Failure;
use crate::files::Folder;

const FST: &str = "wave.fst";
const VCD: &str = "wave.vcd";

/// Writes a VCD of the rows around a mismatch and its GTKWave save file, under this name; the line that tells where
/// they are, or of what there would be a waveform.
pub fn waveform(around: &Around, number: u64, name: &str, folder: Option<&mut Folder>) -> Result<String, Failure> {
    let [Some(first), Some(last)] = [around.rows.first(), around.rows.last()] else { return Ok(String::new()) };
    let rows = format!("{}s {} to {}", around.counted, first.number, last.number);
    let Some(folder) = folder else { return Ok(format!("    -o DIR writes a waveform of {rows}\n")) };
    let vcd = format!("{name}.vcd");
    let save = format!("{vcd}.gtkw");
    folder.write(&vcd, mismatch_vcd(around))?;
    folder.write(&save, mismatch_gtkw(around, number, &vcd))?;
    Ok(format!("    waveform of {rows}: gtkwave {}\n", folder.place(&save).display()))
}

/// Writes an FST, and a VCD when asked, each with its GTKWave save file, while it watches a run: each file on a thread
/// of its own.
pub struct Waves {
    fst: Box<dyn WaveFile>,
    vcd: Option<Box<dyn WaveFile>>,
}

impl Waves {
    /// Begins the files.
    pub fn begin(session: &impl Rig, folder: &mut Folder, with_vcd: bool) -> Result<Self, Failure> {
        let clock = session.clock();
        let layout = layout(session);
        let save = |dump: &str| gtkw(&layout, dump, clock, Cycle(0)..Cycle(session.edges()));
        folder.write("wave.fst.gtkw", save(FST))?;
        let fst_file = folder.create(FST)?;
        let fst = fst_aside(fst_file, &layout, clock).map_err(failed(folder, FST))?;
        let vcd = if with_vcd {
            folder.write("wave.vcd.gtkw", save(VCD))?;
            let vcd_file = folder.create(VCD)?;
            Some(vcd_aside(vcd_file, &layout, clock).map_err(failed(folder, VCD))?)
        } else {
            None
        };
        Ok(Self { fst, vcd })
    }

    /// Completes the files.
    pub fn finish(self, folder: &Folder, end: Cycle) -> Result<(), Failure> {
        self.fst.complete(end).map_err(failed(folder, FST))?;
        self.vcd.map_or(Ok(()), |vcd| vcd.complete(end).map_err(failed(folder, VCD)))
    }
}

fn failed(folder: &Folder, name: &str) -> impl FnOnce(io::Error) -> Failure {
    let place = folder.place(name);
    move |error| Failure::at(&place, error)
}

fn layout(session: &impl Rig) -> Layout {
    let layout = Layout::of(session);
    if session.record().clock { layout.with_clock() } else { layout }
}

impl Observe for Waves {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.fst.nets(cycle, words);
        if let Some(vcd) = &mut self.vcd {
            vcd.nets(cycle, words);
        }
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.fst.reals(cycle, values);
        if let Some(vcd) = &mut self.vcd {
            vcd.reals(cycle, values);
        }
    }
}
