//! Many independent runs: units of work, spread over threads, in the order of the units whatever the threads.
//!
//! A unit is a pure function of its number (and of what the study's header names). What it made is a row of text, or
//! the reason why there is none; a panic is such a reason too. Rows are handed over as they are finished, to be kept; a
//! set that was interrupted is given the rows it has and does the rest.

use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};
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

/// Does these units, and hands their rows to `take` in the order in which they come; when stopped, some do not come. No
/// row is kept here.
///
/// `control` stops the set, and counts the units done here as progress. Each thread gets a control of its own; a unit
/// that was stopped, or that is to be done another time, returns `None`.
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
                    // One that was not done, because it was stopped or for a reason of its own, has no row.
                    let Some(row) = made.unwrap_or_else(|panic| Some(Err(reason(panic.as_ref())))) else { continue };
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

/// How the first line of a journal begins; the number is that of its format.
const FORMAT: &str = "journal 2: ";

/// The journal of a set. Line 1 names the set. Each other line is a row: a checksum over the set's name and the rest of
/// the line, the unit's number, and what it made. A row whose checksum does not hold is not believed: its unit is to be
/// run again.
#[derive(Clone, PartialEq, Debug)]
pub struct Journal {
    /// The rows that are whole.
    pub rows: BTreeMap<usize, Row>,
    /// How many rows are not: changed, cut off, of another set, or two different ones of the same unit.
    pub damaged: usize,
}

/// Why a journal cannot be gone on with.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum JournalError {
    /// It is that of another set, named so.
    Other(String),
    /// It is of the first format, whose rows have no checksums.
    Old,
}

impl fmt::Display for JournalError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Other(header) => write!(f, "holds another study: {header}"),
            Self::Old => f.write_str("is a journal of an older program, whose rows have no checksums"),
        }
    }
}

impl std::error::Error for JournalError {}

impl Journal {
    /// Reads a journal of the set with this header. An empty journal, or one with only the beginning of line 1, has no
    /// rows.
    ///
    /// # Errors
    ///
    /// [`JournalError`] when line 1 is another.
    pub fn read(bytes: &[u8], header: &str, count: usize) -> Result<Self, JournalError> {
        let mut journal = Self { rows: BTreeMap::new(), damaged: 0 };
        let head = Self::head(header);
        if head.as_bytes().starts_with(bytes) {
            return Ok(journal);
        }
        let Some(rest) = bytes.strip_prefix(head.as_bytes()) else {
            let end = bytes.iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len());
            let first = String::from_utf8_lossy(&bytes[..end]);
            return Err(if is_old(&first) {
                JournalError::Old
            } else {
                JournalError::Other(first.strip_prefix(FORMAT).unwrap_or(&first).to_string())
            });
        };
        let mut disputed: BTreeSet<usize> = BTreeSet::new();
        for line in rest.split_inclusive(|byte| *byte == b'\n') {
            let found = line.strip_suffix(b"\n").and_then(|line| str::from_utf8(line).ok());
            match found.and_then(|line| row(header, line)).filter(|(index, _)| *index < count) {
                Some((index, _)) if disputed.contains(&index) => journal.damaged += 1,
                Some((index, row)) => match journal.rows.get(&index) {
                    Some(known) if *known != row => {
                        disputed.insert(index);
                        journal.rows.remove(&index);
                        journal.damaged += 2;
                    }
                    _ => drop(journal.rows.insert(index, row)),
                },
                None => journal.damaged += 1,
            }
        }
        Ok(journal)
    }

    /// Line 1 of the journal of the set with this header.
    #[must_use]
    pub fn head(header: &str) -> String {
        format!("{FORMAT}{header}\n")
    }

    /// A row as its line in the journal of the set with this header.
    #[must_use]
    pub fn line(header: &str, index: usize, row: &Row) -> String {
        let said = match row {
            Ok(row) => format!("{index} made {row}"),
            Err(reason) => format!("{index} failed {reason}"),
        };
        format!("{} {said}\n", checksum(header, &said))
    }
}

/// Whether this is line 1 of the first format: a kind, a fingerprint, and the command.
fn is_old(line: &str) -> bool {
    let mut words = line.split(' ').skip(1);
    let print = words.next().unwrap_or_default();
    print.len() == 16 && print.bytes().all(|byte| byte.is_ascii_hexdigit()) && words.next() == Some("of")
}

/// FNV-1a: each of its steps is a bijection, so that no change of a single byte leaves it as it was.
fn checksum(header: &str, said: &str) -> String {
    fingerprint([header.as_bytes(), said.as_bytes()])
}

fn row(header: &str, line: &str) -> Option<(usize, Row)> {
    let (sum, said) = line.split_once(' ')?;
    if sum != checksum(header, said) {
        return None;
    }
    let (index, rest) = said.split_once(' ')?;
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
