//! Backward difference of the position over a programmable sample period, without a division by the period.
//!
//! - **Equation**: `d(k) = position(k) - position(k-1)`, modulo `2^WIDTH` as two's complement; `velocity = d`, or
//!   `floor(d * scale)` when `RESCALED`, which keeps the physical damping when the period changes.
//! - **Ports**: `position` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1,
//!   `scale` (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC), ignored unless `RESCALED`, in; `velocity` (1,OUT_WIDTH-1,0) out, in
//!   counts per sample.
//! - **Latency**: 1 edge after a sample edge, up to `period`.
//! - **Edge**: with the countdown at 0, `velocity` and the previous position are loaded and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down. A new period takes effect at the next sample edge.
//! - **Reset**: countdown, previous position and velocity 0; the first edge samples.
//! - **Overflow**: saturates when `OUT_WIDTH` is too narrow. Motion of half the counter's range in one sample aliases.
//! - **VHDL twin**: `hdl/velocity_register.vhd`.
//! - **Source**: Vasudevan et al. 2007, Eq. (4).
//! - **Differs from the hardware**: RESCALED is an addition to the paper's design; its product takes one edge, so no
//!   limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the register.
    pub struct In of |block: &VelocityRegister| {
        position: Format::unsigned(block.config.width), "count", "Position, modulo its width";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
        scale: block.config.scale, "1", "Factor of the difference, if rescaled";
    }
    /// Outputs of the register.
    pub struct Out of |block: &VelocityRegister| {
        velocity: block.narrowing.to, "count/sample", "Motion in the latest sample";
    }
}

crate::base::listed::configuration! {
    /// The widths of a velocity register.
    pub struct VelocityConfig {
        /// Width of the position, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Width of the period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// Whether the difference is multiplied by `scale`.
        rescaled: bool = false, ["RESCALED"];
        /// Format of `scale`.
        scale: Format = Format::new(false, 8, 8).expect("16 bits"), ["SCALE_WIDTH", "SCALE_FRAC"];
        /// Width of the velocity, in bits.
        out_width: u32 = 12, ["OUT_WIDTH"];
    }
}

/// A velocity register; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct VelocityRegister {
    config: VelocityConfig,
    difference: Format,
    narrowing: Narrowing,
    fits_64: bool,
    /// Whether the velocity is the difference itself, which always fits it.
    is_plain: bool,
    countdown: Countdown,
    previous: i64,
    latest: Narrowed,
}

/// The velocity at standstill and after reset.
const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl VelocityRegister {
    /// Returns a velocity register with these widths.
    ///
    /// # Errors
    ///
    /// Returns an error unless position, scale and velocity have 2 to 62 bits, the period has 2 to 30 bits, and the
    /// scale is unsigned with 0 or more fraction bits.
    pub fn new(config: VelocityConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", config.period_width, COUNTER)?;
        within(Self::NAME, "SCALE_WIDTH", config.scale.width(), WORD)?;
        within(Self::NAME, "OUT_WIDTH", config.out_width, WORD)?;
        if config.scale.is_signed() || config.scale.frac() < 0 {
            let found = format!("scale is {}", config.scale);
            return Err(ConfigError::new(Self::NAME, found, "unsigned with 0 or more fraction bits, as (0,8,8)"));
        }
        let narrowing = Narrowing {
            from_frac: if config.rescaled { config.scale.frac() } else { 0 },
            to: Format::signed(config.out_width),
            rounding: Rounding::Truncate,
            overflow: Overflow::Saturate,
        };
        let difference = Format::signed(config.width);
        let countdown = Countdown::default();
        let is_plain = !config.rescaled && config.out_width >= config.width;
        let (previous, latest) = (0, ZERO);
        let mut block = Self { config, difference, narrowing, fits_64: false, is_plain, countdown, previous, latest };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the velocity, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the velocity that a sample edge would load now.
    #[inline]
    fn sample(&self, input: &In<i64>) -> Narrowed {
        if input.position == self.previous {
            return ZERO;
        }
        if self.is_plain {
            return Narrowed { word: self.difference.wrap((input.position - self.previous).into()), ..ZERO };
        }
        if self.fits_64 {
            self.moved(Machine::<i64>::of(self.previous), input.map(Machine::of)).narrowed()
        } else {
            self.moved(Machine::<i128>::of(self.previous), input.map(Machine::of)).narrowed()
        }
    }

    /// Computes the velocity of a motion from the previous position to the present one.
    #[inline]
    fn moved<W: Word>(&self, previous: W, input: In<W>) -> W {
        let difference = (input.position - previous).wrap(self.difference);
        let factor = if self.config.rescaled { input.scale } else { W::int(1) };
        (difference * factor).narrow(&self.narrowing)
    }
}

impl Step for VelocityRegister {
    fn registers(&self) -> Vec<Register> {
        let VelocityConfig { width, period_width, .. } = self.config;
        vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("velocity", self.narrowing.to),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [left, previous, velocity] = *registers else { unreachable!("three registers") };
        let (left, samples) = counted_down(left, input.period);
        let sampled = || [input.position, self.moved(previous, input)];
        let [next, latest] = W::branch(samples, sampled, || [previous, velocity]);
        (vec![left, next, latest], Out { velocity })
    }
}

crate::base::listed::configured!(VelocityRegister: VelocityConfig);

impl Block for VelocityRegister {
    const NAME: &'static str = "velocity_register";
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
            self.latest = self.sample(&input);
            self.previous = input.position;
        }
        Out { velocity: self.latest.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // The next sample loads the present difference, every later one 0. A change of the lost bits counts as a change
        // of the output.
        let next = self.sample(input);
        if next != self.latest {
            self.countdown.left()
        } else if next != ZERO {
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

impl Listed for VelocityRegister {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let scale = Format::new(false, 4, 4).expect("8 bits");
        let small = VelocityConfig { width: 8, period_width: 6, out_width: 8, ..VelocityConfig::default() };
        Ok(vec![
            ("8_bit", Self::new(small)?),
            ("narrow", Self::new(VelocityConfig { out_width: 5, ..small })?),
            ("wide", Self::new(VelocityConfig { out_width: 16, ..small })?),
            ("rescaled", Self::new(VelocityConfig { rescaled: true, ..VelocityConfig::default() })?),
            ("rescaled_8_bit", Self::new(VelocityConfig { rescaled: true, scale, ..small })?),
        ])
    }
}
