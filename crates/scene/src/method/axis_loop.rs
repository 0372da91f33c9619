//! The wirings of an axis: a type for each method.

use hpu_datapath::{AnyWiring, ConventionalLoop, HybridLoop, Law, LoopConfig, MethodLoop, MethodLoopConfig, Shaping};
use hpu_signal::Format;

use crate::method::published::Published;
use crate::method::setting::{Setting, Unmade};
use crate::method::shaper::high_pass;
use crate::method::{LawMethod, Loop};

macro_rules! axis_loop {
    (($d:tt) $($kind:ident: $Law:ident, $Method:ident, $float:ident;)*) => {
        /// The wiring of an axis, whatever its method.
        #[derive(Clone)]
        #[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
        pub enum AxisLoop {
            /// Spring combinational, damping sampled.
            Hybrid(HybridLoop),
            /// Both sampled and held.
            Conventional(ConventionalLoop),
            $(#[doc = concat!("The loop around the law of `", stringify!($kind), "`.")]
            $Law(MethodLoop<hpu_datapath::$Law>),)*
        }

        /// Evaluates an expression with the wiring of an [`AxisLoop`] bound to a name, whatever its type.
        #[macro_export]
        macro_rules! with_axis_loop {
            ($d axis_loop:expr, $d wiring:ident => $d call:expr) => {
                match $d axis_loop {
                    $d crate::AxisLoop::Hybrid($d wiring) => $d call,
                    $d crate::AxisLoop::Conventional($d wiring) => $d call,
                    $($d crate::AxisLoop::$Law($d wiring) => $d call,)*
                }
            };
        }

        impl AxisLoop {
            /// Returns the wiring of a method before reset.
            pub fn new(method: &Loop, setting: &Setting, config: LoopConfig) -> Result<Self, Unmade> {
                Ok(match method {
                    Loop::Hybrid => Self::Hybrid(HybridLoop::new(config)?),
                    Loop::Conventional => Self::Conventional(ConventionalLoop::new(config)?),
                    $(Loop::Law(LawMethod::$Law(law)) => {
                        Self::$Law(around(law.block(setting)?, setting, config)?)
                    })*
                })
            }

            /// Returns the clock edges from a sample to the torque computed from it, beyond the edge at which it is
            /// taken.
            pub fn latency(&self) -> u64 {
                match self {
                    Self::Hybrid(_) | Self::Conventional(_) => 0,
                    $(Self::$Law(wiring) => u64::from(wiring.law().latency()),)*
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
