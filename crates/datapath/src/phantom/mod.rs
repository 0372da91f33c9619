//! A three-joint PHANToM, from the counts of its encoders to the commands of its motors (Sevcik, Kopp, O'Malley et al.
//! 2009): four sources of sine and cosine, the kinematics, a room of walls, the transposed Jacobian, and the wirings.
//!
//! Joint 1 turns about the vertical, joints 2 and 3 lift the upper arm and the forearm, both measured from the
//! horizontal and the vertical; at counts of 0 the tip is at the origin, x to the right, y up, z towards the user.
//! Every narrowing is to the nearest, ties up, and wraps unless a block says otherwise.

mod config;
mod force_path;
mod variants;

pub mod command_register;
pub mod command_scaler;
pub mod cube_room;
pub mod phantom_engine;
pub mod phantom_forward;
pub mod phantom_io;
pub mod phantom_loop;
pub mod phantom_shared_loop;
pub mod phantom_torque;
pub mod sample_register;

pub use crate::trig::{
    Phase, Trig, TrigCordic, TrigIn, TrigInterpolated, TrigOut, TrigQuarter, TrigTable, Turn, Wave, trig_cordic,
    trig_interpolated, trig_quarter, trig_table,
};
pub use command_register::CommandRegister;
pub use command_scaler::CommandScaler;
pub use config::{Config, Formats};
pub use cube_room::CubeRoom;
pub use phantom_engine::PhantomEngine;
pub use phantom_forward::PhantomForward;
pub use phantom_io::{PhantomIo, PhantomIoCircuit, PhantomIoIn, PhantomIoOut};
pub use phantom_loop::{PhantomCircuit, PhantomIn, PhantomLoop, PhantomOut, PhantomWiring};
pub use phantom_shared_loop::PhantomSharedLoop;
pub use phantom_torque::PhantomTorque;
pub use sample_register::SampleRegister;
pub use variants::loop_variants;

use crate::{AnyWiring, ConfigError};

/// Returns a PHANToM's wiring without its type: each block its own logic, or one multiplier for all (`shared`). A crate
/// that makes one of the type, and looks into it, compiles all its blocks once more.
///
/// # Errors
///
/// When a block refuses its words.
pub fn wiring(config: Config, shared: bool) -> Result<Box<dyn AnyWiring>, ConfigError> {
    Ok(if shared { Box::new(PhantomSharedLoop::new(config)?) } else { Box::new(PhantomLoop::new(config)?) })
}
