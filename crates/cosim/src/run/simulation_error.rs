//! The reason why a scene cannot run.

use std::fmt;

use crate::world::plant::PlantError;
use hpu_scene::SceneError;
use hpu_scene::method::Unmade;

/// The reason why a scene cannot run.
#[derive(Debug)]
pub enum SimulationError {
    /// Its words do not fit.
    Scene(SceneError),
    /// Its widths do not make a datapath.
    Config(hpu_datapath::ConfigError),
    /// Its device does not make a plant.
    Plant(PlantError),
    /// Its arm is impossible.
    Arm(String),
}

impl fmt::Display for SimulationError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Config(error) => error.fmt(f),
            Self::Plant(error) => error.fmt(f),
            Self::Arm(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SimulationError {}

impl From<Unmade> for SimulationError {
    fn from(error: Unmade) -> Self {
        match error {
            Unmade::Scene(error) => Self::Scene(error),
            Unmade::Config(error) => Self::Config(error),
        }
    }
}
