//! The circuit of the two haptic loops. They differ by one register: with `HELD`, the wall reads the position through a
//! zero-order hold.

use hpu_signal::{Format, Overflow, Signal};

use crate::base::config::{COUNTER, within};
use crate::base::listed::{Configured, Given, Listed};
use crate::circuit::circuit_loop::{AxisCircuit, CircuitLoop, LoopCircuit, Passed, Way};
use crate::circuit::{Set, circuit, put};
use crate::{
    AnyWiring, Block, CommandLimiter, ConfigError, Displacement, Generic, LoopConfig, LoopIn, LoopOut, PositionCounter,
    Pwm, PwmConfig, QuadratureDecoder, Synchronizer, TorqueSum, TruncatingMultiplier, Unilateral, VelocityConfig,
    VelocityRegister, ZeroOrderHold, arithmetic::command_limiter, arithmetic::torque_sum,
    arithmetic::truncating_multiplier, arithmetic::unilateral, arithmetic::zero_order_hold, pins::displacement,
    pins::position_counter, pins::pwm, pins::quadrature_decoder, pins::synchronizer, velocity::velocity_register,
};

/// Returns a haptic loop without its type, for callers that would compile both of them once more.
///
/// # Errors
///
/// When a block refuses its words.
pub fn haptic_wiring(config: LoopConfig, is_conventional: bool) -> Result<Box<dyn AnyWiring>, ConfigError> {
    Ok(if is_conventional {
        Box::new(HapticLoop::<true>::new(config)?)
    } else {
        Box::new(HapticLoop::<false>::new(config)?)
    })
}

/// A haptic loop, position counter to H-bridge: [`HybridLoop`](crate::HybridLoop) or
/// [`ConventionalLoop`](crate::ConventionalLoop).
pub type HapticLoop<const HELD: bool> = CircuitLoop<HapticCircuit<HELD>, 25>;

circuit! {
    /// The blocks of a haptic loop up to the command.
    pub struct HapticCircuit[const HELD: bool][HELD][25] { config: LoopConfig, modulator: Pwm }
    nets {
        a_pin, b_pin, reference, stiffness, damping, period, scale, a_high, a_low, b_high, b_low, a, b, step, error,
        position, held if HELD else position, delta, contact, penetration, spring, velocity, drag, torque, command,
    }
    sync: Synchronizer = synchronizer { a_pin, b_pin } -> { a, b };
    decoder: QuadratureDecoder = quadrature_decoder { a, b } -> { step, error };
    counter: PositionCounter = position_counter { step } -> { position };
    hold: ZeroOrderHold = zero_order_hold { d: position, period } -> { q: held } if HELD;
    offset: Displacement = displacement { position: held, reference } -> { delta };
    wall: Unilateral = unilateral { delta } -> { contact, penetration };
    spring_mult: TruncatingMultiplier = truncating_multiplier { a: penetration, b: stiffness } -> { product: spring };
    velocity_reg: VelocityRegister = velocity_register { position, period, scale } -> { velocity };
    damping_mult: TruncatingMultiplier = truncating_multiplier { a: velocity, b: damping } -> { product: drag };
    sum: TorqueSum = torque_sum { spring, damping: drag, contact } -> { torque };
    limiter: CommandLimiter = command_limiter { value: torque } -> { limited: command };
}

impl<const HELD: bool> HapticLoop<HELD> {
    /// Returns a loop in its state after reset.
    ///
    /// # Errors
    ///
    /// Returns an error when a block refuses its widths, and unless stiffness and damping are unsigned with 0 or more
    /// fraction bits.
    pub fn new(config: LoopConfig) -> Result<Self, ConfigError> {
        for (word, format) in [("stiffness", config.stiffness), ("damping", config.damping)] {
            if format.is_signed() || format.frac() < 0 {
                let found = format!("{word} is {format}");
                return Err(ConfigError::new(Self::NAME, found, "unsigned with 0 or more fraction bits, as (0,12,0)"));
            }
        }
        let (depth, width) = (config.position_width, config.pwm.width);
        within(Self::NAME, "PWM_WIDTH", width, COUNTER)?;
        let velocity = VelocityConfig {
            width: depth,
            period_width: config.period_width,
            rescaled: config.rescaled,
            scale: config.scale,
            out_width: config.velocity_width,
        };
        let overflow = if config.saturate { Overflow::Saturate } else { Overflow::Wrap };
        let multiplier = |a, b, out| TruncatingMultiplier::new(a, b, out, overflow);
        let circuit = HapticCircuit {
            paces: Paces::default(),
            config,
            velocity_reg: VelocityRegister::new(velocity)?,
            sync: Synchronizer::new(),
            decoder: QuadratureDecoder::default(),
            counter: PositionCounter::new(depth)?,
            hold: ZeroOrderHold::new(depth, config.period_width)?,
            offset: Displacement::new(depth)?,
            wall: Unilateral::new(depth)?,
            spring_mult: multiplier(Format::unsigned(depth), config.stiffness, Format::unsigned(width))?,
            damping_mult: multiplier(Format::signed(config.velocity_width), config.damping, Format::signed(width + 1))?,
            sum: TorqueSum::new(width, width + 1, width + 2)?,
            limiter: CommandLimiter::new(width + 2, width + 1, (1 << width) - 1, config.settling)?,
            modulator: Pwm::new(config.pwm)?,
        };
        Ok(Self::of(circuit))
    }
}

impl<const HELD: bool> Default for HapticLoop<HELD> {
    fn default() -> Self {
        Self::new(LoopConfig::default()).expect("the data sheet's default")
    }
}

impl<const HELD: bool> LoopCircuit<25> for HapticCircuit<HELD> {
    const NAME: &'static str = if HELD { "conventional_loop" } else { "hybrid_loop" };

    const INPUTS: usize = 7;
    type In<T> = LoopIn<T>;
    type Out<T> = LoopOut<T>;

    fn inputs(&self) -> LoopIn<Signal> {
        let synchronizer::In { a_pin, b_pin } = self.sync.inputs();
        let displacement::In { reference, .. } = self.offset.inputs();
        let velocity_register::In { period, scale, .. } = self.velocity_reg.inputs();
        let stiffness = Signal::new("stiffness", self.config.stiffness, "PWM count/count", "Stiffness of the wall");
        let damping =
            Signal::new("damping", self.config.damping, "PWM count/(count/sample)", "Damping inside the wall");
        LoopIn { a_pin, b_pin, reference, stiffness, damping, period, scale }
    }

    fn outputs(&self) -> LoopOut<Signal> {
        let pwm::Out { a_high, a_low, b_high, b_low } = self.modulator.outputs();
        LoopOut { a_high, a_low, b_high, b_low }
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.config.generics()
    }

    fn described(&self, net: Signal) -> Signal {
        let torque_sum::In { spring, damping, .. } = self.sum.inputs();
        match net.name {
            "held" => Signal { doc: "Position of the latest sample edge", ..net },
            "spring" => spring,
            "drag" => Signal { name: "drag", ..damping },
            _ => net,
        }
    }

    #[inline]
    fn modulator(&self) -> Option<&Pwm> {
        Some(&self.modulator)
    }

    #[inline]
    fn modulator_mut(&mut self) -> Option<&mut Pwm> {
        Some(&mut self.modulator)
    }

    const PASSED: Set = 1 << Self::NET.a | 1 << Self::NET.b | 1 << Self::NET.step | 1 << Self::NET.error;

    #[inline(always)]
    fn pass_step(&mut self, edge: u64, words: &mut [i64; 25]) -> Option<Passed> {
        let Paces { sync, decoder, counter, hold, velocity_reg, limiter, .. } = &mut self.paces;
        let mut others = [counter.due(), hold.due(), velocity_reg.due(), limiter.due()].into_iter();
        let (sync, decoder) = ((sync, &mut self.sync), (decoder, &mut self.decoder));
        let way = Way { sync, decoder, counter: &mut self.counter };
        let (synchronizer::Out { a, b }, [step, position]) = way.pass(edge, |last| others.any(|due| due <= last))?;
        let nets = [(Self::NET.a, a), (Self::NET.b, b), (Self::NET.position, position)];
        let changed = nets.into_iter().fold(0, |changed, (net, word)| changed | put(words, net, word));
        Some(Passed { changed, step: (Self::NET.step, step) })
    }
}

impl<const HELD: bool> AxisCircuit<25> for HapticCircuit<HELD> {
    #[inline]
    fn load(&mut self, edge: u64, position: i64, words: &mut [i64; 25]) -> Set {
        self.paces.counter.catch_up(&mut self.counter, edge);
        put(words, Self::NET.position, self.counter.load(position))
    }
}

impl<const HELD: bool> Configured for HapticLoop<HELD> {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(LoopConfig {
            position_width: given.natural("POSITION_WIDTH")?,
            stiffness: given.sized(false, "STIFFNESS")?,
            damping: given.sized(false, "DAMPING")?,
            period_width: given.natural("PERIOD_WIDTH")?,
            velocity_width: given.natural("VELOCITY_WIDTH")?,
            rescaled: given.is("RESCALED"),
            scale: given.sized(false, "SCALE")?,
            saturate: given.is("SATURATE"),
            pwm: PwmConfig::given(&given.renamed(&pwm::IN_LOOP))?,
            settling: given.natural("SETTLING")?,
        })
    }
}

impl<const HELD: bool> Listed for HapticLoop<HELD> {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |int, frac| Format::new(false, int, frac).expect("8 bits");
        let small = LoopConfig {
            position_width: 8,
            stiffness: format(6, 2),
            damping: format(4, 4),
            period_width: 6,
            velocity_width: 6,
            pwm: PwmConfig { width: 6, ..PwmConfig::default() },
            ..LoopConfig::default()
        };
        let all = [
            ("wrap", LoopConfig { saturate: false, ..LoopConfig::default() }),
            ("8_bit", small),
            ("rescaled", LoopConfig { rescaled: true, scale: format(4, 4), ..small }),
            ("antiphase", LoopConfig { pwm: PwmConfig { antiphase: true, dead_time: 2, ..small.pwm }, ..small }),
            ("immediate", LoopConfig { pwm: PwmConfig { latched: false, floating: true, ..small.pwm }, ..small }),
            ("settling", LoopConfig { settling: 3, pwm: PwmConfig { latched: false, ..small.pwm }, ..small }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
