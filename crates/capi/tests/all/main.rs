//! All tests of the crate in one binary: the library in C, and its worlds in Rust.

mod common;
mod dut;
mod emulated;
mod header;
mod in_c;
mod motion;
mod refused;
mod simulators;
