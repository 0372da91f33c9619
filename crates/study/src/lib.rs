//! Studies of many runs: limits of a scene's stiffness, published tables run again, maps, widths, sweeps on farms, the
//! least model.

pub mod accuracy;
pub mod command;
pub mod criteria;
pub mod fit;
pub mod gimbal;
pub mod limits;
pub mod map;
pub mod page;
pub mod phantom;
pub mod quantities;
#[cfg(not(target_family = "wasm"))]
pub mod sweep;
pub mod timing;
pub mod told;
#[cfg(not(target_family = "wasm"))]
pub mod trace_table;
pub mod units;
pub mod widths;

mod axis;
mod device;
mod devices;
mod watch;

pub use device::{Device, ToldLimits, ToldTables};
pub use devices::device;
pub use phantom::tables;
