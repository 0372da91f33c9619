//! The part of a search's page that depends on the device.

use hpu_page::{Column, Field};
use hpu_study::widths::search::RatedDesign;
use serde_json::Value;

/// The part of a page that depends on the device.
pub struct Shown<'a> {
    /// The columns of a design.
    pub fields: Vec<Field<'a, RatedDesign>>,
    /// The designs of the CSV.
    pub designs: Vec<&'a RatedDesign>,
    /// The text of the reference.
    pub reference: String,
    /// Lines on the conditions, with their labels.
    pub lines: Vec<(&'static str, String)>,
    /// Lines on the smallest design, if there is one.
    pub smallest: Option<String>,
    /// The keys of the JSON that this device alone has.
    pub data: Vec<(&'static str, Value)>,
}

/// Returns a column of a design for the text alone, aligned on the right.
pub fn in_text(head: &str, least: usize) -> Column {
    Column::number("", head).said().least(least)
}

/// Returns a text in one line, cut to so many characters.
pub fn cut(text: &str, most: usize) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.chars().count() <= most { line } else { line.chars().take(most - 1).chain(['\u{2026}']).collect() }
}
