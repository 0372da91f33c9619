#![doc = include_str!("../README.md")]
//!
//! Most are files in the language of [`studies`]: scenes under overrides, what is [measured](measure) of them, and a
//! paper's claims beside the figures. Those of the PHANToM's table are in [`phantom`].

pub mod formula;
pub mod measure;
pub mod phantom;
pub mod studies;
pub mod template;

hpu_signal::error! {
    /// Why a study, or a line of it, has no result.
    pub struct Error from hpu_cosim::scene::SceneError, hpu_cosim::SimulationError, hpu_farm::Failed, hpu_prove::Error,
        hpu_study::Error;
}
