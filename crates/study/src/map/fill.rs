//! Filling a map: its cells as units of work, in rounds of refinement.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::time::Duration;

use hpu_cosim::Control;

use super::{Cell, Found, Map, Refinement};
use crate::units::{self, Row};

/// How a map is filled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Plan {
    /// Whether every cell is run.
    pub full: bool,
    /// How long a cell may take.
    pub timeout: Duration,
    /// Threads.
    pub jobs: NonZeroUsize,
}

impl Map {
    /// Runs one cell, as a unit of work; `None` when it was stopped.
    pub fn run_cell(&self, index: usize, timeout: Duration, control: &Control) -> Option<Row> {
        let made = self.experiment(self.point(index)).map_err(|error| error.to_string());
        match made.and_then(|experiment| Cell::run(&experiment, timeout, control)) {
            Ok(cell) => cell.map(|cell| Ok(cell.line())),
            Err(reason) => Some(Err(reason)),
        }
    }

    /// Fills the map; `None` when `control` stopped it. Rows that are `done` are not run again, and every new one goes
    /// through `keep`.
    ///
    /// # Errors
    ///
    /// What `keep` says.
    pub fn run<E>(
        &self,
        plan: Plan,
        mut done: BTreeMap<usize, Row>,
        control: &Control,
        mut keep: impl FnMut(usize, &Row) -> Result<(), E>,
    ) -> Result<Option<Vec<Found>>, E> {
        let unit = |index: usize, control: &Control| self.run_cell(index, plan.timeout, control);
        let mut do_all = |wanted: Vec<usize>, done: &mut BTreeMap<usize, Row>| {
            units::run_some(wanted.iter().copied(), plan.jobs, done, control, unit, &mut keep)?;
            Ok(wanted.iter().all(|index| done.contains_key(index)))
        };
        let mut found: Vec<Option<Found>> = vec![None; self.len()];
        if plan.full {
            if !do_all((0..self.len()).collect(), &mut done)? {
                return Ok(None);
            }
            found = done.values().map(|row| Some(Found::Run(read(row)))).collect();
        } else {
            let mut layers = vec![Refinement::new(self.x.cells(), self.y.cells()); self.methods.len()];
            let firsts: Vec<usize> = (0..self.methods.len()).map(|method| method * self.layer()).collect();
            loop {
                let wanted = layers.iter().zip(&firsts);
                let wanted = wanted.flat_map(|(layer, first)| layer.wanted().iter().map(move |cell| first + cell));
                if !do_all(wanted.collect(), &mut done)? {
                    return Ok(None);
                }
                let class = |index: usize| read(&done[&index]).ok().map(|cell| cell.outcome);
                let asked =
                    layers.iter_mut().zip(&firsts).map(|(layer, first)| layer.refine(|cell| class(first + cell)));
                // Every layer takes its step: no short cut at the first.
                if !asked.fold(false, |any, asked| any | asked) {
                    break;
                }
            }
            for (layer, first) in layers.iter().zip(&firsts) {
                for cell in layer.wanted() {
                    found[first + cell] = Some(Found::Run(read(&done[&(first + cell)])));
                }
                for (cell, like) in layer.inferred() {
                    found[first + cell] = Some(Found::As(first + like));
                }
            }
        }
        Ok(found.into_iter().collect())
    }
}

/// A row as the cell that it was.
fn read(row: &Row) -> Result<Cell, String> {
    row.as_ref()
        .map_err(Clone::clone)
        .and_then(|line| Cell::read(line).ok_or_else(|| format!("`{line}` in the journal is no cell")))
}
