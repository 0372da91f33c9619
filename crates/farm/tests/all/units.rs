//! Sets of units: the rows do not depend on threads, interruptions or failures.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;
use hpu_farm::units::run;
use hpu_farm::{Failed, JournalError, file_fingerprint, fingerprint};

type UnitResult = hpu_farm::UnitResult<String>;
type Journal = hpu_farm::Journal<String>;

const COUNT: usize = 40;

fn jobs(jobs: usize) -> NonZeroUsize {
    NonZeroUsize::new(jobs).unwrap()
}

/// Returns a row that contains the unit's index; one unit in seven fails.
fn unit(index: usize) -> UnitResult {
    if index % 7 == 3 {
        Err(Failed::new(format!("unit {index} cannot")))
    } else {
        Ok(format!("{index},{}", index * index))
    }
}

fn all(jobs_: usize, unit: impl Fn(usize) -> UnitResult + Sync) -> Vec<UnitResult> {
    let unit = |index: usize, _: &Control| Some(unit(index));
    let rows =
        run(COUNT, jobs(jobs_), BTreeMap::new(), &Control::default(), unit, |_, _| Ok::<_, Infallible>(())).unwrap();
    rows.expect("nobody stops it")
}

#[test]
fn rows_are_in_the_order_of_the_units_whatever_the_threads() {
    let expected: Vec<UnitResult> = (0..COUNT).map(unit).collect();
    for threads in [1, 2, 3, 64] {
        // Later units finish sooner.
        let slow = |index: usize| {
            thread::sleep(Duration::from_micros(100 * (COUNT - index) as u64));
            unit(index)
        };
        assert_eq!(all(threads, slow), expected, "{threads} threads");
    }
}

#[test]
fn a_unit_that_panics_is_a_row_with_what_it_said_and_the_others_are_done() {
    let rows = all(2, |index| {
        assert!(index != 5, "no {index}\nat all");
        unit(index)
    });
    assert_eq!(rows[5], Err(Failed::new("panicked: no 5 at all")));
    let others =
        |rows: Vec<UnitResult>| rows.into_iter().enumerate().filter(|(index, _)| *index != 5).collect::<Vec<_>>();
    assert_eq!(others(rows), others((0..COUNT).map(unit).collect()));
}

/// Runs the set until so many rows are kept, and returns what a journal would hold.
fn interrupted(threads: usize, header: &str, stop_after: usize) -> String {
    let control = Control::default();
    let mut journal = Journal::head(header);
    let mut kept = 0;
    let unit = |index: usize, own: &Control| {
        // Some units are running when the stop comes, and wait for it.
        if index >= stop_after {
            while !own.stop.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            return None;
        }
        Some(unit(index))
    };
    let rows = run(COUNT, jobs(threads), BTreeMap::new(), &control, unit, |index, row| {
        journal += &Journal::line(header, index, row);
        kept += 1;
        if kept == stop_after {
            control.stop.store(true, Ordering::Relaxed);
        }
        Ok::<_, Infallible>(())
    });
    assert_eq!(rows.unwrap(), None, "a set that was stopped has no result");
    assert_eq!(control.progress.load(Ordering::Relaxed), stop_after as u64);
    journal
}

#[test]
fn a_set_that_goes_on_equals_one_that_was_never_interrupted_and_does_no_unit_twice() {
    let expected: Vec<UnitResult> = (0..COUNT).map(unit).collect();
    for (threads, stop_after) in [(1, 1), (2, 13), (3, 39)] {
        let mut text = interrupted(threads, "a set", stop_after);
        // A power cut in the middle of a line.
        text += "39 {39,15";
        let journal = Journal::read(text.as_bytes(), "a set", COUNT).unwrap();
        assert_eq!((journal.rows.len(), journal.damaged), (stop_after, 1));
        let again = Mutex::new(Vec::new());
        let unit = |index: usize, _: &Control| {
            again.lock().unwrap().push(index);
            Some(unit(index))
        };
        let done = journal.rows.clone();
        let rows = run(COUNT, jobs(threads), done, &Control::default(), unit, |_, _| Ok::<_, Infallible>(())).unwrap();
        assert_eq!(rows, Some(expected.clone()));
        let mut again = again.into_inner().unwrap();
        again.sort_unstable();
        let left: Vec<usize> = (0..COUNT).filter(|index| !journal.rows.contains_key(index)).collect();
        assert_eq!(again, left);
    }
}

#[test]
fn a_row_that_cannot_be_kept_ends_the_set_with_that_error() {
    let begun = AtomicUsize::new(0);
    let unit = |index: usize, _: &Control| {
        begun.fetch_add(1, Ordering::Relaxed);
        thread::sleep(Duration::from_millis(5));
        Some(unit(index))
    };
    let mut kept = 0;
    let rows = run(COUNT, jobs(2), BTreeMap::new(), &Control::default(), unit, |_, _| {
        kept += 1;
        if kept == 3 { Err("the disk is full") } else { Ok(()) }
    });
    assert_eq!(rows, Err("the disk is full"));
    assert_eq!(kept, 3, "nothing more is kept");
    assert!(begun.load(Ordering::Relaxed) < COUNT, "the rest is not begun");
}

const NAME: &str = "study 1 of a";

fn read(bytes: &[u8]) -> Result<(BTreeMap<usize, UnitResult>, usize), JournalError> {
    Journal::read(bytes, NAME, 10).map(|journal| (journal.rows, journal.damaged))
}

/// Returns a journal of three rows: its bytes, its rows, and where each row begins and ends.
fn small() -> (Vec<u8>, BTreeMap<usize, UnitResult>, Vec<std::ops::Range<usize>>) {
    let rows = BTreeMap::from([
        (0, Ok("settled,1.5e-3,,0e0,7500000".to_string())),
        (3, Err(Failed::new("no, \"never\""))),
        (9, Ok(String::new())),
    ]);
    let mut text = Journal::head(NAME);
    let mut places = Vec::new();
    for (index, row) in &rows {
        let line = Journal::line(NAME, *index, row);
        places.push(text.len()..text.len() + line.len());
        text += &line;
    }
    (text.into_bytes(), rows, places)
}

/// Returns the rows except the one whose place holds this byte.
fn without(byte: usize) -> BTreeMap<usize, UnitResult> {
    let (_, rows, places) = small();
    rows.into_iter().zip(places).filter(|(_, place)| !place.contains(&byte)).map(|(row, _)| row).collect()
}

#[test]
fn a_journal_of_another_set_or_of_an_older_program_is_refused() {
    let of = |text: &str| read(text.as_bytes()).map(|(rows, _)| rows.len());
    assert_eq!(of(""), Ok(0));
    for length in 0..Journal::head(NAME).len() {
        assert_eq!(of(&Journal::head(NAME)[..length]), Ok(0), "the beginning of its own first line");
    }
    assert_eq!(of(&Journal::head("study 2 of a")), Err(JournalError::Other("study 2 of a".into())));
    assert_eq!(of("my own notes"), Err(JournalError::Other("my own notes".into())));
    let old = "map 0123456789abcdef of hpu map hybrid-wall\n0 made settled\n";
    assert_eq!(of(old), Err(JournalError::Old));
    assert_eq!(of(&Journal::head(NAME).replacen("journal 3", "journal 2", 1)), Err(JournalError::Old));
    assert!(JournalError::Old.to_string().contains("older program"));
}

#[test]
fn every_bit_that_flips_in_a_row_costs_that_row_and_no_other() {
    let (whole, rows, places) = small();
    assert_eq!(read(&whole), Ok((rows, 0)));
    for bit in 8 * places[0].start..8 * whole.len() {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let (found, damaged) = read(&bytes).expect("its own first line");
        // If a line's end is damaged, the next row is lost with it.
        let (here, end) = (bit / 8, places.iter().position(|place| place.end == bit / 8 + 1));
        let mut expected = without(here);
        if let Some(next) = end.and_then(|end| places.get(end + 1)) {
            expected.retain(|index, _| without(next.start).contains_key(index));
        }
        assert_eq!(found, expected, "bit {bit}");
        assert!((1..=2).contains(&damaged), "bit {bit}: {damaged}");
    }
    for bit in 0..8 * places[0].start {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&bytes).is_err(), "bit {bit} of the first line");
    }
}

#[test]
fn every_digit_that_is_another_costs_its_row() {
    let (whole, _, places) = small();
    for at in (places[0].start..whole.len()).filter(|at| whole[*at].is_ascii_digit()) {
        for digit in (b'0'..=b'9').filter(|digit| *digit != whole[at]) {
            let mut bytes = whole.clone();
            bytes[at] = digit;
            assert_eq!(read(&bytes), Ok((without(at), 1)), "byte {at} as {}", digit as char);
        }
    }
}

#[test]
fn a_journal_that_is_cut_off_anywhere_has_the_rows_before_the_cut() {
    let (whole, rows, places) = small();
    for length in places[0].start..whole.len() {
        let before: BTreeMap<_, _> = rows
            .clone()
            .into_iter()
            .zip(&places)
            .filter(|(_, place)| place.end <= length)
            .map(|(row, _)| row)
            .collect();
        let cut = usize::from(!places.iter().any(|place| place.start == length));
        assert_eq!(read(&whole[..length]), Ok((before, cut)), "{length} bytes");
    }
    // Zeros, as some file systems leave after a power cut.
    let (mut zeros, last) = (whole.clone(), places[2].clone());
    zeros[last.clone()].fill(0);
    assert_eq!(read(&zeros), Ok((without(last.start), 1)));
}

#[test]
fn rows_that_are_there_twice_count_once_and_rows_of_other_sets_never() {
    let (whole, rows, places) = small();
    let with = |line: &str| read(&[&whole, line.as_bytes()].concat()).expect("its own first line");
    assert_eq!(with(std::str::from_utf8(&whole[places[0].clone()]).unwrap()), (rows.clone(), 0));
    // Two different rows of the same unit: neither is used, nor is a third.
    let mut others = rows.clone();
    others.remove(&3);
    let other = Journal::line(NAME, 3, &Ok("settled".into()));
    assert_eq!(with(&other), (others.clone(), 2));
    assert_eq!(with(&format!("{other}{other}")), (others, 3));
    for foreign in [
        Journal::line("study 2 of a", 5, &Ok("settled".into())),
        Journal::line(NAME, 10, &Ok("beyond".into())),
        "5 made settled\n".into(),
        "\n".into(),
        "notes\n".into(),
        "\u{fffd}".into(),
    ] {
        assert_eq!(with(&foreign), (rows.clone(), 1), "{foreign:?}");
    }
    assert_eq!(read(&[&whole[..], &[0xff, 0xfe, b'\n']].concat()), Ok((rows, 1)), "no text");
}

#[test]
fn a_row_is_one_line_and_comes_back_from_the_journal_as_it_was() {
    for row in [Ok("a,b  c ".to_string()), Ok(String::new()), Err(Failed::new("why, \"so\""))] {
        let text = Journal::head("h") + &Journal::line("h", 7, &row);
        assert_eq!(Journal::read(text.as_bytes(), "h", 8).unwrap().rows, BTreeMap::from([(7, row)]));
    }
    assert_eq!(all(1, |_| Err(Failed::new("two\n lines")))[0], Err(Failed::new("two lines")));
}

#[test]
fn the_fingerprint_is_fnv_1a_and_tells_parts_apart() {
    // Published values of 64-bit FNV-1a: the empty input, and one zero byte.
    assert_eq!(fingerprint([]), "cbf29ce484222325");
    assert_eq!(fingerprint([&b""[..]]), "af63bd4c8601b7df");
    assert_ne!(fingerprint([&b"ab"[..], b"c"]), fingerprint([&b"a"[..], b"bc"]));
}

#[test]
fn the_fingerprint_of_a_file_is_what_xxh128sum_prints() {
    let path = std::env::temp_dir().join(format!("hpu-fingerprint-{}", std::process::id()));
    let printed = |bytes: Vec<u8>| {
        std::fs::write(&path, bytes).expect("a file");
        file_fingerprint(&path).expect("a fingerprint")
    };
    // By xxh128sum 0.8.1 of the same bytes, written by Python: nothing, and more than is read at a time.
    assert_eq!(printed(Vec::new()), "99aa06d3014798d86001c324468d497f");
    let many = (0..200_001_u64).map(|i| ((i * i / 7 + i) % 251) as u8).collect();
    assert_eq!(printed(many), "cabc9bfb699b5f05d04643ff43abe46a");
    std::fs::remove_file(&path).expect("the file goes");
}
