//! Random words that are meaningful to an arm's blocks: the sines of a posture, a tip near its walls, stiffness over
//! all decades, periods in which a computation can end, positions that a gimbal reaches.

use hpu_cosim::SplitMix64;
use hpu_signal::Signal;

/// Length of both links of the postures, in metres: that of a Premium 1.0.
const LINK_M: f64 = 0.14;

/// Returns whether a block with these inputs computes with postures.
pub(crate) fn is_posed(inputs: &[Signal]) -> bool {
    inputs.iter().any(|signal| matches!(signal.name, "sine1" | "x_low"))
}

/// Replaces some of the random words by meaningful words, three times in four.
pub(crate) fn pose(random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
    let place = |name: &str| inputs.iter().position(|signal| signal.name == name);
    let put = |words: &mut [i64], name: &str, value: f64| {
        if let Some(index) = place(name) {
            let format = inputs[index].format;
            words[index] = format.wrap((value / format.lsb()).round() as i128);
        }
    };
    if place("sine1").is_some() && !random.one_in(4) {
        let angles: [f64; 3] = std::array::from_fn(|_| 2.0 * unit(random) - 1.0);
        let [(s1, c1), (s2, c2), (s3, c3)] = angles.map(f64::sin_cos);
        for (name, value) in
            [("sine1", s1), ("cosine1", c1), ("sine2", s2), ("cosine2", c2), ("sine3", s3), ("cosine3", c3)]
        {
            put(words, name, value);
        }
        let radius_m = LINK_M * (c2 + s3);
        for (name, value) in [("x", s1 * radius_m), ("z", c1 * radius_m - LINK_M)] {
            put(words, name, value);
        }
        for name in ["force_x", "force_y", "force_z"] {
            put(words, name, 17.0 * unit(random) - 8.5);
        }
    }
    if place("x_low").is_some() && !random.one_in(4) {
        for (name, sign) in
            [("x_low", -1.0), ("x_high", 1.0), ("y_low", -1.0), ("y_high", 1.0), ("z_low", -1.0), ("z_high", 1.0)]
        {
            put(words, name, sign * 0.02 * unit(random));
        }
        put(words, "stiffness", f64::exp2(16.0 * unit(random)) - 1.0);
        if place("sine1").is_none() {
            for name in ["x", "y", "z"] {
                put(words, name, 0.06 * unit(random) - 0.03);
            }
        }
    }
}

/// Positions about the reach of a gimbal, one for each computation of its inverse kinematics. Most computations end.
pub(crate) struct Targets {
    latency: i64,
    passed: i64,
    /// The least and the greatest radius, in words.
    reach: [f64; 2],
}

impl Targets {
    /// Returns targets about this reach, for computations of that many edges.
    pub(crate) fn new(latency: i64, [least, most]: [i64; 2]) -> Self {
        Self { latency, passed: 0, reach: [least as f64, most as f64] }
    }

    /// Starts a computation when the last has ended, seldom before. Three positions in four are within 60 degrees and
    /// close to the reach; some of these are on its ends or in a plane of the axes.
    pub(crate) fn step(&mut self, random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
        let starts = if self.passed > self.latency { random.one_in(4) } else { random.one_in(2000) };
        (words[0], self.passed) = (i64::from(starts), if starts { 0 } else { self.passed + 1 });
        if starts && !random.one_in(4) {
            self.aim(random, &inputs[1..], &mut words[1..]);
        }
    }

    /// Puts the first three words at a position within 60 degrees and close to the reach.
    pub(crate) fn aim(&self, random: &mut SplitMix64, inputs: &[Signal], words: &mut [i64]) {
        let mut angle =
            || if random.one_in(8) { 0.0 } else { (2.0 * unit(random) - 1.0) * std::f64::consts::FRAC_PI_3 };
        let [(pitch_sine, pitch_cosine), (roll_sine, roll_cosine)] = [angle(), angle()].map(f64::sin_cos);
        let [least, most] = self.reach;
        let share = if random.one_in(8) { random.below(2) as f64 } else { 1.1 * unit(random) - 0.05 };
        let radius = least + share * (most - least);
        let tip = [-pitch_cosine * roll_sine, pitch_cosine * roll_cosine, pitch_sine];
        for ((word, signal), along) in words.iter_mut().zip(inputs).zip(tip) {
            *word = signal.format.wrap((radius * along).round() as i128);
        }
    }
}

/// Returns a random number from 0 to 1.
fn unit(random: &mut SplitMix64) -> f64 {
    random.below(1 << 53) as f64 / (1u64 << 53) as f64
}
