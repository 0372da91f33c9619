//! Pulse-width modulation by the timer of a microcontroller: prescaler, any number of steps, preloaded compare
//! register; locked antiphase on an H-bridge.
//!
//! - **Equation**: one period is `PRESCALE STEPS` clocks. Leg B is high and leg A low while
//!   `phase < PRESCALE (command + CENTRE)`, else B low and A high: a positive command drives the positive direction.
//! - **Ports**: `command` (1,COMMAND_WIDTH-1,0) in; gates `a_high`, `a_low`, `b_high`, `b_low` (0,1,0) out.
//! - **Latency**: 1 edge, up to a period: a command takes effect at phase 0.
//! - **Edge**, in this order:
//!   1. at phase 0, the command is taken;
//!   2. the gates are chosen;
//!   3. the phase advances, after the last clock of a period to 0.
//! - **Reset**: phase 0, command 0, all gates 0.
//! - **Overflow**: none; a command outside of the period's steps is never or always on.
//! - **VHDL twin**: `hdl/timer_pwm.vhd`.
//! - **Source**: TIM1 of an STM32F4 as the firmware of EPFL's haptic paddle sets it (`h_bridge.c`): 168 MHz, prescaler
//!   5, 1024 steps, 32.8125 kHz.
//! - **Differs from the hardware**: gates switch at the clock edge, with no driver delay and no dead time.

use hpu_signal::{Format, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the modulator.
    pub struct In of |block: &TimerPwm| {
        command: Format::signed(block.config.command_width), "step", "Duty, from the middle";
    }
    /// Outputs of the modulator.
    pub struct Out of |_: &TimerPwm| {
        a_high, "Upper gate of leg A";
        a_low, "Lower gate of leg A";
        b_high, "Upper gate of leg B";
        b_low, "Lower gate of leg B";
    }
}

crate::base::listed::configuration! {
    /// The width and the period of a modulator.
    pub struct TimerPwmConfig {
        /// Width of the command, in bits.
        command_width: u32 = 10, ["COMMAND_WIDTH"];
        /// Clocks of a step.
        prescale: u32 = 5, ["PRESCALE"];
        /// Steps of a period.
        steps: u32 = 1024, ["STEPS"];
        /// Steps for which leg B is high at a command of 0.
        centre: u32 = 511, ["CENTRE"];
    }
}

/// A modulator; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TimerPwm {
    config: TimerPwmConfig,
    period: i64,
    phase: i64,
    held: i64,
    /// Whether leg B is high; `None` after a reset, with all gates 0.
    shown: Option<bool>,
    resting: bool,
}

impl TimerPwm {
    /// Returns a modulator with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless the command has 2 to 24 bits, the prescaler is 1 to 65536, a period has 2 to 65536
    /// steps, and the centre is one of them.
    pub fn new(config: TimerPwmConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "COMMAND_WIDTH", config.command_width, 2..=24)?;
        within(Self::NAME, "PRESCALE", config.prescale, 1..=1 << 14)?;
        within(Self::NAME, "STEPS", config.steps, 2..=1 << 16)?;
        within(Self::NAME, "CENTRE", config.centre, 0..=config.steps)?;
        let period = i64::from(config.prescale) * i64::from(config.steps);
        Ok(Self { config, period, phase: 0, held: 0, shown: None, resting: false })
    }

    /// Stops the modulator for good, all gates 0: for a loop whose gates drive nothing.
    pub fn rest(&mut self) {
        self.resting = true;
        self.reset();
    }

    fn phase(&self) -> Format {
        Format::unsigned((self.period - 1).ilog2() + 1)
    }

    /// Returns the clocks for which leg B is high in a period with this command.
    #[inline]
    fn pulse(&self, command: i64) -> i64 {
        (i64::from(self.config.prescale) * (command + i64::from(self.config.centre))).clamp(0, self.period)
    }

    #[inline]
    fn gates(&self) -> Out<i64> {
        let [b, a] = [self.shown == Some(true), self.shown == Some(false)].map(i64::from);
        Out { a_high: a, a_low: b, b_high: b, b_low: a }
    }
}

impl Step for TimerPwm {
    fn registers(&self) -> Vec<Register> {
        let held = Register::new("held", Format::signed(self.config.command_width));
        let mut all = vec![Register::new("phase", self.phase()), held];
        all.extend(["a_high", "a_low", "b_high", "b_low"].map(|gate| Register::new(gate, Format::BIT)));
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { command }: In<W>) -> (Vec<W>, Out<W>) {
        let [phase, held, a_high, a_low, b_high, b_low] = *registers else { unreachable!("six registers") };
        let held = W::select(phase.is_set(), held, command);
        let pulse = W::int(self.config.prescale.into()) * (held + W::int(self.config.centre.into()));
        let on = pulse.above(phase);
        let last = phase.equals(W::int((self.period - 1).into()));
        let next = W::select(last, W::int(0), (phase + W::int(1)).wrap(self.phase()));
        let [high, low] = [W::of_bit(on), W::of_bit(!on)];
        (vec![next, held, low, high, high, low], Out { a_high, a_low, b_high, b_low })
    }
}

crate::base::listed::configured!(TimerPwm: TimerPwmConfig);

impl Block for TimerPwm {
    const NAME: &'static str = "timer_pwm";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        (self.phase, self.held, self.shown) = (0, 0, None);
        self.gates()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.phase == 0 {
            self.held = input.command;
        }
        self.shown = (!self.resting).then(|| self.phase < self.pulse(self.held));
        self.phase = if self.phase == self.period - 1 { 0 } else { self.phase + 1 };
        self.gates()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if self.resting {
            return u64::MAX;
        }
        let pulse = self.pulse(if self.phase == 0 { input.command } else { self.held });
        let on = self.phase < pulse;
        if self.shown != Some(on) {
            return 0;
        }
        let change = if on && pulse < self.period {
            pulse - self.phase
        } else {
            // Nothing changes in the rest of this period; the next one has the pulse of the present command.
            let (next, rest) = (self.pulse(input.command), self.period - self.phase);
            match next {
                _ if (next > 0) != on => rest,
                0 => return u64::MAX,
                _ if next == self.period => return u64::MAX,
                _ => rest + next,
            }
        };
        change.unsigned_abs()
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let begins = self.phase == 0 || edges > (self.period - self.phase).unsigned_abs();
        if edges > 0 && begins {
            self.held = input.command;
        }
        let period = self.period.unsigned_abs();
        self.phase = ((self.phase.unsigned_abs() + edges % period) % period).cast_signed();
    }
}

crate::circuit::part::registers!(TimerPwm);

impl Listed for TimerPwm {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let of = |command_width, prescale, steps, centre| {
            Self::new(TimerPwmConfig { command_width, prescale, steps, centre })
        };
        Ok(vec![("narrow", of(4, 3, 7, 5)?), ("power_of_two", of(5, 1, 32, 16)?), ("beyond", of(6, 2, 9, 0)?)])
    }
}
