#![doc = include_str!("../README.md")]
//!
//! A [`Layout`] lists the variables of a file. It has the hierarchy that GHDL shows for the same design, with the
//! plant's outputs beside it. [`Vcd`] and [`Fst`] observe a run and write the same data in two formats, and
//! [`Recording::aside`] lets them write on a thread of their own. [`gtkw`] and [`sucl`] arrange the data on the screen
//! of GTKWave and of Surfer.
//! [`mismatch_vcd`] writes the rows around a mismatch, with the words of both sides.
//!
//! A file's unit of time is the longest power of ten in which every edge of the clock, and the middle between two
//! edges, is a whole number (10 ns at 50 MHz). For a clock without such a unit it is a picosecond, and edges are
//! rounded down to it. The words after an edge change at the time of the edge. `rst` is 0 throughout, because the reset
//! edge is before the recording.

mod around;
mod aside;
mod fst;
mod gtkw;
mod layout;
mod mismatch;
mod recording;
mod sink;
mod sucl;
mod timescale;
mod vcd;
mod wave_file;

pub use self::around::{Around, Column, ComparedRow};
pub use self::aside::Aside;
pub use self::fst::{Fst, FstFile};
pub use self::gtkw::gtkw;
pub use self::layout::{Layout, Scope, Source, Var, differs};
pub use self::mismatch::{mismatch_gtkw, mismatch_vcd};
pub use self::recording::Recording;
pub use self::sink::Sink;
pub use self::sucl::sucl;
pub use self::vcd::{Vcd, VcdFile};
pub use self::wave_file::{WaveFile, fst_aside, vcd_aside};

/// The name of the producer in the files.
const VERSION: &str = concat!("hpu ", env!("CARGO_PKG_VERSION"));
