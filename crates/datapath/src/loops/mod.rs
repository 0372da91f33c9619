//! Loops of a haptic interface, made of blocks.

pub mod axis_front;
pub mod conventional_loop;
pub(crate) mod haptic_loop;
pub mod hybrid_loop;
pub(crate) mod loop_config;
