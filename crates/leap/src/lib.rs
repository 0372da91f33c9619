//! A simulator of synthesised netlists that leaps over the clock edges at which nothing but counters moves.
//!
//! Between two changes of its inputs, most registers of a controller rest, and a few count. So every word of the
//! netlist is described as a line with a horizon ([`Line`]):
//!
//! ```text
//! word(t) = (word + slope t) mod 2^width   for 0 <= t < horizon,   t in clock edges from now
//! ```
//!
//! The word of now is always exact; a horizon of 1 says that nothing is known of later edges. One pass over the cells
//! takes the lines of the registers to those of all words ([`Operation::line`]). A register is assumed to move by the
//! difference between its next word and its present one. The assumption is *checked* for `n` edges at once where the
//! line of its next word has the same slope and a horizon of at least `n`: by induction the register then moves by that
//! difference at each of the `n` edges. So [`Leap`] takes the least horizon of all registers and outputs, and jumps
//! there. A pass that finds no horizon costs time and never a wrong word: an ordinary edge follows.
//!
//! Registers that depend on nothing that changes, such as a divider, run through a table of their states, and the edge
//! at which one of their words changes next is its horizon. Where others wait for such registers, whole periods of
//! edges are one jump.
//!
//! [`yosys`] reads a [`Netlist`] from the JSON that Yosys writes.

mod engine;
mod index_set;
mod line;
mod netlist;
mod operation;
pub mod yosys;

pub use engine::{Leap, Share};
pub use line::{FOREVER, Line};
pub use netlist::{AsynchronousReset, Cell, MadeClock, Net, Netlist, Output, Register};
pub use operation::{MOST_BITS, Operation, Widths};
