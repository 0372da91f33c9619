//! The table at one seed: the class of each cell's trials, and how stiff each platform's walls may be.

use hpu_cosim::scene::{Direction, Platform};

use super::trial::{Trial, Verdict};
use super::{Outcomes, Study};
use crate::Error;

hpu_signal::named! {
    /// The class of a cell, and how the paper prints it.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Class {
        /// Every trial was passive: "x".
        Passive = "passive",
        /// Some trial was not passive, and none was aborted: shaded.
        NonPassive = "non-passive",
        /// Some trial was aborted: white.
        HighlyUnstable = "highly unstable",
        /// Some trial could not be run.
        Failed = "failed",
    }
}

/// A cell of the table.
#[derive(Clone, PartialEq, Debug)]
pub struct Cell {
    /// Seed of the cell's draws.
    pub seed: u64,
    /// Class of the cell.
    pub class: Class,
    /// The cell's trials, or why they could not be run.
    pub trials: Vec<Result<Trial, Error>>,
}

impl Cell {
    pub(super) fn new(seed: u64, trials: Vec<Result<Trial, Error>>) -> Self {
        let verdicts = || trials.iter().flatten().map(|trial| trial.verdict);
        let class = if trials.iter().any(Result::is_err) || trials.is_empty() {
            Class::Failed
        } else if verdicts().any(|verdict| matches!(verdict, Verdict::HighlyUnstable { .. })) {
            Class::HighlyUnstable
        } else if verdicts().all(|verdict| matches!(verdict, Verdict::Passive { .. })) {
            Class::Passive
        } else {
            Class::NonPassive
        };
        Self { seed, class, trials }
    }

    /// Returns the mean of the trials' rms, in m; `None` in cells that are aborted or failed, where it is not recorded.
    pub fn rms_m(&self) -> Option<f64> {
        if !matches!(self.class, Class::Passive | Class::NonPassive) {
            return None;
        }
        let all: Vec<f64> = self.trials.iter().flatten().filter_map(|trial| trial.verdict.rms_m()).collect();
        Some(all.iter().sum::<f64>() / all.len() as f64)
    }

    /// Returns the greatest rms of the trials, in m, which decides whether the cell is passive; `None` where
    /// [`Cell::rms_m`] is.
    pub fn worst_rms_m(&self) -> Option<f64> {
        self.rms_m()?;
        self.trials.iter().flatten().filter_map(|trial| trial.verdict.rms_m()).max_by(f64::total_cmp)
    }
}

/// How stiff a wall may be on a platform, along an axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limit {
    /// The stiffest row, in N/m, that is passive and below which all softer rows are passive too; `None` if the softest
    /// row is not passive.
    pub passive_n_per_m: Option<f64>,
    /// The next row, in N/m, which is not passive; `None` if all rows are passive.
    pub beyond_n_per_m: Option<f64>,
    /// Whether some stiffer row is passive again.
    pub again: bool,
}

/// The cells of one rung of the study at one seed. For a cell that was not run at this seed, the first seed's cell is
/// taken.
#[derive(Clone, PartialEq, Debug)]
pub struct Table {
    /// The seed.
    pub seed: u64,
    /// The axes.
    pub axes: Vec<Direction>,
    /// The platforms.
    pub platforms: Vec<Platform>,
    /// Stiffnesses of the rows, in N/m, ascending.
    pub stiffnesses_n_per_m: Vec<f64>,
    /// Number of trials of each cell.
    pub trials: u64,
    cells: Vec<Cell>,
}

impl Table {
    /// Returns the table of one rung at a seed; the first seed is 0.
    ///
    /// # Panics
    ///
    /// If not all cells were run at the first seed.
    pub(super) fn new(study: &Study, rung: usize, seed: usize, outcomes: &Outcomes) -> Self {
        let count = study.cells() / study.rungs.len();
        let cell = |cell| study.cell(cell, seed, outcomes).or_else(|| study.cell(cell, 0, outcomes));
        let cells = (rung * count..(rung + 1) * count).map(cell).collect::<Option<_>>();
        Self {
            seed: study.first_seed + seed as u64,
            axes: study.axes.clone(),
            platforms: study.platforms.clone(),
            stiffnesses_n_per_m: study.stiffnesses_n_per_m.clone(),
            trials: study.trials,
            cells: cells.expect("every cell is run at the first seed"),
        }
    }

    /// Returns a cell, if the study has it.
    pub fn cell(&self, axis: Direction, platform: Platform, stiffness_n_per_m: f64) -> Option<&Cell> {
        let axis = self.axes.iter().position(|other| *other == axis)?;
        let platform = self.platforms.iter().position(|other| *other == platform)?;
        let row = self.stiffnesses_n_per_m.iter().position(|other| *other == stiffness_n_per_m)?;
        self.cells.get((axis * self.platforms.len() + platform) * self.stiffnesses_n_per_m.len() + row)
    }

    /// Returns how stiff the walls may be, if the study tells.
    pub fn limit(&self, axis: Direction, platform: Platform) -> Option<Limit> {
        let rows = self.stiffnesses_n_per_m.iter();
        let passive = rows.map(|&row| self.cell(axis, platform, row).map(|cell| cell.class == Class::Passive));
        let passive = passive.collect::<Option<Vec<bool>>>()?;
        let row = |index: usize| self.stiffnesses_n_per_m.get(index).copied();
        let first = passive.iter().position(|passive| !passive).unwrap_or(passive.len());
        Some(Limit {
            passive_n_per_m: first.checked_sub(1).and_then(row),
            beyond_n_per_m: row(first),
            again: passive[first..].contains(&true),
        })
    }

    /// Returns all cells, in the order of the study.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }
}
