//! Second-order section, sampled, direct form I.
//!
//! - **Equation**: `y(k) = B0 x(k) + B1 x(k-1) + B2 x(k-2) - A1 y(k-1) - A2 y(k-2)`, the `y` on the right as narrowed
//!   words, the sum of the five products exact and narrowed once.
//! - **Ports**: `x` (1,IN_INT,IN_FRAC), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `y`
//!   (1,OUT_INT,OUT_FRAC) out. The coefficients are generics, integers that stand for words of (1,COEF_INT,COEF_FRAC).
//! - **Latency**: 1 edge after a sample edge, up to `period`.
//! - **Edge**: with the countdown at 0, `y(k)` is loaded, the delays move on, and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down.
//! - **Reset**: all 0; the first edge samples.
//! - **Overflow**: rounds as `ROUNDING` says, to the nearest, ties up, unless it says otherwise; then saturates.
//! - **VHDL twin**: `hdl/biquad.vhd`.
//! - **Source**: the direct form I of the textbooks.
//! - **Differs from the hardware**: five products and their sum take one edge, so no limit on the clock.
//!
//! Every rounding of `y` is fed back, and `1/A(z)` amplifies it up to about `1/(1 + A1 + A2)` times. A corner far
//! below the sampling rate therefore needs fraction bits: at `f_c/f_s = 1/4000`, `1 + A1 + A2` is `2.5e-6`, a sixth of
//! an LSB of coefficients with 16 fraction bits, and an error of half an LSB of `y` grows to `2e5` LSBs.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{COUNTER, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the section.
    pub struct In of |block: &Biquad| {
        x: block.config.input, "1", "Input";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the section.
    pub struct Out of |block: &Biquad| {
        y: block.config.output, "1", "Output of the latest sample edge";
    }
}

crate::base::listed::configuration! {
    /// The formats, coefficients and widths of a section.
    pub struct BiquadConfig {
        /// Format of `x`.
        input: Format = Format::new(true, 12, 4).expect("17 bits"), ["IN_INT", "IN_FRAC"];
        /// Format of `y`.
        output: Format = Format::new(true, 14, 8).expect("23 bits"), ["OUT_INT", "OUT_FRAC"];
        /// Format of the coefficients.
        coefficient: Format = Format::new(true, 2, 16).expect("19 bits"), ["COEF_INT", "COEF_FRAC"];
        /// Coefficients `B0`, `B1`, `B2` as words of `coefficient`.
        b: [i32; 3] = [65_536, 0, 0], ["B0", "B1", "B2"];
        /// Coefficients `A1`, `A2` as words of `coefficient`.
        a: [i32; 2] = [0, 0], ["A1", "A2"];
        /// Width of the period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// The rounding of `y`.
        rounding: Rounding = Rounding::NearestUp, ["ROUNDING"];
    }
}

/// Words of the two latest samples, the latest first.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Delays {
    x: [i64; 2],
    y: [i64; 2],
}

/// A second-order section; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Biquad {
    config: BiquadConfig,
    narrowing: Narrowing,
    fits_64: bool,
    countdown: Countdown,
    delays: Delays,
    latest: Narrowed,
}

const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl Delays {
    /// Returns the delays after the sample whose input is `x` and whose output is `y`.
    #[inline]
    fn after(self, x: i64, y: i64) -> Self {
        Self { x: [x, self.x[0]], y: [y, self.y[0]] }
    }
}

impl Biquad {
    /// Returns a section with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless `x` and `y` are signed with 2 to 40 bits, the coefficients are signed with 2 to 32 bits,
    /// all have 0 to 30 fraction bits, every coefficient fits its format, and the period has 2 to 30 bits.
    pub fn new(config: BiquadConfig) -> Result<Self, ConfigError> {
        let BiquadConfig { input, output, coefficient, b, a, period_width, rounding } = config;
        for (name, format, widest) in [("x", input, 40), ("y", output, 40), ("a coefficient", coefficient, 32)] {
            let fits = (2..=widest).contains(&format.width()) && (0..=30).contains(&format.frac());
            if !fits || !format.is_signed() || format.int() < 0 {
                let accepted = format!("signed, 2 to {widest} bits, 0 to 30 of them fraction bits");
                return Err(ConfigError::new(Self::NAME, format!("{name} is {format}"), accepted));
            }
        }
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        if let Some(word) = b.iter().chain(&a).find(|&&word| !coefficient.holds(word.into())) {
            let accepted = format!("{} to {}", coefficient.min(), coefficient.max());
            return Err(ConfigError::new(Self::NAME, format!("a coefficient's word is {word}"), accepted));
        }
        let from_frac = coefficient.frac() + input.frac().max(output.frac());
        let narrowing = Narrowing { from_frac, to: output, rounding, overflow: Overflow::Saturate };
        let (countdown, delays) = (Countdown::default(), Delays::default());
        let mut block = Self { config, narrowing, fits_64: false, countdown, delays, latest: ZERO };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the output, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the output that a sample edge would load from these delays.
    #[inline]
    fn sample(&self, x: i64, delays: Delays) -> Narrowed {
        if self.fits_64 {
            self.made(Machine::<i64>::of(x), delays.x.map(Machine::of), delays.y.map(Machine::of)).narrowed()
        } else {
            self.made(Machine::<i128>::of(x), delays.x.map(Machine::of), delays.y.map(Machine::of)).narrowed()
        }
    }

    /// Computes the output of a sample from its input, the two inputs before it and the two outputs before it.
    #[inline]
    fn made<W: Word>(&self, x: W, [x1, x2]: [W; 2], [y1, y2]: [W; 2]) -> W {
        let BiquadConfig { input, output, coefficient, b, a, .. } = self.config;
        let room = coefficient.width() + input.int().max(output.int()).unsigned_abs() + self.frac().cast_unsigned() + 1;
        // Multiplies by the magnitude, as the VHDL does.
        let product = |coefficient: i32, factor: W, name: &str| {
            let product = W::int(coefficient.unsigned_abs().into()) * factor;
            if coefficient < 0 { -product } else { product }.cut(name, room)
        };
        // All samples are aligned to the longer fraction.
        let [x0, x1, x2] = [x, x1, x2].map(|word| word.shl(self.spare(input)));
        let [y1, y2] = [y1, y2].map(|word| word.shl(self.spare(output)));
        let forward = product(b[0], x0, "p0") + product(b[1], x1, "p1") + product(b[2], x2, "p2");
        (forward - product(a[0], y1, "q1") - product(a[1], y2, "q2")).narrow(&self.narrowing)
    }

    /// Returns the number of fraction bits of the aligned samples.
    fn frac(&self) -> i32 {
        self.config.input.frac().max(self.config.output.frac())
    }

    /// Returns the number of zero bits by which an input or output is shifted up to align it; they are the lowest bits
    /// of the VHDL's registers.
    fn spare(&self, own: Format) -> u32 {
        (self.frac() - own.frac()).cast_unsigned()
    }
}

impl Step for Biquad {
    fn registers(&self) -> Vec<Register> {
        let BiquadConfig { input, output, period_width, .. } = self.config;
        let sample = |name, format| Register { low: self.spare(format), ..Register::new(name, format) };
        vec![
            Register::new("countdown", Format::unsigned(period_width)),
            sample("x1", input),
            sample("x2", input),
            sample("y1", output),
            sample("y2", output),
            Register::new("y", output),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], In { x, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, x1, x2, y1, y2, y] = *registers else { unreachable!("six registers") };
        let (left, samples) = counted_down(left, period);
        let sampled = || {
            let made = self.made(x, [x1, x2], [y1, y2]);
            [x, x1, made, y1, made]
        };
        let loaded = W::branch(samples, sampled, || [x1, x2, y1, y2, y]);
        ([[left].as_slice(), &loaded].concat(), Out { y })
    }
}

crate::base::listed::configured!(Biquad: BiquadConfig);

impl Block for Biquad {
    const NAME: &'static str = "biquad";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.delays = Delays::default();
        self.latest = ZERO;
        Out { y: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.latest = self.sample(input.x, self.delays);
            self.delays = self.delays.after(input.x, self.latest.word);
        }
        Out { y: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // If two samples change nothing, the delays are full of the same words; a third one then predicts all later
        // samples.
        let mut delays = self.delays;
        for sample in 0..3 {
            if self.sample(input.x, delays) != self.latest {
                return self.countdown.left() + sample * edges(input.period);
            }
            delays = delays.after(input.x, self.latest.word);
        }
        u64::MAX
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        for _ in 0..self.countdown.samples(edges, input.period).min(2) {
            self.delays = self.delays.after(input.x, self.latest.word);
        }
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for Biquad {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let section = |words: [(i32, i32); 3], b, a, period_width| {
            let [input, output, coefficient] =
                words.map(|(int, frac)| Format::new(true, int, frac).expect("at most 40 bits"));
            let rounding = Rounding::NearestUp;
            Self::new(BiquadConfig { input, output, coefficient, b, a, period_width, rounding })
        };
        let rounded = |rounding| {
            let narrow = section([(3, 2), (2, 1), (1, 3)], [5, -7, 3], [-13, 6], 4)?;
            Self::new(BiquadConfig { rounding, ..narrow.config })
        };
        // A Butterworth high-pass filter at 1/4000 of the sampling rate: 2.5 Hz at 10 kHz.
        let high_pass = ([1_072_549_859, -2_145_099_718, 1_072_549_859], [-2_145_098_394, 1_071_359_217]);
        let most = i32::MAX;
        Ok(vec![
            ("high_pass", section([(12, 4), (13, 26), (1, 30)], high_pass.0, high_pass.1, 4)?),
            ("narrow", section([(3, 2), (2, 1), (1, 3)], [5, -7, 3], [-13, 6], 4)?),
            ("integer", section([(9, 0), (11, 3), (2, 0)], [1, -2, 1], [-1, 1], 6)?),
            ("extreme", section([(19, 20), (20, 19), (1, 30)], [most, i32::MIN, most], [-most, -most], 8)?),
            ("truncate", rounded(Rounding::Truncate)?),
            ("nearest_even", rounded(Rounding::NearestEven)?),
        ])
    }
}
