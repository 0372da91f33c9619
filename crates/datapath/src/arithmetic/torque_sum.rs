//! The sum of spring and damping, inside the wall only.
//!
//! - **Equation**: `torque = spring + damping` if `contact = 1`, else 0. Positive is against the penetration; `damping`
//!   is `+B * velocity`.
//! - **Ports**: `spring` (0,SPRING_WIDTH,0), `damping` (1,DAMPING_WIDTH-1,0), `contact` (0,1,0) in;
//!   `torque` (1,OUT_WIDTH-1,0) out.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: wraps; the default widths cannot overflow.
//! - **VHDL twin**: `hdl/torque_sum.vhd`.
//! - **Source**: Vasudevan et al. 2007, Eqs. (6), (7). Its Eq. (5) reads tau2 + tau3, a slip for tau1 + tau2.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Word};

use crate::base::config::{WORD, within};
use crate::base::listed::Listed;
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the sum.
    pub struct In of |block: &TorqueSum| {
        spring: block.spring, "PWM count", "Torque of the spring";
        damping: block.damping, "PWM count", "Torque of the damper";
        contact, "At or behind the wall's surface";
    }
    /// Outputs of the sum.
    pub struct Out of |block: &TorqueSum| {
        torque: block.torque, "PWM count", "Torque against the penetration";
    }
}

/// The sum of spring and damping; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TorqueSum {
    spring: Format,
    damping: Format,
    torque: Format,
}

impl TorqueSum {
    /// Returns a sum of words with these widths.
    ///
    /// # Errors
    ///
    /// Returns an error unless every width is 2 to 62.
    pub fn new(spring_width: u32, damping_width: u32, out_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "SPRING_WIDTH", spring_width, WORD)?;
        within(Self::NAME, "DAMPING_WIDTH", damping_width, WORD)?;
        within(Self::NAME, "OUT_WIDTH", out_width, WORD)?;
        Ok(Self {
            spring: Format::unsigned(spring_width),
            damping: Format::signed(damping_width),
            torque: Format::signed(out_width),
        })
    }

    /// Returns the outputs for these inputs.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<i64> {
        in_machine!(true, input, |input| self.made(input)).map(|port| port.word)
    }
}

impl Combinational for TorqueSum {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let sum = W::select(input.contact.is_set(), input.spring + input.damping, W::int(0));
        Out { torque: sum.wrap(self.torque) }
    }
}

crate::base::listed::configured! {
    TorqueSum of |block| {
        "SPRING_WIDTH": u32 = 12, block.spring.width();
        "DAMPING_WIDTH": u32 = 13, block.damping.width();
        "OUT_WIDTH": u32 = 14, block.torque.width();
    }
}

impl Block for TorqueSum {
    const NAME: &'static str = "torque_sum";

    crate::base::block::combinational!(self, input => self.eval(input));
}

impl Listed for TorqueSum {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![
            ("8_bit", Self::new(8, 9, 10)?),
            ("wrap", Self::new(8, 9, 8)?),
            ("narrow_damping", Self::new(8, 5, 8)?),
            ("narrow_spring", Self::new(5, 9, 8)?),
        ])
    }
}
