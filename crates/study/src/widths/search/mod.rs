//! Searches the widths of a loop: returns the front of stable stiffness, error of the outputs, and lookup tables.
//!
//! A design is a choice of widths for the loop of a scene. The search finds three figures of it:
//!
//! - the *stable stiffness*, the stiffest wall that settles (by the rule of `climb`);
//! - the *error* of the scene's outputs, with the wall as written, against the outputs of a reference of wide words
//!   ([`crate::accuracy::Outputs`]);
//! - an *estimate* of its LUT4s ([`estimate`]).
//!
//! The front holds the designs that no other design beats in all three. Designs whose error is above [`Plan::within`]
//! and designs that settle at no stiffness are left out.
//!
//! A design that is good for one motion may fail for another. So a search takes several scenes of one hardware: a
//! design's error is the worst of all scenes, its stable stiffness the least. With [`Plan::proved`], a design's
//! position and velocity also hold the range that is proved for every motion within the device's limits
//! ([`ProvedRanges`]).
//!
//! The front is always that of the whole grid. Nothing is assumed of verdicts and errors; they need not be monotone.
//! Three theorems save runs.
//!
//! 1. A run is a function of the gains' values, whatever their formats. It is the same for all widths of position and
//!    velocity, and all depths of tables, that hold every value of the run (`memory`; each device has the proof). So
//!    most designs are answered by the runs of other designs, and of designs that are alike in all runs only the
//!    cheapest are kept. A run of one scene says nothing about another scene.
//! 2. After each try, the stable stiffness of a format lies in a known interval. Formats that differ in fraction bits
//!    share their tries (`climb`). The least stable stiffness of several scenes is known once one of them is known and
//!    all others lie at or above it.
//! 3. A design that is beaten even at the upper end of its interval is beaten. So the search follows only designs that
//!    would be on the front if each had its upper end, until the stiffness of all designs on that front is known.
//!
//! The order of the runs depends only on their results. So an interrupted search can be continued from its rows
//! ([`hpu_farm::units`]).

mod case;
pub(crate) mod climb;
mod device;
pub(crate) mod estimate;
mod front;
mod kinds;
pub(crate) mod knob;
pub(crate) mod loops;
mod memory;
mod runner;
mod wave;

use hpu_cosim::scene::{OutcomeKind, Output};

pub use device::Device;
pub(crate) use device::OF_YOURS;
pub use estimate::{ESTIMATE_ERROR, estimate};
pub use front::{Cost, Merit, front};
pub use knob::{Design, Key, Keys, Knob};
pub use loops::Loops;
pub use memory::Ran;
#[cfg(not(target_family = "wasm"))]
pub use memory::schema;
pub use wave::{Ended, Plan, Progress, search, search_wave};

use hpu_prove::ranges::ProvedRanges;

/// A design whose three figures are known.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RatedDesign {
    /// Its widths.
    pub design: Design,
    /// Cost, error against the reference, and stable stiffness in the scene's unit.
    pub merit: Merit,
    /// Whether its stiffness format holds no stiffer wall.
    pub capped: bool,
}

/// The errors of designs that differ in one width: its values with the errors there.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// Which width.
    pub key: Key,
    /// Bits and error: infinite where the verdict differs, `None` where no scene can have the design.
    pub errors: Vec<(i32, Option<f64>)>,
}

/// A scene on which every design of a search was run.
#[derive(Clone, PartialEq, Debug)]
pub struct On {
    /// Its name as given.
    pub scene: String,
    /// The reference's verdict on it.
    pub outcome: OutcomeKind,
    /// Whether the reference touches the wall in the judged window. Without that, its verdict and the stable stiffness
    /// say nothing about the wall.
    pub touches: bool,
    /// The outputs whose worst error counts.
    pub outputs: Vec<Output>,
}

/// The result of a search.
#[derive(Clone, PartialEq, Debug)]
pub struct Found {
    /// The design that errors are measured against.
    pub reference: RatedDesign,
    /// The scenes on which every design was run.
    pub on: Vec<On>,
    /// The proved ranges of the reference's words on each scene; `None` where they were not requested, or where the
    /// words do not hold them.
    pub proved: Option<Vec<ProvedRanges>>,
    /// Unit of stiffness.
    pub unit: &'static str,
    /// The largest relative error of the estimate of logic.
    pub estimate_error: f64,
    /// All designs of the knobs.
    pub designs: usize,
    /// Designs that no scene can have: the reason and their number, the most frequent first.
    pub refused: Vec<(String, usize)>,
    /// The number of remaining designs; designs that are alike in every run count once.
    pub kinds: usize,
    /// Designs whose outputs have a larger error than is allowed.
    pub off: usize,
    /// The cheapest design of every kind whose stiffness was found, cheapest first.
    pub points: Vec<RatedDesign>,
    /// Indices of the points that no other point beats, equal ones included.
    pub front: Vec<usize>,
    /// Errors around the reference, width by width.
    pub lines: Vec<Line>,
    /// The number of runs done.
    pub runs: usize,
    /// The least number of runs that a search of the whole grid, design by design, takes. A design whose stiffness was
    /// not needed counts as far as it was followed.
    pub grid_runs: usize,
    /// Runs that failed, with their reasons; their designs are left out.
    pub failed: Vec<String>,
}

impl Found {
    /// Returns the outputs whose worst error counts, of all scenes together.
    pub fn outputs(&self) -> Vec<Output> {
        let all = self.on.iter().flat_map(|on| &on.outputs);
        all.fold(Vec::new(), |mut all, &output| {
            if !all.contains(&output) {
                all.push(output);
            }
            all
        })
    }

    /// Returns the points of the front, cheapest first; of equal ones, the one with the fewest bits.
    pub fn best(&self) -> impl Iterator<Item = &RatedDesign> {
        let front = self.front.iter().enumerate();
        let first = front.filter(|&(place, &index)| {
            self.front[..place].last().is_none_or(|&before| self.points[before].merit != self.points[index].merit)
        });
        first.map(|(_, &index)| &self.points[index])
    }

    /// Returns the cheapest design whose stable stiffness falls short of the reference's by at most this share of it.
    pub fn smallest(&self, share: f64) -> Option<&RatedDesign> {
        let enough = (1.0 - share) * self.reference.merit.stiffness;
        self.best().find(|point| point.merit.stiffness >= enough)
    }
}
