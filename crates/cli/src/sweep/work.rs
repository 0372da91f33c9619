//! The points of a sweep, by the verb that they belong to.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_cosim::{Control, SceneFile};
use hpu_study::map::{self, Map, SceneText};
use hpu_study::page::Value;
use hpu_study::sweep::{Points, Schema};
use hpu_study::units::{self, UnitResult};

use super::manifest::Manifest;
use crate::answers::read_words;
use crate::exit::Failure;
use crate::map::Args as MapArgs;
use crate::scene;
use crate::widths::Args as WidthsArgs;

/// Rows by the numbers of their points.
pub type Rows = BTreeMap<usize, UnitResult>;

/// Takes each new row.
pub type Take<'a> = &'a mut dyn FnMut(usize, UnitResult) -> Result<(), Failure>;

/// The points of a verb. The verbs that a sweep can split implement it.
pub trait Work: Sync {
    /// Returns the columns of the files.
    fn schema(&self) -> Schema;
    /// Returns units and meanings of the columns, as keys and values.
    fn meanings(&self) -> Vec<(String, String)>;
    /// Returns the command that runs the same points on one machine.
    fn command(&self) -> String;
    /// Returns the scenes that rows depend on, as the command names them.
    fn scenes(&self) -> Vec<(String, SceneText)>;
    /// Returns the place of a point, as values for the columns.
    fn place(&self, point: usize) -> Vec<Value>;
    /// Whether the points of a wave depend on the rows of the waves before it.
    fn is_adaptive(&self) -> bool;
    /// Returns the points of the next wave when these rows are done; none when the sweep is complete.
    fn next(&self, done: Rows, control: &Control) -> Result<Points, Failure>;
    /// Runs points of the wave that follows these rows, one after the other, and hands over each row. A point has no
    /// row if it took longer than the guard allows, or if `control` stopped it.
    fn run(&self, done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure>;
}

/// The verbs whose points a sweep can split.
pub const VERBS: [&str; 2] = ["map", "widths"];

/// Returns the work of a verb under these words. `find` returns a scene by its name.
pub fn work(verb: &str, words: &[String], find: Find) -> Result<Box<dyn Work>, Failure> {
    Ok(match verb {
        "map" => Box::new(MapWork::new(read_words("map", words)?, find)?),
        "widths" => Box::new(read_words::<WidthsArgs>("widths", words)?.waves(find)?),
        _ => return Err(Failure::usage(format!("a sweep cannot split `{verb}`; it can: {}", VERBS.join(", ")))),
    })
}

/// Returns the work of a manifest.
pub fn of(manifest: &Manifest) -> Result<Box<dyn Work>, Failure> {
    work(&manifest.verb, &manifest.words, &mut |name| scene_of(manifest, name))
}

/// Returns a scene of a manifest.
pub fn scene_of(manifest: &Manifest, name: &str) -> Result<Source, Failure> {
    let found = manifest.scenes.iter().find(|(own, _)| own == name);
    let (_, scene) = found.ok_or_else(|| Failure::file(format!("the manifest has no scene {name}")))?;
    Ok(Source { scene: scene.clone(), file: None })
}

/// A scene, and where its data files are.
pub struct Source {
    /// The scene's text, with the data files that a manifest has.
    pub scene: SceneText,
    /// The scene's file, where a sweep is planned.
    pub file: Option<SceneFile>,
}

impl Source {
    /// Reads a data file.
    pub fn load(&self, name: &str) -> io::Result<Vec<u8>> {
        match &self.file {
            Some(file) => file.load(name),
            None => self.scene.files.get(name).cloned().ok_or_else(|| io::Error::from(io::ErrorKind::NotFound)),
        }
    }
}

/// Returns a scene by its name.
pub type Find<'a> = &'a mut dyn FnMut(&str) -> Result<Source, Failure>;

/// Finds a scene by its path or its shipped name.
pub fn on_disk(name: &str) -> Result<Source, Failure> {
    let file = scene::source(name)?;
    let scene = SceneText { name: file.name.clone(), text: file.text.clone(), files: BTreeMap::new() };
    Ok(Source { scene, file: Some(file) })
}

/// The cells of a map.
pub struct MapWork {
    /// The command's arguments.
    pub args: MapArgs,
    /// The map.
    pub map: Map,
}

impl MapWork {
    /// Returns the cells of a map.
    pub fn new(args: MapArgs, find: Find) -> Result<Self, Failure> {
        args.provide()?;
        let source = find(args.scene())?;
        let map = args.map((&source.scene.name, &source.scene.text), &mut |name: &str| source.load(name))?;
        Ok(Self { args, map })
    }
}

impl Work for MapWork {
    fn schema(&self) -> Schema {
        map::schema(&self.map)
    }

    fn meanings(&self) -> Vec<(String, String)> {
        map::meanings(&self.map)
    }

    fn command(&self) -> String {
        self.args.command() + if self.args.full() { " --full" } else { "" }
    }

    fn scenes(&self) -> Vec<(String, SceneText)> {
        vec![(self.args.scene().to_string(), self.map.scene.clone())]
    }

    fn place(&self, point: usize) -> Vec<Value> {
        map::place(&self.map, point)
    }

    fn is_adaptive(&self) -> bool {
        !self.args.full()
    }

    fn next(&self, done: Rows, _control: &Control) -> Result<Points, Failure> {
        if self.args.full() {
            return Ok(Points::all(self.map.len() as u64));
        }
        Ok(Points::of(self.map.next_wave(done).into_iter().map(|cell| cell as u64)))
    }

    fn run(&self, _done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure> {
        let limits = self.args.limits();
        // Stopping may end a simulator, and with it a cell, before the cell itself is told to stop.
        let stopped = || control.stop.load(Ordering::Relaxed);
        let unit =
            |index: usize, own: &Control| self.map.run_cell(index, limits, own).filter(|row| row.is_ok() || !stopped());
        units::run_some(points, NonZeroUsize::MIN, control, unit, take)
    }
}
