//! Rows for the loops of the segment on a gimbal: samples far enough apart for the inverse kinematics to end, targets
//! about the reach, and forces on either side of the thresholds.

use hpu_cosim::SplitMix64;
use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

use super::{corners, draw, edge, generic, reset};
use crate::Stimulus;
use crate::vectors::stimuli::postures::unit;

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

/// Positions about the reach of a gimbal, one for each computation of its inverse kinematics. Most computations end.
pub(super) struct Targets {
    latency: i64,
    passed: i64,
    /// The least and the greatest radius, in words.
    reach: [f64; 2],
}

impl Targets {
    /// Returns targets of an inverse kinematics whose computations take `latency` edges; `None` for another block.
    pub(super) fn of(block: &dyn AnyBlock, latency: fn(&dyn AnyBlock) -> i64) -> Option<Self> {
        let lengths = ["OFFSET", "ROD_LENGTH", "CRANK_LENGTH"].map(|name| generic(block, name));
        let [Some(offset), Some(rod), Some(crank)] = lengths else { return None };
        let reach = [offset + rod - crank, offset + rod + crank];
        (block.inputs()[0].name == "start").then(|| Self::new(latency(block), reach))
    }

    /// Returns targets about this reach, in words, for computations of that many edges.
    fn new(latency: i64, [least, most]: [i64; 2]) -> Self {
        Self { latency, passed: 0, reach: [least as f64, most as f64] }
    }

    /// Starts a computation when the last has ended, seldom before. Three positions in four are within 60 degrees and
    /// close to the reach; some of these are on its ends or in a plane of the axes.
    pub(super) fn step(&mut self, random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
        let starts = if self.passed > self.latency { random.one_in(4) } else { random.one_in(2000) };
        (words[0], self.passed) = (i64::from(starts), if starts { 0 } else { self.passed + 1 });
        if starts && !random.one_in(4) {
            self.aim(random, &inputs[1..], &mut words[1..]);
        }
    }

    /// Puts the first three words at a position within 60 degrees and close to the reach.
    fn aim(&self, random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
        let mut angle =
            || if random.one_in(8) { 0.0 } else { (2.0 * unit(random) - 1.0) * std::f64::consts::FRAC_PI_3 };
        let [(pitch_sine, pitch_cosine), (roll_sine, roll_cosine)] = [angle(), angle()].map(libm::sincos);
        let [least, most] = self.reach;
        let share = if random.one_in(8) { random.below(2) as f64 } else { 1.1 * unit(random) - 0.05 };
        let radius = least + share * (most - least);
        let tip = [-pitch_cosine * roll_sine, pitch_cosine * roll_cosine, pitch_sine];
        for ((word, signal), along) in words.iter_mut().zip(inputs).zip(tip) {
            *word = signal.format.wrap((radius * along).round() as i128);
        }
    }
}
