//! The angle of the encoder, or that of an analog sensor.
//!
//! - **Equation**: `angle = delta` where `analog = 0`, else `code` read as two's complement.
//! - **Ports**: `delta` (1,WIDTH-1,0), `code` (0,CODE_WIDTH,0), `analog` (0,1,0) in; `angle` (1,WIDTH-1,0) out.
//! - **Latency**: none, combinational. **Reset**: none. **Overflow**: none, because a code has at most `WIDTH` bits.
//! - **VHDL twin**: `hdl/angle_select.vhd`.
//! - **Source**: the flag `enable_EncoderAngle` in the firmware of EPFL's haptic paddle.
//! - **Differs from the hardware**: none known.

use hpu_signal::{Format, Narrowed, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::circuit::part::{Part, exact};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the selection.
    pub struct In of |block: &AngleSelect| {
        delta: block.angle, "count", "Angle of the encoder";
        code: Format::unsigned(block.code_width), "code", "Angle of the analog sensor, modulo its width";
        analog, "The analog sensor is read";
    }
    /// Outputs of the selection.
    pub struct Out of |block: &AngleSelect| {
        angle: block.angle, "1", "The angle that is read";
    }
}

/// The selection of an angle; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AngleSelect {
    angle: Format,
    code_width: u32,
}

impl AngleSelect {
    /// Returns a selection of angles of `width` bits and codes of `code_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 30, and `code_width` 2 to `width`.
    pub fn new(width: u32, code_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, 2..=30)?;
        within(Self::NAME, "CODE_WIDTH", code_width, 2..=width)?;
        Ok(Self { angle: Format::signed(width), code_width })
    }

    /// Returns the outputs for these inputs.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<i64> {
        in_machine!(true, input, |input| self.made(input)).map(|port| port.word)
    }
}

impl Combinational for AngleSelect {
    #[inline]
    fn made<W: Word>(&self, In { delta, code, analog }: In<W>) -> Out<W> {
        Out { angle: W::select(analog.is_set(), code.wrap(Format::signed(self.code_width)), delta) }
    }
}

crate::base::listed::configured! {
    AngleSelect of |block| {
        "WIDTH": u32 = 14, block.angle.width();
        "CODE_WIDTH": u32 = 12, block.code_width;
    }
}

impl Block for AngleSelect {
    const NAME: &'static str = "angle_select";

    crate::base::block::combinational!(self, input => self.eval(input));
}

impl Part for AngleSelect {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        self.eval(*input).map(exact)
    }
}

impl Listed for AngleSelect {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("narrow", Self::new(5, 3)?), ("as_wide", Self::new(12, 12)?)])
    }
}
