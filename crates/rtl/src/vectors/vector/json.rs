//! Vectors as JSON: all information about a set, and the SHA-256 of the text.
//!
//! The text has one key a line and one row a line. The last key is the SHA-256, in hex, of all other lines, so that
//! `grep -v '"sha256"' FILE | sha256sum` prints it again. Words are decimal integers of up to 64 bits, in units of
//! their least significant bit. A reader must not read them as floats.

use hpu_datapath::Generic;
use hpu_signal::Format;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use hpu_wave::Column;

use super::{Header, VectorError, Vectors};
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
            Generic::Integer(value) => Value::from(value),
            Generic::Boolean(value) => Value::from(value),
        };
        (name.to_string(), value)
    };
    [
        ("block", header.block.into()),
        ("clocked", header.clocked.into()),
        ("generics", Value::Object(header.generics.iter().map(generic).collect::<Map<_, _>>())),
        ("columns", columns.collect()),
    ]
}

fn origin_keys(origin: &Origin) -> Vec<(&'static str, Value)> {
    let mut keys = vec![("variant", origin.variant.clone().into())];
    keys.extend(match &origin.source {
        Source::Directed => vec![("set", "directed".into())],
        Source::Random { seed } => vec![("set", "random".into()), ("seed", (*seed).into())],
        Source::Scene { scene, settings, seed } => {
            vec![
                ("set", "scene".into()),
                ("scene", scene.clone().into()),
                ("settings", settings.clone().into()),
                ("seed", (*seed).into()),
            ]
        }
        Source::Table => vec![("set", "table".into())],
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

    /// Reads a JSON file. Its header must be one of those that `headers` returns for the name of its block and for its
    /// generics, each a name and a value.
    ///
    /// # Errors
    ///
    /// [`VectorError`] when the file was changed after it was written, or does not describe a set.
    pub fn from_json<H: IntoIterator<Item = Header>>(
        text: &str,
        headers: impl FnOnce(&str, &[(String, String)]) -> Result<H, String>,
    ) -> Result<Self, VectorError> {
        let told: Vec<_> = text.lines().filter(|line| line.contains(DIGEST)).collect();
        let told = match told[..] {
            [line] => line.trim().strip_prefix(DIGEST).and_then(|rest| rest.strip_prefix(": \"")?.strip_suffix('"')),
            _ => None,
        };
        let no_digest = "one line should be `\"sha256\": \"...\"`, as `hpu vectors --format json` ends its files";
        let told = told.ok_or_else(|| VectorError::at(text.lines().count().max(1), no_digest))?;
        let found = digest(text);
        let of =
            |key: &str| (1..).zip(text.lines()).find(|(_, line)| line.contains(key)).map_or(1, |(number, _)| number);
        if told != found {
            let why = format!("changed since it was written: its sha256 is told as {told}, and is {found}");
            return Err(VectorError::at(of(DIGEST), why));
        }
        let no_json = |error: serde_json::Error| VectorError::at(error.line(), format!("no JSON: {error}"));
        let json: Value = serde_json::from_str(text).map_err(no_json)?;
        let same = |header: &Header| described(header).iter().all(|(key, value)| json[*key] == *value);
        let generics = json["generics"].as_object().into_iter().flatten();
        let generics: Vec<_> = generics.map(|(name, value)| (name.clone(), value.to_string())).collect();
        let block = json["block"].as_str().unwrap_or_default();
        let headers = headers(block, &generics).map_err(|why| VectorError::at(of("\"block\""), why))?;
        let columns = json["columns"].as_array().into_iter().flatten();
        let formats: Vec<_> = columns.filter_map(format_of).collect();
        let mut headers = headers.into_iter().map(|header| header.with_formats(&formats));
        let header = headers.find(same).ok_or_else(|| {
            let block = &json["block"];
            let why = format!("no configuration of a block {block} has these columns and generics; see hpu block NAME");
            VectorError::at(of("\"block\""), why)
        })?;
        let columns: Vec<_> = header.columns().cloned().collect();
        let refused = |row: usize, why: String| VectorError::at(row_line(text, row), format!("row {row}: {why}"));
        let wrong_row = |row| refused(row, format!("{} words expected", columns.len()));
        let read = |(row, told): (usize, &Value)| {
            let words = told.as_array().filter(|words| words.len() == columns.len()).ok_or_else(|| wrong_row(row))?;
            let word = |(Column { name, format, .. }, found): (&Column, &Value)| {
                let value = found.as_i64().map(i128::from).or(found.as_u64().map(i128::from));
                let word = value.filter(|&value| format.holds(value)).map(|value| format.wrap(value));
                let (least, most) = (format.min(), format.max());
                let why = || format!("{name}: `{found}` is no integer from {least} to {most}, which {format} holds");
                word.ok_or_else(|| refused(row, why()))
            };
            columns.iter().zip(words).map(word).collect()
        };
        let rows = json["rows"].as_array().ok_or_else(|| wrong_row(1))?;
        let rows = (1..).zip(rows).map(read).collect::<Result<_, _>>()?;
        Ok(Self { header, rows })
    }
}

/// Returns the name and the format of a column.
fn format_of(column: &Value) -> Option<(&str, Format)> {
    let part = |index: usize| column["format"][index].as_i64().and_then(|part| i32::try_from(part).ok());
    let format = Format::new(part(0)? == 1, part(1)?, part(2)?).ok()?;
    Some((column["name"].as_str()?, format))
}

/// Returns a list with one element a line.
fn list(key: &str, elements: impl Iterator<Item = String>) -> String {
    format!("\"{key}\": [\n{}\n],\n", elements.collect::<Vec<_>>().join(",\n"))
}
