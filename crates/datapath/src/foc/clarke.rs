//! Clarke's transformation: two or three phase currents to the two axes of the stator, with the amplitude of a phase.
//!
//! - **Equation**: of two currents, `alpha = a` and `beta = (a + 2 b) / sqrt(3)`, because the third is `-a - b`. With
//!   `THREE`, `alpha = (2 a - b - c) / 3` and `beta = (b - c) / sqrt(3)`: a part that is common to all three drops out.
//!   The factors are `C = round(2^F / sqrt(3))` and `T = round(2^F / 3)`, over `2^F` with `F = WIDTH + FRAC + 2`. Each
//!   product is exact and rounded once, to the nearest, ties up.
//! - **Ports**: `a`, `b`, `c` (1,WIDTH-1,0) in, `c` is ignored without `THREE`; `alpha`, `beta` (1,WIDTH,FRAC) out, in
//!   the unit of the currents.
//! - **Error**: at most 11/16 of the least significant bit of `alpha` and `beta`: 1/2 of rounding, and at most 3/16 of
//!   the rounded factor, because `|a + 2 b|` is at most `3 2^(WIDTH-1)`. Without `THREE`, `alpha` is exact.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: none, because `alpha` and `beta` are below `2^WIDTH`.
//! - **VHDL twin**: `hdl/clarke.vhd`.
//! - **Source**: Clarke 1943, scaled to equal amplitudes.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::base::words::nearest;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the transformation.
    pub struct In of |block: &Clarke| {
        a: block.current(), "code", "Current of phase a";
        b: block.current(), "code", "Current of phase b";
        c: block.current(), "code", "Current of phase c; ignored without THREE";
    }
    /// Outputs of the transformation.
    pub struct Out of |block: &Clarke| {
        alpha: block.axis(), "code", "Current along phase a";
        beta: block.axis(), "code", "Current across phase a, a quarter of a turn ahead";
    }
}

crate::base::listed::configuration! {
    /// The words of Clarke's transformation.
    pub struct ClarkeConfig {
        /// Width of a current, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Fraction bits of the results.
        frac: u32 = 3, ["FRAC"];
        /// Whether all three currents are measured.
        three: bool = false, ["THREE"];
    }
}

/// Clarke's transformation; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Clarke {
    config: ClarkeConfig,
    /// `C`: `1 / sqrt(3)`.
    root: i128,
}

impl Clarke {
    /// Returns a transformation of these words.
    ///
    /// # Errors
    ///
    /// Returns an error unless a current has 2 to 18 bits and a result 0 to 10 fraction bits.
    pub fn new(config: ClarkeConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, 2..=18)?;
        within(Self::NAME, "FRAC", config.frac, 0..=10)?;
        // No power of two over the root of 3 is a tie, so that the root of the integer rounds as the real one does.
        let twice = (4u128 << (2 * config.factor_frac())) / 3;
        Ok(Self { config, root: (twice.isqrt().div_ceil(2)).cast_signed() })
    }

    fn current(&self) -> Format {
        Format::signed(self.config.width)
    }

    fn axis(&self) -> Format {
        let ClarkeConfig { width, frac, .. } = self.config;
        Format::new(true, width.cast_signed(), frac.cast_signed()).expect("at most 29 bits")
    }

    /// Returns the outputs for these inputs, and which bits were lost to make them.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(true, input, |input| self.made(input))
    }
}

impl ClarkeConfig {
    /// Fraction bits of the factors.
    fn factor_frac(self) -> u32 {
        self.width + self.frac + 2
    }
}

impl Combinational for Clarke {
    #[inline]
    fn made<W: Word>(&self, In { a, b, c }: In<W>) -> Out<W> {
        let frac = self.config.factor_frac();
        let rule = nearest(frac.cast_signed(), self.axis());
        let third = ((1 << frac) + 1) / 3;
        let (along, across) =
            if self.config.three { ((a.shl(1) - b - c) * W::int(third), b - c) } else { (a.shl(frac), a + b.shl(1)) };
        Out { alpha: along.narrow(&rule), beta: (across * W::int(self.root)).narrow(&rule) }
    }
}

crate::base::listed::configured!(Clarke: ClarkeConfig);

impl Block for Clarke {
    const NAME: &'static str = "clarke";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(Clarke);

impl Listed for Clarke {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let of = |width, frac, three| Self::new(ClarkeConfig { width, frac, three });
        Ok(vec![
            ("three", of(12, 3, true)?),
            ("narrow", of(4, 0, false)?),
            ("narrow_three", of(4, 1, true)?),
            ("wide", of(18, 10, false)?),
            ("wide_three", of(18, 10, true)?),
        ])
    }
}
