//! Space-vector modulation: a voltage of the stator as the duties of three legs.
//!
//! - **Equation**: the phases are `u_a = alpha`, `u_b = (-alpha + sqrt(3) beta) / 2` and `u_c = (-alpha - sqrt(3) beta)
//!   / 2`. With `common = (max(u) + min(u)) / 2`, each duty is `STEPS (1/2 + (u - common) / 2^(WIDTH-1))`. With
//!   `SINUSOIDAL`, `common = 0`. The factor is `R = round(2^F sqrt(3)) / 2^F` with `F = DUTY_WIDTH + 2`. Each duty is
//!   exact otherwise, rounded once, to the nearest, ties up, and clamped to 0 and `STEPS`.
//! - **Ports**: `alpha`, `beta` (1,WIDTH-1,0) in, `2^(WIDTH-1)` is the supply's voltage; `duty_a`, `duty_b`, `duty_c`
//!   (0,DUTY_WIDTH,0) out.
//! - **Range**: amplitudes up to `1/sqrt(3)` of the supply, with `SINUSOIDAL` up to 1/2. Beyond, duties clamp each for
//!   itself, and the voltage has another direction.
//! - **Error**: below 5/8 of a step where the duty is not clamped: 1/2 of rounding, less than 1/8 of the factor.
//! - **Latency**: none, combinational. **Reset**: none. **Overflow**: the duties clamp.
//! - **VHDL twin**: `hdl/space_vector.vhd`.
//! - **Source**: van der Broeck, Skudelny and Stanke 1988; that the mean of the greatest and the least phase makes the
//!   same duties as the table of sectors is a test.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::base::words::limited;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Step};

hpu_signal::ports! {
    /// Inputs of the modulation.
    pub struct In of |block: &SpaceVector| {
        alpha: Format::signed(block.config.width), "1", "Voltage along phase a, in parts of the supply's";
        beta: Format::signed(block.config.width), "1", "Voltage across phase a, in parts of the supply's";
    }
    /// Outputs of the modulation.
    pub struct Out of |block: &SpaceVector| {
        duty_a: Format::unsigned(block.config.duty_width), "step", "Duty of leg A";
        duty_b: Format::unsigned(block.config.duty_width), "step", "Duty of leg B";
        duty_c: Format::unsigned(block.config.duty_width), "step", "Duty of leg C";
    }
}

crate::base::listed::configuration! {
    /// The widths and the kind of a modulation.
    pub struct SpaceVectorConfig {
        /// Width of the voltages, in bits.
        width: u32 = 16, ["WIDTH"];
        /// Width of the duties, in bits.
        duty_width: u32 = 11, ["DUTY_WIDTH"];
        /// The greatest duty.
        steps: u32 = 1250, ["STEPS"];
        /// Whether the phases are sines; otherwise their greatest and least are equally far from the middle.
        sinusoidal: bool = false, ["SINUSOIDAL"];
    }
}

/// A modulation; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SpaceVector {
    config: SpaceVectorConfig,
    /// `R`: the root of 3.
    root: i128,
    fits_64: bool,
}

impl SpaceVector {
    /// Returns a modulation of these words.
    ///
    /// # Errors
    ///
    /// Returns an error unless a voltage has 2 to 22 bits, a duty 2 to 16, and the steps are a duty above 0.
    pub fn new(config: SpaceVectorConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, 2..=22)?;
        within(Self::NAME, "DUTY_WIDTH", config.duty_width, 2..=16)?;
        within(Self::NAME, "STEPS", config.steps, 1..=(1 << config.duty_width) - 1)?;
        // No power of two times the root of 3 is a tie, so that the root of the integer rounds as the real one does.
        let twice = 12u128 << (2 * config.factor_frac());
        let mut block = Self { config, root: twice.isqrt().div_ceil(2).cast_signed(), fits_64: false };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the outputs for these inputs, and which bits were lost to make them: a clamped duty has overflowed.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(self.fits_64, input, |input| self.made(input))
    }
}

impl SpaceVectorConfig {
    /// Fraction bits of the factor.
    fn factor_frac(self) -> u32 {
        self.duty_width + 2
    }
}

impl Combinational for SpaceVector {
    #[inline]
    fn made<W: Word>(&self, In { alpha, beta }: In<W>) -> Out<W> {
        let SpaceVectorConfig { width, duty_width, steps, sinusoidal } = self.config;
        let frac = self.config.factor_frac();
        // The widths of the VHDL: of a phase in units of 2^-(F+1), and of its product with the steps.
        let phase_width = width + frac + 3;
        let total_width = phase_width + duty_width + 3;
        let across = (beta * W::int(self.root)).cut("across", phase_width);
        let a = alpha.shl(frac + 1);
        let b = (across - alpha.shl(frac)).cut("phase_b", phase_width);
        let c = (-across - alpha.shl(frac)).cut("phase_c", phase_width);
        let common = if sinusoidal {
            W::int(0)
        } else {
            let most = a.greater(b).greater(c).cut("most_u", phase_width);
            most + a.lesser(b).lesser(c).cut("least_u", phase_width)
        };
        let half = W::int(i128::from(steps) << (frac + width));
        let duty = |phase: W, name: &str| {
            let total = ((phase.shl(1) - common) * W::int(steps.into()) + half).cut(name, total_width);
            limited(total, (frac + width + 1).cast_signed(), [0, steps.into()])
        };
        Out { duty_a: duty(a, "total_a"), duty_b: duty(b, "total_b"), duty_c: duty(c, "total_c") }
    }
}

crate::base::listed::configured!(SpaceVector: SpaceVectorConfig);

impl Block for SpaceVector {
    const NAME: &'static str = "space_vector";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(SpaceVector);

impl Listed for SpaceVector {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let of = |width, duty_width, steps, sinusoidal| {
            Self::new(SpaceVectorConfig { width, duty_width, steps, sinusoidal })
        };
        Ok(vec![
            ("sinusoidal", of(16, 11, 1250, true)?),
            ("narrow", of(4, 3, 6, false)?),
            ("narrow_sinusoidal", of(5, 4, 13, true)?),
            ("wide", of(18, 12, 4_095, false)?),
        ])
    }
}
