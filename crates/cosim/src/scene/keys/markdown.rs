//! The keys as the tables of the documentation.

use std::fmt::Write as _;

use super::{Row, rows};

/// Every key, a table for the keys of a section that the same kinds take, in Markdown.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::new();
    let mut last = None;
    for row in rows() {
        let group = (row.section, row.kinds);
        if last != Some(group) {
            let _ = writeln!(
                text,
                "\n{}\n\n| Key | Unit | Default | Accepted | Meaning |\n|---|---|---|---|---|",
                row.heading()
            );
            last = Some(group);
        }
        let cells = [format!("`{}`", row.key), row.unit(), row.default(), row.accepted(), row.meaning.to_string()];
        let _ = writeln!(text, "| {} |", cells.map(|cell| escaped(&cell)).join(" | "));
    }
    text.trim_start().to_string()
}

impl Row {
    /// The section and the kinds that take the key, as in `[hand] of "prescribed"`.
    #[must_use]
    pub fn heading(&self) -> String {
        let section = if self.section.is_empty() { "the scene itself".into() } else { format!("`[{}]`", self.section) };
        let kinds: Vec<_> = self.kinds.iter().map(|kind| format!("`{kind}`")).collect();
        if kinds.is_empty() { section } else { format!("{section} of {}", kinds.join(", ")) }
    }
}

/// Text of a cell: brackets outside of code are no links.
fn escaped(cell: &str) -> String {
    let mut code = false;
    let mut text = String::new();
    for letter in cell.chars() {
        code ^= letter == '`';
        if !code && "[]|<>".contains(letter) {
            text.push('\\');
        }
        text.push(letter);
    }
    text
}
