//! The velocity estimators as an exchangeable part of a law, all with the same output format.

use hpu_signal::{Narrowed, Word};

use crate::base::listed::{Field, Given};
use crate::velocity::timed_velocity::TimedVelocity;
use crate::{
    Block, ButterworthConfig, ButterworthDifference, ConfigError, FilteredConfig, FilteredDifference, Foaw, FoawConfig,
    Generic, LevantConfig, LevantDifferentiator, Register, Step, VelocityConfig, VelocityRegister, WindowDifference,
    velocity::butterworth_difference, velocity::filtered_difference, velocity::foaw, velocity::levant_differentiator,
    velocity::velocity_register, velocity::window_difference,
};

hpu_signal::named! {
    /// The method by which a law estimates a velocity, in the order of the generic `ESTIMATOR`.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Estimator {
        /// Backward difference, in counts per sample.
        Difference = "difference",
        /// Backward difference through a low-pass filter, in counts per sample.
        Filtered = "filtered",
        /// Difference over a window, in counts per window.
        Window = "window",
        /// Difference over an adaptive window (FOAW), in counts per sample.
        Foaw = "foaw",
        /// The sample period divided by the time between two counts, in counts per sample.
        EdgeTimer = "edge_timer",
        /// Levant's differentiator, in counts per sample.
        Levant = "levant",
        /// Backward difference through a second-order low-pass filter, in counts per sample.
        Butterworth = "butterworth",
    }
}

/// Its place among all.
impl Field for Estimator {
    fn told(self, generics: &[&'static str]) -> Vec<(&'static str, Generic)> {
        let index = Self::ALL.iter().position(|&estimator| estimator == self).expect("all of them");
        vec![(generics[0], Generic::Integer(index as i64))]
    }

    fn given(given: &Given, generics: &[&'static str], _: &Self) -> Result<Self, ConfigError> {
        let index: i64 = given.whole(generics[0], "a whole number")?;
        let found = usize::try_from(index).ok().and_then(|index| Self::ALL.get(index)).copied();
        found.ok_or_else(|| {
            let last = Self::ALL.len() - 1;
            ConfigError::new(given.name(), format!("{} is {index}", generics[0]), format!("0 to {last}"))
        })
    }
}

/// The widths and parameters of an estimator; each estimator uses those that its block has.
#[derive(Clone, Copy)]
pub(crate) struct EstimatorConfig {
    pub(crate) width: u32,
    pub(crate) period_width: u32,
    pub(crate) frac: u32,
    pub(crate) shift: u32,
    pub(crate) weight: u32,
    pub(crate) window: u32,
    pub(crate) noise: u32,
    pub(crate) root_gain: u32,
    pub(crate) slew: u32,
    pub(crate) b0: u32,
    pub(crate) a1: i32,
    pub(crate) guard: u32,
}

/// The block that estimates the velocity.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Velocity {
    Difference(VelocityRegister, Whole),
    Filtered(FilteredDifference),
    Window(WindowDifference, Whole),
    Foaw(Foaw),
    EdgeTimer(TimedVelocity),
    Levant(LevantDifferentiator),
    Butterworth(ButterworthDifference),
}

/// A velocity in whole counts, as a word with fraction bits.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Whole {
    count: i64,
    latest: i64,
}

impl Whole {
    fn new(frac: u32) -> Self {
        Self { count: 1 << frac, latest: 0 }
    }

    #[inline]
    fn take(&mut self, counts: i64) {
        self.latest = counts * self.count;
    }

    /// Returns whole counts as a word with fraction bits.
    fn of<W: Word>(&self, counts: W) -> W {
        counts.shl(self.count.trailing_zeros())
    }

    #[inline]
    fn latest(&self) -> Narrowed {
        Narrowed { word: self.latest, rounded: false, overflowed: false }
    }
}

impl Velocity {
    pub(crate) fn new(estimator: Estimator, config: EstimatorConfig) -> Result<Self, ConfigError> {
        let EstimatorConfig { width, period_width, frac: out_frac, shift, weight, window, noise, .. } = config;
        Ok(match estimator {
            Estimator::Difference => {
                let config = VelocityConfig { width, period_width, out_width: width, ..VelocityConfig::default() };
                Self::Difference(VelocityRegister::new(config)?, Whole::new(out_frac))
            }
            Estimator::Filtered => Self::Filtered(FilteredDifference::new(FilteredConfig {
                width,
                period_width,
                shift,
                weight,
                out_frac,
                ..FilteredConfig::default()
            })?),
            Estimator::Window => {
                Self::Window(WindowDifference::new(width, period_width, window)?, Whole::new(out_frac))
            }
            Estimator::Foaw => Self::Foaw(Foaw::new(FoawConfig { width, period_width, window, noise, out_frac })?),
            Estimator::EdgeTimer => Self::EdgeTimer(TimedVelocity::new(width, period_width, out_frac)?),
            Estimator::Levant => {
                let EstimatorConfig { root_gain, slew, .. } = config;
                let config = LevantConfig { width, period_width, out_frac, root_gain, slew };
                Self::Levant(LevantDifferentiator::new(config)?)
            }
            Estimator::Butterworth => {
                let EstimatorConfig { b0, a1, guard, .. } = config;
                let config = ButterworthConfig { width, period_width, b0, a1, guard, out_frac };
                Self::Butterworth(ButterworthDifference::new(config)?)
            }
        })
    }

    /// Returns the block, if it has equations.
    pub(crate) fn block(&self) -> Option<&dyn crate::AnyBlock> {
        match self {
            Self::Difference(block, _) => Some(block),
            Self::Filtered(block) => Some(block),
            Self::Window(block, _) => Some(block),
            Self::Butterworth(block) => Some(block),
            Self::Foaw(_) | Self::EdgeTimer(_) | Self::Levant(_) => None,
        }
    }

    /// Returns the velocity, and which bits were lost to make it.
    #[inline]
    pub(crate) fn latest(&self) -> Narrowed {
        match self {
            Self::Difference(_, whole) | Self::Window(_, whole) => whole.latest(),
            Self::Filtered(block) => block.latest(),
            Self::Foaw(block) => block.latest(),
            Self::EdgeTimer(block) => block.latest(),
            Self::Levant(block) => block.latest(),
            Self::Butterworth(block) => block.latest(),
        }
    }

    /// Returns whether its clock edge has equations.
    pub(crate) fn has_equations(&self) -> bool {
        !matches!(self, Self::Foaw(block) if block.equations().is_none())
    }

    /// Returns its registers inside a law.
    pub(crate) fn registers(&self) -> Vec<Register> {
        match self {
            Self::Difference(block, _) => Register::inside("g_difference_estimate", block).collect(),
            Self::Filtered(block) => Register::inside("g_filtered_estimate", block).collect(),
            Self::Window(block, _) => Register::inside("g_window_estimate", block).collect(),
            Self::Foaw(block) => Register::inside("g_adaptive_estimate", block).collect(),
            Self::EdgeTimer(block) => block.registers(),
            Self::Levant(block) => {
                let place =
                    |inner: Option<&str>| inner.map_or("g_levant_estimate", |_| "g_levant_estimate.root_of_error");
                let all = Step::registers(block).into_iter();
                all.map(|register| Register { instance: Some(place(register.instance)), ..register }).collect()
            }
            Self::Butterworth(block) => {
                let place = |inner: Option<&str>| match inner {
                    Some("hold") => "g_butterworth_estimate.hold",
                    _ => "g_butterworth_estimate.section",
                };
                let all = Step::registers(block).into_iter();
                all.map(|register| Register { instance: Some(place(register.instance)), ..register }).collect()
            }
        }
    }

    /// Computes the registers after an edge, and the velocity before it, in words.
    pub(crate) fn step<W: Word>(&self, registers: &[W], position: W, period: W) -> (Vec<W>, W) {
        match self {
            Self::Difference(block, whole) => {
                let input = velocity_register::In { position, period, scale: W::int(0) };
                let (next, shown) = block.step(registers, input);
                (next, whole.of(shown.velocity))
            }
            Self::Filtered(block) => {
                let (next, shown) = block.step(registers, filtered_difference::In { position, period });
                (next, shown.velocity)
            }
            Self::Window(block, whole) => {
                let (next, shown) = block.step(registers, window_difference::In { position, period });
                (next, whole.of(shown.velocity))
            }
            Self::Foaw(block) => {
                let (next, shown) = block.step(registers, foaw::In { position, period });
                (next, shown.velocity)
            }
            Self::EdgeTimer(block) => block.step(registers, position, period),
            Self::Levant(block) => {
                let (next, shown) = block.step(registers, levant_differentiator::In { position, period });
                (next, shown.velocity)
            }
            Self::Butterworth(block) => {
                let (next, shown) = block.step(registers, butterworth_difference::In { position, period });
                (next, shown.velocity)
            }
        }
    }

    pub(crate) fn reset(&mut self) {
        match self {
            Self::Difference(block, whole) => whole.take(block.reset().velocity),
            Self::Filtered(block) => _ = block.reset(),
            Self::Window(block, whole) => whole.take(block.reset().velocity),
            Self::Foaw(block) => _ = block.reset(),
            Self::EdgeTimer(block) => block.reset(),
            Self::Levant(block) => _ = block.reset(),
            Self::Butterworth(block) => _ = block.reset(),
        }
    }

    #[inline]
    pub(crate) fn tick(&mut self, position: i64, period: i64) {
        match self {
            Self::Difference(block, whole) => {
                whole.take(block.tick(velocity_register::In { position, period, scale: 0 }).velocity);
            }
            Self::Filtered(block) => _ = block.tick(filtered_difference::In { position, period }),
            Self::Window(block, whole) => {
                whole.take(block.tick(window_difference::In { position, period }).velocity);
            }
            Self::Foaw(block) => _ = block.tick(foaw::In { position, period }),
            Self::EdgeTimer(block) => block.tick(position, period),
            Self::Levant(block) => _ = block.tick(levant_differentiator::In { position, period }),
            Self::Butterworth(block) => _ = block.tick(butterworth_difference::In { position, period }),
        }
    }

    #[inline]
    pub(crate) fn quiet(&self, position: i64, period: i64) -> u64 {
        match self {
            Self::Difference(block, _) => block.quiet(&velocity_register::In { position, period, scale: 0 }),
            Self::Filtered(block) => block.quiet(&filtered_difference::In { position, period }),
            Self::Window(block, _) => block.quiet(&window_difference::In { position, period }),
            Self::Foaw(block) => block.quiet(&foaw::In { position, period }),
            Self::EdgeTimer(block) => block.quiet(position),
            Self::Levant(block) => block.quiet(&levant_differentiator::In { position, period }),
            Self::Butterworth(block) => block.quiet(&butterworth_difference::In { position, period }),
        }
    }

    #[inline]
    pub(crate) fn skip(&mut self, edges: u64, position: i64, period: i64) {
        match self {
            Self::Difference(block, _) => block.skip(edges, &velocity_register::In { position, period, scale: 0 }),
            Self::Filtered(block) => block.skip(edges, &filtered_difference::In { position, period }),
            Self::Window(block, _) => block.skip(edges, &window_difference::In { position, period }),
            Self::Foaw(block) => block.skip(edges, &foaw::In { position, period }),
            Self::EdgeTimer(block) => block.skip(edges, position, period),
            Self::Levant(block) => block.skip(edges, &levant_differentiator::In { position, period }),
            Self::Butterworth(block) => block.skip(edges, &butterworth_difference::In { position, period }),
        }
    }
}
