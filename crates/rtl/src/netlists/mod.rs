//! Netlists as Yosys writes them: their cells, what clocks them, how they are wired.

pub(crate) mod cells;
pub(crate) mod clocking;
mod loops;
pub(crate) mod unknown;
pub(crate) mod wiring;

/// Yosys passes that make one module, in which tables are selections, and words that are made of their own other bits
/// are single bits.
pub(crate) const FLAT: &str = "flatten; memory_map; opt_clean; scc -select; techmap; select -clear; opt_clean";
/// Yosys passes that write the transition of one module. Unknown bits may have any value; clock enables and
/// asynchronous resets become selections.
pub(crate) const TRANSITION: &str = "setundef -undriven -anyseq; async2sync; dffunmap; write_smt2";
