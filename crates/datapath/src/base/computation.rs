//! The timing of a computation of a fixed number of edges after a start, which the divider, the square root and the
//! CORDIC share.

use hpu_signal::Narrowed;

/// The result of the divider and of the root before their first computation.
pub(crate) const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

/// The sequence of a computation with results `R`. The result is known at the start and held back until the edge that
/// shows it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Computation<R> {
    steps: u64,
    /// Edges until the result is shown; 0 when no computation runs.
    left: u64,
    next: R,
    result: R,
    ready: bool,
}

impl<R: Copy> Computation<R> {
    /// Returns an idle sequence that shows a result `steps` edges after its start, and this one until then.
    pub(crate) fn new(steps: u32, reset: R) -> Self {
        Self { steps: steps.into(), left: 0, next: reset, result: reset, ready: false }
    }

    /// Returns to idle, with this result.
    pub(crate) fn reset(&mut self, reset: R) {
        *self = Self { left: 0, next: reset, result: reset, ready: false, ..*self };
    }

    /// Returns the result that is shown.
    #[inline]
    pub(crate) fn result(&self) -> R {
        self.result
    }

    /// Whether a computation is running.
    #[inline]
    pub(crate) fn busy(&self) -> bool {
        self.left > 0
    }

    /// Whether the latest edge has brought a new result.
    #[inline]
    pub(crate) fn ready(&self) -> bool {
        self.ready
    }

    /// Ticks one edge. `start` holds the result of the computation that starts at this edge; a start discards the
    /// running one.
    #[inline]
    pub(crate) fn tick(&mut self, start: Option<R>) {
        self.ready = false;
        if let Some(next) = start {
            self.next = next;
            self.left = self.steps;
        } else if self.left > 0 {
            self.left -= 1;
            if self.left == 0 {
                self.result = self.next;
                self.ready = true;
            }
        }
    }

    /// Returns the number of edges for which result, busy and ready certainly stay as they are.
    #[inline]
    pub(crate) fn quiet(&self, start: bool) -> u64 {
        match (start, self.busy()) {
            // A start at every edge restarts the computation, so it never ends.
            (true, true) => u64::MAX,
            (true, false) => 0,
            (false, true) => self.left - 1,
            (false, false) if self.ready => 0,
            (false, false) => u64::MAX,
        }
    }

    /// Ticks that many quiet edges at once.
    #[inline]
    pub(crate) fn skip(&mut self, edges: u64, start: Option<R>) {
        match start {
            _ if edges == 0 => {}
            Some(_) => self.tick(start),
            None => self.left = self.left.saturating_sub(edges),
        }
    }
}
