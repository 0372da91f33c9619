//! Recorded input: encoder lines from a logic analyser or a simulator, and motions from a table.
//!
//! [`read_capture`] takes lines from VCD (of simulators, also GHDL's and extended VCD), FST, and tables (CSV of Saleae
//! Logic, PulseView and sigrok). [`read_motion`] takes times and positions from a table with any of the usual
//! separators, units and additional columns.

mod capture;
mod channel;
mod columns;
mod counter;
mod decode;
#[cfg(not(target_family = "wasm"))]
mod fst;
mod logic_table;
mod motion;
mod smooth;
mod table;
mod units;
mod vcd;

use std::fmt;

pub use capture::read_capture;
pub use channel::Capture;
pub use columns::Columns;
pub use motion::{Motion, read_motion};
pub use units::Unit;

pub(crate) use smooth::smooth;

/// The levels of the two encoder lines from a time on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PinEdge {
    /// Time in picoseconds since the capture's zero, rounded down.
    pub picoseconds: i64,
    /// Level of line A.
    pub a: bool,
    /// Level of line B.
    pub b: bool,
}

/// A recording that a scene names.
#[derive(Clone, PartialEq, Debug)]
pub struct Recording {
    /// The name of its file.
    pub file: String,
    /// Columns, span and rows that the reader took.
    pub taken: Taken,
}

/// The part of a recording that the reader took.
#[derive(Clone, PartialEq, Debug)]
pub struct Taken {
    /// The columns, with the units by which they were read, or the channels.
    pub columns: Vec<String>,
    /// The first and the last time, in s.
    pub span_s: [f64; 2],
    /// The number of rows, or of changes.
    pub rows: usize,
    /// Notes on values that the reader took otherwise than they are written.
    pub notes: Vec<String>,
}

/// The reason why a recording was refused, and the line of the recording.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ReplayError {
    /// Line of the recording, from 1; 0 for a file without lines.
    pub line: u64,
    /// The fault there, and what is accepted.
    pub reason: String,
}

impl ReplayError {
    pub(crate) fn new(line: u64, reason: impl Into<String>) -> Self {
        Self { line, reason: reason.into() }
    }
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.line {
            0 => write!(f, " {}", self.reason),
            line => write!(f, "{line}: {}", self.reason),
        }
    }
}

impl std::error::Error for ReplayError {}

/// The reason for doubting a file whose last line has no line feed.
pub const CUT: &str = "the last line has no line feed, so the file may be cut short";
