//! Blocks that estimate a velocity.

pub mod butterworth_difference;
pub mod edge_timer;
pub(crate) mod estimator;
pub mod filtered_difference;
pub mod foaw;
pub mod levant_differentiator;
pub(crate) mod timed_velocity;
pub mod velocity_register;
pub mod window_difference;
