//! A scene as a Functional Mock-up Unit: FMI 3.0, co-simulation.
//!
//! A unit is the plant of a scene, driven by somebody else's logic, or its whole loop. Times become clock edges by
//! rounding to the nearest one, so outputs are at most half a clock beside the communication point. `abi` has the
//! functions that an importer calls, and [`archive`] the file.

mod abi;
mod archive;
mod description;
mod unit;

pub use archive::{Export, archive};
pub use unit::Kind;
