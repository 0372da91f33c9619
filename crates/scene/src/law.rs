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
//! | [`BrakingPulse`] | `braking_pulse` | takes the momentum out at the wall's entry |
//! | [`TableLaw`] | `torque_table` | torques over the angle: detents, textures |
//! | [`PidLaw`] | `position_pid` | follows a target's path |
//! | [`MidpointSpring`] | none: it needs the next position | lossless, for simulation |
//! | [`InputShaper`] | `input_shaper` | the digital twin of the analog shaper |

pub use crate::method::braking_pulse::BrakingPulse;
pub use crate::method::energy_bounding::{BoundingForm, EnergyBounding};
pub use crate::method::passive_spring::{MidpointSpring, PassiveSpring};
pub use crate::method::passivity_controller::{Observer, PassivityController};
pub use crate::method::pid::PidLaw;
pub use crate::method::shaper::{InputShaper, high_pass};
pub use crate::method::table::TableLaw;
pub use crate::method::virtual_coupling::VirtualCoupling;
pub use crate::method::wall::Wall;
pub use crate::method::{AnyLaw, SampledLaw};
