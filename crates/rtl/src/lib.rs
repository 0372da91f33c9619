//! The bridge to VHDL: golden vectors, packages, testbenches, GHDL runs, and the loop closed around the VHDL itself.
//!
//! Everything flows outward from the port lists of `hpu_datapath`: the VHDL blocks are written by hand from their data
//! sheets, and this crate holds them to the emulator's bits.

pub mod check;
pub mod closed_loop;
mod foreign;
pub mod generated;
pub mod ghdl;
pub mod junit;
pub mod lockstep;
pub mod loop_bench;
pub mod package;
pub mod random;
pub mod reader;
pub mod report;
pub mod stimuli;
pub mod testbench;
pub mod vector;
pub mod wave;

pub use check::{CheckOptions, check};
pub use closed_loop::{LoopOptions, closed_loop};
pub use generated::{generated, stale, write_committed};
pub use ghdl::GhdlError;
pub use random::SplitMix64;
pub use reader::{Problem, VectorError, stimuli_from_csv};
pub use report::{CheckReport, CheckRow, Mismatch};
pub use vector::{Header, Stimulus, Vectors};
