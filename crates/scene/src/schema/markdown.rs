//! The keys as the tables of the documentation.

use std::fmt::Write as _;

use crate::schema::KeyRow;

/// Returns these keys in Markdown, with a table for the keys of a section that the same kinds take.
pub(crate) fn markdown(rows: impl Iterator<Item = KeyRow>) -> String {
    grouped(rows).iter().map(|group| table(group)).collect::<Vec<_>>().join("\n")
}

/// Returns the rows of a section in groups of the same kinds, in the order of each group's first row.
pub fn grouped(rows: impl Iterator<Item = KeyRow>) -> Vec<Vec<KeyRow>> {
    let mut groups: Vec<Vec<KeyRow>> = Vec::new();
    for row in rows {
        let of_group = |group: &&mut Vec<KeyRow>| (group[0].section, group[0].kinds) == (row.section, row.kinds);
        match groups.iter_mut().find(of_group) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    groups
}

fn table(group: &[KeyRow]) -> String {
    let mut text = group.first().map_or(String::new(), |row| format!("{}\n\n", row.heading()));
    text += "| Key | Unit | Default | Accepted | Meaning |\n|---|---|---|---|---|\n";
    for row in group {
        let cells = [format!("`{}`", row.key), row.unit(), row.default(), row.accepted(), row.meaning.to_string()];
        let _ = writeln!(text, "| {} |", cells.map(|cell| escaped(&cell)).join(" | "));
    }
    text
}

impl KeyRow {
    /// Returns the section and the kinds that take the key, as in "`[hand]` of `prescribed`".
    pub fn heading(&self) -> String {
        let kinds: Vec<_> = self.kinds.iter().map(|kind| format!("`{kind}`")).collect();
        let kinds = if kinds.is_empty() { String::new() } else { format!(" of {}", kinds.join(", ")) };
        match (self.section, kinds.as_str()) {
            ("", "") => "Every scene".into(),
            ("", kinds) => format!("Scenes{kinds}"),
            (section, kinds) => format!("`[{section}]`{kinds}"),
        }
    }
}

/// Returns the text of a cell; brackets outside of code are escaped, because they would be links.
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
