//! A PID controller whose target is the reference: a motor that follows a path.
//!
//! - **Equation**: a [`pid`](crate::Pid) with `measured = position` and `target = position - delta`, which is the
//!   loop's reference; its proportional gain is `stiffness`, its derivative gain `damping`, its integral gain the
//!   constant `INTEGRAL`, all in the narrowest format that holds the three; `torque = -command`. At a sample edge, with
//!   the target's motion `d = (target - memory) mod 2^WIDTH` as two's complement: `memory' = target`, and the
//!   controller's feed-forward is `clamp(floor(FEED_FORWARD d / 2^DAMPING_FRAC), -LIMIT, LIMIT)`.
//! - **Ports**: those of every law; `contact`, `penetration` and `scale` are ignored. `memory` (0,WIDTH,0): the target
//!   of the latest sample.
//! - **Latency**: 1 edge: the sample edge loads torque and memory.
//! - **Edge**: with the countdown at 0, everything is loaded and the countdown restarts at `max(period,1) - 1`; else it
//!   counts down. A new period takes effect at the next sample edge.
//! - **Reset**: everything 0; the first edge samples, with motions of the whole position and of the whole target.
//! - **Overflow**: command, sum and feed-forward saturate; differences wrap, as the counter does.
//! - **VHDL twin**: `hdl/position_pid.vhd`.
//! - **Source**: that of `pid`; the feed-forward of the target's speed as in every servo drive.
//! - **Differs from the hardware**: as in `pid`.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::arithmetic::pid;
use crate::base::config::within;
use crate::base::countdown::Countdown;
use crate::base::listed::Listed;
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::step::counted_down;
use crate::{
    Block, ClockEdge, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, MethodLoop, Pid, PidConfig, Register, Step,
};

/// The controller's name as an instance.
const CONTROLLER: &str = "controller";

crate::base::listed::configuration! {
    /// The widths and constants of a controller of a position.
    pub struct PositionPidConfig {
        /// The widths and formats that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Gain of the sum of errors, in its format.
        integral: u32 = 16, ["INTEGRAL"];
        /// Format of that gain, in PWM counts per count and sample.
        integral_format: Format = Format::new(false, 4, 8).expect("12 bits"), ["INTEGRAL_WIDTH", "INTEGRAL_FRAC"];
        /// The greatest torque, in PWM counts.
        limit: u32 = 4095, ["LIMIT"];
        /// Whether the sum gives back what the limit cuts off; otherwise it stands still there.
        back_calculation: bool = false, ["BACK_CALCULATION"];
        /// Exponent of the share that a sample gives back: `2^-back`.
        back: u32 = 4, ["BACK"];
        /// Torque for a motion of the target of one count in a sample, in the format of the damping; 0 for none.
        feed_forward: u32 = 0, ["FEED_FORWARD"];
    }
}

impl PositionPidConfig {
    /// Returns the controller's format of all three gains: the narrowest that holds each.
    ///
    /// # Errors
    ///
    /// Returns an error if it has more than 24 bits.
    pub fn gain(&self) -> Result<Format, ConfigError> {
        let all = [self.widths.stiffness, self.widths.damping, self.integral_format];
        let most = |part: fn(Format) -> i32| all.map(part).into_iter().max().expect("three formats");
        let (int, frac) = (most(Format::int), most(Format::frac));
        let gain = Format::new(false, int, frac).ok().filter(|gain| gain.width() <= 24);
        gain.ok_or_else(|| {
            let found = format!("the gains need {int} integer and {frac} fraction bits");
            ConfigError::new(PositionPid::NAME, found, "24 bits for all three gains together")
        })
    }
}

/// A PID controller of a position; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PositionPid {
    config: PositionPidConfig,
    pid: Pid,
    /// A position or its difference, as two's complement.
    difference: Format,
    ahead: Narrowing,
    frac: i32,
    countdown: Countdown,
    memory: i64,
}

impl PositionPid {
    /// Returns a controller with these widths and constants.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`], the controller accepts its own, and the constants
    /// fit their words; `FEED_FORWARD` has at most 24 bits.
    pub fn new(config: PositionPidConfig) -> Result<Self, ConfigError> {
        let PositionPidConfig { widths, integral, integral_format, limit, back_calculation, back, feed_forward } =
            config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "INTEGRAL_WIDTH", integral_format.width(), 2..=24)?;
        within(Self::NAME, "INTEGRAL", integral, 0..=(1 << integral_format.width()) - 1)?;
        within(Self::NAME, "FEED_FORWARD", feed_forward, 0..=(1 << 24) - 1)?;
        let gain = config.gain()?;
        let pid = Pid::new(PidConfig {
            width: widths.width,
            gain,
            command_width: widths.torque_width + 1,
            limit,
            back_calculation,
            back,
            forwarded: feed_forward > 0,
            period_width: widths.period_width,
        })?;
        let ahead = Narrowing {
            from_frac: widths.damping.frac(),
            to: Format::signed(widths.torque_width + 1),
            rounding: Rounding::Truncate,
            overflow: Overflow::Saturate,
        };
        Ok(Self {
            config,
            pid,
            difference: Format::signed(widths.width),
            ahead,
            frac: gain.frac(),
            countdown: Countdown::default(),
            memory: 0,
        })
    }

    /// Returns the widths and constants.
    pub fn config(&self) -> &PositionPidConfig {
        &self.config
    }

    /// Returns the format of the target.
    fn memory(&self) -> Format {
        Format::unsigned(self.config.widths.width)
    }

    /// Returns the loop's reference.
    fn target<W: Word>(&self, input: &LawIn<W>) -> W {
        (input.position - input.delta).wrap(self.memory())
    }

    /// Returns what the controller is given, with the target of the sample before.
    #[inline]
    fn given<W: Word>(&self, input: &LawIn<W>, memory: W) -> pid::In<W> {
        let PositionPidConfig { widths, integral, integral_format, limit, feed_forward, .. } = self.config;
        let gain = |word: W, format: Format| word.shl((self.frac - format.frac()).unsigned_abs());
        let target = self.target(input);
        let ahead = if feed_forward > 0 {
            let motion = (target - memory).wrap(self.difference).cut("motion", widths.width);
            let product = W::int(feed_forward.into()) * motion;
            product.narrow(&self.ahead).limit(-i128::from(limit), limit.into()).shed()
        } else {
            W::int(0)
        };
        pid::In {
            target: target.wrap(self.difference),
            measured: input.position.wrap(self.difference),
            feed_forward: ahead,
            proportional: gain(input.stiffness, widths.stiffness),
            integral: gain(W::int(integral.into()), integral_format),
            derivative: gain(input.damping, widths.damping),
            period: input.period,
        }
    }

    /// Returns what the controller is given now, and the target.
    #[inline]
    fn seen(&self, input: &LawIn<i64>) -> (pid::In<i64>, i64) {
        let words = input.map(Machine::<i64>::of);
        let given = self.given(&words, Machine::of(self.memory)).map(|word| word.narrowed().word);
        (given, self.target(&words).narrowed().word)
    }

    /// Returns the torque against the positive direction.
    #[inline]
    fn shown(&self) -> LawOut<Narrowed> {
        let command = self.pid.latest();
        let memory = Narrowed { word: self.memory, rounded: false, overflowed: false };
        LawOut { torque: Narrowed { word: -command.word, ..command }, memory }
    }
}

impl Step for PositionPid {
    fn registers(&self) -> Vec<Register> {
        let own = [
            Register::new(Register::COUNTDOWN, Format::unsigned(self.config.widths.period_width)),
            Register::new("memory", self.memory()),
        ];
        own.into_iter().chain(Register::inside(CONTROLLER, &self.pid)).collect()
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let ([left, memory], controller) = registers.split_first_chunk().expect("two registers and the controller's");
        let (next_left, samples) = counted_down(*left, input.period);
        let (next, pid::Out { command }) = self.pid.step(controller, self.given(&input, *memory));
        let target = W::select(samples, self.target(&input), *memory);
        ([&[next_left, target][..], &next].concat(), LawOut { torque: -command, memory: *memory })
    }
}

crate::base::listed::configured!(PositionPid: PositionPidConfig);

impl Law for PositionPid {
    const LOOP: &'static str = "position_pid_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        1
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.shown().lost()
    }
}

impl Block for PositionPid {
    const NAME: &'static str = "position_pid";
    crate::base::law::law_ports!(self => self.memory(), "count", "Target of the latest sample");

    fn equations(&self) -> Option<ClockEdge<'_>> {
        Some(ClockEdge::of(self))
    }

    fn reset(&mut self) -> LawOut<i64> {
        self.countdown = Countdown::default();
        self.memory = 0;
        self.pid.reset();
        self.shown().words()
    }

    #[inline]
    fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
        let (given, target) = self.seen(&input);
        self.pid.tick(given);
        if self.countdown.tick(input.period) {
            self.memory = target;
        }
        self.shown().words()
    }

    #[inline]
    fn quiet(&self, input: &LawIn<i64>) -> u64 {
        let (given, target) = self.seen(input);
        // A sample takes in the target's motion; later ones find none.
        if target == self.memory { self.pid.quiet(&given) } else { self.countdown.left() }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LawIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.pid.skip(edges, &self.seen(input).0);
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for PositionPid {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let narrow = narrow();
        let all = [
            ("8_bit", narrow),
            ("back_calculation", PositionPidConfig { back_calculation: true, back: 1, ..narrow }),
            ("feed_forward", PositionPidConfig { feed_forward: 21, ..narrow }),
            ("proportional", PositionPidConfig { integral: 0, ..narrow }),
            ("distinct", apart()),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}

/// Returns a controller that is limited, and winds up, within a few samples.
fn narrow() -> PositionPidConfig {
    let integral_format = Format::new(false, 2, 3).expect("5 bits");
    PositionPidConfig { widths: short(), integral: 5, integral_format, limit: 50, ..PositionPidConfig::default() }
}

/// Returns a controller of which no two generics are the same.
fn apart() -> PositionPidConfig {
    let integral_format = Format::new(false, 7, 6).expect("13 bits");
    let config =
        PositionPidConfig { widths: distinct(), integral: 37, integral_format, ..PositionPidConfig::default() };
    PositionPidConfig { limit: 1400, back_calculation: true, back: 2, feed_forward: 333, ..config }
}

impl InLoops for PositionPid {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let narrow = Self::new(PositionPidConfig { feed_forward: 21, ..narrow() })?;
        let phase = narrow.latency() + 1;
        Ok(vec![("8_bit", shaped(narrow, phase)?), ("distinct", bare(Self::new(apart())?)?)])
    }
}
