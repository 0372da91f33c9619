//! First-order filter and PID controller in one sample, with a limited sum and a limited command.
//!
//! - **Equation**: at a sample, with `F = FRAC + GAIN_FRAC`, `y` in units of `2^-FRAC` and `sum` in units of `2^-F`:
//!   `y' = y + floor(share (2^FRAC measured - y) / 2^16)`, `t = 2^(FRAC-TARGET_FRAC) target`, `e = t - y'`;
//!   `sum' = clamp(sum + integral e, -S, S)` with `S = 2^(F-SUM_FRAC) SUM_LIMIT`;
//!   `command = clamp(floor((proportional e + sum' - derivative (y' - y) + forward t) / 2^F), LEAST, MOST)`.
//! - **Ports**: `target` (1,TARGET_WIDTH-1-TARGET_FRAC,TARGET_FRAC), `measured` (1,WIDTH-1,0), `share` (0,0,16),
//!   `proportional`, `integral`, `derivative` and `forward` (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC), `sample` in; `filtered`
//!   (1,WIDTH-1,FRAC), `command` (1,COMMAND_WIDTH-1,0) out. The gains are those of a sample.
//! - **Latency**: 1 edge, at edges with `sample`.
//! - **Reset**: all 0.
//! - **Overflow**: sum and command clamp, each for itself; nothing else can overflow.
//! - **VHDL twin**: `hdl/filtered_pid.vhd`.
//! - **Source**: current and position controller of EPFL's haptic paddle (`torque_regulator.c`, `pid.c`,
//!   `haptic_controller.c`). The sum has a limit of its own, which the limit of the command does not touch, and the
//!   controller sees the filter of the same sample: [`pid`](crate::pid) has neither.
//! - **Differs from the hardware**: the firmware computes in float32; all products take one edge, so no limit on the
//!   clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{NATURAL, within};
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

/// Fraction bits of the filter's share.
pub const SHARE: u32 = 16;

hpu_signal::ports! {
    /// Inputs of the controller.
    pub struct In of |block: &FilteredPid| {
        target: block.config.target, "1", "Wanted value";
        measured: Format::signed(block.config.width), "1", "Measured value";
        share: Format::new(false, 0, SHARE.cast_signed()).expect("16 bits"), "1", "Share of a new value in the filter";
        proportional: block.config.gain, "1", "Command for an error of 1";
        integral: block.config.gain, "1", "Change of the command in a sample for an error of 1";
        derivative: block.config.gain, "1", "Command for a change of 1 in a sample";
        forward: block.config.gain, "1", "Command for a target of 1";
        sample, "The edge samples";
    }
    /// Outputs of the controller.
    pub struct Out of |block: &FilteredPid| {
        filtered: block.value, "1", "Filtered value of the latest sample";
        command: block.narrowing.to, "1", "Command of the latest sample";
    }
}

crate::base::listed::configuration! {
    /// The formats and limits of a controller.
    pub struct FilteredPidConfig {
        /// Width of the measured value, in bits.
        width: u32 = 14, ["WIDTH"];
        /// Fraction bits of the filter.
        frac: u32 = 12, ["FRAC"];
        /// Format of the target.
        target: Format = Format::new(true, 13, 12).expect("26 bits"), ["TARGET_WIDTH", "TARGET_FRAC"];
        /// Format of the gains.
        gain: Format = Format::new(false, 16, 14).expect("30 bits"), ["GAIN_WIDTH", "GAIN_FRAC"];
        /// Width of the command, in bits.
        command_width: u32 = 16, ["COMMAND_WIDTH"];
        /// Least command.
        least: i32 = -24_339, ["LEAST"];
        /// Greatest command.
        most: i32 = 24_339, ["MOST"];
        /// Limit of the sum, in units of `2^-sum_frac` of the command.
        sum_limit: u32 = NATURAL, ["SUM_LIMIT"];
        /// Fraction bits of `sum_limit`.
        sum_frac: u32 = 0, ["SUM_FRAC"];
    }
}

/// The registers that a sample loads.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct State {
    y: i64,
    sum: i64,
    command: Narrowed,
}

const RESET: State = State { y: 0, sum: 0, command: ZERO };

/// A filter with a PID controller; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FilteredPid {
    config: FilteredPidConfig,
    value: Format,
    narrowing: Narrowing,
    fits_64: bool,
    state: State,
}

impl FilteredPid {
    /// Returns a controller with these formats and limits.
    ///
    /// # Errors
    ///
    /// Returns an error unless the measured value has 2 to 24 bits and the filter 0 to 16 fraction bits, the target is
    /// signed with 2 to 40 bits and at most as many fraction bits, the gains are unsigned with 2 to 32 bits, 0 to 30 of
    /// them fraction bits, the command has 2 to 31 bits that hold both limits, the least below the greatest, and the
    /// sum's limit is a VHDL `natural` with no more fraction bits than the sum.
    pub fn new(config: FilteredPidConfig) -> Result<Self, ConfigError> {
        let FilteredPidConfig { width, frac, target, gain, command_width, least, most, sum_limit, sum_frac } = config;
        within(Self::NAME, "WIDTH", width, 2..=24)?;
        within(Self::NAME, "FRAC", frac, 0..=16)?;
        let fits = (0..=frac.cast_signed()).contains(&target.frac()) && (2..=40).contains(&target.width());
        if !fits || !target.is_signed() {
            let accepted = format!("signed, 2 to 40 bits, 0 to {frac} of them fraction bits");
            return Err(ConfigError::new(Self::NAME, format!("target is {target}"), accepted));
        }
        let fits = (0..=30).contains(&gain.frac()) && (2..=32).contains(&gain.width());
        if !fits || gain.is_signed() {
            let accepted = "unsigned, 2 to 32 bits, 0 to 30 of them fraction bits";
            return Err(ConfigError::new(Self::NAME, format!("a gain is {gain}"), accepted));
        }
        within(Self::NAME, "COMMAND_WIDTH", command_width, 2..=31)?;
        let command = Format::signed(command_width);
        if !command.holds(least.into()) || !command.holds(most.into()) || least >= most {
            let accepted = format!("LEAST < MOST, both {} to {}", command.min(), command.max());
            return Err(ConfigError::new(Self::NAME, format!("LEAST is {least}, MOST is {most}"), accepted));
        }
        let from_frac = frac.cast_signed() + gain.frac();
        within(Self::NAME, "SUM_LIMIT", sum_limit, 0..=NATURAL)?;
        // The sum has at most 62 bits.
        let most_frac = from_frac.cast_unsigned();
        within(Self::NAME, "SUM_FRAC", sum_frac, most_frac.saturating_sub(30)..=most_frac)?;
        let value = Format::new(true, width.cast_signed() - 1, frac.cast_signed()).expect("at most 40 bits");
        let narrowing =
            Narrowing { from_frac, to: command, rounding: Rounding::Truncate, overflow: Overflow::Saturate };
        let mut block = Self { config, value, narrowing, fits_64: false, state: RESET };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the outputs, and which bits were lost to make them.
    #[inline]
    pub fn latest(&self) -> Out<Narrowed> {
        let State { y, command, .. } = self.state;
        Out { filtered: Narrowed { word: y, ..ZERO }, command }
    }

    fn shown(&self) -> Out<i64> {
        Out { filtered: self.state.y, command: self.state.command.word }
    }

    /// Returns the fraction bits of the sum.
    fn fraction(&self) -> u32 {
        self.narrowing.from_frac.cast_unsigned()
    }

    /// Returns the width of the error in the VHDL.
    fn error_width(&self) -> u32 {
        let FilteredPidConfig { frac, target, .. } = self.config;
        (target.width() + frac - target.frac().cast_unsigned()).max(self.value.width()) + 1
    }

    fn sum(&self) -> Format {
        Format::signed(32 + self.fraction() - self.config.sum_frac)
    }

    /// Returns the width of the products and their sum in the VHDL.
    fn total_width(&self) -> u32 {
        (self.config.gain.width() + self.error_width() + 1).max(self.sum().width()) + 3
    }

    /// Computes `y`, `sum` and `command` after a sample.
    #[inline]
    fn made<W: Word>(&self, [y, sum]: [W; 2], input: &In<W>) -> [W; 3] {
        let FilteredPidConfig { frac, target, least, most, sum_limit, sum_frac, .. } = self.config;
        let (error_width, total_width) = (self.error_width(), self.total_width());
        let gap = (input.measured.shl(frac) - y).cut("gap", self.value.width() + 1);
        let moved = (input.share * gap).cut("moved", self.value.width() + 1 + SHARE + 1);
        let next = (y + moved.shr(SHARE)).wrap(self.value).cut("next_y", self.value.width());
        let aim = input.target.shl((frac.cast_signed() - target.frac()).cast_unsigned());
        let error = (aim - next).cut("e", error_width);
        let rate = (next - y).cut("rate", error_width);
        let gained = |gain: W, value: W, name: &str| (gain * value).cut(name, total_width);
        let limit = i128::from(sum_limit) << (self.fraction() - sum_frac);
        let pushed = (sum + gained(input.integral, error, "push")).cut("pushed", total_width);
        let grown = pushed.limit(-limit, limit).cut("grown", total_width);
        let pull = gained(input.proportional, error, "pull");
        let drag = gained(input.derivative, rate, "drag");
        let ahead = gained(input.forward, aim, "ahead");
        let total = (pull + grown - drag + ahead).cut("total", total_width);
        let asked = total.shr(self.fraction());
        let beyond = asked.above(W::int(most.into())) | W::int(least.into()).above(asked);
        let command = total.narrow(&self.narrowing).limit(least.into(), most.into()).overflowing(beyond);
        [next.shed(), grown.shed(), command]
    }

    /// Returns the registers that a sample would load now.
    #[inline]
    fn sample(&self, input: &In<i64>) -> State {
        let before = [self.state.y, self.state.sum];
        let [y, sum, command] = if self.fits_64 {
            self.made(before.map(Machine::<i64>::of), &input.map(Machine::of)).map(Machine::narrowed)
        } else {
            self.made(before.map(Machine::<i128>::of), &input.map(Machine::of)).map(Machine::narrowed)
        };
        State { y: y.word, sum: sum.word, command }
    }
}

impl Step for FilteredPid {
    fn registers(&self) -> Vec<Register> {
        vec![
            Register::new("y", self.value),
            Register::new("sum", self.sum()),
            Register::new("command", self.narrowing.to),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [y, sum, command] = *registers else { unreachable!("three registers") };
        let next = W::branch(input.sample.is_set(), || self.made([y, sum], &input), || [y, sum, command]);
        (next.to_vec(), Out { filtered: y, command })
    }
}

crate::base::listed::configured!(FilteredPid: FilteredPidConfig);

impl Block for FilteredPid {
    const NAME: &'static str = "filtered_pid";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.state = RESET;
        self.shown()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if input.sample != 0 {
            self.state = self.sample(&input);
        }
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // The sum is no output, but grows from sample to sample.
        if input.sample == 0 || self.sample(input) == self.state { u64::MAX } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
    }
}

crate::circuit::part::registers!(FilteredPid, self => self.latest());

impl Listed for FilteredPid {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |signed, int, frac| Format::new(signed, int, frac).expect("at most 40 bits");
        let narrow = FilteredPidConfig {
            width: 5,
            frac: 3,
            target: format(true, 4, 2),
            gain: format(false, 4, 4),
            command_width: 6,
            least: -23,
            most: 19,
            sum_limit: 37,
            sum_frac: 1,
        };
        Ok(vec![
            ("narrow", Self::new(narrow)?),
            ("current", Self::new(FilteredPidConfig::current())?),
            ("whole", Self::new(FilteredPidConfig { frac: 0, target: format(true, 5, 0), sum_frac: 0, ..narrow })?),
        ])
    }
}

impl FilteredPidConfig {
    /// The current controller of EPFL's haptic paddle: from sums of 33 codes of 12 bits to steps of the duty, with 10 V
    /// for the sum's limit.
    pub fn current() -> Self {
        Self {
            width: 19,
            target: Format::signed(16),
            gain: Format::new(false, 0, 24).expect("24 bits"),
            command_width: 10,
            least: -501,
            most: 500,
            sum_limit: 223_259_307,
            sum_frac: 20,
            ..Self::default()
        }
    }
}
