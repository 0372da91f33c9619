//! Words of the wall, or of a target, that change while a scene runs.

use std::sync::Arc;

use hpu_signal::Format;

use crate::path::AxisTarget;

/// A word that follows a straight line from one value to another: at every edge the nearest word, with halves rounded
/// away from the start.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WordRamp {
    from: i64,
    to: i64,
    start: u64,
    edges: u64,
}

impl WordRamp {
    /// Creates a ramp from the word `from` at edge `start` to the word `to`, `edges` edges later.
    ///
    /// # Panics
    ///
    /// When `edges` is 0.
    pub fn new(from: i64, to: i64, start: u64, edges: u64) -> Self {
        assert!(edges > 0, "a ramp takes time");
        Self { from, to, start, edges }
    }

    /// Returns the steps of one done up to an edge: all `k` with `(k - 1/2) edges <= distance gone`.
    #[inline]
    fn steps(&self, edge: u64) -> u64 {
        let (gone, distance) = (edge.saturating_sub(self.start), self.from.abs_diff(self.to));
        if gone >= self.edges {
            return distance;
        }
        let edges = u128::from(self.edges);
        quotient(2 * u128::from(distance) * u128::from(gone) + edges, 2 * edges)
    }

    /// Returns the word at an edge.
    #[inline]
    pub fn word(&self, edge: u64) -> i64 {
        let steps = self.steps(edge) as i64;
        if self.to >= self.from { self.from + steps } else { self.from - steps }
    }

    /// Returns the first edge after this one at which the word changes.
    #[inline]
    pub fn next(&self, edge: u64) -> Option<u64> {
        let (distance, step) = (self.from.abs_diff(self.to), self.steps(edge) + 1);
        let late = || {
            let (distance, step) = (u128::from(distance), u128::from(step));
            quotient((2 * step - 1) * u128::from(self.edges) + 2 * distance - 1, 2 * distance)
        };
        (step <= distance).then(|| self.start + late())
    }
}

/// Returns `dividend / divisor`, rounded down; the quotient must fit 64 bits.
///
/// Divides in 64 bits where both numbers fit, as they do in most ramps: a division in 128 bits costs more than a law.
#[inline]
fn quotient(dividend: u128, divisor: u128) -> u64 {
    match (u64::try_from(dividend), u64::try_from(divisor)) {
        (Ok(dividend), Ok(divisor)) => dividend / divisor,
        _ => (dividend / divisor) as u64,
    }
}

/// The word of a target: at every sample of the law, the count nearest to the target there.
#[derive(Clone, PartialEq, Debug)]
pub struct TargetWords {
    /// The target.
    pub target: Arc<AxisTarget>,
    /// Clock edges of a sample period.
    pub(crate) period: u64,
    /// The time of a clock edge, in s.
    pub(crate) edge_s: f64,
    /// The position of one count.
    pub(crate) count_rad: f64,
    /// The count at the device's start.
    pub(crate) start: i64,
    /// The format of the word, which wraps; a law in floats has none.
    pub(crate) word: Option<Format>,
}

impl TargetWords {
    /// Returns the position of the target at the latest sample.
    pub fn position(&self, edge: u64) -> f64 {
        self.target.at((edge - edge % self.period) as f64 * self.edge_s)
    }

    /// Returns the word at an edge: counts from the device's start.
    pub fn word(&self, edge: u64) -> i64 {
        let counts = ((self.position(edge) / self.count_rad).round() as i64).saturating_sub(self.start);
        self.word.map_or(counts, |word| word.wrap(counts.into()))
    }

    /// Returns the next edge after this one at which the word may change.
    fn next(&self, edge: u64) -> Option<u64> {
        let sample = edge - edge % self.period;
        let from_s = self.target.moves_from_s(sample as f64 * self.edge_s)?;
        // The sample before the motion begins is soon enough, whatever the division has rounded.
        let before = ((from_s / self.edge_s / self.period as f64) as u64).saturating_sub(1);
        Some(before.saturating_mul(self.period).max(sample.saturating_add(self.period)))
    }
}

/// The scheduled words of a scene.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Schedule {
    /// The wall's stiffness.
    pub stiffness: Option<WordRamp>,
    /// The factor of the loop's forces or velocities.
    pub scale: Option<WordRamp>,
    /// The target, in the place of the wall's surface.
    pub target: Option<TargetWords>,
    /// The wanted position of the paddle's loop, in its own format.
    pub wanted: Option<WordRamp>,
}

impl Schedule {
    /// Whether no word is scheduled.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the first edge after this one at which a word changes.
    pub fn next(&self, edge: u64) -> Option<u64> {
        let ramps = [self.stiffness, self.scale, self.wanted].into_iter().flatten();
        let target = self.target.as_ref().and_then(|target| target.next(edge));
        ramps.filter_map(|ramp| ramp.next(edge)).chain(target).min()
    }
}

#[cfg(test)]
mod tests {
    use super::WordRamp;

    #[test]
    fn every_word_is_the_nearest_to_the_line_and_every_change_is_announced() {
        for (from, to) in [(0, 7), (7, 0), (3, 4), (5, 5), (100, 1), (1, 1000)] {
            for edges in [1u64, 2, 7, 13, 400] {
                let ramp = WordRamp::new(from, to, 10, edges);
                let mut next = ramp.next(0);
                for edge in 1..edges + 30 {
                    let share = edge.clamp(10, 10 + edges) - 10;
                    // |word - line| <= 1/2 in whole numbers.
                    let line = i128::from(from) * i128::from(edges) + i128::from(to - from) * i128::from(share);
                    let off = 2 * (i128::from(ramp.word(edge)) * i128::from(edges) - line).abs();
                    assert!(off <= i128::from(edges), "{ramp:?} at {edge}");
                    assert_eq!(ramp.word(edge) != ramp.word(edge - 1), next == Some(edge), "{ramp:?} at {edge}");
                    if next == Some(edge) {
                        next = ramp.next(edge);
                    }
                }
                assert_eq!((ramp.word(0), ramp.word(10), ramp.word(u64::MAX)), (from, from, to));
                assert_eq!(next, None);
            }
        }
    }

    #[test]
    fn the_widest_word_and_the_longest_run_do_not_overflow() {
        let ramp = WordRamp::new(0, (1 << 32) - 1, 1 << 61, 1 << 61);
        assert_eq!(ramp.word(1 << 62), (1 << 32) - 1);
        assert_eq!(ramp.next(0), Some((1 << 61) + (1 << 28) + 1));
    }

    /// Steps done and the next change, by the formulas in 128 bits.
    fn wide(ramp: WordRamp, edge: u64) -> (i128, Option<i128>) {
        let (distance, edges) = (i128::from(ramp.from.abs_diff(ramp.to)), i128::from(ramp.edges));
        let gone = (i128::from(edge) - i128::from(ramp.start)).clamp(0, edges);
        let steps = (2 * distance * gone + edges).div_euclid(2 * edges);
        let late = || ((2 * steps + 1) * edges + 2 * distance - 1).div_euclid(2 * distance);
        (steps, (steps < distance).then(|| i128::from(ramp.start) + late()))
    }

    fn is_as_in_128_bits(ramp: WordRamp, edge: u64) {
        let (steps, next) = wide(ramp, edge);
        let word = i128::from(ramp.from) + if ramp.to >= ramp.from { steps } else { -steps };
        assert_eq!(i128::from(ramp.word(edge)), word, "{ramp:?} at {edge}");
        assert_eq!(ramp.next(edge).map(i128::from), next, "{ramp:?} at {edge}");
    }

    #[test]
    fn short_ramps_divide_as_in_128_bits() {
        for from in 0..16 {
            for to in 0..16 {
                for edges in 1..40 {
                    let ramp = WordRamp::new(from, to, 3, edges);
                    (0..edges + 6).for_each(|edge| is_as_in_128_bits(ramp, edge));
                }
            }
        }
    }

    #[test]
    fn long_ramps_divide_as_in_128_bits_on_either_side_of_64() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            state ^ (state >> 32)
        };
        let (mut narrow, mut wide) = (0, 0);
        for _ in 0..200_000 {
            let mut below = |bits: u64| random() >> (64 - 1 - random() % bits);
            let (from, to, start, edges) = (below(32), below(32), below(61), 1 + below(61));
            let edge = start + below(62).min(edges + 1);
            let ramp = WordRamp::new(from.cast_signed(), to.cast_signed(), start, edges);
            is_as_in_128_bits(ramp, edge);
            let widest = (2 * u128::from(from.abs_diff(to)) + 1) * u128::from(edges);
            *if widest >> 64 == 0 { &mut narrow } else { &mut wide } += 1;
        }
        assert!(narrow > 10_000 && wide > 10_000, "{narrow} {wide}");
    }
}
