//! Pages, as the command shows them.

use std::path::PathBuf;

use hpu_chart::Picture;
use hpu_page::Page;
use serde_json::json;

use crate::shell::exit::Failure;
use crate::shell::terminal::{print, print_json, verdict};

/// A page, and the pictures of the same result.
pub struct Answer {
    /// The page.
    pub page: Page,
    /// The pictures, the one to show first before the others.
    pub pictures: Vec<Picture>,
}

/// Prints a page: as one JSON object, or as text with colours on a terminal.
pub fn show(page: &Page, as_json: bool) -> Result<(), Failure> {
    if as_json { print_json(&page.json()) } else { print(&page.painted(&verdict)) }
}

/// Adds the files that were written.
pub fn files(page: &mut Page, files: &[PathBuf]) {
    page.data("files", json!(files));
    for file in files {
        page.line("file", file.display().to_string());
    }
}
