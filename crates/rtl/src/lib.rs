#![doc = include_str!("../README.md")]
//!
//! The data flows only outward from the port lists of `hpu_datapath`. The VHDL blocks are written by hand from their
//! data sheets, and this crate compares them with the emulator, bit by bit.
//!
//! Every multi-bit port of the VHDL is `std_logic_vector`, and its format says whether it is signed: a width generic
//! cannot choose between `signed` and `unsigned`, and the multiplier needs both.

mod check;
mod closed_loop;
mod cost;
pub mod dut;
mod engines;
pub mod entity;
pub mod formal;
mod lockstep;
mod netlists;
pub mod system;
mod vectors;

pub use check::{Check, CheckOptions, check, generics_label};
pub use closed_loop::{LoopScene, closed_loop, run_vhdl};
pub use cost::{Cache, Cost, Counts, HX8K_BRAM, HX8K_CELLS, Placed, SEEDS, cost, counts, tool_versions, verilog};
pub use dut::leap::{Difference, Found, LeapsBeside};
pub use engines::cache_folder::CacheFolder;
pub use engines::error::{Cause, Error};
pub use engines::fault::Fault;
pub use engines::ghdl::Library;
pub use engines::group::{Group, stop_tools};
pub use engines::hdl::{Hdl, Setup, differs_from_the_hardware};
pub use engines::note::tell_notes;
pub use engines::sources::vhdl;
pub use engines::temporary;
pub use engines::tool::{Said, TIMEOUT, output};
pub use hpu_wave::{Around, Column, ComparedRow};
pub use vectors::around::around_in_file;
pub use vectors::coverage::{Coverage, Moved, Role};
pub use vectors::generated::{generated, stale, write_committed};
pub use vectors::junit::{Case, junit, junit_suite};
pub use vectors::late::{Late, comparison_edges};
pub use vectors::package::package;
pub use vectors::reader::stimuli_from_csv;
pub use vectors::report::{CheckReport, CheckRow, Contact, Mismatch};
pub use vectors::scene::scene_vectors;
pub use vectors::stimuli;
pub use vectors::testbench::{VECTOR_READER, testbench};
pub use vectors::vector::{Header, Memory, Origin, Source, Stimulus, TooWide, VectorError, Vectors, literal, row_line};
