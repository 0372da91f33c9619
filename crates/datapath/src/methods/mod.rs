//! Methods: laws of a wall, and the loops around them.

pub mod braking_pulse;
pub mod energy_bounding;
pub mod method_loop;
pub(crate) mod method_variants;
pub mod passive_spring;
pub mod passivity_controller;
pub mod position_pid;
pub mod sampled_wall;
pub mod torque_table;
pub mod virtual_coupling;
