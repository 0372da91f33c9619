#![doc = include_str!("../README.md")]
//!
//! Results as pages: a verb makes one [`Page`] of its result, and text, JSON, HTML, CSV and Parquet are renderings of
//! it. [`summary`] tells what a run has come to, [`trace_table`] writes its rows.
//!
//! A [`Page`] is a list of facts, tables and notes in the order in which a reader meets them. Each part says what
//! belongs to which rendering: a fact without a label is in the JSON alone, a fact without a key in the text alone, and
//! a [`Column`] names its places. HTML shows what text shows.
//!
//! ```
//! use hpu_page::{Cell, Column, Page, Table};
//!
//! struct Run { method: &'static str, rms_m: Option<f64>, edges: u64, settled: bool }
//! let runs = [
//!     Run { method: "hybrid", rms_m: Some(2.5e-6), edges: 1200, settled: true },
//!     Run { method: "sampled, held", rms_m: None, edges: 80, settled: false },
//! ];
//! let table = Table::of("runs", &runs, [
//!     Column::text("method", "method").of(|run: &Run| run.method),
//!     Column::number("rms_m", "rms").unit("um").of(|run: &Run| {
//!         Cell::new(run.rms_m).shown(run.rms_m.map_or("-".into(), |rms_m| format!("{:.1}", 1e6 * rms_m)))
//!     }),
//!     Column::integer("work.edges", "edges").file("edges").of(|run: &Run| run.edges),
//!     Column::flag("settled", "").data().of(|run: &Run| run.settled),
//! ]);
//! let mut page = Page::default();
//! page.fact("scene", "scene", "wall", "wall at 50 MHz").data("seed", 7);
//! page.note("").table(table);
//!
//! assert_eq!(page.text(), "\
//! scene      wall at 50 MHz
//!
//! method         rms um  edges
//! hybrid            2.5   1200
//! sampled, held       -     80
//! ");
//! assert_eq!(page.tables().next().unwrap().csv(&["hpu example"]), r#"## hpu example
//! method,rms_m,edges,settled
//! hybrid,2.5e-6,1200,true
//! "sampled, held",,80,false
//! "#.replace("##", "#"));
//! assert_eq!(page.json(), serde_json::json!({
//!     "scene": "wall",
//!     "seed": 7,
//!     "runs": [
//!         { "method": "hybrid", "rms_m": 2.5e-6, "work": { "edges": 1200 }, "settled": true },
//!         { "method": "sampled, held", "rms_m": null, "work": { "edges": 80 }, "settled": false },
//!     ],
//! }));
//! ```

mod cell;
pub mod device;
pub mod heard;
mod html;
#[cfg(not(target_family = "wasm"))]
mod parquet;
pub mod quantities;
pub mod summary;
mod table;
#[cfg(not(target_family = "wasm"))]
pub mod trace_table;

use serde::Serialize;
use serde_json::{Map, Value as Json};

pub use cell::{Cell, Value, as_json, quoted};
pub use html::escaped;
#[cfg(not(target_family = "wasm"))]
pub use parquet::{Parquet, ParquetFile, Rows, write_parquet};
pub use table::{Column, Field, Kind, Place, Table, csv_line, write_csv};

/// The least width of the labels of facts.
const LABEL: usize = 10;

/// A part of a page.
enum Part {
    /// `key` and `value` for the JSON, unless the key is empty; `label` and `text` for the text, unless `text` is
    /// `None`.
    Fact {
        key: String,
        value: Value,
        label: String,
        text: Option<String>,
    },
    Table(Table),
    /// A page inside the page: one object of the list at its key.
    Section(String, Page),
    /// A line of text, or several.
    Note(String),
}

/// A result, with everything that text, JSON, HTML and CSV tell of it. See the [module](self).
#[derive(Default)]
pub struct Page {
    parts: Vec<Part>,
    label: usize,
}

impl Page {
    /// Returns an empty page whose labels are at least so wide.
    pub fn labelled(label: usize) -> Self {
        Self { parts: Vec::new(), label }
    }

    /// Adds a fact for text and JSON. A key with dots stands in objects: `energy.hand_j`.
    pub fn fact(&mut self, key: &str, label: &str, value: impl Into<Value>, text: impl Into<String>) -> &mut Self {
        self.push(key, value.into(), label, Some(text.into()))
    }

    /// Adds a fact for the JSON alone, as serde writes it.
    ///
    /// # Panics
    ///
    /// Panics if a map of the value has keys that are no text.
    pub fn data(&mut self, key: &str, value: impl Serialize) -> &mut Self {
        self.push(key, Value::of(value), "", None)
    }

    /// Adds a line with a label for the text alone. An empty label goes on with the fact above.
    pub fn line(&mut self, label: &str, text: impl Into<String>) -> &mut Self {
        self.push("", Value::Absent, label, Some(text.into()))
    }

    fn push(&mut self, key: &str, value: Value, label: &str, text: Option<String>) -> &mut Self {
        self.parts.push(Part::Fact { key: key.into(), value, label: label.into(), text });
        self
    }

    /// Adds a line without a label, or several, for the text alone. An empty text is an empty line.
    pub fn note(&mut self, text: impl Into<String>) -> &mut Self {
        self.parts.push(Part::Note(text.into()));
        self
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.parts.push(Part::Table(table));
        self
    }

    /// Adds a page inside the page: its text stands here, its JSON is one more object in the list at the key. With an
    /// empty key it has no place in JSON.
    pub fn section(&mut self, key: &str, section: Self) -> &mut Self {
        self.parts.push(Part::Section(key.into(), section));
        self
    }

    /// Adds the parts of another page.
    pub fn append(&mut self, other: Self) -> &mut Self {
        self.parts.extend(other.parts);
        self
    }

    /// Returns the tables in their order.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.parts.iter().filter_map(|part| if let Part::Table(table) = part { Some(table) } else { None })
    }

    /// Returns the page as text without colours.
    pub fn text(&self) -> String {
        self.painted(&|text, _| text.to_string())
    }

    /// Returns the page as text. `paint` colours a cell that is marked as good or bad.
    pub fn painted(&self, paint: &dyn Fn(&str, bool) -> String) -> String {
        let labels = self.parts.iter().filter_map(|part| match part {
            Part::Fact { label, text: Some(_), .. } => Some(label.chars().count()),
            _ => None,
        });
        let width = labels.fold(self.label.max(LABEL), usize::max);
        let mut page = String::new();
        for part in &self.parts {
            match part {
                Part::Fact { label, text: Some(text), .. } => {
                    page += format!("{label:<width$} {text}").trim_end();
                    page.push('\n');
                }
                Part::Fact { .. } => {}
                Part::Table(table) => page += &table.painted(paint),
                Part::Section(_, section) => page += &section.painted(paint),
                Part::Note(text) => {
                    page += text.trim_end_matches('\n');
                    page.push('\n');
                }
            }
        }
        page
    }

    /// Returns the page as one JSON object: facts by their keys, and each table that has a key as a list of its rows.
    pub fn json(&self) -> Json {
        let mut object = Map::new();
        for part in &self.parts {
            match part {
                Part::Fact { key, value, .. } => put(&mut object, key, value.json()),
                Part::Table(table) => put(&mut object, table.key(), Some(table.json())),
                Part::Section(key, _) if key.is_empty() => {}
                Part::Section(key, section) => {
                    let list = object.entry(key.as_str()).or_insert_with(|| Json::Array(Vec::new()));
                    list.as_array_mut().expect("a key of sections has a list").push(section.json());
                }
                Part::Note(_) => {}
            }
        }
        Json::Object(object)
    }
}

/// Puts a value at a key; a key with dots leads through objects. An empty key, or no value, puts nothing.
fn put(object: &mut Map<String, Json>, key: &str, value: Option<Json>) {
    let Some(value) = value.filter(|_| !key.is_empty()) else { return };
    match key.split_once('.') {
        None => drop(object.insert(key.to_string(), value)),
        Some((first, rest)) => {
            let inner = object.entry(first).or_insert_with(|| Json::Object(Map::new()));
            put(inner.as_object_mut().expect("a key that leads on is an object's"), rest, Some(value));
        }
    }
}
