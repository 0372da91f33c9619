//! Cells that are one run: the stiffness and the damping that they ask for have the same words.
//!
//! Words are coarse, so on a fine map many neighbours hold the same ones. Such cells have the same loop in the same
//! world, and their motions are equal to the bit. They differ only in figures relative to the stiffness asked for.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use hpu_cosim::scene::{Datapath, Experiment, Loop, LoopWords, Realised, Scene, Wall};

use super::{Cell, Displayed, Map};
use crate::Error;

/// The cells that were run, by the words of their scenes; nothing of a map whose cells hardly share words.
pub struct Alike(Option<Mutex<Known>>);

/// The number of a world, and a scene's words for reference, stiffness, damping, period and scale.
type Words = (usize, [i64; 5]);

#[derive(Default)]
struct Known {
    /// One scene of each world.
    worlds: Vec<Scene>,
    /// The cells with these words; their loops may still have other widths.
    cells: BTreeMap<Words, Vec<(LoopWords, Cell)>>,
}

/// The keys of the gains whose words cells may share.
const GAINS: [&str; 2] = ["wall.stiffness", "wall.damping"];

impl Alike {
    /// Returns the cells of a map, of which none was run yet. Cells share runs where the map is over stiffness and
    /// damping of the wall; over any other key almost every cell is a world of its own.
    pub fn of(map: &Map) -> Self {
        let is_over_gains = [&map.x, &map.y].iter().all(|axis| GAINS.contains(&axis.key()));
        Self(is_over_gains.then(Mutex::default))
    }

    /// Returns the result of an experiment: by `run`, or of another cell with the same words in the same world.
    ///
    /// # Errors
    ///
    /// Returns the error of `run`.
    pub(super) fn cell(
        &self,
        experiment: &Experiment,
        run: impl FnOnce() -> Result<Option<Cell>, Error>,
    ) -> Result<Option<Cell>, Error> {
        let (Some(known), Some((scene, words))) = (&self.0, sharing(experiment)) else { return run() };
        // A cell is whole wherever a thread may have panicked.
        let known = || known.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known().find(scene, &words).cloned();
        if let Some(cell) = found {
            return Ok(Some(asked(cell, experiment, scene)));
        }
        // Two threads may run the same words at the same time, and find the same.
        let cell = run()?;
        if let Some(cell) = &cell {
            known().keep(scene, words, cell.clone());
        }
        Ok(cell)
    }
}

impl Known {
    fn find(&self, scene: &Scene, words: &LoopWords) -> Option<&Cell> {
        let world = self.worlds.iter().position(|other| is_same_world(scene, other))?;
        let cells = self.cells.get(&(world, key(words)))?;
        cells.iter().find(|(other, _)| other == words).map(|(_, cell)| cell)
    }

    fn keep(&mut self, scene: &Scene, words: LoopWords, cell: Cell) {
        let world = self.worlds.iter().position(|other| is_same_world(scene, other)).unwrap_or_else(|| {
            self.worlds.push(scene.clone());
            self.worlds.len() - 1
        });
        self.cells.entry((world, key(&words))).or_default().push((words, cell));
    }
}

fn key(words: &LoopWords) -> [i64; 5] {
    [words.reference, words.stiffness, words.damping, words.period, words.scale]
}

/// Returns a scene whose run depends on the wall's stiffness and damping through its words alone, and these words
/// without their distance from the gains asked for. Some laws also read the wall's stiffness as it is asked for.
fn sharing(experiment: &Experiment) -> Option<(&Scene, LoopWords)> {
    let Experiment::Axis(scene) = experiment else { return None };
    if scene.model.datapath != Datapath::Words || matches!(scene.method.kind, Loop::Law(_)) {
        return None;
    }
    let words = scene.words().ok()?;
    let realised = Realised { stiffness_error: 0.0, stiffness_miss: None, damping_error: 0.0, ..words.realised };
    Some((scene, LoopWords { realised, ..words }))
}

/// Returns whether two scenes differ in nothing but the wall's stiffness and damping. A new part of a scene has to be
/// named here.
fn is_same_world(a: &Scene, b: &Scene) -> bool {
    let Scene {
        head,
        device,
        encoder,
        bridge,
        amplifier,
        method,
        wall,
        target,
        hand,
        faults,
        model,
        network,
        host_clocks,
    } = a;
    let Wall { position_rad, stiffness_nm_per_rad: _, damping_nm_s_per_rad: _, wraps, ramp } = wall;
    (position_rad, wraps, ramp) == (&b.wall.position_rad, &b.wall.wraps, &b.wall.ramp)
        && (device, encoder, bridge, amplifier) == (&b.device, &b.encoder, &b.bridge, &b.amplifier)
        && (method, hand, faults, model) == (&b.method, &b.hand, &b.faults, &b.model)
        && (network, host_clocks, target) == (&b.network, &b.host_clocks, &b.target)
        && (head.clock, head.run, head.record) == (b.clock, b.run, b.record)
}

/// Returns a cell as the cell of another scene with the same words.
fn asked(cell: Cell, experiment: &Experiment, scene: &Scene) -> Cell {
    let asked = scene.wall.stiffness_nm_per_rad;
    Cell {
        displayed: cell.displayed.map(|displayed| Displayed { asked, ..displayed }),
        stiffness_error: experiment.setup().stiffness_error(),
        ..cell
    }
}
