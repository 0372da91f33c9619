//! The report of a folder of results: its pictures, its tables whose rows can be pointed at, and its texts.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use hpu_page::escaped;
use serde_json::{Value, json};

use crate::document::{Content, Document, Section, data, picture};
use crate::shell::{Failure, read_text};

/// Most rows of a table that is shown.
const ROWS: usize = 5000;
/// Most bytes of a file that is read.
const BYTES: u64 = 20_000_000;
/// The ends of the names of the files that are shown.
const ENDS: [&str; 4] = ["svg", "csv", "txt", "json"];
/// Columns of known tables to begin with: across, up, and for the colour.
const VIEWS: [(&str, [&str; 3]); 6] = [
    ("fit", ["speedup", "error", "judged"]),
    ("map", ["x", "y", "outcome"]),
    ("designs", ["lut4_estimated", "stable_stiffness", "front"]),
    ("error-by-width", ["bits", "error", "width"]),
    ("chart", ["motion_per_wall", "error", "family"]),
    ("sines", ["rom_bits", "worst", "source"]),
];
/// The names, without extension, of files that serve a command and no reader.
const OF_COMMANDS: [&str; 1] = ["journal"];

/// Returns the report of a folder.
pub fn document(dir: &Path) -> Result<Document, Failure> {
    let mut stems = BTreeSet::new();
    for entry in fs::read_dir(dir).map_err(|error| Failure::at(dir, error))? {
        let path = entry.map_err(|error| Failure::at(dir, error))?.path();
        let is_shown = path.extension().and_then(|end| end.to_str()).is_some_and(|end| ENDS.contains(&end));
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_file() && is_shown && !OF_COMMANDS.contains(&stem.as_str()) {
            stems.insert(stem);
        }
    }
    let mut sections = Vec::new();
    for (index, stem) in stems.iter().enumerate() {
        let html = shown(dir, stem)?;
        let content = Content { by: command(dir, stem)?, html, ..Content::default() };
        sections.push(Section { id: format!("part-{}", index + 1), title: stem.clone(), beside: vec![content] });
    }
    if sections.is_empty() {
        let said = format!("{} holds no results: no file whose name ends in .{}", dir.display(), ENDS.join(", ."));
        return Err(Failure::usage(said));
    }
    let name = dir.file_name().map_or(dir.display().to_string(), |name| name.to_string_lossy().into_owned());
    Ok(Document { title: name, about: String::new(), sections })
}

/// Returns the files of this name in a folder as HTML: the table, the picture, and the text or else the JSON.
pub fn shown(dir: &Path, stem: &str) -> Result<String, Failure> {
    let path = |end: &str| dir.join(format!("{stem}.{end}"));
    let text = |end: &str| {
        let path = path(end);
        let is_there = fs::metadata(&path).is_ok_and(|found| found.is_file() && found.len() <= BYTES);
        is_there.then(|| read_text(&path)).transpose()
    };
    let mut html = String::new();
    let csv = text("csv")?;
    if let Some(table) = csv.as_deref().map(Rows::read) {
        html += &table.html(stem);
    }
    if let Some(svg) = text("svg")? {
        html += &picture(&svg);
    }
    let said = match text("txt")? {
        Some(said) => Some(said),
        // Where there is a table, the JSON says the same.
        None if csv.is_none() => match text("json")? {
            Some(_) => Some(format!("{:#}", json(&path("json"))?)),
            None => None,
        },
        None => None,
    };
    if let Some(said) = said {
        html += &format!("<pre>{}</pre>\n", escaped(&said));
    }
    Ok(html)
}

/// Reads a result that a command has kept as JSON.
pub fn json(path: &Path) -> Result<Value, Failure> {
    serde_json::from_str(&read_text(path)?).map_err(|error| Failure::at(path, error))
}

/// Returns the command that made a table, which is its first comment.
fn command(dir: &Path, stem: &str) -> Result<String, Failure> {
    let path = dir.join(format!("{stem}.csv"));
    if !path.is_file() {
        return Ok(String::new());
    }
    let text = read_text(&path)?;
    Ok(text.lines().next().and_then(|line| line.strip_prefix("# ")).unwrap_or_default().to_string())
}

/// A table read back.
struct Rows {
    /// The comments above, without their marks.
    comments: Vec<String>,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Rows {
    /// Reads CSV below comments.
    fn read(text: &str) -> Self {
        let mut all = Vec::new();
        let (mut row, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
        let comments = || text.lines().take_while(|line| line.starts_with('#'));
        let body: usize = comments().map(|line| line.len() + 1).sum();
        let comments = comments().map(|line| line.trim_start_matches('#').trim().to_string()).collect();
        let mut chars = text.get(body..).unwrap_or_default().chars().peekable();
        while let Some(c) = chars.next() {
            match c {
                '"' if is_quoted && chars.peek() == Some(&'"') => {
                    chars.next();
                    cell.push('"');
                }
                '"' => is_quoted = !is_quoted,
                ',' if !is_quoted => row.push(std::mem::take(&mut cell)),
                '\n' if !is_quoted => {
                    row.push(std::mem::take(&mut cell));
                    all.push(std::mem::take(&mut row));
                }
                c => cell.push(c),
            }
        }
        let mut rows = all.into_iter();
        let columns: Vec<String> = rows.next().unwrap_or_default();
        let whole = rows.filter(|row: &Vec<String>| row.len() == columns.len()).collect();
        Self { comments, columns, rows: whole }
    }

    /// Returns the table for `hpuRows`; a number for a cell that is one.
    fn html(&self, stem: &str) -> String {
        if self.rows.len() > ROWS {
            return format!("<p>{stem}.csv has {} rows, which are not shown here.</p>\n", self.rows.len());
        }
        let id = format!("rows-{}", stem.replace(|c: char| !c.is_ascii_alphanumeric(), "-"));
        let value = |cell: &String| match cell.parse::<f64>() {
            _ if cell.is_empty() => Value::Null,
            Ok(number) if number.is_finite() => Value::from(number),
            _ => Value::from(cell.as_str()),
        };
        let rows: Vec<Vec<Value>> = self.rows.iter().map(|row| row.iter().map(value).collect()).collect();
        let [x, y, color] = VIEWS.iter().find(|(name, _)| *name == stem).map_or([""; 3], |(_, view)| *view);
        // A comment such as `x: wall.stiffness in N.m/rad` tells the meaning of a column.
        let meanings = self.comments.iter().filter_map(|comment| comment.split_once(": "));
        let about: serde_json::Map<String, Value> = meanings
            .filter(|(name, _)| self.columns.iter().any(|column| column == name))
            .map(|(name, meaning)| (name.to_string(), Value::from(meaning)))
            .collect();
        let table = json!({ "columns": self.columns, "rows": rows, "x": x, "y": y, "color": color, "about": about });
        format!("<div data-rows=\"{id}\"></div>\n{}", data(&id, &table))
    }
}
