//! The input shaper compared with its equation on whole histories, and its response to sines compared with the formula
//! of the analog shaper.

use std::f64::consts::{PI, SQRT_2, TAU};

use hpu_datapath::{Block, InputShaper, InputShaperConfig, Shaping, input_shaper};
use hpu_signal::Rounding;
use proptest::prelude::*;

use crate::cases::cases;
use crate::oracle::rounded;

fn shaper(torque_width: u32, period_width: u32, shaping: Shaping) -> InputShaper {
    rounding(torque_width, period_width, shaping, Rounding::Truncate)
}

fn rounding(torque_width: u32, period_width: u32, shaping: Shaping, rounding: Rounding) -> InputShaper {
    InputShaper::new(InputShaperConfig { torque_width, period_width, shaping: Some(shaping), rounding }).unwrap()
}

/// Returns the shaped torque after a history of torques and periods, one pair for each edge.
fn expected(torque_width: u32, shaping: Shaping, history: &[(i64, i64)], rounding: Rounding) -> i64 {
    let [b0, b1, b2, a1, a2] = [shaping.b[0], shaping.b[1], shaping.b[2], shaping.a[0], shaping.a[1]].map(i128::from);
    let most = (1i128 << (torque_width + 2 + 16)) - 1;
    // The two latest samples and outputs of the filter, in units of 2^-16.
    let ([mut u, mut before_u], [mut h, mut before_h]) = ([0, 0], [0, 0]);
    let mut edge = shaping.phase as usize;
    while let Some(&(torque, period)) = history.get(edge) {
        let fresh = i128::from(torque) << 16;
        let exact = b0 * fresh + b1 * u + b2 * before_u - a1 * h - a2 * before_h;
        let nearest = (exact + (1 << 29)).div_euclid(1 << 30).clamp(-most - 1, most);
        [u, before_u] = [fresh, u];
        [h, before_h] = [nearest, h];
        edge += period.max(1) as usize;
    }
    rounded(u - h.max(0), 1 << 16, rounding).max(0) as i64
}

fn follows(torque_width: u32, shaping: Shaping, history: &[(i64, i64)], block: &mut InputShaper) {
    follows_rounding(torque_width, (shaping, Rounding::Truncate), history, block);
}

fn follows_rounding(
    torque_width: u32,
    (shaping, rounding): (Shaping, Rounding),
    history: &[(i64, i64)],
    block: &mut InputShaper,
) {
    assert_eq!(block.reset().shaped, 0);
    for edge in 0..history.len() {
        let (torque, period) = history[edge];
        let shaped = block.tick(input_shaper::In { torque, period }).shaped;
        let history = &history[..=edge];
        let expected = expected(torque_width, shaping, history, rounding);
        assert_eq!(shaped, expected, "{shaping:?} {rounding:?} {history:?}");
    }
}

/// Returns a differentiator, a filter that rings and overflows, and the high-pass filter of the experiments.
fn shapings() -> [Shaping; 3] {
    let one = 1 << 30;
    let (b, a) = words(butterworth());
    [
        Shaping { phase: 0, b: [one, -one, 0], a: [0, 0] },
        Shaping { phase: 0, b: [one, -one, one / 3], a: [-one / 2, one + one / 8] },
        Shaping { phase: 0, b, a },
    ]
}

#[test]
fn every_short_history_is_shaped_as_the_equation_says() {
    for shaping in shapings() {
        let mut block = shaper(2, 2, shaping);
        for words in 0..1i64 << 16 {
            let history = [0, 4, 8, 12].map(|place| ((words >> place & 15) - 8, 1));
            follows(2, shaping, &history, &mut block);
        }
    }
}

#[test]
fn every_short_history_is_rounded_in_every_way() {
    // Quarters and sixteenths of a torque: ties, and values on either side of them.
    let shaping = Shaping { phase: 0, b: [1 << 28, -1 << 28, 3 << 26], a: [0, 0] };
    for one in Rounding::ALL {
        let mut block = rounding(2, 2, shaping, one);
        for words in 0..1i64 << 12 {
            let history = [0, 4, 8].map(|place| ((words >> place & 15) - 8, 1));
            follows_rounding(2, (shaping, one), &history, &mut block);
        }
    }
}

#[test]
fn every_torque_of_a_disabled_shaper_passes_at_once() {
    let mut block = InputShaper::default();
    for torque in -8192..8192 {
        assert_eq!(block.tick(input_shaper::In { torque, period: 3 }).shaped, torque);
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn a_history_is_shaped_as_the_equation_says(
        history in prop::collection::vec((-8192i64..8192, 0i64..5), 1..60),
        stay in 1usize..9,
        phase in 0u32..40,
        which in 0usize..3,
    ) {
        let history: Vec<_> = history.into_iter().flat_map(|edge| vec![edge; stay]).collect();
        let shaping = Shaping { phase, ..shapings()[which] };
        follows(12, shaping, &history, &mut shaper(12, 3, shaping));
    }
}

const SAMPLE_HZ: f64 = 1000.0;
const CORNER_HZ: f64 = 2.5;

/// Returns numerator and denominator of the bilinear transform of `s^2 / (s^2 + sqrt(2) s + 1)`, with the corner kept
/// in its place.
fn butterworth() -> ([f64; 3], [f64; 3]) {
    let k = (PI * CORNER_HZ / SAMPLE_HZ).tan();
    let norm = 1.0 / (1.0 + SQRT_2 * k + k * k);
    ([norm, -2.0 * norm, norm], [1.0, 2.0 * (k * k - 1.0) * norm, (1.0 - SQRT_2 * k + k * k) * norm])
}

/// Returns the nearest words of 30 fraction bits.
fn words((b, a): ([f64; 3], [f64; 3])) -> ([i32; 3], [i32; 2]) {
    let word = |value: f64| (value * f64::from(1 << 30)).round() as i32;
    (b.map(word), [word(a[1]), word(a[2])])
}

/// Returns the size of `c0 + c1 z^-1 + c2 z^-2` on the unit circle.
fn size(c: [f64; 3], w: f64) -> f64 {
    (c[0] + c[1] * w.cos() + c[2] * (2.0 * w).cos()).hypot(c[1] * w.sin() + c[2] * (2.0 * w).sin())
}

/// Returns the sum of the sizes of the impulse response of `1/A`, which tells how far rounding errors of size 1 can
/// drive the output. With a pole of radius 0.989 the rest beyond 100 000 samples is below any float.
fn noise_gain(a: [f64; 3]) -> f64 {
    let (mut sum, mut latest, mut before) = (0.0, 1.0, 0.0);
    for _ in 0..100_000 {
        sum += f64::abs(latest);
        (latest, before) = (-a[1] * latest - a[2] * before, latest);
    }
    sum
}

/// Returns `|1 - H|` of the analog shaper at a frequency in units of its corner: a first-order roll-off behind a peak.
fn shaped(x: f64) -> f64 {
    (1.0 + 2.0 * x * x).sqrt() / ((1.0 - x * x).powi(2) + 2.0 * x * x).sqrt()
}

#[test]
fn the_coefficients_are_those_of_the_published_shaper_at_1_khz() {
    let (b, a) = butterworth();
    let published = [0.988954248067, -1.97790849613, 0.988954248067, -1.97778648378, 0.978030508492];
    for (value, digits) in [b[0], b[1], b[2], a[1], a[2]].into_iter().zip(published) {
        assert!((value - digits).abs() < 5e-12, "{value}");
    }
}

#[test]
fn the_response_to_sines_is_that_of_the_analog_shaper() {
    const TORQUE_WIDTH: u32 = 20;
    let (bias, amplitude) = (1_000_000, 400_000.0);
    let (ideal_b, ideal_a) = butterworth();
    let (b, a) = words((ideal_b, ideal_a));
    let value = |word: i32| f64::from(word) / f64::from(1 << 30);
    let a_words = [1.0, value(a[0]), value(a[1])];
    for (frequency_hz, samples_a_period, published) in
        [(1.0, 1000u32, 1.134_482_9), (2.5, 400, 1.224_744_9), (10.0, 100, 0.358_335_97), (100.0, 10, 0.035_360_856)]
    {
        let w = TAU * frequency_hz / SAMPLE_HZ;
        let mut blocks = [1, -1].map(|sign| (sign, shaper(TORQUE_WIDTH, 2, Shaping { phase: 0, b, a })));
        let (mut input, mut output) = ((0.0, 0.0), (0.0, 0.0));
        // The poles' radius is sqrt(A2) = 0.989, so after 8000 samples the start has decayed to e^-88 of itself.
        let settled = 8000;
        for k in 0..settled + samples_a_period {
            let sine = (amplitude * (w * f64::from(k % samples_a_period)).sin()).round() as i64;
            // The rectifier behind the filter passes the positive half waves of h, and for an opposite sine it passes
            // the others: max(0, h) - max(0, -h) = h. With this bias the rectifier at the output passes everything.
            let [up, down] = blocks.each_mut().map(|(sign, block)| {
                let torque = bias + *sign * sine;
                let shaped = block.tick(input_shaper::In { torque, period: 1 }).shaped;
                assert!(shaped > 0 && !block.latest().overflowed);
                shaped
            });
            if k >= settled {
                let add = |sum: &mut (f64, f64), value: f64| {
                    *sum = (sum.0 + value * (w * f64::from(k)).cos(), sum.1 + value * (w * f64::from(k)).sin());
                };
                add(&mut input, sine as f64);
                add(&mut output, (up - down - sine) as f64);
            }
        }
        let line = |sum: (f64, f64)| 2.0 / f64::from(samples_a_period) * sum.0.hypot(sum.1);
        let measured = line(output) / line(input);

        // Per sample, up - down differs from 2 sine - h by less than 1 for the floors of the two outputs, and by the
        // two filters' roundings, half of 2^-16 each, amplified by 1/A. An error of size e makes at most 2 e of a line.
        let noise = 1.0 + 2.0 * noise_gain(a_words) / f64::from(1 << 17);
        let words_bound =
            0.5 / f64::from(1 << 30) * (3.0 + 2.0 * size(ideal_b, w) / size(ideal_a, w)) / size(a_words, w);
        let bound = 2.0 * noise / line(input) + words_bound + 1e-12;
        // The bilinear transform maps the analog response to w = 2 atan(tan(w_c/2) x).
        let x = (w / 2.0).tan() / (PI * CORNER_HZ / SAMPLE_HZ).tan();
        assert!((measured - shaped(x)).abs() <= bound, "{frequency_hz} Hz: {measured}, bound {bound}");
        assert!(bound < 1e-4, "the bound says something: {bound}");
        // The formula agrees with the published table to its last digit. The formula's slope on logarithmic scales,
        // 2 x^2 / (1 + 2 x^2) less 2 x^4 / (1 + x^4), is between -2 and 1. So a shift in frequency by the transform is
        // at most twice as large in size.
        let table = shaped(frequency_hz / CORNER_HZ);
        assert!((table / published - 1.0).abs() < 5e-8, "{table}");
        let moved = (x * CORNER_HZ / frequency_hz).ln().abs();
        assert!((shaped(x) / table).ln().abs() <= 2.0 * moved + 1e-12, "{frequency_hz} Hz");
    }
}

#[test]
fn a_shaper_refuses_what_its_filter_cannot_take() {
    let shaping = Shaping { phase: 0, b: [0; 3], a: [0; 2] };
    let config = InputShaperConfig::default();
    for (torque_width, phase, accepted) in [(21, 4095, true), (22, 0, false), (12, 4096, false)] {
        let shaping = Some(Shaping { phase, ..shaping });
        assert_eq!(InputShaper::new(InputShaperConfig { torque_width, shaping, ..config }).is_ok(), accepted);
    }
    assert!(InputShaper::new(InputShaperConfig { torque_width: 30, ..config }).is_ok());
}
