//! The scene with the identified values.

use hpu_cosim::SceneFile;
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use super::Identification;
use super::page::{interval, rounded};
use crate::shell::Failure;

/// Returns the scene's text with the identified values, their intervals in comments above it.
pub fn scene(
    source: &SceneFile,
    set: &[(String, String)],
    result: &Identification,
    command: &str,
) -> Result<String, Failure> {
    let mut document: DocumentMut = source
        .text
        .replace("\r\n", "\n")
        .parse()
        .map_err(|error| Failure::file(format!("{}: {error}", source.name)))?;
    let mut comments = format!("# Identified by: {}\n", command.replace('\n', " "));
    for (found, unit) in result.found.found.iter().zip(&result.units) {
        let value = rounded(found.value, found);
        comments += &format!("# {} = {value} {unit} (95 %: {})\n", found.key, interval(found));
        put(&mut document, &found.key, Value::from(value.parse().unwrap_or(found.value)));
    }
    for (key, value) in set.iter().filter(|(key, _)| result.free.iter().all(|free| free.key != *key)) {
        put(&mut document, key, value.parse().unwrap_or_else(|_| Value::from(value.as_str())));
    }
    Ok(format!("{comments}\n{}", document.to_string().trim_start_matches('\n')))
}

/// Puts a value in the place of a key, and keeps what stands around it.
fn put(document: &mut DocumentMut, key: &str, value: Value) {
    let mut parts: Vec<&str> = key.split('.').collect();
    let Some(last) = parts.pop() else { return };
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for part in parts {
        let of_part = table.entry(part).or_insert_with(|| Item::Table(Table::new()));
        let Some(next) = of_part.as_table_like_mut() else { return };
        table = next;
    }
    let mut value = value;
    if let Some(Item::Value(before)) = table.get(last) {
        *value.decor_mut() = before.decor().clone();
    }
    table.insert(last, Item::Value(value));
}
