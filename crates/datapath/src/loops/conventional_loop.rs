//! The conventional loop: position and velocity are sampled together, and the torque is held between samples.
//!
//! - **Equation**: as the [hybrid loop](crate::hybrid_loop), with `delta` taken from the position held since the latest
//!   sample edge.
//! - **Ports**: as the hybrid loop.
//! - **Latency**: pin to position 4 edges; then up to `period` to the sample edge, 1, and `SETTLING`.
//! - **Reset**, **Overflow**: as the hybrid loop.
//! - **VHDL twin**: `hdl/conventional_loop.vhd`.
//! - **Source**: the loop that Vasudevan et al. 2007 compare with.
//! - **Differs from the hardware**: samples exactly every period; a controller in software has jitter and a computing
//!   delay. Combinational paths settle within the clock they change in, whatever their length; SETTLING says how much
//!   later they would.

use crate::loops::haptic_loop::HapticLoop;

/// The conventional loop; the [module](self) describes it.
pub type ConventionalLoop = HapticLoop<true>;
