//! The vocabulary of the emulator: word formats, roundings, signals, port bundles and clock cycles.
//!
//! Every other crate uses these terms, and this crate knows none of the others. A *word* is an [`i64`] that carries the
//! bits of a run-time [`Format`]; the [`Signal`] that owns it gives its unit.

mod clock;
mod format;
mod format_text;
mod machine;
mod named;
mod narrow;
mod notation;
mod operators;
mod ports;
mod reach;
mod recorded;
mod term;
mod word;

pub use clock::{Clock, ClockError, Cycle};
pub use format::{Format, FormatError, UNKNOWN};
pub use machine::{Int, Machine};
pub use narrow::{Narrowed, Narrowing, Overflow, Rounding};
pub use notation::Notation;
pub use ports::{Meter, Observe, Ports, Real, Signal, SignalUse};
pub use reach::Reach;
pub use recorded::{Equations, Reading, Recorded, RecordedBit};
pub use term::{Bit, Defined, Term};
pub use word::{Sine, Truth, Word};
