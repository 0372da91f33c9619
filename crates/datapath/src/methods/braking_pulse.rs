//! A wall that takes the momentum out at its entry: one braking pulse, then spring and damper.
//!
//! - **Equation**: at a sample edge, with `d` the motion since the last one and `wanted` the torque of spring and drag:
//!   `brake' = sat(floor(PULSE d / 2^DAMPING_FRAC))` if `contact` is set, `d > 0`, and either the last sample was not
//!   in contact or a pulse goes on; else 0. `torque' = clamp(wanted + brake')`. A pulse goes on while it asks for more
//!   than the bridge can show: `wanted + brake' > top` with `top = 2^TORQUE_WIDTH - 1`. `wanted = clamp(spring + drag)`
//!   as every law has it: `spring = min(floor(penetration * stiffness), top)` and `drag = floor(damping * d)`, within
//!   `-top - 1 .. top`, inside the wall, 0 outside.
//! - **Ports**: those of every law; `scale` and `delta` are ignored. `memory` (1,TORQUE_WIDTH+8,0): the pulse `brake`.
//! - **Latency**: 1 edge: the sample edge loads torque and memory.
//! - **Edge**: with the countdown at 0, everything is loaded and the countdown restarts at `max(period,1) - 1`; else it
//!   counts down. A new period takes effect at the next sample edge.
//! - **Reset**: everything 0, outside the wall; the first edge samples.
//! - **Overflow**: pulse and torque saturate.
//! - **VHDL twin**: `hdl/braking_pulse.vhd`.
//! - **Source**: Salcudean and Vlaar 1997, whose pulse of one sample is `m v / T`: `PULSE = m / T` in words. Where the
//!   bridge cannot show it, this pulse goes on with what is left of the speed; in the paper it is cut off.
//! - **Known failures**: the speed is the mean of the last sample, so that a device that a hand accelerates is stopped
//!   late and one that the wall brakes is stopped twice. A count that toggles at the surface makes a pulse each time.
//! - **Differs from the hardware**: all products take one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::base::config::{NATURAL, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::law::{Wanted, ZERO, shown};
use crate::base::listed::Listed;
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::step::counted_down;
use crate::{Block, ClockEdge, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, MethodLoop, Register, Step};

crate::base::listed::configuration! {
    /// The widths and the gain of a braking pulse.
    pub struct PulseConfig {
        /// The widths and formats that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Torque that takes out a speed of one count per sample within a sample, with the fraction bits of the
        /// damping.
        pulse: u32 = 1025, ["PULSE"];
    }
}

hpu_signal::ports! {
    /// The registers that a sample edge loads.
    pub struct Registers { previous, touched, braking, brake, torque }
}

const RESET: Registers<Narrowed> =
    Registers { previous: ZERO, touched: ZERO, braking: ZERO, brake: ZERO, torque: ZERO };

/// A wall with a braking pulse; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BrakingPulse {
    config: PulseConfig,
    motion: Format,
    wanted: Wanted,
    brake: Narrowing,
    fits_64: bool,
    countdown: Countdown,
    latest: Registers<Narrowed>,
}

impl BrakingPulse {
    /// Returns a wall with these widths and this gain.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`] and the gain is a VHDL `natural`.
    pub fn new(config: PulseConfig) -> Result<Self, ConfigError> {
        let PulseConfig { widths, pulse } = config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "PULSE", pulse, 0..=NATURAL)?;
        let mut block = Self {
            config,
            motion: Format::signed(widths.width),
            wanted: Wanted::new(&widths),
            brake: Narrowing {
                from_frac: widths.damping.frac(),
                to: Format::signed(widths.torque_width + 9),
                rounding: Rounding::Truncate,
                overflow: Overflow::Saturate,
            },
            fits_64: false,
            countdown: Countdown::default(),
            latest: RESET,
        };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the widths and the gain.
    pub fn config(&self) -> &PulseConfig {
        &self.config
    }

    /// Computes the registers after a sample edge.
    #[inline]
    fn made<W: Word>(&self, input: LawIn<W>, last: &Registers<W>) -> Registers<W> {
        let (zero, top) = (W::int(0), W::int(self.config.widths.top().into()));
        let motion = (input.position - last.previous.shed()).wrap(self.motion);
        let wanted = self.wanted.torque(&input, motion);
        let begins_or_goes_on = !last.touched.is_set() | last.braking.is_set();
        let brakes = input.contact.is_set() & motion.above(zero) & begins_or_goes_on;
        let pulse = || [(W::int(self.config.pulse.into()) * motion).narrow(&self.brake)];
        let [brake] = W::branch(brakes, pulse, || [zero]);
        let total = wanted + brake.shed();
        Registers {
            previous: input.position,
            touched: input.contact,
            braking: W::of_bit(brake.above(zero) & total.above(top)),
            brake,
            torque: shown(total, self.config.widths.top()),
        }
    }

    /// Returns the registers that a sample edge would load now.
    #[inline]
    fn sample(&self, input: &LawIn<i64>, last: &Registers<Narrowed>) -> Registers<Narrowed> {
        if self.fits_64 {
            self.made(input.map(Machine::<i64>::of), &last.map(Machine::of_narrowed)).map(Machine::narrowed)
        } else {
            self.made(input.map(Machine::<i128>::of), &last.map(Machine::of_narrowed)).map(Machine::narrowed)
        }
    }

    #[inline]
    fn shown(&self) -> LawOut<Narrowed> {
        LawOut { torque: self.latest.torque, memory: self.latest.brake }
    }
}

impl Step for BrakingPulse {
    fn registers(&self) -> Vec<Register> {
        let LawWidths { width, period_width, .. } = self.config.widths;
        vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("touched", Format::BIT),
            Register::new("braking", Format::BIT),
            Register::new("memory", self.brake.to),
            Register::new("torque", self.config.widths.torque()),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let [left, previous, touched, braking, brake, torque] = *registers else { unreachable!("six registers") };
        let (left, samples) = counted_down(left, input.period);
        let last = Registers { previous, touched, braking, brake, torque };
        let sampled = || {
            let Registers { previous, touched, braking, brake, torque } = self.made(input, &last);
            [previous, touched, braking, brake, torque]
        };
        let next = W::branch(samples, sampled, || [previous, touched, braking, brake, torque]);
        ([&[left][..], &next].concat(), LawOut { torque, memory: brake })
    }
}

crate::base::listed::configured!(BrakingPulse: PulseConfig);

impl Law for BrakingPulse {
    const LOOP: &'static str = "braking_pulse_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        1
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.shown().lost()
    }
}

impl Block for BrakingPulse {
    const NAME: &'static str = "braking_pulse";
    crate::base::law::law_ports!(self => self.brake.to, "PWM count", "Braking pulse");

    fn equations(&self) -> Option<ClockEdge<'_>> {
        Some(ClockEdge::of(self))
    }

    fn reset(&mut self) -> LawOut<i64> {
        self.countdown = Countdown::default();
        self.latest = RESET;
        self.shown().words()
    }

    #[inline]
    fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
        if self.countdown.tick(input.period) {
            self.latest = self.sample(&input, &self.latest);
        }
        self.shown().words()
    }

    #[inline]
    fn quiet(&self, input: &LawIn<i64>) -> u64 {
        let next = self.sample(input, &self.latest);
        let same = |registers: &Registers<Narrowed>| {
            registers.torque == self.latest.torque && registers.brake == self.latest.brake
        };
        // The next sample takes in the motion and the entry, every later one neither.
        if !same(&next) {
            self.countdown.left()
        } else if !same(&self.sample(input, &next)) {
            self.countdown.left() + edges(input.period)
        } else {
            u64::MAX
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LawIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if self.countdown.skip(edges, input.period) {
            // After the first of the samples that were skipped, another one changes nothing.
            self.latest = self.sample(input, &self.latest);
        }
    }
}

impl Listed for BrakingPulse {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let narrow = |pulse| Self::new(PulseConfig { widths: short(), pulse });
        Ok(vec![("8_bit", narrow(2345)?), ("long", narrow(70_000)?)])
    }
}

impl InLoops for BrakingPulse {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let narrow = Self::new(PulseConfig { widths: short(), pulse: 90 })?;
        let phase = narrow.latency() + 1;
        let others = PulseConfig { widths: distinct(), pulse: 333 };
        Ok(vec![("8_bit", shaped(narrow, phase)?), ("distinct", bare(Self::new(others)?)?)])
    }
}
