//! Tests of the simulator of netlists.

mod cells;
mod horizons;
mod netlists;
mod random;
mod verilog;
mod yosys;
