//! The input shaper subtracts the high-pass part of a torque, and never pulls. It is the digital twin of the analog
//! shaper.
//!
//! - **Equation**: with `h` the high-pass of the sampled torque `u`, `shaped = max(0, u - max(0, h))`, rounded as
//!   `ROUNDING` says, down unless it says otherwise; `shaped = torque` unless `ENABLED`.
//! - **Ports**: `torque` (1,TORQUE_WIDTH+1,0), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `shaped`
//!   (1,TORQUE_WIDTH+1,0) out. `h` is a (1,TORQUE_WIDTH+2,16); the coefficients are words of (1,1,30).
//! - **Latency**: 1 edge after a sample edge, up to `period`; none unless `ENABLED`.
//! - **Edge**: the first `PHASE` edges after reset do nothing. From then on a `biquad` and a `zero_order_hold` sample
//!   the torque on the same edges, the first one at once; what they show makes `shaped`, combinational.
//! - **Reset**: filter and hold as their blocks say, and `PHASE` edges to wait. Unless `ENABLED`, there is no register.
//! - **Overflow**: `h` saturates; `shaped` holds every value. A negative torque gives 0.
//! - **VHDL twin**: `hdl/input_shaper.vhd`.
//! - **Source**: the analog input shaper's Figure 1: two rectifiers, one behind the high-pass, one at the output; a
//!   Butterworth high-pass of 2.5 Hz, bilinear.
//! - **Differs from the hardware**: the published shaper is analog; here the filter samples and rounds, and its
//!   products take one edge.
//!
//! `PHASE` puts the samples behind those of a law with the same period, so that a torque is shaped in the sample that
//! made it.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::{COUNTER, within};
use crate::base::listed::{Configured, Field, Given, Listed};
use crate::{
    Biquad, BiquadConfig, Block, ConfigError, Generic, ROUNDING, Register, Step, ZeroOrderHold, arithmetic::biquad,
    arithmetic::zero_order_hold,
};

hpu_signal::ports! {
    /// Inputs of the shaper.
    pub struct In of |block: &InputShaper| {
        torque: block.torque, "PWM count", "Torque against the penetration";
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
    /// Outputs of the shaper.
    pub struct Out of |block: &InputShaper| {
        shaped: block.torque, "PWM count", "Torque without its transients";
    }
}

/// The phase and the filter of an enabled shaper.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shaping {
    /// Edges after reset before the first sample edge.
    pub phase: u32,
    /// Words of `B0`, `B1`, `B2`, with 30 fraction bits.
    pub b: [i32; 3],
    /// Words of `A1`, `A2`.
    pub a: [i32; 2],
}

/// The widths of a shaper, and its filter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct InputShaperConfig {
    /// Bits of a torque's magnitude.
    pub torque_width: u32,
    /// Width of the period.
    pub period_width: u32,
    /// Phase and filter; `None` passes the torque on.
    pub shaping: Option<Shaping>,
    /// The rounding of `shaped`.
    pub rounding: Rounding,
}

impl Default for InputShaperConfig {
    fn default() -> Self {
        Self { torque_width: 12, period_width: 24, shaping: None, rounding: Rounding::Truncate }
    }
}

/// The registers of an enabled shaper.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Sampled {
    /// Edges left before the first sample edge.
    waiting: u64,
    filter: Biquad,
    hold: ZeroOrderHold,
    /// The words that filter and hold show.
    h: i64,
    u: i64,
    narrowing: Narrowing,
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InputShaper {
    config: InputShaperConfig,
    torque: Format,
    sampled: Option<Sampled>,
    shown: Narrowed,
}

/// Fraction bits of the filter's output.
const FRAC: i32 = 16;

impl Sampled {
    fn new(
        torque: Format,
        InputShaperConfig { period_width, rounding, .. }: InputShaperConfig,
        Shaping { b, a, .. }: Shaping,
    ) -> Result<Self, ConfigError> {
        let format = |int, frac| Format::new(true, int, frac).expect("at most 49 bits");
        let output = format(torque.int() + 1, FRAC);
        let config = BiquadConfig {
            input: torque,
            output,
            coefficient: format(1, 30),
            b,
            a,
            period_width,
            ..BiquadConfig::default()
        };
        Ok(Self {
            waiting: 0,
            filter: Biquad::new(config)?,
            hold: ZeroOrderHold::new(torque.width(), period_width)?,
            h: 0,
            u: 0,
            narrowing: Narrowing { from_frac: FRAC, to: torque, rounding, overflow: Overflow::Saturate },
        })
    }

    /// Returns the torque less the filter's output, and which bits were lost to make it.
    #[inline]
    fn shaped(&self) -> Narrowed {
        let overflowed = self.filter.latest().overflowed;
        let rest = self.rest(Machine::<i64>::of(self.u), Machine::of(self.h));
        Narrowed { overflowed, ..rest.narrowed() }
    }

    /// Returns the held torque less the positive part of the filter's output.
    #[inline]
    fn rest<W: Word>(&self, u: W, h: W) -> W {
        let zero = W::int(0);
        (u.shl(FRAC.unsigned_abs()) - h.greater(zero)).greater(zero).narrow(&self.narrowing)
    }

    /// Returns the registers after an edge that samples, and the output before it.
    fn step<W: Word>(&self, registers: &[W], In { torque, period }: In<W>) -> (Vec<W>, W) {
        let word = self.narrowing.to;
        let (hold, filter) = registers.split_at(Step::registers(&self.hold).len());
        let d = torque.wrap(Format::unsigned(word.width()));
        let (hold, held) = self.hold.step(hold, zero_order_hold::In { d, period });
        let (filter, filtered) = self.filter.step(filter, biquad::In { x: torque, period });
        ([hold, filter].concat(), self.rest(held.q.wrap(word), filtered.y))
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) {
        if self.waiting > 0 {
            self.waiting -= 1;
            return;
        }
        let In { torque, period } = input;
        self.h = self.filter.tick(biquad::In { x: torque, period }).y;
        self.u = self.hold.tick(zero_order_hold::In { d: torque, period }).q;
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let In { torque, period } = *input;
        let filter = self.filter.quiet(&biquad::In { x: torque, period });
        let hold = self.hold.quiet(&zero_order_hold::In { d: torque, period });
        self.waiting.saturating_add(filter.min(hold))
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        let In { torque, period } = *input;
        let sampling = edges.saturating_sub(self.waiting);
        self.waiting = self.waiting.saturating_sub(edges);
        self.filter.skip(sampling, &biquad::In { x: torque, period });
        self.hold.skip(sampling, &zero_order_hold::In { d: torque, period });
    }
}

impl InputShaper {
    /// Returns a shaper with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless torque and period have 2 to 30 bits. An enabled shaper also needs a torque of at most 21
    /// bits, coefficients that each fit a (1,1,30), and a phase of at most 4095.
    pub fn new(config: InputShaperConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "TORQUE_WIDTH", config.torque_width, COUNTER)?;
        within(Self::NAME, "PERIOD_WIDTH", config.period_width, COUNTER)?;
        let torque = Format::signed(config.torque_width + 2);
        let sampled = match config.shaping {
            None => None,
            Some(shaping) => {
                within(Self::NAME, "PHASE", shaping.phase, 0..=4095)?;
                within(Self::NAME, "TORQUE_WIDTH", config.torque_width, 2..=21)?;
                Some(Sampled::new(torque, config, shaping)?)
            }
        };
        let mut block =
            Self { config, torque, sampled, shown: Narrowed { word: 0, rounded: false, overflowed: false } };
        block.reset();
        Ok(block)
    }

    /// Lets the output settle with this torque and the current registers.
    #[inline]
    pub(crate) fn settle(&mut self, torque: i64) -> Out<i64> {
        self.shown = match &self.sampled {
            Some(sampled) => sampled.shaped(),
            None => Narrowed { word: torque, rounded: false, overflowed: false },
        };
        Out { shaped: self.shown.word }
    }

    /// Returns the output, whether it was rounded, and whether the filter overflowed.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.shown
    }
}

/// The registers are those of the VHDL: first those that wait for the phase, during which hold and filter are reset,
/// then those of hold and filter.
impl Step for InputShaper {
    fn registers(&self) -> Vec<Register> {
        let (Some(sampled), Some(Shaping { phase, .. })) = (&self.sampled, self.config.shaping) else {
            return Vec::new();
        };
        let remaining = Format::unsigned((u32::BITS - phase.leading_zeros()).max(1));
        let mut all = vec![
            Register::set("g_shaper_delay_remaining", remaining, phase.into()),
            Register::set("g_shaper_early", Format::BIT, (phase > 0).into()),
        ];
        all.extend(Register::inside("g_shaper_hold", &sampled.hold));
        all.extend(Register::inside("g_shaper_filter", &sampled.filter));
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let Some(sampled) = &self.sampled else { return (Vec::new(), Out { shaped: input.torque }) };
        let [remaining, early, ref sampling @ ..] = *registers else { unreachable!("registers") };
        let (next, shaped) = sampled.step(sampling, input);
        let one = W::int(1);
        let waits = remaining.above(one);
        let waiting = [W::select(waits, remaining - one, remaining), W::of_bit(waits)];
        let next = next.into_iter().map(|word| W::select(early.is_set(), W::int(0), word));
        (waiting.into_iter().chain(next).collect(), Out { shaped })
    }
}

crate::base::block::data_sheet!(InputShaper = Self::new(InputShaperConfig::default()));

impl Block for InputShaper {
    const NAME: &'static str = "input_shaper";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        if let (Some(sampled), Some(shaping)) = (&mut self.sampled, self.config.shaping) {
            sampled.waiting = shaping.phase.into();
            sampled.h = sampled.filter.reset().y;
            sampled.u = sampled.hold.reset().q;
        }
        self.settle(0)
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if let Some(sampled) = &mut self.sampled {
            sampled.tick(input);
        }
        self.settle(input.torque)
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        match &self.sampled {
            Some(sampled) => sampled.quiet(input),
            None if input.torque == self.shown.word => u64::MAX,
            None => 0,
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if let Some(sampled) = &mut self.sampled {
            sampled.skip(edges, input);
        }
    }
}

impl Shaping {
    /// The 2.5 Hz high-pass filter at 10 kHz, for variants.
    pub(crate) fn high_pass(phase: u32) -> Self {
        Self { phase, b: [1_072_549_859, -2_145_099_718, 1_072_549_859], a: [-2_145_098_394, 1_071_359_217] }
    }
}

impl InputShaper {
    fn told(&self) -> Vec<(&'static str, Generic)> {
        let InputShaperConfig { torque_width, period_width, shaping, rounding } = self.config;
        let Shaping { phase, b, a } = shaping.unwrap_or(Shaping { phase: 0, b: [0; 3], a: [0; 2] });
        let mut all = vec![("ENABLED", Generic::Boolean(shaping.is_some()))];
        all.extend([torque_width, period_width, phase].told(&["TORQUE_WIDTH", "PERIOD_WIDTH", "PHASE"]));
        all.extend([b.told(&["B0", "B1", "B2"]), a.told(&["A1", "A2"]), rounding.told(&[ROUNDING])].concat());
        all
    }
}

impl InputShaperConfig {
    /// Reads the configuration from the generics of an entity.
    pub(crate) fn given(given: &Given) -> Result<Self, ConfigError> {
        let [torque_width, period_width] = given.naturals(["TORQUE_WIDTH", "PERIOD_WIDTH"])?;
        let shaping = if given.is("ENABLED") {
            let (b, a) = (given.field(&["B0", "B1", "B2"], [0; 3])?, given.field(&["A1", "A2"], [0; 2])?);
            Some(Shaping { phase: given.natural("PHASE")?, b, a })
        } else {
            None
        };
        let rounding = given.field(&[ROUNDING], Rounding::Truncate)?;
        Ok(Self { torque_width, period_width, shaping, rounding })
    }
}

impl Configured for InputShaper {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(InputShaperConfig::given(given)?)
    }
}

impl Listed for InputShaper {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let small = InputShaperConfig { torque_width: 6, period_width: 6, ..InputShaperConfig::default() };
        let filter = |phase, b, a| Some(Shaping { phase, b, a });
        let rounded = InputShaperConfig { shaping: filter(0, [1 << 28, -1 << 28, 3 << 26], [0, 0]), ..small };
        let all = [
            ("8_bit", small),
            ("shaping", InputShaperConfig { shaping: Some(Shaping::high_pass(0)), ..InputShaperConfig::default() }),
            ("shaping_8_bit", InputShaperConfig { shaping: Some(Shaping::high_pass(0)), ..small }),
            // The filter shows half of each difference. The other half of a step up is shown at once, so the edge of
            // the first sample is visible.
            ("phase", InputShaperConfig { shaping: filter(5, [1 << 29, -1 << 29, 0], [0, 0]), ..small }),
            // A ringing difference reaches every rectifier and the filter's limits within a few samples.
            ("ringing", InputShaperConfig { shaping: filter(1, [1 << 30, -1 << 30, 0], [0, 1 << 30]), ..small }),
            // The filter shows quarters and sixteenths, so that ties are met, and values on either side of them.
            ("nearest_even", InputShaperConfig { rounding: Rounding::NearestEven, ..rounded }),
            ("nearest_inward", InputShaperConfig { rounding: Rounding::NearestInward, ..rounded }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
