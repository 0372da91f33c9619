//! The table at one seed: what became of each cell's trials, and how stiff each platform's walls may be.

use hpu_cosim::scene::{Direction, Platform};

use super::trial::{Trial, Verdict};
use super::{Outcomes, Study};

/// What a cell of the table shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// Every trial was passive: "x".
    Passive,
    /// Some trial was not, and none was aborted: shaded.
    NonPassive,
    /// Some trial was aborted: white.
    HighlyUnstable,
    /// Some trial could not be run.
    Failed,
}

impl Class {
    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Passive => "passive",
            Self::NonPassive => "non-passive",
            Self::HighlyUnstable => "highly unstable",
            Self::Failed => "failed",
        }
    }
}

/// A cell of the table.
#[derive(Clone, PartialEq, Debug)]
pub struct Cell {
    /// The seed of its draws.
    pub seed: u64,
    /// What it shows.
    pub class: Class,
    /// Its trials, or why they could not be run.
    pub trials: Vec<Result<Trial, String>>,
}

impl Cell {
    pub(super) fn new(seed: u64, trials: Vec<Result<Trial, String>>) -> Self {
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

    /// The mean of the trials' rms; `None` where it was not recorded, which is in cells that are aborted or failed.
    #[must_use]
    pub fn rms_m(&self) -> Option<f64> {
        if !matches!(self.class, Class::Passive | Class::NonPassive) {
            return None;
        }
        let all: Vec<f64> = self.trials.iter().flatten().filter_map(|trial| trial.verdict.rms_m()).collect();
        Some(all.iter().sum::<f64>() / all.len() as f64)
    }

    /// The greatest rms of the trials, by which the cell is passive or not; `None` where [`Cell::rms_m`] is.
    #[must_use]
    pub fn worst_rms_m(&self) -> Option<f64> {
        self.rms_m()?;
        self.trials.iter().flatten().filter_map(|trial| trial.verdict.rms_m()).max_by(f64::total_cmp)
    }
}

/// How stiff a wall may be on a platform, along an axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limit {
    /// The stiffest row that is passive, all softer rows being so too; `None` when the softest is not.
    pub passive_n_per_m: Option<f64>,
    /// The row after it, which is not; `None` when all rows are passive.
    pub beyond_n_per_m: Option<f64>,
    /// Whether some stiffer row is passive again.
    pub again: bool,
}

/// The cells of one rung of the study at one seed; a cell that was not run at it is the first seed's.
#[derive(Clone, PartialEq, Debug)]
pub struct Table {
    /// The seed.
    pub seed: u64,
    /// Along which axes.
    pub axes: Vec<Direction>,
    /// On which platforms.
    pub platforms: Vec<Platform>,
    /// The rows, ascending.
    pub stiffnesses_n_per_m: Vec<f64>,
    /// Trials of each cell.
    pub trials: u64,
    cells: Vec<Cell>,
}

impl Table {
    /// The table of one rung at a seed, the first being 0.
    ///
    /// # Panics
    ///
    /// When not all cells were run at the first seed.
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

    /// A cell, if the study has it.
    #[must_use]
    pub fn cell(&self, axis: Direction, platform: Platform, stiffness_n_per_m: f64) -> Option<&Cell> {
        let axis = self.axes.iter().position(|other| *other == axis)?;
        let platform = self.platforms.iter().position(|other| *other == platform)?;
        let row = self.stiffnesses_n_per_m.iter().position(|other| *other == stiffness_n_per_m)?;
        self.cells.get((axis * self.platforms.len() + platform) * self.stiffnesses_n_per_m.len() + row)
    }

    /// How stiff the walls may be, if the study tells.
    #[must_use]
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

    /// All cells, in the order of the study.
    #[must_use]
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }
}
