//! Tables as programs of laboratories write them: with commas, semicolons or tabs, with a decimal point or comma, with
//! quotes, comments and a byte order mark.

use super::ReplayError;
use crate::text::message::excerpt;

/// A table: the comments above it, its header, and its rows as text.
pub(super) struct Table {
    /// The lines of comments above the header, without their signs.
    pub(super) comments: Vec<String>,
    /// The line of the header.
    pub(super) line: u64,
    pub(super) header: Vec<String>,
    /// The rows with their lines.
    pub(super) rows: Vec<(u64, Vec<String>)>,
}

/// The reason for refusing an empty table.
const NO_HEADER: &str = "no header; write the names of the columns with their units, as in `time_s,angle_rad`";

/// The separators that a table may have, in the order in which they are looked for in its header.
const SEPARATORS: [char; 3] = ['\t', ';', ','];

impl Table {
    /// Reads a table. Empty lines are skipped, and comments: lines that begin with `#`, above the header also those
    /// that begin with `;`, `%` or `//`. `separator` is that of the header if it is `None`.
    pub(super) fn read(text: &str, separator: Option<char>) -> Result<Self, ReplayError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let (mut comments, mut above) = (Vec::new(), 0);
        for line in text.split_inclusive('\n') {
            let comment = ["#", ";", "%", "//"].iter().find_map(|sign| line.trim_start().strip_prefix(sign));
            match comment {
                Some(comment) => comments.push(comment.trim().to_string()),
                None if line.trim().is_empty() => {}
                None => break,
            }
            above += line.len();
        }
        let first_line = text[..above].bytes().filter(|byte| *byte == b'\n').count() as u64;
        let body = &text[above..];
        let first = body.lines().next().unwrap_or_default();
        let outside = outside_quotes(first);
        let separator = separator.or_else(|| SEPARATORS.into_iter().find(|one| outside.contains(*one)));
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(u8::try_from(separator.unwrap_or(',')).unwrap_or(b','))
            .comment(Some(b'#'))
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(body.as_bytes());
        let (mut rows, mut record) = (Vec::new(), csv::StringRecord::new());
        loop {
            let read = reader.read_record(&mut record);
            // The reader stands at the line after the record's.
            let line = first_line + reader.position().line().saturating_sub(1).max(1);
            if !read.map_err(|error| ReplayError::new(line, format!("not a table: {error}")))? {
                break;
            }
            let cells: Vec<String> = record.iter().map(str::to_string).collect();
            if cells.iter().any(|cell| !cell.is_empty()) {
                rows.push((line, cells));
            }
        }
        if rows.is_empty() {
            return Err(ReplayError::new(first_line.max(1), NO_HEADER));
        }
        let (line, mut header) = rows.remove(0);
        header.pop_if(|last| last.is_empty());
        // Loggers end rows with a separator.
        for (_, cells) in rows.iter_mut().filter(|(_, cells)| cells.len() == header.len() + 1) {
            cells.pop_if(|last| last.is_empty());
        }
        Ok(Self { comments, line, header, rows })
    }

    /// Returns the cell of a row in a column.
    pub(super) fn cell<'a>(&self, (line, row): &'a (u64, Vec<String>), column: usize) -> Result<&'a str, ReplayError> {
        let columns = self.header.len();
        if row.len() != columns {
            let reason = format!("{} columns; the header has {columns}", row.len());
            return Err(ReplayError::new(*line, reason));
        }
        Ok(&row[column])
    }

    /// Returns the number of a cell.
    pub(super) fn number(&self, row: &(u64, Vec<String>), column: usize) -> Result<f64, ReplayError> {
        let cell = self.cell(row, column)?;
        let value = number(cell).filter(|value| value.is_finite());
        value.ok_or_else(|| ReplayError::new(row.0, format!("`{}` is not a finite number", excerpt(cell))))
    }
}

/// Returns the letters of a line that are outside of quotes.
fn outside_quotes(line: &str) -> String {
    line.split('"').step_by(2).collect()
}

/// Returns a number with a decimal point, or a decimal comma.
fn number(cell: &str) -> Option<f64> {
    match cell.parse() {
        Ok(value) => Some(value),
        Err(_) if cell.matches(',').count() == 1 && !cell.contains('.') => cell.replace(',', ".").parse().ok(),
        Err(_) => None,
    }
}

/// A column's name without its unit, and the unit: `pos [deg]`, `pos (deg)`, `pos / deg` and `pos_deg`.
pub(super) fn name_and_unit(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some((name, unit)) = cell.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
            return (name.trim_end(), Some(unit.trim()));
        }
    }
    if let Some((name, unit)) = cell.rsplit_once(" / ") {
        return (name.trim_end(), Some(unit.trim()));
    }
    match cell.rsplit_once(['_', ' ']) {
        Some((name, unit)) => (name, Some(unit)),
        None => (cell, None),
    }
}
