//! Contact: the share of the judged window in which the wall sees penetration.
//!
//! The window is that of the [verdict](crate::verdict): the last 30 % of the run. What counts is penetration as the
//! wall sees it, from the position that its law reads, and not the true angle:
//!
//! - of a loop with a clock, the share of the clock cycles in which the net `penetration` is above 0 (a PHANToM's
//!   `contact`); nets change at ticks alone, so that the count is exact with both drivers;
//! - of a PHANToM whose force a host computes, the share of the cycles with a command other than 0;
//! - of an axis in steps without a clock, the share of the time beyond the first count inside the wall (with an ideal
//!   encoder, beyond the wall itself), on the straight line between the ends of a step.

use std::ops::Range;

use hpu_signal::{Clock, Cycle, Signal};

use crate::scene::Experiment;
use crate::window::window;

/// Clock edges from one row of a trace at this rate to the next.
pub(crate) fn stride(clock: Clock, rate_hz: f64) -> u64 {
    clock.edges(1.0 / rate_hz).max(1)
}

/// The first clock edge of the window of a run of so many edges, with a row every `stride` edges.
pub(crate) fn window_start(edges: u64, stride: u64) -> u64 {
    window(edges / stride + 1).start * stride
}

/// When the judged window of a scene's complete run begins and ends, in seconds.
#[must_use]
pub fn judged_window_s(experiment: &Experiment) -> [f64; 2] {
    let clock = experiment.clock();
    let rate_hz = match experiment {
        Experiment::Axis(scene) => scene.record.plant_rate_hz,
        Experiment::Phantom(scene) => scene.record.plant_rate_hz,
    };
    let (edges, stride) = (experiment.edges(), stride(clock, rate_hz));
    [window_start(edges, stride), edges].map(|edge| clock.seconds(Cycle(edge)))
}

/// Counts the clock edges of the window in which the wall is touched.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Contact {
    /// The nets that tell: one of them is not 0.
    nets: Range<usize>,
    /// The window's first edge.
    from: u64,
    inside: bool,
    since: u64,
    edges: u64,
}

impl Contact {
    /// Of a wiring with these nets, from this edge on.
    pub(crate) fn new(nets: &[Signal], from: u64) -> Self {
        let one = |name: &str| nets.iter().position(|net| net.name == name).map(|at| at..at + 1);
        let commands = || nets.iter().position(|net| net.name == "command1").map(|at| at..at + 3);
        let told = one("penetration").or_else(|| one("contact")).or_else(commands);
        Self { nets: told.expect("a loop around a wall"), from, inside: false, since: 0, edges: 0 }
    }

    /// Takes the words from `edge` on.
    #[inline]
    pub(crate) fn see(&mut self, edge: u64, words: &[i64]) {
        let inside = words[self.nets.clone()].iter().any(|&word| word != 0);
        if inside != self.inside {
            self.turn(edge, inside);
        }
    }

    #[inline(never)]
    fn turn(&mut self, edge: u64, inside: bool) {
        self.edges += self.standing(edge);
        (self.inside, self.since) = (inside, edge);
    }

    /// Edges of contact since the last turn, in the window.
    fn standing(&self, edge: u64) -> u64 {
        if self.inside { edge.max(self.from) - self.since.max(self.from) } else { 0 }
    }

    /// Edges of contact in the window of a run that ended at `end`.
    pub(crate) fn edges(&self, end: u64) -> u64 {
        self.edges + self.standing(end)
    }
}

/// How much of a straight line from `from` to `to` lies beyond a limit: 0 to 1.
#[inline(always)]
pub(crate) fn share_beyond(limit: f64, from: f64, to: f64) -> f64 {
    match (from >= limit, to >= limit) {
        (true, true) => 1.0,
        (false, false) => 0.0,
        (false, true) => (to - limit) / (to - from),
        (true, false) => (from - limit) / (from - to),
    }
}
