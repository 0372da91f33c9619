//! Saturation of a word to the actuator's full scale.
//!
//! - **Equation**: `limited = clamp(value, -LIMIT, +LIMIT)`.
//! - **Ports**: `value` (1,IN_WIDTH-1,0) in; `limited` (1,OUT_WIDTH-1,0) out; `LIMIT < 2^(OUT_WIDTH-1)`.
//! - **Latency**: none, combinational. **Reset**: none. **Overflow**: none, `limited` holds every limited value.
//! - **VHDL twin**: `hdl/saturator.vhd`.
//! - **Source**: Vasudevan et al. 2007, Eq. (8): stall torque at 100 % duty, here on both sides.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Word};

use crate::base::config::{NATURAL, WORD, within};
use crate::base::listed::Listed;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the saturator.
    pub struct In of |block: &Saturator| {
        value: block.value, "PWM count", "Torque asked for";
    }
    /// Outputs of the saturator.
    pub struct Out of |block: &Saturator| {
        limited: block.limited, "PWM count", "Torque within full scale";
    }
}

/// A saturator; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Saturator {
    pub(super) value: Format,
    pub(super) limited: Format,
    pub(super) limit: u32,
}

impl Saturator {
    /// Returns a saturator to `-limit..=limit`.
    ///
    /// # Errors
    ///
    /// Returns an error unless both widths are 2 to 62, and `limit` is a VHDL `natural` below `2^(out_width-1)`.
    pub fn new(in_width: u32, out_width: u32, limit: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "IN_WIDTH", in_width, WORD)?;
        within(Self::NAME, "OUT_WIDTH", out_width, WORD)?;
        let limited = Format::signed(out_width);
        let most = u32::try_from(limited.max()).map_or(NATURAL, |most| most.min(NATURAL));
        within(Self::NAME, "LIMIT", limit, 0..=most)?;
        Ok(Self { value: Format::signed(in_width), limited, limit })
    }

    /// Returns the outputs for these inputs.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<i64> {
        in_machine!(true, input, |input| self.made(input)).map(|port| port.word)
    }
}

impl Combinational for Saturator {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let limit = i128::from(self.limit);
        let limited = input.value.limit(-limit, limit);
        Out { limited: limited.overflowing(!limited.equals(input.value)) }
    }
}

crate::base::listed::configured! {
    Saturator of |block| {
        "IN_WIDTH": u32 = 14, block.value.width();
        "OUT_WIDTH": u32 = 13, block.limited.width();
        "LIMIT": u32 = 4095, block.limit;
    }
}

impl Block for Saturator {
    const NAME: &'static str = "saturator";

    crate::base::block::combinational!(self, input => self.eval(input));
}

impl Listed for Saturator {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(10, 9, 255)?), ("limit_0", Self::new(10, 9, 0)?)])
    }
}
