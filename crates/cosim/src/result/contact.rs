//! Contact: the share of the judged window in which the wall sees penetration.
//!
//! The window is that of the [verdict](crate::result::verdict). The position that the wall's law
//! reads decides, not the true angle. The share is
//!
//! - for a loop with a clock, the share of the clock cycles in which the net `penetration` is above 0 (of another
//!   device, the net that its outline names); nets change only at ticks, so the count is exact with both drivers;
//! - for an arm whose force a host computes, the share of the cycles in which the tested joint's command is not 0;
//! - for an axis in steps without a clock, the share of the time beyond the first count inside the wall (with an ideal
//!   encoder, beyond the wall itself), on the straight line between the ends of a step;
//! - for a design of the user's own, the share of the cycles in which the encoder's count is beyond the wall's.
//!
//! A held position, or a counter that wrapped, tells the logic of another contact than that of the device. So the world
//! counts how long the device itself is beyond its wall ([`Stays`](crate::Stays)).

use hpu_signal::Cycle;

use hpu_scene::Experiment;
use hpu_scene::judged::{stride, window_start};

/// Returns begin and end of the judged window of a scene's complete run, in seconds.
pub fn judged_window_s(experiment: &Experiment) -> [f64; 2] {
    let clock = experiment.clock;
    let (edges, stride) = (experiment.edges(), stride(clock, experiment.record.plant_rate_hz));
    let still = clock.edges(experiment.setup().still_from_s());
    [window_start(edges, stride, still), edges].map(|edge| clock.seconds(Cycle(edge)))
}

/// Counts the clock edges of the window in which the wall is touched.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Contact {
    /// Index of the net that shows contact: its word is then not 0.
    net: usize,
    /// The present word of that net, and the edge from which it stands.
    word: i64,
    since: u64,
    /// The window's first edge.
    from: u64,
    edges: u64,
}

impl Contact {
    /// Creates the count for the net of this index, from this edge on; without contact for an index that no net has.
    pub(crate) fn of(net: usize, from: u64) -> Self {
        Self { net, word: 0, since: 0, from, edges: 0 }
    }

    /// Returns the index of the net that shows contact.
    pub(crate) fn net(&self) -> usize {
        self.net
    }

    /// Takes note of the words that stand from `edge` on.
    #[inline(always)]
    pub(crate) fn see(&mut self, edge: u64, words: &[i64]) {
        if let Some(&word) = words.get(self.net)
            && word != self.word
        {
            self.turn(edge, word);
        }
    }

    #[inline(never)]
    fn turn(&mut self, edge: u64, word: i64) {
        self.edges = self.edges(edge);
        (self.word, self.since) = (word, edge);
    }

    /// Returns the edges of contact in the window up to an edge.
    pub(crate) fn edges(&self, end: u64) -> u64 {
        let standing = if self.word == 0 { 0 } else { end.max(self.from) - self.since.max(self.from) };
        self.edges + standing
    }
}

/// Returns how much of a straight line from `from` to `to` lies beyond a limit: 0 to 1.
#[inline(always)]
pub(crate) fn share_beyond(limit: f64, from: f64, to: f64) -> f64 {
    match (from >= limit, to >= limit) {
        (true, true) => 1.0,
        (false, false) => 0.0,
        (false, true) => (to - limit) / (to - from),
        (true, false) => (from - limit) / (from - to),
    }
}
