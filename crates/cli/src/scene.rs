//! Scenes on the command line: by path or by shipped name, with `--set`.

use std::io;

use clap::Args;
use hpu_cosim::SceneFile;
use hpu_cosim::scene::Experiment;
use hpu_rtl::LoopScene;

use crate::shell::{Failure, values};

pub use hpu_study::command::{quoted, set_options};

/// A scene and what of it is changed.
#[derive(Default, Args)]
pub struct Set {
    /// Change a key of the scene, as in wall.stiffness=2
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = values::pair)]
    pub set: Vec<(String, String)>,
}

/// A scene: its name or path, as the command has it, and its text.
pub type Named = (String, SceneFile);

/// A scene, and its source.
pub struct Loaded {
    /// The scene.
    pub scene: Experiment,
    source: SceneFile,
    overrides: Vec<(String, String)>,
}

impl Loaded {
    /// Reads a scene. `edges`, if given, replaces its duration.
    pub fn new(scene: &str, overrides: &[(String, String)], edges: Option<u64>) -> Result<Self, Failure> {
        Self::of(source(scene)?, overrides, edges)
    }

    /// Reads a scene as [`new`](Self::new) does, from its text.
    pub fn of(source: SceneFile, overrides: &[(String, String)], edges: Option<u64>) -> Result<Self, Failure> {
        let mut overrides = overrides.to_vec();
        let mut parsed = source.parse(&overrides)?;
        if let Some(edges) = edges {
            let duration_s = edges as f64 / parsed.clock.frequency_hz() as f64;
            overrides.push(("run.duration".to_string(), format!("{duration_s:?}")));
            parsed = source.parse(&overrides)?;
        }
        Ok(Self { scene: parsed, source, overrides })
    }

    /// Returns the scene for GHDL.
    pub fn in_vhdl(&self, edges: u64) -> LoopScene {
        LoopScene { source: self.source.clone(), overrides: self.overrides.clone(), edges }
    }

    /// Reads a data file that the scene names.
    ///
    /// # Errors
    ///
    /// As [`SceneFile::load`].
    pub fn data(&self, file: &str) -> io::Result<Vec<u8>> {
        self.source.load(file)
    }

    /// Returns the text of the scene, and its place.
    pub fn source(&self) -> &SceneFile {
        &self.source
    }

    /// Returns the keys that are changed, with their values.
    pub fn overrides(&self) -> &[(String, String)] {
        &self.overrides
    }

    /// Returns the command that runs this scene.
    pub fn command(&self) -> String {
        let place = if self.source.is_shipped { &self.scene.name } else { &self.source.name };
        format!("hpu run {}{}", quoted(place), set_options(&self.overrides))
    }
}

/// Finds a scene's text by its path or by its shipped name.
pub fn source(scene: &str) -> Result<SceneFile, Failure> {
    SceneFile::find(scene).map_err(Failure::file)
}

/// Returns the first sentence of a text on one line. A full stop, a space and a capital letter mark its end.
pub fn first_sentence(about: &str) -> String {
    let text = about.split_whitespace().collect::<Vec<_>>().join(" ");
    let ends = text.match_indices(". ").find(|(at, _)| text[at + 2..].starts_with(char::is_uppercase));
    ends.map_or(text.clone(), |(at, _)| text[..=at].to_string())
}
