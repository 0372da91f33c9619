//! The position of the encoder's counter, or that of an absolute sensor.
//!
//! - **Equation**: `position = count` where `coded = 0`, else `code`.
//! - **Ports**: `count`, `code` (0,WIDTH,0), `coded` (0,1,0) in; `position` (0,WIDTH,0) out.
//! - **Latency**: none, combinational. **Reset**: none. **Overflow**: none.
//! - **VHDL twin**: `hdl/position_select.vhd`.
//! - **Source**: none needed.
//! - **Differs from the hardware**: no propagation delay.

use hpu_signal::{Format, Narrowed, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::circuit::part::{Part, exact};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError};

hpu_signal::ports! {
    /// Inputs of the selection.
    pub struct In of |block: &PositionSelect| {
        count: block.position, "count", "Position of the encoder, modulo its width";
        code: block.position, "code", "Position of the absolute sensor, modulo its width";
        coded, "The absolute sensor is read";
    }
    /// Outputs of the selection.
    pub struct Out of |block: &PositionSelect| {
        position: block.position, "count", "The position that is read, modulo its width";
    }
}

/// The selection of a position; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PositionSelect {
    position: Format,
}

impl PositionSelect {
    /// Returns a selection of positions of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 32.
    pub fn new(width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, 2..=32)?;
        Ok(Self { position: Format::unsigned(width) })
    }

    /// Returns the outputs for these inputs.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<i64> {
        in_machine!(true, input, |input| self.made(input)).map(|port| port.word)
    }
}

impl Combinational for PositionSelect {
    #[inline]
    fn made<W: Word>(&self, In { count, code, coded }: In<W>) -> Out<W> {
        Out { position: W::select(coded.is_set(), code, count) }
    }
}

crate::base::listed::configured! {
    PositionSelect of |block| {
        "WIDTH": u32 = 16, block.position.width();
    }
}

impl Block for PositionSelect {
    const NAME: &'static str = "position_select";

    crate::base::block::combinational!(self, input => self.eval(input));
}

impl Part for PositionSelect {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        self.eval(*input).map(exact)
    }
}

impl Listed for PositionSelect {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("narrow", Self::new(4)?)])
    }
}
