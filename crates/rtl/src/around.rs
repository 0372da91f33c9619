//! The rows around a mismatch, with the words of the emulator and of the other side: as a table, and for a waveform.

use hpu_signal::{Clock, Signal};

use crate::vector::{Column, Header, Vectors, hex};

/// Rows of a table; the last one is the mismatch.
const SHOWN: usize = 16;
/// Rows of a waveform up to the mismatch, and after it. `testbench/vhdl/vector_reader.vhd` keeps the same numbers.
pub(crate) const BEFORE: usize = 64;
pub(crate) const AFTER: usize = 64;

/// Rows around a mismatch.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Around {
    /// The block, or the wiring of a closed loop.
    pub name: &'static str,
    /// The side that is compared with the emulator: `vhdl`, `verilog` or a `file`.
    pub beside: &'static str,
    /// The name of a row: `row` of vectors, or `edge` of a closed loop.
    pub counted: &'static str,
    /// The signals: first the inputs that both sides are given, then the signals that are compared.
    pub columns: Vec<Column>,
    /// The number of these common inputs.
    pub inputs: usize,
    /// The clock; a row is one cycle.
    pub clock: Clock,
    /// The rows, in order.
    pub rows: Vec<Row>,
}

/// Words of a row, in hex. A digit with an unknown bit is `X`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Row {
    /// The row's number, counted from 1.
    pub number: u64,
    /// The emulator's words, one a column.
    pub expected: Vec<String>,
    /// The words of the other side, one for each column that is not an input.
    pub got: Vec<String>,
}

/// A table of text: the names of its columns, and its rows of words.
type Table = (Vec<String>, Vec<Vec<String>>);

impl Around {
    /// Returns the columns of a block's testbench, without rows. A row takes 10 ns.
    pub(crate) fn of_block(header: &Header) -> Self {
        Self {
            name: header.block,
            beside: "vhdl",
            counted: "row",
            columns: header.columns().cloned().collect(),
            inputs: header.inputs.len(),
            clock: Clock::new(100_000_000).expect("a clock"),
            rows: Vec::new(),
        }
    }

    /// Returns the columns of a closed loop, without rows. Each side has its own inputs, so no input is common.
    pub(crate) fn of_loop(name: &'static str, nets: &[Signal], clock: Clock) -> Self {
        let column = |&Signal { name, format, unit, .. }: &Signal| Column { name, format, unit };
        let columns = nets.iter().map(column).collect();
        Self { name, beside: "vhdl", counted: "edge", columns, inputs: 0, clock, rows: Vec::new() }
    }

    /// Returns the rows around a mismatch between a file of vectors and the emulator. `mismatch` is the number of the
    /// row, counted from 1.
    #[must_use]
    pub fn of_file(file: &Vectors, emulator: &Vectors, mismatch: usize) -> Self {
        let around = Self { beside: "file", ..Self::of_block(&file.header) };
        let first = mismatch.saturating_sub(BEFORE) + 1;
        let last = (mismatch + AFTER).min(file.rows.len()).min(emulator.rows.len());
        let words = |vectors: &Vectors, row: usize, from: usize| {
            let cells = around.columns.iter().zip(&vectors.rows[row]).skip(from);
            cells.map(|(column, &word)| hex(column.format, word)).collect::<Vec<_>>()
        };
        let row = |number: usize| Row {
            number: number as u64,
            expected: words(emulator, number - 1, 0),
            got: words(file, number - 1, around.inputs),
        };
        let rows = (first..=last).map(row).collect();
        Self { rows, ..around }
    }

    /// Returns a copy with the rows that a testbench has printed, each as in `row=7 0 fff got ffe`.
    pub(crate) fn with<'l>(&self, lines: impl Iterator<Item = &'l str>) -> Self {
        let words = |text: &str| text.split_whitespace().map(str::to_string).collect::<Vec<_>>();
        let row = |line: &str| {
            let (number, line) = line.strip_prefix("row=")?.split_once(' ')?;
            let (expected, got) = line.split_once("got")?;
            let row = Row { number: number.parse().ok()?, expected: words(expected), got: words(got) };
            let whole = row.expected.len() == self.columns.len() && row.got.len() == self.columns.len() - self.inputs;
            whole.then_some(row)
        };
        Self { rows: lines.filter_map(row).collect(), ..self.clone() }
    }

    /// Returns the last rows up to row `number`, under the names of their columns. Where a signal differs in one of
    /// these rows, a second column after it holds the words of the other side, as in `delta(vhdl)`.
    #[must_use]
    pub fn table(&self, number: u64) -> Table {
        let end = self.rows.iter().take_while(|row| row.number <= number).count();
        let rows = &self.rows[end.saturating_sub(SHOWN)..end];
        let differs = |index: usize| {
            let answer = index.checked_sub(self.inputs);
            answer.is_some_and(|answer| rows.iter().any(|row| row.expected[index] != row.got[answer]))
        };
        let differing: Vec<bool> = (0..self.columns.len()).map(differs).collect();
        let mut heads = vec![self.counted.to_string()];
        let mut cells: Vec<_> = rows.iter().map(|row| vec![row.number.to_string()]).collect();
        for (index, column) in self.columns.iter().enumerate() {
            heads.push(column.name.to_string());
            cells.iter_mut().zip(rows).for_each(|(cells, row)| cells.push(row.expected[index].clone()));
            if differing[index] {
                heads.push(format!("{}({})", column.name, self.beside));
                let answers = cells.iter_mut().zip(rows);
                answers.for_each(|(cells, row)| cells.push(row.got[index - self.inputs].clone()));
            }
        }
        (heads, cells)
    }

    /// Returns the table as aligned lines. A signal that does not change and is equal on both sides is printed once,
    /// below the table.
    #[must_use]
    pub fn lines(&self, number: u64) -> Vec<String> {
        let (heads, rows) = self.table(number);
        if rows.is_empty() {
            return Vec::new();
        }
        let is_told_once = |column: usize| {
            let beside = format!("{}({})", heads[column], self.beside);
            let differs = heads[column].ends_with(')') || heads.get(column + 1) == Some(&beside);
            column > 0 && !differs && rows.iter().all(|row| row[column] == rows[0][column])
        };
        let (once, shown): (Vec<usize>, Vec<usize>) = (0..heads.len()).partition(|&column| is_told_once(column));
        let width = |column: usize| rows.iter().map(|row| row[column].len()).fold(heads[column].len(), usize::max);
        let line = |row: &Vec<String>| {
            let cells = shown.iter().map(|&column| format!("{:<width$}", row[column], width = width(column)));
            cells.collect::<Vec<_>>().join("  ").trim_end().to_string()
        };
        let mut lines: Vec<String> = std::iter::once(&heads).chain(&rows).map(line).collect();
        if !once.is_empty() {
            let same = once.iter().map(|&column| format!("{}={}", heads[column], rows[0][column]));
            lines.push(format!("unchanged: {}", same.collect::<Vec<_>>().join(" ")));
        }
        lines
    }
}
