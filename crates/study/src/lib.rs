#![doc = include_str!("../README.md")]

pub mod accuracy;
pub mod command;
pub mod fit;
mod foc;
pub mod gimbal;
pub mod identify;
pub mod limits;
pub mod map;
mod paddle;
pub mod phantom;
pub mod timing;
#[cfg(not(target_family = "wasm"))]
mod transfer;
pub mod widths;

mod axis;
mod device;
mod devices;
mod error;
mod watch;

pub use device::{Device, ToldLimits, ToldTables};
pub use devices::device;
pub use error::{Error, Kind};
pub use phantom::tables;
