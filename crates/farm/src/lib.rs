#![doc = include_str!("../README.md")]
//!
//! A point of a sweep is a unit of work ([`units`]): a pure function of its number. Its result is a [`Row`], and a
//! [`Journal`] keeps rows as they are finished. A shard is a range of the points of a wave; its file holds the rows of
//! its points ([`Schema`]) and a checksum over all of its bytes ([`seal`]). So a file that was cut off or changed
//! anywhere is found, and the gathered file depends on the rows alone.

#[cfg(not(target_family = "wasm"))]
mod fingerprint;
mod journal;
mod points;
mod row;
#[cfg(not(target_family = "wasm"))]
mod schema;
#[cfg(not(target_family = "wasm"))]
mod seal;
pub mod units;

pub use journal::{Journal, JournalError, fingerprint};
pub use row::{Failed, Row, UnitResult, form, one_line, typed, untyped};

#[cfg(not(target_family = "wasm"))]
pub use fingerprint::file_fingerprint;
pub use points::Points;
#[cfg(not(target_family = "wasm"))]
pub use schema::{FileRow, PointResult, Schema, append};
#[cfg(not(target_family = "wasm"))]
pub use seal::{Damage, SEAL, UNSEALED, seal, unseal};

/// Number of rows in a group of a sweep's files, and so in memory at a time.
pub const GROUP_ROWS: usize = 65_536;
