//! Pages, as the command shows them.

use std::path::{Path, PathBuf};

use hpu_chart::Picture;
use hpu_page::Page;
use serde_json::{Value, json};

use crate::shell::files::file_lines;
use crate::shell::{Failure, Folder, print, print_json, verdict};

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

/// Returns where the rows of a stopped command are kept.
pub fn kept(out: Option<&Path>) -> String {
    out.map_or("none is kept; with -o DIR they would be".to_string(), |dir| {
        format!("kept in {}; the same command goes on from there", dir.display())
    })
}

/// The files of a result by their names, and its pictures.
pub type Files = (Vec<(String, String)>, Vec<Picture>);

/// Writes the files and pictures of a result, if there is a folder, and prints it: as text, or as one JSON object whose
/// `files` are their places. `made` makes files and pictures.
pub fn give(
    (text, mut object): (&str, Value),
    folder: Option<Folder>,
    as_json: bool,
    made: impl FnOnce() -> Result<Files, Failure>,
) -> Result<(), Failure> {
    let mut places = Vec::new();
    if let Some(mut folder) = folder {
        let (files, pictures) = made()?;
        files.iter().try_for_each(|(name, content)| folder.write(name, content))?;
        pictures.iter().try_for_each(|picture| folder.draw(picture))?;
        places = folder.commit()?;
    }
    if as_json {
        object["files"] = json!(places);
        return print_json(&object);
    }
    print(&format!("{text}{}", file_lines(&places)))
}

/// Adds the files that were written.
pub fn files(page: &mut Page, files: &[PathBuf]) {
    page.data("files", files);
    for file in files {
        page.line("file", file.display().to_string());
    }
}
