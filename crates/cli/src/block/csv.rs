//! A table of a block's inputs and outputs in decimal, in units of each word's least significant bit.

use hpu_cosim::excerpt;
use hpu_cosim::replay::CUT;
use hpu_datapath::AnyBlock;
use hpu_page::csv_line;
use hpu_signal::Signal;

use crate::shell::Failure;

/// A table with its columns.
#[derive(Debug)]
pub(crate) struct Ticked {
    /// Names of the columns.
    pub columns: Vec<&'static str>,
    /// Values of the words.
    pub rows: Vec<Vec<i128>>,
}

impl Ticked {
    /// Reads a CSV whose header names every input, in any order, and puts the columns in port order. Ignores empty
    /// lines, and lines that begin with `#`.
    pub fn read(file: &str, text: &str, inputs: &[Signal]) -> Result<Self, Failure> {
        let refuse = |line: usize, reason: String| Failure::file(format!("{file}:{line}: {reason}"));
        if !text.is_empty() && !text.ends_with('\n') {
            return Err(refuse(text.lines().count(), format!("{CUT}; end a whole one with a line feed")));
        }
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        let names: Vec<_> = inputs.iter().map(|input| input.name).collect();
        let accepted = format!("the header names the inputs: {}", names.join(","));
        let (line, header) = lines.next().ok_or_else(|| refuse(1, format!("no header; {accepted}")))?;
        let found: Vec<_> = header.split(',').map(str::trim).collect();
        if let Some(name) = found.iter().find(|name| !names.contains(name)) {
            return Err(refuse(line, format!("`{}` is no input; {accepted}", excerpt(name))));
        }
        let mut places = Vec::new();
        for name in &names {
            let mut at = (0..found.len()).filter(|&place| found[place] == *name);
            places.push(at.next().ok_or_else(|| refuse(line, format!("`{name}` is missing; {accepted}")))?);
            if at.next().is_some() {
                return Err(refuse(line, format!("`{name}` is named twice; {accepted}")));
            }
        }
        let mut rows = Vec::new();
        for (line, row) in lines {
            let cells: Vec<_> = row.split(',').map(str::trim).collect();
            if cells.len() != found.len() {
                return Err(refuse(line, format!("{} columns; the header has {}", cells.len(), found.len())));
            }
            let value = |(input, &place): (&Signal, &usize)| {
                let (Signal { name, format, .. }, cell) = (input, cells[place]);
                cell.parse().ok().filter(|&value| format.holds(value)).ok_or_else(|| {
                    let (least, most) = (format.min(), format.max());
                    let cell = excerpt(cell);
                    refuse(line, format!("{name}: `{cell}` is no integer from {least} to {most}, which {format} holds"))
                })
            };
            rows.push(inputs.iter().zip(&places).map(value).collect::<Result<_, _>>()?);
        }
        Ok(Self { columns: names, rows })
    }

    /// Resets a block for one edge, then ticks it with these inputs, one row an edge, and appends the outputs to the
    /// rows.
    pub fn tick(mut self, block: &mut dyn AnyBlock) -> Self {
        let (inputs, outputs) = (block.inputs(), block.outputs());
        block.reset();
        for row in &mut self.rows {
            let words: Vec<_> = inputs.iter().zip(&*row).map(|(input, &value)| input.format.wrap(value)).collect();
            let answer = block.tick(&words);
            row.extend(outputs.iter().zip(answer).map(|(output, word)| output.format.value(word)));
        }
        self.columns.extend(outputs.iter().map(|output| output.name));
        self
    }

    /// Returns the table as CSV.
    pub fn to_csv(&self) -> String {
        let lines = self.rows.iter().map(|row| csv_line(row.iter().map(i128::to_string)));
        csv_line(self.columns.iter().map(|name| (*name).to_string())) + &lines.collect::<String>()
    }
}
