//! The vocabulary of the emulator: word formats, roundings, signals, port bundles and clock cycles.
//!
//! Every other crate uses these terms, and this crate knows none of the others. A *word* is an [`i64`] that carries the
//! bits of a run-time [`Format`]; the [`Signal`] that owns it gives its unit.

mod clock;
mod format;
mod format_text;
mod narrow;
mod notation;
mod operators;
mod ports;
mod recorded;
mod term;
mod word;

pub use clock::{Clock, ClockError, Cycle};
pub use format::{Format, FormatError, UNKNOWN};
pub use narrow::{Narrowed, Narrowing, Overflow, Rounding};
pub use notation::Notation;
pub use ports::{Meter, Observe, Ports, Real, Signal, SignalUse};
pub use recorded::{Equations, Recorded, RecordedBit};
pub use term::{Bit, Defined, Term};
pub use word::{Int, Machine, Reach, Sine, Truth, Word};
