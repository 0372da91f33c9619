//! The registers of a law that captures at a sample edge, computes, and loads what came of it edges later.

use hpu_signal::{Term, Word};

use crate::countdown::{Countdown, edges};
use crate::step::{counted_down, equal, loads_first};
use crate::{Lemma, Step};

/// Registers `R` as they are and as the next load leaves them: known at the capture and held back until its edge, as
/// nobody sees them in between. Sample edges up to and including that of the load are passed over.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Sequence<R> {
    latency: u64,
    countdown: Countdown,
    /// Edges until the load, its own included; 0 when idle.
    left: u64,
    now: R,
    /// Equal to `now` when idle.
    next: R,
}

impl<R: Copy + PartialEq> Sequence<R> {
    /// An idle sequence from these registers, that loads `latency` edges after a capture.
    pub(crate) fn new(latency: u32, reset: R) -> Self {
        Self { latency: latency.into(), countdown: Countdown::default(), left: 0, now: reset, next: reset }
    }

    /// Back to idle with these registers.
    pub(crate) fn reset(&mut self, reset: R) {
        *self = Self { latency: self.latency, countdown: Countdown::default(), left: 0, now: reset, next: reset };
    }

    /// Edges from a capture to its load.
    pub(crate) fn latency(&self) -> u32 {
        u32::try_from(self.latency).expect("made of one")
    }

    /// The registers as of the latest load.
    #[inline]
    pub(crate) fn loaded(&self) -> &R {
        &self.now
    }

    /// The registers that the latest capture leads to.
    #[inline]
    pub(crate) fn captured(&self) -> &R {
        &self.next
    }

    /// One edge; tells whether it captures, which is to be followed by [`captures`](Self::captures).
    #[inline]
    pub(crate) fn tick(&mut self, period: i64) -> bool {
        let sample = self.countdown.tick(period);
        if self.left == 0 {
            return sample;
        }
        self.left -= 1;
        if self.left == 0 {
            self.now = self.next;
        }
        false
    }

    /// What the capture of this edge leads to.
    #[inline]
    pub(crate) fn captures(&mut self, next: R) {
        self.next = next;
        self.left = self.latency;
    }

    /// Edges for which neither a load nor a capture changes a register; for that, whether the
    /// registers would stay is asked. A motion is among them, so that most captures need not be computed for it.
    #[inline]
    pub(crate) fn quiet(&self, period: i64, stay: impl FnOnce(&R) -> bool) -> u64 {
        if self.next != self.now {
            self.left - 1
        } else if stay(&self.next) {
            u64::MAX
        } else {
            self.until_capture(period)
        }
    }

    /// That many quiet edges at once: no register changes, whatever is captured and loaded meanwhile.
    #[inline]
    pub(crate) fn skip(&mut self, edges: u64, period: i64) {
        let capture = self.until_capture(period);
        self.left = if edges > capture {
            self.latency.saturating_sub((edges - capture - 1) % self.between_captures(period))
        } else {
            self.left.saturating_sub(edges)
        };
        self.countdown.skip(edges, period);
    }

    /// Edges before that of the next capture.
    #[inline]
    fn until_capture(&self, period: i64) -> u64 {
        let (sample, busy) = (self.countdown.left(), self.left);
        sample + edges(period) * busy.saturating_sub(sample).div_ceil(edges(period))
    }

    /// Edges from a capture to the next.
    #[inline]
    fn between_captures(&self, period: i64) -> u64 {
        edges(period) * (self.latency / edges(period) + 1)
    }
}

/// In words, the countdown after an edge of such a law, and whether that edge captures: none does from the edge that
/// starts the divider or root to that which loads what it made.
pub(crate) fn captures<W: Word>(left: W, period: W, [start, busy, ready]: [W; 3]) -> (W, W::Bit) {
    let (left, samples) = counted_down(left, period);
    (left, samples & !(start.is_set() | busy.is_set() | ready.is_set()))
}

/// That it does not matter what a reset leaves in such a law, whose own registers are the first ones, that which starts
/// at this place; those of the divider or root come after them, its `remaining` first, its `ready` last. At rest, no
/// word that is kept is read; from the capture on, those of the law are loaded, and with the start those inside.
pub(crate) fn loads_before_it_reads<S: Step>(law: &S, own: usize, start: usize) -> Lemma<'_> {
    loads_first(law, move |one: &[Term], other: &[Term]| {
        let rests = !one[own].is_set() & !one[one.len() - 1].is_set();
        rests & (!one[start].is_set() | equal(&one[..own], &other[..own]))
    })
}
