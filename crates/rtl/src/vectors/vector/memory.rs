//! Memories: rows or tables as the words of a ROM, in the formats of simulators and vendors' tools.

use std::fmt::Write as _;

use super::Vectors;

/// The contents of a memory.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Memory {
    /// Two lines that describe the contents.
    about: [String; 2],
    /// Bits of a word.
    width: usize,
    /// The words by address, each with its most significant bit first.
    words: Vec<Vec<bool>>,
}

impl Memory {
    /// Returns a memory with the columns from `first` on, side by side.
    pub(super) fn new(vectors: &Vectors, first: usize) -> Self {
        let columns: Vec<_> = vectors.header.columns().skip(first).collect();
        let width = columns.iter().map(|column| column.format.width() as usize).sum();
        let mut top = width;
        let mut slices = Vec::new();
        for column in &columns {
            let low = top - column.format.width() as usize;
            slices.push(format!("{}[{}:{low}]", column.name, top - 1));
            top = low;
        }
        let word = |row: &Vec<i64>| {
            let bits = |(column, &word): (&&hpu_wave::Column, &i64)| {
                let (format, bits) = (column.format, column.format.bits(word));
                (0..format.width()).rev().map(move |bit| bits >> bit & 1 == 1)
            };
            columns.iter().zip(&row[first..]).flat_map(bits).collect()
        };
        let about = [vectors.header.to_string()[2..].to_string(), slices.join(" ")];
        Self { about, width, words: vectors.rows.iter().map(word).collect() }
    }

    /// Returns the number of bits of a word.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns whether there are no words. No tool accepts a memory without words.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Returns the contents for Verilog's `$readmemh`: one hex number a line.
    pub fn to_readmemh(&self) -> String {
        let [what, slices] = &self.about;
        let words = self.words.iter().map(|word| hex(word) + "\n");
        format!("// {what}\n// {slices}\n") + &words.collect::<String>()
    }

    /// Returns the coefficients for Xilinx's memory generators (UG896, "COE File Syntax"): hex numbers in the order of
    /// the addresses.
    pub fn to_coe(&self) -> String {
        let [what, slices] = &self.about;
        let words: Vec<_> = self.words.iter().map(|word| hex(word)).collect();
        format!(
            "; {what}\n; {slices}\nmemory_initialization_radix=16;\nmemory_initialization_vector=\n{};\n",
            words.join(",\n")
        )
    }

    /// Returns a Memory Initialization File for Quartus by Intel (formerly Altera): depth and width, then `address :
    /// word;` in hex.
    pub fn to_mif_intel(&self) -> String {
        let [what, slices] = &self.about;
        let mut text = format!(
            "-- {what}\n-- {slices}\nDEPTH = {};\nWIDTH = {};\n\
             ADDRESS_RADIX = HEX;\nDATA_RADIX = HEX;\nCONTENT\nBEGIN\n",
            self.words.len(),
            self.width
        );
        for (address, word) in self.words.iter().enumerate() {
            writeln!(text, "{address:x} : {};", hex(word)).expect("a string grows");
        }
        text + "END;\n"
    }

    /// Returns a memory initialization file for Xilinx (UG896, "MIF File Description"): one binary word a line, without
    /// comments.
    pub fn to_mif_xilinx(&self) -> String {
        let line =
            |word: &Vec<bool>| word.iter().map(|&bit| if bit { '1' } else { '0' }).chain(['\n']).collect::<String>();
        self.words.iter().map(line).collect()
    }
}

/// Returns bits as a hex number, padded on the left to whole digits.
fn hex(word: &[bool]) -> String {
    let first = word.len() % 4;
    let (head, rest) = word.split_at(first);
    let digits = (!head.is_empty()).then_some(head).into_iter().chain(rest.chunks(4));
    let value = |digit: &[bool]| digit.iter().fold(0, |value, &bit| value * 2 + u32::from(bit));
    digits.map(|digit| char::from_digit(value(digit), 16).expect("four bits")).collect()
}
