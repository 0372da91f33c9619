//! Takes three commands together once a sample period, a fixed number of edges after the samples that they result from.
//!
//! - **Equation**: `q_i(t) = d_i(kT + DELAY)` for `kT + DELAY <= t < (k+1)T + DELAY`, in edges.
//! - **Ports**: `d1` `d2` `d3` (1,WIDTH-1,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `q1` `q2` `q3`
//!   (1,WIDTH-1,0) out.
//! - **Latency**: 1 edge after a capture, up to `period`.
//! - **Edge**: with the countdown at 0, `q := d` and the countdown restarts at `max(period,1) - 1`; else it counts
//!   down. Released from reset together with a `sample_register` of the same period, it captures `DELAY` edges after
//!   each sample edge; a new period takes effect at the next capture, and with a period above `DELAY` both stay in
//!   step.
//! - **Reset**: `q` 0, countdown `DELAY`. **Overflow**: none.
//! - **VHDL twin**: `hdl/command_register.vhd`.
//! - **Source**: the sampled loop of Sevcik et al. 2009.
//! - **Differs from the hardware**: loads exactly every period, without jitter; the conversion time of the D/A
//!   converter is not in it.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::Countdown;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the register.
    pub struct In of |block: &CommandRegister| {
        d1: block.command, "DAC count", "Command of motor 1 to be taken";
        d2: block.command, "DAC count", "Command of motor 2 to be taken";
        d3: block.command, "DAC count", "Command of motor 3 to be taken";
        period: block.period, "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the register.
    pub struct Out of |block: &CommandRegister| {
        q1: block.command, "DAC count", "Command of motor 1 of the latest capture";
        q2: block.command, "DAC count", "Command of motor 2 of the latest capture";
        q3: block.command, "DAC count", "Command of motor 3 of the latest capture";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CommandRegister {
    command: Format,
    period: Format,
    delay: u32,
    countdown: Countdown,
    out: Out<i64>,
}

impl CommandRegister {
    /// Returns a register of commands of `width` bits, with a period of `period_width` bits, `delay` edges behind the
    /// samples.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62, `period_width` 2 to 30, and `delay` at most `2^16`.
    pub fn new(width: u32, period_width: u32, delay: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        within(Self::NAME, "DELAY", delay, 0..=1 << 16)?;
        Ok(Self {
            command: Format::signed(width),
            period: Format::unsigned(period_width),
            delay,
            countdown: Countdown::after(delay),
            out: Out { q1: 0, q2: 0, q3: 0 },
        })
    }
}

impl Step for CommandRegister {
    fn registers(&self) -> Vec<Register> {
        let bits = self.period.width().max(u32::BITS - self.delay.leading_zeros());
        let countdown = Register::set("countdown", Format::unsigned(bits), self.delay.into());
        let command = |name| Register::new(name, self.command);
        vec![countdown, command("q1"), command("q2"), command("q3")]
    }

    fn step<W: Word>(&self, registers: &[W], In { d1, d2, d3, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, q1, q2, q3] = *registers else { unreachable!("four registers") };
        let (left, samples) = counted_down(left, period);
        let [next1, next2, next3] = W::branch(samples, || [d1, d2, d3], || [q1, q2, q3]);
        (vec![left, next1, next2, next3], Out { q1, q2, q3 })
    }
}

crate::base::listed::configured! {
    CommandRegister of |block| {
        "WIDTH": u32 = 16, block.command.width();
        "PERIOD_WIDTH": u32 = 24, block.period.width();
        "DELAY": u32 = 8, block.delay;
    }
}

impl Block for CommandRegister {
    const NAME: &'static str = "command_register";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::after(self.delay);
        self.out = Out { q1: 0, q2: 0, q3: 0 };
        self.out
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let In { d1, d2, d3, period } = input;
        if self.countdown.tick(period) {
            self.out = Out { q1: d1, q2: d2, q3: d3 };
        }
        self.out
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let In { d1, d2, d3, .. } = *input;
        if self.out == (Out { q1: d1, q2: d2, q3: d3 }) { u64::MAX } else { self.countdown.left() }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

crate::circuit::part::registers!(CommandRegister);

impl Listed for CommandRegister {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8, 6, 3)?), ("delay_0", Self::new(10, 4, 0)?)])
    }
}
