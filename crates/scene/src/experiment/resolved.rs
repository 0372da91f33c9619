//! A scene with every key that it takes: the value, its unit, its source and its meaning. `hpu scenes show` prints it
//! as a scene that runs again, and `hpu new` as a scene to begin with.

use std::fmt::Write as _;

use toml_edit::{Item, TableLike, Value};

use crate::experiment::Experiment;
use crate::experiment::audit::{kinds, own_kind};
use crate::experiment::groups::{kinds_of, schema};
use crate::schema::parameter::{Origin, Parameter, ParameterValue};
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source, join};
use crate::schema::{KeyRow, Otherwise, Takes, is_any_name};

/// A key of a scene with the value that a run uses.
#[derive(Clone, PartialEq, Debug)]
pub struct Resolved {
    /// The section; empty for the scene itself.
    pub section: String,
    /// The key.
    pub key: String,
    /// The value as TOML; `None` where the scene does without the key.
    pub toml: Option<String>,
    /// The value in `unit`, or the words about a scene without the key.
    pub value: ParameterValue,
    /// The unit; empty without one.
    pub unit: &'static str,
    /// The source of the value.
    pub source: ValueSource,
    /// The effect of the value.
    pub meaning: &'static str,
    /// The values that the key accepts.
    pub takes: Takes,
}

/// The source of a key's value.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ValueSource {
    /// A place in the scene's file, as in `wall.toml:12`, or an override, as in `--set wall.stiffness=2`.
    Given(String),
    /// The default.
    Default,
    /// Data of the motor or of the arm that the scene names.
    Named(String),
    /// No value: another part of the scene decides, or nothing needs one.
    Derived,
}

impl std::fmt::Display for ValueSource {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Given(place) => f.write_str(place),
            Self::Default => f.write_str("default"),
            Self::Named(what) => f.write_str(what),
            Self::Derived => f.write_str("derived"),
        }
    }
}

/// Returns every key of a scene, section by section. The arguments after the scene are those that it was read from.
///
/// # Errors
///
/// [`SceneError`] if the text is not the scene's.
pub fn resolved(
    scene: &Experiment,
    name: &str,
    text: &str,
    overrides: &[(String, String)],
) -> Result<Vec<Resolved>, SceneError> {
    let source = Source::parse(name, text, overrides, schema())?;
    let root = Section::root(&source);
    let Some((of, device, _)) = kinds(&root) else {
        return Err(root.error("device.kind", "no kind"));
    };
    let resolving = Resolving { of, device, source: &source, parameters: &scene.parameters };
    let mut all = resolving.section(&root, "");
    // A scene's own values stand before its first section.
    all.sort_by_key(|key| !key.section.is_empty());
    Ok(all)
}

struct Resolving<'a> {
    of: &'static str,
    device: &'a str,
    source: &'a Source,
    parameters: &'a [Parameter],
}

impl Resolving<'_> {
    /// Returns the keys of a section and of the sections below.
    fn section(&self, s: &Section, name: &str) -> Vec<Resolved> {
        let own = own_kind(s).map(str::to_string);
        let own = own.or_else(|| Some(self.parameter(&join(name, "kind"))?.value.to_string()));
        let kinds = kinds_of(name, self.of, self.device, own.as_deref());
        let mut all = Vec::new();
        for (key, row) in schema().taken(name, &kinds) {
            let (is_given, path) = (s.has(row.key), join(name, row.key));
            if !is_given && key.beside().is_some_and(|beside| !s.has(beside)) {
                continue;
            }
            if is_any_name(row.key) {
                all.extend(s.keys().map(|any| self.key(s, name, any, &row)));
            } else if row.takes != Takes::Section {
                all.push(self.key(s, name, row.key, &row));
            } else if self.source.auto && path == "model" {
                all.push(Resolved { toml: Some("\"auto\"".into()), ..self.key(s, name, row.key, &row) });
            } else if let (true, Ok(below)) = (is_given || self.is_used(&path), s.section(row.key)) {
                all.extend(self.section(&below, &path));
            }
        }
        // Sections below stand after the section's own keys.
        all.sort_by_key(|key| key.section != name);
        all
    }

    /// Returns whether the run uses a key of a section.
    fn is_used(&self, section: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.key.strip_prefix(section).is_some_and(|k| k.starts_with('.')))
    }

    fn parameter(&self, path: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.key == path)
    }

    fn key(&self, s: &Section, section: &str, key: &str, row: &KeyRow) -> Resolved {
        let path = join(section, key);
        let (given, parameter) = (s.get(key), self.parameter(&path));
        let source = match (given, parameter.map(|parameter| parameter.origin)) {
            (Some(_), _) => ValueSource::Given(self.source.places.source(&path)),
            (None, Some(Origin::Part { kind, name })) => ValueSource::Named(format!("{kind} {name}")),
            (None, Some(Origin::Arm(name))) => ValueSource::Named(format!("model {name}")),
            (None, Some(_)) => ValueSource::Default,
            (None, None) => ValueSource::Derived,
        };
        let toml = given.map(toml).or_else(|| parameter.map(|Parameter { value, unit, .. }| as_toml(value, unit)));
        let value = match (parameter, &toml) {
            (Some(parameter), _) => parameter.value.clone(),
            (None, Some(toml)) => ParameterValue::Text(toml.clone()),
            (None, None) => ParameterValue::Text(row.default()),
        };
        let unit = parameter.map_or("", |parameter| parameter.unit);
        let (section, key) = (section.into(), key.into());
        Resolved { section, key, toml, value, unit, source, meaning: row.meaning, takes: row.takes.clone() }
    }
}

/// Returns a parameter's value as a scene has it.
fn as_toml(value: &ParameterValue, unit: &str) -> String {
    match value {
        ParameterValue::Number(number) if unit.is_empty() || *number == 0.0 => format!("{number:?}"),
        ParameterValue::Number(_) => format!("\"{value} {unit}\""),
        ParameterValue::Integer(_) | ParameterValue::Flag(_) => value.to_string(),
        ParameterValue::Text(text) => Value::from(text.as_str()).to_string(),
    }
}

/// Returns a value as it was written, without the comments around it and on one line, but for texts.
fn toml(item: &Item) -> String {
    let of_table = |table: &dyn TableLike| {
        let pairs = table.iter().map(|(key, item)| format!("{} = {}", quoted(key), toml(item)));
        format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
    };
    match item {
        Item::Value(Value::Array(array)) => {
            format!("[{}]", array.iter().map(|value| toml(&Item::Value(value.clone()))).collect::<Vec<_>>().join(", "))
        }
        Item::Value(Value::InlineTable(table)) => of_table(table),
        Item::Table(table) => of_table(table),
        Item::Value(value) => value.clone().decorated("", "").to_string(),
        _ => item.to_string().trim().to_string(),
    }
}

/// Returns a key as TOML, quoted where it is not made of letters, digits, `_` and `-`.
fn quoted(key: &str) -> String {
    toml_edit::Key::new(key).to_string()
}

/// The most columns of a comment.
const COLUMNS: usize = 118;

/// Returns a text as lines of comments.
fn comment(text: &str) -> String {
    let (mut all, mut line) = (String::new(), String::from("#"));
    for word in text.split_whitespace() {
        if line.len() + 1 + word.len() > COLUMNS {
            let _ = writeln!(all, "{line}");
            line = "#".into();
        }
        let _ = write!(line, " {word}");
    }
    all + &line + "\n"
}

/// The beginning of a scene that `hpu new` wrote. The rest of its line is the command's options.
pub const WRITTEN_BY_NEW: &str = "# Written by `hpu new ";

/// A comment in a scene that `hpu new` wrote, with another value than the default.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ChangedDefault {
    /// The line of the comment, from 1.
    pub line: usize,
    /// The key with its section, as in `wall.damping`.
    pub key: String,
    /// The value in the comment.
    pub commented: String,
    /// The default.
    pub default: String,
}

/// Returns the comments of a scene that `hpu new` wrote whose values are not the defaults. `hpu new` writes each
/// default as a comment, so a scene keeps the defaults of its day. A default that follows from other keys changes with
/// them, and is not compared. Other scenes have comments of any kind, and get an empty list. The arguments after the
/// scene are those that it was read from.
///
/// # Errors
///
/// [`SceneError`] if the text is not the scene's.
pub fn changed_defaults(
    scene: &Experiment,
    name: &str,
    text: &str,
    overrides: &[(String, String)],
) -> Result<Vec<ChangedDefault>, SceneError> {
    let mut changed = Vec::new();
    if !text.starts_with(WRITTEN_BY_NEW) {
        return Ok(changed);
    }
    let all = resolved(scene, name, text, overrides)?;
    let is_fixed = |key: &Resolved| {
        let of_key = |row: &KeyRow| row.section == key.section && row.key == key.key;
        schema().rows().any(|row| of_key(&row) && row.otherwise == Otherwise::Is(key.value.clone()))
    };
    let mut section = "";
    for (index, line) in text.lines().enumerate() {
        let before_comment = line.split('#').next().unwrap_or_default().trim();
        if let Some(name) = before_comment.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = name;
        } else if let Some((key, commented)) = line.strip_prefix("# ").and_then(|pair| pair.split_once(" = "))
            && let Some(key) = all.iter().find(|one| one.section == section && one.key == key)
            && key.source == ValueSource::Default
            && let Some(default) = &key.toml
            && default != commented
            && is_fixed(key)
        {
            let (key, commented, default) = (join(section, &key.key), commented.to_string(), default.clone());
            changed.push(ChangedDefault { line: index + 1, key, commented, default });
        }
    }
    Ok(changed)
}

/// Returns a scene as TOML. The meaning of a key stands above it. `line` returns the key's line, given `key = value`,
/// and decides how a key without a value is told.
pub fn as_scene(all: &[Resolved], line: impl Fn(&Resolved, Option<&str>) -> Option<String>) -> String {
    let mut text = String::new();
    let mut section = "";
    for key in all {
        let pair = key.toml.as_ref().map(|toml| format!("{} = {toml}", quoted(&key.key)));
        let Some(line) = line(key, pair.as_deref()) else { continue };
        if section != key.section {
            section = &key.section;
            let _ = writeln!(text, "\n[{section}]");
        }
        let _ = writeln!(text, "{}{line}", comment(key.meaning));
    }
    text
}
