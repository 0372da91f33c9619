//! All tests of the crate in one binary: linked once, and spread over the cores together.

mod amplifier;
mod arm_certified;
mod arm_dynamics;
mod arm_edges;
mod arm_finger;
mod arm_flexible;
mod arm_friction;
mod arm_gimbal;
mod arm_judge;
mod arm_kinematics;
mod arm_motion;
mod arm_stepper;
mod arms;
mod cruise;
mod decisions;
mod ends;
mod held_device;
mod less_model;
mod motor;
mod network;
mod random;
mod searches;
mod sensors;
mod shaper;
mod stepper;
mod transfer;
