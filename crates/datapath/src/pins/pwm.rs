//! Pulse-width modulation by counter and comparison, with the four gates of an H-bridge.
//!
//! - **Equation**: one period is `2^WIDTH` clocks. Sign/magnitude: on while `phase < |command|`. Locked antiphase: on
//!   while `phase < floor((command + 2^WIDTH) / 2)`.
//! - **Ports**: `command` (1,WIDTH,0) in; gates `a_high`, `a_low`, `b_high`, `b_low` (0,1,0) out.
//! - **Latency**: 1 edge, when `LATCHED` up to a period: a command takes effect at phase 0.
//! - **Edge**, in this order:
//!   1. unless `LATCHED`, or at phase 0, the command is taken;
//!   2. each leg's state is chosen: on and positive A high, B low; on and negative A low, B high; off both low (brake),
//!      or both off when `FLOATING`; in antiphase on A high, B low, off A low, B high;
//!   3. a leg that changes its state waits `DEAD_TIME` edges with both gates off;
//!   4. the phase advances.
//! - **Reset**: phase 0, command 0, legs off, all gates 0. **Overflow**: none; `-2^WIDTH` is 100 %.
//! - **VHDL twin**: `hdl/pwm.vhd`.
//! - **Source**: Vasudevan et al. 2007 (12-bit PWM); the two modes of the LMD18200.
//! - **Differs from the hardware**: gates switch at the clock edge, with no driver delay and no rise or fall time.

use hpu_signal::{Format, Word};

use crate::base::config::{NATURAL, within};
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Repeat, Step};

hpu_signal::ports! {
    /// Inputs of the modulator.
    pub struct In of |block: &Pwm| {
        command: Format::signed(block.config.width + 1), "PWM count", "Mean voltage; full scale is the supply";
    }
    /// Outputs of the modulator.
    pub struct Out of |_: &Pwm| {
        a_high, "Upper gate of leg A";
        a_low, "Lower gate of leg A";
        b_high, "Upper gate of leg B";
        b_low, "Lower gate of leg B";
    }
}

/// The generics that have another name in a loop.
pub(crate) const IN_LOOP: [(&str, &str); 1] = [("WIDTH", "PWM_WIDTH")];

crate::base::listed::configuration! {
    /// The width and modes of a modulator.
    pub struct PwmConfig {
        /// Exponent of the period, which is `2^width` clocks.
        width: u32 = 12, ["WIDTH"];
        /// Whether the mode is locked antiphase; otherwise it is sign/magnitude.
        antiphase: bool = false, ["ANTIPHASE"];
        /// Whether a command waits for the start of a period.
        latched: bool = true, ["LATCHED"];
        /// Whether the off phase of sign/magnitude leaves the motor open instead of braking it.
        floating: bool = false, ["FLOATING"];
        /// Number of clocks for which both gates of a leg are off when the leg changes.
        dead_time: u32 = 0, ["DEAD_TIME"];
    }
}

/// The state that a leg of the bridge is asked to have.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum State {
    Off,
    Low,
    High,
}

/// A leg with its dead time. The modulators of two and of three legs have it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Leg {
    /// The state that the leg is asked to have.
    pub(crate) state: State,
    /// Clocks before its gate turns on.
    pub(crate) wait: u64,
}

impl Leg {
    pub(crate) const RESET: Self = Self { state: State::Off, wait: 0 };

    /// Ticks one edge, at which the leg is asked for a state.
    #[inline]
    pub(crate) fn tick(&mut self, wanted: State, dead_time: u64) {
        if wanted == self.state {
            self.wait = self.wait.saturating_sub(1);
        } else {
            *self = Self { state: wanted, wait: dead_time };
        }
    }

    /// Returns the gate on the side of a state.
    #[inline]
    pub(crate) fn gate(&self, state: State) -> i64 {
        i64::from(self.state == state && self.wait == 0)
    }

    /// Returns the number of edges before a gate turns on at the end of a dead time.
    #[inline]
    pub(crate) fn quiet(&self) -> u64 {
        if self.state == State::Off || self.wait == 0 { u64::MAX } else { self.wait - 1 }
    }
}

/// A command in the form of the comparison: the legs are `on` for the first `duty` clocks of a period, then off.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Pulse {
    duty: u64,
    on: [State; 2],
}

/// A pulse-width modulator; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Pwm {
    config: PwmConfig,
    period: u64,
    dead_time: u64,
    off: [State; 2],
    phase: u64,
    held: i64,
    pulse: Pulse,
    legs: [Leg; 2],
    resting: bool,
}

impl Pwm {
    /// Returns a modulator with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is 1 to 30 and `dead_time` is a VHDL `natural`.
    pub fn new(config: PwmConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, 1..=30)?;
        within(Self::NAME, "DEAD_TIME", config.dead_time, 0..=NATURAL)?;
        let off = match config {
            PwmConfig { antiphase: true, .. } => [State::Low, State::High],
            PwmConfig { floating: true, .. } => [State::Off, State::Off],
            _ => [State::Low, State::Low],
        };
        let mut block = Self {
            config,
            period: 1 << config.width,
            dead_time: config.dead_time.into(),
            off,
            phase: 0,
            held: 0,
            pulse: Pulse { duty: 0, on: off },
            legs: [Leg::RESET; 2],
            resting: false,
        };
        block.reset();
        Ok(block)
    }

    /// Stops the modulator for good, all gates 0. It is called for loops whose gates drive nothing, because a running
    /// modulator would keep the loop from being quiet.
    pub fn rest(&mut self) {
        self.resting = true;
        self.reset();
    }

    #[inline]
    fn pulse(&self, command: i64) -> Pulse {
        if self.config.antiphase {
            let duty = self.period.wrapping_add_signed(command) / 2;
            Pulse { duty, on: [State::High, State::Low] }
        } else {
            let on = if command > 0 { [State::High, State::Low] } else { [State::Low, State::High] };
            Pulse { duty: command.unsigned_abs(), on }
        }
    }

    #[inline]
    fn wanted(&self, pulse: Pulse, phase: u64) -> [State; 2] {
        if phase < pulse.duty { pulse.on } else { self.off }
    }

    /// Whether the next edge takes a new command.
    #[inline]
    fn takes(&self) -> bool {
        !self.config.latched || self.phase == 0
    }

    #[inline]
    fn take(&mut self, command: i64) {
        if command != self.held {
            self.held = command;
            self.pulse = self.pulse(command);
        }
    }

    /// Returns how the gates repeat from the edge just ticked on while this command stays, if they do. They do if that
    /// edge has begun a period, with the pulse of the command. The number of edges (`edges`) has no limit here; the
    /// caller limits it by the other nets.
    #[inline]
    pub(crate) fn repeats(&self, input: &In<i64>) -> Option<Repeat<Out<i64>>> {
        let Self { period, pulse: Pulse { duty, .. }, .. } = *self;
        let is_plain = self.config.latched && self.dead_time == 0 && !self.resting;
        let repeats = is_plain && self.phase == 1 && (1..period).contains(&duty) && input.command == self.held;
        repeats.then(|| Repeat { period, first: duty, others: self.pause(), edges: u64::MAX })
    }

    /// Returns the gates between two pulses.
    #[inline]
    pub(crate) fn pause(&self) -> Out<i64> {
        Self::shown(&self.off.map(|state| Leg { state, wait: 0 }))
    }

    /// Ticks `edges` edges from the beginning of a pulse that repeats, at once; returns the gates after them.
    #[inline]
    pub(crate) fn skip_repeats(&mut self, edges: u64) -> Out<i64> {
        let last = edges & (self.period - 1);
        self.legs = self.wanted(self.pulse, last).map(|state| Leg { state, wait: 0 });
        self.phase = (last + 1) & (self.period - 1);
        self.gates()
    }

    #[inline]
    fn gates(&self) -> Out<i64> {
        Self::shown(&self.legs)
    }

    #[inline]
    fn shown([a, b]: &[Leg; 2]) -> Out<i64> {
        Out {
            a_high: a.gate(State::High),
            a_low: a.gate(State::Low),
            b_high: b.gate(State::High),
            b_low: b.gate(State::Low),
        }
    }
}

/// Registers as in the VHDL: each leg has the state that it is asked to have (0 off, 1 low, 2 high) above its dead
/// time.
impl Step for Pwm {
    fn registers(&self) -> Vec<Register> {
        let PwmConfig { width, dead_time, .. } = self.config;
        let mut all =
            vec![Register::new("phase", Format::unsigned(width)), Register::new("held", Format::signed(width + 1))];
        for leg in ["leg_a", "leg_b"] {
            all.push(Register::new(leg, Format::unsigned(2)));
            if dead_time > 0 {
                let format = Format::unsigned(u32::BITS - dead_time.leading_zeros());
                all.push(Register { low: 2, ..Register::new(leg, format) });
            }
        }
        all.extend(["a_high", "a_low", "b_high", "b_low"].map(|gate| Register::new(gate, Format::BIT)));
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { command }: In<W>) -> (Vec<W>, Out<W>) {
        let [phase, held, ref legs @ .., a_high, a_low, b_high, b_low] = *registers else { unreachable!("registers") };
        let PwmConfig { width, antiphase, latched, floating, dead_time } = self.config;
        let (zero, one, full) = (W::int(0), W::int(1), W::int(1 << width));
        let [off, low, high] = [zero, one, W::int(2)];
        let held = if latched { W::select(phase.is_set(), held, command) } else { command };
        let is_active =
            if antiphase { (held + full).shr(1).above(phase) } else { held.above(phase) | (-held).above(phase) };
        let rest = match (antiphase, floating) {
            (true, _) => [low, high],
            (_, true) => [off, off],
            _ => [low, low],
        };
        let drives = |bit: W::Bit| W::branch(bit, || [high, low], || [low, high]);
        let pulse = if antiphase { [high, low] } else { drives(held.above(zero)) };
        let wanted = W::branch(is_active, || pulse, || rest);
        let mut next = vec![(phase + one).wrap(Format::unsigned(width)), held];
        let mut gates = Vec::new();
        for (leg, wanted) in legs.chunks(legs.len() / 2).zip(wanted) {
            let wait = leg.get(1).copied().unwrap_or(zero);
            let goes_on = || [W::select(wait.is_set(), wait - one, wait)];
            let [wait] = W::branch(wanted.equals(leg[0]), goes_on, || [W::int(dead_time.into())]);
            next.push(wanted);
            next.extend((leg.len() > 1).then_some(wait));
            gates.extend([high, low].map(|level| W::of_bit(wanted.equals(level) & wait.equals(zero))));
        }
        next.extend(gates);
        (next, Out { a_high, a_low, b_high, b_low })
    }
}

crate::base::listed::configured!(Pwm: PwmConfig);

impl Block for Pwm {
    const NAME: &'static str = "pwm";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.phase = 0;
        self.held = 0;
        self.pulse = self.pulse(0);
        self.legs = [Leg::RESET; 2];
        self.gates()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.resting {
            return Out { a_high: 0, a_low: 0, b_high: 0, b_low: 0 };
        }
        if self.takes() {
            self.take(input.command);
        }
        let [a, b] = self.wanted(self.pulse, self.phase);
        self.legs[0].tick(a, self.dead_time);
        self.legs[1].tick(b, self.dead_time);
        self.phase = (self.phase + 1) & (self.period - 1);
        self.gates()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if self.resting {
            return u64::MAX;
        }
        let now = if self.takes() { self.pulse(input.command) } else { self.pulse };
        let wanted = self.wanted(now, self.phase);
        if wanted != self.legs.map(|leg| leg.state) {
            return 0;
        }
        let change = if self.phase < now.duty && now.duty < self.period {
            now.duty - self.phase
        } else {
            // Nothing changes in the rest of this period; the next period has the pulse of the present command.
            let next = self.pulse(input.command);
            let rest = self.period - self.phase;
            if self.wanted(next, 0) != wanted {
                rest
            } else if (1..self.period).contains(&next.duty) {
                rest + next.duty
            } else {
                u64::MAX
            }
        };
        change.min(self.legs[0].quiet()).min(self.legs[1].quiet())
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if edges == 0 || self.resting {
            return;
        }
        if self.takes() || edges > self.period - self.phase {
            self.take(input.command);
        }
        for leg in &mut self.legs {
            leg.wait = leg.wait.saturating_sub(edges);
        }
        self.phase = self.phase.wrapping_add(edges) & (self.period - 1);
    }
}

impl Listed for Pwm {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let small = PwmConfig { width: 5, ..PwmConfig::default() };
        let all = [
            ("8_bit", PwmConfig { width: 8, ..small }),
            ("antiphase", PwmConfig { antiphase: true, ..small }),
            ("immediate", PwmConfig { latched: false, ..small }),
            ("immediate_antiphase", PwmConfig { antiphase: true, latched: false, ..small }),
            ("floating", PwmConfig { floating: true, ..small }),
            ("dead_time", PwmConfig { dead_time: 3, ..small }),
            ("dead_time_antiphase", PwmConfig { antiphase: true, dead_time: 2, ..small }),
            ("dead_time_floating", PwmConfig { floating: true, dead_time: 4, ..small }),
            ("dead_time_longer_than_period", PwmConfig { width: 2, dead_time: 7, latched: false, ..small }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
