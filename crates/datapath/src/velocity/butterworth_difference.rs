//! Backward difference of the position through a second-order Butterworth low pass.
//!
//! - **Equation**: `d(k) = position(k) - position(k-1)`, modulo `2^WIDTH` as two's complement; `y` is a `biquad` of `d`
//!   with the coefficients `B0`, `2 B0`, `B0`, `A1` and `A2 = 4 B0 - 2^30 - A1`, in units of `2^-30`, which passes a
//!   constant `d` on as it is; `velocity` is `y`, rounded to the nearest, ties up.
//! - **Ports**: `position` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `velocity`
//!   (1,WIDTH-1,OUT_FRAC) out, in counts per sample.
//! - **Latency**: 1 edge after a sample edge, up to `period`, beside that of the filter.
//! - **Edge**: with the countdown at 0, `y` and the previous position are loaded and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down. A new period takes effect at the next sample edge.
//! - **Reset**: countdowns, previous position and filter 0; the first edge samples.
//! - **Overflow**: `y` and `velocity` saturate: the filter overshoots by 4.3 %.
//! - **VHDL twin**: `hdl/butterworth_difference.vhd`.
//! - **Source**: the Butterworth low pass by the bilinear transform, its corner prewarped.
//! - **Differs from the hardware**: five products and their sum take one edge, so no limit on the clock.
//!
//! `y` has `GUARD` fraction bits more than `velocity`. At rest the roundings of `y` leave it up to `2^29 / (4 B0)` of
//! its LSBs beside 0, so that `velocity` comes to rest at 0 with `GUARD` of at least `log2(2^28 / B0) + 1`.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{COUNTER, within};
use crate::base::listed::Listed;
use crate::{
    Biquad, BiquadConfig, Block, ConfigError, Register, Step, ZeroOrderHold, arithmetic::biquad,
    arithmetic::zero_order_hold,
};

hpu_signal::ports! {
    /// Inputs of the estimator.
    pub struct In of |block: &ButterworthDifference| {
        position: Format::unsigned(block.config.width), "count", "Position, modulo its width";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the estimator.
    pub struct Out of |block: &ButterworthDifference| {
        velocity: block.narrowing.to, "count/sample", "Filtered motion in a sample";
    }
}

crate::base::listed::configuration! {
    /// The widths and coefficients of a difference behind a Butterworth low pass.
    pub struct ButterworthConfig {
        /// Width of the position, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Width of the period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// Coefficient `B0`, in units of `2^-30`.
        b0: u32 = 576_782, ["B0"];
        /// Coefficient `A1`, in units of `2^-30`.
        a1: i32 = -2_075_951_210, ["A1"];
        /// Number of fraction bits of the filter beyond those of the velocity.
        guard: u32 = 10, ["GUARD"];
        /// Number of fraction bits of the velocity.
        out_frac: u32 = 8, ["OUT_FRAC"];
    }
}

/// Fraction bits of the coefficients.
const COEFFICIENT: u32 = 30;

impl ButterworthConfig {
    /// Returns the coefficient `A2` that makes the gain of a constant difference 1, in units of `2^-30`.
    pub fn a2(&self) -> i64 {
        4 * i64::from(self.b0) - (1 << COEFFICIENT) - i64::from(self.a1)
    }
}

/// A backward difference behind a Butterworth low pass; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ButterworthDifference {
    config: ButterworthConfig,
    difference: Format,
    narrowing: Narrowing,
    previous: ZeroOrderHold,
    held: i64,
    section: Biquad,
}

impl ButterworthDifference {
    /// Returns an estimator with these widths and coefficients.
    ///
    /// # Errors
    ///
    /// Returns an error unless the position has at least 2 bits, position, `OUT_FRAC` and `GUARD` together at most 40,
    /// `OUT_FRAC` and `GUARD` together at most 30, the period 2 to 30, and the poles lie inside the unit circle.
    pub fn new(config: ButterworthConfig) -> Result<Self, ConfigError> {
        let ButterworthConfig { width, period_width, b0, a1, guard, out_frac } = config;
        let one = 1u32 << COEFFICIENT;
        within(Self::NAME, "WIDTH", width, 2..=40)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        within(Self::NAME, "B0", b0, 1..=one - 1)?;
        within(Self::NAME, "OUT_FRAC", out_frac, 0..=30)?;
        within(Self::NAME, "GUARD", guard, 0..=30 - out_frac)?;
        within(Self::NAME, "WIDTH + OUT_FRAC + GUARD", width + out_frac + guard, 2..=40)?;
        let (one, a2) = (i64::from(one), config.a2());
        if a2.abs() >= one || i64::from(a1) >= one + a2 {
            let [least, most] = [4 * i64::from(b0) - 2 * one + 1, 2 * i64::from(b0) - 1];
            return Err(ConfigError::new(Self::NAME, format!("A1 is {a1}"), format!("{least} to {most}")));
        }
        let format = |frac: u32| Format::new(true, width.cast_signed() - 1, frac.cast_signed()).expect("2 to 40 bits");
        let narrowing = Narrowing {
            from_frac: (out_frac + guard).cast_signed(),
            to: format(out_frac),
            rounding: Rounding::NearestUp,
            overflow: Overflow::Saturate,
        };
        let b0 = b0.cast_signed();
        let section = Biquad::new(BiquadConfig {
            input: format(0),
            output: format(out_frac + guard),
            coefficient: Format::new(true, 1, COEFFICIENT.cast_signed()).expect("32 bits"),
            b: [b0, 2 * b0, b0],
            a: [a1, i32::try_from(a2).expect("below 1")],
            period_width,
            rounding: Rounding::NearestUp,
        })?;
        let previous = ZeroOrderHold::new(width, period_width)?;
        Ok(Self { config, difference: Format::signed(width), narrowing, previous, held: 0, section })
    }

    /// Returns the velocity, and which bits the latest sample lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        let made = self.section.latest();
        let shown: Narrowed = self.shown::<Machine<i64>>(Machine::of(made.word)).narrowed();
        let (rounded, overflowed) = (made.rounded || shown.rounded, made.overflowed || shown.overflowed);
        Narrowed { rounded, overflowed, ..shown }
    }

    /// Computes the velocity from the output of the filter.
    #[inline]
    fn shown<W: Word>(&self, y: W) -> W {
        y.narrow(&self.narrowing)
    }

    /// Returns the inputs of the hold and of the filter.
    #[inline]
    fn inner(&self, In { position, period }: In<i64>) -> (zero_order_hold::In<i64>, biquad::In<i64>) {
        let x = self.difference.wrap(i128::from(position) - i128::from(self.held));
        (zero_order_hold::In { d: position, period }, biquad::In { x, period })
    }
}

impl Step for ButterworthDifference {
    fn registers(&self) -> Vec<Register> {
        let previous = Register::inside("hold", &self.previous);
        previous.chain(Register::inside("section", &self.section)).collect()
    }

    fn step<W: Word>(&self, registers: &[W], In { position, period }: In<W>) -> (Vec<W>, Out<W>) {
        let (hold, section) = registers.split_at(Step::registers(&self.previous).len());
        let (mut next, zero_order_hold::Out { q }) =
            self.previous.step(hold, zero_order_hold::In { d: position, period });
        let x = (position - q).wrap(self.difference);
        let (filtered, biquad::Out { y }) = self.section.step(section, biquad::In { x, period });
        next.extend(filtered);
        (next, Out { velocity: self.shown(y) })
    }
}

crate::base::listed::configured!(ButterworthDifference: ButterworthConfig);

impl Block for ButterworthDifference {
    const NAME: &'static str = "butterworth_difference";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.held = self.previous.reset().q;
        self.section.reset();
        Out { velocity: self.latest().word }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let (hold, section) = self.inner(input);
        self.section.tick(section);
        self.held = self.previous.tick(hold).q;
        Out { velocity: self.latest().word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let (hold, section) = self.inner(*input);
        self.previous.quiet(&hold).min(self.section.quiet(&section))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let (hold, section) = self.inner(*input);
        self.previous.skip(edges, &hold);
        self.section.skip(edges, &section);
    }
}

impl Listed for ButterworthDifference {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let of = |[width, period_width, guard, out_frac]: [u32; 4], b0, a1| {
            Self::new(ButterworthConfig { width, period_width, b0, a1, guard, out_frac })
        };
        Ok(vec![
            // Corners of a fifth, a quarter, 1 / 10300 and 47 % of the sample rate.
            ("5_bit", of([5, 4, 3, 2], 221_805_086, -396_777_000)?),
            ("no_guard", of([6, 4, 0, 0], 1 << 28, 0)?),
            ("slow", of([8, 6, 23, 7], 100, -2_146_556_629)?),
            ("near_half", of([10, 4, 4, 6], 939_720_690, 1_862_647_611)?),
        ])
    }
}
