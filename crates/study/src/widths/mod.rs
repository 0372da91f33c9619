//! Bit widths: what happened to every signal of a scene, what each needs, and what each bit buys.
//!
//! [`measured`] is what happened in closed loop: in one run, a set of scenes, or seeded random motion.

pub mod proof;
pub mod search;
pub mod settling;
pub mod tables;

mod book;
mod exact;
mod field;
mod measured;
mod method;
mod noise;
mod parts;
mod random;
mod real;
mod recommend;

use hpu_datapath::AnyBlock;
use hpu_signal::{Cycle, Format, Signal};

pub use field::Field;
pub use measured::{Measured, beside, idle_bits, measured, together};
pub use noise::{Asked, Beside};
pub(crate) use proof::System;
pub use random::{Walk, random};
pub use recommend::{Needed, Recommended, by_range, recommend};

/// Whether a block is one between the counters and the modulator: those have lines alone on one side, or count.
fn is_on_the_way(block: &dyn AnyBlock) -> bool {
    let is_line = |port: &Signal| port.format == Format::BIT;
    let lines = block.inputs().iter().all(is_line) || block.outputs().iter().all(is_line);
    !lines && block.counts().is_none()
}

/// Bits that a signal lost below its least significant one, or above its most significant one.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Loss {
    /// Clock edges during which bits were lost.
    pub edges: u64,
    /// The most that a value missed the exact one by, in the signal's unit; no number where the block does not tell.
    pub worst: f64,
    /// The first edge of them.
    pub first: Option<Cycle>,
}

/// One signal, and what happened to it.
#[derive(Clone, PartialEq, Debug)]
pub struct SignalRow {
    /// Its name.
    pub name: &'static str,
    /// Its format.
    pub format: Format,
    /// The unit of its values.
    pub unit: &'static str,
    /// Least and greatest word; none of a signal that never stood.
    pub measured: Option<(i64, i64)>,
    /// Unused upper bits of the format over the measured range.
    pub headroom_bits: i32,
    /// Bits lost below the least significant one.
    pub rounded: Loss,
    /// Bits lost above the most significant one, or to a limit.
    pub overflowed: Loss,
    /// Signal-to-quantisation-noise ratio against the law in `f64` on the same encoder counts; infinite when they never
    /// differed, none where the law has no such signal.
    pub sqnr_db: Option<f64>,
    /// The least format that keeps the scene's outputs within the error asked for.
    pub recommended: Option<Format>,
}
