//! The fractional derivative against exact sums, closed forms and its bounds.

use std::f64::consts::PI;

use hpu_datapath::fractional_difference::{In, memory_bound};
use hpu_datapath::{Block, FractionalConfig, FractionalDifference};
use hpu_signal::Format;

const ORDERS: [[u32; 2]; 9] =
    [[1, 2], [3, 2], [1, 1], [7, 5], [1, 1000], [999, 1000], [1001, 1000], [1999, 1000], [1, 3]];

/// Returns pseudo-random words, always the same ones.
fn words(format: Format, count: usize) -> Vec<i64> {
    let mut state = 88_172_645_463_325_252u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        format.from_bits(state >> 11)
    };
    (0..count).map(|_| next()).collect()
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}

fn made(config: FractionalConfig) -> FractionalDifference {
    FractionalDifference::new(config).expect("a configuration")
}

/// Samples `u` and returns the derivative, which must come at the edge of the data sheet and no other.
fn sampled(block: &mut FractionalDifference, u: i64, gain: i64, memory: u32) -> i64 {
    let before = block.tick(In { u, gain, sample: 1 }).y;
    for edge in 0..memory {
        // Another sample is passed over, whatever its words are.
        assert_eq!(block.tick(In { u: !u, gain, sample: i64::from(edge % 3 == 0) }).y, before, "edge {edge}");
    }
    block.tick(In { u: !u, gain, sample: 1 }).y
}

/// Returns the exact weight as a fraction, for orders and places whose fraction fits.
fn exact(k: u32, [num, den]: [u32; 2]) -> f64 {
    let order = f64::from(num) / f64::from(den);
    // (-1)^k times the binomial coefficient, whose factors are multiplied from the last one on.
    (1..=k).rev().map(|j| (f64::from(j) - 1.0 - order) / f64::from(j)).product()
}

#[test]
fn a_weight_is_within_five_eighths_of_its_lsb() {
    for order in ORDERS {
        for (coef_frac, memory) in [(6, 16), (16, 254), (30, 254)] {
            let block = made(FractionalConfig { coef_frac, order, memory, ..FractionalConfig::default() });
            for (k, &word) in (0..).zip(block.weights()) {
                let exact = exact(k, order) * 2f64.powi(coef_frac as i32);
                // The product of 254 factors is wrong by less than 2^-43 of itself, below 2^-11 LSBs.
                assert!((word as f64 - exact).abs() <= 0.625 + 2f64.powi(-11), "{order:?} {coef_frac} {k}: {word}");
            }
        }
    }
}

#[test]
fn every_derivative_is_the_exact_sum_rounded_once() {
    let normal = FractionalConfig::default();
    let narrow = FractionalConfig {
        input: format(true, 2, 1),
        output: format(true, 2, 3),
        gain: format(false, 2, 1),
        coef_frac: 4,
        order: [3, 2],
        memory: 3,
    };
    let whole = FractionalConfig { output: format(true, 12, 6), ..narrow };
    let long = FractionalConfig { order: [7, 5], memory: 64, ..normal };
    let wide = FractionalConfig { input: format(true, 6, 20), coef_frac: 30, memory: 5, ..normal };
    for config in [normal, narrow, whole, long, wide] {
        let mut block = made(config);
        let inputs = words(config.input, 3000);
        let gains = words(config.gain, 3000);
        let drop = config.input.frac() + config.coef_frac as i32 + config.gain.frac() - config.output.frac();
        let whole = 2i128.pow(drop as u32);
        for n in 0..inputs.len() {
            let weights = block.weights().to_vec();
            let past = weights.iter().zip(inputs[..=n].iter().rev());
            let sum: i128 = past.map(|(&weight, &u)| i128::from(weight) * i128::from(u)).sum();
            let rounded = (2 * sum * i128::from(gains[n]) + whole).div_euclid(2 * whole);
            let expected = rounded.clamp(config.output.min(), config.output.max());
            let y = sampled(&mut block, inputs[n], gains[n], config.memory);
            assert_eq!(i128::from(y), expected, "{config:?}: sample {n}");
        }
    }
}

#[test]
fn the_first_order_is_the_backward_difference() {
    for memory in [2, 3, 17, 254] {
        let one = FractionalConfig { order: [1, 1], memory, ..FractionalConfig::default() };
        let mut block = made(one);
        let weights = block.weights().to_vec();
        assert_eq!(weights[..2], [1 << 16, -(1 << 16)]);
        assert!(weights[2..].iter().all(|&weight| weight == 0));
        let mut before = 0;
        for u in words(one.input, 200) {
            // The output has the fraction bits of the input, and the gain is 1.
            assert_eq!(sampled(&mut block, u, 1 << 8, memory), u - before);
            before = u;
        }
    }
}

#[test]
fn every_pair_of_words_has_its_backward_difference() {
    let narrow = FractionalConfig {
        input: format(true, 5, 0),
        output: format(true, 6, 0),
        gain: format(false, 2, 0),
        coef_frac: 3,
        order: [1, 1],
        memory: 2,
    };
    let mut block = made(narrow);
    for u in -32..32 {
        for v in -32..32 {
            sampled(&mut block, u, 1, 2);
            assert_eq!(sampled(&mut block, v, 1, 2), v - u);
        }
    }
}

#[test]
fn orders_near_whole_ones_are_near_their_differences() {
    // At the orders 1/1000 and 1999/1000, the weights are within 1/1000 of (1, 0, 0) and (1, -2, 1).
    for (order, limit) in [([1, 1000], [1.0, 0.0, 0.0, 0.0]), ([1999, 1000], [1.0, -2.0, 1.0, 0.0])] {
        let block = made(FractionalConfig { order, ..FractionalConfig::default() });
        for (&weight, limit) in block.weights().iter().zip(limit) {
            let weight = weight as f64 / 65_536.0;
            assert!((weight - limit).abs() <= 0.0015, "{order:?}: {weight} near {limit}");
        }
    }
}

#[test]
fn the_derivative_of_time_is_its_closed_form_up_to_the_first_order_of_the_step() {
    // In steps of 1, the derivative of order 1/2 of t is sqrt(t) / gamma(3/2), and that of order 3/2 is
    // 1 / (sqrt(t) gamma(1/2)). The sum over all samples from 0 on is gamma(n+1-a) / (gamma(2-a) gamma(n)); by
    // Gautschi's inequality its quotient by the closed form is between these bounds, which are of the first order in
    // 1/n.
    let root = PI.sqrt();
    for memory in [16u32, 64] {
        for (order, coef_frac) in [([1, 2], 24), ([3, 2], 24)] {
            let (input, output) = (format(true, 7, 4), format(true, 7, 20));
            let config = FractionalConfig { input, output, coef_frac, order, memory, ..FractionalConfig::default() };
            let mut block = made(config);
            let n = memory - 1;
            let mut y = 0;
            for t in 0..=n {
                y = sampled(&mut block, i64::from(t) << 4, 1 << 8, memory);
            }
            let n = f64::from(n);
            let (closed, least, most) = match order {
                [1, 2] => (n.sqrt() * 2.0 / root, (n / (n + 1.0)).sqrt(), 1.0),
                _ => (1.0 / (n.sqrt() * root), (n / (n + 1.0)).sqrt() / (1.0 - 0.5 / n), 1.0 / (1.0 - 0.5 / n)),
            };
            // Every weight by 5/8 of its LSB, times at most n; and half an LSB of the output.
            let words = f64::from(memory) * n * 0.625 * 2f64.powi(-24) + 2f64.powi(-21);
            let y = y as f64 * 2f64.powi(-20);
            let bounds = closed * least - words..=closed * most + words;
            assert!(bounds.contains(&y), "{order:?} with {memory}: {y} in {bounds:?}");
        }
    }
}

#[test]
fn the_bound_of_the_memory_is_the_sum_of_what_it_leaves_out() {
    for order @ [num, den] in ORDERS {
        let of = |memory| memory_bound(f64::from(num) / f64::from(den), memory);
        for memory in [2, 3, 16, 64] {
            let more: f64 = (memory..1000).map(|k| exact(k, order).abs()).sum();
            assert!((more + of(1000) - of(memory)).abs() < 1e-12, "{order:?} {memory}");
        }
        assert!(of(100_000) < of(100) && of(1000) >= 0.0 || num == den, "{order:?}");
    }
    assert_eq!(memory_bound(1.0, 2), 0.0);
    // The sum of the weights of order 1/2 is the central binomial coefficient over 4^(N-1).
    assert!((memory_bound(0.5, 4) - 20.0 / 64.0).abs() < 1e-15);
}

#[test]
fn a_short_memory_differs_from_a_long_one_by_no_more_than_its_bound() {
    for order @ [num, den] in ORDERS {
        let short = FractionalConfig { order, memory: 8, ..FractionalConfig::default() };
        let long = FractionalConfig { memory: 250, ..short };
        let (mut less, mut more) = (made(short), made(long));
        // The worst function: at every weight that the short memory leaves out, the input has one sign.
        let most = 100i64 << 8;
        let inputs: Vec<i64> = (0..250).map(|n| if n < 240 { -most } else { most }).collect();
        let bound = 100.0 * memory_bound(f64::from(num) / f64::from(den), 8);
        let allowed = bound + 100.0 * (8.0 + 250.0) * 0.625 / 65_536.0 + 1.0 / 256.0;
        let mut widest = 0.0f64;
        for u in inputs {
            let pair = [(&mut less, 8), (&mut more, 250)].map(|(block, memory)| sampled(block, u, 1 << 8, memory));
            widest = widest.max((pair[0] - pair[1]).abs() as f64 / 256.0);
        }
        assert!(widest <= allowed, "{order:?}: {widest} of {allowed}");
        // The bound is not idle: 250 samples of one sign come near it.
        let reached = 100.0 * memory_bound(f64::from(num) / f64::from(den), 250);
        assert!(widest >= bound - reached - (allowed - bound), "{order:?}: {widest} of {bound}");
    }
}

#[test]
fn orders_outside_zero_and_two_are_refused_by_name() {
    for [num, den] in [[0, 1], [2, 1], [5, 2], [2000, 1000]] {
        let error = FractionalDifference::new(FractionalConfig { order: [num, den], ..FractionalConfig::default() });
        let message = error.expect_err("a bad order").to_string();
        assert!(message.contains(&format!("{num}/{den}")), "{message}");
        assert!(message.contains("orders above 0 and below 2"), "{message}");
    }
    let normal = FractionalConfig::default();
    for config in [
        FractionalConfig { order: [1, 0], ..normal },
        FractionalConfig { order: [1, 1001], ..normal },
        FractionalConfig { memory: 1, ..normal },
        FractionalConfig { memory: 255, ..normal },
        FractionalConfig { input: format(true, 20, 20), ..normal },
        FractionalConfig { output: format(true, 2, 33), ..normal },
        FractionalConfig { input: format(false, 8, 8), ..normal },
    ] {
        assert!(FractionalDifference::new(config).is_err(), "{config:?}");
    }
}
