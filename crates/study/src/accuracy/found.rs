//! The results of a race.

use hpu_cosim::scene::{OutcomeKind, Output};
use hpu_farm::UnitResult;

use super::contestants::Contestant;
use super::front::front;
use crate::timing::Spread;

/// How large the error of a contestant is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Grade {
    /// Every edge of every net, and every row of the plant, equals the reference.
    Exact,
    /// The worst error of the outputs that count, relative.
    Off(f64),
    /// The verdict is right; the contestant gives none of the other outputs that count.
    VerdictOnly,
    /// The verdict is wrong, or an output is not a number.
    Wrong,
}

impl Grade {
    /// Returns the name of the grade.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Off(_) => "off",
            Self::VerdictOnly => "verdict_only",
            Self::Wrong => "wrong",
        }
    }

    /// Returns the error, if it is a number.
    pub fn error(self) -> Option<f64> {
        match self {
            Self::Exact => Some(0.0),
            Self::Off(error) => Some(error),
            Self::VerdictOnly | Self::Wrong => None,
        }
    }
}

/// The speed of a contestant over some turns, in which all contestants run one after the other.
#[derive(Clone, PartialEq, Debug)]
pub struct Speed {
    /// Duration of the motion, in s.
    pub motion_s: f64,
    /// The wall time of each turn, in s.
    pub walls_s: Vec<f64>,
    /// Number of clock edges; 0 for a criterion.
    pub edges: u64,
    /// Seconds of motion, from its start, that were timed and scaled to the whole; `None` if the whole motion was
    /// timed.
    pub timed_s: Option<f64>,
}

impl Speed {
    /// Returns median and quartiles of the wall time, in s.
    pub fn wall_s(&self) -> Spread {
        Spread::of(&self.walls_s)
    }

    /// Returns the seconds of motion in a second of the median wall time.
    pub fn motion_per_wall(&self) -> f64 {
        self.motion_s / self.wall_s().median
    }

    /// Returns how many times as fast this contestant is as another one, by the turns in which both have run.
    pub fn over(&self, other: &Self) -> Spread {
        let per_motion = |speed: &Self| speed.walls_s.iter().map(|wall_s| wall_s / speed.motion_s).collect::<Vec<_>>();
        Spread::ratio(&per_motion(other), &per_motion(self))
    }

    /// Returns as text which part of the motion was timed: `whole`, or `first 0.031 s`.
    pub fn timed(&self) -> String {
        // Two digits; parsing drops trailing zeros.
        let two = |timed_s: f64| format!("{timed_s:.1e}").parse().unwrap_or(timed_s);
        self.timed_s.map_or("whole".into(), |timed_s| format!("first {} s", two(timed_s)))
    }

    /// Returns the number of clock edges in a second of wall time.
    pub fn edges_per_s(&self) -> f64 {
        self.edges as f64 / self.wall_s().median
    }
}

/// The result of a contestant.
#[derive(Clone, PartialEq, Debug)]
pub struct ContestantResult {
    /// How large its error is.
    pub grade: Grade,
    /// The error of every output.
    pub errors: Vec<(Output, f64)>,
    /// The contestant's verdict; `None` for a criterion that only tells that the motion does not come to rest.
    pub outcome: Option<OutcomeKind>,
    /// The duration, in s, to which the contestant and its reference were shortened, if they were.
    pub shortened_s: Option<f64>,
    /// The contestant's speed.
    pub speed: Speed,
}

/// A contestant and its result, or why it cannot run this scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Entry {
    /// The contestant.
    pub contestant: Contestant,
    /// The result of the contestant.
    pub row: UnitResult<ContestantResult>,
}

/// A finished race.
#[derive(Clone, PartialEq, Debug)]
pub struct Chart {
    /// The reference's verdict.
    pub outcome: OutcomeKind,
    /// The outputs that count.
    pub outputs: Vec<Output>,
    /// The relative error that the scene allows.
    pub within: f64,
    /// All contestants, in the order of the race.
    pub entries: Vec<Entry>,
}

impl Chart {
    /// Returns the entries that no other entry beats in both speed and error, the slowest first.
    pub fn front(&self) -> Vec<usize> {
        let point = |entry: &Entry| {
            let row = entry.row.as_ref().ok()?;
            Some((row.speed.motion_per_wall(), row.grade.error()?))
        };
        let points: Vec<(f64, f64)> =
            self.entries.iter().map(|entry| point(entry).unwrap_or((f64::NAN, f64::NAN))).collect();
        front(&points)
    }

    /// Returns the fastest entry whose error is within what the scene allows.
    pub fn fastest_within(&self) -> Option<usize> {
        let speed = |index: &usize| self.entries[*index].row.as_ref().map_or(0.0, |row| row.speed.motion_per_wall());
        let within = |index: &usize| {
            let row = self.entries[*index].row.as_ref();
            row.is_ok_and(|row| row.grade.error().is_some_and(|error| error <= self.within))
        };
        (0..self.entries.len()).filter(within).max_by(|a, b| speed(a).total_cmp(&speed(b)))
    }
}
