//! Pages as HTML.
//!
//! Facts become lists of labels and texts, tables become tables. A fact or cell that has a place in the JSON carries
//! its key in `data-key` and its value in `data-value`, as JSON, so that a program reads from the HTML the values that
//! it reads from the JSON. A style sheet gives the classes their looks.

use std::fmt::Write as _;

use hpu_cosim::{printable, printable_json};

use crate::cell::Cell;
use crate::table::{Kind, Place, Table};
use crate::{Page, Part, Value};

/// Returns a text with the characters that mean something in HTML written as entities.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Returns the attributes that carry a key and a value; none for a value without a place in the JSON.
fn data(key: &str, value: &Value) -> String {
    let Some(json) = value.json().filter(|_| !key.is_empty()) else { return String::new() };
    format!(r#" data-key="{}" data-value="{}""#, escaped(key), escaped(&printable_json(&json.to_string())))
}

/// Returns a text whose lines end in `<br>`.
fn lines(text: &str) -> String {
    escaped(text.trim_start_matches('\n')).replace('\n', "<br>")
}

impl Page {
    /// Returns the page as HTML, without a document around it. What only the JSON has is left out.
    pub fn html(&self) -> String {
        let mut html = String::new();
        let (mut in_list, mut notes, mut before) = (false, Vec::new(), "");
        for part in &self.parts {
            if !matches!(part, Part::Note(_)) {
                html += &noted(&mut notes);
            }
            match part {
                Part::Fact { text: None, .. } => continue,
                Part::Fact { key, value, label, text: Some(text) } => {
                    if !in_list {
                        html += "<dl class=\"facts\">\n";
                    }
                    // A label is said once.
                    let told = if in_list && before == label { "" } else { label };
                    (in_list, before) = (true, label);
                    let (label, data, text) = (escaped(told), data(key, value), lines(text));
                    let _ = writeln!(html, "<dt>{label}</dt><dd{data}>{text}</dd>");
                    continue;
                }
                _ if in_list => html += "</dl>\n",
                _ => {}
            }
            in_list = false;
            match part {
                Part::Table(table) => html += &table.html(),
                Part::Section(key, section) => {
                    let _ = writeln!(html, "<div data-section=\"{}\">\n{}</div>", escaped(key), section.html());
                }
                Part::Note(text) => notes.push(text.as_str()),
                Part::Fact { .. } => {}
            }
        }
        if in_list {
            html += "</dl>\n";
        }
        html + &noted(&mut notes)
    }

    /// Takes the first table of this key out of the page, as for a place of its own; `None` if there is none.
    pub fn take_table(&mut self, key: &str) -> Option<Table> {
        let at = self.parts.iter().position(|part| matches!(part, Part::Table(table) if table.key() == key))?;
        let Part::Table(table) = self.parts.remove(at) else { unreachable!("it is a table") };
        Some(table)
    }
}

/// Returns the notes that stand one below the other, and forgets them. Blanks within a note align it.
fn noted(notes: &mut Vec<&str>) -> String {
    let text = notes.join("\n");
    notes.clear();
    let text = text.trim_matches('\n');
    if text.is_empty() { String::new() } else { format!("<pre class=\"note\">{}</pre>\n", escaped(text)) }
}

impl Table {
    /// Returns the table as HTML: the columns and rows of the text, with the values of the JSON.
    pub fn html(&self) -> String {
        let told = || self.rows.iter().enumerate().filter(|(row, _)| !self.untold.contains(row)).map(|(_, row)| row);
        // A column without a head that says the same in each row is the label of a line of text.
        let is_label =
            |at: usize| told().map(|row| row[at].text()).collect::<std::collections::BTreeSet<_>>().len() < 2;
        let shown: Vec<_> = self
            .places(Place::Text)
            .filter(|(at, column)| !(column.heading().is_empty() && column.key.is_empty() && is_label(*at)))
            .collect();
        if shown.is_empty() || told().next().is_none() {
            return String::new();
        }
        let mut html = format!("<div class=\"wide\"><table data-table=\"{}\">\n", escaped(&self.key));
        if shown.iter().any(|(_, column)| !column.heading().is_empty()) {
            let heads = shown.iter().map(|(_, column)| {
                format!("<th scope=\"col\"{}>{}</th>", aligned(column.kind()), escaped(&column.heading()))
            });
            let _ = writeln!(html, "<thead><tr>{}</tr></thead>", heads.collect::<String>());
        }
        html += "<tbody>\n";
        for row in told() {
            let cells = shown.iter().map(|(at, column)| {
                let cell: &Cell = &row[*at];
                let good = match cell.good {
                    Some(true) => " good",
                    Some(false) => " bad",
                    None => "",
                };
                let class = format!("{}{good}", if is_number(column.kind()) { "number" } else { "" });
                let class = if class.is_empty() { class } else { format!(" class=\"{}\"", class.trim()) };
                let key = if column.is_in(Place::Json) { column.key.as_str() } else { "" };
                format!("<td{class}{}>{}</td>", data(key, &cell.value), lines(&cell.text()))
            });
            let _ = writeln!(html, "<tr>{}</tr>", cells.collect::<String>());
        }
        html + "</tbody></table></div>\n"
    }
}

fn is_number(kind: Kind) -> bool {
    matches!(kind, Kind::Number | Kind::Integer)
}

fn aligned(kind: Kind) -> &'static str {
    if is_number(kind) { " class=\"number\"" } else { "" }
}
