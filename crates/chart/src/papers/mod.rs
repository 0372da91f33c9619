//! Pictures of published studies.

pub(crate) mod formats;
pub(crate) mod ladder;
pub(crate) mod sines;
pub(crate) mod table_2;
pub(crate) mod velocities;
