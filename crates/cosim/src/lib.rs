//! Joins datapath and plant: scenes, engine, energy audit, verdict.

pub mod replay;
pub mod scene;
