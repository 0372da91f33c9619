//! The front: designs that no other design beats in cost, error and stiffness.

use std::collections::BTreeMap;

/// The figures of a design, or the best that they can still become.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Merit {
    /// Lookup tables; fewer are better.
    pub lut4: u32,
    /// Error of the outputs; less is better. An infinite error excludes the design.
    pub error: f64,
    /// The stable stiffness; more is better. A stiffness of 0 excludes the design.
    pub stiffness: f64,
}

impl Merit {
    /// Returns whether it is at least as good in all figures, and better in one.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        let as_good = self.lut4 <= other.lut4 && self.error <= other.error && self.stiffness >= other.stiffness;
        as_good && self != other
    }

    /// Returns whether the design can be on a front: its error is finite and its stiffness above 0.
    #[must_use]
    pub fn is_some(&self) -> bool {
        self.error.is_finite() && self.stiffness > 0.0
    }
}

/// Returns the indices of designs that no other beats, cheapest first; equal designs all stay.
#[must_use]
pub fn front(merits: &[Merit]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..merits.len()).filter(|&index| merits[index].is_some()).collect();
    // Of two designs in this order, the later never beats the earlier.
    order.sort_by(|&a, &b| {
        let (a, b) = (&merits[a], &merits[b]);
        a.lut4.cmp(&b.lut4).then(a.error.total_cmp(&b.error)).then(b.stiffness.total_cmp(&a.stiffness))
    });
    // For each error, the greatest stiffness so far among designs with at most that error: both rise from step to step.
    let mut steps: BTreeMap<u64, f64> = BTreeMap::new();
    let mut kept: Vec<usize> = Vec::new();
    for index in order {
        let Merit { error, stiffness, .. } = merits[index];
        // Errors are not negative, so their bits sort in the same order.
        let error = error.abs().to_bits();
        let stiffest = steps.range(..=error).next_back().map(|(_, stiffness)| *stiffness);
        let equal = kept.last().is_some_and(|&last| merits[last] == merits[index]);
        if !equal && stiffest.is_some_and(|stiffest| stiffest >= stiffness) {
            continue;
        }
        let passed: Vec<u64> =
            steps.range(error..).take_while(|(_, of)| **of <= stiffness).map(|(error, _)| *error).collect();
        steps.retain(|error, _| !passed.contains(error));
        steps.insert(error, stiffness);
        kept.push(index);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::{Merit, front};

    #[test]
    fn the_front_of_every_small_set_is_that_of_the_definition() {
        let values = |seed: u64, index: u64| {
            let mixed = (seed * 31 + index).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let errors = [0.0, 1e-6, 1e-3, f64::INFINITY];
            Merit {
                lut4: (mixed % 4) as u32,
                error: errors[(mixed / 4 % 4) as usize],
                stiffness: (mixed / 16 % 4) as f64,
            }
        };
        for seed in 0..2000 {
            let merits: Vec<Merit> = (0..seed % 12).map(|index| values(seed, index)).collect();
            let is_front =
                |merit: &Merit| merit.is_some() && !merits.iter().any(|other| other.is_some() && other.beats(merit));
            let wanted: Vec<usize> = (0..merits.len()).filter(|&index| is_front(&merits[index])).collect();
            let mut found = front(&merits);
            assert!(found.is_sorted_by_key(|&index| merits[index].lut4));
            found.sort_unstable();
            assert_eq!(found, wanted, "{merits:?}");
        }
    }
}
