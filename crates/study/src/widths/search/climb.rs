//! Climbs to the stiffest wall whose motion settles.
//!
//! A verdict need not be a monotone function of the stiffness, so a rule says which place is meant where it changes;
//! `hpu limits` shows the others. After each try, the place lies in a known interval, which the search uses.

/// A climb to the stable stiffness of a design on a scene.
pub trait Climb {
    /// Returns the wall to try next; `None` when the climb is over. `rivals` returns the greatest stiffness that is
    /// known of a design that costs no more and has no larger error. A design that does not exceed it is on no front,
    /// or only as an equal.
    fn next(&self, rivals: &dyn Fn() -> f64) -> Option<i128>;

    /// Takes the verdict on a wall that [`next`](Self::next) returned.
    fn told(&mut self, wall: i128, settles: bool);

    /// Returns bounds of the stable stiffness; 0 where none settles.
    fn between(&self) -> [f64; 2];

    /// Returns whether the format holds no stiffer wall than the stable one.
    fn is_capped(&self) -> bool;

    /// Returns the number of walls that a search design by design tries at least to know as much.
    fn tries(&self) -> usize;

    /// Returns whether the climb has an end still to reach.
    fn is_open(&self) -> bool {
        self.next(&|| 0.0).is_some()
    }
}

/// A climb word by word, on the words of one format.
///
/// It begins at the power of two (in PWM counts a count) at or below the scene's own stiffness. While the wall settles,
/// the stiffness is doubled; if it does not settle, it is halved; until a stiffness settles whose double does not.
/// Between these two, the binary digits are tried from the highest down to the format's last. A digit stays if the wall
/// still settles with it. The result is the stable stiffness: it settles, and one word more does not, or the format
/// does not hold one more.
///
/// The place is the same for all formats: a format with more fraction bits tries the same stiffnesses as one with
/// fewer, and then more digits. So it is never less stiff, and stiffer by less than the last digit of the other.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Digits {
    /// The word to begin at, a power of two.
    start: i128,
    /// The greatest word.
    max: i128,
    /// The stiffness of the last bit.
    lsb: f64,
    /// The stiffest word that is known to settle.
    low: Option<i128>,
    /// The softest word that is known not to settle, or the first that the format does not hold.
    high: Option<i128>,
    tries: usize,
}

impl Digits {
    /// Starts from the scene's own word; the format's words go up to `max`, one less than a power of two.
    pub fn new(own: i128, max: i128, lsb: f64) -> Self {
        Self { start: 1 << own.clamp(1, max).ilog2(), max, lsb, low: None, high: None, tries: 0 }
    }

    /// Returns the stable word, or a lower bound of it; 0 when none settles.
    fn least(&self) -> i128 {
        self.low.unwrap_or(0)
    }

    /// Returns the stable word, or an upper bound of it.
    fn most(&self) -> i128 {
        self.high.map_or(self.max, |high| high - 1)
    }
}

impl Climb for Digits {
    fn next(&self, _rivals: &dyn Fn() -> f64) -> Option<i128> {
        match (self.low, self.high) {
            (None, None) => Some(self.start),
            (Some(low), None) => Some(2 * low),
            (None, Some(1)) => None,
            (None, Some(high)) => Some(high / 2),
            (Some(low), Some(high)) => (high - low > 1).then_some(low + (high - low) / 2),
        }
    }

    fn told(&mut self, wall: i128, settles: bool) {
        self.tries += 1;
        *(if settles { &mut self.low } else { &mut self.high }) = Some(wall);
        if self.high.is_none() && self.low.is_some_and(|low| 2 * low > self.max) {
            self.high = Some(self.max + 1);
        }
    }

    fn between(&self) -> [f64; 2] {
        [self.least(), self.most()].map(|word| word as f64 * self.lsb)
    }

    fn is_capped(&self) -> bool {
        self.least() == self.max
    }

    fn tries(&self) -> usize {
        self.tries
    }
}

/// A climb rung by rung: the highest rung up to which all rungs settle. Nothing is assumed of the rungs above.
///
/// A design that does not settle at the first rung above its rivals, or at one below, is none better than they are. So
/// that rung is tried first.
pub(crate) struct Rungs {
    /// The stiffness of each rung that the format holds, rung 0 first.
    rungs: Vec<f64>,
    /// The number of rungs from 0 on that are known to settle.
    low: usize,
    /// The lowest rung that is known not to settle, or the first that the format does not hold.
    high: usize,
    /// Rungs above that are known to settle.
    above: Vec<usize>,
}

impl Rungs {
    /// Starts below the lowest of the rungs.
    pub fn new(rungs: Vec<f64>) -> Self {
        Self { low: 0, high: rungs.len(), rungs, above: Vec::new() }
    }
}

impl Climb for Rungs {
    fn next(&self, rivals: &dyn Fn() -> f64) -> Option<i128> {
        let rivals = if self.low < self.high { rivals() } else { return None };
        let first = self.rungs.partition_point(|rung| *rung <= rivals);
        let open = (self.low..self.high).contains(&first) && !self.above.contains(&first);
        Some(if open { first } else { self.low } as i128)
    }

    fn told(&mut self, wall: i128, settles: bool) {
        let rung = wall as usize;
        match settles {
            true => self.above.push(rung),
            false => self.high = self.high.min(rung),
        }
        while self.above.contains(&self.low) {
            self.low += 1;
        }
    }

    fn between(&self) -> [f64; 2] {
        [self.low, self.high].map(|rungs| rungs.checked_sub(1).map_or(0.0, |top| self.rungs[top]))
    }

    fn is_capped(&self) -> bool {
        self.low == self.rungs.len()
    }

    fn tries(&self) -> usize {
        // Rung 0 is the run that shows the error.
        (self.low + usize::from(self.high < self.rungs.len())).saturating_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::{Climb, Digits, Rungs};

    fn climb(own: i128, max: i128, settles: impl Fn(i128) -> bool) -> (i128, Vec<i128>) {
        let mut climb = Digits::new(own, max, 1.0);
        let mut tries = Vec::new();
        while let Some(word) = climb.next(&|| 0.0) {
            assert!((1..=max).contains(&word), "{word} of {max}");
            tries.push(word);
            climb.told(word, settles(word));
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

    #[test]
    fn a_ladder_ends_below_its_first_fall_whatever_the_rivals() {
        // Every pattern of verdicts on the rungs 0 to 9, of 1 to 10 newtons a metre.
        for pattern in 0..1u32 << 10 {
            let settles = |rung: i128| pattern >> rung & 1 == 1;
            let stable = (0..10).take_while(|&rung| settles(rung)).count();
            for rivals in 0..=10 {
                let mut climb = Rungs::new((1..=10).map(f64::from).collect());
                let mut tried = Vec::new();
                while let Some(rung) = climb.next(&|| f64::from(rivals)) {
                    assert!(!tried.contains(&rung), "{rung} twice");
                    tried.push(rung);
                    climb.told(rung, settles(rung));
                    let [least, most] = climb.between();
                    assert!(least <= stable as f64 && stable as f64 <= most, "{pattern:b}: {least}..{most}");
                }
                assert_eq!(climb.between(), [stable as f64; 2]);
                assert_eq!(climb.is_capped(), stable == 10);
                assert_eq!(climb.tries(), stable.min(9), "rungs 1 to the first fall");
                assert_eq!(tried[0], if rivals < 10 { rivals.into() } else { 0 });
            }
        }
    }
}
