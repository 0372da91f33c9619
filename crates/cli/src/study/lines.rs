//! The lines of a study, as a sweep does them.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use hpu_cosim::Control;
use hpu_farm::{Failed, Points, Schema, units, untyped};
use hpu_page::{Column, Value};
use hpu_papers::studies::{Study, read};
use hpu_study::map::SceneText;

use super::{Args, VERBS, command_of};
use crate::beside;
use crate::shell::{Exit, Failure};
use crate::work::{Find, Rows, Take, Work};

/// The scenes that a study has read, by the names that it has for them.
pub type Used = Arc<Mutex<BTreeMap<String, SceneText>>>;

/// Reads a study, and notes its scenes.
pub fn study(name: &str, text: &str, find: Find) -> Result<(Study, Used), Failure> {
    let used = Used::default();
    let keep = Arc::clone(&used);
    let load = move |name: &str, set: &[(String, String)]| {
        let source = find(name).map_err(|failure| failure.to_string())?;
        let read = SceneText::read((&source.scene.name, &source.scene.text), set, &mut |file: &str| source.load(file));
        let (text, experiment) = read.map_err(|error| error.to_string())?;
        let mut used = keep.lock().unwrap_or_else(PoisonError::into_inner);
        let known =
            used.entry(name.to_string()).or_insert_with(|| SceneText { files: BTreeMap::new(), ..text.clone() });
        known.files.extend(text.files);
        Ok(experiment)
    };
    let study = read(name, text.as_bytes(), &VERBS, Arc::new(load)).map_err(Failure::file)?;
    Ok((study, used))
}

/// The lines of a study.
pub struct Lines {
    study: Study,
    used: Used,
    name: String,
    text: String,
}

impl Lines {
    /// Returns the lines of a study of this name and text.
    pub fn new(name: &str, text: &str, find: Find) -> Result<Self, Failure> {
        let (study, used) = study(name, text, find)?;
        if study.comparison.lines.is_empty() {
            return Err(Failure::file(format!("{name} has no lines")));
        }
        Ok(Self { study, used, name: name.to_string(), text: text.to_string() })
    }

    /// Shows the lines that a sweep has gathered, as `args` ask for.
    pub fn show(&self, args: &Args, rows: Rows) -> Result<Exit, Failure> {
        let files = [self.text.clone().into_bytes()];
        beside::run(&self.study.comparison, &self.command(), &files, &args.to, Some(rows))
    }
}

impl Work for Lines {
    fn schema(&self) -> Schema {
        let place = vec![Column::text("group", ""), Column::text("line", "")];
        Schema::new(place, vec![Column::text("found", "")])
    }

    fn meanings(&self) -> Vec<(String, String)> {
        vec![(
            "found".into(),
            "the line's figures and its text with units, as the journal of hpu study has them".into(),
        )]
    }

    fn command(&self) -> String {
        command_of(Path::new(&self.name))
    }

    fn scenes(&self) -> Vec<(String, SceneText)> {
        let used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        used.iter().map(|(name, scene)| (name.clone(), scene.clone())).collect()
    }

    fn place(&self, point: usize) -> Vec<Value> {
        let line = &self.study.comparison.lines[point];
        vec![Value::from(line.group), Value::from(&line.what)]
    }

    fn count(&self) -> Option<u64> {
        Some(self.study.comparison.lines.len() as u64)
    }

    fn is_adaptive(&self) -> bool {
        false
    }

    fn next(&self, _done: Rows, _control: &Control) -> Result<Points, Failure> {
        Ok(Points::all(self.study.comparison.lines.len() as u64))
    }

    fn run(&self, _done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure> {
        let lines = &self.study.comparison.lines;
        let unit = |index: usize, own: &Control| (lines[index].measure)(own).map(|found| found.map_err(Failed::new));
        units::run_some(points, NonZeroUsize::MIN, control, unit, |line, row| take(line, untyped(&row)))
    }
}
