//! Rows for the loops of the segment on a gimbal: samples far enough apart for the inverse kinematics to end, targets
//! about the reach, and forces on either side of the thresholds.

use hpu_cosim::SplitMix64;
use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

use super::{corners, draw, edge, generic, reset};
use crate::Stimulus;
use crate::postures::Targets;

/// Words of a loop that stay for one or more sample periods.
pub(super) struct Samples {
    targets: Targets,
    /// The least sample period in which all drives are shown.
    period: u64,
    left: u64,
}

impl Samples {
    /// Returns samples for a loop; `None` for another block.
    pub(super) fn of(block: &dyn AnyBlock) -> Option<Self> {
        let inputs = block.inputs();
        if !inputs.iter().any(|signal| signal.name == "crank_derivative") {
            return None;
        }
        let of = |name: &str| generic(block, name).expect("a generic of the loop");
        let [offset, rod, crank] = ["OFFSET", "ROD_LENGTH", "CRANK_LENGTH"].map(of);
        let latency = 3 * of("ROTATIONS") + of("LENGTH_WIDTH") + 13;
        let targets = Targets::new(latency, [offset + rod - crank, offset + rod + crank]);
        let least = (latency + 3).max(generic(block, "MEMORY").unwrap_or(0) + 2);
        Some(Self { targets, period: least.unsigned_abs(), left: 0 })
    }

    /// Replaces the words from time to time, on the average twice in three sample periods. One period in 16 is short.
    pub(super) fn step(&mut self, random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
        if self.left > 0 {
            self.left -= 1;
            return;
        }
        self.left = self.period / 2 + random.below(2 * self.period);
        for (word, signal) in words.iter_mut().zip(inputs) {
            if random.one_in(if signal.name.starts_with("count") { 1 } else { 3 }) {
                *word = draw(random, signal, *word);
            }
        }
        let at = |name: &str| inputs.iter().position(|signal| signal.name == name).expect("an input of the loop");
        if !random.one_in(4) {
            let x = at("x");
            self.targets.aim(random, &inputs[x..x + 3], &mut words[x..x + 3]);
        }
        let period = if random.one_in(16) { random.below(self.period) } else { self.period + random.below(4) };
        words[at("period")] = inputs[at("period")].format.from_bits(period);
    }
}

/// Returns corners of all words, each for two sample periods, from a reset and between random words of a fixed seed.
pub(super) fn directed(inputs: &[Signal], mut samples: Samples) -> Vec<Stimulus> {
    let random = &mut SplitMix64::new(0);
    let mut rows = Vec::new();
    for turn in 0..7 {
        let mut words: Vec<_> =
            inputs.iter().map(|signal| corners(signal.format)).map(|all| all[turn % all.len()]).collect();
        let at = |name: &str| inputs.iter().position(|signal| signal.name == name).expect("an input of the loop");
        let period = at("period");
        words[period] = inputs[period].format.from_bits(samples.period);
        rows.push(reset(words.clone()));
        rows.extend(vec![edge(words.clone()); 2 * samples.period as usize]);
        let random_rows = (0..4 * samples.period).map(|_| {
            samples.step(random, inputs, &mut words);
            edge(words.clone())
        });
        rows.extend(random_rows.collect::<Vec<_>>());
    }
    rows
}
