//! The second-order section as a filter: a Butterworth high-pass of 2.5 Hz at 10 kHz, compared with its formula.

use std::f64::consts::{PI, SQRT_2, TAU};

use hpu_datapath::{Biquad, BiquadConfig, Block, biquad};
use hpu_signal::Format;

const SAMPLE_HZ: f64 = 10_000.0;
const CORNER_HZ: f64 = 2.5;

/// A complex number with the operations that a transfer function needs.
#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn over(self, other: Self) -> Self {
        let size = other.0 * other.0 + other.1 * other.1;
        Self((self.0 * other.0 + self.1 * other.1) / size, (self.1 * other.0 - self.0 * other.1) / size)
    }

    fn minus(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }

    fn size(self) -> f64 {
        self.0.hypot(self.1)
    }
}

/// Returns `c0 + c1 z^-1 + c2 z^-2` on the unit circle.
fn polynomial(c: [f64; 3], w: f64) -> Complex {
    Complex(c[0] + c[1] * w.cos() + c[2] * (2.0 * w).cos(), -c[1] * w.sin() - c[2] * (2.0 * w).sin())
}

fn format(int: i32, frac: i32) -> Format {
    Format::new(true, int, frac).unwrap()
}

/// Returns numerator and denominator of the bilinear transform of `s^2 / (s^2 + sqrt(2) s + 1)`, with the corner kept
/// in its place.
fn butterworth() -> ([f64; 3], [f64; 3]) {
    let k = (PI * CORNER_HZ / SAMPLE_HZ).tan();
    let norm = 1.0 / (1.0 + SQRT_2 * k + k * k);
    ([norm, -2.0 * norm, norm], [1.0, 2.0 * (k * k - 1.0) * norm, (1.0 - SQRT_2 * k + k * k) * norm])
}

fn high_pass(coefficient: Format) -> BiquadConfig {
    let (b, a) = butterworth();
    let word = |value: f64| (value / coefficient.lsb()).round() as i32;
    let (input, output) = (format(12, 4), format(13, 26));
    BiquadConfig { input, output, coefficient, b: b.map(word), a: [word(a[1]), word(a[2])], ..BiquadConfig::default() }
}

/// Returns the numerator and the denominator that the words stand for.
fn words(config: &BiquadConfig) -> ([f64; 3], [f64; 3]) {
    let value = |word: i32| f64::from(word) * config.coefficient.lsb();
    (config.b.map(value), [1.0, value(config.a[0]), value(config.a[1])])
}

/// Returns the sum of the sizes of the impulse response of `1/A`, which tells how far rounding errors of size 1 can
/// drive the output. With a pole of radius 0.9989 the rest beyond a million samples is below any float.
fn noise_gain(a: [f64; 3]) -> f64 {
    let (mut sum, mut latest, mut before) = (0.0, 1.0, 0.0);
    for _ in 0..1_000_000 {
        sum += f64::abs(latest);
        (latest, before) = (-a[1] * latest - a[2] * before, latest);
    }
    sum
}

/// Returns the cosine and sine parts of samples over whole periods, as `(2/N) sum f(k) e^(-jwk)`.
fn fundamental(samples: &[f64], w: f64) -> Complex {
    let scale = 2.0 / samples.len() as f64;
    (0..).zip(samples).fold(Complex(0.0, 0.0), |sum, (k, sample)| {
        let phase = w * f64::from(k);
        Complex(sum.0 + scale * sample * phase.cos(), sum.1 - scale * sample * phase.sin())
    })
}

#[test]
fn the_response_to_sines_is_that_of_the_formula() {
    let config = high_pass(format(1, 30));
    let (b, a) = words(&config);
    let (ideal_b, ideal_a) = butterworth();
    let worst_y = config.output.lsb() / 2.0 * noise_gain(a);
    for (frequency_hz, samples_a_period) in [(1.0, 10_000u32), (2.5, 4000), (5.0, 2000), (40.0, 250), (2000.0, 5)] {
        let w = TAU * frequency_hz / SAMPLE_HZ;
        let amplitude = 4000.0;
        let mut block = Biquad::new(config).unwrap();
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        // The poles' radius is sqrt(A2) = 0.9989, so after 40 000 samples the start has decayed to e^-44 of itself.
        let settled = 40_000;
        for k in 0..settled + samples_a_period {
            let value = amplitude * (w * f64::from(k % samples_a_period)).sin();
            let x = (value / config.input.lsb()).round() as i64;
            let y = block.tick(biquad::In { x, period: 1 }).y;
            assert!(!block.latest().overflowed);
            if k >= settled {
                xs.push(config.input.to_f64(x));
                ys.push(config.output.to_f64(y));
            }
        }
        // The filter passes this line of the periodic words' spectrum exactly by H. The output y differs from that by
        // at most `worst_y`, and the share of this difference in the line is at most the mean of 2 |cos| times it:
        // 4/pi, a little more for few samples, and never more than 2. The rest allows for floats: 1e-12 of the
        // amplitude.
        let measured = fundamental(&ys, w).over(fundamental(&xs, w));
        let formula = polynomial(b, w).over(polynomial(a, w));
        let bound = 2.0 * worst_y / fundamental(&xs, w).size() + 1e-12;
        assert!(measured.minus(formula).size() <= bound, "{frequency_hz} Hz: bound {bound}");

        // H' - H = (dB - H dA)/A', where each coefficient is off by half a unit at most: three in B, two in A.
        let ideal = polynomial(ideal_b, w).over(polynomial(ideal_a, w));
        let half = config.coefficient.lsb() / 2.0;
        let words_bound = half * (3.0 + 2.0 * ideal.size()) / polynomial(a, w).size();
        assert!(formula.minus(ideal).size() <= words_bound, "{frequency_hz} Hz: bound {words_bound}");
        assert!(words_bound < 2e-3 && bound < 2e-4 / ideal.size().min(1.0), "the bounds say something");

        // Butterworth's own formula: |H|^2 = 1 / (1 + (tan(w_c/2) / tan(w/2))^4).
        let ratio = (PI * CORNER_HZ / SAMPLE_HZ).tan() / (w / 2.0).tan();
        let butterworth = (1.0 + ratio.powi(4)).sqrt().recip();
        assert!((measured.size() - butterworth).abs() <= bound + words_bound, "{frequency_hz} Hz");
    }
}

#[test]
fn a_constant_is_taken_out_but_for_what_the_loop_makes_of_rounding() {
    // With B0 + B1 + B2 = 0 to the word, the rest is less than half an LSB times the noise gain.
    let config = high_pass(format(1, 30));
    assert_eq!(config.b.iter().map(|&word| i64::from(word)).sum::<i64>(), 0);
    let most = config.output.lsb() / 2.0 * noise_gain(words(&config).1);
    let mut block = Biquad::new(config).unwrap();
    let mut left = f64::INFINITY;
    for _ in 0..60_000 {
        left = config.output.to_f64(block.tick(biquad::In { x: 65_535, period: 1 }).y);
    }
    // The step itself leaves 4096 times e^-66.
    assert!(left.abs() <= most + 1e-20, "{left} of at most {most}");
}

#[test]
fn sixteen_fraction_bits_cannot_hold_this_corner() {
    // The distance of the poles from z = 1 is the root of 1 + A1 + A2, and equals the corner in radians per sample:
    // 2.5e-6 is less than a sixth of 2^-16. Whole numbers of that unit put a pole on z = 1, or the corner more than the
    // root of 6 times too high.
    let (_, a) = butterworth();
    let corner = TAU * CORNER_HZ / SAMPLE_HZ;
    assert!((a[0] + a[1] + a[2] - corner * corner).abs() < 0.01 * corner * corner);
    let config = high_pass(format(2, 16));
    let units = (1 << 16) + config.a[0] + config.a[1];
    let off = f64::from(units) * config.coefficient.lsb() / (corner * corner);
    assert!(units <= 0 || off > 6.0, "{units} units, {off} of the corner's square");
}
