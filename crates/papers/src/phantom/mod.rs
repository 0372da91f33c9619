//! Published studies, run again: Table 2 of Sevcik et al. 2009, a weighted PHANToM dropped onto virtual walls.
//!
//! A [`Study`] is a set of drop trials: rungs of models × axes × platforms × stiffnesses × seeds × trials. Each trial
//! is one run of the shipped scene [`SCENE`] under overrides. Near a boundary of stability one draw is not enough,
//! so a cell there is run at every seed ([`Study::wanted`]). A [`Table`] sums up one seed's trials of one rung as the
//! paper does, and [`Tables`] those of all seeds. [`Published`] knows which cells are legible. [`Tables::claims`]
//! compares the paper's claims with the table of every seed. The [`ladder`] does so with more and more of the physics.
//!
//! Other modules examine the word formats of the arm's datapath: [`formats`] proves and measures ranges and errors,
//! [`hpu_study::phantom`] counts what the tables hold and compares four sources of sine.

mod claims;
pub mod formats;
pub mod ladder;
pub mod postures;
mod published;
mod seeds;
mod table;
mod tables;
mod text;
mod trial;

pub use claims::{Claim, claims};
pub use ladder::{RUNGS, Rung};
pub use ladder::{brief, plus};
pub use published::{Agreement, PUBLISHED, Published};
pub use table::{Cell, Class, Limit, Table};
pub use tables::{Repeated, Share, Span, Tables, Tally};
pub use text::{CSV_HEADER, csv, table_text};
pub use trial::{Trial, Verdict, run_trial, scene};

use std::collections::BTreeMap;
use std::ops::Range;

use hpu_cosim::scene::{Direction, Platform};
use hpu_datapath::phantom::Config;

use crate::Error;
use hpu_prove::arms::{SIGNALS, SignalBound, bounds};
pub use hpu_study::phantom::TABLE_2;

/// The device that the studies are about.
pub const DEVICE: &str = "PHANToM";
/// Table 2 of the paper by ever more of the physics, as `hpu reproduce` takes its name.
pub const LADDER: &str = "phantom-ladder";
/// The formats of the words.
pub const FORMATS: &str = "phantom-formats";
/// The sources of sine.
pub const SINES: &str = "phantom-sines";
/// The cost of blocks and loops.
pub const COST: &str = "phantom-cost";
/// The shipped scene of a drop trial.
pub const SCENE: &str = "phantom-drop";

/// The trials that were run, by their index in [`Study::points`].
pub type Outcomes = BTreeMap<usize, Result<Trial, Error>>;

/// The stiffnesses of the walls, in N/m: the legible rows of the table, and rows that may have stood between them.
pub const STIFFNESSES_N_PER_M: [f64; 20] = [
    5.0, 50.0, 100.0, 250.0, 500.0, 750.0, 1e3, 1250.0, 1500.0, 2e3, 2500.0, 3e3, 4e3, 5e3, 7.5e3, 10e3, 15e3, 20e3,
    30e3, 40e3,
];

/// Number of trials of each cell at a seed, as in the paper.
pub const TRIALS: u64 = 3;

/// Seed of the shipped scene, at which every cell is run.
pub const FIRST_SEED: u64 = 1;

/// Number of seeds at which a cell near a boundary is run.
pub const SEEDS: u64 = 12;

/// The drop trials to run.
#[derive(Clone, PartialEq, Debug)]
pub struct Study {
    /// The models, each of which makes a whole table.
    pub rungs: Vec<Rung>,
    /// The axes.
    pub axes: Vec<Direction>,
    /// The platforms.
    pub platforms: Vec<Platform>,
    /// The stiffnesses of the walls, in N/m, ascending.
    pub stiffnesses_n_per_m: Vec<f64>,
    /// The seed at which every cell is run.
    pub first_seed: u64,
    /// Number of seeds, from the first on, at which a cell near a boundary is run.
    pub seeds: u64,
    /// Number of trials of a cell at a seed.
    pub trials: u64,
    /// Further overrides of the scene.
    pub set: Vec<(String, String)>,
}

/// One drop trial.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TrialSetup {
    /// Index of the rung in the study.
    pub rung: usize,
    /// The axis.
    pub axis: Direction,
    /// The platform.
    pub platform: Platform,
    /// Stiffness of the wall, in N/m.
    pub stiffness_n_per_m: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// Number of the trial, from 1.
    pub trial: u64,
}

impl Study {
    /// Returns the study of all of the paper's trials on these rungs.
    pub fn whole(rungs: &[Rung]) -> Self {
        Self {
            rungs: rungs.to_vec(),
            axes: Direction::ALL.to_vec(),
            platforms: Platform::ALL.to_vec(),
            stiffnesses_n_per_m: STIFFNESSES_N_PER_M.to_vec(),
            first_seed: FIRST_SEED,
            seeds: SEEDS,
            trials: TRIALS,
            set: Vec::new(),
        }
    }

    /// Returns all trials that may be run. They are ordered by rung, axis, platform, stiffness, seed and trial; the
    /// trial changes fastest.
    pub fn points(&self) -> Vec<TrialSetup> {
        let mut points = Vec::new();
        for rung in 0..self.rungs.len() {
            for &axis in &self.axes {
                for &platform in &self.platforms {
                    for &stiffness_n_per_m in &self.stiffnesses_n_per_m {
                        for seed in self.all_seeds() {
                            let point = |trial| TrialSetup { rung, axis, platform, stiffness_n_per_m, seed, trial };
                            points.extend((1..=self.trials).map(point));
                        }
                    }
                }
            }
        }
        points
    }

    /// Returns the seeds, in their order.
    pub fn all_seeds(&self) -> Range<u64> {
        self.first_seed..self.first_seed + self.seeds
    }

    /// Returns a trial's overrides of the scene: first its place in the table, then its rung's model, then the user's
    /// overrides, last its seed.
    pub fn overrides(&self, point: &TrialSetup) -> Vec<(String, String)> {
        let own = [
            ("platform.kind", point.platform.name().to_string()),
            ("drop.axis", point.axis.name().to_string()),
            ("drop.trial", point.trial.to_string()),
            ("room.stiffness", point.stiffness_n_per_m.to_string()),
        ];
        let own = own.map(|(key, value)| (key.to_string(), value));
        let rung = self.rungs[point.rung].overrides(point.platform);
        let rung = rung.map(|(key, value)| (key.to_string(), value.to_string()));
        let seed = [("run.seed".to_string(), point.seed.to_string())];
        own.into_iter().chain(rung).chain(self.set.iter().cloned()).chain(seed).collect()
    }

    /// Keys of the scene that the study itself sets.
    pub const OWN_KEYS: [&str; 4] = ["platform.kind", "drop.axis", "drop.trial", "room.stiffness"];
}
