//! Scenes on the command line: by path or by shipped name, with `--set`.

use clap::{Args, ValueEnum};
use hpu_cosim::SceneFile;
use hpu_cosim::scene::{Experiment, SceneError, shipped};
use hpu_rtl::LoopScene;
use serde_json::json;

pub use hpu_study::command::{quoted, set_options};

use crate::shell::exit::{Exit, Failure};
use crate::shell::terminal::{print, print_file, print_json};

/// List the shipped scenes
#[derive(Args)]
pub(crate) struct ListArgs {
    /// One JSON object
    #[arg(long)]
    pub json: bool,
    /// Print what a design of your own begins with, to be filled in: its scene, or the steps that check it in
    /// continuous integration
    #[arg(long, value_enum, num_args = 0..=1, default_missing_value = "scene", conflicts_with = "json")]
    pub template: Option<Template>,
}

/// A file to be filled in.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Template {
    /// A scene
    Scene,
    /// A workflow for GitHub Actions, which others read too
    Ci,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Self::Scene => hpu_assets::text("testbench/dut/template.toml"),
            Self::Ci => hpu_assets::text("testbench/dut/ci.yml"),
        }
    }
}

/// Runs `hpu scenes`.
pub fn scenes(args: &ListArgs) -> Result<Exit, Failure> {
    if let Some(template) = args.template {
        print_file(template.text())?;
        return Ok(Exit::Fine);
    }
    list(args.json)
}

/// A scene and what of it is changed.
#[derive(Default, Args)]
pub struct Set {
    /// Change a key of the scene, as in wall.stiffness=2
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = pair)]
    pub set: Vec<(String, String)>,
}

/// Reads `PORT=NET`.
pub(crate) fn port_and_net(text: &str) -> Result<(String, String), String> {
    pair(text).map_err(|_| "write PORT=NET, as in pwm_o=a_high; the scene's name stands before --compare".to_string())
}

/// Reads `KEY=VALUE`.
pub fn pair(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("write KEY=VALUE, as in wall.stiffness=2")?;
    Ok((key.to_string(), value.to_string()))
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

/// Lists the shipped scenes, one line each.
pub fn list(as_json: bool) -> Result<Exit, Failure> {
    let scenes: Vec<_> =
        shipped().iter().map(|shipped| shipped.parse(&[])).collect::<Result<_, SceneError>>().map_err(Failure::file)?;
    if as_json {
        let rows: Vec<_> = scenes.iter().map(|scene| json!({ "name": scene.name, "about": scene.about })).collect();
        print_json(&json!({ "scenes": rows }))?;
    } else {
        let lines = scenes.iter().map(|scene| format!("{:<24} {}\n", scene.name, first_sentence(&scene.about)));
        print(&lines.collect::<String>())?;
    }
    Ok(Exit::Fine)
}

/// Returns the first sentence of a text on one line. A full stop, a space and a capital letter mark its end.
pub fn first_sentence(about: &str) -> String {
    let text = about.split_whitespace().collect::<Vec<_>>().join(" ");
    let ends = text.match_indices(". ").find(|(at, _)| text[at + 2..].starts_with(char::is_uppercase));
    ends.map_or(text.clone(), |(at, _)| text[..=at].to_string())
}
