//! Filling a map: its cells as units of work, in rounds of refinement.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::Experiment;

use super::alike::Alike;
use super::{Cell, CellLimits, Class, Found, Map, Refinement};
use crate::Error;
use hpu_farm::{Failed, UnitResult, units};

/// How a map is filled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Plan {
    /// Whether every cell is run.
    pub full: bool,
    /// How far a cell is run.
    pub limits: CellLimits,
    /// Number of threads.
    pub jobs: NonZeroUsize,
}

impl Map {
    /// Runs one cell as a unit of work, unless a cell with the same words was run; returns `None` when `control` or the
    /// guard stopped it.
    fn run_cell(&self, index: usize, limits: CellLimits, control: &Control, alike: &Alike) -> Option<UnitResult<Cell>> {
        let made = self.experiment(self.point(index)).map_err(Error::from);
        let run = |experiment: Experiment| alike.cell(&experiment, || Cell::run(&experiment, limits, control));
        match made.and_then(run) {
            Ok(cell) => cell.map(Ok),
            Err(reason) => Some(Err(Failed::new(reason))),
        }
    }

    /// Runs these cells, and hands their rows to `take` in the order in which they finish. Cells with the same words
    /// are one run, by `alike` also with those of earlier calls.
    ///
    /// # Errors
    ///
    /// Returns the error of `take`.
    pub fn run_cells<E>(
        &self,
        cells: &[usize],
        Plan { limits, jobs, .. }: Plan,
        control: &Control,
        alike: &Alike,
        take: impl FnMut(usize, UnitResult<Cell>) -> Result<(), E>,
    ) -> Result<(), E> {
        // Stopping the map may end a simulator, and with it a cell, before the cell itself is told to stop. A cell that
        // failed for this reason is run again.
        let stopped = || control.stop.load(Ordering::Relaxed);
        let unit = |index: usize, own: &Control| {
            self.run_cell(index, limits, own, alike).filter(|row| row.is_ok() || !stopped())
        };
        units::run_some(cells, jobs, control, unit, take)
    }

    /// Fills the map; returns `None` when `control` stopped it. A cell that took longer than the guard allows is
    /// [`Found::Late`]. Rows that are `done` are not run again, and every new row goes through `keep`.
    ///
    /// # Errors
    ///
    /// Returns the error of `keep`.
    pub fn run<E>(
        &self,
        plan: Plan,
        done: BTreeMap<usize, UnitResult<Cell>>,
        control: &Control,
        mut keep: impl FnMut(usize, &UnitResult<Cell>) -> Result<(), E>,
    ) -> Result<Option<Vec<Found>>, E> {
        // For each cell only its result is in memory.
        let mut found: Vec<Option<Found>> = vec![None; self.len()];
        for (index, row) in done {
            found[index] = Some(Found::Run(row));
        }
        let alike = Alike::of(self);
        let mut fill = |wanted: &mut dyn Iterator<Item = usize>, found: &mut [Option<Found>]| {
            let mut left: Vec<usize> = wanted.filter(|index| found[*index].is_none()).collect();
            left.sort_unstable_by_key(scattered);
            self.run_cells(&left, plan, control, &alike, |index, row| {
                keep(index, &row)?;
                found[index] = Some(Found::Run(row));
                Ok(())
            })?;
            // If the map was not stopped, the missing cells were late. They have no row, so that a later continuation
            // runs them.
            if !control.stop.load(Ordering::Relaxed) {
                for index in &left {
                    found[*index].get_or_insert(Found::Late);
                }
            }
            Ok(left.iter().all(|index| found[*index].is_some()))
        };
        if plan.full {
            fill(&mut (0..self.len()), &mut found)?;
            return Ok(found.into_iter().collect());
        }
        let mut layers = Layers::new(self);
        loop {
            if !fill(&mut layers.wanted(), &mut found)? {
                return Ok(None);
            }
            if !layers.refine(&found) {
                break;
            }
        }
        for (layer, first) in layers.0 {
            for (cell, like) in layer.inferred() {
                found[first + cell] = Some(Found::As(first + like));
            }
        }
        Ok(found.into_iter().collect())
    }

    /// Returns the numbers of the cells that a refined map runs next, in order, when these rows are `done`; none when
    /// the map is complete.
    pub fn next_wave(&self, done: BTreeMap<usize, UnitResult<Cell>>) -> Vec<usize> {
        let mut found: Vec<Option<Found>> = vec![None; self.len()];
        for (index, row) in done {
            found[index] = Some(Found::Run(row));
        }
        let mut layers = Layers::new(self);
        loop {
            let mut left: Vec<usize> = layers.wanted().filter(|index| found[*index].is_none()).collect();
            if !left.is_empty() || !layers.refine(&found) {
                left.sort_unstable();
                return left;
            }
        }
    }
}

/// The refinement of each layer of a map, with the number of the layer's first cell.
struct Layers(Vec<(Refinement, usize)>);

impl Layers {
    fn new(map: &Map) -> Self {
        let layer = |method| (Refinement::new(map.x.cells(), map.y.cells()), method * map.layer());
        Self((0..map.methods.len()).map(layer).collect())
    }

    /// Returns the cells that are to be run, layer by layer.
    fn wanted(&self) -> impl Iterator<Item = usize> {
        self.0.iter().flat_map(|(layer, first)| layer.wanted().iter().map(move |cell| first + cell))
    }

    /// Asks for more cells where known cells differ; returns `false` if there is nothing to ask for.
    fn refine(&mut self, found: &[Option<Found>]) -> bool {
        let class = |index: usize| match &found[index] {
            Some(Found::Run(Ok(cell))) => Some(Class::of(cell)),
            _ => None,
        };
        let asked = self.0.iter_mut().map(|(layer, first)| layer.refine(|cell| class(*first + cell)));
        // Every layer takes its step, so `fold` is used, which does not stop early.
        asked.fold(false, |any, asked| any | asked)
    }
}

/// Returns a cell's place in an order that scatters neighbours, by multiples of the golden ratio. Neighbours take
/// similar time: in the map's own order a corner of slow cells may come last, and one thread would wait for another.
fn scattered(index: &usize) -> u64 {
    (*index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
}
