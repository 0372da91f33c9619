//! The countdown between two sample edges, which every sampling block holds.

/// Edges left before the next sample edge; a period of 0 acts as 1.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Countdown {
    left: u64,
}

impl Countdown {
    /// A countdown whose first sample edge comes after that many others.
    pub(crate) fn after(edges: u32) -> Self {
        Self { left: edges.into() }
    }

    /// Edges that certainly come before the next sample edge.
    #[inline]
    pub(crate) fn left(&self) -> u64 {
        self.left
    }

    /// Sample edges among the next `count` edges.
    #[inline]
    pub(crate) fn samples(&self, count: u64, period: i64) -> u64 {
        if count > self.left { 1 + (count - self.left - 1) / edges(period) } else { 0 }
    }

    /// One edge; tells whether it is a sample edge.
    #[inline]
    pub(crate) fn tick(&mut self, period: i64) -> bool {
        let sample = self.left == 0;
        self.left = if sample { edges(period) - 1 } else { self.left - 1 };
        sample
    }

    /// That many edges at once; tells whether a sample edge was among them.
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

/// A sample period in edges.
#[inline]
pub(crate) fn edges(period: i64) -> u64 {
    period.max(1).unsigned_abs()
}
