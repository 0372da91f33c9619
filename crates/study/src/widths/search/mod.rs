//! What each bit of a loop buys, and what it costs: the front of stable stiffness, error of the outputs, and lookup
//! tables.
//!
//! A design is a choice of widths ([`Width`]) for the loop of a scene. Of each is asked: the *stable stiffness*, the
//! stiffest wall that settles (`climb`'s rule); the *error* of the scene's outputs, wall as written, against those of a
//! reference of wide words ([`crate::accuracy::Outputs`]); and an *estimate* of its LUT4s ([`estimate`]). The front is
//! what no other design beats in all three; a design whose error is above [`Plan::within`], or that settles at no
//! stiffness, is none.
//!
//! A design that is good for one motion may fail another. So a search takes several scenes of one hardware: a design's
//! error is the worst, its stable stiffness the least of all. With [`Plan::proved`] a design's position and velocity
//! hold the range proved for every motion within the device's limits ([`Held`]).
//!
//! The front is that of the whole grid, always: nothing is assumed of verdicts and errors, least of all that they are
//! monotone. Runs are saved by three theorems.
//!
//! 1. A run is a function of the gains' values, whatever their formats, and the same for all words of position and
//!    velocity that hold what the run puts into them (`memory`, with the proof). So most designs are answered by other
//!    designs' runs; of those that are alike in all runs only the cheapest are kept. A run of one scene says nothing of
//!    another.
//! 2. After each try the stable stiffness of a format lies in a known interval, and formats that differ in fraction
//!    bits share their tries (`climb`). The least of several is known once one of them is known and all others lie at
//!    or above it.
//! 3. A design that is beaten even if its stiffness is the interval's upper end, is beaten. So only designs that are on
//!    the front of what all may be at best are looked at any further, until all of that front are known.
//!
//! The order of the runs depends on their results and on nothing else, so a search may be interrupted and gone on with
//! by its rows ([`crate::units`]).

mod case;
mod climb;
mod estimate;
mod front;
mod kinds;
mod knob;
mod memory;
pub mod phantom;
mod refused;
mod runner;
mod table;
mod wave;

use hpu_cosim::scene::{OutcomeKind, Output};

pub use estimate::{ESTIMATE_ERROR, estimate};
pub use front::{Merit, front};
pub use knob::{Design, Knob, Width};
pub use refused::SearchError;
pub use table::{csv, errors_csv};
pub use wave::{Ended, Plan, Progress, search};

use super::proof::Held;

/// A design whose three figures are known.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Point {
    /// Its widths.
    pub design: Design,
    /// Estimated LUT4s, error against the reference, and stable stiffness in the scene's unit.
    pub merit: Merit,
    /// Whether its stiffness format holds no stiffer wall.
    pub capped: bool,
}

/// The errors of designs that differ in one width: its values with the errors there.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// Which width.
    pub width: Width,
    /// Bits and error; an infinite one where the verdict is another, none where no scene has the design.
    pub errors: Vec<(i32, Option<f64>)>,
}

/// A scene that every design of a search was run on.
#[derive(Clone, PartialEq, Debug)]
pub struct On {
    /// As it was named.
    pub scene: String,
    /// The reference's verdict on it.
    pub outcome: OutcomeKind,
    /// Whether the reference touches the wall in the judged window; without that its verdict, and so the stable
    /// stiffness, says nothing of the wall.
    pub touches: bool,
    /// The outputs whose worst error counts.
    pub outputs: Vec<Output>,
}

/// What a search found.
#[derive(Clone, PartialEq, Debug)]
pub struct Found {
    /// What errors are measured against.
    pub reference: Point,
    /// The scenes that every design was run on.
    pub on: Vec<On>,
    /// What is proved of the reference's words on each scene; none where that was not asked, or where they do not hold
    /// it.
    pub proved: Option<Vec<Held>>,
    /// Unit of stiffness.
    pub unit: &'static str,
    /// All designs of the knobs.
    pub designs: usize,
    /// Designs that no scene has: the reason and how many, the most frequent first.
    pub refused: Vec<(String, usize)>,
    /// Designs that are left, those alike in every run counted once.
    pub kinds: usize,
    /// The cheapest design of every kind whose stiffness was found, cheapest first.
    pub points: Vec<Point>,
    /// Indices of those that no other beats, equals among them.
    pub front: Vec<usize>,
    /// Errors around the reference, width by width.
    pub lines: Vec<Line>,
    /// Runs that were done.
    pub runs: usize,
    /// Runs of the grid, design by design, at the least: those whose stiffness was not needed count as far as it was
    /// followed.
    pub grid_runs: usize,
    /// Runs that failed, with their reasons; their designs are left out.
    pub failed: Vec<String>,
}

impl Found {
    /// The outputs whose worst error counts, of all scenes together.
    #[must_use]
    pub fn outputs(&self) -> Vec<Output> {
        let all = self.on.iter().flat_map(|on| &on.outputs);
        all.fold(Vec::new(), |mut all, &output| {
            if !all.contains(&output) {
                all.push(output);
            }
            all
        })
    }

    /// The points of the front, cheapest first; of equals the one of fewest bits.
    pub fn best(&self) -> impl Iterator<Item = &Point> {
        let front = self.front.iter().enumerate();
        let first = front.filter(|&(place, &index)| {
            self.front[..place].last().is_none_or(|&before| self.points[before].merit != self.points[index].merit)
        });
        first.map(|(_, &index)| &self.points[index])
    }

    /// The cheapest design that keeps the reference's stable stiffness but for this share of it.
    #[must_use]
    pub fn smallest(&self, share: f64) -> Option<&Point> {
        let enough = (1.0 - share) * self.reference.merit.stiffness;
        self.best().find(|point| point.merit.stiffness >= enough)
    }
}
