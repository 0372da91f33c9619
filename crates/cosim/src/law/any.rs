//! Any of the laws, by value.

use super::{EnergyBounding, InputShaper, PassiveSpring, PassivityController, SampledLaw, VirtualCoupling, Wall};

/// Any of the laws that a scene can ask for.
#[derive(Clone, PartialEq, Debug)]
pub enum AnyLaw {
    /// A plain wall.
    Wall(Wall),
    /// Virtual coupling.
    VirtualCoupling(VirtualCoupling),
    /// Passivity observer and controller.
    PassivityController(PassivityController),
    /// Energy bounding.
    EnergyBounding(EnergyBounding),
    /// The energy-level spring.
    PassiveSpring(PassiveSpring),
    /// Another law with the input shaper behind it.
    Shaped(Box<InputShaper<AnyLaw>>),
}

impl AnyLaw {
    /// Sets stiffness and scale from now on, as shares of those that the law began with (`start`), as a ramp changes
    /// them.
    ///
    /// # Panics
    ///
    /// When `start` is another law.
    pub fn vary(&mut self, start: &Self, stiffness: f64, scale: f64) {
        match (self, start) {
            (Self::Wall(now), Self::Wall(start)) => now.stiffness_n_per_m = start.stiffness_n_per_m * stiffness,
            (Self::VirtualCoupling(now), Self::VirtualCoupling(start)) => {
                now.coupling_n_per_m = start.coupling_n_per_m * stiffness;
            }
            (Self::PassivityController(now), Self::PassivityController(start)) => {
                now.wall.stiffness_n_per_m = start.wall.stiffness_n_per_m * stiffness;
            }
            (Self::EnergyBounding(now), Self::EnergyBounding(start)) => {
                now.wall.stiffness_n_per_m = start.wall.stiffness_n_per_m * stiffness;
            }
            (Self::PassiveSpring(now), Self::PassiveSpring(start)) => {
                now.stiffness_n_per_m = start.stiffness_n_per_m * stiffness;
                now.beta = start.beta * scale;
            }
            (Self::Shaped(now), Self::Shaped(start)) => now.law.vary(&start.law, stiffness, scale),
            _ => unreachable!("a law stays what it is"),
        }
    }
}

impl SampledLaw for AnyLaw {
    #[inline]
    fn sample(&mut self, x_m: f64) -> f64 {
        match self {
            Self::Wall(law) => law.sample(x_m),
            Self::VirtualCoupling(law) => law.sample(x_m),
            Self::PassivityController(law) => law.sample(x_m),
            Self::EnergyBounding(law) => law.sample(x_m),
            Self::PassiveSpring(law) => law.sample(x_m),
            Self::Shaped(law) => law.sample(x_m),
        }
    }
}
