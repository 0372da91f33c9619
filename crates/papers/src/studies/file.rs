//! The text of a study's file: values with their places, and all errors at once.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use hpu_cosim::{Lines, did_you_mean, excerpt, utf8};
use toml_edit::{Document, Item, TableLike};

use super::vary::Variables;
use crate::template::Template;

/// The errors of a study's file, each with file, line, column, and what is accepted instead.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FileErrors(Vec<String>);

impl fmt::Display for FileErrors {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0.join("\n"))?;
        if self.0.len() > 1 { write!(f, "\n{} errors", self.0.len()) } else { Ok(()) }
    }
}

impl std::error::Error for FileErrors {}

/// A file being read.
pub(super) struct File<'a> {
    name: &'a str,
    lines: Lines<'a>,
    /// The errors by the byte and the key at which each stands.
    errors: BTreeMap<(usize, String), String>,
}

/// Where an item stands: the bytes of its value, or of the table around it.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    /// The key, with the sections around it.
    pub key: &'a str,
    /// The first byte.
    pub byte: usize,
}

pub(super) fn start(span: Option<Range<usize>>) -> usize {
    span.map_or(0, |span| span.start)
}

impl<'a> File<'a> {
    /// Reads the file as TOML.
    pub fn parse(name: &'a str, bytes: &'a [u8]) -> Result<(Self, Document<String>), FileErrors> {
        let text = utf8(name, bytes).map_err(|error| FileErrors(vec![error.to_string()]))?;
        let mut file = Self { name, lines: Lines::new(text), errors: BTreeMap::new() };
        match Document::parse(text.to_string()) {
            Ok(document) => Ok((file, document)),
            Err(error) => {
                let reason = format!("not TOML: {}", error.message().replace('\n', "; "));
                file.refuse(At { key: "", byte: start(error.span()) }, reason);
                Err(file.errors())
            }
        }
    }

    fn errors(self) -> FileErrors {
        FileErrors(self.errors.into_values().collect())
    }

    /// Returns what was read, or the errors if there are any.
    pub fn finish<T>(self, read: T) -> Result<T, FileErrors> {
        if self.errors.is_empty() { Ok(read) } else { Err(self.errors()) }
    }

    /// Returns file, line and column of a byte.
    pub fn place(&self, byte: usize) -> String {
        let (line, column) = self.lines.place(byte);
        format!("{}:{line}:{column}", self.name)
    }

    /// Notes an error. An item that is read more than once, under other variables, has one error.
    pub fn refuse(&mut self, at: At, reason: impl fmt::Display) {
        let key = if at.key.is_empty() { String::new() } else { format!("{}: ", excerpt(at.key)) };
        let error = format!("{}: {key}{reason}", self.place(at.byte));
        self.errors.entry((at.byte, at.key.to_string())).or_insert(error);
    }

    /// Refuses the keys of a table that are none of these.
    pub fn accept(&mut self, table: &dyn TableLike, path: &str, names: &[&str]) {
        for (name, item) in table.iter().filter(|(name, _)| !names.contains(name)) {
            let span = table.key(name).and_then(toml_edit::Key::span).or_else(|| item.span());
            let near = did_you_mean(name, names);
            let reason = format!("unknown key; accepted here: {}{near}", names.join(", "));
            self.refuse(At { key: &join(path, name), byte: start(span) }, reason);
        }
    }

    /// Returns a text in which variables are replaced; empty if the key is missing, which is an error if it is needed.
    pub fn string(&mut self, table: &dyn TableLike, at: At, name: &str, vars: &Variables, needed: bool) -> String {
        let key = join(at.key, name);
        let Some(item) = table.get(name) else {
            if needed {
                self.refuse(At { key: &key, ..at }, "missing; write a text in quotes");
            }
            return String::new();
        };
        let at = At { key: &key, byte: start(item.span()) };
        match item.as_str().map(|text| vars.replace(text)) {
            Some(Ok(text)) => text,
            Some(Err(error)) => self.refused(at, error),
            None => self.refused(at, "write a text in quotes"),
        }
    }

    /// Returns a template, with variables replaced.
    pub fn template(&mut self, table: &dyn TableLike, at: At, name: &str, vars: &Variables) -> Template {
        let text = self.string(table, at, name, vars, true);
        let here = At { key: &join(at.key, name), byte: table.get(name).map_or(at.byte, |item| start(item.span())) };
        Template::read(&text).unwrap_or_else(|error| self.refused(here, error))
    }

    /// Notes an error, and returns an empty value to go on with.
    pub fn refused<T: Default>(&mut self, at: At, reason: impl fmt::Display) -> T {
        self.refuse(at, reason);
        T::default()
    }

    /// Returns the tables of an array of tables, or the single table; none if the key is missing.
    pub fn tables<'t>(&mut self, table: &'t dyn TableLike, path: &str, name: &str) -> Vec<(&'t dyn TableLike, usize)> {
        match table.get(name) {
            None => Vec::new(),
            Some(Item::ArrayOfTables(all)) => {
                all.iter().map(|table| (table as &dyn TableLike, start(table.span()))).collect()
            }
            Some(item) => match item.as_table_like() {
                Some(one) => vec![(one, start(item.span()))],
                None => {
                    let key = join(path, name);
                    let reason = format!("a section is expected; write [[{key}]]");
                    self.refused(At { key: &key, byte: start(item.span()) }, reason)
                }
            },
        }
    }
}

pub(super) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_string() } else { format!("{path}.{key}") }
}
