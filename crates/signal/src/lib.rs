#![doc = include_str!("../README.md")]

mod clock;
mod error;
mod format;
mod machine;
mod named;
mod narrow;
mod operators;
mod ports;
mod reach;
mod recorded;
mod span;
mod term;
#[cfg(any(feature = "bitvec", feature = "fixed"))]
mod typed;
mod word;

pub use clock::{Clock, ClockError, Cycle};
pub use format::notation::Notation;
pub use format::{Format, FormatError, UNKNOWN};
pub use machine::{Int, Machine};
pub use narrow::{Narrowed, Narrowing, Overflow, Rounding};
pub use ports::{Meter, Observe, Ports, Real, Signal, SignalUse};
pub use reach::Reach;
pub use recorded::{Equations, Reading, Recorded, RecordedBit};
pub use span::Span;
pub use term::{Bit, Defined, Term};
#[cfg(feature = "bitvec")]
pub use typed::{WordBits, joined_bits, split_bits};
pub use word::{Sine, Truth, Word};
