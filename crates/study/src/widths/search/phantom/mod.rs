//! Searches the widths of a PHANToM's datapath: returns the front of stable stiffness, error of the outputs, block RAM
//! and logic cells.
//!
//! A design is a choice of widths ([`FIELDS`]). The search finds four figures of it: the *stable stiffness* on a ladder
//! of walls ([`rung`]); the *error* of the scene's outputs, with the wall as written, against those of the widest
//! design; *block RAM*; and *logic cells* ([`cells`]). The front holds the designs that no other design beats in all
//! four. Designs whose error is above [`Plan::within`] are left out.
//!
//! The front is always that of the whole grid; nothing is assumed to be monotone. Two theorems save runs.
//!
//! 1. Designs that differ only in the tables' depth share the runs whose counts the shallower tables hold (`runs`).
//! 2. Let a known design cost no more, have no larger error, and be stable up to rung `k`. Another design that is not
//!    passive at rung `k + 1`, or below, is stable up to `k` at most. So it is not on the front, or only as an equal of
//!    the known design. That rung is tried first.
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

/// The options of a search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// The largest error of a design's outputs; designs beyond it are dropped.
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
    /// The highest rung up to which all rungs are passive.
    pub rung: u32,
    /// Whether the stiffness format does not hold the next rung.
    pub capped: bool,
}

impl Point {
    /// Returns whether it is at least as good in all four figures.
    #[must_use]
    pub fn is_as_good_as(&self, other: &Self) -> bool {
        let no_dearer = self.rams <= other.rams && self.cells <= other.cells;
        no_dearer && self.error <= other.error && self.rung >= other.rung
    }

    /// Returns whether it beats another: it is as good in all figures, and better in one.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        self.is_as_good_as(other) && !other.is_as_good_as(self)
    }
}

/// The result of a search.
#[derive(Clone, PartialEq, Debug)]
pub struct Found {
    /// The widest design, which errors are measured against.
    pub reference: Point,
    /// The outputs whose worst error counts.
    pub outputs: Vec<Output>,
    /// The scene's own stiffness.
    pub own_n_per_m: f64,
    /// All designs of the knobs.
    pub designs: usize,
    /// Designs that no scene can have: the reason and their number.
    pub refused: Vec<(String, usize)>,
    /// Designs whose outputs have a larger error than is allowed.
    pub off: usize,
    /// The points that no other point beats: fewest block RAMs first, then fewest cells; of equal points, one.
    pub front: Vec<Point>,
    /// The number of runs done.
    pub runs: usize,
    /// The least number of runs that a search of the whole grid, design by design, takes. A design whose stiffness was
    /// not needed counts as far as it was followed.
    pub grid_runs: usize,
    /// Runs that failed, with their reasons; their designs are left out.
    pub failed: Vec<String>,
}

impl Found {
    /// Returns the stiffness of a point in N/m.
    #[must_use]
    pub fn stiffness_n_per_m(&self, point: &Point) -> f64 {
        self.own_n_per_m * rung(point.rung)
    }

    /// Returns the first design of the front whose stable stiffness falls short of the reference's by at most this
    /// share of it.
    #[must_use]
    pub fn smallest(&self, share: f64) -> Option<&Point> {
        let enough = (1.0 - share) * self.stiffness_n_per_m(&self.reference);
        self.front.iter().find(|point| self.stiffness_n_per_m(point) >= enough)
    }
}

/// Returns the proved errors of a design, for every posture that its tables hold: the error of the tip along one
/// direction in metres, and the error of torques as a share of their joint's full scale, for the forces as words.
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
