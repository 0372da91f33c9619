//! Many independent runs: units of work, spread over threads. Rows come in the order of the units, whatever the threads
//! do.
//!
//! A unit is a pure function of its number (and of what the study's header names). Its result is a row of text, or the
//! reason why there is none; a panic is such a reason too. Each row is handed over as soon as it is finished, to be
//! kept. An interrupted set is given the rows that it already has, and does the rest.

use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;

/// The result of a unit: one line of text, or the reason, in one line, why there is none.
pub type UnitResult = Result<String, String>;

/// Runs those of the units `0..count` that are not done yet, and returns the rows of all units in their order, or
/// `None` when stopped.
///
/// Works like [`run_some`]; every new row also goes through `keep`.
///
/// # Errors
///
/// Returns the error of `keep`; the other units are stopped then.
pub fn run<E>(
    count: usize,
    jobs: NonZeroUsize,
    mut done: BTreeMap<usize, UnitResult>,
    control: &Control,
    unit: impl Fn(usize, &Control) -> Option<UnitResult> + Sync,
    mut keep: impl FnMut(usize, &UnitResult) -> Result<(), E>,
) -> Result<Option<Vec<UnitResult>>, E> {
    let left: Vec<usize> = (0..count).filter(|index| !done.contains_key(index)).collect();
    run_some(&left, jobs, control, unit, |index, row| {
        keep(index, &row)?;
        done.insert(index, row);
        Ok(())
    })?;
    Ok((0..count).map(|index| done.remove(&index)).collect())
}

/// Runs these units, and hands their rows to `take` in the order in which they finish. When stopped, some rows are
/// missing. No row is kept here.
///
/// `control` stops the set, and counts the finished units as progress. Each thread gets a control of its own. A unit
/// returns `None` if it was stopped, or if it is to be run another time.
///
/// # Errors
///
/// Returns the error of `take`; the other units are stopped then.
pub fn run_some<E>(
    wanted: &[usize],
    jobs: NonZeroUsize,
    control: &Control,
    unit: impl Fn(usize, &Control) -> Option<UnitResult> + Sync,
    mut take: impl FnMut(usize, UnitResult) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let own: Vec<Control> = (0..jobs.get().min(wanted.len())).map(|_| Control::default()).collect();
    let stop = || own.iter().for_each(|control| control.stop.store(true, Ordering::Relaxed));
    let (send, rows) = mpsc::channel::<(usize, UnitResult)>();
    let failed = thread::scope(|scope| {
        for control in &own {
            let (send, next, unit) = (send.clone(), &next, &unit);
            scope.spawn(move || {
                while !control.stop.load(Ordering::Relaxed)
                    && let Some(&index) = wanted.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let made = catch_unwind(AssertUnwindSafe(|| unit(index, control)));
                    // A unit that was stopped, or that declined to run, has no row.
                    let Some(row) = made.unwrap_or_else(|panic| Some(Err(reason(panic.as_ref())))) else { continue };
                    // The receiver is gone only after an error of `take`, which is returned there.
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

/// Does jobs in their order, on so many threads. Returns `None` for the jobs that had not begun when `control` stopped
/// them.
pub fn on_threads<T: Send>(
    count: usize,
    jobs: NonZeroUsize,
    control: &Control,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<Option<T>> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::from_iter((0..count).map(|_| None))));
    let worker = || {
        while !control.stop.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            let done = work(index);
            found.lock().expect("no worker panics with it")[index] = Some(done);
        }
    };
    thread::scope(|scope| {
        for _ in 0..jobs.get().min(count) {
            scope.spawn(worker);
        }
    });
    found.into_inner().expect("no worker panics with it")
}

/// Beginning of a journal's first line; the number is the version of the format.
const FORMAT: &str = "journal 2: ";

/// The journal of a set. Line 1 names the set. Each other line is a row: a checksum over the set's name and the rest of
/// the line, the unit's number, and the unit's result. A row with a wrong checksum is ignored, and its unit is run
/// again.
#[derive(Clone, PartialEq, Debug)]
pub struct Journal {
    /// The intact rows.
    pub rows: BTreeMap<usize, UnitResult>,
    /// Number of damaged rows: changed, cut off, of another set, or two different rows of the same unit.
    pub damaged: usize,
}

/// Why a journal cannot be continued.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum JournalError {
    /// The journal belongs to another set, whose header this is.
    Other(String),
    /// The journal has the first format, whose rows have no checksums.
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
    /// Reads a journal of the set with this header. A journal that is empty, or holds only the beginning of line 1, has
    /// no rows.
    ///
    /// # Errors
    ///
    /// Returns a [`JournalError`] if line 1 is not that of this set.
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

    /// Returns line 1 of the journal of the set with this header.
    pub fn head(header: &str) -> String {
        format!("{FORMAT}{header}\n")
    }

    /// Returns a row's line in the journal of the set with this header.
    pub fn line(header: &str, index: usize, row: &UnitResult) -> String {
        let said = match row {
            Ok(row) => format!("{index} made {row}"),
            Err(reason) => format!("{index} failed {reason}"),
        };
        format!("{} {said}\n", checksum(header, &said))
    }
}

/// Whether this is line 1 of a journal of the first format: a kind, a fingerprint, and the command.
fn is_old(line: &str) -> bool {
    let mut words = line.split(' ').skip(1);
    let print = words.next().unwrap_or_default();
    print.len() == 16 && print.bytes().all(|byte| byte.is_ascii_hexdigit()) && words.next() == Some("of")
}

/// Returns the FNV-1a hash. Each step of FNV-1a is a bijection, so changing a single byte always changes the hash.
fn checksum(header: &str, said: &str) -> String {
    fingerprint([header.as_bytes(), said.as_bytes()])
}

fn row(header: &str, line: &str) -> Option<(usize, UnitResult)> {
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

/// Returns a name for everything that a set's rows depend on: 64-bit FNV-1a over the parts, each ended by a zero.
pub fn fingerprint<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let bytes = parts.into_iter().flat_map(|part| part.iter().copied().chain([0]));
    let hash =
        bytes.fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
