//! The distance from the wall's reference, modulo the counter's width: the shorter way round when the counter has
//! wrapped.
//!
//! - **Equation**: `delta = (position - reference) mod 2^WIDTH`, read as two's complement.
//! - **Ports**: `position`, `reference` (0,WIDTH,0) in; `delta` (1,WIDTH-1,0) out.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: wraps on purpose: half a turn and more reads as a distance the other way.
//! - **VHDL twin**: `hdl/displacement.vhd`.
//! - **Source**: Vasudevan et al. 2007, Eq. (2), `theta - theta_ref`.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Word};

use crate::base::config::{WORD, within};
use crate::base::listed::Listed;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the subtraction.
    pub struct In of |block: &Displacement| {
        position: Format::unsigned(block.delta.width()), "count", "Position, modulo its width";
        reference: Format::unsigned(block.delta.width()), "count", "Position of the wall's surface";
    }
    /// Outputs of the subtraction.
    pub struct Out of |block: &Displacement| {
        delta: block.delta, "count", "Displacement from the reference";
    }
}

/// The displacement from the wall's reference; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Displacement {
    delta: Format,
}

impl Displacement {
    /// Returns a subtraction of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62.
    pub fn new(width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        Ok(Self { delta: Format::signed(width) })
    }

    /// Returns the outputs for these inputs.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<i64> {
        in_machine!(true, input, |input| self.made(input)).map(|port| port.word)
    }
}

impl Combinational for Displacement {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        Out { delta: (input.position - input.reference).wrap(self.delta) }
    }
}

crate::base::listed::configured! {
    Displacement of |block| {
        "WIDTH": u32 = 12, block.delta.width();
    }
}

impl Block for Displacement {
    const NAME: &'static str = "displacement";

    crate::base::block::combinational!(self, input => self.eval(input));
}

impl Listed for Displacement {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8)?), ("32_bit", Self::new(32)?)])
    }
}
