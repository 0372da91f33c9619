//! Sets of units: the same rows whatever the threads, the interruptions and the failures.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;
use hpu_study::units::{Journal, JournalError, Row, fingerprint, run};

const COUNT: usize = 40;

fn jobs(jobs: usize) -> NonZeroUsize {
    NonZeroUsize::new(jobs).unwrap()
}

/// A unit whose row tells its index; one in seven fails.
fn unit(index: usize) -> Row {
    if index % 7 == 3 { Err(format!("unit {index} cannot")) } else { Ok(format!("{index},{}", index * index)) }
}

fn all(jobs_: usize, unit: impl Fn(usize) -> Row + Sync) -> Vec<Row> {
    let unit = |index: usize, _: &Control| Some(unit(index));
    let rows =
        run(COUNT, jobs(jobs_), BTreeMap::new(), &Control::default(), unit, |_, _| Ok::<_, Infallible>(())).unwrap();
    rows.expect("nobody stops it")
}

#[test]
fn rows_are_in_the_order_of_the_units_whatever_the_threads() {
    let expected: Vec<Row> = (0..COUNT).map(unit).collect();
    for threads in [1, 2, 3, 64] {
        // Later units are done sooner.
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
    assert_eq!(rows[5], Err("panicked: no 5 at all".to_string()));
    let others = |rows: Vec<Row>| rows.into_iter().enumerate().filter(|(index, _)| *index != 5).collect::<Vec<_>>();
    assert_eq!(others(rows), others((0..COUNT).map(unit).collect()));
}

/// Runs the set until so many rows are kept, and returns what a journal would hold.
fn interrupted(threads: usize, header: &str, stop_after: usize) -> String {
    let control = Control::default();
    let mut journal = format!("{header}\n");
    let mut kept = 0;
    let unit = |index: usize, own: &Control| {
        // Some are in the midst of it when the stop comes, and wait for it.
        if index >= stop_after {
            while !own.stop.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            return None;
        }
        Some(unit(index))
    };
    let rows = run(COUNT, jobs(threads), BTreeMap::new(), &control, unit, |index, row| {
        journal += &Journal::line(index, row);
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
    let expected: Vec<Row> = (0..COUNT).map(unit).collect();
    for (threads, stop_after) in [(1, 1), (2, 13), (3, 39)] {
        let mut text = interrupted(threads, "a set", stop_after);
        // A power cut in the midst of a line.
        text += "39 made 39,15";
        let journal = Journal::read(&text, "a set", COUNT).unwrap();
        assert_eq!(journal.rows.len(), stop_after);
        assert_eq!(journal.whole, text.len() - "39 made 39,15".len());
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

#[test]
fn a_journal_of_another_set_is_refused_and_so_is_a_line_that_is_no_row() {
    let read = |text: &str| Journal::read(text, "study 1 of a", 10).map(|journal| journal.rows.len());
    assert_eq!(read(""), Ok(0));
    assert_eq!(read("study 1 o"), Ok(0), "half of its own header");
    assert_eq!(read("study 1 of a\n"), Ok(0));
    assert_eq!(read("study 1 of a\n3 made x,y z\n4 failed no, never\n"), Ok(2));
    assert_eq!(read("study 2 of a\n"), Err(JournalError::Other("study 2 of a".into())));
    assert_eq!(read("my own notes"), Err(JournalError::Other("my own notes".into())));
    for bad in ["x made y", "3 done x", "3", "", "10 made beyond"] {
        assert_eq!(read(&format!("study 1 of a\n0 made x\n{bad}\n")), Err(JournalError::Line(3)), "{bad}");
    }
}

#[test]
fn a_row_is_one_line_and_comes_back_from_the_journal_as_it_was() {
    for row in [Ok("a,b  c ".to_string()), Ok(String::new()), Err("why, \"so\"".to_string())] {
        let text = format!("h\n{}", Journal::line(7, &row));
        assert_eq!(Journal::read(&text, "h", 8).unwrap().rows, BTreeMap::from([(7, row)]));
    }
    assert_eq!(all(1, |_| Err("two\n lines".into()))[0], Err("two lines".to_string()));
}

#[test]
fn the_fingerprint_is_fnv_1a_and_tells_parts_apart() {
    // Published values of 64-bit FNV-1a: the empty input, and one zero byte.
    assert_eq!(fingerprint([]), "cbf29ce484222325");
    assert_eq!(fingerprint([&b""[..]]), "af63bd4c8601b7df");
    assert_ne!(fingerprint([&b"ab"[..], b"c"]), fingerprint([&b"a"[..], b"bc"]));
}
