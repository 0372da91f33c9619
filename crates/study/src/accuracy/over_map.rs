//! How often a contestant's verdict is wrong over a map.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, OutcomeKind};
use hpu_farm::UnitResult;
use hpu_prove::criteria;
use serde::{Deserialize, Serialize};

use super::contestants::Contestant;
use super::found::Speed;
use super::front::front;
use super::race::{Entrant, Plan, Race};
use crate::Error;
use crate::map::{Axis, Cell, CellIndex, CellLimits, Map, Method, outcome};

/// The shortest step that is run unless all contestants are asked for: shorter ones take too long for a map's many
/// cells.
pub const SHORTEST_STEP_S: f64 = 1e-6;

/// A race over a map. The reference is the map's first layer; each contestant that runs anything is a further layer.
#[derive(Clone, PartialEq, Debug)]
pub struct Tour {
    /// The race's scene and contestants.
    pub race: Race,
    /// The map, with the reference's layer and the contestants' layers.
    pub map: Map,
    /// Contestants that cannot run anywhere on the map, and why.
    pub refused: Vec<(Contestant, String)>,
    /// Indices of the contestants of the layers after the first.
    runners: Vec<usize>,
    /// Indices of the criteria among the contestants.
    criteria: Vec<usize>,
}

/// A row of a tour.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(untagged)]
pub enum TourRow {
    /// A cell of the map.
    Cell(Box<Cell>),
    /// Whether a cell comes to rest, by each criterion; `None` where it says nothing.
    Predicted(Vec<Option<bool>>),
}

/// How often a contestant is wrong.
#[derive(Clone, PartialEq, Debug)]
pub struct Share {
    /// The contestant.
    pub contestant: Contestant,
    /// Number of cells on which both the contestant and the reference have a verdict.
    pub cells: usize,
    /// Number of these cells where the contestant's verdict is wrong.
    pub wrong: usize,
    /// The contestant's speed at the middle cell; `None` if it cannot run there.
    pub speed: Option<Speed>,
}

impl Share {
    /// Returns the share of wrong verdicts; `None` without a cell.
    pub fn share(&self) -> Option<f64> {
        (self.cells > 0).then(|| self.wrong as f64 / self.cells as f64)
    }
}

/// Returns the indices of the shares that no other beats in both speed and share, the slowest first.
pub fn front_of_shares(shares: &[Share]) -> Vec<usize> {
    let point = |share: &Share| Some((share.speed.as_ref()?.motion_per_wall(), share.share()?));
    front(&shares.iter().map(|share| point(share).unwrap_or((f64::NAN, f64::NAN))).collect::<Vec<_>>())
}

impl Tour {
    /// Returns a tour of a race's contestants over two keys. Unless `all`, it leaves out contestants that tick every
    /// edge or step in less than a microsecond.
    ///
    /// # Errors
    ///
    /// Fails if the reference has no such map.
    pub fn new(
        mut race: Race,
        axes: (Axis, Axis),
        all: bool,
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, Error> {
        let quick =
            |one: &Contestant| one.name != "clock" && one.step_s.is_none_or(|step_s| step_s >= SHORTEST_STEP_S * 0.999);
        race.contestants.retain(|one| all || quick(one));
        let scene = (race.scene.name.clone(), race.scene.text.clone());
        let reference = Method { label: "reference".into(), set: Vec::new() };
        let mut map = Map::new((&scene.0, &scene.1), &race.set, axes.clone(), vec![reference], load)?;
        let (mut refused, mut runners, mut criteria) = (Vec::new(), Vec::new(), Vec::new());
        for (index, contestant) in race.contestants.iter().enumerate() {
            if contestant.criterion.is_some() {
                criteria.push(index);
                continue;
            }
            let method = Method { label: contestant.name.clone(), set: contestant.overrides.clone() };
            match Map::new((&scene.0, &scene.1), &race.set, axes.clone(), vec![method], load) {
                Ok(alone) => {
                    map.methods.extend(alone.methods);
                    map.scene.files.extend(alone.scene.files);
                    runners.push(index);
                }
                Err(error) => refused.push((contestant.clone(), error.to_string())),
            }
        }
        Ok(Self { race, map, refused, runners, criteria })
    }

    /// Returns the number of units of work: the cells of all layers, then one for each cell with all criteria's
    /// verdicts.
    pub fn units(&self) -> usize {
        self.map.len() + if self.criteria.is_empty() { 0 } else { self.map.layer() }
    }

    /// Runs every cell, and times every contestant at the middle cell. Returns `None` when `control` stopped it. Rows
    /// that are `done` are not run again, and every new row goes through `keep`.
    ///
    /// # Errors
    ///
    /// Returns the error of `keep`.
    pub fn run<E>(
        &self,
        plan: Plan,
        done: BTreeMap<usize, UnitResult<TourRow>>,
        control: &Control,
        mut keep: impl FnMut(usize, &UnitResult<TourRow>) -> Result<(), E>,
    ) -> Result<Option<Vec<Share>>, E> {
        let (mut cells, mut predicted) = (BTreeMap::new(), BTreeMap::new());
        for (index, row) in done {
            match row {
                Ok(TourRow::Cell(cell)) => drop(cells.insert(index, Ok(*cell))),
                Ok(TourRow::Predicted(rests)) => drop(predicted.insert(index, rests)),
                Err(failed) => drop(cells.insert(index, Err(failed))),
            }
        }
        let cells_plan = crate::map::Plan { full: true, limits: CellLimits::default(), jobs: plan.jobs };
        let cell_of = |row: &UnitResult<Cell>| row.clone().map(|cell| TourRow::Cell(Box::new(cell)));
        let found = self.map.run(cells_plan, cells, control, |index, row| keep(index, &cell_of(row)))?;
        let Some(found) = found else { return Ok(None) };
        for index in self.map.len()..self.units() {
            if control.stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            if let Entry::Vacant(place) = predicted.entry(index) {
                let rests = place.insert(self.predicted(index - self.map.len()));
                keep(index, &Ok(TourRow::Predicted(rests.clone())))?;
                control.progress.fetch_add(1, Ordering::Relaxed);
            }
        }
        let truth = |cell: usize| outcome(&found, cell);
        let count = |verdict: &dyn Fn(usize) -> Option<bool>| {
            let right: Vec<bool> = (0..self.map.layer()).filter_map(verdict).collect();
            (right.len(), right.iter().filter(|right| !**right).count())
        };
        let Some(mut speeds) = self.time(plan, control) else { return Ok(None) };
        let mut shares = Vec::new();
        for (index, contestant) in self.race.contestants.iter().enumerate() {
            let (cells, wrong) = if let Some(layer) = self.runners.iter().position(|runner| *runner == index) {
                let first = (layer + 1) * self.map.layer();
                count(&|cell| Some(truth(cell)? == outcome(&found, first + cell)?))
            } else if let Some(at) = self.criteria.iter().position(|one| *one == index) {
                let rests = |cell: usize| *predicted[&(self.map.len() + cell)].get(at)?;
                let told = |cell: usize| truth(cell).filter(|outcome| outcome.tells());
                count(&|cell| Some(rests(cell)? == (told(cell)? == OutcomeKind::Settled)))
            } else {
                continue;
            };
            let speed = speeds[index].take();
            shares.push(Share { contestant: contestant.clone(), cells, wrong, speed });
        }
        Ok(Some(shares))
    }

    /// Returns whether a cell comes to rest, by each criterion; `None` where it says nothing.
    fn predicted(&self, cell: usize) -> Vec<Option<bool>> {
        let Ok(Experiment::Axis(scene)) = self.map.experiment(self.map.point(cell)) else {
            return vec![None; self.criteria.len()];
        };
        let rests = |name| {
            let criterion = criteria::named(name, &scene)?.ok()?;
            Some(scene.wall.stiffness_nm_per_rad < criterion.limit)
        };
        self.criteria.iter().filter_map(|index| self.race.contestants[*index].criterion).map(rests).collect()
    }

    /// Returns the speed of each contestant at the middle cell, if it can run there; the outer `None` when stopped.
    fn time(&self, plan: Plan, control: &Control) -> Option<Vec<Option<Speed>>> {
        let point = CellIndex { method: 0, ix: self.map.x.cells() / 2, iy: self.map.y.cells() / 2 };
        let mut middle = self.race.clone();
        middle.set = self.map.overrides(point);
        let contestants = self.race.contestants.iter().enumerate();
        let running = contestants.filter(|(index, contestant)| {
            (self.runners.contains(index) || self.criteria.contains(index)) && middle.can_run(contestant)
        });
        let entrant =
            |contestant: &Contestant| Entrant { contestant: contestant.clone(), shortened_s: None, profile: None };
        let (places, entrants): (Vec<usize>, Vec<Entrant>) =
            running.map(|(index, contestant)| (index, entrant(contestant))).unzip();
        let mut speeds: Vec<Option<Speed>> = vec![None; self.race.contestants.len()];
        if let Ok(found) = middle.time(&entrants, plan, control) {
            places.into_iter().zip(found?).for_each(|(index, speed)| speeds[index] = Some(speed));
        }
        Some(speeds)
    }
}
