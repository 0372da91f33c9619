//! All tests of the crate in one binary, which is linked once and runs its tests on all cores.

mod check;
mod closed_loop;
mod cost;
mod cost_cache;
mod cost_verilog;
mod exports;
mod formal;
mod generics;
mod headers;
mod junit;
mod phantom_loops;
mod phantom_waves;
mod read_back;
mod synthesis;
mod testbench;
mod vectors;
mod wave_files;
mod wave_ghdl;
mod wave_gtkw;
mod wave_readback;
mod wave_run;
