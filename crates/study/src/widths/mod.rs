//! Bit widths: the losses of every signal of a scene, the bits that it needs, and the gain of each bit.
//!
//! [`measured`] runs the closed loop and collects them from one run, a set of scenes, or seeded random motion.

pub mod proof;
pub mod search;
pub mod settling;

mod book;
mod device;
mod exact;
pub(crate) mod field;
mod measured;
mod method;
mod noise;
mod parts;
mod random;
mod real;
mod recommend;

use hpu_datapath::AnyBlock;
use hpu_signal::{Cycle, Format, Signal};

pub use device::{Device, Reach};
pub use field::Field;
pub use measured::{Measured, beside, idle_bits, measured, together};
pub use noise::{Asked, Beside};
pub(crate) use proof::System;
pub use random::{Walk, random};
#[cfg(test)]
pub(crate) use real::law;
pub use recommend::{Needed, Recommended, by_range, recommend};

/// Returns whether a block lies between the counters and the modulator. Counters and modulators are told by their
/// ports: all inputs or all outputs are single lines, or the block counts.
fn is_on_the_way(block: &dyn AnyBlock) -> bool {
    let is_line = |port: &Signal| port.format == Format::BIT;
    let lines = block.inputs().iter().all(is_line) || block.outputs().iter().all(is_line);
    !lines && block.counts().is_none()
}

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
