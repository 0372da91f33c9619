//! Bit widths: the losses of every signal of a scene, the bits that it needs, and the gain of each bit.
//!
//! [`measured`] runs the closed loop and collects them from one run, a set of scenes, or seeded random motion.

pub mod search;

mod book;
mod device;
pub(crate) mod field;
mod measured;
mod method;
mod noise;
mod parts;
mod random;
mod recommend;

use hpu_signal::{Cycle, Format};

pub use device::{Device, Reach};
pub use field::Field;
pub use measured::{Measured, beside, idle_bits, measured, together};
pub use noise::{Asked, Beside};
pub use random::{Walk, random};
pub use recommend::{Needed, Recommended, by_range, recommend};

/// The bits that a signal lost below its least significant bit, or above its most significant bit.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Loss {
    /// Clock edges during which bits were lost.
    pub edges: u64,
    /// The largest distance from the exact value, in the signal's unit; NaN where the block does not report it.
    pub worst: f64,
    /// The first of these edges.
    pub first: Option<Cycle>,
}

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
