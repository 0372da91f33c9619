//! Golden vectors: what goes into a block before an edge, and what stands at its outputs after it.
//!
//! A set is plain text. Line 1 names the block, its ports with their formats, and its generics; every further line is
//! one edge (for a combinational block: one settling) in hex words, as many digits as the format needs, inputs first;
//! the last line counts the rows, so that a cut file is never taken for a whole one.
//!
//! ```text
//! # position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12
//! 1 0 000
//! 0 3 fff
//! # end 2 rows
//! ```

use std::fmt::{self, Write as _};

use hpu_datapath::{AnyBlock, Generic};
use hpu_signal::{Format, Signal};

/// One column of a vector file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Column {
    /// Name of the port.
    pub name: &'static str,
    /// Its word format.
    pub format: Format,
}

/// What line 1 of a vector file says. [`Display`](fmt::Display) writes that line.
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
    /// Generics of the configuration.
    pub generics: Vec<(&'static str, Generic)>,
}

/// One edge's stimulus.
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

/// A generic's value as VHDL and GHDL's `-g` write it.
#[must_use]
pub fn literal(value: Generic) -> String {
    match value {
        Generic::Integer(value) => value.to_string(),
        Generic::Boolean(value) => value.to_string(),
    }
}

impl Header {
    /// The header of a block in its configuration.
    #[must_use]
    pub fn of(block: &dyn AnyBlock) -> Self {
        let column = |signal: &Signal| Column { name: signal.name, format: signal.format };
        let rst = block.clocked().then_some(Column { name: "rst", format: Format::BIT });
        Self {
            block: block.name(),
            clocked: block.clocked(),
            inputs: rst.into_iter().chain(block.inputs().iter().map(column)).collect(),
            outputs: block.outputs().iter().map(column).collect(),
            generics: block.generics(),
        }
    }

    /// All columns, inputs first.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.inputs.iter().chain(&self.outputs)
    }
}

impl fmt::Display for Header {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "# {} in", self.block)?;
        for Column { name, format } in &self.inputs {
            write!(f, " {name}{format}")?;
        }
        write!(f, " out")?;
        for Column { name, format } in &self.outputs {
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

/// Hex digits of a word of this width.
pub(crate) fn digits(format: Format) -> usize {
    format.width().div_ceil(4) as usize
}

impl Vectors {
    /// Feeds a block, from its present state, and records what it answers: one row a stimulus.
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

    /// The vector file.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.header);
        for row in &self.rows {
            let mut gap = "";
            for (column, &word) in self.header.columns().zip(row) {
                let (bits, digits) = (column.format.bits(word), digits(column.format));
                write!(text, "{gap}{bits:0digits$x}").expect("a string grows");
                gap = " ";
            }
            text.push('\n');
        }
        writeln!(text, "# end {} rows", self.rows.len()).expect("a string grows");
        text
    }

    /// Decimal values (in units of each word's least significant bit) under a line of column names.
    #[must_use]
    pub fn to_csv(&self) -> String {
        self.csv_from(0)
    }

    /// As [`to_csv`](Self::to_csv), the outputs alone.
    #[must_use]
    pub fn outputs_to_csv(&self) -> String {
        self.csv_from(self.header.inputs.len())
    }

    fn csv_from(&self, first: usize) -> String {
        let columns: Vec<_> = self.header.columns().skip(first).collect();
        let names: Vec<_> = columns.iter().map(|column| column.name).collect();
        let mut text = names.join(",") + "\n";
        for row in &self.rows {
            let cells = columns.iter().zip(&row[first..]);
            let values: Vec<_> = cells.map(|(column, &word)| column.format.value(word).to_string()).collect();
            text += &(values.join(",") + "\n");
        }
        text
    }

    /// Verilog's `$readmemh`: one hex number a row, all words side by side, the first column in the upper bits.
    #[must_use]
    pub fn to_readmemh(&self) -> String {
        let mut text = format!("// {}\n//", &self.header.to_string()[2..]);
        let mut top: u32 = self.header.columns().map(|column| column.format.width()).sum();
        let total = top;
        for column in self.header.columns() {
            let low = top - column.format.width();
            write!(text, " {}[{}:{low}]", column.name, top - 1).expect("a string grows");
            top = low;
        }
        text.push('\n');
        for row in &self.rows {
            // Most significant bit first, padded on the left to whole digits.
            let mut bits = vec![false; (total.next_multiple_of(4) - total) as usize];
            for (column, &word) in self.header.columns().zip(row) {
                let word = column.format.bits(word);
                bits.extend((0..column.format.width()).rev().map(|bit| word >> bit & 1 == 1));
            }
            for digit in bits.chunks(4) {
                let digit = digit.iter().fold(0, |digit, &bit| digit * 2 + u32::from(bit));
                write!(text, "{digit:x}").expect("a string grows");
            }
            text.push('\n');
        }
        text
    }
}
