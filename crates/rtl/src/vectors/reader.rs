//! Reads vectors and stimuli back. An error names the line.

use hpu_wave::Column;

use crate::vectors::vector::{Header, Stimulus, VectorError, Vectors, digits};

impl Vectors {
    /// Reads a vector file, whose line 1 must be that of `header`.
    ///
    /// # Errors
    ///
    /// [`VectorError`], with the line, when the file is of another configuration, cut or damaged.
    pub fn parse(text: &str, header: Header) -> Result<Self, VectorError> {
        let mut lines = text.lines().zip(1..);
        let found = lines.next().map_or("", |(line, _)| line);
        if found != header.to_string() {
            return Err(stale(&header.to_string(), found));
        }
        let columns: Vec<_> = header.columns().cloned().collect();
        let mut rows = Vec::new();
        for (line, number) in &mut lines {
            if line.starts_with('#') {
                if line != format!("# end {} rows", rows.len()) {
                    let why = format!("the file has {} rows, but ends with `{line}`", rows.len());
                    return Err(VectorError::at(number, why));
                }
                return match lines.next() {
                    None => Ok(Self { header, rows }),
                    Some((_, number)) => Err(VectorError::at(number, "text after the last line `# end N rows`")),
                };
            }
            let words: Vec<_> = line.split(' ').collect();
            if words.len() != columns.len() {
                return Err(count(number, columns.len(), words.len()));
            }
            let row = columns.iter().zip(words).map(|(column, found)| hex(number, column, found));
            rows.push(row.collect::<Result<_, _>>()?);
        }
        Err(VectorError::at(rows.len() + 2, "the file is cut: its last line should be `# end N rows`"))
    }
}

/// Returns the error of a file that was made for another configuration.
fn stale(expected: &str, found: &str) -> VectorError {
    VectorError::at(1, format!("made for another configuration; expected `{expected}`, found `{found}`"))
}

/// Returns the error of a row with another number of words.
fn count(line: usize, expected: usize, found: usize) -> VectorError {
    VectorError::at(line, format!("{expected} words expected, {found} found"))
}

/// Returns the error of a word that does not fit its column.
fn word(line: usize, Column { name, format, .. }: &Column, found: &str) -> VectorError {
    VectorError::at(line, format!("`{found}` is not a word of {name}{format}"))
}

/// Reads a word in hex. It must have exactly the digits of its column, and no bit beyond the column's width.
fn hex(line: usize, column: &Column, found: &str) -> Result<i64, VectorError> {
    let format = column.format;
    let plain = found.len() == digits(format) && found.bytes().all(|digit| digit.is_ascii_hexdigit());
    let bits = plain.then(|| u64::from_str_radix(found, 16).ok()).flatten();
    let bits = bits.filter(|&bits| format.bits(format.from_bits(bits)) == bits);
    bits.map(|bits| format.from_bits(bits)).ok_or_else(|| word(line, column, found))
}

/// Reads stimuli as CSV: a line with the block's input names in order (`rst` may be left out), then decimal rows in
/// units of each word's least significant bit.
///
/// # Errors
///
/// [`VectorError`], with the line, when line 1 has other names, a row has the wrong length, or a number does not fit.
pub fn stimuli_from_csv(text: &str, header: &Header) -> Result<Vec<Stimulus>, VectorError> {
    let names = |columns: &[Column]| columns.iter().map(|column| column.name).collect::<Vec<_>>().join(",");
    let first = text.lines().next().unwrap_or("").trim();
    let with_rst = first == names(&header.inputs);
    let columns = &header.inputs[usize::from(header.clocked && !with_rst)..];
    if first != names(columns) {
        return Err(stale(&names(&header.inputs), first));
    }
    let mut stimuli = Vec::new();
    for (line, number) in text.lines().zip(1..).skip(1).filter(|(line, _)| !line.trim().is_empty()) {
        let cells: Vec<_> = line.split(',').map(str::trim).collect();
        if cells.len() != columns.len() {
            return Err(count(number, columns.len(), cells.len()));
        }
        let read = |(column, found): (&Column, &&str)| {
            let value = found.parse().ok().filter(|&value| column.format.holds(value));
            value.map(|value| column.format.wrap(value)).ok_or_else(|| word(number, column, found))
        };
        let mut words: Vec<i64> = columns.iter().zip(&cells).map(read).collect::<Result<_, _>>()?;
        let rst = header.clocked && with_rst && words.remove(0) == 1;
        stimuli.push(Stimulus { rst, words });
    }
    Ok(stimuli)
}
