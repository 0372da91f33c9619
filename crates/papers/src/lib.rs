#![doc = include_str!("../README.md")]
//!
//! Most are files in the language of [`studies`]: scenes under overrides, what is [measured](measure) of them, and a
//! paper's claims beside the figures. Those of the PHANToM's table are in [`phantom`].

pub mod formula;
pub mod measure;
pub mod phantom;
pub mod studies;
pub mod template;
