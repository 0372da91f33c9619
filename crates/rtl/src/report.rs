//! What a check found, and how it is read from what testbenches write.

use std::fmt;

use crate::around::Around;
use crate::late::Late;

/// The first row in which VHDL and emulator disagree, or the first edge of a closed loop.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Mismatch {
    /// Row of the vectors, or edge of a closed loop, counted from 1.
    pub row: u64,
    /// Name of the signal.
    pub signal: String,
    /// What the emulator says, in bits and in value.
    pub expected: String,
    /// What the VHDL says.
    pub got: String,
    /// The rows around it.
    pub around: Around,
}

/// Contact in a comparison of a closed loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Contact {
    /// Where the comparison began, and whether the scene reaches the wall at all.
    pub late: Late,
    /// Edges compared at which the datapath saw the wall.
    pub edges: u64,
}

impl Contact {
    /// Whether there had to be contact, and was none.
    fn is_missing(&self) -> bool {
        self.late.reached.is_some() && self.late.is_long && self.edges == 0
    }
}

/// One configuration of one block, checked.
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
    /// The first of them.
    pub first: Option<Mismatch>,
    /// Of a loop that is compared from shortly before the wall: what was seen of that.
    pub contact: Option<Contact>,
    /// What GHDL said when it did not come to a result, or why the result says too little.
    pub failure: Option<String>,
    /// Seconds taken.
    pub seconds: f64,
}

impl CheckRow {
    /// Nothing compared yet.
    pub(crate) fn new(block: &str, variant: &str) -> Self {
        Self {
            block: block.to_string(),
            variant: variant.to_string(),
            vectors: 0,
            edges: 0,
            mismatches: 0,
            first: None,
            contact: None,
            failure: None,
            seconds: 0.0,
        }
    }

    /// Adds what one run of a testbench found.
    pub(crate) fn add(&mut self, found: Result<Tally, String>, clocked: bool, seconds: f64) {
        self.seconds += seconds;
        match found {
            Ok(tally) => {
                self.vectors += tally.rows;
                self.edges += if clocked { tally.rows } else { 0 };
                self.mismatches += tally.mismatches;
                self.first = self.first.take().or(tally.first);
                self.contact = tally.contact;
                if tally.contact.is_some_and(|contact| contact.is_missing()) {
                    let why = "the scene reaches the wall, and at no edge compared was it touched";
                    self.failure = Some(format!("{why}; compare more of them (--edges)"));
                }
            }
            Err(said) => self.failure = self.failure.take().or(Some(said)),
        }
    }

    /// Whether every word was equal.
    #[must_use]
    pub fn ok(&self) -> bool {
        self.mismatches == 0 && self.failure.is_none() && self.vectors > 0
    }
}

/// What the check found.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CheckReport {
    /// One row a configuration, in the order of `variants()`.
    pub rows: Vec<CheckRow>,
    /// One row a scene whose loop was closed around the VHDL, see [`closed_loop`](crate::closed_loop()): the block is
    /// the wiring, the variant the scene.
    pub loops: Vec<CheckRow>,
}

impl CheckReport {
    /// Whether there was something to check and every word was equal.
    #[must_use]
    pub fn ok(&self) -> bool {
        self.all().next().is_some() && self.all().all(CheckRow::ok)
    }

    /// Blocks, then loops.
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

/// What a testbench wrote.
pub(crate) struct Tally {
    pub(crate) rows: u64,
    pub(crate) mismatches: u64,
    pub(crate) first: Option<Mismatch>,
    /// Of a closed loop.
    pub(crate) contact: Option<Contact>,
}

/// Reads what a testbench wrote: `RESULT`, and before it `MISMATCH` and `HISTORY` when there was one. `around` has
/// their columns.
pub(crate) fn tally(said: &str, around: &Around) -> Option<Tally> {
    let number = |line: &str, key: &str| line.split_once(key)?.1.split(' ').next()?.parse().ok();
    let result = said.lines().find(|line| line.starts_with("RESULT "))?;
    let history = || around.with(said.lines().filter_map(|line| line.strip_prefix("HISTORY ")));
    let first = said.lines().find_map(|line| first(line.strip_prefix("MISMATCH row=")?, history));
    Some(Tally { rows: number(result, "rows=")?, mismatches: number(result, "mismatches=")?, first, contact: None })
}

/// `<row> signal=<name> expected=<bits and value> got=<bits and value>`
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
        row.add(Ok(Tally { rows: 9, mismatches: 0, first: None, contact }), true, 1.0);
        row
    }

    #[test]
    fn a_scene_that_reaches_its_wall_and_is_compared_without_contact_fails() {
        assert!(row(Some(8), true, 6).ok());
        let empty = row(Some(8), true, 0);
        assert!(!empty.ok() && empty.failure.expect("why").contains("--edges"));
        // Neither does one that never reaches it, nor so few edges that they may hold no sample.
        assert!(row(None, true, 0).ok());
        assert!(row(Some(8), false, 0).ok());
    }
}
