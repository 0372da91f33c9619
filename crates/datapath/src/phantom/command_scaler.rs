//! Converts a joint torque into a motor command, which is 0 while the sines of any joint are not known.
//!
//! - **Equation**: `command = saturate(round(torque GAIN / 2^GAIN_FRAC))` to a whole DAC count, nearest, ties up, if
//!   all of `valid1` `valid2` `valid3` are set; else 0.
//! - **Ports**: `torque` (1,TORQUE_INT,TORQUE_FRAC) in N.m, `valid1` `valid2` `valid3` in; `command`
//!   (1,COMMAND_WIDTH-1,0) in DAC counts out. `GAIN / 2^GAIN_FRAC` DAC counts per N.m.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: saturates. [`eval`](CommandScaler::eval) tells it.
//! - **VHDL twin**: `hdl/command_scaler.vhd`.
//! - **Source**: the output stage of Sevcik et al. 2009.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock.

use hpu_signal::{Format, Narrowed, Word};

use super::Config;
use super::variants::paths;
use crate::base::config::{NATURAL, within};
use crate::base::listed::Listed;
use crate::base::words::{accept, limited};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Step};

hpu_signal::ports! {
    /// Inputs of the scaler.
    pub struct In of |block: &CommandScaler| {
        torque: block.torque, "N.m", "Torque asked for";
        valid1, "The sine of joint 1 is known";
        valid2, "The sine of joint 2 is known";
        valid3, "The sine of joint 3 is known";
    }
    /// Outputs of the scaler.
    pub struct Out of |block: &CommandScaler| {
        command: block.command, "DAC count", "Command of the motor";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CommandScaler {
    torque: Format,
    gain: u32,
    gain_frac: u32,
    command: Format,
    fits_64: bool,
}

impl CommandScaler {
    /// Returns a scaler of torques by `gain / 2^gain_frac` into commands of `command_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless the torque is signed with 2 to 40 bits, 0 to 30 of them fraction bits, the gain is a
    /// positive VHDL `natural` with at most 30 fraction bits, and `command_width` is 2 to 31.
    pub fn new(torque: Format, gain: u32, gain_frac: u32, command_width: u32) -> Result<Self, ConfigError> {
        accept(Self::NAME, "TORQUE", torque, true)?;
        within(Self::NAME, "GAIN", gain, 1..=NATURAL)?;
        within(Self::NAME, "GAIN_FRAC", gain_frac, 0..=30)?;
        within(Self::NAME, "COMMAND_WIDTH", command_width, 2..=31)?;
        let command = Format::signed(command_width);
        let mut block = Self { torque, gain, gain_frac, command, fits_64: false };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the command, and which bits were lost to make it.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Out<Narrowed> {
        in_machine!(self.fits_64, input, |input| self.made(input))
    }
}

impl Combinational for CommandScaler {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        let valid = input.valid1.is_set() & input.valid2.is_set() & input.valid3.is_set();
        let drop = self.torque.frac() + self.gain_frac.cast_signed();
        let ends = [self.command.min(), self.command.max()];
        let scaled = || [limited(input.torque * W::int(self.gain.into()), drop, ends)];
        let [command] = W::branch(valid, scaled, || [W::int(0)]);
        Out { command }
    }
}

crate::base::listed::configured! {
    CommandScaler of |block| {
        "TORQUE_INT" "TORQUE_FRAC": Format = Format::new(true, 3, 20).expect("24 bits"), block.torque;
        "GAIN": u32 = 220_289, block.gain;
        "GAIN_FRAC": u32 = 3, block.gain_frac;
        "COMMAND_WIDTH": u32 = 16, block.command.width();
    }
}

impl Block for CommandScaler {
    const NAME: &'static str = "command_scaler";

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(CommandScaler);

impl Listed for CommandScaler {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let scaler =
            |config: Config| Self::new(config.formats.torque, config.gains[0], config.gain_frac, config.command_width);
        paths().into_iter().map(|(label, config)| Ok((label, scaler(config)?))).collect()
    }
}
