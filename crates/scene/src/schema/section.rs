//! One section of a scene: its items, their places, and the errors at them. `keys/reading.rs` reads keys by their rows.

use toml_edit::{Item, TableLike, Value};

use crate::schema::Schema;
use crate::schema::parameter::{Origin, Parameter, ParameterValue, Parameters};
use crate::schema::quantity::{Axis, Dimension, SHAFT, Sense};
use crate::schema::source::{Places, SceneError, Source, join};
use crate::text::message::excerpt;

/// One table of the scene. A missing table reads as an empty one.
pub(crate) struct Section<'a> {
    schema: &'static Schema,
    places: &'a Places,
    parameters: &'a Parameters,
    axis: &'static Axis,
    path: String,
    table: Option<&'a dyn TableLike>,
    /// Parts that the scene names, whose data stand where the table has none.
    parts: Vec<(Origin, &'a dyn TableLike)>,
}

impl<'a> Section<'a> {
    pub(crate) fn root(source: &'a Source) -> Self {
        let Source { schema, places, parameters, .. } = source;
        Self {
            schema,
            places,
            parameters,
            axis: &SHAFT,
            path: String::new(),
            table: Some(source.table()),
            parts: Vec::new(),
        }
    }

    /// Returns the section with its quantities of the device's motion in the dimensions of an axis.
    pub fn along(self, axis: &'static Axis) -> Self {
        Self { axis, ..self }
    }

    /// Returns the same section with its quantities of motion in the dimensions of another axis.
    pub fn alike(&self, axis: &'static Axis) -> Section<'a> {
        let Self { schema, places, parameters, table, .. } = *self;
        Section { schema, places, parameters, axis, path: self.path.clone(), table, parts: self.parts.clone() }
    }

    /// Returns the section with the data of a part, if there is one, where it has none of its own.
    pub fn with(mut self, part: Option<(Origin, &'a dyn TableLike)>) -> Self {
        self.parts.extend(part);
        self
    }

    /// The dimensions of the device's motion.
    pub fn axis(&self) -> &'static Axis {
        self.axis
    }

    /// Every key that a scene may have.
    pub(super) fn schema(&self) -> &'static Schema {
        self.schema
    }

    /// The section's name; empty for the scene itself.
    pub fn path(&self) -> &str {
        &self.path
    }

    pub fn key(&self, key: &str) -> String {
        join(&self.path, key)
    }

    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.error(&self.key(key), reason)
    }

    pub fn section(&self, key: &str) -> Result<Section<'a>, SceneError> {
        let table = match self.own(key) {
            None => None,
            Some(item) => match item.as_table_like() {
                Some(table) => Some(table),
                None => {
                    let auto =
                        if self.key(key) == "model" { ", or model = \"auto\" for what hpu fit chooses" } else { "" };
                    return Err(self.error(key, format!("a section is expected; write [{}]{auto}", self.key(key))));
                }
            },
        };
        let Self { schema, places, parameters, axis, .. } = *self;
        let below = |(origin, data): &(Origin, &'a dyn TableLike)| Some((*origin, data.get(key)?.as_table_like()?));
        let parts = self.parts.iter().filter_map(below).collect();
        Ok(Section { schema, places, parameters, axis, path: self.key(key), table, parts })
    }

    /// Returns what the scene itself has.
    fn own(&self, key: &str) -> Option<&'a Item> {
        self.table.and_then(|table| table.get(key))
    }

    pub fn get(&self, key: &str) -> Option<&'a Item> {
        self.own(key).or_else(|| self.parts.iter().find_map(|(_, data)| data.get(key)))
    }

    /// Returns the keys that are present.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.table.into_iter().flat_map(|table| table.iter()).map(|(key, _)| key)
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Returns an error about the key itself, not its value.
    pub fn key_error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.key_error(&self.key(key), reason)
    }

    /// Returns the error for an unknown key, with the text to write instead.
    pub fn unknown(&self, key: &str, instead: &str) -> SceneError {
        self.key_error(key, format!("unknown key; {instead}"))
    }

    /// Notes a parameter's value: with the origin of its key if the key is present, else with `otherwise`.
    pub fn note(&self, key: &str, value: ParameterValue, unit: &'static str, otherwise: Origin) {
        let path = self.key(key);
        let of_part = self.parts.iter().find(|(_, data)| data.contains_key(key)).map(|(origin, _)| *origin);
        let origin = if self.own(key).is_some() { self.places.origin(&path) } else { of_part.unwrap_or(otherwise) };
        self.parameters.note(Parameter { key: path, value, unit, origin });
    }

    /// Reads a quantity from an item; `beyond` returns words of its own for values that are refused.
    pub fn quantity_of(
        &self,
        key: &str,
        item: &Item,
        dimension: &Dimension,
        sense: Sense,
        beyond: fn(f64) -> Option<String>,
    ) -> Result<f64, SceneError> {
        let value = match item {
            Item::Value(Value::Integer(number)) => Some(*number.value() as f64),
            Item::Value(Value::Float(number)) => Some(*number.value()).filter(|number| number.is_finite()),
            Item::Value(Value::String(text)) => dimension.parse(text.value()),
            _ => None,
        };
        let value = value.ok_or_else(|| {
            self.error(key, format!("{} is not {}: write {}", shown(item), dimension.name, dimension.accepted()))
        })?;
        match sense.refuses(dimension, value, &shown(item)) {
            None => Ok(value),
            Some(reason) => Err(self.error(key, beyond(value).unwrap_or(reason))),
        }
    }
}

/// Returns a value as it was written, between backticks.
pub(crate) fn shown(item: &Item) -> String {
    match item {
        Item::Value(Value::String(text)) => format!("`{}`", excerpt(text.value())),
        Item::Value(value) => format!("`{}`", excerpt(value.to_string().trim())),
        _ => "a section".to_string(),
    }
}
