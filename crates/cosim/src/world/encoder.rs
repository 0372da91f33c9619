//! An incremental encoder: it counts an angle and shows the count on two lines.

use hpu_plant::Band;

/// The levels of the two encoder lines.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pins {
    /// Line A, 0 or 1.
    pub a: i64,
    /// Line B, 0 or 1.
    pub b: i64,
}

impl Pins {
    /// Returns the lines at a count: forward they run 00, 01, 11, 10.
    pub fn at(count: i64) -> Self {
        let phase = count & 3;
        Self { a: phase >> 1, b: (phase >> 1) ^ (phase & 1) }
    }

    /// Returns the counts from these levels to the next, as a decoder of quadrature reads them: 0 where both lines
    /// change at once.
    pub(crate) fn counts_to(self, next: Self) -> i64 {
        let phase = |pins: Self| 2 * pins.a + (pins.a ^ pins.b);
        match (phase(next) - phase(self)) & 3 {
            1 => 1,
            3 => -1,
            _ => 0,
        }
    }
}

/// Two lines that follow the words of an absolute sensor, a count each clock cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Follower {
    /// Bits of a word.
    bits: u32,
    /// The count that the lines show, and the count of the latest word.
    pub(crate) shown: i64,
    wanted: i64,
    /// The edge at which the lines change next.
    pub(crate) next: u64,
}

impl Follower {
    /// Creates lines that show a count, with the sensor's word there.
    pub(crate) fn new(bits: u32, count: i64) -> (Self, i64) {
        (Self { bits, shown: count, wanted: count, next: u64::MAX }, count & ((1 << bits) - 1))
    }

    /// Takes the present word, whose count is the one next to that of the word before, and moves the lines at an edge.
    pub(crate) fn follow(&mut self, edge: u64, word: i64) {
        let unused = i64::BITS - self.bits;
        self.wanted += (word - self.wanted) << unused >> unused;
        if self.wanted == self.shown {
            self.next = u64::MAX;
        } else if self.next == u64::MAX || self.next <= edge {
            self.shown += (self.wanted - self.shown).signum();
            self.next = if self.wanted == self.shown { u64::MAX } else { edge + 1 };
        }
    }
}

/// The state of an encoder on a shaft.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Encoder {
    step_rad: f64,
    count: i64,
    band: Band,
    /// Changes of the count so far.
    pub(crate) edges: u64,
    /// Whether the angle has left the range of counts, or is NaN.
    lost: bool,
}

/// The greatest size of a count. Up to twice this size, `f64` still tells the angle of one count from that of the next.
const MOST_COUNT: f64 = (1u64 << 52) as f64;

impl Encoder {
    /// Creates an encoder whose count changes every `step_rad`, at an angle; with an infinite step the count never
    /// changes.
    pub(crate) fn new(step_rad: f64, angle_rad: f64) -> Self {
        let mut encoder =
            Self { step_rad, count: 0, band: Band { low: 0.0, high: 0.0, open: true }, edges: 0, lost: false };
        if step_rad == f64::INFINITY {
            encoder.band = Band { low: f64::NEG_INFINITY, high: f64::INFINITY, open: true };
            return encoder;
        }
        encoder.recount(angle_rad, |(low, high)| i8::from(angle_rad >= high) - i8::from(angle_rad < low));
        encoder.edges = 0;
        encoder
    }

    pub(crate) fn count(&self) -> i64 {
        self.count
    }

    /// Returns why no count follows the angle any more, or `None` if one does.
    #[inline]
    pub(crate) fn over(&self) -> Option<&'static str> {
        self.lost.then_some("the motion has left the 2^52 counts to either side that an encoder can tell apart")
    }

    pub(crate) fn pins(&self) -> Pins {
        Pins::at(self.count)
    }

    /// Returns the angles of the present count.
    #[inline(always)]
    pub(crate) fn band(&self) -> Band {
        self.band
    }

    /// Returns the count beside the present one, on the side of its band on which this angle lies, and the angles of
    /// that count; `None` for an angle within the band, and for NaN.
    #[inline(always)]
    pub(crate) fn beside(&self, angle_rad: f64) -> Option<(i64, Band)> {
        let Band { low, high, .. } = self.band;
        let count = self.count + i64::from(side_of((low, high), angle_rad));
        // Farther out, `f64` does not tell all angles of counts apart.
        (count != self.count && count.unsigned_abs() < MOST_COUNT as u64 / 2).then(|| (count, self.band_of(count)))
    }

    /// Sets the count to the one [`beside`](Self::beside) the present one.
    #[inline(always)]
    pub(crate) fn step(&mut self, (count, band): (i64, Band)) {
        (self.count, self.band) = (count, band);
        self.edges += 1;
    }

    #[inline(always)]
    fn band_of(&self, count: i64) -> Band {
        Band { low: count as f64 * self.step_rad, high: (count + 1) as f64 * self.step_rad, open: true }
    }

    /// Takes the shaft's present angle. Returns whether the count has changed.
    #[inline(always)]
    pub(crate) fn sense(&mut self, angle_rad: f64) -> bool {
        self.sense_by(angle_rad, |band| side_of(band, angle_rad))
    }

    /// Takes the shaft's present angle, as [`sense`](Self::sense). The caller decides on which side of a band it lies
    /// (-1 below, 0 inside, 1 above), because it may know that better than `f64`.
    #[inline(always)]
    pub(crate) fn sense_by(&mut self, angle_rad: f64, mut side: impl FnMut((f64, f64)) -> i8) -> bool {
        let Band { low, high, .. } = self.band;
        let beyond = side((low, high));
        // NaN lies outside of every band.
        if beyond == 0 && !angle_rad.is_nan() {
            return false;
        }
        self.recount(angle_rad, side);
        true
    }

    /// Sets the count of an angle: the integer `c` with `c·δ <= angle < (c+1)·δ`, with the products as computed, so
    /// that it does not depend on how the angle was reached.
    fn recount(&mut self, angle_rad: f64, mut side: impl FnMut((f64, f64)) -> i8) {
        let near = angle_rad / self.step_rad;
        // NaN is not within the range either.
        self.lost = near.is_nan() || near.abs() >= MOST_COUNT;
        if self.lost {
            return;
        }
        let mut count = near as i64;
        let mut band = self.band_of(count);
        loop {
            match side((band.low, band.high)) {
                0 => break,
                way => count += i64::from(way),
            }
            band = self.band_of(count);
        }
        self.edges += count.abs_diff(self.count);
        (self.count, self.band) = (count, band);
    }
}

/// Returns where an angle lies with respect to a band: -1 below, 0 inside, 1 above.
#[inline(always)]
pub(crate) fn side_of((low, high): (f64, f64), angle_rad: f64) -> i8 {
    i8::from(angle_rad >= high) - i8::from(angle_rad < low)
}
