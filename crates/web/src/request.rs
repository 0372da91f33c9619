//! Requests and refusals.

use std::collections::BTreeMap;
use std::path::PathBuf;

use hpu_cosim::scene::{Datapath, Experiment, SceneError};
use hpu_cosim::{SceneFile, SimulationError};
use serde_json::{Value, json};

/// Why there is no answer: the messages of the command, each with the key of the scene that it is about.
#[derive(Clone, PartialEq, Debug)]
pub struct Refusal(Vec<(String, String)>);

impl Refusal {
    /// Returns the refusal as JSON: a list of `key` and `message`. The key is empty for the scene as a whole.
    pub fn json(&self) -> Value {
        let all = self.0.iter().map(|(key, message)| json!({ "key": key, "message": message }));
        json!({ "errors": all.collect::<Vec<_>>() })
    }
}

impl From<String> for Refusal {
    fn from(message: String) -> Self {
        Self(vec![(String::new(), message)])
    }
}

impl From<hpu_study::Error> for Refusal {
    fn from(error: hpu_study::Error) -> Self {
        error.to_string().into()
    }
}

impl From<SceneError> for Refusal {
    fn from(error: SceneError) -> Self {
        Self(error.all().map(|error| (error.key().to_string(), error.to_string())).collect())
    }
}

impl From<SimulationError> for Refusal {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Scene(error) => error.into(),
            other => other.to_string().into(),
        }
    }
}

/// A request.
pub(crate) struct Request(Value);

/// A scene's source and its overrides.
pub(crate) struct Source {
    file: SceneFile,
    files: BTreeMap<String, Vec<u8>>,
    /// Keys and values that replace those of the text.
    pub(crate) set: Vec<(String, String)>,
}

impl Request {
    pub(crate) fn read(text: &str) -> Result<Self, Refusal> {
        serde_json::from_str(text).map(Self).map_err(|error| format!("a request is JSON: {error}").into())
    }

    /// Returns the name of what is asked for.
    pub(crate) fn verb(&self) -> &str {
        self.0["do"].as_str().unwrap_or_default()
    }

    /// Returns these parts of the request as one text.
    pub(crate) fn of(&self, keys: &[&str]) -> String {
        keys.iter().map(|key| self.0[key].to_string()).collect()
    }

    /// Returns a text of the request.
    pub(crate) fn text(&self, key: &str) -> Result<&str, Refusal> {
        self.0[key].as_str().ok_or_else(|| format!("the request has no text `{key}`").into())
    }

    /// Returns a number of the request.
    pub(crate) fn number(&self, key: &str) -> Result<f64, Refusal> {
        self.0[key].as_f64().ok_or_else(|| format!("the request has no number `{key}`").into())
    }

    /// Returns a whole number of the request.
    pub(crate) fn whole(&self, key: &str) -> Result<usize, Refusal> {
        let number = self.0[key].as_u64().and_then(|number| usize::try_from(number).ok());
        number.ok_or_else(|| format!("the request has no whole number `{key}`").into())
    }

    /// Returns whether a flag of the request is set.
    pub(crate) fn flag(&self, key: &str) -> bool {
        self.0[key] == true
    }

    /// Returns a list of texts; empty if the request has none.
    pub(crate) fn texts(&self, key: &str) -> Vec<&str> {
        self.0[key].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
    }

    /// Returns a list of texts in which `null` is `None`.
    pub(crate) fn options(&self, key: &str) -> Vec<Option<&str>> {
        self.0[key].as_array().into_iter().flatten().map(Value::as_str).collect()
    }

    /// Returns the source of the scene.
    pub(crate) fn source(&self) -> Result<Source, Refusal> {
        let scene = &self.0["scene"];
        let text = |value: &Value| value.as_str().unwrap_or_default().to_string();
        let file = match scene.as_str() {
            Some(name) if name.contains('/') || name.ends_with(".toml") => {
                return Err(format!("no scene `{name}`: a page has no files").into());
            }
            Some(name) => SceneFile::find(name)?,
            None => SceneFile {
                name: text(&scene["name"]),
                text: text(&scene["text"]),
                data: PathBuf::new(),
                is_shipped: false,
            },
        };
        let files = scene["files"].as_object().into_iter().flatten();
        let files = files.map(|(name, data)| (name.clone(), text(data).into_bytes())).collect();
        let set = self.texts("set").into_iter().map(pair).collect::<Result<_, _>>()?;
        Ok(Source { file, files, set })
    }
}

/// Reads `KEY=VALUE`.
fn pair(text: &str) -> Result<(String, String), Refusal> {
    let (key, value) = text.split_once('=').ok_or_else(|| format!("`{text}`: write KEY=VALUE"))?;
    Ok((key.to_string(), value.to_string()))
}

impl Source {
    /// Returns name and text of the scene.
    pub(crate) fn named(&self) -> (&str, &str) {
        (&self.file.name, &self.file.text)
    }

    /// Returns whether the scene is a shipped one.
    pub(crate) fn is_shipped(&self) -> bool {
        self.file.is_shipped
    }

    /// Returns a data file of the scene.
    pub(crate) fn load(&self, file: &str) -> std::io::Result<Vec<u8>> {
        self.files.get(file).map_or_else(|| self.file.load(file), |data| Ok(data.clone()))
    }

    /// Returns the scene under its overrides.
    pub(crate) fn parse(&self) -> Result<Experiment, Refusal> {
        let (name, text) = self.named();
        Ok(Experiment::parse(name, text, &self.set, &mut |file: &str| self.load(file))?)
    }

    /// Returns a scene that can be run here: its model is chosen, and blocks of this project close its loop.
    pub(crate) fn runnable(&self) -> Result<Experiment, Refusal> {
        let experiment = self.parse()?;
        let refused = |key: &str, why: &str| Err(experiment.error(key, why).into());
        if experiment.auto {
            return refused("model", "\"auto\" is chosen by the times of runs; hpu fit tells what to write instead");
        }
        match &experiment {
            Experiment::Axis(scene) if scene.model.datapath == Datapath::Linear => {
                refused("model.datapath", "\"linear\" is a law without a datapath to run; see hpu limits")
            }
            Experiment::Dut(_) => refused("dut", "a design of your own needs its simulator, which a page has not"),
            _ => Ok(experiment),
        }
    }
}
