//! Vectors as JSON: all information about a set, and the SHA-256 of the text.
//!
//! The text has one key a line and one row a line. The last key is the SHA-256, in hex, of all other lines, so that
//! `grep -v '"sha256"' FILE | sha256sum` prints it again. Words are decimal integers of up to 64 bits, in units of
//! their least significant bit. A reader must not read them as floats.

use std::fmt;

use hpu_datapath::Generic;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use hpu_wave::Column;

use super::{Header, Vectors};
use crate::engines::entry::hexadecimal;

/// The source of the inputs of a set.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Source {
    /// Corner cases.
    Directed,
    /// Random words from a seed.
    Random {
        /// The seed.
        seed: u64,
    },
    /// The inputs of a loop, or of a block in it, in a scene.
    Scene {
        /// Name of the scene.
        scene: String,
        /// The changes to the scene, as `KEY=VALUE`.
        settings: Vec<String>,
        /// The scene's own seed.
        seed: u64,
    },
    /// A lookup table, read at every address.
    Table,
}

/// The origin of a set.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Origin {
    /// Label of the block's configuration, if it is one of the listed configurations.
    pub variant: Option<String>,
    /// The source of the inputs.
    pub source: Source,
}

/// Why a JSON file was refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum JsonError {
    /// No line is the SHA-256, or more than one.
    NoDigest,
    /// The SHA-256 of the other lines is not the one in the file.
    Edited {
        /// The SHA-256 in the file.
        told: String,
        /// The SHA-256 of its other lines.
        found: String,
    },
    /// The text is not JSON.
    Syntax {
        /// The line.
        line: usize,
        /// The parser's message.
        said: String,
    },
    /// No known configuration has this name, these columns and these generics.
    Unknown {
        /// The block as the file describes it.
        block: Value,
    },
    /// A row is not a list with one word for each column.
    Row {
        /// The row's number, counted from 1.
        row: usize,
        /// Number of columns.
        expected: usize,
    },
    /// A value does not fit the column's format.
    Word {
        /// Row, counted from 1.
        row: usize,
        /// The column.
        column: Column,
        /// The value as found.
        found: Value,
    },
}

impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NoDigest => {
                write!(f, "one line should be `\"sha256\": \"...\"`, as `hpu vectors --format json` ends its files")
            }
            Self::Edited { told, found } => {
                write!(f, "changed since it was written: its sha256 is told as {told}, and is {found}")
            }
            Self::Syntax { said, .. } => write!(f, "no JSON: {said}"),
            Self::Unknown { block } => {
                write!(f, "no configuration of a block {block} has these columns and generics; see hpu block NAME")
            }
            Self::Row { row, expected } => write!(f, "row {row}: {expected} words expected"),
            Self::Word { row, column: Column { name, format, .. }, found } => {
                let (least, most) = (format.min(), format.max());
                write!(f, "row {row}: {name}: `{found}` is no integer from {least} to {most}, which {format} holds")
            }
        }
    }
}

impl std::error::Error for JsonError {}

impl JsonError {
    /// Returns the line of the refused text to which the error belongs, counted from 1; line 1 when it belongs to none.
    pub fn line(&self, text: &str) -> usize {
        let of =
            |key: &str| (1..).zip(text.lines()).find(|(_, line)| line.contains(key)).map_or(1, |(number, _)| number);
        match self {
            Self::NoDigest => text.lines().count().max(1),
            Self::Edited { .. } => of(DIGEST),
            Self::Syntax { line, .. } => *line,
            Self::Unknown { .. } => of("\"block\""),
            Self::Row { row, .. } | Self::Word { row, .. } => row_line(text, *row),
        }
    }
}

/// Returns the line of a row, counted from 1, in a file with one row a line.
pub fn row_line(text: &str, row: usize) -> usize {
    let rows = text.lines().position(|line| line.contains("\"rows\"")).unwrap_or(0);
    (rows + 1 + row).min(text.lines().count().max(1))
}

/// The key of the line that is not part of the digest.
const DIGEST: &str = "\"sha256\"";

/// Returns the SHA-256 of all lines except the digest's own.
fn digest(text: &str) -> String {
    let mut sha = Sha256::new();
    for line in text.split_inclusive('\n').filter(|line| !line.contains(DIGEST)) {
        sha.update(line);
    }
    hexadecimal(sha.finalize())
}

/// Returns the keys that describe a header.
fn described(header: &Header) -> [(&'static str, Value); 4] {
    let column = |direction| {
        move |Column { name, format, unit }: &Column| {
            let format = json!([u8::from(format.is_signed()), format.int(), format.frac()]);
            json!({ "name": name, "direction": direction, "format": format, "unit": unit })
        }
    };
    let columns = header.inputs.iter().map(column("in")).chain(header.outputs.iter().map(column("out")));
    let generic = |&(name, value): &(&str, Generic)| {
        let value = match value {
            Generic::Integer(value) => json!(value),
            Generic::Boolean(value) => json!(value),
        };
        (name.to_string(), value)
    };
    [
        ("block", json!(header.block)),
        ("clocked", json!(header.clocked)),
        ("generics", Value::Object(header.generics.iter().map(generic).collect::<Map<_, _>>())),
        ("columns", columns.collect()),
    ]
}

fn origin_keys(origin: &Origin) -> Vec<(&'static str, Value)> {
    let mut keys = vec![("variant", json!(origin.variant))];
    keys.extend(match &origin.source {
        Source::Directed => vec![("set", json!("directed"))],
        Source::Random { seed } => vec![("set", json!("random")), ("seed", json!(seed))],
        Source::Scene { scene, settings, seed } => {
            vec![("set", json!("scene")), ("scene", json!(scene)), ("settings", json!(settings)), ("seed", json!(seed))]
        }
        Source::Table => vec![("set", json!("table"))],
    });
    keys
}

impl Vectors {
    /// Returns the set as JSON, in the format of `json.rs`.
    pub fn to_json(&self, origin: &Origin) -> String {
        let line = |(key, value): (&str, Value)| match value {
            // One element a line.
            Value::Array(all) if key == "columns" => list(key, all.iter().map(Value::to_string)),
            value => format!("\"{key}\": {value},\n"),
        };
        let row = |row: &Vec<i64>| {
            let values = self.header.columns().zip(row).map(|(column, &word)| column.format.value(word).to_string());
            format!("[{}]", values.collect::<Vec<_>>().join(","))
        };
        let lines = described(&self.header).into_iter().chain(origin_keys(origin)).map(line);
        let said = format!("{{\n{}{}", lines.collect::<String>(), list("rows", self.rows.iter().map(row)));
        let sha = digest(&format!("{said}}}\n"));
        format!("{said}{DIGEST}: \"{sha}\"\n}}\n")
    }

    /// Reads a JSON file. Its header must be one of `headers`.
    ///
    /// # Errors
    ///
    /// [`JsonError`] when the file was changed after it was written, or does not describe a set.
    pub fn from_json(text: &str, headers: impl IntoIterator<Item = Header>) -> Result<Self, JsonError> {
        let told: Vec<_> = text.lines().filter(|line| line.contains(DIGEST)).collect();
        let told = match told[..] {
            [line] => line.trim().strip_prefix(DIGEST).and_then(|rest| rest.strip_prefix(": \"")?.strip_suffix('"')),
            _ => None,
        };
        let (told, found) = (told.ok_or(JsonError::NoDigest)?, digest(text));
        if told != found {
            return Err(JsonError::Edited { told: told.to_string(), found });
        }
        let json: Value = serde_json::from_str(text)
            .map_err(|error| JsonError::Syntax { line: error.line(), said: error.to_string() })?;
        let same = |header: &Header| described(header).iter().all(|(key, value)| json[*key] == *value);
        let header = headers.into_iter().find(same);
        let header = header.ok_or_else(|| JsonError::Unknown { block: json["block"].clone() })?;
        let columns: Vec<_> = header.columns().cloned().collect();
        let read = |(row, told): (usize, &Value)| {
            let words = told.as_array().filter(|words| words.len() == columns.len());
            let words = words.ok_or(JsonError::Row { row, expected: columns.len() })?;
            let word = |(column, found): (&Column, &Value)| {
                let value = found.as_i64().map(i128::from).or(found.as_u64().map(i128::from));
                let value = value.filter(|&value| column.format.holds(value));
                let word = value.map(|value| column.format.wrap(value));
                word.ok_or_else(|| JsonError::Word { row, column: column.clone(), found: found.clone() })
            };
            columns.iter().zip(words).map(word).collect()
        };
        let rows = json["rows"].as_array().ok_or(JsonError::Row { row: 1, expected: columns.len() })?;
        let rows = (1..).zip(rows).map(read).collect::<Result<_, _>>()?;
        Ok(Self { header, rows })
    }
}

/// Returns a list with one element a line.
fn list(key: &str, elements: impl Iterator<Item = String>) -> String {
    format!("\"{key}\": [\n{}\n],\n", elements.collect::<Vec<_>>().join(",\n"))
}
