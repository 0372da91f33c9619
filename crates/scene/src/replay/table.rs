//! Tables as programs of laboratories write them: with commas, semicolons, tabs or blanks, with a decimal point or
//! comma, with quotes, comments, titles above the header, and units in a row of their own.

use std::borrow::Cow;

use super::ReplayError;
use super::units::{name_and_unit, time};
use crate::text::message::excerpt;

/// A table: the comments above it, its header, and its rows.
pub(super) struct Table<'a> {
    /// The lines of comments, without their signs.
    pub(super) comments: Vec<&'a str>,
    /// The line of the header.
    pub(super) line: u64,
    /// The names of the columns, with units that stand in the row below; their numbers in a table without a header.
    pub(super) header: Vec<String>,
    pub(super) is_headless: bool,
    pub(super) rows: Vec<Row<'a>>,
    separator: char,
}

/// A row: its line, and its text.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    pub(super) line: u64,
    text: &'a str,
}

/// The cells of a row.
pub(super) type Cells<'a> = Vec<Cow<'a, str>>;

/// The reason for refusing an empty table.
const NO_HEADER: &str = "no header; write the names of the columns with their units, as in `time_s,angle_rad`";

/// The separators that a table may have, in the order in which they are looked for.
const SEPARATORS: [char; 4] = ['\t', ';', ',', ' '];

/// The rows that tell what a table is made of.
const LOOKED_AT: usize = 200;

/// The line that ends a head of LabVIEW's.
const END_OF_HEAD: &str = "***End_of_Header***";

impl<'a> Table<'a> {
    /// Reads a table. Empty lines are skipped, and comments: lines that begin with `#`, `%` or `//`, above the first
    /// row also with `;`. `separator` is what most rows have if it is `None`.
    ///
    /// The header is the first row that has as many cells as most rows and is not of numbers alone. Rows above it are
    /// titles. A table that begins with numbers has its header in the comment above, or none.
    pub(super) fn read(text: &'a str, separator: Option<char>) -> Result<Self, ReplayError> {
        let Lines { comments, rows, separator: said } = Lines::of(text);
        let Some(first) = rows.first() else {
            let lines = text.bytes().filter(|byte| *byte == b'\n').count() as u64;
            return Err(ReplayError::new(lines.max(1), NO_HEADER));
        };
        let some = &rows[..rows.len().min(LOOKED_AT)];
        let has = |separator: char| some.iter().filter(|row| outside_quotes(row.text).contains(separator)).count();
        let common = || SEPARATORS.into_iter().find(|one| 2 * has(*one) > some.len());
        let separator = separator.or(said).or_else(common).unwrap_or(',');
        let widths: Vec<usize> = some.iter().map(|row| width(&cells(row.text, separator))).collect();
        let times = |width: usize| widths.iter().filter(|other| **other == width).count();
        let columns =
            widths.iter().fold(widths[0], |most, width| if times(*width) > times(most) { *width } else { most });
        let fits = |row: &Row| width(&cells(row.text, separator)) == columns;
        let is_numbers = |row: &Row| cells(row.text, separator).iter().all(|cell| cell.is_empty() || is_number(cell));
        let mut header = some.iter().position(fits).unwrap_or(0);
        // A title may have as many cells by chance.
        let of_times = |row: &Row| cells(row.text, separator).iter().any(|cell| is_time(cell));
        let is_title = |pair: &[Row]| !of_times(&pair[0]) && of_times(&pair[1]) && pair.iter().all(fits);
        header += usize::from(some[header..].windows(2).next().is_some_and(is_title));
        let is_headless = is_numbers(&some[header]);
        let is_head = |row: &Row| width(&cells(row.text, separator)) > 1 && !is_numbers(row);
        let mut table = Self { comments, line: first.line, header: Vec::new(), is_headless, rows, separator };
        // A header with another number of cells: the rows are refused.
        if let Some(at) = table.rows[..header].iter().rposition(is_head).filter(|_| is_headless) {
            (table.is_headless, header) = (false, at);
        }
        if table.is_headless {
            table.take_comment(columns, header);
        } else {
            table.take_header(header);
        }
        Ok(table)
    }

    /// Takes the header from a row, and units from the row below it.
    fn take_header(&mut self, at: usize) {
        let names = |row: &Row| cells(row.text, self.separator).iter().map(|cell| cell.to_string()).collect::<Vec<_>>();
        self.line = self.rows[at].line;
        self.header = names(&self.rows[at]);
        self.header.pop_if(|last| last.is_empty());
        let mut after = at + 1;
        if let Some(below) = self.rows.get(after) {
            let mut units = names(below);
            let bare = |cell: &str| cell.trim_matches(['[', ']', '(', ')']).trim().to_string();
            let is_units =
                units.iter().any(|cell| time(&bare(cell)).is_some()) && !units.iter().any(|cell| is_number(cell));
            units.resize(self.header.len().max(units.len()), String::new());
            if is_units {
                for (name, unit) in self.header.iter_mut().zip(&units).filter(|(_, unit)| !bare(unit).is_empty()) {
                    *name = format!("{name} [{}]", bare(unit));
                }
                after += 1;
            }
        }
        self.rows.drain(..after);
        // LabVIEW's rows have no cell below the header's last.
        if let (Some("Comment"), Some(row)) = (self.header.last().map(String::as_str), self.rows.first())
            && width(&cells(row.text, self.separator)) + 1 == self.header.len()
        {
            self.header.pop();
        }
    }

    /// Takes the header of a table that begins with numbers from the comment above it, or else numbers the columns.
    fn take_comment(&mut self, columns: usize, at: usize) {
        self.line = self.rows[at].line;
        self.rows.drain(..at);
        let comment = self.comments.last().filter(|comment| !comment.starts_with("Channels ("));
        let names = comment.map(|comment| cells(comment, self.separator)).unwrap_or_default();
        if columns > 1 && names.len() == columns && !names.iter().all(|name| is_number(name)) {
            self.header = names.iter().map(|name| name.to_string()).collect();
            self.is_headless = false;
        } else {
            self.header = (1..=columns).map(|number| number.to_string()).collect();
        }
    }

    /// Returns the cells of a row, as many as the header has.
    pub(super) fn cells(&self, row: &Row<'a>) -> Result<Cells<'a>, ReplayError> {
        let (mut found, columns) = (cells(row.text, self.separator), self.header.len());
        // Loggers end rows with a separator.
        if found.len() == columns + 1 {
            found.pop_if(|last| last.is_empty());
        }
        match found.len() == columns {
            true => Ok(found),
            false => Err(ReplayError::new(row.line, format!("{} columns; the header has {columns}", found.len()))),
        }
    }

    /// Refuses a column of numbers such as `1,080` among columns with commas between them, where no other number tells
    /// whether that is 1.08 or 1080.
    pub(super) fn check_commas(&self, column: usize) -> Result<(), ReplayError> {
        let mut thousands = None;
        for row in self.rows.iter().filter(|row| self.separator == ',' && row.text.contains('"')) {
            let Ok(cells) = self.cells(row) else { continue };
            let cell = &cells[column];
            match cell.split_once(',') {
                Some((whole, rest)) if is_group(whole, 1) && is_group(rest, 3) && !whole.starts_with('0') => {
                    thousands.get_or_insert_with(|| (row.line, cell.to_string()));
                }
                Some(_) => return Ok(()),
                None => {}
            }
        }
        match thousands {
            None => Ok(()),
            Some((line, cell)) => {
                let reason = format!(
                    "`{}` may be {} or {}; write numbers without a thousands separator, or semicolons between columns",
                    excerpt(&cell),
                    cell.replace(',', "."),
                    cell.replace(',', "")
                );
                Err(ReplayError::new(line, reason))
            }
        }
    }
}

/// Returns the number of a cell.
pub(super) fn number_of(row: &Row, cell: &str) -> Result<f64, ReplayError> {
    let value = number(cell).filter(|value| value.is_finite());
    value.ok_or_else(|| {
        let reason = format!("`{}` is not a finite number{}", excerpt(cell), by_clock(cell));
        ReplayError::new(row.line, reason)
    })
}

/// Returns the way out where a cell is a date or a time of day.
pub(super) fn by_clock(cell: &str) -> &'static str {
    if cell.contains(':') { "; write times as numbers, as in seconds" } else { "" }
}

/// The lines of a file: comments, rows, and the separator that Excel's `sep=;` tells.
struct Lines<'a> {
    comments: Vec<&'a str>,
    rows: Vec<Row<'a>>,
    separator: Option<char>,
}

impl<'a> Lines<'a> {
    fn of(text: &'a str) -> Self {
        let mut all = Self { comments: Vec::new(), rows: Vec::new(), separator: None };
        let (mut rest, mut line) = (text, 1);
        while !rest.is_empty() {
            let (record, breaks) = record(rest);
            all.take(record, line);
            (rest, line) = (&rest[record.len()..], line + breaks);
        }
        all
    }

    fn take(&mut self, record: &'a str, line: u64) {
        let above = self.rows.is_empty();
        let text = record.trim_matches(['\r', '\n']);
        let plain = text.trim();
        let comment =
            ["#", "%", "//", ";"].iter().find_map(|sign| plain.strip_prefix(sign).filter(|_| above || *sign != ";"));
        let separator = plain.get(..4).filter(|key| above && key.eq_ignore_ascii_case("sep=")).map(|_| &plain[4..]);
        if let Some(comment) = comment {
            self.comments.push(comment.trim());
        } else if let Some(separator) = separator {
            self.separator = separator.chars().next().or(text.chars().nth(4));
        } else if plain.starts_with(END_OF_HEAD) {
            self.rows.clear();
        } else if !plain.trim_matches([',', ';', '\t', ' ', '"']).is_empty() {
            self.rows.push(Row { line, text });
        }
    }
}

/// Lines that a cell in quotes may have.
const MOST_LINES: u64 = 8;

/// Returns the first row of a text with its line feed, and the number of its line feeds. Quotes may go on over lines.
fn record(text: &str) -> (&str, u64) {
    let line_end = |from: usize| text[from..].find('\n').map(|at| from + at + 1);
    let first = line_end(0).unwrap_or(text.len());
    let (mut end, mut breaks) = (first, 1);
    let mut quotes = text[..end].matches('"').count();
    while quotes % 2 == 1 {
        match line_end(end).filter(|_| breaks < MOST_LINES) {
            Some(next) => (quotes, end, breaks) = (quotes + text[end..next].matches('"').count(), next, breaks + 1),
            // A quote that is none.
            None => return (&text[..first], 1),
        }
    }
    (&text[..end], breaks)
}

/// Returns the cells of a row, without quotes and blanks around them.
fn cells(text: &str, separator: char) -> Cells<'_> {
    let is_blank = |c: char| c != separator && c.is_whitespace();
    let (mut found, mut rest) = (Vec::new(), text.trim_matches(is_blank));
    if separator == ' ' {
        return words(rest);
    }
    loop {
        rest = rest.trim_start_matches(is_blank);
        let (quoted, after) = match rest.strip_prefix('"').and_then(quoted) {
            Some((cell, after)) => (Some(cell), after),
            None => (None, rest),
        };
        let (plain, next) = after.split_once(separator).map_or((after, None), |(cell, next)| (cell, Some(next)));
        found.push(quoted.unwrap_or(Cow::Borrowed(plain.trim())));
        match next {
            Some(next) => rest = next,
            None => return found,
        }
    }
}

/// Returns the cells of a row with blanks between them; a unit in brackets belongs to the word before it.
fn words(text: &str) -> Cells<'_> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    let mut from = 0;
    for word in text.split_whitespace() {
        let at = from + text[from..].find(word).unwrap_or(0);
        from = at + word.len();
        match found.last_mut().filter(|_| word.starts_with(['[', '(', '{'])) {
            Some(last) => last.1 = from,
            None => found.push((at, from)),
        }
    }
    found.into_iter().map(|(from, to)| Cow::Borrowed(text[from..to].trim_matches('"'))).collect()
}

/// Returns what stands in quotes, and the text behind them; a quote inside stands twice.
fn quoted(inside: &str) -> Option<(Cow<'_, str>, &str)> {
    let mut end = inside.find('"')?;
    while inside[end + 1..].starts_with('"') {
        end += 2 + inside[end + 2..].find('"')?;
    }
    let cell = inside[..end].trim();
    let cell = if cell.contains('"') { Cow::Owned(cell.replace("\"\"", "\"")) } else { Cow::Borrowed(cell) };
    Some((cell, &inside[end + 1..]))
}

/// Returns whether a cell of a header has a unit of time behind a name.
fn is_time(cell: &str) -> bool {
    let (name, unit) = name_and_unit(cell);
    !name.is_empty() && unit.and_then(time).is_some()
}

/// Returns the number of cells, without an empty last one.
fn width(cells: &Cells) -> usize {
    cells.len() - usize::from(cells.len() > 1 && cells.last().is_some_and(|last| last.is_empty()))
}

/// Returns the letters of a line that are outside of quotes.
fn outside_quotes(line: &str) -> String {
    line.trim().split('"').step_by(2).collect()
}

/// Returns whether these are digits of a group before or behind a thousands separator.
fn is_group(text: &str, least: usize) -> bool {
    let digits = text.trim_start_matches('-');
    (least..=3).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_digit())
}

fn is_number(cell: &str) -> bool {
    number(cell).is_some()
}

/// Returns a number with a decimal point, or a decimal comma, with Fortran's exponents and any sign of minus.
fn number(cell: &str) -> Option<f64> {
    cell.parse().ok().or_else(|| {
        let plain = cell.replace('\u{2212}', "-");
        let plain = match plain.matches(',').count() {
            1 if !plain.contains('.') => plain.replace(',', "."),
            _ => plain,
        };
        let digits = plain.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        digits.then(|| plain.replace(['d', 'D'], "e").parse().ok()).flatten()
    })
}
