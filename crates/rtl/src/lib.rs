//! The bridge to VHDL: golden vectors, packages, testbenches, GHDL runs, and the loop closed around the VHDL itself.
//!
//! The data flows only outward from the port lists of `hpu_datapath`. The VHDL blocks are written by hand from their
//! data sheets, and this crate compares them with the emulator, bit by bit.

mod around;
mod around_law;
mod cache_folder;
mod check;
mod closed_loop;
mod cost;
mod coverage;
pub mod dut;
pub mod entity;
mod entry;
mod fault;
pub mod formal;
mod generated;
mod ghdl;
mod ghdl_error;
mod group;
mod hdl;
mod junit;
mod late;
mod library;
mod lifeline;
mod lockstep;
mod netlists;
mod note;
mod owned;
mod package;
mod postures;
mod reader;
mod report;
mod scene;
mod sealed;
mod side;
mod sources;
pub mod stimuli;
pub mod temporary;
mod testbench;
mod tool;
mod vector;

pub use around::around_in_file;
pub use cache_folder::CacheFolder;
pub use check::{Check, CheckOptions, check};
pub use closed_loop::{LoopScene, closed_loop, run_vhdl};
pub use cost::{
    Cache, Cost, CostError, Counts, HX8K_BRAM, HX8K_CELLS, Placed, SEEDS, cost, counts, tool_versions, verilog,
};
pub use coverage::{Coverage, Moved, Role};
pub use fault::Fault;
pub use generated::{generated, stale, write_committed};
pub use ghdl::{GhdlError, Library};
pub use group::{Group, is_ignored, stop_tools};
pub use hdl::{Hdl, Setup, differs_from_the_hardware};
pub use hpu_wave::{Around, Column, ComparedRow};
pub use junit::{Case, junit, junit_suite};
pub use late::{Late, comparison_edges};
pub use note::tell_notes;
pub use package::package;
pub use reader::{Problem, VectorError, stimuli_from_csv};
pub use report::{CheckReport, CheckRow, Contact, Mismatch};
pub use scene::scene_vectors;
pub use sources::vhdl;
pub use testbench::{VECTOR_READER, testbench};
pub use tool::{Said, TIMEOUT, Tool, ToolError, output};
pub use vector::{Header, JsonError, Memory, Origin, Source, Stimulus, TooWide, Vectors, literal, row_line};
