//! Difference of the position over a window of several samples.
//!
//! - **Equation**: `velocity(k) = position(k) - position(k-WINDOW)`, modulo `2^WIDTH` as two's complement; positions
//!   before the first sample count as 0.
//! - **Ports**: `position` (0,WIDTH,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `velocity`
//!   (1,WIDTH-1,0) out, in counts per window.
//! - **Latency**: 1 edge after a sample edge, up to `period`; the velocity is that of half a window ago.
//! - **Edge**: with the countdown at 0, `velocity` is loaded, the positions move on, and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down. A new period takes effect at the next sample edge.
//! - **Reset**: countdown, positions and velocity 0; the first edge samples.
//! - **Overflow**: motion of half the counter's range in one window aliases.
//! - **VHDL twin**: `hdl/window_difference.vhd`.
//! - **Source**: the fixed-time method over several samples; resolution of one count a window.
//! - **Differs from the hardware**: none known.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::history::History;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the estimator.
    pub struct In of |block: &WindowDifference| {
        position: Format::unsigned(block.difference.width()), "count", "Position, modulo its width";
        period: block.period, "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the estimator.
    pub struct Out of |block: &WindowDifference| {
        velocity: block.difference, "count/window", "Motion in the latest window";
    }
}

/// A difference over a window of samples; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WindowDifference {
    difference: Format,
    period: Format,
    countdown: Countdown,
    history: History,
    velocity: i64,
}

impl WindowDifference {
    /// Returns a difference of positions of `width` bits over `window` samples, with a period of `period_width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62, `period_width` is 2 to 30, and `window` is 1 to 64.
    pub fn new(width: u32, period_width: u32, window: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        within(Self::NAME, "WINDOW", window, 1..=64)?;
        Ok(Self {
            difference: Format::signed(width),
            period: Format::unsigned(period_width),
            countdown: Countdown::default(),
            history: History::new(window),
            velocity: 0,
        })
    }

    /// Returns the velocity that a future sample edge loads, if `waiting` sample edges with the present position come
    /// before it.
    #[inline]
    fn sample(&self, position: i64, waiting: usize) -> i64 {
        let oldest = self.history.ago(position, waiting, self.history.window());
        self.difference.wrap(i128::from(position - oldest))
    }
}

impl Step for WindowDifference {
    fn registers(&self) -> Vec<Register> {
        let mut all = vec![Register::new("countdown", self.period), Register::new("velocity", self.difference)];
        all.extend(self.history.registers("earlier", self.difference.width()));
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { position, period }: In<W>) -> (Vec<W>, Out<W>) {
        let [left, velocity, ref earlier @ ..] = *registers else { unreachable!("registers") };
        let (left, samples) = counted_down(left, period);
        let oldest = earlier[earlier.len() - 1];
        let moved = || [(position - oldest).wrap(self.difference)];
        let [latest] = W::branch(samples, moved, || [velocity]);
        let mut next = vec![left, latest];
        next.extend(History::pushed(samples, position, earlier));
        (next, Out { velocity })
    }
}

crate::base::listed::configured! {
    WindowDifference of |block| {
        "WIDTH": u32 = 12, block.difference.width();
        "PERIOD_WIDTH": u32 = 24, block.period.width();
        "WINDOW": u32 = 8, block.history.window() as u32;
    }
}

impl Block for WindowDifference {
    const NAME: &'static str = "window_difference";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.history.reset();
        self.velocity = 0;
        Out { velocity: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.velocity = self.sample(input.position, 0);
            self.history.push(input.position, 1);
        }
        Out { velocity: self.velocity }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // After a window of samples with the same position, nothing changes any more.
        let change = (0..=self.history.window()).find(|&waiting| self.sample(input.position, waiting) != self.velocity);
        change.map_or(u64::MAX, |samples| self.countdown.left() + samples as u64 * edges(input.period))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.history.push(input.position, self.countdown.samples(edges, input.period));
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for WindowDifference {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("one_sample", Self::new(8, 6, 1)?), ("5_bit", Self::new(5, 4, 7)?), ("wide", Self::new(62, 4, 64)?)])
    }
}
