//! What a run leaves behind for pictures and verdicts: the plant's outputs at a fixed rate, and the datapath's words at the
//! same instants.

use std::ops::Range;

use hpu_signal::{Clock, Cycle, Observe};

/// Index of an axis's angle among its outputs.
pub(crate) const ANGLE: usize = 2;
/// Index of the torque or force of its actuator.
pub(crate) const TORQUE: usize = 3;

/// Recorded rows at a fixed interval, the first of edge 0, each of selected outputs of the plant and of selected nets.
#[derive(Clone, PartialEq, Debug)]
pub struct Trace {
    clock: Clock,
    stride: u64,
    rows: usize,
    kept: Vec<usize>,
    reals: Vec<Vec<f64>>,
    picks: Vec<usize>,
    now: Vec<i64>,
    words: Vec<Vec<i64>>,
}

impl Trace {
    /// A trace, every `stride` edges, of the plant's outputs and of the nets at these indices.
    #[must_use]
    pub fn new(clock: Clock, stride: u64, kept: Vec<usize>, picks: Vec<usize>) -> Self {
        Self {
            clock,
            stride,
            rows: 0,
            reals: vec![Vec::new(); kept.len()],
            kept,
            now: vec![0; picks.len()],
            words: vec![Vec::new(); picks.len()],
            picks,
        }
    }

    /// Begins anew, with room for so many rows: what an earlier run has left is gone, and its memory is used again.
    pub(crate) fn begin(&mut self, rows: u64) {
        let rows = usize::try_from(rows).unwrap_or(0).min(1 << 20);
        self.rows = 0;
        self.now.fill(0);
        for column in &mut self.reals {
            column.clear();
            column.reserve(rows);
        }
        for column in &mut self.words {
            column.clear();
            column.reserve(rows);
        }
    }

    /// Appends rows of outputs that go in straight lines. Of a net it is told the word of all rows, or that it must ask for each.
    #[inline]
    pub(crate) fn extend<const N: usize>(
        &mut self,
        lines: &Lines<N>,
        all: impl Fn(usize) -> Option<i64>,
        each: impl Fn(usize, &[f64; N]) -> i64,
    ) {
        debug_assert_eq!((self.rows as u64 * self.stride, self.stride), (lines.first, lines.stride));
        self.rows += lines.rows as usize;
        for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
            let (start, change) = (lines.start[at], lines.change[at]);
            // Signed, for that is what processors make many floats of at once.
            column.extend((0..lines.rows.cast_signed()).map(|row| start + change * f64::from(row)));
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
        self.stride as f64 * self.clock.period_s()
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The time of a row in seconds.
    #[must_use]
    pub fn time_s(&self, row: usize) -> f64 {
        self.clock.seconds(Cycle(row as u64 * self.stride))
    }

    /// Times of the rows in seconds.
    pub fn times_s(&self) -> impl ExactSizeIterator<Item = f64> + Clone {
        (0..self.rows).map(|row| self.time_s(row))
    }

    /// One output of the plant, by its index in the world's list.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    #[must_use]
    pub fn real(&self, index: usize) -> &[f64] {
        let column = self.kept.iter().position(|&kept| kept == index);
        &self.reals[column.expect("an output that the trace keeps")]
    }

    /// The shaft's angle, of an axis.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    #[must_use]
    pub fn angles_rad(&self) -> &[f64] {
        self.real(ANGLE)
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
    /// Fewer than 2^31.
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
        debug_assert_eq!(self.rows as u64 * self.stride, cycle.0);
        self.rows += 1;
        for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
            column.push(values[at]);
        }
        for (column, &word) in self.words.iter_mut().zip(&self.now) {
            column.push(word);
        }
    }
}
