//! Any of the reference laws in floats, by value.

use crate::method::braking_pulse::BrakingPulse;
use crate::method::energy_bounding::EnergyBounding;
use crate::method::passive_spring::PassiveSpring;
use crate::method::passivity_controller::PassivityController;
use crate::method::sampled_law::SampledLaw;
use crate::method::shaper::InputShaper;
use crate::method::table::TableLaw;
use crate::method::virtual_coupling::VirtualCoupling;
use crate::method::wall::Wall;

macro_rules! any_law {
    (($d:tt) $($kind:ident: $Law:ident, $Method:ident, $float:ident;)*) => {
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

    #[inline]
    fn live_n(&self, x_m: f64) -> Option<f64> {
        with_law!(self, law => law.live_n(x_m))
    }
}
