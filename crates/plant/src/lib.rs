#![doc = include_str!("../README.md")]
//!
//! A plant consists of immutable laws ([`Axis`]) and a state ([`Device`]). Each mode of the piecewise-linear axis
//! (slip, stuck, prescribed; circuit closed or open) is a [`Linear`] system that flows exactly over any number of clock
//! edges: in double-double from anchor to anchor, in `f64` with a known bound of its error in between.

pub mod arm;
mod axis;
mod bridge;
mod device;
mod energy;
mod excitation;
mod flow;
mod held_device;
pub mod network;
pub mod pmsm;
mod reduced;
mod shaper;
mod stepper;
#[cfg(not(target_family = "wasm"))]
pub mod transfer;

pub use axis::{Axis, AxisError, Hand, Mass, Motor, Push};
pub use bridge::{Bridge, Circuit, Gates, Leg};
pub use device::{Device, Drive, Event, Pulses, REALS, Standing};
pub use energy::Energy;
pub use excitation::Excitation;
pub use flow::gauge::{Chord, Extent, Gauge, Measured, Pace, Stretch};
pub use flow::guard::{Band, Guard, MotionPoint};
pub use flow::linear::{Linear, Stride, Trajectory};
pub use flow::matrix::{Matrix, State};
pub use held_device::HeldDevice;
pub use shaper::Shaper;
pub use stepper::{Method, Powers, Stepper};
