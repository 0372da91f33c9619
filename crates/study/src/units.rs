//! Many independent runs: units of work, spread over threads, in the order of the units whatever the threads.
//!
//! A unit is a pure function of its number (and of what the study's header names). What it made is a row of text, or the
//! reason why there is none; a panic is such a reason too. Rows are handed over as they are finished, to be kept; a set that
//! was interrupted is given the rows it has and does the rest.

use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;

/// What a unit made: one line, or in one line why it could not.
pub type Row = Result<String, String>;

/// Does the units `0..count` that are not done yet, and returns the rows of all in their order, or `None` when stopped.
///
/// As [`run_some`]; every new row goes through `keep`.
///
/// # Errors
///
/// What `keep` says; the other units are stopped then.
pub fn run<E>(
    count: usize,
    jobs: NonZeroUsize,
    mut done: BTreeMap<usize, Row>,
    control: &Control,
    unit: impl Fn(usize, &Control) -> Option<Row> + Sync,
    mut keep: impl FnMut(usize, &Row) -> Result<(), E>,
) -> Result<Option<Vec<Row>>, E> {
    let left: Vec<usize> = (0..count).filter(|index| !done.contains_key(index)).collect();
    run_some(&left, jobs, control, unit, |index, row| {
        keep(index, &row)?;
        done.insert(index, row);
        Ok(())
    })?;
    Ok((0..count).map(|index| done.remove(&index)).collect())
}

/// Does these units, and hands their rows to `take` in the order in which they come; when stopped, some do not come. No row
/// is kept here.
///
/// `control` stops the set, and counts the units done here as progress. Each thread gets a control of its own; a unit that
/// was stopped returns `None`.
///
/// # Errors
///
/// What `take` says; the other units are stopped then.
pub fn run_some<E>(
    wanted: &[usize],
    jobs: NonZeroUsize,
    control: &Control,
    unit: impl Fn(usize, &Control) -> Option<Row> + Sync,
    mut take: impl FnMut(usize, Row) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let own: Vec<Control> = (0..jobs.get().min(wanted.len())).map(|_| Control::default()).collect();
    let stop = || own.iter().for_each(|control| control.stop.store(true, Ordering::Relaxed));
    let (send, rows) = mpsc::channel::<(usize, Row)>();
    let failed = thread::scope(|scope| {
        for control in &own {
            let (send, next, unit) = (send.clone(), &next, &unit);
            scope.spawn(move || {
                while !control.stop.load(Ordering::Relaxed)
                    && let Some(&index) = wanted.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let made = catch_unwind(AssertUnwindSafe(|| unit(index, control)));
                    let Some(row) = made.unwrap_or_else(|panic| Some(Err(reason(panic.as_ref())))) else { break };
                    // Who listens no more has failed, and says so.
                    let _ = send.send((index, row.map(one_line).map_err(one_line)));
                }
            });
        }
        drop(send);
        loop {
            match rows.recv_timeout(Duration::from_millis(50)) {
                Ok((index, row)) => {
                    if let Err(error) = take(index, row) {
                        stop();
                        return Some(error);
                    }
                    control.progress.fetch_add(1, Ordering::Relaxed);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
            if control.stop.load(Ordering::Relaxed) {
                stop();
            }
        }
    });
    failed.map_or(Ok(()), Err)
}

fn reason(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    format!("panicked: {}", text.unwrap_or("without a word"))
}

fn one_line(text: String) -> String {
    if text.contains(['\n', '\r']) { text.split_whitespace().collect::<Vec<_>>().join(" ") } else { text }
}

/// The journal of a set: line 1 names the set, every other is a unit's row; a last line without its end does not count.
#[derive(Clone, PartialEq, Debug)]
pub struct Journal {
    /// The rows that are there.
    pub rows: BTreeMap<usize, Row>,
    /// Bytes up to the end of the last whole line.
    pub whole: usize,
}

/// Why a journal cannot be gone on with.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum JournalError {
    /// It is that of another set, named so.
    Other(String),
    /// This line, counted from 1, is none of a unit.
    Line(usize),
}

impl fmt::Display for JournalError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Other(header) => write!(f, "holds another study: {header}"),
            Self::Line(line) => write!(f, "line {line} is none of a unit"),
        }
    }
}

impl std::error::Error for JournalError {}

impl Journal {
    /// Reads a journal of the set with this header; an empty one, or half of a header, has no rows.
    ///
    /// # Errors
    ///
    /// [`JournalError`] when the header is another, or a whole line is no row.
    pub fn read(text: &str, header: &str, count: usize) -> Result<Self, JournalError> {
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines();
        match lines.next() {
            Some(first) if first != header => return Err(JournalError::Other(first.to_string())),
            None if !header.starts_with(text) => return Err(JournalError::Other(text.to_string())),
            _ => {}
        }
        let rows = lines
            .enumerate()
            .map(|(line, text)| row(text).filter(|(index, _)| *index < count).ok_or(JournalError::Line(line + 2)));
        Ok(Self { rows: rows.collect::<Result<_, _>>()?, whole })
    }

    /// A row as its line.
    #[must_use]
    pub fn line(index: usize, row: &Row) -> String {
        match row {
            Ok(row) => format!("{index} made {row}\n"),
            Err(reason) => format!("{index} failed {reason}\n"),
        }
    }
}

fn row(line: &str) -> Option<(usize, Row)> {
    let (index, rest) = line.split_once(' ')?;
    let index = index.parse().ok()?;
    match rest.split_once(' ')? {
        ("made", row) => Some((index, Ok(row.to_string()))),
        ("failed", reason) => Some((index, Err(reason.to_string()))),
        _ => None,
    }
}

/// A name for everything that a set's rows depend on: 64-bit FNV-1a over the parts, each ended by a zero.
#[must_use]
pub fn fingerprint<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let bytes = parts.into_iter().flat_map(|part| part.iter().copied().chain([0]));
    let hash =
        bytes.fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
