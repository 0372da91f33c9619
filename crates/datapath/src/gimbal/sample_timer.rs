//! Marks the edges at which other blocks sample.
//!
//! - **Equation**: `sample` is 1 for one edge in every `period`.
//! - **Ports**: `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `sample` (0,1,0) out.
//! - **Latency**: 1 edge.
//! - **Edge**: with the countdown at 0, `sample` rises and the countdown restarts at `max(period,1) - 1`; else `sample`
//!   falls and the countdown counts down. A new period takes effect when `sample` next rises.
//! - **Reset**: countdown and `sample` 0. `sample` rises at the first edge, so that other blocks sample at the second.
//! - **Overflow**: none.
//! - **VHDL twin**: `hdl/sample_timer.vhd`.
//! - **Source**: the sampled loop of Pediredla et al., at 1 kHz.
//! - **Differs from the hardware**: samples exactly every period, without jitter.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the timer.
    pub struct In of |block: &SampleTimer| {
        period: block.period, "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the timer.
    pub struct Out of |_: &SampleTimer| {
        sample, "The next edge samples";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SampleTimer {
    period: Format,
    countdown: Countdown,
    sample: i64,
}

impl SampleTimer {
    /// Returns a timer with a period of `period_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `period_width` is 2 to 30.
    pub fn new(period_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        Ok(Self { period: Format::unsigned(period_width), countdown: Countdown::default(), sample: 0 })
    }
}

impl Step for SampleTimer {
    fn registers(&self) -> Vec<Register> {
        vec![Register::new("countdown", self.period), Register::new("sample", Format::BIT)]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [left, sample] = *registers else { unreachable!("two registers") };
        let (left, samples) = counted_down(left, input.period);
        (vec![left, W::of_bit(samples)], Out { sample })
    }
}

crate::base::listed::configured! {
    SampleTimer of |block| {
        "PERIOD_WIDTH": u32 = 24, block.period.width();
    }
}

impl Block for SampleTimer {
    const NAME: &'static str = "sample_timer";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        (self.countdown, self.sample) = (Countdown::default(), 0);
        Out { sample: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.sample = self.countdown.tick(input.period).into();
        Out { sample: self.sample }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        match (self.sample, self.countdown.left()) {
            (0, left) => left,
            (_, 0) if edges(input.period) == 1 => u64::MAX,
            (_, 0) => 1,
            _ => 0,
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

crate::circuit::part::registers!(SampleTimer);

impl Listed for SampleTimer {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("6_bit", Self::new(6)?)])
    }
}
