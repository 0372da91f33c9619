//! The velocity of the fixed-position method: the sample period divided by the time between two counts.

use hpu_signal::{Format, Narrowed, Word};

use crate::base::countdown::{Countdown, edges};
use crate::base::sequence::captures;
use crate::{
    Block, ConfigError, DividerConfig, EdgeTimer, Register, SequentialDivider, Step, arithmetic::sequential_divider,
    velocity::edge_timer,
};

/// An `edge_timer` and a `sequential_divider` that divides the sample period by the timer's interval, once a period.
/// The quotient is the velocity in counts per period.
///
/// A sample edge captures period and interval. The next edge starts the division, and the edge that sees the quotient
/// ready loads it with its sign. Until then, further sample edges are ignored. The emulator computes the quotient at
/// the capture and shows it `latency` edges later; the velocity is cycle-exact.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct TimedVelocity {
    timer: EdgeTimer,
    divider: SequentialDivider,
    /// The widths of its division.
    division: DividerConfig,
    /// Number of edges from a capture to the load of its velocity.
    latency: u64,
    countdown: Countdown,
    /// Edges until the velocity is loaded; 0 when no division is running.
    left: u64,
    next: Narrowed,
    latest: Narrowed,
}

const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl TimedVelocity {
    pub(crate) fn new(width: u32, period_width: u32, frac: u32) -> Result<Self, ConfigError> {
        let config =
            DividerConfig { num_width: period_width + 1, den_width: period_width, frac, out_width: width - 1 + frac };
        Ok(Self {
            timer: EdgeTimer::new(width, period_width)?,
            divider: SequentialDivider::new(config)?,
            division: config,
            latency: u64::from(config.steps()) + 2,
            countdown: Countdown::default(),
            left: 0,
            next: ZERO,
            latest: ZERO,
        })
    }

    /// Returns its registers inside a law: its own, those of the timer and those of the divider.
    pub(crate) fn registers(&self) -> Vec<Register> {
        let DividerConfig { num_width, den_width, out_width, .. } = self.division;
        let mut all = vec![
            Register::new("g_timer_sample_countdown", Format::unsigned(den_width)),
            Register::new("g_timer_start", Format::BIT),
            Register::new("g_timer_num", Format::unsigned(num_width)),
            Register::new("g_timer_den", Format::unsigned(den_width)),
            Register::new("g_timer_sample_upwards", Format::BIT),
            Register::new("g_timer_sample_standing", Format::BIT),
            Register::new("velocity", Format::signed(out_width + 1)),
        ];
        all.extend(Register::inside("g_timer_timer", &self.timer));
        all.extend(Register::inside("g_timer_divider", &self.divider));
        all
    }

    /// Computes the registers after an edge, and the velocity before it, in words.
    pub(crate) fn step<W: Word>(&self, registers: &[W], position: W, period: W) -> (Vec<W>, W) {
        let [left, start, num, den, upwards, standing, velocity, ref inside @ ..] = *registers else {
            unreachable!("registers")
        };
        let (timer, divider) = inside.split_at(Step::registers(&self.timer).len());
        let (timing, timed) = self.timer.step(timer, edge_timer::In { position });
        let (dividing, made) = self.divider.step(divider, sequential_divider::In { start, num, den });
        let moved = || [W::select(upwards.is_set(), made.quotient, -made.quotient)];
        let loaded = || W::branch(standing.is_set(), || [W::int(0)], moved);
        let [next] = W::branch(made.ready.is_set(), loaded, || [velocity]);
        let (left, captures) = captures(left, period, [start, made.busy, made.ready]);
        let captured = || [period, timed.interval, timed.forward, timed.stopped];
        let [num, den, upwards, standing] = W::branch(captures, captured, || [num, den, upwards, standing]);
        let own = [left, W::of_bit(captures), num, den, upwards, standing, next];
        ([&own[..], &timing, &dividing].concat(), velocity)
    }

    pub(crate) fn reset(&mut self) {
        self.timer.reset();
        self.countdown = Countdown::default();
        self.left = 0;
        (self.next, self.latest) = (ZERO, ZERO);
    }

    #[inline]
    pub(crate) fn latest(&self) -> Narrowed {
        self.latest
    }

    /// Returns the velocity that a capture at this edge leads to.
    #[inline]
    fn capture(&self, period: i64) -> Narrowed {
        let edge_timer::Out { interval, forward, stopped } = self.timer.shown();
        if stopped == 1 {
            return ZERO;
        }
        let quotient = self.divider.divide(period, interval);
        Narrowed { word: if forward == 1 { quotient.word } else { -quotient.word }, ..quotient }
    }

    #[inline]
    pub(crate) fn tick(&mut self, position: i64, period: i64) {
        let sample = self.countdown.tick(period);
        if self.left > 0 {
            self.left -= 1;
            if self.left == 0 {
                self.latest = self.next;
            }
        } else if sample {
            self.next = self.capture(period);
            self.left = self.latency;
        }
        self.timer.tick(edge_timer::In { position });
    }

    #[inline]
    pub(crate) fn quiet(&self, position: i64) -> u64 {
        let on_its_way = self.left > 0;
        let stands = !on_its_way || self.next == self.latest;
        if stands && self.latest == ZERO && self.timer.at_rest(position) {
            u64::MAX
        } else if on_its_way {
            // The next capture after this load takes another `latency` edges to show its velocity.
            if stands { self.left + self.latency } else { self.left - 1 }
        } else {
            self.countdown.left() + self.latency
        }
    }

    /// Ticks `count` edges at which the position does not change and nothing is captured.
    #[inline]
    fn pass(&mut self, count: u64, period: i64) {
        self.countdown.skip(count, period);
        self.timer.rest(count);
        if self.left > 0 {
            self.left = self.left.saturating_sub(count);
            if self.left == 0 {
                self.latest = self.next;
            }
        }
    }

    /// Returns the number of edges before the next capture, while the period stays.
    #[inline]
    fn until_capture(&self, period: i64) -> u64 {
        let (first, period) = (self.countdown.left(), edges(period));
        first + self.left.saturating_sub(first).div_ceil(period) * period
    }

    #[inline]
    pub(crate) fn skip(&mut self, count: u64, position: i64, period: i64) {
        if count == 0 {
            return;
        }
        // The position may have changed before the first edge; after it the position stays.
        self.tick(position, period);
        let mut count = count - 1;
        let until_capture = self.until_capture(period);
        if count > until_capture {
            self.pass(until_capture, period);
            self.tick(position, period);
            count -= until_capture + 1;
            // A longer quiet stretch can only be at standstill: every capture then yields 0, so whole rounds are
            // skipped.
            let round = self.until_capture(period) + 1;
            self.timer.rest(count - count % round);
            count %= round;
        }
        self.pass(count, period);
    }
}
