//! All tests of the crate in one binary, which is linked once and runs its tests on all cores.

mod check;
mod closed_loop;
mod cost;
mod cost_cache;
mod cost_verilog;
mod exports;
mod formal;
mod generics;
mod gimbal_loops;
mod handed_over;
mod headers;
mod junit;
mod leap;
mod phantom_loops;
#[path = "../../../wave/tests/all/read_back.rs"]
mod read_back;
mod synthesis;
mod system_verilog;
mod testbench;
mod thresholds;
mod vectors;
mod wave_ghdl;
