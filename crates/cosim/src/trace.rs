//! What a run leaves behind for pictures and verdicts: the plant's outputs at a fixed rate, and the datapath's words at the
//! same instants.

use std::ops::Range;

use hpu_signal::{Clock, Cycle, Observe};

/// Recorded rows at a fixed interval, each of the plant's outputs and of selected nets.
#[derive(Clone, PartialEq, Debug)]
pub struct Trace {
    interval_s: f64,
    clock: Clock,
    picks: Vec<usize>,
    now: Vec<i64>,
    times_s: Vec<f64>,
    reals: Vec<Vec<f64>>,
    words: Vec<Vec<i64>>,
}

impl Trace {
    /// A trace of so many outputs of the plant every `stride` edges, and of the nets at these indices.
    #[must_use]
    pub fn new(clock: Clock, stride: u64, reals: usize, picks: Vec<usize>) -> Self {
        Self {
            interval_s: stride as f64 * clock.period_s(),
            clock,
            now: vec![0; picks.len()],
            words: vec![Vec::new(); picks.len()],
            picks,
            times_s: Vec::new(),
            reals: vec![Vec::new(); reals],
        }
    }

    /// Makes room for so many rows.
    pub(crate) fn reserve(&mut self, rows: u64) {
        let rows = usize::try_from(rows).unwrap_or(0).min(1 << 20);
        self.times_s.reserve(rows);
        self.reals.iter_mut().for_each(|column| column.reserve(rows));
        self.words.iter_mut().for_each(|column| column.reserve(rows));
    }

    /// Appends rows of outputs that go in straight lines. Of a net it is told the word of all rows, or that it must ask for each.
    #[inline]
    pub(crate) fn extend<const N: usize>(
        &mut self,
        lines: &Lines<N>,
        all: impl Fn(usize) -> Option<i64>,
        each: impl Fn(usize, &[f64; N]) -> i64,
    ) {
        let frequency_hz = self.clock.frequency_hz() as f64;
        let edge = |row: u32| (lines.first + u64::from(row) * lines.stride).cast_signed() as f64;
        self.times_s.extend((0..lines.rows).map(|row| edge(row) / frequency_hz));
        for ((column, &start), &change) in self.reals.iter_mut().zip(&lines.start).zip(&lines.change) {
            column.extend((0..lines.rows).map(|row| start + change * f64::from(row)));
        }
        for (column, &pick) in self.words.iter_mut().zip(&self.picks) {
            match all(pick) {
                Some(word) => column.extend((0..lines.rows).map(|_| word)),
                None => column.extend((0..lines.rows).map(|row| each(pick, &lines.at(row)))),
            }
        }
    }

    /// Seconds between rows.
    #[must_use]
    pub fn interval_s(&self) -> f64 {
        self.interval_s
    }

    /// Times of the rows in seconds.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// One output of the plant, by its index in the world's list.
    #[must_use]
    pub fn real(&self, index: usize) -> &[f64] {
        &self.reals[index]
    }

    /// The shaft's angle, of an axis.
    #[must_use]
    pub fn angles_rad(&self) -> &[f64] {
        &self.reals[2]
    }

    /// The words of the picked net number `index`.
    #[must_use]
    pub fn words(&self, index: usize) -> &[i64] {
        &self.words[index]
    }
}

/// Rows of outputs that go in straight lines.
pub(crate) struct Lines<const N: usize> {
    /// Edge of the first row.
    pub(crate) first: u64,
    /// Edges from one row to the next.
    pub(crate) stride: u64,
    pub(crate) rows: u32,
    /// The first row.
    pub(crate) start: [f64; N],
    /// From one row to the next.
    pub(crate) change: [f64; N],
}

impl<const N: usize> Lines<N> {
    /// A row.
    #[inline(always)]
    pub(crate) fn at(&self, row: u32) -> [f64; N] {
        std::array::from_fn(|k| self.start[k] + self.change[k] * f64::from(row))
    }
}

impl Observe for Trace {
    fn follows(&self, nets: Range<usize>) -> bool {
        self.picks.iter().any(|pick| nets.contains(pick))
    }

    #[inline]
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        for (now, &pick) in self.now.iter_mut().zip(&self.picks) {
            *now = words[pick];
        }
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.times_s.push(self.clock.seconds(cycle));
        for (column, &value) in self.reals.iter_mut().zip(values) {
            column.push(value);
        }
        for (column, &word) in self.words.iter_mut().zip(&self.now) {
            column.push(word);
        }
    }
}
