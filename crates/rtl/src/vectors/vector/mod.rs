//! Golden vectors: the inputs of a block before an edge, and its outputs after the edge.
//!
//! A set is plain text. Line 1 names the block, its ports with their formats, and its generics. Each further line is
//! one edge (for a combinational block: one settling) in hex words with as many digits as the format needs, inputs
//! first. The last line has the number of rows, so that a cut file is never taken for a complete one.
//!
//! ```text
//! # position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12
//! 1 0 000
//! 0 3 fff
//! # end 2 rows
//! ```

mod json;
mod memory;
mod refusal;

use std::fmt::{self, Write as _};

use hpu_datapath::{AnyBlock, Generic, ROUNDING, Rom, block_by_name};
use hpu_signal::{Format, Signal};
use hpu_wave::Column;

pub use json::{Origin, Source, row_line};
pub use memory::Memory;
pub use refusal::VectorError;

/// Returns the generics of a block that a header tells: all but a rounding that is the block's default. Blocks had no
/// other one before, and files from then stay as they are.
fn told(block: &dyn AnyBlock) -> Vec<(&'static str, Generic)> {
    let mut all = block.generics();
    if all.iter().any(|(name, _)| *name == ROUNDING) {
        let default = block_by_name(block.name()).map_or(Vec::new(), |default| default.generics());
        all.retain(|generic| generic.0 != ROUNDING || !default.contains(generic));
    }
    all
}

/// The contents of line 1 of a vector file. [`Display`](fmt::Display) writes that line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Header {
    /// Name of the block.
    pub block: &'static str,
    /// Whether the first input is `rst`.
    pub clocked: bool,
    /// Inputs, `rst` first when clocked.
    pub inputs: Vec<Column>,
    /// Outputs.
    pub outputs: Vec<Column>,
    /// Generics of the configuration, without a `ROUNDING` at its default.
    pub generics: Vec<(&'static str, Generic)>,
}

/// The stimulus of one edge.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Stimulus {
    /// Whether this is a reset edge; never for a combinational block.
    pub rst: bool,
    /// Input words in port order, without `rst`.
    pub words: Vec<i64>,
}

/// A set of golden vectors.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Vectors {
    /// Line 1.
    pub header: Header,
    /// Words of each row: inputs (`rst` first when clocked), then outputs.
    pub rows: Vec<Vec<i64>>,
}

/// Returns a generic's value as VHDL and GHDL's `-g` write it.
pub fn literal(value: Generic) -> String {
    match value {
        Generic::Integer(value) => value.to_string(),
        Generic::Boolean(value) => value.to_string(),
    }
}

impl Header {
    /// Returns the header of a block in its configuration.
    pub fn of(block: &dyn AnyBlock) -> Self {
        let column = |signal: &Signal| Column { name: signal.name, format: signal.format, unit: signal.unit };
        let rst = block.clocked().then_some(Column { name: "rst", format: Format::BIT, unit: "1" });
        Self {
            block: block.name(),
            clocked: block.clocked(),
            inputs: rst.into_iter().chain(block.inputs().iter().map(column)).collect(),
            outputs: block.outputs().iter().map(column).collect(),
            generics: told(block),
        }
    }

    /// Returns the header with these formats, by the names of columns, where they have as many bits and the same sign.
    /// A multiplier's generics tell no fraction bits, so that a file may place them elsewhere.
    #[must_use]
    pub fn with_formats(mut self, formats: &[(&str, Format)]) -> Self {
        for column in self.inputs.iter_mut().chain(&mut self.outputs) {
            let is_alike = |format: Format| {
                (format.width(), format.is_signed()) == (column.format.width(), column.format.is_signed())
            };
            let told = formats.iter().find(|(name, format)| *name == column.name && is_alike(*format));
            column.format = told.map_or(column.format, |(_, format)| *format);
        }
        self
    }

    /// Returns all columns, inputs first.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.inputs.iter().chain(&self.outputs)
    }
}

impl fmt::Display for Header {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "# {} in", self.block)?;
        for Column { name, format, .. } in &self.inputs {
            write!(f, " {name}{format}")?;
        }
        write!(f, " out")?;
        for Column { name, format, .. } in &self.outputs {
            write!(f, " {name}{format}")?;
        }
        if !self.generics.is_empty() {
            write!(f, " generics")?;
            for (name, value) in &self.generics {
                write!(f, " {name}={}", literal(*value))?;
            }
        }
        Ok(())
    }
}

/// Returns the number of hex digits of a word of this format.
pub(crate) fn digits(format: Format) -> usize {
    format.width().div_ceil(4) as usize
}

/// Returns a word in hex with all of its digits.
pub(crate) fn hex(format: Format, word: i64) -> String {
    format!("{:0digits$x}", format.bits(word), digits = digits(format))
}

impl Vectors {
    /// Feeds a block from its present state and records its outputs: one row for each stimulus.
    pub fn record(block: &mut dyn AnyBlock, stimuli: impl IntoIterator<Item = Stimulus>) -> Self {
        let header = Header::of(block);
        let row = |Stimulus { rst, words }: Stimulus| {
            let answer = if rst { block.reset() } else { block.tick(&words) };
            let rst = header.clocked.then_some(i64::from(rst));
            rst.into_iter().chain(words).chain(answer).collect()
        };
        let rows = stimuli.into_iter().map(row).collect();
        Self { header, rows }
    }

    /// Returns a lookup table of a block as vectors, with one row for each address.
    pub fn of_rom(block: &dyn AnyBlock, rom: &Rom) -> Self {
        let bits = rom.words.len().max(2).next_power_of_two().ilog2();
        let header = Header {
            block: block.name(),
            clocked: false,
            inputs: vec![Column { name: "address", format: Format::unsigned(bits), unit: "1" }],
            outputs: vec![Column { name: rom.name, format: rom.format, unit: "1" }],
            generics: told(block),
        };
        Self { header, rows: (0..).zip(&rom.words).map(|(address, &word)| vec![address, word]).collect() }
    }

    /// Returns the text of the vector file.
    pub fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.header);
        for row in &self.rows {
            let mut gap = "";
            for (column, &word) in self.header.columns().zip(row) {
                let bits = hex(column.format, word);
                write!(text, "{gap}{bits}").expect("a string grows");
                gap = " ";
            }
            text.push('\n');
        }
        writeln!(text, "# end {} rows", self.rows.len()).expect("a string grows");
        text
    }

    /// Returns decimal values (in units of each word's least significant bit) under a line of column names.
    pub fn to_csv(&self) -> String {
        let columns: Vec<_> = self.header.columns().collect();
        let names: Vec<_> = columns.iter().map(|column| column.name).collect();
        let mut text = names.join(",") + "\n";
        for row in &self.rows {
            let cells = columns.iter().zip(row);
            let values: Vec<_> = cells.map(|(column, &word)| column.format.value(word).to_string()).collect();
            text += &(values.join(",") + "\n");
        }
        text
    }

    /// Returns the text for VUnit's `load_csv`: decimal values without a line of names, because `load_csv` accepts no
    /// names. The columns are in the order of the header; all become VHDL integers.
    ///
    /// # Errors
    ///
    /// [`TooWide`] when the words of a column do not fit in VHDL integers of 32 bits.
    pub fn to_vunit(&self) -> Result<String, TooWide> {
        let integers = i128::from(i32::MIN)..=i128::from(i32::MAX);
        let fits = |format: Format| integers.contains(&format.min()) && integers.contains(&format.max());
        if let Some(Column { name, format, .. }) = self.header.columns().find(|column| !fits(column.format)) {
            return Err(TooWide { column: name, format: *format });
        }
        let csv = self.to_csv();
        Ok(csv.split_once('\n').map_or("", |(_, rows)| rows).to_string())
    }

    /// Returns the rows as the words of a memory: all columns side by side, the first one in the upper bits.
    pub fn memory(&self) -> Memory {
        Memory::new(self, 0)
    }

    /// Returns the outputs alone as the words of a memory. For a lookup table, these are its contents.
    pub fn outputs_memory(&self) -> Memory {
        Memory::new(self, self.header.inputs.len())
    }
}

/// A column whose words do not fit in VUnit's integers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TooWide {
    /// Name of the column.
    pub column: &'static str,
    /// Its format.
    pub format: Format,
}

impl fmt::Display for TooWide {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { column, format } = self;
        write!(f, "{column}{format} has {} bits; VUnit reads VHDL integers: ", format.width())?;
        write!(f, "signed words of up to 32 bits, unsigned ones of up to 31")
    }
}

impl std::error::Error for TooWide {}
