//! The sequence of a law that captures at a sample edge, computes, and loads the result some edges later.

use hpu_signal::{Term, Word};

use crate::base::countdown::{Countdown, edges};
use crate::step::{counted_down, equal, loads_first};
use crate::{Lemma, Step};

/// Registers `R`, and their values after the next load. The values are known at the capture and held back until the
/// load, because no output shows them in between. Sample edges up to and including that of the load are ignored.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Sequence<R> {
    latency: u64,
    countdown: Countdown,
    /// Edges until the load, including the edge of the load; 0 when idle.
    left: u64,
    now: R,
    /// Equal to `now` when idle.
    next: R,
}

impl<R: Copy + PartialEq> Sequence<R> {
    /// Returns an idle sequence with these registers. It loads `latency` edges after a capture.
    pub(crate) fn new(latency: u32, reset: R) -> Self {
        Self { latency: latency.into(), countdown: Countdown::default(), left: 0, now: reset, next: reset }
    }

    /// Returns to idle with these registers.
    pub(crate) fn reset(&mut self, reset: R) {
        *self = Self { latency: self.latency, countdown: Countdown::default(), left: 0, now: reset, next: reset };
    }

    /// Returns the number of edges from a capture to its load.
    pub(crate) fn latency(&self) -> u32 {
        u32::try_from(self.latency).expect("made of one")
    }

    /// Returns the registers as of the latest load.
    #[inline]
    pub(crate) fn loaded(&self) -> &R {
        &self.now
    }

    /// Returns the registers after the latest capture.
    #[inline]
    pub(crate) fn captured(&self) -> &R {
        &self.next
    }

    /// Ticks one edge and returns whether it captures. If it does, the caller must call [`captures`](Self::captures).
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

    /// Takes the registers that result from the capture of this edge.
    #[inline]
    pub(crate) fn captures(&mut self, next: R) {
        self.next = next;
        self.left = self.latency;
    }

    /// Returns the number of edges for which neither a load nor a capture changes a register. It asks `stay` whether
    /// the registers would stay at a capture. They include a motion, so most captures need not be computed to answer.
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

    /// Does that many quiet edges at once: no register changes, whatever is captured and loaded meanwhile.
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

    /// Returns the number of edges before the next capture.
    #[inline]
    fn until_capture(&self, period: i64) -> u64 {
        let (sample, busy) = (self.countdown.left(), self.left);
        sample + edges(period) * busy.saturating_sub(sample).div_ceil(edges(period))
    }

    /// Returns the number of edges from a capture to the next.
    #[inline]
    fn between_captures(&self, period: i64) -> u64 {
        edges(period) * (self.latency / edges(period) + 1)
    }
}

/// Returns, in words, the countdown after an edge of such a law, and whether that edge captures. No edge captures from
/// the one that starts the divider or root to the one that loads its result.
pub(crate) fn captures<W: Word>(left: W, period: W, [start, busy, ready]: [W; 3]) -> (W, W::Bit) {
    let (left, samples) = counted_down(left, period);
    (left, samples & !(start.is_set() | busy.is_set() | ready.is_set()))
}

/// Claims that registers of such a law which a reset leaves as they are do not matter. The law's own registers come
/// first; index `start` is the one that starts the divider or root. The registers of the divider or root follow,
/// `remaining` first and `ready` last. At rest, no kept register is read. A capture loads those of the law, and the
/// start loads those inside the divider or root.
pub(crate) fn loads_before_it_reads<S: Step>(law: &S, own: usize, start: usize) -> Lemma<'_> {
    loads_first(law, move |one: &[Term], other: &[Term]| {
        let rests = !one[own].is_set() & !one[one.len() - 1].is_set();
        rests & (!one[start].is_set() | equal(&one[..own], &other[..own]))
    })
}
