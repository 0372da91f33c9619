//! The result of a run: its trace, summary and verdict.

pub(crate) mod columns;
pub(crate) mod contact;
pub(crate) mod felt;
pub(crate) mod forever;
pub(crate) mod heard;
pub(crate) mod outline;
pub(crate) mod stays;
pub(crate) mod stopwatch;
pub(crate) mod summary;
pub(crate) mod time_constants;
pub(crate) mod trace;
pub(crate) mod verdict;
pub(crate) mod window;
