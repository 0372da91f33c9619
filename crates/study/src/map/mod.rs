//! Maps of stability: a scene over two of its keys, by any set of methods.
//!
//! A cell is a run of the scene under overrides: those of the whole map, those of the two axes, and those of the
//! method. It is a unit of work ([`hpu_farm::units`]), so a map does not depend on the threads, and continues after an
//! interruption. Unless all cells are asked for, only those along boundaries are run ([`Refinement`]).

mod agreement;
mod alike;
mod axis;
mod cell;
mod class;
mod curves;
mod device;
mod edges;
mod fill;
mod method;
mod refine;
mod table;

use std::collections::BTreeMap;
use std::io;

use crate::{Error, Kind};
use hpu_cosim::Simulation;
use hpu_cosim::scene::{Datapath, Experiment, OutcomeKind, SceneError};
use hpu_farm::UnitResult;

pub use agreement::{Agreement, agreements, is_predicted, predicted};
pub use alike::Alike;
pub use axis::Axis;
pub(crate) use cell::any_simulation;
pub(crate) use cell::more_events;
pub use cell::{Cell, CellLimits, Displayed, ForEver, outcome_name};
pub use class::{Class, class_name, classes, unheld, unseen, wrapped};
pub use class::{is_unseen, settled_for_ever, told_for_ever};
pub use curves::{Curve, Curves};
pub use device::{Device, SwitchWatch, Switching};
pub use edges::{Edge, Reason, Share};
pub use fill::Plan;
pub use method::Method;
pub use refine::{Refinement, STRIDE};
pub use table::{csv, fields, units_of};
#[cfg(not(target_family = "wasm"))]
pub use table::{meanings, parquet, place, schema};

/// A scene's text, with all data files that it needs.
#[derive(Clone, PartialEq, Debug)]
pub struct SceneText {
    /// Name of the file, as errors write it.
    pub name: String,
    /// Text of the scene.
    pub text: String,
    /// The data files that the scene names.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl SceneText {
    /// Reads a scene under overrides. `load` reads the data files that the scene names, and they are kept.
    ///
    /// # Errors
    ///
    /// Returns a [`SceneError`] if this is not a valid scene.
    pub fn read(
        (name, text): (&str, &str),
        overrides: &[(String, String)],
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<(Self, Experiment), SceneError> {
        let mut scene = Self { name: name.into(), text: text.into(), files: BTreeMap::new() };
        let mut keep = |file: &str| {
            let bytes = load(file)?;
            scene.files.insert(file.to_string(), bytes.clone());
            Ok(bytes)
        };
        let experiment = Experiment::parse(name, text, overrides, &mut keep)?;
        Ok((scene, experiment))
    }

    /// Returns the scene under overrides.
    ///
    /// # Errors
    ///
    /// Returns a [`SceneError`] if the overrides make no valid scene.
    pub fn parse(&self, overrides: &[(String, String)]) -> Result<Experiment, SceneError> {
        let mut load =
            |file: &str| self.files.get(file).cloned().ok_or_else(|| io::Error::from(io::ErrorKind::NotFound));
        Experiment::parse(&self.name, &self.text, overrides, &mut load)
    }
}

/// A scene over two of its keys.
#[derive(Clone, PartialEq, Debug)]
pub struct Map {
    /// The scene.
    pub scene: SceneText,
    /// Overrides for all cells.
    pub set: Vec<(String, String)>,
    /// The key that changes from column to column.
    pub x: Axis,
    /// The key that changes from row to row.
    pub y: Axis,
    /// The layers; each is a whole grid.
    pub methods: Vec<Method>,
}

/// The place of a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellIndex {
    /// Index of the method.
    pub method: usize,
    /// Column.
    pub ix: usize,
    /// Row.
    pub iy: usize,
}

/// State of a cell: run, inferred or late.
#[derive(Clone, PartialEq, Debug)]
pub enum Found {
    /// The cell was run; or the reason why it could not be run.
    Run(UnitResult<Cell>),
    /// The cell has the class of the cell with this index, which was run.
    As(usize),
    /// The cell took longer than the guard allows. Nothing is known of it, and it is to be run again.
    Late,
}

impl Map {
    /// Returns a map in which every method can run somewhere: the corners and the middle are tried.
    ///
    /// `load` reads the data files that the scene names; the map keeps them.
    ///
    /// # Errors
    ///
    /// Fails for axes or methods that are one key or one label, for a recording, and for a method that can run nowhere.
    pub fn new(
        (name, text): (&str, &str),
        set: &[(String, String)],
        (x, y): (Axis, Axis),
        methods: Vec<Method>,
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, Error> {
        if x.key() == y.key() {
            return Err(Error::of(Kind::Usage, format_args!("both axes are {}", x.key())));
        }
        for (index, Method { label, set }) in methods.iter().enumerate() {
            if methods[..index].iter().any(|other| other.label == *label) {
                return Err(Error::of(Kind::Usage, format_args!("two methods are labelled {label}")));
            }
            if let Some((key, _)) = set.iter().find(|(key, _)| [x.key(), y.key()].contains(&key.as_str())) {
                return Err(Error::of(Kind::Usage, format_args!("method {label} sets {key}, which is an axis")));
            }
        }
        let scene = SceneText { name: name.into(), text: text.into(), files: BTreeMap::new() };
        let mut map = Self { scene, set: set.to_vec(), x, y, methods };
        for method in 0..map.methods.len() {
            let (columns, rows) = (map.x.cells(), map.y.cells());
            let corners = [(columns / 2, rows / 2), (0, 0), (columns - 1, 0), (0, rows - 1), (columns - 1, rows - 1)];
            let mut refused = None;
            let mut runs = false;
            for (ix, iy) in corners {
                let overrides = map.overrides(CellIndex { method, ix, iy });
                let mut keep = |file: &str| {
                    let bytes = load(file)?;
                    map.scene.files.insert(file.to_string(), bytes.clone());
                    Ok(bytes)
                };
                let parsed = Experiment::parse(&map.scene.name, &map.scene.text, &overrides, &mut keep);
                let made = parsed.map_err(Error::from).and_then(|experiment| {
                    if experiment.auto {
                        return Err("model = \"auto\" is chosen for one scene; set what hpu fit chooses for it".into());
                    }
                    if experiment.clone().axis().is_some_and(|scene| scene.model.datapath == Datapath::Linear) {
                        return Err("model.datapath = \"linear\" is for hpu limits; write \"words\"".into());
                    }
                    cell::any_simulation(&experiment).map(|simulation| simulation.has_device())
                });
                match made {
                    Ok(true) => runs = true,
                    Ok(false) => {
                        return Err(Error::of(Kind::Usage, "a recording has no device whose motion could be judged"));
                    }
                    Err(error) => {
                        refused.get_or_insert(error);
                    }
                }
            }
            if let (false, Some(why)) = (runs, refused) {
                let label = &map.methods[method].label;
                return Err(
                    why.at(format_args!("method {label}: neither the corners nor the middle of the map can run"))
                );
            }
        }
        Ok(map)
    }

    /// Returns the number of cells of all methods.
    pub fn len(&self) -> usize {
        self.methods.len() * self.layer()
    }

    /// Whether the map has no method.
    pub fn is_empty(&self) -> bool {
        self.methods.is_empty()
    }

    /// Returns the number of cells of one method.
    pub fn layer(&self) -> usize {
        self.x.cells() * self.y.cells()
    }

    /// Returns the place of cell number `index`: column by column, row by row, method by method.
    pub fn point(&self, index: usize) -> CellIndex {
        let (method, cell) = (index / self.layer(), index % self.layer());
        CellIndex { method, ix: cell % self.x.cells(), iy: cell / self.x.cells() }
    }

    /// Returns the number of the cell at a place.
    pub fn index(&self, CellIndex { method, ix, iy }: CellIndex) -> usize {
        method * self.layer() + iy * self.x.cells() + ix
    }

    /// Returns the overrides that turn the scene into a cell's: with them, `hpu run` runs the cell.
    pub fn overrides(&self, CellIndex { method, ix, iy }: CellIndex) -> Vec<(String, String)> {
        let axes = [(self.x.key().to_string(), self.x.text(ix)), (self.y.key().to_string(), self.y.text(iy))];
        self.set.iter().cloned().chain(axes).chain(self.methods[method].set.iter().cloned()).collect()
    }

    /// Returns the scene of a cell.
    ///
    /// # Errors
    ///
    /// Returns a [`SceneError`] if the cell's values make no valid scene.
    pub fn experiment(&self, point: CellIndex) -> Result<Experiment, SceneError> {
        self.scene.parse(&self.overrides(point))
    }

    /// Returns the unit of an axis: the unit that it was given, else the unit of plain numbers of its key; empty if the
    /// key has none, or if no cell makes a scene.
    pub fn unit<'m>(&'m self, axis: &'m Axis) -> &'m str {
        if !axis.unit().is_empty() {
            return axis.unit();
        }
        let experiment = self.experiment(self.point(self.layer() / 2)).ok();
        let unit = |experiment: Experiment| {
            let parameter = experiment.parameters.iter().find(|parameter| parameter.key == axis.key())?;
            Some(parameter.unit)
        };
        experiment.and_then(unit).unwrap_or_default()
    }
}

/// Whether nothing is known of a cell because this cell, or the cell whose class it would have, took longer than the
/// guard allows.
pub fn is_late(found: &[Found], index: usize) -> bool {
    match found[index] {
        Found::As(other) => found[other] == Found::Late,
        ref own => *own == Found::Late,
    }
}

/// Returns the outcome of a cell, run or inferred; `None` for a cell that could not be run.
pub fn outcome(found: &[Found], index: usize) -> Option<OutcomeKind> {
    nearest(found, index).map(|cell| cell.outcome)
}

/// Returns the class of a cell, run or inferred; `None` for a cell that could not be run.
pub fn class(found: &[Found], index: usize) -> Option<Class> {
    nearest(found, index).map(Class::of)
}

/// Returns the cell, or the cell that it is inferred from.
pub fn nearest(found: &[Found], index: usize) -> Option<&Cell> {
    match &found[index] {
        Found::Run(cell) => cell.as_ref().ok(),
        Found::As(other) => match &found[*other] {
            Found::Run(cell) => cell.as_ref().ok(),
            Found::As(_) | Found::Late => None,
        },
        Found::Late => None,
    }
}
