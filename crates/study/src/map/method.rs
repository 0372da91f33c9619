//! A method of a map: a label, and what it changes in the scene.

use std::str::FromStr;

/// A layer of a map.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Method {
    /// What it is called.
    pub label: String,
    /// What it changes in the scene.
    pub set: Vec<(String, String)>,
}

impl FromStr for Method {
    type Err = String;

    /// Reads `LABEL:KEY=VALUE,KEY=VALUE`; a comma within brackets or quotes parts nothing.
    fn from_str(text: &str) -> Result<Self, String> {
        const SYNTAX: &str =
            "write LABEL:KEY=VALUE,KEY=VALUE, as in 1khz:method.kind=conventional,method.sample_rate='1 kHz'";
        let (label, changes) = text.split_once(':').unwrap_or((text, ""));
        if label.trim().is_empty() || label.contains('=') {
            return Err(SYNTAX.into());
        }
        let pair = |change: &str| {
            let (key, value) = change.split_once('=').ok_or(SYNTAX)?;
            Ok((key.trim().to_string(), value.trim().to_string()))
        };
        let changes = parts(changes).into_iter().filter(|change| !change.trim().is_empty());
        Ok(Self { label: label.trim().to_string(), set: changes.map(pair).collect::<Result<_, String>>()? })
    }
}

/// What commas part that are in no brackets and no quotes.
fn parts(text: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quoted) = (Vec::new(), 0, 0, false);
    for (at, letter) in text.char_indices() {
        match letter {
            '"' => quoted = !quoted,
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 && !quoted => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}
