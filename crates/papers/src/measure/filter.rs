//! The gain `|1 - H|` of an input shaper without its rectifiers: in closed form, for the plant's shaper, and for the
//! datapath's fixed-point words.

use std::f64::consts::{PI, SQRT_2, TAU};

use hpu_cosim::Control;
use hpu_cosim::law::high_pass;
use hpu_datapath::{Biquad, BiquadConfig, Block, biquad};
use hpu_plant::Shaper;
use hpu_signal::Format;

use super::{Asked, numbers};
use crate::Error;
use crate::template::Values;

/// Cutoff of the published filter, in Hz.
pub const CUTOFF_HZ: f64 = 2.5;

/// Sample time of the digital shaper, in s.
pub const PERIOD_S: f64 = 1e-3;

pub(super) fn gains(asked: &Asked, _: &Control) -> Result<Values, Error> {
    let frequency_hz = asked.number("frequency").ok_or("frequency is missing")?;
    Ok(numbers([
        ("exact", exact(frequency_hz)),
        ("analog", analog(frequency_hz)),
        ("bilinear", bilinear(frequency_hz)),
        ("words", digital(frequency_hz)),
    ]))
}

pub(super) fn step(_: &Asked, _: &Control) -> Result<Values, Error> {
    let [exact, analog, words] = overshoots();
    Ok(numbers([("exact", exact), ("analog", analog), ("words", words)]))
}

/// Returns `|1 - H|` of the Butterworth filter: `(√2 ω_c s + ω_c²) / (s² + √2 ω_c s + ω_c²)`.
pub fn exact(frequency_hz: f64) -> f64 {
    // Frequencies are in units of the cutoff.
    let w = frequency_hz / CUTOFF_HZ;
    let slow = SQRT_2 * w;
    libm::hypot(slow, 1.0) / libm::hypot(slow, 1.0 - w * w)
}

/// Returns `|1 - H|` of the bilinear transform, which maps each frequency to another one and the cutoff to itself.
pub fn bilinear(frequency_hz: f64) -> f64 {
    let warped = |hz: f64| libm::tan(PI * hz * PERIOD_S);
    exact(CUTOFF_HZ * warped(frequency_hz) / warped(CUTOFF_HZ))
}

/// Returns `|1 - H|` of the plant's shaper, whose input is a sine held for a thousandth of its period; the output is
/// read in the middle of every hold.
pub fn analog(frequency_hz: f64) -> f64 {
    const HOLDS: u32 = 1000;
    let half_s = 0.5 / (frequency_hz * f64::from(HOLDS));
    let settling = libm::ceil(3.0 * frequency_hz) as u32;
    let mut shaper = Shaper::new(CUTOFF_HZ);
    let mut left = [0.0; 2];
    for hold in 0..(settling + 1) * HOLDS {
        let (sin, cos) = libm::sincos(TAU * f64::from(hold % HOLDS) / f64::from(HOLDS));
        shaper = shaper.stepped(sin).after(half_s);
        if hold >= settling * HOLDS {
            let slow = shaper.input() - shaper.high_pass();
            left = [left[0] + slow * sin, left[1] + slow * cos];
        }
        shaper = shaper.after(half_s);
    }
    libm::hypot(left[0], left[1]) * 2.0 / f64::from(HOLDS)
}

/// Bits of a force's magnitude in the words that are measured.
const FORCE_BITS: u32 = 16;

/// Returns `1 - H` of a sequence of forces, as the datapath's filter computes it, in the forces' units.
///
/// # Panics
///
/// If the shaper's own widths are refused.
pub fn words(forces: impl Iterator<Item = i64>) -> impl Iterator<Item = f64> {
    let coefficient = Format::new(true, 1, 30).expect("32 bits");
    let word = |value: f64| (value / coefficient.lsb()).round() as i32;
    let [b0, b1, b2, a1, a2] = high_pass(CUTOFF_HZ, PERIOD_S).map(word);
    let output = Format::new(true, FORCE_BITS as i32 + 2, 16).expect("35 bits");
    let input = Format::signed(FORCE_BITS + 2);
    let config = BiquadConfig { input, output, coefficient, b: [b0, b1, b2], a: [a1, a2], ..BiquadConfig::default() };
    let mut filter = Biquad::new(config).expect("as in the shaper");
    // One sample at every clock cycle.
    forces.map(move |x| x as f64 - output.to_f64(filter.tick(biquad::In { x, period: 1 }).y))
}

/// Returns `|1 - H|` of the datapath's fixed-point words, whose input is a sine of full scale sampled for two seconds.
pub fn digital(frequency_hz: f64) -> f64 {
    const SETTLING: usize = 3000;
    const WATCHED: usize = 2000;
    let full = f64::from((1u32 << FORCE_BITS) - 1);
    let wave = |sample: usize| libm::sincos(TAU * frequency_hz * PERIOD_S * sample as f64);
    let forces = (0..SETTLING + WATCHED).map(|sample| (full * wave(sample).0).round() as i64);
    let left = words(forces).enumerate().skip(SETTLING).fold([0.0; 2], |left, (sample, slow)| {
        let (sin, cos) = wave(sample);
        [left[0] + slow * sin, left[1] + slow * cos]
    });
    libm::hypot(left[0], left[1]) * 2.0 / (WATCHED as f64 * full)
}

/// Returns the greatest value of `1 - H` under a step of 1: in closed form, of the plant's shaper read every 0.1 ms,
/// and of the fixed-point words.
pub fn overshoots() -> [f64; 3] {
    let step = Shaper::new(CUTOFF_HZ).stepped(1.0);
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let analog = most(&mut (0..5000).map(|tick| 1.0 - step.after(f64::from(tick) * 1e-4).high_pass()));
    let full = (1i64 << FORCE_BITS) - 1;
    let digital = most(&mut words((0..500).map(|_| full))) / full as f64;
    [1.0 + libm::exp(-0.5 * PI), analog, digital]
}
