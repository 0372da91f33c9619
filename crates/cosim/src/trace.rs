//! What a run leaves behind for pictures and verdicts: the plant's outputs at a fixed rate, and the datapath's words at the
//! same instants.

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

impl Observe for Trace {
    #[inline]
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        for (now, &pick) in self.now.iter_mut().zip(&self.picks) {
            *now = words[pick];
        }
    }

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
