//! Compares the answers of somebody else's block with ours, row by row.

use std::collections::VecDeque;
use std::ops::Range;

use hpu_cosim::dut::Change;
use hpu_signal::Format;
use hpu_wave::{Around, Column, ComparedRow};

use super::ours::Ours;
use super::wires::{What, Wire, same};
use crate::vectors::around::{self, AFTER, BEFORE};
use crate::vectors::coverage::Coverage;
use crate::vectors::report::{Mismatch, Tally};
use crate::vectors::vector::{Vectors, digits, hex};

/// The answers of theirs so far.
pub(super) struct BlockComparison<'a> {
    ours: &'a Ours,
    wires: &'a [Wire],
    /// The bits at the ports of theirs, `None` where one of them is unknown.
    now: Vec<Option<u64>>,
    compared: u64,
    mismatches: u64,
    first: Option<Mismatch>,
    around: Around,
    last: VecDeque<ComparedRow>,
    coverage: Coverage,
}

impl<'a> BlockComparison<'a> {
    /// Begins to compare the answers at these connections of so many ports.
    pub(super) fn new(ours: &'a Ours, (wires, ports): (&'a [Wire], usize), beside: &'static str) -> Self {
        let around = Around { beside, ..around::of_block(&ours.vectors.header) };
        let (now, last) = (vec![None; ports], VecDeque::new());
        let coverage = Coverage::of_block(&ours.vectors.header);
        Self { ours, wires, now, compared: 0, mismatches: 0, first: None, around, last, coverage }
    }

    /// Takes the outputs of theirs before the first row.
    pub(super) fn begin(&mut self, changes: &[Change]) {
        changes.iter().for_each(|change| self.now[change.port] = change.bits);
    }

    /// Takes the changes during some rows, and compares each row.
    pub(super) fn rows(&mut self, rows: Range<usize>, changes: &[Change]) {
        let mut changes = changes.iter().peekable();
        for (edge, row) in (1..).zip(rows) {
            while let Some(change) = changes.next_if(|change| change.edge <= edge) {
                self.now[change.port] = change.bits;
            }
            self.compare(row);
        }
    }

    fn compare(&mut self, row: usize) {
        let Vectors { header, rows } = &self.ours.vectors;
        let (inputs, number) = (header.inputs.len(), row as u64 + 1);
        let answered = self.ours.answered(row);
        self.compared += u64::from(answered.is_some());
        // Where nothing is compared, the table shows the answer of ours on both sides.
        let own = &rows[answered.unwrap_or(row)][inputs..];
        if answered.is_some() {
            self.coverage.row(header.clocked, rows[row][..inputs].iter().chain(own).copied());
        }
        let mut got: Vec<_> = header.outputs.iter().zip(own).map(|(column, &word)| hex(column.format, word)).collect();
        for wire in self.wires {
            let bits = self.now[wire.place].map(|word| wire.bits(word));
            let What::Output(index) = wire.what else { continue };
            let (column, expected) = (&header.outputs[index], own[index]);
            let answer = Answer::of(wire, bits, column.format);
            got[index] = answer.hex(column.format);
            if answered.is_none() || answer == Answer::Word(expected) {
                continue;
            }
            self.mismatches += 1;
            if self.first.is_none() {
                let theirs = &wire.port.name;
                let theirs = if same(column.name, theirs) { String::new() } else { format!(" (their {theirs})") };
                self.first = Some(Mismatch {
                    row: number,
                    signal: format!("{}{theirs}", column.name),
                    expected: shown(column, expected),
                    got: answer.shown(column),
                    around: self.around.clone(),
                });
            }
        }
        let before = self.first.as_ref().is_none_or(|first| first.row == number);
        if before && self.last.len() == BEFORE {
            self.last.pop_front();
        }
        if before || self.last.len() < BEFORE + AFTER {
            let expected = header.columns().zip(rows[row][..inputs].iter().chain(own));
            let expected = expected.map(|(column, &word)| hex(column.format, word)).collect();
            self.last.push_back(ComparedRow { number, expected, got });
        }
    }

    /// Returns the result of the comparison.
    pub(super) fn tally(self) -> Tally {
        let (rows, around) = (Vec::from(self.last), self.around);
        let first = self.first.map(|first| Mismatch { around: Around { rows, ..around }, ..first });
        Tally { rows: self.compared, mismatches: self.mismatches, first, contact: None, coverage: self.coverage }
    }
}

/// An answer of theirs, as a word of ours.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// A word with the same bits; for a number, with the same value.
    Word(i64),
    /// A number that a word of ours cannot hold.
    Beyond(i64),
    Unknown,
}

impl Answer {
    fn of(wire: &Wire, bits: Option<u64>, format: Format) -> Self {
        let Some(bits) = bits else { return Self::Unknown };
        if !wire.port.is_number {
            return Self::Word(format.from_bits(bits));
        }
        let number = wire.port.format.from_bits(bits);
        if format.wrap(number.into()) == number { Self::Word(number) } else { Self::Beyond(number) }
    }

    fn hex(self, format: Format) -> String {
        match self {
            Self::Word(word) => hex(format, word),
            Self::Beyond(_) | Self::Unknown => "X".repeat(digits(format)),
        }
    }

    fn shown(self, column: &Column) -> String {
        match self {
            Self::Word(word) => shown(column, word),
            Self::Beyond(number) => number.to_string(),
            Self::Unknown => "unknown bits (X, Z or U)".to_string(),
        }
    }
}

/// Returns a word's bits and its value as text.
fn shown(&Column { format, .. }: &Column, word: i64) -> String {
    let value = format.value(word) as f64 * format.lsb();
    format!("{:0width$b} ({value})", format.bits(word), width = format.width() as usize)
}
