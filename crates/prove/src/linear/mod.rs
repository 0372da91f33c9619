//! The stable sets of a scene's linear loop over its stiffness.
//!
//! A set may have gaps: a loop may settle, oscillate and settle again as its wall becomes stiffer. [`StableSet`] is
//! that of the loop with an ideal drive, [`DrivenSet`] that of the loop that runs, with its modulator and its
//! registers, and [`BoxSet`] that of all loops over a box of parameters. What pulses add at rest is the [`Ripple`].

mod characteristic;
mod controller;
mod crossings;
mod driven;
#[cfg(test)]
mod driven_tests;
mod jet;
mod lyapunov;
mod open_loop;
mod pulses;
mod range;
mod ripple;
mod robust;
mod stable;

pub use controller::Damping;
pub use driven::{DrivenSet, NotDriven};
pub use range::{unit, usual_range};
pub use ripple::Ripple;
pub use robust::{BoxSet, Worlds, corners};
pub use stable::{End, StableSet, Stretch, linear_settles};
