//! Random words that are meaningful to an arm's blocks: the sines of a posture, a tip near its walls, stiffness over
//! all decades, periods in which a computation can end.

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
        let [(s1, c1), (s2, c2), (s3, c3)] = angles.map(libm::sincos);
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
        put(words, "stiffness", libm::exp2(16.0 * unit(random)) - 1.0);
        if place("sine1").is_none() {
            for name in ["x", "y", "z"] {
                put(words, name, 0.06 * unit(random) - 0.03);
            }
        }
    }
}

/// Returns a random number from 0 to 1.
pub(crate) fn unit(random: &mut SplitMix64) -> f64 {
    random.below(1 << 53) as f64 / (1u64 << 53) as f64
}
