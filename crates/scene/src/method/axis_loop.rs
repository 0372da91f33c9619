//! The wirings of an axis, a type for each method, and the reference laws in floats.

use hpu_datapath::{AnyWiring, ConventionalLoop, HybridLoop, Law, LoopConfig, MethodLoop, MethodLoopConfig, Shaping};
use hpu_signal::Format;

use crate::method::braking_pulse::BrakingPulse;
use crate::method::energy_bounding::EnergyBounding;
use crate::method::passive_spring::PassiveSpring;
use crate::method::passivity_controller::PassivityController;
use crate::method::pid::PidLaw;
use crate::method::published::Published;
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::method::shaper::InputShaper;
use crate::method::shaper::high_pass;
use crate::method::table::TableLaw;
use crate::method::virtual_coupling::VirtualCoupling;
use crate::method::wall::Wall;
use crate::method::{LawMethod, Loop};

macro_rules! axis_loop {
    (($d:tt) $($(#[$on:meta])? $kind:ident: $Law:ident, $Method:ident, $float:ident;)*) => {
        /// The wiring of an axis, whatever its method.
        #[derive(Clone)]
        #[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
        pub enum AxisLoop {
            /// Spring combinational, damping sampled.
            Hybrid(HybridLoop),
            /// Both sampled and held.
            Conventional(ConventionalLoop),
            $(#[doc = concat!("The loop around the law of `", stringify!($kind), "`.")]
            $(#[$on])?
            $Law(MethodLoop<hpu_datapath::$Law>),)*
        }

        /// Evaluates an expression with the wiring of an [`AxisLoop`] bound to a name, whatever its type.
        #[macro_export]
        macro_rules! with_axis_loop {
            ($d axis_loop:expr, $d wiring:ident => $d call:expr) => {
                match $d axis_loop {
                    $d crate::AxisLoop::Hybrid($d wiring) => $d call,
                    $d crate::AxisLoop::Conventional($d wiring) => $d call,
                    $($(#[$on])? $d crate::AxisLoop::$Law($d wiring) => $d call,)*
                }
            };
        }

        impl AxisLoop {
            /// Returns the wiring of a method before reset.
            pub fn new(method: &Loop, setting: &Setting, config: LoopConfig) -> Result<Self, Unmade> {
                Ok(match method {
                    Loop::Hybrid => Self::Hybrid(HybridLoop::new(config)?),
                    Loop::Conventional => Self::Conventional(ConventionalLoop::new(config)?),
                    $($(#[$on])? Loop::Law(LawMethod::$Law(law)) => {
                        Self::$Law(around(law.block(setting)?, setting, config)?)
                    })*
                    #[cfg(target_family = "wasm")]
                    Loop::Law(law) => {
                        let reason = format!("a page in a browser has no {}; use hpu itself", law.name());
                        return Err(setting.places.error("method.kind", reason).into());
                    }
                })
            }

            /// Returns the clock edges from a sample to the torque computed from it, beyond the edge at which it is
            /// taken.
            pub fn latency(&self) -> u64 {
                match self {
                    Self::Hybrid(_) | Self::Conventional(_) => 0,
                    $($(#[$on])? Self::$Law(wiring) => u64::from(wiring.law().latency()),)*
                }
            }
        }
    };
}
laws!(axis_loop);

impl AxisLoop {
    /// Returns the wiring without its type. Never inlined: each crate into which this went would compile every wiring
    /// and block once more.
    #[inline(never)]
    pub fn wiring(&self) -> &dyn AnyWiring {
        with_axis_loop!(self, wiring => wiring)
    }
}

/// Puts the loop around a law. A shaper samples when the law's torque is there.
fn around<L: Law>(law: L, setting: &Setting, config: LoopConfig) -> Result<MethodLoop<L>, Unmade> {
    if i64::from(law.latency()) >= setting.period {
        let most_hz = setting.clock_hz as f64 / f64::from(law.latency() + 1);
        let reason = format!(
            "{} clocks a sample, {} take {}; write at most {most_hz:.0} Hz, or fewer bits",
            setting.period,
            L::NAME,
            law.latency()
        );
        return Err(setting.places.error("method.sample_rate", reason).into());
    }
    let shaping = setting.shaper_hz.map(|cutoff_hz| {
        let unit = Format::new(true, 1, 30).expect("32 bits").lsb();
        let word = |value: f64| (value / unit).round() as i32;
        let [b0, b1, b2, a1, a2] = high_pass(cutoff_hz, setting.period_s).map(word);
        Shaping { phase: law.latency() + 1, b: [b0, b1, b2], a: [a1, a2] }
    });
    Ok(MethodLoop::new(law, MethodLoopConfig { pwm: config.pwm, shaping })?)
}

macro_rules! any_law {
    (($d:tt) $($(#[$on:meta])? $kind:ident: $Law:ident, $Method:ident, $float:ident;)*) => {
        /// Any of the reference laws that a scene can ask for.
        #[derive(Clone, PartialEq, Debug)]
        pub enum AnyLaw {
            /// The plain wall of the two loops.
            Wall(Wall),
            $(#[doc = concat!("The law of `", stringify!($kind), "`.")] $Law($float),)*
            /// Another law with the input shaper behind it.
            Shaped(Box<InputShaper<AnyLaw>>),
        }

        macro_rules! with_law {
            ($d any:expr, $d law:ident => $d call:expr) => {
                match $d any {
                    AnyLaw::Wall($d law) => $d call,
                    $(AnyLaw::$Law($d law) => $d call,)*
                    AnyLaw::Shaped($d law) => $d call,
                }
            };
        }
    };
}
laws!(any_law);

impl SampledLaw for AnyLaw {
    #[inline]
    fn sample(&mut self, x_m: f64) -> f64 {
        with_law!(self, law => law.sample(x_m))
    }

    fn vary(&mut self, stiffness_n_per_m: f64, scale: f64) {
        with_law!(self, law => law.vary(stiffness_n_per_m, scale));
    }

    fn aim(&mut self, target_m: f64) {
        with_law!(self, law => law.aim(target_m));
    }

    #[inline]
    fn live_n(&self, x_m: f64) -> Option<f64> {
        with_law!(self, law => law.live_n(x_m))
    }
}
