//! A spherical segment on a gimbal that a crank raises (Pediredla, Chandrasekaran, Annamraju, Thondiyath), from the
//! positions of its servos and the force at the finger to the commands of the servos.
//!
//! The joints are pitch, roll and crank, in this order. Angles are binary angles: the value 1 is half a turn.

mod config;
pub mod fractional_difference;
mod loop_config;
pub mod sample_timer;

pub mod control_switch;
pub mod crank_table;
pub mod gimbal_inverse;
pub mod gimbal_loop;
pub mod gimbal_shear_loop;
pub mod impedance_control;
pub mod servo_control;

pub use config::GimbalConfig;
pub use control_switch::{ControlSwitch, SwitchConfig};
pub use crank_table::CrankTable;
pub use gimbal_inverse::GimbalInverse;
pub use gimbal_loop::{GimbalCircuit, GimbalIn, GimbalLoop, GimbalOut, GimbalWiring};
pub use gimbal_shear_loop::GimbalShearLoop;
pub use impedance_control::{ImpedanceConfig, ImpedanceControl};
pub use loop_config::GimbalLoopConfig;
pub use servo_control::{ServoConfig, ServoControl};
