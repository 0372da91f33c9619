//! The methods' reference laws, in floats and SI units; the methods' datapaths approximate them in words.
//!
//! A law reads the position `x` beyond the wall's surface once every `T`, and computes the force `F` against the
//! penetration, which is held until the next sample. Metres and newtons stand for radians and newton metres as well.
//! The hybrid and the conventional loop are [`Wall`], with the spring read at once or once a sample.
//!
//! | Law | Datapath | Page |
//! |---|---|---|
//! | [`Wall`] | `sampled_wall` | any velocity estimate, at its own rate; negative damping |
//! | [`VirtualCoupling`] | `virtual_coupling` | a massless tool between device and wall |
//! | [`PassivityController`] | `passivity_controller` | time-domain passivity observer and controller |
//! | [`EnergyBounding`] | `energy_bounding` | both published forms |
//! | [`PassiveSpring`] | `passive_spring` | energy-level spring, power scaling |
//! | [`MidpointSpring`] | none: it needs the next position | lossless, for simulation |
//! | [`InputShaper`] | `input_shaper` | the digital twin of the analog shaper |

mod any;
pub mod bounding;
pub mod coupling;
pub mod passivity;
pub mod shaper;
pub mod spring;
pub mod wall;

pub use any::AnyLaw;
pub use bounding::{BoundingForm, EnergyBounding};
pub use coupling::VirtualCoupling;
pub use passivity::{Observer, PassivityController};
pub use shaper::{InputShaper, high_pass};
pub use spring::{MidpointSpring, PassiveSpring};
pub use wall::Wall;

/// A `SampledLaw` is a law that is sampled and held. The reference laws implement it, all but [`MidpointSpring`], so
/// that one loop runs them all.
pub trait SampledLaw {
    /// Returns the force from this sample to the next, for the position `x_m` beyond the surface at this sample.
    fn sample(&mut self, x_m: f64) -> f64;
}
