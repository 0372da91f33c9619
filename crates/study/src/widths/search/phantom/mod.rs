//! What each bit of a PHANToM's datapath buys: the front of stable stiffness, error of the outputs, block RAM and logic
//! cells.
//!
//! A design is a choice of widths ([`FIELDS`]). Of each is asked: the *stable stiffness* on a ladder of walls
//! ([`rung`]); the *error* of the scene's outputs, wall as written, against those of the widest design; *block RAM* and
//! *logic cells* ([`cells`]). The front is what no other design beats in all four; a design whose error is above
//! [`Plan::within`] is none.
//!
//! The front is that of the whole grid, always: nothing is assumed to be monotone. Runs are saved by two theorems.
//!
//! 1. Designs that differ in the tables' depth alone share the runs whose counts the shallower tables hold (`runs`).
//! 2. Let a known design cost no more, err no more, and be stable up to rung `k`. One that is not passive at rung
//!    `k + 1`, or below, is stable up to `k` at most, and so is not on the front, or only as its equal. That rung is
//!    tried first.
//!
//! The runs do not depend on the number of threads.

mod cost;
mod knob;
mod runs;
mod search;
mod table;

pub use cost::{ESTIMATE_ERROR, cells, rams};
pub use knob::{Design, FIELDS, Knob, key};
pub use runs::rung;
pub use search::search;
pub use table::csv;

use std::num::NonZeroUsize;

use hpu_cosim::scene::{Output, PhantomScene};

use crate::widths::proof::bounds;

/// How a search is done.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// The most that a design's outputs may be off by; beyond, it is another scene.
    pub within: f64,
    /// Threads.
    pub jobs: NonZeroUsize,
}

/// A design whose four figures are known.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Point {
    /// Its widths.
    pub design: Design,
    /// Block RAMs of its tables.
    pub rams: u64,
    /// Estimated logic cells of a parallel loop.
    pub cells: Option<u32>,
    /// Error of the outputs.
    pub error: f64,
    /// The highest rung up to which all are passive.
    pub rung: u32,
    /// Whether the stiffness format does not hold the next one.
    pub capped: bool,
}

impl Point {
    /// Whether it is at least as good in all four.
    #[must_use]
    pub fn is_as_good_as(&self, other: &Self) -> bool {
        let no_dearer = self.rams <= other.rams && self.cells <= other.cells;
        no_dearer && self.error <= other.error && self.rung >= other.rung
    }

    /// Whether it beats another: as good in all, and better in one.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        self.is_as_good_as(other) && !other.is_as_good_as(self)
    }
}

/// What a search found.
#[derive(Clone, PartialEq, Debug)]
pub struct Found {
    /// What errors are measured against: the widest design.
    pub reference: Point,
    /// The outputs whose worst error counts.
    pub outputs: Vec<Output>,
    /// The scene's own stiffness.
    pub own_n_per_m: f64,
    /// All designs of the knobs.
    pub designs: usize,
    /// Designs that no scene has: the reason and how many.
    pub refused: Vec<(String, usize)>,
    /// Designs whose outputs are off by more than is allowed.
    pub off: usize,
    /// Those that no other beats, of fewest block RAMs and then fewest cells first; of equals one.
    pub front: Vec<Point>,
    /// Runs that were done.
    pub runs: usize,
    /// Runs of the grid, design by design, at the least: those whose stiffness was not needed count as far as it was
    /// followed.
    pub grid_runs: usize,
    /// Runs that failed, with their reasons; their designs are left out.
    pub failed: Vec<String>,
}

impl Found {
    /// Stiffness of a point in N/m.
    #[must_use]
    pub fn stiffness_n_per_m(&self, point: &Point) -> f64 {
        self.own_n_per_m * rung(point.rung)
    }

    /// The first design of the front that keeps the reference's stable stiffness but for this share of it.
    #[must_use]
    pub fn smallest(&self, share: f64) -> Option<&Point> {
        let enough = (1.0 - share) * self.stiffness_n_per_m(&self.reference);
        self.front.iter().find(|point| self.stiffness_n_per_m(point) >= enough)
    }
}

/// Proved of a design, for every posture that its tables hold: the error of the tip along one direction in metres, and
/// of torques over their joint's full scale, for the forces as words.
///
/// # Errors
///
/// Why there is no such datapath.
pub fn proved(base: &PhantomScene, design: &Design) -> Result<(f64, f64), String> {
    let scene = design.scene(base)?;
    let config = &scene.method.config;
    let bounds = bounds(config, scene.room.stiffness_n_per_m).map_err(|error| error.to_string())?;
    let error = |name: &str| bounds.iter().find(|bound| bound.name == name).map_or(f64::INFINITY, |bound| bound.error);
    let tip_m = ["x", "y", "z"].into_iter().map(error).fold(0.0, f64::max);
    let full = f64::from(1u32 << (config.gain_frac + config.command_width - 1));
    let torques = ["torque1", "torque2", "torque3"].into_iter().zip(config.gains);
    Ok((tip_m, torques.map(|(name, gain)| error(name) * f64::from(gain) / full).fold(0.0, f64::max)))
}
