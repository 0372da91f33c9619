//! Collects the rows around a mismatch: from two files, from a testbench's text, or for a closed loop.

use hpu_signal::{Clock, Signal};
use hpu_wave::{Around, Column, ComparedRow};

use crate::vectors::vector::{Header, Vectors, hex};

/// Rows of a waveform up to the mismatch, and after it. `testbench/vhdl/vector_reader.vhd` keeps the same numbers.
pub(crate) const BEFORE: usize = 64;
pub(crate) const AFTER: usize = 64;

/// Returns the columns of a block's testbench, without rows. A row takes 10 ns.
pub(crate) fn of_block(header: &Header) -> Around {
    Around {
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
pub(crate) fn of_loop(name: &'static str, nets: &[Signal], clock: Clock) -> Around {
    let column = |&Signal { name, format, unit, .. }: &Signal| Column { name, format, unit };
    let columns = nets.iter().map(column).collect();
    Around { name, beside: "vhdl", counted: "edge", columns, inputs: 0, clock, rows: Vec::new() }
}

/// Returns the rows around a mismatch between a file of vectors and the emulator. `mismatch` is the number of the
/// row, counted from 1.
pub fn around_in_file(file: &Vectors, emulator: &Vectors, mismatch: usize) -> Around {
    let around = Around { beside: "file", ..of_block(&file.header) };
    let first = mismatch.saturating_sub(BEFORE) + 1;
    let last = (mismatch + AFTER).min(file.rows.len()).min(emulator.rows.len());
    let words = |vectors: &Vectors, row: usize, from: usize| {
        let cells = around.columns.iter().zip(&vectors.rows[row]).skip(from);
        cells.map(|(column, &word)| hex(column.format, word)).collect::<Vec<_>>()
    };
    let row = |number: usize| ComparedRow {
        number: number as u64,
        expected: words(emulator, number - 1, 0),
        got: words(file, number - 1, around.inputs),
    };
    let rows = (first..=last).map(row).collect();
    Around { rows, ..around }
}

/// Returns a copy with the rows that a testbench has printed, each as in `row=7 0 fff got ffe`.
pub(crate) fn with<'l>(around: &Around, lines: impl Iterator<Item = &'l str>) -> Around {
    let words = |text: &str| text.split_whitespace().map(str::to_string).collect::<Vec<_>>();
    let row = |line: &str| {
        let (number, line) = line.strip_prefix("row=")?.split_once(' ')?;
        let (expected, got) = line.split_once("got")?;
        let row = ComparedRow { number: number.parse().ok()?, expected: words(expected), got: words(got) };
        let whole = row.expected.len() == around.columns.len() && row.got.len() == around.columns.len() - around.inputs;
        whole.then_some(row)
    };
    Around { rows: lines.filter_map(row).collect(), ..around.clone() }
}
