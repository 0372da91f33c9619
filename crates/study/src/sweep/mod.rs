//! Sweeps: many points in shards, each shard a file, whichever machine runs it.
//!
//! A point is a unit of work ([`crate::units`]): a pure function of its number. A shard is a range of the points of a
//! wave; its file holds the rows of its points ([`Schema`]) and a checksum over all of its bytes ([`seal`]). So a file
//! that was cut off or changed anywhere is found, and the gathered file depends on the rows alone.

mod fingerprint;
mod points;
mod schema;
mod seal;

pub use fingerprint::file_fingerprint;
pub use points::Points;
pub use schema::{FileRow, Row, Schema, append};
pub use seal::{Damage, SEAL, UNSEALED, seal, unseal};

/// Number of rows in a group of a sweep's files, and so in memory at a time.
pub const GROUP_ROWS: usize = 65_536;
