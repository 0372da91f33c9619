//! Scenes on the command line: by path or by shipped name, with `--set`.

use std::io;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use hpu_cosim::did_you_mean;
use hpu_cosim::scene::{Experiment, SceneError, Shipped, shipped, shipped_file};
use hpu_rtl::LoopScene;
use serde_json::json;

use crate::exit::{Exit, Failure};
use crate::input::{read_plain, read_text};
use crate::terminal::{print, print_json};

/// List the shipped scenes
#[derive(Args)]
pub struct ListArgs {
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
            Self::Scene => include_str!("../../../testbench/dut/template.toml"),
            Self::Ci => include_str!("../../../testbench/dut/ci.yml"),
        }
    }
}

/// Runs `hpu scenes`.
pub fn scenes(args: &ListArgs) -> Result<Exit, Failure> {
    if let Some(template) = args.template {
        print(template.text())?;
        return Ok(Exit::Fine);
    }
    list(args.json)
}

/// A scene and what of it is changed.
#[derive(Args)]
pub struct Set {
    /// Change a key of the scene, as in wall.stiffness=2
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = pair)]
    pub set: Vec<(String, String)>,
}

/// Reads `PORT=NET`.
pub fn port_and_net(text: &str) -> Result<(String, String), String> {
    pair(text).map_err(|_| "write PORT=NET, as in pwm_o=a_high; the scene's name stands before --compare".to_string())
}

/// Reads `KEY=VALUE`.
pub fn pair(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("write KEY=VALUE, as in wall.stiffness=2")?;
    Ok((key.to_string(), value.to_string()))
}

/// A scene, and its source.
pub struct Loaded {
    /// The scene.
    pub scene: Experiment,
    name: String,
    text: String,
    overrides: Vec<(String, String)>,
    data: PathBuf,
    is_shipped: bool,
}

impl Loaded {
    /// Reads a scene. `edges`, if given, replaces its duration.
    pub fn new(scene: &str, overrides: &[(String, String)], edges: Option<u64>) -> Result<Self, Failure> {
        let source = source(scene)?;
        let mut overrides = overrides.to_vec();
        let mut parsed = source.parse(&overrides)?;
        if let Some(edges) = edges {
            let duration_s = edges as f64 / parsed.clock.frequency_hz() as f64;
            overrides.push(("run.duration".to_string(), format!("{duration_s:?}")));
            parsed = source.parse(&overrides)?;
        }
        let Source { name, text, data, is_shipped } = source;
        Ok(Self { scene: parsed, name, text, overrides, data, is_shipped })
    }

    /// Returns the scene for GHDL.
    pub fn in_vhdl(&self, edges: u64) -> LoopScene {
        LoopScene {
            name: self.name.clone(),
            text: self.text.clone(),
            overrides: self.overrides.clone(),
            data: self.data.clone(),
            edges,
        }
    }

    /// Returns the command that runs this scene.
    pub fn command(&self) -> String {
        let place = if self.is_shipped { &self.scene.name } else { &self.name };
        format!("hpu run {place}{}", set_options(&self.overrides))
    }
}

/// Returns overrides as options, each after a space.
pub fn set_options(overrides: &[(String, String)]) -> String {
    overrides.iter().map(|(key, value)| format!(" --set {key}={}", quoted(value))).collect()
}

/// Returns a word quoted for a shell.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-+/:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// The text of a scene.
pub struct Source {
    /// The name of the file in errors.
    pub name: String,
    /// Its text.
    pub text: String,
    data: PathBuf,
    is_shipped: bool,
}

/// Reads a scene's text.
pub fn source(scene: &str) -> Result<Source, Failure> {
    let is_path = scene.contains('/') || scene.ends_with(".toml");
    if let (false, Some(Shipped { name, text })) = (is_path, shipped().iter().find(|shipped| shipped.name == scene)) {
        let name = format!("testbench/scenes/{name}.toml");
        return Ok(Source { name, text: (*text).to_string(), data: PathBuf::from("."), is_shipped: true });
    }
    let path = Path::new(scene);
    if !is_path && !path.exists() {
        let names: Vec<_> = shipped().iter().map(|shipped| shipped.name).collect();
        return Err(Failure::file(format!(
            "no scene `{scene}`: neither a file nor one of the shipped {}{}",
            names.join(", "),
            did_you_mean(scene, &names)
        )));
    }
    let text = read_text(path)?;
    let data = path.parent().unwrap_or(Path::new("")).to_path_buf();
    Ok(Source { name: scene.to_string(), text, data, is_shipped: false })
}

impl Source {
    /// Parses the scene with these overrides.
    pub fn parse(&self, overrides: &[(String, String)]) -> Result<Experiment, Failure> {
        let mut load = |file: &str| self.load(file);
        // All errors of the scene, not the first alone.
        let all = |error: SceneError| Failure::file(format!("{error:#}"));
        Experiment::parse(&self.name, &self.text, overrides, &mut load).map_err(all)
    }

    /// Reads a data file that the scene names.
    pub fn load(&self, file: &str) -> io::Result<Vec<u8>> {
        let read = read_plain(&self.data.join(file));
        if self.is_shipped { read.or_else(|error| shipped_file(file).map_err(|_| error)) } else { read }
    }
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
fn first_sentence(about: &str) -> String {
    let text = about.split_whitespace().collect::<Vec<_>>().join(" ");
    let ends = text.match_indices(". ").find(|(at, _)| text[at + 2..].starts_with(char::is_uppercase));
    ends.map_or(text.clone(), |(at, _)| text[..=at].to_string())
}
