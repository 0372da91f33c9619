//! Takes the counts of three joints together once a sample period.
//!
//! - **Equation**: `count_i(t) = position_i(kT)` for `kT <= t < (k+1)T`, read as two's complement.
//! - **Ports**: `position1` `position2` `position3` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1,
//!   in; `count1` `count2` `count3` (1,WIDTH-1,0) out.
//! - **Latency**: 1 edge after a sample edge, up to `period`.
//! - **Edge**: with the countdown at 0, the counts are taken and the countdown restarts at `max(period,1) - 1`; else it
//!   counts down.
//! - **Reset**: counts and countdown 0, so that the first edge samples. **Overflow**: none.
//! - **VHDL twin**: `hdl/sample_register.vhd`.
//! - **Source**: the sampled loop of Sevcik et al. 2009.
//! - **Differs from the hardware**: samples exactly every period, without jitter.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::Countdown;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the register.
    pub struct In of |block: &SampleRegister| {
        position1: Format::unsigned(block.count.width()), "count", "Position of joint 1, modulo its width";
        position2: Format::unsigned(block.count.width()), "count", "Position of joint 2, modulo its width";
        position3: Format::unsigned(block.count.width()), "count", "Position of joint 3, modulo its width";
        period: block.period, "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the register.
    pub struct Out of |block: &SampleRegister| {
        count1: block.count, "count", "Position of joint 1 at the latest sample edge";
        count2: block.count, "count", "Position of joint 2 at the latest sample edge";
        count3: block.count, "count", "Position of joint 3 at the latest sample edge";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SampleRegister {
    count: Format,
    period: Format,
    countdown: Countdown,
    out: Out<i64>,
}

impl SampleRegister {
    /// Returns a register of counts of `width` bits, with a period of `period_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62 and `period_width` 2 to 30.
    pub fn new(width: u32, period_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        Ok(Self {
            count: Format::signed(width),
            period: Format::unsigned(period_width),
            countdown: Countdown::default(),
            out: Out { count1: 0, count2: 0, count3: 0 },
        })
    }

    /// Returns the counts that a sample edge would load now.
    #[inline]
    fn sample(&self, input: &In<i64>) -> Out<i64> {
        let In { position1, position2, position3, .. } = *input;
        Out { count1: position1, count2: position2, count3: position3 }.map(|word| self.count.wrap(word.into()))
    }
}

impl Step for SampleRegister {
    fn registers(&self) -> Vec<Register> {
        let count = |name| Register::new(name, self.count);
        vec![Register::new("countdown", self.period), count("count1"), count("count2"), count("count3")]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [left, count1, count2, count3] = *registers else { unreachable!("four registers") };
        let (left, samples) = counted_down(left, input.period);
        let counts = || [input.position1, input.position2, input.position3].map(|word| word.wrap(self.count));
        let [next1, next2, next3] = W::branch(samples, counts, || [count1, count2, count3]);
        (vec![left, next1, next2, next3], Out { count1, count2, count3 })
    }
}

crate::base::listed::configured! {
    SampleRegister of |block| {
        "WIDTH": u32 = 16, block.count.width();
        "PERIOD_WIDTH": u32 = 24, block.period.width();
    }
}

impl Block for SampleRegister {
    const NAME: &'static str = "sample_register";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.out = Out { count1: 0, count2: 0, count3: 0 };
        self.out
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.out = self.sample(&input);
        }
        self.out
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if self.sample(input) == self.out { u64::MAX } else { self.countdown.left() }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

crate::circuit::part::registers!(SampleRegister);

impl Listed for SampleRegister {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8, 6)?)])
    }
}
