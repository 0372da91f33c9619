//! Parses scenes: the reader of their text, joined to the check that their words make a datapath.

use std::io;

use crate::method::Unmade;
use crate::run::closed::Closed;
use crate::scene::{Experiment, LoopWords, Scene, SceneError, Shipped, Text, shipped_file};

impl Experiment {
    /// Parses and validates a scene of any kind.
    ///
    /// `name` is the file's name in error messages. `overrides` are keys and values that replace the file's, in order,
    /// as in `("wall.stiffness", "2 N.m/rad")`. A value that is not TOML is a string; missing sections are created; an
    /// inline table replaces a whole section (`("hand", "{ kind = \"none\" }")`). `load` reads a file that the scene
    /// names.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        Self::read(Text { name, text, overrides }, load, &buildable)
    }

    /// Parses and validates a scene for its plant, which somebody else's logic drives: as [`parse`](Self::parse), but
    /// the scene of a motor may have neither a `[method]` nor a `[dut]`. The plant alone is then returned as a
    /// [`Dut`](Self::Dut) whose design has no files and the [pins](crate::scene::Dut::pins) of a motor.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead; of a plant alone the first
    /// error, with the keys that are unknown.
    pub fn plant(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        Self::read_plant(Text { name, text, overrides }, load, &buildable)
    }
}

impl Scene {
    /// Parses and validates a scene of an axis, as [`Experiment::parse`] does.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with file, line, column, key, and what is accepted instead.
    pub fn parse(
        name: &str,
        text: &str,
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, SceneError> {
        Self::read(Text { name, text, overrides }, load, &buildable)
    }
}

impl Shipped {
    /// Parses the scene, with its own data files, under the overrides.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when an override is refused, or names a file that is not shipped.
    pub fn parse(&self, overrides: &[(String, String)]) -> Result<Experiment, SceneError> {
        Experiment::parse(&format!("testbench/scenes/{}.toml", self.name), self.text, overrides, &mut shipped_file)
    }
}

/// Refuses words that make no datapath.
fn buildable(scene: &Scene, words: &LoopWords) -> Result<(), SceneError> {
    match Closed::new(scene, words) {
        Err(Unmade::Scene(error)) => Err(error),
        Err(Unmade::Config(error)) => Err(scene.error("method.kind", error.to_string())),
        Ok(_) => Ok(()),
    }
}
