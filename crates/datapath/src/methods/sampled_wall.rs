//! The plain wall: a spring, and a damper with any velocity estimator at a rate of its own.
//!
//! - **Equation**: `torque = spring + drag - relief`; `spring = min(floor(penetration * stiffness), top)` and
//!   `drag = floor(damping * v)` in contact only, `relief = floor(RELIEF * v)` always, drag and relief clamped to
//!   `-2^TORQUE_WIDTH .. 2^TORQUE_WIDTH - 1`, the sum fits. `top = 2^TORQUE_WIDTH - 1`.
//! - **Ports**: those of every law, of which `delta` and `scale` are ignored, in; `torque` (1,TORQUE_WIDTH+1,0) and
//!   `memory`, the velocity `v` (1,WIDTH-1,VELOCITY_FRAC), out.
//! - **Latency**: 1 edge after a sample edge to `v`, with 4 and 5 that of the division or root; `torque` is
//!   combinational.
//! - **Edge**: with `SPRING_HELD`, contact and penetration go through a `zero_order_hold`, sampled with `period`;
//!   otherwise they act at once. The estimator samples with `period * RATIO`, modulo `2^PERIOD_WIDTH`. `ESTIMATOR`:
//!   - 0 `velocity_register` [count/sample], 1 `filtered_difference` [count/sample], 2 `window_difference`
//!     [count/window], 3 `foaw` [count/sample];
//!   - 4 an `edge_timer` whose interval a `sequential_divider` divides the velocity's period by [count/sample]: a
//!     sample edge captures both, the next edge starts the division, and the edge that sees its quotient ready loads
//!     `v`, positive if the captured motion was forward, 0 if it had stopped. Sample edges until then are passed over;
//!   - 5 `levant_differentiator`, 6 `butterworth_difference` [count/sample].
//! - **Reset**: every register 0.
//! - **Overflow**: saturates.
//! - **VHDL twin**: `hdl/sampled_wall.vhd`.
//! - **Source**: Colgate and Schenkel 1997 (spring and damper); two rates and negative damping as in Colgate and Brown
//!   1994; the estimators as in their blocks.
//! - **Differs from the hardware**: combinational paths settle within the clock they change in, whatever their length.
//!   With ESTIMATOR 4 the emulator models the ports of the divider, not the registers within.

use hpu_signal::{Format, Machine, Narrowing, Overflow, Reach, Rounding, Signal, Word};

use crate::base::config::{NATURAL, WORD, within};
use crate::base::law::Wanted;
use crate::base::listed::Listed;
use crate::base::sequence::loads_before_it_reads;
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, small};
use crate::velocity::estimator::{Estimator, EstimatorConfig, Velocity};
use crate::{
    Block, ClockEdge, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, Lemma, MethodLoop, MethodLoopConfig,
    PwmConfig, Register, Shaping, Step, ZeroOrderHold, arithmetic::zero_order_hold,
};

crate::base::listed::configuration! {
    /// The widths and modes of a sampled wall.
    pub struct SampledWallConfig {
        /// The widths of every law.
        widths: LawWidths = LawWidths::default(), [];
        /// Whether the spring is sampled too; otherwise it acts at once.
        spring_held: bool = true, ["SPRING_HELD"];
        /// The estimator of the velocity.
        estimator: Estimator = Estimator::Difference, ["ESTIMATOR"];
        /// The velocity's period in periods of the spring.
        ratio: u32 = 1, ["RATIO"];
        /// Exponent of the low pass, for [`Estimator::Filtered`].
        shift: u32 = 3, ["SHIFT"];
        /// Weight of a new difference in the low pass, in units of `2^-shift`.
        weight: u32 = 1, ["WEIGHT"];
        /// Samples of the window, for [`Estimator::Window`] and [`Estimator::Foaw`].
        window: u32 = 8, ["WINDOW"];
        /// Noise of the position in counts, for [`Estimator::Foaw`].
        noise: u32 = 1, ["NOISE"];
        /// Fraction bits of the velocity.
        velocity_frac: u32 = 8, ["VELOCITY_FRAC"];
        /// Gain of negative damping, in units of the damping's LSB.
        relief: u32 = 0, ["RELIEF"];
        /// Slope for an error of one count, for [`Estimator::Levant`], as in its block.
        root_gain: u32 = 94, ["ROOT_GAIN"];
        /// Velocity added in a sample, for [`Estimator::Levant`], as in its block.
        slew: u32 = 17, ["SLEW"];
        /// Coefficient of the numerator, for [`Estimator::Butterworth`], as in its block.
        b0: u32 = 576_782, ["B0"];
        /// Coefficient of the denominator, for [`Estimator::Butterworth`], as in its block.
        a1: i32 = -2_075_951_210, ["A1"];
        /// Further fraction bits of the filter, for [`Estimator::Butterworth`], as in its block.
        guard: u32 = 10, ["GUARD"];
    }
}

hpu_signal::ports! {
    /// The values from which a torque is computed.
    pub struct Made { contact, penetration, stiffness, damping, velocity }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SampledWall {
    config: SampledWallConfig,
    wanted: Wanted,
    drag: Narrowing,
    period: Format,
    hold: ZeroOrderHold,
    held: i64,
    velocity: Velocity,
    /// The values from which the shown torque was computed, and whether it was rounded or overflowed.
    made: Made<i64>,
    fits_64: bool,
    shown: i64,
    lost: (bool, bool),
}

impl SampledWall {
    /// Returns a wall with these widths and modes.
    ///
    /// # Errors
    ///
    /// Returns an error when no law can have these widths, or when the estimator's block refuses its words. Returns an
    /// error unless the velocity has 2 to 62 bits, 0 to 30 of them fraction bits (16 from an edge timer), `ratio` is a
    /// VHDL `positive`, and the other numbers are `natural`.
    pub fn new(config: SampledWallConfig) -> Result<Self, ConfigError> {
        let SampledWallConfig { widths, ratio, shift, weight, window, noise, relief, root_gain, slew, .. } = config;
        let SampledWallConfig { b0, a1, guard, velocity_frac: frac, .. } = config;
        widths.check(Self::NAME)?;
        let LawWidths { width, period_width, .. } = widths;
        within(Self::NAME, "RATIO", ratio, 1..=NATURAL)?;
        let gains = [("ROOT_GAIN", root_gain), ("SLEW", slew), ("B0", b0), ("GUARD", guard)];
        for (generic, value) in
            [("SHIFT", shift), ("WEIGHT", weight), ("WINDOW", window), ("NOISE", noise), ("RELIEF", relief)]
                .into_iter()
                .chain(gains)
        {
            within(Self::NAME, generic, value, 0..=NATURAL)?;
        }
        within(Self::NAME, "VELOCITY_FRAC", frac, 0..=30)?;
        within(Self::NAME, "WIDTH + VELOCITY_FRAC", width + frac, WORD)?;
        let estimator =
            EstimatorConfig { width, period_width, frac, shift, weight, window, noise, root_gain, slew, b0, a1, guard };
        let mut block = Self {
            config,
            wanted: Wanted::new(&widths),
            drag: Narrowing {
                from_frac: widths.damping.frac() + frac.cast_signed(),
                to: Format::signed(widths.torque_width + 1),
                rounding: Rounding::Truncate,
                overflow: Overflow::Saturate,
            },
            period: Format::unsigned(period_width),
            hold: ZeroOrderHold::new(width + 1, period_width)?,
            held: 0,
            velocity: Velocity::new(config.estimator, estimator)?,
            made: Made { contact: 0, penetration: 0, stiffness: 0, damping: 0, velocity: 0 },
            fits_64: false,
            shown: 0,
            lost: (false, false),
        };
        let LawIn { contact, penetration, stiffness, damping, .. } = widths.inputs().map(|port| Reach::of(port.format));
        let velocity = Reach::of(block.outputs().memory.format);
        let made = Made { contact, penetration, stiffness, damping, velocity };
        block.fits_64 = Reach::fit_64(&[block.torque(made)]);
        block.reset();
        Ok(block)
    }

    /// Returns the word that the hold samples: the contact bit above the penetration.
    #[inline]
    fn sampled(&self, input: &LawIn<i64>) -> zero_order_hold::In<i64> {
        zero_order_hold::In { d: input.contact * self.contact() + input.penetration, period: input.period }
    }

    /// Returns the value of the contact bit in that word.
    #[inline]
    fn contact(&self) -> i64 {
        1 << self.config.widths.width
    }

    /// Returns the velocity's period, computed from the spring's.
    #[inline]
    pub fn velocity_period(&self, period: i64) -> i64 {
        self.period.wrap(i128::from(period) * i128::from(self.config.ratio))
    }

    /// Returns the widths and modes.
    pub fn config(&self) -> &SampledWallConfig {
        &self.config
    }

    fn velocity_word(&self) -> Format {
        let (int, frac) = (self.config.widths.width.cast_signed() - 1, self.config.velocity_frac.cast_signed());
        Format::new(true, int, frac).expect("2 to 62 bits")
    }

    fn velocity_unit(&self) -> &'static str {
        if self.config.estimator == Estimator::Window { "count/window" } else { "count/sample" }
    }

    /// Returns the block that estimates the velocity, if it has equations.
    pub fn estimator(&self) -> Option<&dyn crate::AnyBlock> {
        self.velocity.block()
    }

    /// Returns the values from which the torque is computed, with these inputs and the current registers.
    #[inline]
    fn made(&self, input: &LawIn<i64>) -> Made<i64> {
        let LawIn { stiffness, damping, .. } = *input;
        let (contact, penetration) = if self.config.spring_held {
            (self.held / self.contact(), self.held % self.contact())
        } else {
            (input.contact, input.penetration)
        };
        Made { contact, penetration, stiffness, damping, velocity: self.velocity.latest().word }
    }

    /// Computes the torque. Drag and relief have the same sign, so the clamp never acts.
    #[inline]
    pub fn torque<W: Word>(&self, made: Made<W>) -> W {
        let Made { contact, penetration, stiffness, damping, velocity } = made;
        let most = 2 * i128::from(self.config.widths.top()) + 1;
        let narrowed = |product: W, name: &str| product.narrow(&self.drag).cut(name, self.drag.to.width());
        let wall = || [self.wanted.spring(penetration, stiffness) + narrowed(damping * velocity, "drag")];
        let [wall] = W::branch(contact.is_set(), wall, || [W::int(0)]);
        let relief = narrowed(W::int(self.config.relief.into()) * velocity, "relief_torque");
        (wall - relief).limit(-most, most)
    }

    /// Computes the torque and keeps it.
    fn make(&mut self, made: Made<i64>) {
        let torque = if self.fits_64 {
            self.torque(made.map(Machine::<i64>::of)).narrowed()
        } else {
            self.torque(made.map(Machine::<i128>::of)).narrowed()
        };
        self.made = made;
        self.shown = torque.word;
        self.lost = (torque.rounded, torque.overflowed);
    }

    /// Returns the outputs with these inputs and the current registers.
    #[inline]
    fn shown(&mut self, input: &LawIn<i64>) -> LawOut<i64> {
        let made = self.made(input);
        if made != self.made {
            self.make(made);
        }
        LawOut { torque: self.shown, memory: made.velocity }
    }
}

/// The registers are those of the VHDL: those of its hold, if there is one, and of its estimator.
impl Step for SampledWall {
    fn registers(&self) -> Vec<Register> {
        let hold = self.config.spring_held.then(|| Register::inside("g_held_hold", &self.hold));
        hold.into_iter().flatten().chain(self.velocity.registers()).collect()
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let LawIn { position, contact, penetration, stiffness, damping, period, .. } = input;
        let held = if self.config.spring_held { Step::registers(&self.hold).len() } else { 0 };
        let (hold, estimator) = registers.split_at(held);
        let (mut next, mut touched) = (Vec::new(), (contact, penetration));
        if self.config.spring_held {
            let width = self.config.widths.width;
            let d = contact.shl(width) + penetration;
            let (holding, zero_order_hold::Out { q }) = self.hold.step(hold, zero_order_hold::In { d, period });
            touched = (q.shr(width), q.wrap(Format::unsigned(width)));
            next = holding;
        }
        let scaled = (period * W::int(self.config.ratio.into())).wrap(self.period);
        let (estimating, velocity) = self.velocity.step(estimator, position, scaled);
        next.extend(estimating);
        let (contact, penetration) = touched;
        let torque = self.torque(Made { contact, penetration, stiffness, damping, velocity });
        (next, LawOut { torque, memory: velocity })
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        let registers = Step::registers(self);
        let of = |path: &str| registers.iter().position(|register| register.path() == path);
        let divides = of("g_timer_start").zip(of("g_timer_divider.remaining"));
        let roots = of("g_levant_estimate.start").zip(of("g_levant_estimate.root_of_error.remaining"));
        divides.or(roots).map(|(start, own)| loads_before_it_reads(self, own, start)).into_iter().collect()
    }
}

crate::base::listed::configured!(SampledWall: SampledWallConfig);

impl Law for SampledWall {
    const LOOP: &'static str = "sampled_wall_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        0
    }

    #[inline]
    fn settle(&mut self, input: &LawIn<i64>, _: LawOut<i64>) -> LawOut<i64> {
        self.shown(input)
    }

    #[inline]
    fn lost(&self) -> [(bool, bool); 2] {
        let velocity = self.velocity.latest();
        [self.lost, (velocity.rounded, velocity.overflowed)]
    }
}

impl Block for SampledWall {
    const NAME: &'static str = "sampled_wall";
    crate::base::law::law_ports!(self => self.velocity_word(), self.velocity_unit(), "Velocity");

    fn equations(&self) -> Option<ClockEdge<'_>> {
        self.velocity.has_equations().then(|| ClockEdge::of(self))
    }

    fn reset(&mut self) -> LawOut<i64> {
        self.held = self.hold.reset().q;
        self.velocity.reset();
        self.make(Made { contact: 0, penetration: 0, stiffness: 0, damping: 0, velocity: 0 });
        LawOut { torque: self.shown, memory: 0 }
    }

    #[inline]
    fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
        if self.config.spring_held {
            self.held = self.hold.tick(self.sampled(&input)).q;
        }
        self.velocity.tick(input.position, self.velocity_period(input.period));
        self.shown(&input)
    }

    #[inline]
    fn quiet(&self, input: &LawIn<i64>) -> u64 {
        if self.made(input) != self.made {
            return 0;
        }
        let hold = if self.config.spring_held { self.hold.quiet(&self.sampled(input)) } else { u64::MAX };
        hold.min(self.velocity.quiet(input.position, self.velocity_period(input.period)))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LawIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if self.config.spring_held {
            self.hold.skip(edges, &self.sampled(input));
        }
        self.velocity.skip(edges, input.position, self.velocity_period(input.period));
    }
}

impl Listed for SampledWall {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        // Every estimator, the spring held and live, both rates, and with and without relief.
        let small = SampledWallConfig { widths: small(), velocity_frac: 4, ..SampledWallConfig::default() };
        let timed = SampledWallConfig { estimator: Estimator::EdgeTimer, ..small };
        // A corner of a fifth of the sample rate.
        let fifth = SampledWallConfig { b0: 221_805_086, a1: -396_777_000, guard: 3, ..small };
        let all = [
            ("8_bit", small),
            ("live", SampledWallConfig { spring_held: false, ratio: 3, ..small }),
            ("filtered", SampledWallConfig { estimator: Estimator::Filtered, shift: 2, relief: 5, ..small }),
            ("weighted", SampledWallConfig { estimator: Estimator::Filtered, shift: 3, weight: 5, ratio: 2, ..small }),
            ("window", SampledWallConfig { estimator: Estimator::Window, window: 3, ratio: 3, ..small }),
            ("foaw", SampledWallConfig { estimator: Estimator::Foaw, spring_held: false, relief: 90, ..small }),
            ("levant", SampledWallConfig { estimator: Estimator::Levant, root_gain: 300, slew: 9, relief: 7, ..small }),
            ("butterworth", SampledWallConfig { estimator: Estimator::Butterworth, ratio: 2, ..fifth }),
            ("edge_timer", timed),
            ("edge_timer_live", SampledWallConfig { spring_held: false, ratio: 3, relief: 3, ..timed }),
            ("edge_timer_wide", SampledWallConfig { estimator: Estimator::EdgeTimer, ..SampledWallConfig::default() }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}

impl InLoops for SampledWall {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let wall =
            || Self::new(SampledWallConfig { widths: small(), velocity_frac: 4, ..SampledWallConfig::default() });
        let pwm = PwmConfig { width: small().torque_width, ..PwmConfig::default() };
        let around = |pwm, shaping| MethodLoop::new(wall()?, MethodLoopConfig { pwm, shaping });
        let filtered = SampledWallConfig {
            widths: distinct(),
            estimator: Estimator::Filtered,
            ratio: 2,
            shift: 4,
            weight: 11,
            window: 13,
            noise: 14,
            velocity_frac: 6,
            relief: 15,
            root_gain: 333,
            slew: 17,
            ..SampledWallConfig::default()
        };
        let foaw = SampledWallConfig { estimator: Estimator::Foaw, window: 6, noise: 2, ratio: 1, ..filtered };
        Ok(vec![
            ("8_bit", around(pwm, Some(Shaping::high_pass(5)))?),
            ("antiphase", around(PwmConfig { antiphase: true, dead_time: 2, ..pwm }, None)?),
            ("immediate", around(PwmConfig { latched: false, floating: true, ..pwm }, Some(Shaping::high_pass(0)))?),
            ("distinct", shaped(Self::new(filtered)?, 16)?),
            ("distinct_foaw", bare(Self::new(foaw)?)?),
        ])
    }
}
