//! Words of the wall that change while a scene runs.

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
    #[must_use]
    pub fn new(from: i64, to: i64, start: u64, edges: u64) -> Self {
        assert!(edges > 0, "a ramp takes time");
        Self { from, to, start, edges }
    }

    /// Returns the steps of one done up to an edge: all `k` with `(k - 1/2) edges <= distance gone`.
    fn steps(&self, edge: u64) -> i128 {
        let gone = i128::from(edge.saturating_sub(self.start).min(self.edges));
        let (distance, edges) = (i128::from(self.from.abs_diff(self.to)), i128::from(self.edges));
        (2 * distance * gone + edges) / (2 * edges)
    }

    /// Returns the word at an edge.
    #[must_use]
    pub fn word(&self, edge: u64) -> i64 {
        let steps = self.steps(edge) as i64;
        if self.to >= self.from { self.from + steps } else { self.from - steps }
    }

    /// Returns the first edge after this one at which the word changes.
    #[must_use]
    pub fn next(&self, edge: u64) -> Option<u64> {
        let distance = i128::from(self.from.abs_diff(self.to));
        let step = self.steps(edge) + 1;
        let late = || ((2 * step - 1) * i128::from(self.edges) + 2 * distance - 1) / (2 * distance);
        (step <= distance).then(|| self.start + late() as u64)
    }
}

/// The scheduled words of a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Schedule {
    /// The wall's stiffness.
    pub stiffness: Option<WordRamp>,
    /// The factor of the loop's forces or velocities.
    pub scale: Option<WordRamp>,
}

impl Schedule {
    /// Returns the first edge after this one at which a word changes.
    #[must_use]
    pub fn next(&self, edge: u64) -> Option<u64> {
        let ramps = [self.stiffness, self.scale];
        ramps.into_iter().flatten().filter_map(|ramp| ramp.next(edge)).min()
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
}
