//! `libhpu`: the plant of a scene in the loop of somebody else's logic, and blocks as golden models.
//!
//! [`Plant`] and [`Block`] are the library in Rust; [`Emulated`] is a scene's own loop, for the Python package. `abi`
//! is the C interface around the first two, which `include/hpu.h` documents: handles, status codes, and no panic across
//! the boundary.

mod abi;
mod block;
mod emulated;
mod error;
pub mod fmi;
mod plant;
mod table;

pub use block::Block;
pub use emulated::Emulated;
pub use error::{Error, Status};
pub use plant::Plant;
