//! Blocks built from the generics of their entities.

use hpu_signal::{Format, Overflow};

use crate::phantom::{
    CommandRegister, CommandScaler, CubeRoom, PhantomConfig, PhantomEngine, PhantomFormats, PhantomForward, PhantomIo,
    PhantomLoop, PhantomSharedLoop, PhantomTorque, Phase, SampleRegister, TrigCordic, TrigInterpolated, TrigQuarter,
    TrigTable, Turn,
};
use crate::{
    AnyBlock, AxisFront, Biquad, BiquadConfig, BoundingConfig, CommandLimiter, ConfigError, ConventionalLoop,
    CouplingConfig, Displacement, DividerConfig, EdgeTimer, EnergyBounding, Estimator, FilteredConfig,
    FilteredDifference, Foaw, FoawConfig, Generic, HybridLoop, InputShaper, InputShaperConfig, LawWidths, LoopConfig,
    MethodLoop, MethodLoopConfig, PassiveSpring, PassivityConfig, PassivityController, PositionCounter, Pwm, PwmConfig,
    QuadratureDecoder, SampledWall, SampledWallConfig, Saturator, SequentialDivider, Shaping, SpringConfig, SquareRoot,
    Synchronizer, TorqueSum, TruncatingMultiplier, Unilateral, VelocityConfig, VelocityRegister, VirtualCoupling,
    WindowDifference, ZeroOrderHold, block_by_name,
};

/// Returns the block of that name with these generics; its other generics are those of its default configuration.
/// Returns `None` if there is no such block.
///
/// # Errors
///
/// Returns an error if the block has no such generic, or no configuration with these values.
pub fn configured(name: &str, set: &[(&str, Generic)]) -> Option<Result<Box<dyn AnyBlock>, ConfigError>> {
    let block = block_by_name(name)?;
    Some(Given::new(&*block, set).and_then(|given| given.block()))
}

/// The values of all generics of a block.
struct Given {
    name: &'static str,
    values: Vec<(&'static str, Generic)>,
}

type Made<T> = Result<T, ConfigError>;

impl Given {
    fn new(block: &dyn AnyBlock, set: &[(&str, Generic)]) -> Made<Self> {
        let (name, mut values) = (block.name(), block.generics());
        for &(generic, value) in set {
            let names: Vec<_> = values.iter().map(|(name, _)| *name).collect();
            let Some((_, old)) = values.iter_mut().find(|(name, _)| *name == generic) else {
                let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
                return Err(ConfigError::new(name, format!("generic {generic}"), names));
            };
            if std::mem::discriminant(old) != std::mem::discriminant(&value) {
                let accepted = if matches!(old, Generic::Boolean(_)) { "true or false" } else { "a whole number" };
                let value = match value {
                    Generic::Integer(value) => value.to_string(),
                    Generic::Boolean(value) => value.to_string(),
                };
                return Err(ConfigError::new(name, format!("{generic} is {value}"), accepted));
            }
            *old = value;
        }
        Ok(Self { name, values })
    }

    fn value(&self, generic: &str) -> Generic {
        let value = self.values.iter().find(|(name, _)| *name == generic).map(|(_, value)| *value);
        value.unwrap_or_else(|| panic!("{} has the generic {generic}", self.name))
    }

    fn is(&self, generic: &str) -> bool {
        self.value(generic) == Generic::Boolean(true)
    }

    fn whole<T: TryFrom<i64>>(&self, generic: &str, accepted: &str) -> Made<T> {
        let Generic::Integer(value) = self.value(generic) else { panic!("{generic} is a number") };
        T::try_from(value).map_err(|_| ConfigError::new(self.name, format!("{generic} is {value}"), accepted))
    }

    fn natural(&self, generic: &str) -> Made<u32> {
        self.whole(generic, "0 to 2147483647")
    }

    fn naturals<const N: usize>(&self, generics: [&str; N]) -> Made<[u32; N]> {
        let mut all = [0; N];
        for (value, generic) in all.iter_mut().zip(generics) {
            *value = self.natural(generic)?;
        }
        Ok(all)
    }

    fn word(&self, generic: &str) -> Made<i32> {
        self.whole(generic, "-2147483648 to 2147483647")
    }

    fn format(&self, signed: bool, int: i32, frac: i32) -> Made<Format> {
        let accepted = "1 to 64 bits, each part -63 to 64";
        Format::new(signed, int, frac).map_err(|_| {
            ConfigError::new(self.name, format!("a word of ({},{int},{frac})", u8::from(signed)), accepted)
        })
    }

    /// Returns an unsigned format from its width and its fraction bits.
    fn unsigned(&self, stem: &str) -> Made<Format> {
        let (width, frac) = (self.word(&format!("{stem}_WIDTH"))?, self.word(&format!("{stem}_FRAC"))?);
        self.format(false, width.saturating_sub(frac), frac)
    }

    /// Returns a format from its integer bits and its fraction bits.
    fn parts(&self, signed: bool, stem: &str) -> Made<Format> {
        self.format(signed, self.word(&format!("{stem}_INT"))?, self.word(&format!("{stem}_FRAC"))?)
    }

    fn block(&self) -> Made<Box<dyn AnyBlock>> {
        let width = |generic| self.natural(generic);
        Ok(match self.name {
            "synchronizer" => Box::new(Synchronizer::new()),
            "quadrature_decoder" => Box::new(QuadratureDecoder::new(width("SETTLE")?)?),
            "position_counter" => Box::new(PositionCounter::new(width("WIDTH")?)?),
            "displacement" => Box::new(Displacement::new(width("WIDTH")?)?),
            "unilateral" => Box::new(Unilateral::new(width("WIDTH")?)?),
            "truncating_multiplier" => Box::new(self.multiplier()?),
            "velocity_register" => Box::new(VelocityRegister::new(VelocityConfig {
                width: width("WIDTH")?,
                period_width: width("PERIOD_WIDTH")?,
                rescaled: self.is("RESCALED"),
                scale: self.unsigned("SCALE")?,
                out_width: width("OUT_WIDTH")?,
            })?),
            "zero_order_hold" => Box::new(ZeroOrderHold::new(width("WIDTH")?, width("PERIOD_WIDTH")?)?),
            "torque_sum" => {
                Box::new(TorqueSum::new(width("SPRING_WIDTH")?, width("DAMPING_WIDTH")?, width("OUT_WIDTH")?)?)
            }
            "saturator" => Box::new(Saturator::new(width("IN_WIDTH")?, width("OUT_WIDTH")?, width("LIMIT")?)?),
            "command_limiter" => Box::new(CommandLimiter::new(
                width("IN_WIDTH")?,
                width("OUT_WIDTH")?,
                width("LIMIT")?,
                width("SETTLING")?,
            )?),
            "pwm" => Box::new(Pwm::new(self.pwm("WIDTH")?)?),
            "sequential_divider" => {
                let [num_width, den_width, frac, out_width] =
                    self.naturals(["NUM_WIDTH", "DEN_WIDTH", "FRAC", "OUT_WIDTH"])?;
                Box::new(SequentialDivider::new(DividerConfig { num_width, den_width, frac, out_width })?)
            }
            "square_root" => Box::new(SquareRoot::new(width("WIDTH")?)?),
            "biquad" => Box::new(Biquad::new(BiquadConfig {
                input: self.parts(true, "IN")?,
                output: self.parts(true, "OUT")?,
                coefficient: self.parts(true, "COEF")?,
                b: [self.word("B0")?, self.word("B1")?, self.word("B2")?],
                a: [self.word("A1")?, self.word("A2")?],
                period_width: width("PERIOD_WIDTH")?,
            })?),
            "filtered_difference" => {
                let [width, period_width, shift, out_frac] =
                    self.naturals(["WIDTH", "PERIOD_WIDTH", "SHIFT", "OUT_FRAC"])?;
                Box::new(FilteredDifference::new(FilteredConfig { width, period_width, shift, out_frac })?)
            }
            "window_difference" => {
                Box::new(WindowDifference::new(width("WIDTH")?, width("PERIOD_WIDTH")?, width("WINDOW")?)?)
            }
            "foaw" => {
                let [width, period_width, window, noise, out_frac] =
                    self.naturals(["WIDTH", "PERIOD_WIDTH", "WINDOW", "NOISE", "OUT_FRAC"])?;
                Box::new(Foaw::new(FoawConfig { width, period_width, window, noise, out_frac })?)
            }
            "edge_timer" => Box::new(EdgeTimer::new(width("WIDTH")?, width("TIME_WIDTH")?)?),
            "hybrid_loop" => Box::new(HybridLoop::new(self.haptic_loop()?)?),
            "conventional_loop" => Box::new(ConventionalLoop::new(self.haptic_loop()?)?),
            "axis_front" => Box::new(AxisFront::new(width("POSITION_WIDTH")?)?),
            "input_shaper" => Box::new(InputShaper::new(InputShaperConfig {
                torque_width: width("TORQUE_WIDTH")?,
                period_width: width("PERIOD_WIDTH")?,
                shaping: self.shaping("")?,
            })?),
            "sampled_wall" => Box::new(self.sampled_wall(OF_LAW)?),
            "virtual_coupling" => Box::new(self.virtual_coupling(OF_LAW)?),
            "passivity_controller" => Box::new(self.passivity_controller(OF_LAW)?),
            "energy_bounding" => Box::new(self.energy_bounding(OF_LAW)?),
            "passive_spring" => Box::new(self.passive_spring(OF_LAW)?),
            "sampled_wall_loop" => Box::new(MethodLoop::new(self.sampled_wall(OF_LOOP)?, self.method_loop()?)?),
            "virtual_coupling_loop" => Box::new(MethodLoop::new(self.virtual_coupling(OF_LOOP)?, self.method_loop()?)?),
            "passivity_controller_loop" => {
                Box::new(MethodLoop::new(self.passivity_controller(OF_LOOP)?, self.method_loop()?)?)
            }
            "energy_bounding_loop" => Box::new(MethodLoop::new(self.energy_bounding(OF_LOOP)?, self.method_loop()?)?),
            "passive_spring_loop" => Box::new(MethodLoop::new(self.passive_spring(OF_LOOP)?, self.method_loop()?)?),
            _ => self.of_a_phantom()?,
        })
    }

    /// Returns a multiplier. The entity tells no fraction bits but only how many lower bits are dropped. That many
    /// fraction bits are given to the factors, to `a` first; if the factors have room for all of them, the product is a
    /// whole number.
    fn multiplier(&self) -> Made<TruncatingMultiplier> {
        let dropped = self.word("DROP_LOWER")?;
        let factor = |width: &str, sign: &str, fraction: i32| {
            let (width, signed) = (self.word(width)?, self.is(sign));
            let fraction = fraction.clamp(0, width.max(0));
            self.format(signed, width.saturating_sub(i32::from(signed)) - fraction, fraction)
        };
        let a = factor("A_WIDTH", "A_SIGNED", dropped)?;
        let b = factor("B_WIDTH", "B_SIGNED", dropped.saturating_sub(a.frac()))?;
        let signed = a.is_signed() || b.is_signed();
        let frac = (a.frac() + b.frac()).saturating_sub(dropped);
        let out =
            self.format(signed, self.word("OUT_WIDTH")?.saturating_sub(i32::from(signed)).saturating_sub(frac), frac)?;
        let overflow = if self.is("SATURATE") { Overflow::Saturate } else { Overflow::Wrap };
        TruncatingMultiplier::new(a, b, out, overflow)
    }

    fn pwm(&self, width: &str) -> Made<PwmConfig> {
        Ok(PwmConfig {
            width: self.natural(width)?,
            antiphase: self.is("ANTIPHASE"),
            latched: self.is("LATCHED"),
            floating: self.is("FLOATING"),
            dead_time: self.natural("DEAD_TIME")?,
        })
    }

    fn haptic_loop(&self) -> Made<LoopConfig> {
        Ok(LoopConfig {
            position_width: self.natural("POSITION_WIDTH")?,
            stiffness: self.unsigned("STIFFNESS")?,
            damping: self.unsigned("DAMPING")?,
            period_width: self.natural("PERIOD_WIDTH")?,
            velocity_width: self.natural("VELOCITY_WIDTH")?,
            rescaled: self.is("RESCALED"),
            scale: self.unsigned("SCALE")?,
            saturate: self.is("SATURATE"),
            pwm: self.pwm("PWM_WIDTH")?,
            settling: self.natural("SETTLING")?,
        })
    }

    fn shaping(&self, stem: &str) -> Made<Option<Shaping>> {
        let named = |name: &str| format!("{stem}{name}");
        if !self.is(&named("ENABLED")) {
            return Ok(None);
        }
        let word = |name: &str| self.word(&named(name));
        let (b, a) = ([word("B0")?, word("B1")?, word("B2")?], [word("A1")?, word("A2")?]);
        Ok(Some(Shaping { phase: self.natural(&named("PHASE"))?, b, a }))
    }

    fn method_loop(&self) -> Made<MethodLoopConfig> {
        Ok(MethodLoopConfig { pwm: self.pwm("PWM_WIDTH")?, shaping: self.shaping("SHAPER_")? })
    }

    fn law(&self, [width, torque_width]: [&str; 2]) -> Made<LawWidths> {
        Ok(LawWidths {
            width: self.natural(width)?,
            stiffness: self.unsigned("STIFFNESS")?,
            damping: self.unsigned("DAMPING")?,
            period_width: self.natural("PERIOD_WIDTH")?,
            scale: self.unsigned("SCALE")?,
            torque_width: self.natural(torque_width)?,
        })
    }

    fn sampled_wall(&self, names: [&str; 2]) -> Made<SampledWall> {
        let index: i64 = self.whole("ESTIMATOR", "a whole number")?;
        let estimator = Estimator::ALL.into_iter().find(|estimator| estimator.index() == index).ok_or_else(|| {
            let last = Estimator::ALL.len() - 1;
            ConfigError::new(self.name, format!("ESTIMATOR is {index}"), format!("0 to {last}"))
        })?;
        SampledWall::new(SampledWallConfig {
            widths: self.law(names)?,
            spring_held: self.is("SPRING_HELD"),
            estimator,
            ratio: self.natural("RATIO")?,
            shift: self.natural("SHIFT")?,
            window: self.natural("WINDOW")?,
            noise: self.natural("NOISE")?,
            velocity_frac: self.natural("VELOCITY_FRAC")?,
            relief: self.natural("RELIEF")?,
        })
    }

    fn virtual_coupling(&self, names: [&str; 2]) -> Made<VirtualCoupling> {
        let [extension_frac, gain_frac, share, free, held] =
            self.naturals(["EXTENSION_FRAC", "GAIN_FRAC", "SHARE", "FREE", "HELD"])?;
        VirtualCoupling::new(CouplingConfig { widths: self.law(names)?, extension_frac, gain_frac, share, free, held })
    }

    fn passivity_controller(&self, names: [&str; 2]) -> Made<PassivityController> {
        let [energy_width, credit] = self.naturals(["ENERGY_WIDTH", "CREDIT"])?;
        let (widths, exact) = (self.law(names)?, self.is("EXACT"));
        PassivityController::new(PassivityConfig { widths, exact, energy_width, credit })
    }

    fn energy_bounding(&self, names: [&str; 2]) -> Made<EnergyBounding> {
        let [c1, c2, bound_frac, bound_width, energy_width, root_width] =
            self.naturals(["C1", "C2", "BOUND_FRAC", "BOUND_WIDTH", "ENERGY_WIDTH", "ROOT_WIDTH"])?;
        EnergyBounding::new(BoundingConfig {
            widths: self.law(names)?,
            least_conservative: self.is("LEAST_CONSERVATIVE"),
            c1,
            c2,
            bound_frac,
            bound_width,
            energy_width,
            root_width,
        })
    }

    fn passive_spring(&self, names: [&str; 2]) -> Made<PassiveSpring> {
        let [extension_frac, alpha] = self.naturals(["EXTENSION_FRAC", "ALPHA"])?;
        let (widths, revive) = (self.law(names)?, self.is("REVIVE"));
        PassiveSpring::new(SpringConfig { widths, extension_frac, alpha, revive })
    }

    fn of_a_phantom(&self) -> Made<Box<dyn AnyBlock>> {
        let width = |generic| self.natural(generic);
        Ok(match self.name {
            "trig_table" => {
                let [count_width, depth_width, num, den] =
                    self.naturals(["COUNT_WIDTH", "DEPTH_WIDTH", "TURN_NUM", "TURN_DEN"])?;
                Box::new(TrigTable::new(count_width, depth_width, Turn { num, den }, self.parts(true, "TRIG")?)?)
            }
            "trig_quarter" => Box::new(TrigQuarter::new(self.phase()?, width("QUARTER_WIDTH")?)?),
            "trig_interpolated" => {
                Box::new(TrigInterpolated::new(self.phase()?, width("QUARTER_WIDTH")?, width("REST_WIDTH")?)?)
            }
            "trig_cordic" => Box::new(TrigCordic::new(self.phase()?, width("ITERATIONS")?, width("GUARD")?)?),
            "sample_register" => Box::new(SampleRegister::new(width("WIDTH")?, width("PERIOD_WIDTH")?)?),
            "phantom_forward" => Box::new(PhantomForward::new(&self.formats()?, self.lengths()?)?),
            "cube_room" => Box::new(CubeRoom::new(&self.formats()?, width("FORCE_LIMIT")?)?),
            "phantom_torque" => Box::new(PhantomTorque::new(&self.formats()?, self.lengths()?)?),
            "command_scaler" => Box::new(CommandScaler::new(
                self.parts(true, "TORQUE")?,
                width("GAIN")?,
                width("GAIN_FRAC")?,
                width("COMMAND_WIDTH")?,
            )?),
            "command_register" => {
                Box::new(CommandRegister::new(width("WIDTH")?, width("PERIOD_WIDTH")?, width("DELAY")?)?)
            }
            "phantom_engine" => Box::new(PhantomEngine::new(self.phantom(PhantomConfig::default())?)?),
            "phantom_loop" => Box::new(PhantomLoop::new(self.phantom(self.encoders()?)?)?),
            "phantom_shared_loop" => Box::new(PhantomSharedLoop::new(self.phantom(self.encoders()?)?)?),
            "phantom_io" => Box::new(PhantomIo::new(width("POSITION_WIDTH")?, width("COMMAND_WIDTH")?)?),
            name => panic!("{name} is made of its generics"),
        })
    }

    fn phase(&self) -> Made<Phase> {
        let [count_width, width, step] = self.naturals(["COUNT_WIDTH", "PHASE_WIDTH", "STEP"])?;
        Ok(Phase { count_width, width, step, trig: self.parts(true, "TRIG")? })
    }

    /// Returns the formats that the block has as generics; the others are those of the default configuration.
    fn formats(&self) -> Made<PhantomFormats> {
        let has = |generic: &str| self.values.iter().any(|(name, _)| *name == generic);
        let default = PhantomFormats::default();
        let parts = |signed: bool, stem: &str, default: Format| {
            if has(&format!("{stem}_INT")) { self.parts(signed, stem) } else { Ok(default) }
        };
        Ok(PhantomFormats {
            trig: parts(true, "TRIG", default.trig)?,
            length_frac: if has("LENGTH_FRAC") { self.natural("LENGTH_FRAC")? } else { default.length_frac },
            position: parts(true, "POSITION", default.position)?,
            stiffness: parts(false, "STIFFNESS", default.stiffness)?,
            force: parts(true, "FORCE", default.force)?,
            torque: parts(true, "TORQUE", default.torque)?,
        })
    }

    fn lengths(&self) -> Made<[u32; 2]> {
        self.naturals(["LENGTH_1", "LENGTH_2"])
    }

    fn encoders(&self) -> Made<PhantomConfig> {
        let turn = |joint: usize| {
            let [num, den] = self.naturals([&*format!("TURN_NUM_{joint}"), &*format!("TURN_DEN_{joint}")])?;
            Ok(Turn { num, den })
        };
        Ok(PhantomConfig {
            position_width: self.natural("POSITION_WIDTH")?,
            depth_width: self.natural("DEPTH_WIDTH")?,
            turns: [turn(1)?, turn(2)?, turn(3)?],
            ..PhantomConfig::default()
        })
    }

    fn phantom(&self, encoders: PhantomConfig) -> Made<PhantomConfig> {
        Ok(PhantomConfig {
            period_width: self.natural("PERIOD_WIDTH")?,
            formats: self.formats()?,
            lengths: self.lengths()?,
            force_limit: self.natural("FORCE_LIMIT")?,
            gains: self.naturals(["GAIN_1", "GAIN_2", "GAIN_3"])?,
            gain_frac: self.natural("GAIN_FRAC")?,
            command_width: self.natural("COMMAND_WIDTH")?,
            delay: self.natural("DELAY")?,
            ..encoders
        })
    }
}

/// The generics of the widths of position and torque: in a law, and in the loop around it.
const OF_LAW: [&str; 2] = ["WIDTH", "TORQUE_WIDTH"];
const OF_LOOP: [&str; 2] = ["POSITION_WIDTH", "PWM_WIDTH"];
