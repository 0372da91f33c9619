//! The rows around a mismatch, of the emulator and of what is held against it: as a table, and for a waveform.

use hpu_signal::{Clock, Signal};

use crate::vector::{Column, Header, Vectors, hex};

/// Rows of a table, which end with the mismatch.
const SHOWN: usize = 16;
/// Rows of a waveform up to the mismatch, and after it. `testbench/vhdl/vector_reader.vhd` keeps as many.
pub(crate) const BEFORE: usize = 64;
pub(crate) const AFTER: usize = 64;

/// Rows around a mismatch.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Around {
    /// The block, or the wiring of a closed loop.
    pub name: &'static str,
    /// What stands beside the emulator: `vhdl`, or a `file`.
    pub beside: &'static str,
    /// What rows are: `row` of vectors, or `edge` of a closed loop.
    pub counted: &'static str,
    /// The signals: inputs that both are given, then what each answers.
    pub columns: Vec<Column>,
    /// How many of them are such inputs.
    pub inputs: usize,
    /// A row a clock cycle.
    pub clock: Clock,
    /// The rows, one after the other.
    pub rows: Vec<Row>,
}

/// Words of a row, in hex; a digit with an unknown bit is `X`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Row {
    /// Counted from 1.
    pub number: u64,
    /// The emulator's words, one a column.
    pub expected: Vec<String>,
    /// What stands beside them, one for each column that is no input.
    pub got: Vec<String>,
}

/// A table of text: the names of its columns, and rows of words.
type Table = (Vec<String>, Vec<Vec<String>>);

impl Around {
    /// Of a block's testbench, which takes 10 ns a row.
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

    /// Of a closed loop, where each side has inputs of its own.
    pub(crate) fn of_loop(name: &'static str, nets: &[Signal], clock: Clock) -> Self {
        let column = |&Signal { name, format, unit, .. }: &Signal| Column { name, format, unit };
        let columns = nets.iter().map(column).collect();
        Self { name, beside: "vhdl", counted: "edge", columns, inputs: 0, clock, rows: Vec::new() }
    }

    /// Of a file of vectors whose row of this number, counted from 1, the emulator answers otherwise.
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

    /// With the rows that a testbench tells, each as `row=7 0 fff got ffe`.
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

    /// The last rows up to a number, under the names of their columns: after each signal whose words differ in one of
    /// them stands what is beside the emulator, as in `delta(vhdl)`.
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

    /// The same as aligned lines. Signals on which both sides agree and that do not change are told once, below.
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
