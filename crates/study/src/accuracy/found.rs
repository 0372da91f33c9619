//! What a race found.

use hpu_cosim::scene::{OutcomeKind, Output};

use super::contestants::Contestant;
use super::front::front;

/// How wrong a contestant is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Grade {
    /// Every edge of every net is the reference's, and every row of the plant.
    Exact,
    /// The worst error of the outputs that count.
    Off(f64),
    /// It tells the right verdict, and of the other outputs that count nothing.
    VerdictOnly,
    /// The verdict is wrong, or a number is none.
    Wrong,
}

impl Grade {
    /// The error, where it is a number.
    #[must_use]
    pub fn error(self) -> Option<f64> {
        match self {
            Self::Exact => Some(0.0),
            Self::Off(error) => Some(error),
            Self::VerdictOnly | Self::Wrong => None,
        }
    }
}

/// The best of some runs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Speed {
    /// Seconds of motion.
    pub motion_s: f64,
    /// Seconds of wall time.
    pub wall_s: f64,
    /// Clock edges; none of a criterion.
    pub edges: u64,
    /// How many runs there were.
    pub runs: u32,
    /// Seconds of motion, from its start, that were timed and scaled to the whole; `None` where all of it was timed.
    pub timed_s: Option<f64>,
}

impl Speed {
    /// Seconds of motion in a second of wall time.
    #[must_use]
    pub fn motion_per_wall(self) -> f64 {
        self.motion_s / self.wall_s
    }

    /// The part of the motion that was timed, in words: `whole`, or `first 0.031 s`.
    #[must_use]
    pub fn timed(self) -> String {
        // Two digits, which are plain where there are fewer.
        let two = |timed_s: f64| format!("{timed_s:.1e}").parse().unwrap_or(timed_s);
        self.timed_s.map_or("whole".into(), |timed_s| format!("first {} s", two(timed_s)))
    }

    /// Clock edges in a second.
    #[must_use]
    pub fn edges_per_s(self) -> f64 {
        self.edges as f64 / self.wall_s
    }
}

/// What a contestant did.
#[derive(Clone, PartialEq, Debug)]
pub struct Row {
    /// How wrong it is.
    pub grade: Grade,
    /// The error of every output.
    pub errors: Vec<(Output, f64)>,
    /// Its verdict; `None` of a criterion that tells only that the motion does not come to rest.
    pub outcome: Option<OutcomeKind>,
    /// The duration that it and its reference were shortened to, if they were.
    pub shortened_s: Option<f64>,
    /// How fast it is.
    pub speed: Speed,
}

/// A contestant, and what it did, or why it is not one of this scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Entry {
    /// Who.
    pub contestant: Contestant,
    /// What it did.
    pub row: Result<Row, String>,
}

/// A race that is through.
#[derive(Clone, PartialEq, Debug)]
pub struct Chart {
    /// What became of the reference.
    pub outcome: OutcomeKind,
    /// The outputs that count.
    pub outputs: Vec<Output>,
    /// The error that the scene allows.
    pub within: f64,
    /// Everybody, in the order of the race.
    pub entries: Vec<Entry>,
}

impl Chart {
    /// The entries that no other beats in both speed and error, the slowest first.
    #[must_use]
    pub fn front(&self) -> Vec<usize> {
        let point = |entry: &Entry| {
            let row = entry.row.as_ref().ok()?;
            Some((row.speed.motion_per_wall(), row.grade.error()?))
        };
        let points: Vec<(f64, f64)> =
            self.entries.iter().map(|entry| point(entry).unwrap_or((f64::NAN, f64::NAN))).collect();
        front(&points)
    }

    /// The fastest entry whose error is within what the scene allows.
    #[must_use]
    pub fn fastest_within(&self) -> Option<usize> {
        let speed = |index: &usize| self.entries[*index].row.as_ref().map_or(0.0, |row| row.speed.motion_per_wall());
        let within = |index: &usize| {
            let row = self.entries[*index].row.as_ref();
            row.is_ok_and(|row| row.grade.error().is_some_and(|error| error <= self.within))
        };
        (0..self.entries.len()).filter(within).max_by(|a, b| speed(a).total_cmp(&speed(b)))
    }
}
