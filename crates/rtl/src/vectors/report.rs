//! The result of a check, and the reading of a testbench's output.

use std::fmt;

use hpu_wave::Around;

use crate::vectors::around;
use crate::vectors::coverage::Coverage;
use crate::vectors::late::Late;

/// The first row, or the first edge of a closed loop, in which VHDL and emulator disagree.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Mismatch {
    /// Row of the vectors, or edge of a closed loop, counted from 1.
    pub row: u64,
    /// Name of the signal.
    pub signal: String,
    /// The emulator's word, in bits and in value.
    pub expected: String,
    /// The VHDL's word, in bits and in value.
    pub got: String,
    /// The rows around it.
    pub around: Around,
}

/// Contact in a comparison of a closed loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Contact {
    /// The place where the comparison began, and whether the scene reaches the wall at all.
    pub late: Late,
    /// Compared edges at which the datapath saw the wall.
    pub edges: u64,
}

impl Contact {
    /// Returns whether the comparison had to contain contact but did not.
    fn is_missing(&self) -> bool {
        self.late.reached.is_some() && self.late.is_long && self.edges == 0
    }
}

/// The result for one configuration of one block.
#[derive(Clone, PartialEq, Debug)]
pub struct CheckRow {
    /// Name of the block.
    pub block: String,
    /// Label of the configuration.
    pub variant: String,
    /// Rows compared.
    pub vectors: u64,
    /// Clock edges among them; 0 for combinational logic.
    pub edges: u64,
    /// Words that differ.
    pub mismatches: u64,
    /// The first word that differs.
    pub first: Option<Mismatch>,
    /// The contact in a loop that is compared from shortly before the wall.
    pub contact: Option<Contact>,
    /// The rows by their kind, and the bits that moved in them.
    pub coverage: Coverage,
    /// GHDL's message when the run gave no result, or the reason why the result is not enough.
    pub failure: Option<String>,
    /// Seconds taken.
    pub seconds: f64,
}

impl CheckRow {
    /// Returns a row in which nothing is compared yet.
    pub(crate) fn new(block: &str, variant: &str) -> Self {
        Self {
            block: block.to_string(),
            variant: variant.to_string(),
            vectors: 0,
            edges: 0,
            mismatches: 0,
            first: None,
            contact: None,
            coverage: Coverage::default(),
            failure: None,
            seconds: 0.0,
        }
    }

    /// Adds the result of one run of a testbench.
    pub(crate) fn add(&mut self, found: Result<Tally, String>, clocked: bool, seconds: f64) {
        self.seconds += seconds;
        match found {
            Ok(tally) => {
                self.vectors += tally.rows;
                self.edges += if clocked { tally.rows } else { 0 };
                self.mismatches += tally.mismatches;
                self.first = self.first.take().or(tally.first);
                self.contact = tally.contact;
                self.coverage.add(tally.coverage);
                if tally.contact.is_some_and(|contact| contact.is_missing()) {
                    let why = "the scene reaches the wall, and at no edge compared was it touched";
                    self.failure = Some(format!("{why}; compare more of them (--edges)"));
                }
            }
            Err(said) => self.failure = self.failure.take().or(Some(said)),
        }
    }

    /// Returns whether every word was equal.
    pub fn ok(&self) -> bool {
        self.mismatches == 0 && self.failure.is_none() && self.vectors > 0
    }
}

/// The result of a check.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CheckReport {
    /// One row for each configuration, in the order of `variants()`.
    pub rows: Vec<CheckRow>,
    /// One row for each scene whose loop was closed around the VHDL, see [`closed_loop`](crate::closed_loop()). The
    /// block is the wiring, and the variant is the scene.
    pub loops: Vec<CheckRow>,
}

impl CheckReport {
    /// Returns whether anything was checked and every word was equal.
    pub fn ok(&self) -> bool {
        self.all().next().is_some() && self.all().all(CheckRow::ok)
    }

    /// Returns the rows of the blocks, then those of the loops.
    pub fn all(&self) -> impl Iterator<Item = &CheckRow> {
        self.rows.iter().chain(&self.loops)
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "{:<22} {:<30} {:>10} {:>10} {:>10} {:>8}",
            "block", "variant", "vectors", "edges", "mismatches", "s"
        )?;
        for row in self.all() {
            let CheckRow { block, variant, vectors, edges, mismatches, seconds, .. } = row;
            writeln!(f, "{block:<22} {variant:<30} {vectors:>10} {edges:>10} {mismatches:>10} {seconds:>8.2}")?;
            if let Some(first) = &row.first {
                write!(f, "{first}")?;
            }
            if let Some(failure) = &row.failure {
                writeln!(f, "  {}", failure.trim_end().replace('\n', "\n  "))?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { row, signal, expected, got, around } = self;
        writeln!(f, "  first at {row}: {signal} expected {expected}, got {got}")?;
        around.lines(*row).iter().try_for_each(|line| writeln!(f, "    {line}"))
    }
}

/// The result that a testbench printed.
pub(crate) struct Tally {
    pub(crate) rows: u64,
    pub(crate) mismatches: u64,
    pub(crate) first: Option<Mismatch>,
    /// The contact, in a closed loop.
    pub(crate) contact: Option<Contact>,
    pub(crate) coverage: Coverage,
}

/// Reads the output of a testbench: `RESULT`, and before it `MISMATCH` and `HISTORY` when there was a mismatch.
/// `around` has the columns of the rows.
pub(crate) fn tally(said: &str, around: &Around) -> Option<Tally> {
    let number = |line: &str, key: &str| line.split_once(key)?.1.split(' ').next()?.parse().ok();
    let result = said.lines().find(|line| line.starts_with("RESULT "))?;
    let history = || around::with(around, said.lines().filter_map(|line| line.strip_prefix("HISTORY ")));
    let first = said.lines().find_map(|line| first(line.strip_prefix("MISMATCH row=")?, history));
    let (rows, mismatches) = (number(result, "rows=")?, number(result, "mismatches=")?);
    Some(Tally { rows, mismatches, first, contact: None, coverage: Coverage::default() })
}

/// Reads `<row> signal=<name> expected=<bits and value> got=<bits and value>`.
fn first(line: &str, around: impl Fn() -> Around) -> Option<Mismatch> {
    let (row, line) = line.split_once(" signal=")?;
    let (signal, line) = line.split_once(" expected=")?;
    let (expected, got) = line.split_once(" got=")?;
    Some(Mismatch {
        row: row.parse().ok()?,
        signal: signal.to_string(),
        expected: expected.to_string(),
        got: got.to_string(),
        around: around(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(reached: Option<u64>, is_long: bool, edges: u64) -> CheckRow {
        let mut row = CheckRow::new("hybrid_loop", "hybrid-wall");
        let contact = Some(Contact { late: Late { from_edge: 5, reached, is_long }, edges });
        row.add(Ok(Tally { rows: 9, mismatches: 0, first: None, contact, coverage: Coverage::default() }), true, 1.0);
        row
    }

    #[test]
    fn a_scene_that_reaches_its_wall_and_is_compared_without_contact_fails() {
        assert!(row(Some(8), true, 6).ok());
        let empty = row(Some(8), true, 0);
        assert!(!empty.ok() && empty.failure.expect("why").contains("--edges"));
        // A comparison of a scene that never reaches the wall passes, and so does one that may be too short for a
        // sample.
        assert!(row(None, true, 0).ok());
        assert!(row(Some(8), false, 0).ok());
    }
}
