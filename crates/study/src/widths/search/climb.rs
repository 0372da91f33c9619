//! Finds the stiffest wall whose motion settles, word by word.
//!
//! The rule begins at the power of two (in PWM counts a count) at or below the scene's own stiffness. While the wall
//! settles, the stiffness is doubled; if it does not settle, it is halved; until a stiffness settles whose double does
//! not. Between these two, the binary digits are tried from the highest down to the format's last. A digit stays if the
//! wall still settles with it. The result is the stable stiffness: it settles, and one word more does not, or the
//! format does not hold one more.
//!
//! The verdict need not be a monotone function of the stiffness, so this is one place where it changes; `hpu limits`
//! shows the others. The place is the same for all formats: a format with more fraction bits tries the same stiffnesses
//! as one with fewer, and then more digits. So it is never less stiff, and stiffer by less than the last digit of the
//! other. After each try, the place lies in a known interval, which the search uses.

/// A climb on the words of one format.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Climb {
    /// The word to begin at, a power of two.
    start: i128,
    /// The greatest word.
    max: i128,
    /// The stiffest word that is known to settle.
    low: Option<i128>,
    /// The softest word that is known not to settle, or the first that the format does not hold.
    high: Option<i128>,
}

impl Climb {
    /// Starts from the scene's own word; the format's words go up to `max`, one less than a power of two.
    pub fn new(own: i128, max: i128) -> Self {
        Self { start: 1 << own.clamp(1, max).ilog2(), max, low: None, high: None }
    }

    /// Returns the word to try next; `None` when the climb is over.
    pub fn next(&self) -> Option<i128> {
        match (self.low, self.high) {
            (None, None) => Some(self.start),
            (Some(low), None) => Some(2 * low),
            (None, Some(1)) => None,
            (None, Some(high)) => Some(high / 2),
            (Some(low), Some(high)) => (high - low > 1).then_some(low + (high - low) / 2),
        }
    }

    /// Takes the verdict on the word that [`next`](Self::next) returned.
    pub fn told(&mut self, settles: bool) {
        let Some(word) = self.next() else { return };
        *(if settles { &mut self.low } else { &mut self.high }) = Some(word);
        if self.high.is_none() && self.low.is_some_and(|low| 2 * low > self.max) {
            self.high = Some(self.max + 1);
        }
    }

    /// Returns the stable word, or a lower bound of it; 0 when none settles.
    pub fn least(&self) -> i128 {
        self.low.unwrap_or(0)
    }

    /// Returns the stable word, or an upper bound of it.
    pub fn most(&self) -> i128 {
        self.high.map_or(self.max, |high| high - 1)
    }

    /// Returns whether the format holds no stiffer wall than the stable one.
    pub fn is_capped(&self) -> bool {
        self.least() == self.max
    }
}

#[cfg(test)]
mod tests {
    use super::Climb;

    fn climb(own: i128, max: i128, settles: impl Fn(i128) -> bool) -> (i128, Vec<i128>) {
        let mut climb = Climb::new(own, max);
        let mut tries = Vec::new();
        while let Some(word) = climb.next() {
            assert!((1..=max).contains(&word), "{word} of {max}");
            tries.push(word);
            climb.told(settles(word));
            assert!(climb.least() <= climb.most());
        }
        assert_eq!(climb.least(), climb.most());
        (climb.least(), tries)
    }

    #[test]
    fn every_limit_of_every_small_format_is_found_from_everywhere() {
        for max in (1..=7).map(|bits| (1 << bits) - 1) {
            for own in 1..=max {
                for limit in 0..=max {
                    assert_eq!(climb(own, max, |word| word <= limit).0, limit, "{own} of {max}");
                }
            }
        }
    }

    #[test]
    fn what_is_found_settles_and_its_neighbour_does_not_whatever_the_verdicts() {
        // Every pattern of verdicts on the words 1 to 15.
        for pattern in 0..1u32 << 15 {
            let settles = |word: i128| pattern >> (word - 1) & 1 == 1;
            let (found, _) = climb(5, 15, settles);
            assert!(found == 0 || settles(found));
            assert!(found == 15 || !settles(found + 1), "{found} of {pattern:015b}");
        }
    }

    #[test]
    fn a_finer_format_tries_what_a_coarser_one_tries_and_then_more() {
        for pattern in 0..1u32 << 15 {
            let settles = |word: i128| pattern >> (word - 1) & 1 == 1;
            let (fine, tries) = climb(10, 15, settles);
            let (coarse, before) = climb(5, 7, |word| settles(2 * word));
            let before: Vec<i128> = before.iter().map(|word| 2 * word).collect();
            assert_eq!(tries[..before.len()], before);
            assert!(fine == 2 * coarse || fine == 2 * coarse + 1, "{fine} {coarse}");
        }
    }
}
