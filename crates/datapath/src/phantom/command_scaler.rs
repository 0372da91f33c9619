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

use hpu_signal::{Format, Narrowed, Signal, Word};

use super::Config;
use super::variants::paths;
use crate::base::config::{NATURAL, within};
use crate::base::listed::{Given, Listed};
use crate::base::words::{accept, limited, natural, parts};
use crate::step::in_machine;
use crate::{Block, Combinational, ConfigError, Generic, Step};

hpu_signal::ports! {
    /// Inputs of the scaler.
    pub struct In { torque, valid1, valid2, valid3 }
}

hpu_signal::ports! {
    /// Outputs of the scaler.
    pub struct Out { command }
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

impl Default for CommandScaler {
    fn default() -> Self {
        let torque = Format::new(true, 3, 20).expect("24 bits");
        Self::new(torque, 220_289, 3, 16).expect("the data sheet's default")
    }
}

impl Block for CommandScaler {
    const NAME: &'static str = "command_scaler";

    fn inputs(&self) -> In<Signal> {
        In {
            torque: Signal::new("torque", self.torque, "N.m", "Torque asked for"),
            valid1: Signal::bit("valid1", "The sine of joint 1 is known"),
            valid2: Signal::bit("valid2", "The sine of joint 2 is known"),
            valid3: Signal::bit("valid3", "The sine of joint 3 is known"),
        }
    }

    fn outputs(&self) -> Out<Signal> {
        Out { command: Signal::new("command", self.command, "DAC count", "Command of the motor") }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let mut all = parts("TORQUE_INT", "TORQUE_FRAC", self.torque).to_vec();
        all.push(natural("GAIN", self.gain));
        all.push(natural("GAIN_FRAC", self.gain_frac));
        all.push(natural("COMMAND_WIDTH", self.command.width()));
        all
    }

    crate::base::block::combinational!(self, input => self.eval(input).map(|port| port.word));
}

crate::circuit::part::telling!(CommandScaler);

impl Listed for CommandScaler {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        let [gain, gain_frac, command_width] = given.naturals(["GAIN", "GAIN_FRAC", "COMMAND_WIDTH"])?;
        Self::new(given.parts(true, "TORQUE")?, gain, gain_frac, command_width)
    }

    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let scaler =
            |config: Config| Self::new(config.formats.torque, config.gains[0], config.gain_frac, config.command_width);
        paths().into_iter().map(|(label, config)| Ok((label, scaler(config)?))).collect()
    }
}
