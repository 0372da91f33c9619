//! A computation of one bit an edge from a start on, as the divider and the square root have it.

use hpu_signal::Narrowed;

/// Registers of the sequence; the result is known at the start and held back until its edge.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Computation {
    steps: u64,
    /// Edges until the result is shown; 0 when idle.
    left: u64,
    next: Narrowed,
    result: Narrowed,
    ready: bool,
}

impl Computation {
    /// An idle sequence that shows its result that many edges after the start.
    pub(crate) fn new(steps: u32) -> Self {
        let zero = Narrowed { word: 0, rounded: false, overflowed: false };
        Self { steps: steps.into(), left: 0, next: zero, result: zero, ready: false }
    }

    /// Back to idle, result 0.
    pub(crate) fn reset(&mut self) {
        let zero = Narrowed { word: 0, rounded: false, overflowed: false };
        *self = Self { left: 0, next: zero, result: zero, ready: false, ..*self };
    }

    /// The result shown.
    #[inline]
    pub(crate) fn result(&self) -> Narrowed {
        self.result
    }

    /// Whether a computation is under way.
    #[inline]
    pub(crate) fn busy(&self) -> bool {
        self.left > 0
    }

    /// Whether the latest edge has brought the result.
    #[inline]
    pub(crate) fn ready(&self) -> bool {
        self.ready
    }

    /// One edge; a start comes with the result that it will have, and gives up what is under way.
    #[inline]
    pub(crate) fn tick(&mut self, start: Option<Narrowed>) {
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

    /// Edges for which result, busy and ready stay as they are.
    #[inline]
    pub(crate) fn quiet(&self, start: bool) -> u64 {
        match (start, self.busy()) {
            // Started over and over, it never ends.
            (true, true) => u64::MAX,
            (true, false) => 0,
            (false, true) => self.left - 1,
            (false, false) if self.ready => 0,
            (false, false) => u64::MAX,
        }
    }

    /// That many quiet edges at once.
    #[inline]
    pub(crate) fn skip(&mut self, edges: u64, start: Option<Narrowed>) {
        match start {
            _ if edges == 0 => {}
            Some(_) => self.tick(start),
            None => self.left = self.left.saturating_sub(edges),
        }
    }
}
