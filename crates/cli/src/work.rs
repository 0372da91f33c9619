//! The points of a verb that a sweep can split, and where their scenes come from.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use hpu_cosim::{Control, SceneFile};
use hpu_farm::UnitResult;
use hpu_farm::{Points, Schema};
use hpu_page::Value;
use hpu_study::map::SceneText;

use crate::scene;
use crate::shell::Failure;

/// Rows by the numbers of their points.
pub type Rows = BTreeMap<usize, UnitResult>;

/// Takes each new row.
pub(crate) type Take<'a> = &'a mut dyn FnMut(usize, UnitResult) -> Result<(), Failure>;

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
    /// Returns the place of a point, as values for the columns; none of a search.
    fn place(&self, _point: usize) -> Vec<Value> {
        Vec::new()
    }
    /// Returns the number of all points, which are numbered from 0; `None` for a search, which numbers its runs as they
    /// come up.
    fn count(&self) -> Option<u64> {
        None
    }
    /// Whether the points of a wave depend on the rows of the waves before it.
    fn is_adaptive(&self) -> bool;
    /// Returns the points of the next wave when these rows are done; none when the sweep is complete.
    fn next(&self, done: Rows, control: &Control) -> Result<Points, Failure>;
    /// Runs points of the wave that follows these rows, one after the other, and hands over each row. A point has no
    /// row if it took longer than the guard allows, or if `control` stopped it.
    fn run(&self, done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure>;
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
pub(crate) type Find = Arc<dyn Fn(&str) -> Result<Source, Failure> + Send + Sync>;

/// Finds a scene by its path or its shipped name.
pub fn on_disk(name: &str) -> Result<Source, Failure> {
    let file = scene::source(name)?;
    let scene = SceneText { name: file.name.clone(), text: file.text.clone(), files: BTreeMap::new() };
    Ok(Source { scene, file: Some(file) })
}
