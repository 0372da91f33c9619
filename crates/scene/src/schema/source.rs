//! The scene's text as a tree that remembers the place of every key and value, with the `--set` overrides applied.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use toml_edit::{Array, Document, DocumentMut, InlineTable, Item, Key, TableLike, Value};

use crate::schema::Schema;
use crate::schema::parameter::{Origin, Parameters};
use crate::text::message::{Lines, excerpt};

/// The reason why a scene, or a text, was refused: place, key, and what is accepted instead.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SceneError {
    place: String,
    key: String,
    reason: String,
    /// The other errors of the scene, in the order of the file.
    others: Vec<SceneError>,
}

impl SceneError {
    /// Returns an error about no key: of a file, or of an argument if `place` is empty.
    pub(crate) fn at(place: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { place: place.into(), key: String::new(), reason: reason.into(), others: Vec::new() }
    }

    /// Returns this error with others of the same scene: those at other keys, in the order of the file.
    pub(crate) fn with(self, mut others: Vec<Self>) -> Self {
        others.retain(|other| other.key != self.key);
        others.sort_by_cached_key(Self::line_and_column);
        Self { others, ..self }
    }

    /// Returns line and column; an override has none and comes first.
    fn line_and_column(&self) -> (u32, u32) {
        let mut numbers = self.place.rsplitn(3, ':').map(|number| number.parse().unwrap_or(0));
        let column = numbers.next().unwrap_or(0);
        (numbers.next().unwrap_or(0), column)
    }

    /// Returns line and column of the first error in its file; `None` for an override, or for the file as a whole.
    pub fn place(&self) -> Option<(u32, u32)> {
        Some(self.line_and_column()).filter(|(line, _)| *line > 0 && !self.is_override())
    }

    /// Returns the refused key, as in `wall.stiffness`; empty for the file as a whole.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns this error and the other errors of its scene, in the order of the file.
    pub fn all(&self) -> impl Iterator<Item = &Self> {
        [self].into_iter().chain(&self.others)
    }

    /// Returns whether the refused value came from an override, not from the file.
    pub fn is_override(&self) -> bool {
        self.place.starts_with(OVERRIDE)
    }
}

/// The beginning of the place of an override.
const OVERRIDE: &str = "--set ";

/// The first error, which is one line; as `{:#}` all errors of the scene, a line each, and their number.
impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for part in [&*self.place, &*excerpt(&self.key)].into_iter().filter(|part| !part.is_empty()) {
            write!(f, "{part}: ")?;
        }
        f.write_str(&self.reason)?;
        if f.alternate() && !self.others.is_empty() {
            for other in &self.others {
                write!(f, "\n{other}")?;
            }
            write!(f, "\n{} errors", self.others.len() + 1)?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneError {}

/// The place of every key of a scene: `file:line:column`, or the `--set` that gave it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Places {
    file: String,
    keys: BTreeMap<String, String>,
    values: BTreeMap<String, String>,
}

impl Places {
    /// Returns an error about a key's value.
    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.error_in(&self.values, key, reason.into())
    }

    /// Returns an error about the key itself.
    pub fn key_error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.error_in(&self.keys, key, reason.into())
    }

    /// Returns the source of the value of a key that is given: file and line, or the override.
    pub fn source(&self, key: &str) -> String {
        let place = self.place_in(&self.values, key);
        match place.rsplit_once(':') {
            Some((line, _)) if !place.starts_with(OVERRIDE) => line.to_string(),
            _ => place,
        }
    }

    /// Returns the origin of the value of a key that is given.
    pub fn origin(&self, key: &str) -> Origin {
        let by_override = self.place_in(&self.values, key).starts_with(OVERRIDE);
        if by_override { Origin::Set } else { Origin::Scene }
    }

    /// Returns whether a key is given.
    pub fn has(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }

    /// Returns an error about a key. A key that is missing is reported at the innermost section that is present.
    fn error_in(&self, places: &BTreeMap<String, String>, key: &str, reason: String) -> SceneError {
        SceneError { place: self.place_in(places, key), key: key.to_string(), reason, others: Vec::new() }
    }

    fn place_in(&self, places: &BTreeMap<String, String>, key: &str) -> String {
        let mut path = key;
        loop {
            match (places.get(path), path.rfind(['.', '['])) {
                (Some(place), _) => return place.clone(),
                (None, Some(end)) => path = &path[..end],
                (None, None) => return format!("{}:1:1", self.file),
            }
        }
    }

    fn note(&mut self, lines: &Lines, path: &str, key: Option<&Key>, item: &Item) {
        self.note_at(lines, path, key.and_then(Key::span), item.span());
        if let Some(table) = item.as_table_like() {
            for (name, item) in table.iter() {
                self.note(lines, &join(path, name), table.key(name), item);
            }
        } else if let Some(array) = item.as_array() {
            self.note_values(lines, path, array);
        }
    }

    /// Notes the values of an array, which may be arrays and tables.
    fn note_values(&mut self, lines: &Lines, path: &str, array: &Array) {
        for (index, value) in array.iter().enumerate() {
            let path = format!("{path}[{index}]");
            self.note_at(lines, &path, None, value.span());
            match value {
                Value::Array(array) => self.note_values(lines, &path, array),
                Value::InlineTable(table) => {
                    let table: &dyn TableLike = table;
                    for (name, item) in table.iter() {
                        self.note(lines, &join(&path, name), table.key(name), item);
                    }
                }
                _ => {}
            }
        }
    }

    /// Notes the place of a key, or of a value without one, and of its value.
    fn note_at(&mut self, lines: &Lines, path: &str, key: Option<Range<usize>>, value: Option<Range<usize>>) {
        let at = |span: Range<usize>| place(&self.file, lines, span.start);
        let value = value.map(at);
        let key = key.map(at).or_else(|| value.clone());
        self.keys.extend(key.map(|place| (path.to_string(), place)));
        self.values.extend(value.map(|place| (path.to_string(), place)));
    }

    /// Sets the place of `path` and of everything below it to `place`.
    fn replace(&mut self, path: &str, place: &str) {
        for places in [&mut self.keys, &mut self.values] {
            places.retain(|key, _| {
                !key.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
            });
            places.insert(path.to_string(), place.to_string());
        }
    }
}

/// The tree and its places.
pub(crate) struct Source {
    /// Every key that a scene may have.
    pub(super) schema: &'static Schema,
    document: DocumentMut,
    pub places: Places,
    /// The parameters read so far.
    pub parameters: Parameters,
    /// Whether the scene leaves its model to `hpu fit`: `model = "auto"`.
    pub auto: bool,
}

impl Source {
    pub fn parse(
        file: &str,
        text: &str,
        overrides: &[(String, String)],
        schema: &'static Schema,
    ) -> Result<Self, SceneError> {
        // The parser keeps the line ends of Windows in texts of several lines.
        let text = &*text.replace("\r\n", "\n");
        let document = Document::parse(text.to_string()).map_err(|error| SceneError {
            place: place(file, &Lines::new(text), error.span().map_or(0, |span| span.start)),
            key: String::new(),
            reason: format!("not TOML: {}", error.message().replace('\n', "; ")),
            others: Vec::new(),
        })?;
        let mut places = Places { file: file.to_string(), keys: BTreeMap::new(), values: BTreeMap::new() };
        places.note(&Lines::new(text), "", None, document.as_item());
        let document = document.into_mut();
        let mut source = Self { schema, document, places, parameters: Parameters::default(), auto: false };
        for (key, value) in overrides {
            source.set(key, value)?;
        }
        source.auto = is_auto(source.document.get("model"));
        if source.auto {
            source.document.insert("model", Item::Value(Value::InlineTable(InlineTable::new())));
        }
        Ok(source)
    }

    fn set(&mut self, key: &str, text: &str) -> Result<(), SceneError> {
        let place = format!("{OVERRIDE}{}={}", excerpt(key), excerpt(text));
        let refuse = |reason: &str| SceneError {
            place: place.clone(),
            key: key.to_string(),
            reason: reason.to_string(),
            others: Vec::new(),
        };
        let keys = Key::parse(key).map_err(|_| refuse("not a key; write section.key, as in wall.stiffness"))?;
        let (last, sections) = keys.split_last().ok_or_else(|| refuse("no key before the `=`"))?;
        let mut table: &mut dyn TableLike = self.document.as_table_mut();
        let mut path = String::new();
        for section in sections {
            path = join(&path, section.get());
            // A key of the model replaces "auto".
            if table.get(section.get()).is_none() || path == "model" && is_auto(table.get("model")) {
                table.insert(section.get(), Item::Value(Value::InlineTable(InlineTable::new())));
                self.places.replace(&path, &place);
            }
            let below = table.get_mut(section.get()).and_then(Item::as_table_like_mut);
            table = below.ok_or_else(|| refuse(&format!("{path} is a value, not a section")))?;
        }
        let value = text.parse::<Value>().unwrap_or_else(|_| Value::from(text));
        table.insert(last.get(), Item::Value(value));
        self.places.replace(&join(&path, last.get()), &place);
        Ok(())
    }

    /// Returns the scene as a table.
    pub fn table(&self) -> &dyn TableLike {
        self.document.as_table()
    }
}

fn is_auto(model: Option<&Item>) -> bool {
    model.and_then(Item::as_str) == Some("auto")
}

pub(crate) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_string() } else { format!("{path}.{key}") }
}

fn place(file: &str, lines: &Lines, byte: usize) -> String {
    let (line, column) = lines.place(byte);
    format!("{file}:{line}:{column}")
}
