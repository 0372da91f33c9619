//! The rows around a mismatch, with the words of the emulator and of the other side: as a table, and for a waveform.

use hpu_signal::{Clock, Format};

/// Rows of a table; the last one is the mismatch.
const SHOWN: usize = 16;

/// A column of words: a port of vectors, or a net.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Column {
    /// Name of the port.
    pub name: &'static str,
    /// Its word format.
    pub format: Format,
    /// Unit of the value.
    pub unit: &'static str,
}

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
    pub rows: Vec<ComparedRow>,
}

/// Words of a row, in hex. A digit with an unknown bit is `X`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ComparedRow {
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
    /// Returns the last rows up to row `number`, under the names of their columns. Where a signal differs in one of
    /// these rows, a second column after it holds the words of the other side, as in `delta(vhdl)`.
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
