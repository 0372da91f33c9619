//! Backward difference of the position through a first-order low pass. With a factor that is a power of two it has no
//! multiplier.
//!
//! - **Equation**: `d(k) = position(k) - position(k-1)`, modulo `2^WIDTH` as two's complement;
//!   `v(k) = v(k-1) + rounded((d(k) * 2^OUT_FRAC - v(k-1)) * WEIGHT / 2^SHIFT)`, rounded as `ROUNDING` says, down
//!   unless it says otherwise: `alpha = WEIGHT * 2^-SHIFT`, a time constant of about `1/alpha - 1/2` sample periods, a
//!   corner of `-ln(1 - alpha) / (2 pi T)` at a sample period `T`.
//! - **Ports**: `position` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `velocity`
//!   (1,WIDTH-1,OUT_FRAC) out, in counts per sample.
//! - **Latency**: 1 edge after a sample edge, up to `period`, beside that of the filter.
//! - **Edge**: with the countdown at 0, `velocity` and the previous position are loaded and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down. A new period takes effect at the next sample edge.
//! - **Reset**: countdown, previous position and velocity 0; the first edge samples.
//! - **Overflow**: none; the new velocity is between the previous velocity and the difference, which both fit. With
//!   `ROUNDING` 0 every floor is carried on: the velocity is less than `2^SHIFT / WEIGHT` of its LSBs below that of the
//!   exact filter, and after motion back it comes to rest less than that below 0.
//! - **VHDL twin**: `hdl/filtered_difference.vhd`.
//! - **Source**: the first-order filter that haptic controllers put behind their difference (Colgate and Brown 1994).
//! - **Differs from the hardware**: none known.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the estimator.
    pub struct In of |block: &FilteredDifference| {
        position: Format::unsigned(block.config.width), "count", "Position, modulo its width";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the estimator.
    pub struct Out of |block: &FilteredDifference| {
        velocity: block.narrowing.to, "count/sample", "Filtered motion in a sample";
    }
}

crate::base::listed::configuration! {
    /// The widths of a filtered difference.
    pub struct FilteredConfig {
        /// Width of the position, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Width of the period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// Exponent of the filter's factor `weight * 2^-shift`; with 0 nothing is filtered.
        shift: u32 = 3, ["SHIFT"];
        /// Weight of a new difference, in units of `2^-shift`.
        weight: u32 = 1, ["WEIGHT"];
        /// Number of fraction bits of the velocity.
        out_frac: u32 = 8, ["OUT_FRAC"];
        /// The rounding of a step of the velocity.
        rounding: Rounding = Rounding::Truncate, ["ROUNDING"];
    }
}

/// A backward difference with a low pass; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FilteredDifference {
    config: FilteredConfig,
    difference: Format,
    narrowing: Narrowing,
    fits_64: bool,
    countdown: Countdown,
    previous: i64,
    latest: Narrowed,
}

/// The velocity after reset.
const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl FilteredDifference {
    /// Returns an estimator with these widths.
    ///
    /// # Errors
    ///
    /// Returns an error unless position and velocity have 2 to 62 bits, the velocity has 0 to 30 fraction bits, the
    /// period has 2 to 30 bits, the shift is 0 to 16, and the weight 1 to `2^shift`.
    pub fn new(config: FilteredConfig) -> Result<Self, ConfigError> {
        let FilteredConfig { width, period_width, shift, weight, out_frac, .. } = config;
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        within(Self::NAME, "SHIFT", shift, 0..=16)?;
        within(Self::NAME, "WEIGHT", weight, 1..=1 << shift)?;
        within(Self::NAME, "OUT_FRAC", out_frac, 0..=30)?;
        within(Self::NAME, "WIDTH + OUT_FRAC", width + out_frac, WORD)?;
        let (int, frac) = (width.cast_signed() - 1, out_frac.cast_signed());
        let narrowing = Narrowing {
            from_frac: frac + shift.cast_signed(),
            to: Format::new(true, int, frac).expect("2 to 62 bits"),
            rounding: Rounding::Truncate,
            overflow: Overflow::Wrap,
        };
        let difference = Format::signed(width);
        let countdown = Countdown::default();
        let mut block = Self { config, difference, narrowing, fits_64: false, countdown, previous: 0, latest: ZERO };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the velocity, and which bits the latest sample lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the velocity that a sample edge would load after a motion from `previous` to `position`.
    #[inline]
    fn sample(&self, position: i64, previous: i64) -> Narrowed {
        let last = self.latest.word;
        if self.fits_64 {
            self.moved::<Machine<i64>>(Machine::of(position), Machine::of(previous), Machine::of(last)).narrowed()
        } else {
            self.moved::<Machine<i128>>(Machine::of(position), Machine::of(previous), Machine::of(last)).narrowed()
        }
    }

    /// Computes the velocity after a motion from the velocity before it.
    #[inline]
    fn moved<W: Word>(&self, position: W, previous: W, last: W) -> W {
        let input = (position - previous).wrap(self.difference).shl(self.config.out_frac);
        let FilteredConfig { shift, weight, rounding, .. } = self.config;
        let way = if weight == 1 { input - last } else { (input - last) * W::int(weight.into()) };
        if rounding != Rounding::Truncate {
            return (last + way.round(rounding, shift.cast_signed())).wrap(self.narrowing.to);
        }
        // This is v + floor((d - v) * WEIGHT / 2^SHIFT), over the common denominator.
        (last.shl(shift) + way).narrow(&self.narrowing)
    }
}

impl Step for FilteredDifference {
    fn registers(&self) -> Vec<Register> {
        let FilteredConfig { width, period_width, .. } = self.config;
        vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("state", self.narrowing.to),
            Register::new("velocity", self.narrowing.to),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], In { position, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, previous, state, velocity] = *registers else { unreachable!("four registers") };
        let (left, samples) = counted_down(left, period);
        let sampled = || {
            let moved = self.moved(position, previous, state);
            [position, moved, moved]
        };
        let [next, filtered, shown] = W::branch(samples, sampled, || [previous, state, velocity]);
        (vec![left, next, filtered, shown], Out { velocity })
    }
}

crate::base::listed::configured!(FilteredDifference: FilteredConfig);

impl Block for FilteredDifference {
    const NAME: &'static str = "filtered_difference";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.previous = 0;
        self.latest = ZERO;
        Out { velocity: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.latest = self.sample(input.position, self.previous);
            self.previous = input.position;
        }
        Out { velocity: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // The next sample takes in the present difference, every later one a difference of 0. A change of the lost bits
        // counts as a change of the output.
        if self.sample(input.position, self.previous) != self.latest {
            self.countdown.left()
        } else if self.sample(input.position, input.position) != self.latest {
            self.countdown.left() + edges(input.period)
        } else {
            u64::MAX
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if self.countdown.skip(edges, input.period) {
            self.previous = input.position;
        }
    }
}

impl Listed for FilteredDifference {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let filtered = |[width, period_width, shift, out_frac]: [u32; 4]| {
            Self::new(FilteredConfig { width, period_width, shift, out_frac, ..FilteredConfig::default() })
        };
        let small = FilteredConfig { width: 5, period_width: 4, shift: 2, out_frac: 3, ..FilteredConfig::default() };
        let rounded = |rounding| Self::new(FilteredConfig { rounding, ..small });
        Ok(vec![
            ("unfiltered", filtered([8, 6, 0, 0])?),
            ("5_bit", filtered([5, 4, 2, 3])?),
            ("slow", filtered([10, 6, 16, 16])?),
            ("wide", filtered([40, 4, 5, 22])?),
            ("nearest_up", rounded(Rounding::NearestUp)?),
            ("toward_zero", rounded(Rounding::TowardZero)?),
            ("weighted", Self::new(FilteredConfig { shift: 3, weight: 5, rounding: Rounding::NearestEven, ..small })?),
            ("30_hz", Self::new(FilteredConfig { shift: 16, weight: 3017, ..FilteredConfig::default() })?),
        ])
    }
}
