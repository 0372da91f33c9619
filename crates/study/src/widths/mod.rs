//! Bit widths: the losses of every signal of a scene, the bits that it needs, and the gain of each bit.
//!
//! [`measured`] runs the closed loop and collects them from one run, a set of scenes, or seeded random motion.

pub mod proof;
pub mod search;
pub mod settling;

pub(crate) mod field;
mod measured;
mod random;
mod recommend;

use hpu_signal::Format;

pub use field::Field;
pub use hpu_numbers::{Asked, Beside, Loss};
pub use measured::{Measured, beside, idle_bits, measured, together};
pub(crate) use proof::System;
pub use random::{Walk, random};
pub use recommend::{Needed, Recommended, by_range, recommend};

/// One signal with its measured range and losses.
#[derive(Clone, PartialEq, Debug)]
pub struct SignalRow {
    /// Its name.
    pub name: &'static str,
    /// Its format.
    pub format: Format,
    /// The unit of its values.
    pub unit: &'static str,
    /// Least and greatest word; `None` for a signal that never had a value.
    pub measured: Option<(i64, i64)>,
    /// Unused upper bits of the format over the measured range.
    pub headroom_bits: i32,
    /// Bits lost below the least significant one.
    pub rounded: Loss,
    /// Bits lost above the most significant one, or to a limit.
    pub overflowed: Loss,
    /// Signal-to-quantisation-noise ratio in decibels against the law in `f64` on the same encoder counts; infinite
    /// when the two never differed, `None` where the law has no such signal.
    pub sqnr_db: Option<f64>,
    /// The narrowest format that keeps the scene's outputs within the requested error.
    pub recommended: Option<Format>,
}
