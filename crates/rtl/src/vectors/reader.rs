//! Reads vectors and stimuli back. An error names the line.

use std::fmt;

use hpu_signal::Format;

use hpu_wave::Column;

use crate::vectors::vector::{Header, Stimulus, Vectors, digits};

/// Why a vector or stimulus file was refused, and in which line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct VectorError {
    /// Line, counted from 1.
    pub line: usize,
    /// The problem with the line.
    pub problem: Problem,
}

/// A problem with a line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Problem {
    /// Line 1 is not that of the block's configuration.
    Stale {
        /// Line 1 of the block's configuration.
        expected: String,
        /// Line 1 of the file.
        found: String,
    },
    /// The file ends before its last line `# end N rows`.
    Truncated,
    /// The last line has another number of rows.
    Count {
        /// Rows found.
        found: usize,
        /// The last line of the file.
        told: String,
    },
    /// A row with the wrong number of words.
    Words {
        /// Number of columns.
        expected: usize,
        /// Words found.
        found: usize,
    },
    /// A word that is not a number of its column's format.
    Word {
        /// Name of the column.
        column: &'static str,
        /// Its format.
        format: Format,
        /// The word as found.
        found: String,
    },
    /// Something after the last line.
    Trailing,
}

impl fmt::Display for VectorError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: ", self.line)?;
        match &self.problem {
            Problem::Stale { expected, found } => {
                write!(f, "made for another configuration; expected `{expected}`, found `{found}`")
            }
            Problem::Truncated => {
                write!(f, "the file is cut: its last line should be `# end N rows`")
            }
            Problem::Count { found, told } => {
                write!(f, "the file has {found} rows, but ends with `{told}`")
            }
            Problem::Words { expected, found } => {
                write!(f, "{expected} words expected, {found} found")
            }
            Problem::Word { column, format, found } => write!(f, "`{found}` is not a word of {column}{format}"),
            Problem::Trailing => write!(f, "text after the last line `# end N rows`"),
        }
    }
}

impl std::error::Error for VectorError {}

impl Vectors {
    /// Reads a vector file, whose line 1 must be that of `header`.
    ///
    /// # Errors
    ///
    /// [`VectorError`], with the line, when the file is of another configuration, cut or damaged.
    pub fn parse(text: &str, header: Header) -> Result<Self, VectorError> {
        let at = |line, problem| VectorError { line, problem };
        let mut lines = text.lines().zip(1..);
        let found = lines.next().map_or("", |(line, _)| line);
        if found != header.to_string() {
            return Err(at(1, Problem::Stale { expected: header.to_string(), found: found.to_string() }));
        }
        let columns: Vec<_> = header.columns().cloned().collect();
        let mut rows = Vec::new();
        for (line, number) in &mut lines {
            if line.starts_with('#') {
                if line != format!("# end {} rows", rows.len()) {
                    return Err(at(number, Problem::Count { found: rows.len(), told: line.to_string() }));
                }
                return match lines.next() {
                    None => Ok(Self { header, rows }),
                    Some((_, number)) => Err(at(number, Problem::Trailing)),
                };
            }
            let words: Vec<_> = line.split(' ').collect();
            if words.len() != columns.len() {
                return Err(at(number, Problem::Words { expected: columns.len(), found: words.len() }));
            }
            let row = columns.iter().zip(words).map(|(column, found)| hex(column, found)).collect::<Result<_, _>>();
            rows.push(row.map_err(|problem| at(number, problem))?);
        }
        Err(at(rows.len() + 2, Problem::Truncated))
    }
}

/// Reads a word in hex. It must have exactly the digits of its column, and no bit beyond the column's width.
fn hex(column: &Column, found: &str) -> Result<i64, Problem> {
    let Column { name, format, .. } = *column;
    let plain = found.len() == digits(format) && found.bytes().all(|digit| digit.is_ascii_hexdigit());
    let bits = plain.then(|| u64::from_str_radix(found, 16).ok()).flatten();
    let bits = bits.filter(|&bits| format.bits(format.from_bits(bits)) == bits);
    bits.map(|bits| format.from_bits(bits)).ok_or(Problem::Word { column: name, format, found: found.to_string() })
}

/// Reads stimuli as CSV: a line with the block's input names in order (`rst` may be left out), then decimal rows in
/// units of each word's least significant bit.
///
/// # Errors
///
/// [`VectorError`], with the line, when line 1 has other names, a row has the wrong length, or a number does not fit.
pub fn stimuli_from_csv(text: &str, header: &Header) -> Result<Vec<Stimulus>, VectorError> {
    let at = |line, problem| VectorError { line, problem };
    let names = |columns: &[Column]| columns.iter().map(|column| column.name).collect::<Vec<_>>().join(",");
    let first = text.lines().next().unwrap_or("").trim();
    let with_rst = first == names(&header.inputs);
    let columns = &header.inputs[usize::from(header.clocked && !with_rst)..];
    if first != names(columns) {
        return Err(at(1, Problem::Stale { expected: names(&header.inputs), found: first.to_string() }));
    }
    let mut stimuli = Vec::new();
    for (line, number) in text.lines().zip(1..).skip(1).filter(|(line, _)| !line.trim().is_empty()) {
        let cells: Vec<_> = line.split(',').map(str::trim).collect();
        if cells.len() != columns.len() {
            return Err(at(number, Problem::Words { expected: columns.len(), found: cells.len() }));
        }
        let word = |(column, found): (&Column, &&str)| {
            let value = found.parse().ok().filter(|&value| column.format.holds(value));
            let Column { name, format, .. } = *column;
            value.map(|value| format.wrap(value)).ok_or(Problem::Word {
                column: name,
                format,
                found: found.to_string(),
            })
        };
        let mut words: Vec<i64> =
            columns.iter().zip(&cells).map(word).collect::<Result<_, _>>().map_err(|problem| at(number, problem))?;
        let rst = header.clocked && with_rst && words.remove(0) == 1;
        stimuli.push(Stimulus { rst, words });
    }
    Ok(stimuli)
}
