//! Links from a page to files of the repository, of which the book carries copies.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use mdbook_driver::errors::{Error, Result};

use crate::root;

/// Returns the way from a page to the repository, as links in its source have it.
pub fn to_root(page: &Path) -> String {
    "../".repeat(page.components().count() + 2)
}

/// The files that the book carries beside its pages.
#[derive(Default)]
pub struct Carried {
    /// Files of the repository, each with its place in the book.
    files: BTreeMap<String, String>,
    /// Files made while the book is rendered, by their places.
    made: BTreeMap<String, Vec<u8>>,
}

impl Carried {
    /// Has the book carry a file of the repository, and returns its place in the book. Text gets the ending `.txt`, so
    /// that a browser shows it.
    fn file(&mut self, file: &str) -> Result<String> {
        let folder = root().join(file);
        if folder.is_dir() {
            return self.folder(file, &folder);
        }
        if !folder.is_file() {
            return Err(Error::msg(format!("no file {file} in the repository")));
        }
        let ending = if [".png", ".svg", ".txt"].iter().any(|shown| file.ends_with(shown)) { "" } else { ".txt" };
        // A link to `.md` would lead to a page of the book.
        let place = format!("files/{}{ending}", file.replace(".md", "-md"));
        self.files.insert(file.to_string(), place.clone());
        Ok(place)
    }

    /// Has the book carry the files of a folder and a list of them, whose place it returns.
    fn folder(&mut self, folder: &str, path: &Path) -> Result<String> {
        let mut entries: Vec<_> = fs::read_dir(path)?.collect::<Result<_, _>>()?;
        entries.sort_by_key(fs::DirEntry::file_name);
        let mut list = format!("<!DOCTYPE html><meta charset=\"utf-8\"><title>{folder}</title><h1>{folder}</h1><ul>");
        for entry in entries.iter().filter(|entry| entry.path().is_file()) {
            let name = entry.file_name().to_string_lossy().into_owned();
            let place = self.file(&format!("{folder}/{name}"))?;
            let link = place.rsplit('/').next().unwrap_or(&name);
            list += &format!("<li><a href=\"{link}\">{name}</a></li>");
        }
        let place = format!("files/{folder}/index.html");
        self.made(&place, (list + "</ul>").into_bytes());
        Ok(place)
    }

    /// Has the book carry a made file at this place.
    pub fn made(&mut self, place: &str, content: Vec<u8>) {
        self.made.insert(place.to_string(), content);
    }

    /// Returns the text of a page in which each link to a file of the repository leads to the copy in the book.
    pub fn rewritten(&mut self, text: &str, page: &Path) -> Result<String> {
        let to_top = "../".repeat(page.components().count() - 1);
        let up = format!("]({}", to_root(page));
        let mut parts = text.split(&up);
        let mut whole = parts.next().unwrap_or_default().to_string();
        for part in parts {
            let (file, rest) = part.split_once(')').ok_or_else(|| Error::msg(format!("an open link: {part}")))?;
            let place = self.file(file).map_err(|error| Error::msg(format!("{}: {error}", page.display())))?;
            whole += &format!("]({to_top}{place}){rest}");
        }
        Ok(whole)
    }

    /// Writes the files into the folder of the book.
    pub fn write(&self, root: &Path, out: &Path) -> Result<()> {
        let put = |place: &str, content: &[u8]| -> Result<()> {
            let path = out.join(place);
            fs::create_dir_all(path.parent().unwrap_or(out))?;
            Ok(fs::write(path, content)?)
        };
        self.files.iter().try_for_each(|(file, place)| put(place, &fs::read(root.join(file))?))?;
        self.made.iter().try_for_each(|(place, content)| put(place, content))
    }
}
