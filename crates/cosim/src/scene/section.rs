//! Reads one section of a scene. Each reader knows its key's default, range and unit, and names them when it refuses.

use toml_edit::{Item, TableLike, Value};

use super::keys::{self, Key, Otherwise, Quantity, Read};
use super::parameter::{Origin, Parameter, ParameterValue, Parameters};
use super::quantity::{Axis, Dimension, SHAFT, Sense};
use super::source::{Places, SceneError, join};
use crate::message::{did_you_mean, excerpt};

/// One table of the scene. A missing table reads as an empty one.
pub(crate) struct Section<'a> {
    places: &'a Places,
    parameters: &'a Parameters,
    axis: &'static Axis,
    path: String,
    table: Option<&'a dyn TableLike>,
}

impl<'a> Section<'a> {
    pub fn root(places: &'a Places, parameters: &'a Parameters, table: &'a dyn TableLike) -> Self {
        Self { places, parameters, axis: &SHAFT, path: String::new(), table: Some(table) }
    }

    /// Returns the section with its quantities of the device's motion in the dimensions of an axis.
    pub fn along(self, axis: &'static Axis) -> Self {
        Self { axis, ..self }
    }

    /// The dimensions of the device's motion.
    pub fn axis(&self) -> &'static Axis {
        self.axis
    }

    pub fn key(&self, key: &str) -> String {
        join(&self.path, key)
    }

    pub fn error(&self, key: &str, reason: impl Into<String>) -> SceneError {
        self.places.error(&self.key(key), reason)
    }

    pub fn section(&self, key: &str) -> Result<Section<'a>, SceneError> {
        let table = match self.get(key) {
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
        let Self { places, parameters, axis, .. } = *self;
        Ok(Section { places, parameters, axis, path: self.key(key), table })
    }

    pub fn get(&self, key: &str) -> Option<&'a Item> {
        self.table.and_then(|table| table.get(key))
    }

    /// Returns the keys that are present.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.table.into_iter().flat_map(|table| table.iter()).map(|(key, _)| key)
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Returns the error for an unknown key, with the text to write instead.
    pub fn unknown(&self, key: &str, instead: &str) -> SceneError {
        self.places.key_error(&self.key(key), format!("unknown key; {instead}"))
    }

    /// Refuses every key that these kinds of the section do not take.
    pub fn accept(&self, kinds: &[&str]) -> Result<(), SceneError> {
        self.accept_as(&self.path, kinds)
    }

    /// Does the same by the rows of another section, for sections whose own name is free.
    pub fn accept_as(&self, section: &str, kinds: &[&str]) -> Result<(), SceneError> {
        let refused = self.unknown_keys(section, kinds).into_iter().chain(self.alone(section, kinds)).next();
        refused.map_or(Ok(()), Err)
    }

    /// Returns the refusals of keys that these kinds of a section do not take.
    pub fn unknown_keys(&self, section: &str, kinds: &[&str]) -> Vec<SceneError> {
        let names: Vec<_> = keys::accepted(section, kinds).map(|key| key.name()).collect();
        let kind = self.get("kind").and_then(|item| item.as_str());
        let kind = kind.map_or(String::new(), |kind| format!(" for kind \"{kind}\""));
        let refused = |unknown: &str| {
            let near = did_you_mean(unknown, &names);
            let reason = format!("unknown key{kind}; accepted here: {}{near}", names.join(", "));
            self.places.key_error(&self.key(unknown), reason)
        };
        self.keys().filter(|key| !names.contains(key)).map(refused).collect()
    }

    /// Returns the refusals of keys that say nothing without another, which is missing.
    pub fn alone(&self, section: &str, kinds: &[&str]) -> Vec<SceneError> {
        let present = keys::accepted(section, kinds).filter(|key| self.has(key.name()));
        let alone = present.filter_map(|key| {
            let of = key.beside().filter(|of| !self.has(of))?;
            Some(self.error(key.name(), format!("without {of} it says nothing; write {of} too, or leave this out")))
        });
        alone.collect()
    }

    /// Returns the value of a key, or its default.
    pub fn read<V: Read>(&self, key: &Key<V>) -> Result<V::Value, SceneError> {
        key.value.read(self, key.name)
    }

    /// Returns the value of a key if it is present.
    pub fn given<V: Read>(&self, key: &Key<V>) -> Result<Option<V::Value>, SceneError> {
        if self.has(key.name) { self.read(key).map(Some) } else { Ok(None) }
    }

    /// Returns a quantity whose default another part of the scene decides.
    pub fn read_or(&self, key: &Key<Quantity>, otherwise: f64, by: Origin) -> Result<f64, SceneError> {
        key.value.read_or(self, key.name, Otherwise::Is(otherwise), by)
    }

    /// Notes a parameter's value: with the origin of its key if the key is present, else with `otherwise`.
    pub fn note(&self, key: &str, value: ParameterValue, unit: &'static str, otherwise: Origin) {
        let path = self.key(key);
        let origin = if self.has(key) { self.places.origin(&path) } else { otherwise };
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
pub(super) fn shown(item: &Item) -> String {
    match item {
        Item::Value(Value::String(text)) => format!("`{}`", excerpt(text.value())),
        Item::Value(value) => format!("`{}`", excerpt(value.to_string().trim())),
        _ => "a section".to_string(),
    }
}
