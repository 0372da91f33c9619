//! Three-phase pulse-width modulation around an up-down carrier, with dead time, a least pulse and a trigger for
//! converters.
//!
//! - **Equation**: one period is `2 STEPS` clocks, from valley to valley of the carrier. A leg is asked to be high
//!   while `STEPS - duty <= phase < STEPS + duty`, for `2 duty` clocks around the peak, else low; without `enable`,
//!   off. At the valley all legs are low unless one is at full duty, so that shunts under the low switches carry the
//!   currents.
//! - **Least pulse**: a duty above `STEPS` is taken as `STEPS`. A duty below `MIN_PULSE` is dropped (taken as 0), one
//!   above `STEPS - MIN_PULSE` is held (taken as `STEPS`). While `enable` stays, no pulse and no gap that is asked for
//!   is shorter than `MIN_PULSE` clocks, and at a constant duty none shorter than `2 MIN_PULSE`. The dead time is taken
//!   off a pulse.
//! - **Ports**: `duty_a`, `duty_b`, `duty_c` (0,DUTY_WIDTH,0) in steps, `enable` (0,1,0) in; gates `a_high`, `a_low`,
//!   `b_high`, `b_low`, `c_high`, `c_low`, `trigger`, `sample` (0,1,0) out.
//! - **Latency**: 1 edge; a duty waits for the valley, with `PEAK` for valley or peak. A gate turns on `DEAD_TIME`
//!   clocks later and turns off at once.
//! - **Edge**, in this order:
//!   1. at phase 0, with `PEAK` also at phase `STEPS`, the duties are taken and `trigger` rises, for one clock;
//!   2. `sample` is 1 for the clock that begins `SAMPLE_DELAY` clocks later, if `enable` is 1: by then a converter that
//!      the trigger has started is to have its words;
//!   3. a leg whose wanted state changes has both gates off for `DEAD_TIME` clocks, another change on the way begins
//!      them again; then it takes that state;
//!   4. the phase advances, after the last clock of a period to 0, with and without `enable`.
//! - **Reset**: phase 0, duties 0, all legs off, all outputs 0.
//! - **Overflow**: duties clamp.
//! - **VHDL twin**: `hdl/three_phase_pwm.vhd`.
//! - **Source**: common practice; the timers of motor controllers have the same parts.
//! - **Differs from the hardware**: gates switch at the clock edge, with no driver delay and no rise or fall time.

use hpu_signal::{Format, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::pins::pwm::{Leg, State};
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the modulator.
    pub struct In of |block: &ThreePhasePwm| {
        duty_a: block.duty(), "step", "Duty of leg A";
        duty_b: block.duty(), "step", "Duty of leg B";
        duty_c: block.duty(), "step", "Duty of leg C";
        enable, "0 turns all gates off";
    }
    /// Outputs of the modulator.
    pub struct Out of |_: &ThreePhasePwm| {
        a_high, "Upper gate of leg A";
        a_low, "Lower gate of leg A";
        b_high, "Upper gate of leg B";
        b_low, "Lower gate of leg B";
        c_high, "Upper gate of leg C";
        c_low, "Lower gate of leg C";
        trigger, "Duties are taken, converters begin";
        sample, "Words of the converters are there";
    }
}

crate::base::listed::configuration! {
    /// The period and the times of a modulator.
    pub struct ThreePhasePwmConfig {
        /// Width of the duties, in bits.
        duty_width: u32 = 11, ["DUTY_WIDTH"];
        /// Steps from valley to peak; a step is a clock.
        steps: u32 = 1250, ["STEPS"];
        /// Clocks for which both gates of a leg are off when the leg changes.
        dead_time: u32 = 25, ["DEAD_TIME"];
        /// The least duty that is not dropped, and the least distance of a duty from `steps` that is not held.
        min_pulse: u32 = 20, ["MIN_PULSE"];
        /// Clocks from `trigger` to `sample`.
        sample_delay: u32 = 100, ["SAMPLE_DELAY"];
        /// Whether duties are taken, and converters triggered, at the peak too.
        peak: bool = false, ["PEAK"];
    }
}

/// A modulator of three legs; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ThreePhasePwm {
    config: ThreePhasePwmConfig,
    /// Clocks from valley to peak.
    steps: u64,
    phase: u64,
    held: [u64; 3],
    legs: [Leg; 3],
    trigger: bool,
    sample: bool,
    resting: bool,
}

const GATES: [&str; 6] = ["a_high", "a_low", "b_high", "b_low", "c_high", "c_low"];

impl ThreePhasePwm {
    /// Returns a modulator with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless a duty has 2 to 16 bits, there are 2 steps at least and a duty can be all of them, the
    /// dead time is below them, the least pulse at most half of them, and the delay of the sample 1 or more and below
    /// them.
    pub fn new(config: ThreePhasePwmConfig) -> Result<Self, ConfigError> {
        let ThreePhasePwmConfig { duty_width, steps, dead_time, min_pulse, sample_delay, .. } = config;
        within(Self::NAME, "DUTY_WIDTH", duty_width, 2..=16)?;
        within(Self::NAME, "STEPS", steps, 2..=(1 << duty_width) - 1)?;
        within(Self::NAME, "DEAD_TIME", dead_time, 0..=steps - 1)?;
        within(Self::NAME, "MIN_PULSE", min_pulse, 0..=steps / 2)?;
        within(Self::NAME, "SAMPLE_DELAY", sample_delay, 1..=steps - 1)?;
        Ok(Self {
            config,
            steps: steps.into(),
            phase: 0,
            held: [0; 3],
            legs: [Leg::RESET; 3],
            trigger: false,
            sample: false,
            resting: false,
        })
    }

    /// Keeps all gates 0 for good: for a loop whose gates drive nothing. `trigger` and `sample` go on.
    pub fn rest(&mut self) {
        self.resting = true;
        self.legs = [Leg::RESET; 3];
    }

    fn duty(&self) -> Format {
        Format::unsigned(self.config.duty_width)
    }

    fn phase(&self) -> Format {
        Format::unsigned((2 * self.config.steps - 1).ilog2() + 1)
    }

    /// Returns the duty that is taken for a word.
    #[inline]
    fn taken(&self, duty: i64) -> u64 {
        let (duty, least) = (duty.unsigned_abs().min(self.steps), u64::from(self.config.min_pulse));
        match duty {
            _ if duty < least => 0,
            _ if duty > self.steps - least => self.steps,
            _ => duty,
        }
    }

    /// Whether the edge at this phase takes duties, that many clocks after valley or peak.
    #[inline]
    fn marks(&self, after: u64) -> bool {
        self.phase == after || self.config.peak && self.phase == self.steps + after
    }

    /// Returns the edges before the one at which that many clocks have passed since valley or peak.
    #[inline]
    fn until(&self, after: u64) -> u64 {
        let (peak, end) = (self.steps + after, 2 * self.steps + after);
        match self.phase {
            phase if phase <= after => after - phase,
            phase if self.config.peak && phase <= peak => peak - phase,
            phase => end - phase,
        }
    }

    #[inline]
    fn wanted(&self, held: u64, enable: i64) -> State {
        match enable {
            0 => State::Off,
            _ if (self.steps - held..self.steps + held).contains(&self.phase) => State::High,
            _ => State::Low,
        }
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let [a, b, c] = &self.legs;
        Out {
            a_high: a.gate(State::High),
            a_low: a.gate(State::Low),
            b_high: b.gate(State::High),
            b_low: b.gate(State::Low),
            c_high: c.gate(State::High),
            c_low: c.gate(State::Low),
            trigger: self.trigger.into(),
            sample: self.sample.into(),
        }
    }
}

/// Registers as in the VHDL: each leg has the state that it is asked to have (0 off, 1 low, 2 high) above its dead
/// time.
impl Step for ThreePhasePwm {
    fn registers(&self) -> Vec<Register> {
        let ThreePhasePwmConfig { steps, dead_time, .. } = self.config;
        let mut all = vec![Register::new("phase", self.phase())];
        let held = Format::unsigned(steps.ilog2() + 1);
        all.extend(["held_a", "held_b", "held_c"].map(|name| Register::new(name, held)));
        for leg in ["leg_a", "leg_b", "leg_c"] {
            all.push(Register::new(leg, Format::unsigned(2)));
            if dead_time > 0 {
                all.push(Register { low: 2, ..Register::new(leg, Format::unsigned(dead_time.ilog2() + 1)) });
            }
        }
        all.extend(GATES.iter().chain(&["trigger", "sample"]).map(|name| Register::new(name, Format::BIT)));
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [phase, held_a, held_b, held_c, ref rest @ ..] = *registers else { unreachable!("registers") };
        let (legs, shown) = rest.split_at(rest.len() - 8);
        let ThreePhasePwmConfig { steps, dead_time, min_pulse, sample_delay, peak, .. } = self.config;
        let [zero, one, low, high] = [0, 1, 1, 2].map(W::int);
        let full = W::int(steps.into());
        let marks = |after: u32| {
            let valley = phase.equals(W::int(after.into()));
            if peak { valley | phase.equals(W::int((steps + after).into())) } else { valley }
        };
        let takes = marks(0);
        let taken = |duty: W| {
            let duty = duty.lesser(full);
            let held = W::select(duty.above(W::int((steps - min_pulse).into())), full, duty);
            W::select(duty.at_least(W::int(min_pulse.into())), held, zero)
        };
        let duties = || [input.duty_a, input.duty_b, input.duty_c].map(taken);
        let held = W::branch(takes, duties, || [held_a, held_b, held_c]);
        let last = phase.equals(W::int((2 * steps - 1).into()));
        let after = W::select(last, zero, (phase + one).wrap(self.phase()));
        let mut next = [vec![after], held.to_vec()].concat();
        let mut gates = Vec::new();
        for (leg, held) in legs.chunks(legs.len() / 3).zip(held) {
            let is_high = phase.at_least(full - held) & (full + held).above(phase);
            let wanted = W::select(input.enable.is_set(), W::select(is_high, high, low), zero);
            let wait = leg.get(1).copied().unwrap_or(zero);
            let goes_on = || [W::select(wait.is_set(), wait - one, wait)];
            let [wait] = W::branch(wanted.equals(leg[0]), goes_on, || [W::int(dead_time.into())]);
            next.push(wanted);
            next.extend((leg.len() > 1).then_some(wait));
            gates.extend([high, low].map(|level| W::of_bit(wanted.equals(level) & wait.equals(zero))));
        }
        next.extend(gates);
        next.extend([W::of_bit(takes), W::of_bit(marks(sample_delay) & input.enable.is_set())]);
        let mut shown = shown.iter().copied();
        (next, hpu_signal::Ports::build(|| shown.next().expect("eight outputs")))
    }
}

crate::base::listed::configured!(ThreePhasePwm: ThreePhasePwmConfig);

impl Block for ThreePhasePwm {
    const NAME: &'static str = "three_phase_pwm";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        (self.phase, self.held, self.legs) = (0, [0; 3], [Leg::RESET; 3]);
        (self.trigger, self.sample) = (false, false);
        self.shown()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.trigger = self.marks(0);
        self.sample = input.enable != 0 && self.marks(self.config.sample_delay.into());
        if self.trigger {
            self.held = [input.duty_a, input.duty_b, input.duty_c].map(|duty| self.taken(duty));
        }
        if !self.resting {
            let wanted = self.held.map(|held| self.wanted(held, input.enable));
            for (leg, wanted) in self.legs.iter_mut().zip(wanted) {
                leg.tick(wanted, self.config.dead_time.into());
            }
        }
        self.phase = (self.phase + 1) % (2 * self.steps);
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if self.trigger || self.sample {
            return 0;
        }
        let mut quiet = self.until(0);
        if input.enable != 0 {
            quiet = quiet.min(self.until(self.config.sample_delay.into()));
        }
        if self.resting || quiet == 0 {
            return quiet;
        }
        // No duty is taken before that edge.
        for (leg, held) in self.legs.iter().zip(self.held) {
            if self.wanted(held, input.enable) != leg.state {
                return 0;
            }
            let changes = [self.steps - held, self.steps + held].into_iter().filter(|at| *at > self.phase);
            let change = changes.min().filter(|_| input.enable != 0 && held > 0);
            quiet = quiet.min(leg.quiet()).min(change.map_or(u64::MAX, |at| at - self.phase));
        }
        quiet
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        for leg in &mut self.legs {
            leg.wait = leg.wait.saturating_sub(edges);
        }
        self.phase = (self.phase + edges) % (2 * self.steps);
    }
}

crate::circuit::part::registers!(ThreePhasePwm);

impl Listed for ThreePhasePwm {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let small =
            ThreePhasePwmConfig { duty_width: 4, steps: 11, dead_time: 2, min_pulse: 3, sample_delay: 5, peak: false };
        let all = [
            ("short", small),
            ("peak", ThreePhasePwmConfig { peak: true, ..small }),
            ("no_dead_time", ThreePhasePwmConfig { dead_time: 0, min_pulse: 0, sample_delay: 1, ..small }),
            ("long_dead_time", ThreePhasePwmConfig { dead_time: 8, min_pulse: 1, peak: true, ..small }),
            ("power_of_two", ThreePhasePwmConfig { duty_width: 5, steps: 16, min_pulse: 8, sample_delay: 15, ..small }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
