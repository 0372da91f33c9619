//! The FPGA: one file a block, integers only, and the wirings that put blocks together as VHDL would.

mod block;
mod wiring;

pub use block::{AnyBlock, Block, Generic, bundle, flatten};
pub use wiring::{Connection, Instance, LoopIn, LoopOut, Wiring};
