//! PID controller with a limited command and a sum that does not wind up.
//!
//! - **Equation**: at a sample edge, with `F = GAIN_FRAC` and `sum` in units of `2^-F`:
//!   `e = target - measured` and `rate = measured - previous`, modulo `2^WIDTH` as two's complement;
//!   `grown = sum + integral e`; `asked = floor((proportional e + grown - derivative rate) / 2^F)`, plus `feed_forward`
//!   with `FORWARDED`; `command = clamp(asked, -LIMIT, LIMIT)`; then `sum` is clamped to `+-LIMIT`:
//!   - without `BACK_CALCULATION`, `sum' = sum` where `asked` is beyond the limit to which `e` pushes, else `grown`;
//!   - with it, `sum' = grown - (asked - command) 2^-BACK`.
//! - **Ports**: `target` and `measured` (1,WIDTH-1,0), `feed_forward` (1,COMMAND_WIDTH-1,0), `proportional`,
//!   `integral` and `derivative` (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as
//!   1, in; `command` (1,COMMAND_WIDTH-1,0) out. The gains are those of a sample: `integral` has the period in it.
//! - **Latency**: 1 edge after a sample edge, up to `period`.
//! - **Edge**: with the countdown at 0, `command`, `sum` and `previous` are loaded and the countdown restarts at
//!   `max(period,1) - 1`; else it counts down.
//! - **Reset**: all 0; the first edge samples, with a `rate` of `measured`.
//! - **Overflow**: the command and the sum clamp; the error and the rate wrap, so that a position may be a counter's.
//!   Words that must not wrap need one more bit.
//! - **VHDL twin**: `hdl/pid.vhd`.
//! - **Source**: the PID controller of the textbooks, whose derivative is that of the measured value, so that a step of
//!   the target makes no kick; both ways against windup as in Åström and Hägglund 1995.
//! - **Differs from the hardware**: three products and their sum take one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{COUNTER, within};
use crate::base::countdown::Countdown;
use crate::base::listed::Listed;
use crate::step::counted_down;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the controller.
    pub struct In of |block: &Pid| {
        target: block.difference, "count", "Wanted value";
        measured: block.difference, "count", "Measured value";
        feed_forward: block.narrowing.to, "1", "Command without an error; ignored without FORWARDED";
        proportional: block.config.gain, "1/count", "Command for an error of one count";
        integral: block.config.gain, "1/count", "Change of the command in a sample for an error of one count";
        derivative: block.config.gain, "1/(count/sample)", "Command for a motion of one count in a sample";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the controller.
    pub struct Out of |block: &Pid| {
        command: block.narrowing.to, "1", "Command of the latest sample edge";
    }
}

crate::base::listed::configuration! {
    /// The widths and modes of a PID controller.
    pub struct PidConfig {
        /// Width of target and measured value, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Format of the gains.
        gain: Format = Format::new(false, 8, 8).expect("16 bits"), ["GAIN_WIDTH", "GAIN_FRAC"];
        /// Width of the command, in bits.
        command_width: u32 = 13, ["COMMAND_WIDTH"];
        /// The greatest command.
        limit: u32 = 4095, ["LIMIT"];
        /// Whether the sum gives back what the limit cuts off; otherwise it stands still there.
        back_calculation: bool = false, ["BACK_CALCULATION"];
        /// Exponent of the share that a sample gives back: `2^-back`.
        back: u32 = 4, ["BACK"];
        /// Whether `feed_forward` is added.
        forwarded: bool = false, ["FORWARDED"];
        /// Width of the period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
    }
}

/// The registers that a sample edge loads, of which the command may have lost bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct State {
    previous: i64,
    sum: i64,
    command: Narrowed,
}

const RESET: State = State { previous: 0, sum: 0, command: Narrowed { word: 0, rounded: false, overflowed: false } };

/// A PID controller; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Pid {
    config: PidConfig,
    difference: Format,
    narrowing: Narrowing,
    countdown: Countdown,
    state: State,
}

impl Pid {
    /// Returns a controller with these widths and modes.
    ///
    /// # Errors
    ///
    /// Returns an error unless the values have 2 to 32 bits, the gains are unsigned with 2 to 24 bits, 0 to 24 of them
    /// fraction bits, the command has 2 to 31 bits that hold the limit, `BACK` is at most the gains' fraction bits, and
    /// the period has 2 to 30 bits.
    pub fn new(config: PidConfig) -> Result<Self, ConfigError> {
        let PidConfig { width, gain, command_width, limit, back, period_width, .. } = config;
        within(Self::NAME, "WIDTH", width, 2..=32)?;
        within(Self::NAME, "GAIN_WIDTH", gain.width(), 2..=24)?;
        let Some(frac) = u32::try_from(gain.frac()).ok().filter(|frac| *frac <= 24 && !gain.is_signed()) else {
            return Err(ConfigError::new(Self::NAME, format!("a gain is {gain}"), "unsigned, 0 to 24 fraction bits"));
        };
        within(Self::NAME, "COMMAND_WIDTH", command_width, 2..=31)?;
        within(Self::NAME, "LIMIT", limit, 1..=(1 << (command_width - 1)) - 1)?;
        within(Self::NAME, "BACK", back, 0..=frac)?;
        within(Self::NAME, "PERIOD_WIDTH", period_width, COUNTER)?;
        let narrowing = Narrowing {
            from_frac: gain.frac(),
            to: Format::signed(command_width),
            rounding: Rounding::Truncate,
            overflow: Overflow::Saturate,
        };
        let difference = Format::signed(width);
        Ok(Self { config, difference, narrowing, countdown: Countdown::default(), state: RESET })
    }

    /// Returns the command, and which bits were lost to make it.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.state.command
    }

    fn frac(&self) -> u32 {
        self.config.gain.frac().unsigned_abs()
    }

    /// Returns the width of every sum in the VHDL: at most 59 bits.
    fn total_width(&self) -> u32 {
        let PidConfig { width, gain, command_width, .. } = self.config;
        (gain.width() + width).max(command_width + self.frac()) + 3
    }

    /// Returns the width of the VHDL's sum of errors.
    fn sum(&self) -> Format {
        Format::signed(self.config.command_width + self.frac())
    }

    /// Computes `sum` and `command` after a sample edge from the measured value before it and `sum` before it.
    #[inline]
    fn made<W: Word>(&self, [previous, sum]: [W; 2], input: &In<W>) -> [W; 2] {
        let PidConfig { width, limit, back_calculation, back, forwarded, .. } = self.config;
        let (frac, total_width, zero) = (self.frac(), self.total_width(), W::int(0));
        let (limit, most) = (i128::from(limit), i128::from(limit) << frac);
        let error = (input.target - input.measured).wrap(self.difference).cut("e", width);
        let rate = (input.measured - previous).wrap(self.difference).cut("rate", width);
        let gained = |gain: W, value: W, name: &str| (gain * value).cut(name, total_width);
        let grown = (sum + gained(input.integral, error, "push")).cut("grown", total_width);
        let pull = gained(input.proportional, error, "pull");
        let drag = gained(input.derivative, rate, "drag");
        let ahead = if forwarded { input.feed_forward.shl(frac) } else { zero };
        let total = (pull + grown - drag + ahead).cut("total", total_width);
        let asked = total.shr(frac);
        let (high, low) = (asked.above(W::int(limit)), W::int(-limit).above(asked));
        let command = total.narrow(&self.narrowing).limit(-limit, limit).overflowing(high | low);
        let next = if back_calculation {
            let excess = asked - asked.limit(-limit, limit);
            (grown - excess.shl(frac - back)).limit(-most, most)
        } else {
            let pushes = (high & error.above(zero)) | (low & zero.above(error));
            W::select(pushes, sum, grown.limit(-most, most))
        };
        [next.shed(), command]
    }

    /// Returns the registers that a sample edge would load now.
    #[inline]
    fn sample(&self, input: &In<i64>) -> State {
        let State { previous, sum, .. } = self.state;
        let before = [previous, sum].map(Machine::<i64>::of);
        let [sum, command] = self.made(before, &input.map(Machine::of)).map(Machine::narrowed);
        State { previous: input.measured, sum: sum.word, command }
    }
}

impl Step for Pid {
    fn registers(&self) -> Vec<Register> {
        vec![
            Register::new("countdown", Format::unsigned(self.config.period_width)),
            Register::new("previous", self.difference),
            Register::new("sum", self.sum()),
            Register::new("command", self.narrowing.to),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [left, previous, sum, command] = *registers else { unreachable!("four registers") };
        let (left, samples) = counted_down(left, input.period);
        let sampled = || {
            let [sum, command] = self.made([previous, sum], &input);
            [input.measured, sum, command]
        };
        let loaded = W::branch(samples, sampled, || [previous, sum, command]);
        ([[left].as_slice(), &loaded].concat(), Out { command })
    }
}

crate::base::listed::configured!(Pid: PidConfig);

impl Block for Pid {
    const NAME: &'static str = "pid";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::default();
        self.state = RESET;
        Out { command: 0 }
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            self.state = self.sample(&input);
        }
        Out { command: self.state.command.word }
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // The sum is no output, but grows from sample to sample.
        if self.sample(input) == self.state { u64::MAX } else { self.countdown.left() }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for Pid {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let gain = |int, frac| Format::new(false, int, frac).expect("at most 24 bits");
        let narrow = PidConfig {
            width: 5,
            gain: gain(2, 2),
            command_width: 6,
            limit: 21,
            back: 1,
            period_width: 4,
            ..PidConfig::default()
        };
        let all = [
            ("narrow", narrow),
            ("back_calculation", PidConfig { back_calculation: true, ..narrow }),
            ("feed_forward", PidConfig { forwarded: true, limit: 31, ..narrow }),
            ("back_and_forward", PidConfig { back_calculation: true, forwarded: true, back: 0, ..narrow }),
            ("whole_gains", PidConfig { gain: gain(4, 0), back: 0, width: 7, ..narrow }),
            ("wide", PidConfig { width: 32, gain: gain(4, 20), command_width: 31, limit: 1_000_000_000, ..narrow }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
