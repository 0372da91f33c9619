//! The position word: counts the decoder's steps.
//!
//! - **Equation**: `position := (position + step) mod 2^WIDTH`.
//! - **Ports**: `step` (1,1,0) in; `position` (0,WIDTH,0) out.
//! - **Latency**: 1 edge.
//! - **Reset**: 0. **Overflow**: wraps; `displacement` reads through the wrap. A step of -2 counts -2.
//! - **VHDL twin**: `hdl/position_counter.vhd`.
//! - **Source**: Vasudevan et al. 2007: 12 bits, 4 x 1024 lines, one wrap a motor revolution.
//! - **Differs from the hardware**: no index pulse and no preset, so zero is wherever the handle was at reset.

use hpu_signal::{Format, Machine, Word};

use crate::base::config::{WORD, within};
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the counter.
    pub struct In of |_: &PositionCounter| {
        step: Format::signed(2), "count", "Motion to be added";
    }
    /// Outputs of the counter.
    pub struct Out of |block: &PositionCounter| {
        position: block.format, "count", "Position since reset, modulo its width";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PositionCounter {
    format: Format,
    position: i64,
}

impl PositionCounter {
    /// Returns a counter of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62.
    pub fn new(width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        Ok(Self { format: Format::unsigned(width), position: 0 })
    }
}

impl PositionCounter {
    /// Sets the counter to a position, which no step can do.
    pub(crate) fn load(&mut self, position: i64) -> i64 {
        self.position = self.format.wrap(position.into());
        self.position
    }
}

impl PositionCounter {
    #[inline]
    fn counted<W: Word>(&self, position: W, step: W) -> W {
        (position + step).wrap(self.format)
    }
}

impl Step for PositionCounter {
    fn registers(&self) -> Vec<Register> {
        vec![Register::new("position", self.format)]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let position = registers[0];
        (vec![self.counted(position, input.step)], Out { position })
    }
}

crate::base::listed::configured! {
    PositionCounter of |block| {
        "WIDTH": u32 = 12, block.format.width();
    }
}

impl Block for PositionCounter {
    const NAME: &'static str = "position_counter";
    crate::base::block::clocked!();

    fn counts(&self) -> Option<&'static str> {
        Some("position")
    }

    fn reset(&mut self) -> Out<i64> {
        self.position = 0;
        Out { position: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.position = self.counted(Machine::<i64>::of(self.position), Machine::of(input.step)).narrowed().word;
        Out { position: self.position }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if input.step == 0 { u64::MAX } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
    }
}

impl Listed for PositionCounter {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8)?), ("32_bit", Self::new(32)?)])
    }
}
