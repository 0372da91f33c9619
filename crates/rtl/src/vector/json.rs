//! Vectors as JSON: everything that is known of a set, and the SHA-256 of what is written.
//!
//! One key a line, one row a line. The last key is the SHA-256, in hex, of all other lines, so that
//! `grep -v '"sha256"' FILE | sha256sum` prints it again. Words are decimal integers in units of their least
//! significant bit, up to 64 bits: a reader must not take them for floats.

use std::fmt;

use hpu_datapath::Generic;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use super::{Column, Header, Vectors};

/// Where the inputs of a set come from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Source {
    /// Corner cases.
    Directed,
    /// A seed.
    Random {
        /// The seed.
        seed: u64,
    },
    /// What a loop, or a block in it, saw in a scene.
    Scene {
        /// Name of the scene.
        scene: String,
        /// What was changed of it, as `KEY=VALUE`.
        settings: Vec<String>,
        /// The scene's own seed.
        seed: u64,
    },
    /// A lookup table: every address.
    Table,
}

/// Where a set comes from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Origin {
    /// Label of the block's configuration, when it is one of those that are listed.
    pub variant: Option<String>,
    /// The inputs.
    pub source: Source,
}

/// Why a JSON file was refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum JsonError {
    /// Not one line is the SHA-256, or more than one.
    NoDigest,
    /// The other lines have another SHA-256.
    Edited {
        /// What the file says.
        told: String,
        /// What its other lines have.
        found: String,
    },
    /// No JSON.
    Syntax {
        /// The line.
        line: usize,
        /// What the parser says of it.
        said: String,
    },
    /// No configuration is called so, with these columns and generics.
    Unknown {
        /// What the file calls the block.
        block: Value,
    },
    /// A row that is no list of as many words as there are columns.
    Row {
        /// Which one, counted from 1.
        row: usize,
        /// Number of columns.
        expected: usize,
    },
    /// A value that the column's format does not hold.
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
    /// The line of the refused text, counted from 1; the first where none is to blame.
    #[must_use]
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

/// The line of a row, counted from 1, in a file with a row a line.
#[must_use]
pub fn row_line(text: &str, row: usize) -> usize {
    let rows = text.lines().position(|line| line.contains("\"rows\"")).unwrap_or(0);
    (rows + 1 + row).min(text.lines().count().max(1))
}

/// The line that is not part of its own digest.
const DIGEST: &str = "\"sha256\"";

/// SHA-256 of all lines but its own.
fn digest(text: &str) -> String {
    let mut sha = Sha256::new();
    for line in text.split_inclusive('\n').filter(|line| !line.contains(DIGEST)) {
        sha.update(line);
    }
    sha.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What a header says, by key.
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
    /// The set as JSON, see `json.rs`.
    #[must_use]
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

    /// Reads a JSON file, whose header must be one of these.
    ///
    /// # Errors
    ///
    /// [`JsonError`] when the file was changed since it was written, or says what no set can be.
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

/// A list, one element a line.
fn list(key: &str, elements: impl Iterator<Item = String>) -> String {
    format!("\"{key}\": [\n{}\n],\n", elements.collect::<Vec<_>>().join(",\n"))
}
