//! Sample and hold of a word.
//!
//! - **Equation**: `q(t) = d(kT)` for `kT <= t < (k+1)T`.
//! - **Ports**: `d` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `q` (0,WIDTH,0) out.
//! - **Latency**: 1 edge after a sample edge, up to `period`.
//! - **Edge**: with the countdown at 0, `q := d` and the countdown restarts at `max(period,1) - 1`; else it counts
//!   down. Samples on the same edges as a `velocity_register` with the same period.
//! - **Reset**: `q` 0, countdown 0, so that the first edge samples. **Overflow**: none.
//! - **VHDL twin**: `hdl/zero_order_hold.vhd`.
//! - **Source**: the conventional loop that Vasudevan et al. 2007 compare with.
//! - **Differs from the hardware**: samples exactly every period; a controller in software has jitter and a computing
//!   delay.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::Countdown;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the hold.
    pub struct In of |block: &ZeroOrderHold| {
        d: block.word, "count", "Word to be sampled";
        period: block.period, "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the hold.
    pub struct Out of |block: &ZeroOrderHold| {
        q: block.word, "count", "Word of the latest sample edge";
    }
}

/// A zero-order hold; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ZeroOrderHold {
    word: Format,
    period: Format,
    countdown: Countdown,
    q: i64,
}

impl ZeroOrderHold {
    /// Returns a hold of words of `width` bits, with a period of `period_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62 and `period_width` is 2 to 30.
    pub fn new(width: u32, period_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        Ok(Self {
            word: Format::unsigned(width),
            period: Format::unsigned(period_width),
            countdown: Countdown::default(),
            q: 0,
        })
    }
}

impl Step for ZeroOrderHold {
    fn registers(&self) -> Vec<Register> {
        vec![Register::new("countdown", self.period), Register::new("q", self.word)]
    }

    fn step<W: Word>(&self, registers: &[W], In { d, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, q] = *registers else { unreachable!("two registers") };
        let (left, samples) = counted_down(left, period);
        (vec![left, W::select(samples, d, q)], Out { q })
    }
}

crate::base::listed::configured! {
    ZeroOrderHold of |block| {
        "WIDTH": u32 = 12, block.word.width();
        "PERIOD_WIDTH": u32 = 24, block.period.width();
    }
}

impl Block for ZeroOrderHold {
    const NAME: &'static str = "zero_order_hold";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.q = 0;
        Out { q: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.q = input.d;
        }
        Out { q: self.q }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if input.d == self.q { u64::MAX } else { self.countdown.left() }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for ZeroOrderHold {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("8_bit", Self::new(8, 6)?)])
    }
}
