//! The front: designs that no other design beats in block RAM, logic, error and stiffness.

use std::collections::BTreeMap;

/// The cost of a loop in an FPGA; less is better. Block RAM comes first where costs are in a row.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Cost {
    /// Block RAMs.
    pub rams: u64,
    /// Estimated lookup tables or logic cells; `None` where there is no estimate for the loop, whatever its widths.
    pub logic: Option<u32>,
}

impl Cost {
    /// Returns the cost of a loop without block RAM.
    pub fn of_logic(logic: u32) -> Self {
        Self { rams: 0, logic: Some(logic) }
    }

    /// Returns the estimated lookup tables; 0 where there is no estimate.
    pub fn lut4(&self) -> u32 {
        self.logic.unwrap_or(0)
    }
}

/// The figures of a design, or the best that they can still become.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Merit {
    /// The cost of the loop.
    pub cost: Cost,
    /// Error of the outputs; less is better. An infinite error excludes the design.
    pub error: f64,
    /// The stable stiffness; more is better. A stiffness of 0 excludes the design.
    pub stiffness: f64,
}

impl Merit {
    /// Returns whether it costs no more and has no larger error.
    pub(crate) fn is_no_dearer(&self, other: &Self) -> bool {
        self.cost.rams <= other.cost.rams && self.cost.logic <= other.cost.logic && self.error <= other.error
    }

    /// Returns whether it is at least as good in all figures, and better in one.
    pub fn beats(&self, other: &Self) -> bool {
        self.is_no_dearer(other) && self.stiffness >= other.stiffness && self != other
    }

    /// Returns whether the design can be on a front: its error is finite and its stiffness above 0.
    pub fn is_some(&self) -> bool {
        self.error.is_finite() && self.stiffness > 0.0
    }
}

/// Returns the indices of the merits that no other merit beats, cheapest first; equal designs all stay.
pub fn front(merits: &[Merit]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..merits.len()).filter(|&index| merits[index].is_some()).collect();
    let by = |a: &Merit, b: &Merit| a.error.total_cmp(&b.error).then(b.stiffness.total_cmp(&a.stiffness));
    // Of two designs in this order, the later never beats the earlier.
    order.sort_by(|&a, &b| {
        let (a, b) = (&merits[a], &merits[b]);
        a.cost.logic.cmp(&b.cost.logic).then(a.cost.rams.cmp(&b.cost.rams)).then(by(a, b))
    });
    // For each number of block RAMs and each error, the greatest stiffness so far among designs with at most that
    // error: both rise from step to step.
    let mut stairs: BTreeMap<u64, BTreeMap<u64, f64>> = BTreeMap::new();
    let mut kept: Vec<usize> = Vec::new();
    for index in order {
        let Merit { cost, error, stiffness } = merits[index];
        // Errors are not negative, so their bits sort in the same order.
        let error = error.abs().to_bits();
        let reached = |(_, steps): (_, &BTreeMap<u64, f64>)| {
            steps.range(..=error).next_back().is_some_and(|(_, stiffest)| *stiffest >= stiffness)
        };
        let equal = kept.last().is_some_and(|&last| merits[last] == merits[index]);
        if !equal && stairs.range(..=cost.rams).any(reached) {
            continue;
        }
        let steps = stairs.entry(cost.rams).or_default();
        let passed: Vec<u64> =
            steps.range(error..).take_while(|(_, of)| **of <= stiffness).map(|(error, _)| *error).collect();
        for error in passed {
            steps.remove(&error);
        }
        steps.insert(error, stiffness);
        kept.push(index);
    }
    kept.sort_by(|&a, &b| merits[a].cost.cmp(&merits[b].cost).then(by(&merits[a], &merits[b])));
    kept
}

#[cfg(test)]
mod tests {
    use super::{Cost, Merit, front};

    #[test]
    fn the_front_of_every_small_set_is_that_of_the_definition() {
        let values = |seed: u64, index: u64| {
            let mixed = (seed * 31 + index).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let errors = [0.0, 1e-6, 1e-3, f64::INFINITY];
            Merit {
                cost: Cost { rams: mixed / 64 % (1 + seed % 3), logic: Some((mixed % 4) as u32) },
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
            assert!(found.is_sorted_by_key(|&index| merits[index].cost));
            found.sort_unstable();
            assert_eq!(found, wanted, "{merits:?}");
        }
    }
}
