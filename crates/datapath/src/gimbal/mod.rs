//! A spherical segment on a gimbal that a crank raises (Pediredla, Chandrasekaran, Annamraju, Thondiyath), from the
//! positions of its servos and the force at the finger to the commands of the servos.
//!
//! The joints are pitch, roll and crank, in this order. Angles are binary angles: the value 1 is half a turn.

mod config;

pub mod control_switch;
pub mod crank_table;
pub mod gimbal_inverse;
pub mod impedance_control;
pub mod servo_control;

pub use config::GimbalConfig;
pub use control_switch::{ControlSwitch, SwitchConfig};
pub use crank_table::CrankTable;
pub use gimbal_inverse::GimbalInverse;
pub use impedance_control::{ImpedanceConfig, ImpedanceControl};
pub use servo_control::{ServoConfig, ServoControl};
