//! Which cells are run at which seeds.
//!
//! At the edge of stability the chatter of a drop is chaotic: another draw of the release can turn a cell that is not
//! passive into a passive one. Every cell is run at the first seed. A cell is *near a boundary* when its class, at any
//! seed known so far, differs from the class of a neighbouring row of its column, or from its own class at another
//! seed. No wall, below the softest row, counts as passive. A wall beyond the stiffest row counts as aborted, because
//! the boundary may be just there. A cell near a boundary is run at every seed. A cell whose seeds disagree makes its
//! neighbours near a boundary too, and so on until no new cell is found.

use std::collections::BTreeSet;
use std::ops::Range;

use super::table::{Cell, Class};
use super::{Outcomes, Study};

impl Study {
    /// Returns the number of cells, over all rungs, in the order of the points.
    pub(super) fn cells(&self) -> usize {
        self.rungs.len() * self.axes.len() * self.platforms.len() * self.stiffnesses_n_per_m.len()
    }

    /// Returns the indices in [`Study::points`] of a cell's trials at a seed; the first seed is 0.
    fn trials_of(&self, cell: usize, seed: usize) -> impl Iterator<Item = usize> + use<> {
        let trials = self.trials as usize;
        let first = (cell * self.seeds as usize + seed) * trials;
        first..first + trials
    }

    /// Returns a cell at a seed; `None` until all of its trials there have been run.
    pub(super) fn cell(&self, cell: usize, seed: usize, outcomes: &Outcomes) -> Option<Cell> {
        let trials = self.trials_of(cell, seed).map(|trial| outcomes.get(&trial).cloned());
        Some(Cell::new(self.first_seed + seed as u64, trials.collect::<Option<Vec<_>>>()?))
    }

    /// Returns the known classes of a cell, one for each seed at which it could be run.
    fn classes(&self, cell: usize, outcomes: &Outcomes) -> Vec<Class> {
        let seeds = (0..self.seeds as usize).filter_map(|seed| Some(self.cell(cell, seed, outcomes)?.class));
        seeds.filter(|class| *class != Class::Failed).collect()
    }

    /// Returns the cells near a boundary, as far as these outcomes tell.
    fn near(&self, outcomes: &Outcomes) -> BTreeSet<usize> {
        let classes: Vec<_> = (0..self.cells()).map(|cell| self.classes(cell, outcomes)).collect();
        let mut near = BTreeSet::new();
        for (column, rows) in classes.chunks(self.stiffnesses_n_per_m.len().max(1)).enumerate() {
            let rows = [&[vec![Class::Passive]], rows, &[vec![Class::HighlyUnstable]]].concat();
            for (row, around) in rows.windows(3).enumerate() {
                if around.concat().windows(2).any(|pair| pair[0] != pair[1]) {
                    near.insert(column * (rows.len() - 2) + row);
                }
            }
        }
        near
    }

    /// Returns the indices of the trials to run next, in order; none when the study is finished. They depend only on
    /// the set of outcomes. The outcomes at the end do not depend on the order in which trials are run or interrupted.
    pub fn wanted(&self, outcomes: &Outcomes) -> Vec<usize> {
        let left = |cell: usize, seeds: Range<usize>| {
            let trials = seeds.flat_map(move |seed| self.trials_of(cell, seed));
            trials.filter(|trial| !outcomes.contains_key(trial))
        };
        let first: Vec<usize> = (0..self.cells()).flat_map(|cell| left(cell, 0..1)).collect();
        if !first.is_empty() {
            return first;
        }
        self.near(outcomes).into_iter().flat_map(|cell| left(cell, 0..self.seeds as usize)).collect()
    }
}
