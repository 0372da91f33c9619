//! The positions of the latest samples, which the windowed estimators keep.

use std::collections::VecDeque;

use hpu_signal::{Format, Word};

use crate::Register;

/// A shift register of positions, the latest first; all 0 after reset.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct History(VecDeque<i64>);

impl History {
    /// Returns a shift register of `window` positions.
    pub(crate) fn new(window: u32) -> Self {
        Self((0..window).map(|_| 0).collect())
    }

    /// Returns the number of positions.
    #[inline]
    pub(crate) fn window(&self) -> usize {
        self.0.len()
    }

    /// Sets all positions to 0.
    pub(crate) fn reset(&mut self) {
        self.0.iter_mut().for_each(|position| *position = 0);
    }

    /// Shifts in `samples` samples of the same position.
    #[inline]
    pub(crate) fn push(&mut self, position: i64, samples: u64) {
        for _ in 0..samples.min(self.0.len() as u64) {
            self.0.pop_back();
            self.0.push_front(position);
        }
    }

    /// Returns the positions as parts of the VHDL's array, the latest position in the uppermost bits.
    pub(crate) fn registers(&self, name: &'static str, width: u32) -> impl Iterator<Item = Register> {
        let window = u32::try_from(self.0.len()).expect("a window of few samples");
        let format = Format::unsigned(width);
        (1..=window).map(move |ago| Register { low: (window - ago) * width, ..Register::new(name, format) })
    }

    /// Computes the positions after an edge; `samples` says whether it is a sample edge.
    pub(crate) fn pushed<W: Word>(samples: W::Bit, position: W, earlier: &[W]) -> impl Iterator<Item = W> {
        let newer = [position].into_iter().chain(earlier.iter().copied());
        newer.zip(earlier).map(move |(newer, &kept)| W::select(samples, newer, kept))
    }

    /// Returns the position `back` samples before a future sample edge. `waiting` other sample edges come before that
    /// edge, all with the present `position`.
    #[inline]
    pub(crate) fn ago(&self, position: i64, waiting: usize, back: usize) -> i64 {
        if back <= waiting { position } else { self.0[back - waiting - 1] }
    }
}
