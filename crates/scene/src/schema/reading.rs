//! Reads a section's keys by their rows, and refuses the keys that have none.

use crate::schema::parameter::Origin;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Key, Otherwise, Quantity, Read};
use crate::text::message::did_you_mean;

impl Section<'_> {
    /// Refuses every key that these kinds of the section do not take.
    pub fn accept(&self, kinds: &[&str]) -> Result<(), SceneError> {
        self.accept_as(self.path(), kinds)
    }

    /// Does the same by the rows of another section, for sections whose own name is free.
    pub fn accept_as(&self, section: &str, kinds: &[&str]) -> Result<(), SceneError> {
        let refused = self.unknown_keys(section, kinds).into_iter().chain(self.alone(section, kinds)).next();
        refused.map_or(Ok(()), Err)
    }

    /// Returns the refusals of keys that these kinds of a section do not take.
    pub fn unknown_keys(&self, section: &str, kinds: &[&str]) -> Vec<SceneError> {
        let names: Vec<_> = self.schema().accepted(section, kinds).map(|key| key.name()).collect();
        let kind = self.get("kind").and_then(|item| item.as_str());
        let kind = kind.map_or(String::new(), |kind| format!(" for kind \"{kind}\""));
        let refused = |unknown: &str| {
            let near = did_you_mean(unknown, &names);
            self.key_error(unknown, format!("unknown key{kind}; accepted here: {}{near}", names.join(", ")))
        };
        self.keys().filter(|key| !names.contains(key)).map(refused).collect()
    }

    /// Returns the refusals of keys that say nothing without another, which is missing.
    pub fn alone(&self, section: &str, kinds: &[&str]) -> Vec<SceneError> {
        let present = self.schema().accepted(section, kinds).filter(|key| self.has(key.name()));
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
}
