#![doc = include_str!("../README.md")]
//!
//! This crate is compiled twice: by `build.rs` to the shared library, and by cargo to the parent's side of the
//! protocol, which carries the library as [`LIBRARY`]. `hpu-rtl` is the parent.
//!
//! The two sides talk in words of 8 bytes. First the parent sends the number of ports, which of them are outputs that
//! drive the device, and the bits at all of them. The simulator holds the design in reset with these inputs, then
//! answers as it does to every request. A request is the number of edges to clock, the changes that are wanted (0: of
//! outputs that drive the device, 1: of all outputs, 2: of signals inside too), and the bits at all ports. An answer is
//! the number of edges done, the number of changes, 1 where the design has ended the run, and for each change the edge,
//! the port, the bits, and 1 where all bits are known. Before it answers, a simulator writes out everything that the
//! design has said.

#[cfg(unix)]
mod foreign;
#[cfg(unix)]
mod served;
#[cfg(unix)]
mod vpi;

use std::io::{self, Read, Write};

/// Environment variable that makes a bench report its ports and end.
pub const ASK: &str = "HPU_DUT_PORTS";

/// Environment variable that makes a bench report the signals inside.
pub const INSIDE: &str = "HPU_DUT_INSIDE";
/// The file beside a bench that lists the signals to be reported, one a line.
pub const LIST: &str = "hpu_dut_inside";

/// The shared library; empty on Windows, where `hpu` starts no GHDL. A file with these bytes is what GHDL loads.
#[cfg(not(shared_library))]
pub static LIBRARY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/libhpu_vhpi.so"));

/// The file descriptor through which a simulator talks to its parent.
pub const DESCRIPTOR: i32 = 3;

/// Writes words, the lowest byte of each first.
///
/// # Errors
///
/// [`io::Error`] of the stream.
pub fn put(to: &mut impl Write, words: &[u64]) -> io::Result<()> {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    to.write_all(&bytes)
}

/// Reads a word.
///
/// # Errors
///
/// [`io::Error`] of the stream, also where it ends before the word does.
pub fn take(from: &mut impl Read) -> io::Result<u64> {
    let mut bytes = [0; 8];
    from.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}
