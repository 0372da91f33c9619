//! The unilateral wall, which pushes and never pulls.
//!
//! - **Equation**: operator E of Vasudevan et al. 2007, Eq. (1): `E(x) = 1` for `x <= 0`, else 0, with
//!   `x = theta_ref - theta = -delta`, the reading that agrees with its Eq. (7).
//! - **Ports**: `delta` (1,WIDTH-1,0) in; `contact` (0,1,0) = 1 when `delta >= 0`, `penetration` (0,WIDTH,0) = `delta`
//!   in contact, else 0, out.
//! - **Latency**: none, combinational. **Reset**: none. **Overflow**: none.
//! - **VHDL twin**: `hdl/unilateral.vhd`.
//! - **Source**: Vasudevan et al. 2007, Eqs. (1), (7).
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Word};

use crate::base::config::{WORD, within};
use crate::base::listed::Listed;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the operator.
    pub struct In of |block: &Unilateral| {
        delta: Format::signed(block.width), "count", "Displacement from the reference";
    }
    /// Outputs of the operator.
    pub struct Out of |block: &Unilateral| {
        contact, "At or behind the wall's surface";
        penetration: Format::unsigned(block.width), "count", "Depth behind the wall's surface";
    }
}

/// The operator of the unilateral wall; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Unilateral {
    width: u32,
}

impl Unilateral {
    /// Returns an operator on words of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62.
    pub fn new(width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        Ok(Self { width })
    }

    /// Returns the outputs for these inputs.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<i64> {
        in_machine!(true, input, |input| self.made(input)).map(|port| port.word)
    }
}

impl Combinational for Unilateral {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let surface = W::int(0);
        Out { contact: W::of_bit(input.delta.at_least(surface)), penetration: input.delta.greater(surface) }
    }
}

crate::base::listed::configured! {
    Unilateral of |block| {
        "WIDTH": u32 = 12, block.width;
    }
}

impl Block for Unilateral {
    const NAME: &'static str = "unilateral";

    crate::base::block::combinational!(self, input => self.eval(input));
}

impl Listed for Unilateral {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8)?)])
    }
}
