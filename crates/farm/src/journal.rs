//! The journal of a set of units: its rows, kept as they are finished.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::row::UnitResult;

/// Beginning of a journal's first line; the number is the version of the format.
const FORMAT: &str = "journal 3: ";

/// The journal of a set. Line 1 names the set. Each other line is a row: a checksum over the set's name and the rest of
/// the line, which is JSON: the unit's number and its result. A row with a wrong checksum is ignored, and its unit is
/// run again.
#[derive(Clone, PartialEq, Debug)]
pub struct Journal<T> {
    /// The intact rows.
    pub rows: BTreeMap<usize, UnitResult<T>>,
    /// Number of damaged rows: changed, cut off, of another set, or two different rows of the same unit.
    pub damaged: usize,
}

/// Why a journal cannot be continued.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum JournalError {
    /// The journal belongs to another set, whose header this is.
    Other(String),
    /// The journal has the format of an older program.
    Old,
}

impl fmt::Display for JournalError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Other(header) => write!(f, "holds another study: {header}"),
            Self::Old => f.write_str("is a journal of an older program, whose rows this one cannot read"),
        }
    }
}

impl std::error::Error for JournalError {}

impl<T: Serialize + DeserializeOwned + PartialEq> Journal<T> {
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
    ///
    /// # Panics
    ///
    /// Panics if a row has maps whose keys are no texts.
    pub fn line(header: &str, index: usize, row: &UnitResult<T>) -> String {
        let row = serde_json::to_string(&(index, row)).expect("a row is JSON");
        format!("{} {row}\n", checksum(header, &row))
    }
}

/// Whether this is line 1 of a journal of an older format: of the second one, or of the first, which had a kind, a
/// fingerprint, and the command.
fn is_old(line: &str) -> bool {
    let mut words = line.split(' ').skip(1);
    let print = words.next().unwrap_or_default();
    let is_first = print.len() == 16 && print.bytes().all(|byte| byte.is_ascii_hexdigit());
    line.starts_with("journal 2: ") || is_first && words.next() == Some("of")
}

/// Returns the FNV-1a hash. Each step of FNV-1a is a bijection, so changing a single byte always changes the hash.
fn checksum(header: &str, row: &str) -> String {
    fingerprint([header.as_bytes(), row.as_bytes()])
}

fn row<T: DeserializeOwned>(header: &str, line: &str) -> Option<(usize, UnitResult<T>)> {
    let (sum, row) = line.split_once(' ')?;
    (sum == checksum(header, row)).then(|| serde_json::from_str(row).ok())?
}

/// Returns a name for everything that a set's rows depend on: 64-bit FNV-1a over the parts, each ended by a zero.
pub fn fingerprint<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let bytes = parts.into_iter().flat_map(|part| part.iter().copied().chain([0]));
    let hash =
        bytes.fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
