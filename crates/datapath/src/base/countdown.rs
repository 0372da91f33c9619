//! The countdown to the next sample edge, which every sampling block has.

/// The number of edges left before the next sample edge; a period of 0 acts as 1.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Countdown {
    left: u64,
}

impl Countdown {
    /// Returns a countdown whose first sample edge comes after `edges` other edges.
    pub(crate) fn after(edges: u32) -> Self {
        Self { left: edges.into() }
    }

    /// Returns the number of edges that certainly come before the next sample edge.
    #[inline]
    pub(crate) fn left(&self) -> u64 {
        self.left
    }

    /// Returns the number of sample edges among the next `count` edges.
    #[inline]
    pub(crate) fn samples(&self, count: u64, period: i64) -> u64 {
        if count > self.left { 1 + (count - self.left - 1) / edges(period) } else { 0 }
    }

    /// Ticks one edge; returns whether it is a sample edge.
    #[inline]
    pub(crate) fn tick(&mut self, period: i64) -> bool {
        let sample = self.left == 0;
        self.left = if sample { edges(period) - 1 } else { self.left - 1 };
        sample
    }

    /// Ticks `count` edges at once; returns whether a sample edge was among them.
    #[inline]
    pub(crate) fn skip(&mut self, count: u64, period: i64) -> bool {
        let sample = count > self.left;
        self.left = if sample {
            let since_sample = (count - self.left - 1) % edges(period);
            edges(period) - 1 - since_sample
        } else {
            self.left - count
        };
        sample
    }
}

/// Returns a sample period in edges; 0 acts as 1.
#[inline]
pub(crate) fn edges(period: i64) -> u64 {
    period.max(1).unsigned_abs()
}
