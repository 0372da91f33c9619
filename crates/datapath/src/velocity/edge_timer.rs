//! The time between two counts: the fixed-position method of measuring a speed.
//!
//! - **Equation**: `interval` = edges between the two latest changes of the position, if both went the same way; the
//!   speed is `f_clock / interval` counts per second.
//! - **Ports**: `position` (0,WIDTH,0) in; `interval` (0,TIME_WIDTH,0) in clocks, `forward`, `stopped` (0,1,0) out.
//! - **Latency**: 1 edge.
//! - **Edge**: a timer counts the edges since the latest change and saturates at all ones; with `timer` as it stood
//!   before the edge and `d` the motion, modulo `2^WIDTH` as two's complement, that the edge sees:
//!   - `d /= 0` and the same way as the latest change: `interval := timer + 1`, `stopped := 0`; another way, or the
//!     first change since reset or since the timer ran out: `interval` all ones, `stopped := 1`. Either way
//!     `forward := d > 0` and the timer restarts. A motion of several counts is one change.
//!   - `d = 0`: the timer goes on. Once `timer + 1` exceeds the interval the next count is overdue and `interval :=
//!     timer + 1`; when the timer reaches all ones it has run out: `interval` all ones, `stopped := 1`.
//! - **Reset**: `interval` all ones, `stopped` 1, `forward` 0, timer and previous position 0.
//! - **Overflow**: none.
//! - **VHDL twin**: `hdl/edge_timer.vhd`.
//! - **Source**: the fixed-position method (Belanger 1992); timeout and reversal as every such timer needs them.
//! - **Differs from the hardware**: none known.

use hpu_signal::{Format, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the timer.
    pub struct In of |block: &EdgeTimer| {
        position: Format::unsigned(block.difference.width()), "count", "Position, modulo its width";
    }
    /// Outputs of the timer.
    pub struct Out of |block: &EdgeTimer| {
        interval: block.time, "clock", "Time of one count; all ones if unknown";
        forward, "The latest change went up";
        stopped, "The interval is unknown: standstill, start or reversal";
    }
}

/// A timer of the edges between two counts; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct EdgeTimer {
    difference: Format,
    time: Format,
    previous: i64,
    timer: i64,
    /// Whether the position has changed since the reset, and the timer has not run out since then.
    moving: bool,
    out: Out<i64>,
}

impl EdgeTimer {
    /// Returns a timer of `time_width` bits for a position of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 2 to 62 and `time_width` is 2 to 30.
    pub fn new(width: u32, time_width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, WORD)?;
        within(Self::NAME, "TIME_WIDTH", time_width, COUNTER)?;
        let (difference, time) = (Format::signed(width), Format::unsigned(time_width));
        let out = Out { interval: time.wrap(time.max()), forward: 0, stopped: 1 };
        Ok(Self { difference, time, previous: 0, timer: 0, moving: false, out })
    }

    /// Returns the longest time that the timer can hold, in edges.
    #[inline]
    fn longest(&self) -> i64 {
        self.time.wrap(self.time.max())
    }

    /// Returns the outputs as they stand.
    #[inline]
    pub(crate) fn shown(&self) -> Out<i64> {
        self.out
    }

    /// Whether the timer has run out and `position` is the previous one, so that nothing changes while the position
    /// stays.
    #[inline]
    pub(crate) fn at_rest(&self, position: i64) -> bool {
        position == self.previous && self.out.stopped == 1
    }

    /// Ticks `edges` edges at which the position does not change; the outputs may change at them.
    #[inline]
    pub(crate) fn rest(&mut self, edges: u64) {
        let left = (self.longest() - self.timer).unsigned_abs();
        if edges < left {
            self.timer += edges.cast_signed();
            self.out.interval = self.out.interval.max(self.timer);
        } else if edges > 0 {
            self.timer = self.longest();
            self.stop();
        }
    }

    /// Stops the timer because it has run out.
    #[inline]
    fn stop(&mut self) {
        self.moving = false;
        self.out = Out { interval: self.longest(), stopped: 1, ..self.out };
    }
}

/// Registers as in the VHDL: a timer at its longest time has no change to measure from.
impl Step for EdgeTimer {
    fn registers(&self) -> Vec<Register> {
        let (position, longest) = (Format::unsigned(self.difference.width()), self.longest());
        vec![
            Register::new("previous", position),
            Register::set("timer", self.time, longest),
            Register::set("interval", self.time, longest),
            Register::new("forward", Format::BIT),
            Register::set("stopped", Format::BIT, 1),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], In { position }: In<W>) -> (Vec<W>, Out<W>) {
        let [previous, timer, interval, forward, stopped] = *registers else { unreachable!("five registers") };
        let (zero, one, longest) = (W::int(0), W::int(1), W::int(self.longest().into()));
        let difference = (position - previous).wrap(self.difference);
        let goes_up = W::of_bit(difference.at_least(zero));
        let is_timed = !timer.equals(longest);
        let passed = W::select(is_timed, timer + one, timer).wrap(self.time);
        let known = is_timed & forward.equals(goes_up);
        let changed = || [zero, W::select(known, passed, longest), goes_up, W::of_bit(!known)];
        let rests = || {
            let has_stopped = W::select(passed.equals(longest), one, stopped);
            [passed, interval.greater(passed), forward, has_stopped]
        };
        let [timer, next_interval, next_forward, next_stopped] = W::branch(difference.is_set(), changed, rests);
        let next = vec![position, timer, next_interval, next_forward, next_stopped];
        (next, Out { interval, forward, stopped })
    }
}

crate::base::listed::configured! {
    EdgeTimer of |block| {
        "WIDTH": u32 = 12, block.difference.width();
        "TIME_WIDTH": u32 = 20, block.time.width();
    }
}

impl Block for EdgeTimer {
    const NAME: &'static str = "edge_timer";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.previous = 0;
        self.timer = 0;
        self.out.forward = 0;
        self.stop();
        self.out
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let difference = self.difference.wrap(i128::from(input.position - self.previous));
        self.previous = input.position;
        let passed = (self.timer + 1).min(self.longest());
        if difference != 0 {
            let forward = i64::from(difference > 0);
            self.out = if self.moving && forward == self.out.forward {
                Out { interval: passed, forward, stopped: 0 }
            } else {
                Out { interval: self.longest(), forward, stopped: 1 }
            };
            self.moving = true;
            self.timer = 0;
        } else {
            self.timer = passed;
            self.out.interval = self.out.interval.max(passed);
            if passed == self.longest() {
                self.stop();
            }
        }
        self.out
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if input.position != self.previous {
            0
        } else if self.out.stopped == 1 {
            u64::MAX
        } else {
            let shown = self.out.interval.min(self.longest() - 1);
            shown.saturating_sub(self.timer).unsigned_abs()
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.rest(edges);
    }
}

impl Listed for EdgeTimer {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("2_bit", Self::new(2, 2)?), ("short", Self::new(8, 3)?), ("wide", Self::new(48, 30)?)])
    }
}
