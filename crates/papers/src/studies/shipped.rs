//! The studies that come with the program, by name.

use std::sync::Arc;

use hpu_cosim::scene;

use super::comparison::Comparison;
use super::read::read;
use crate::Error;

macro_rules! studies {
    ($($name:literal),* $(,)?) => {
        &[$(($name, hpu_assets::text(concat!("testbench/studies/", $name, ".toml")))),*]
    };
}

/// Names and texts of the files in `testbench/studies`.
static STUDIES: &[(&str, &str)] = studies![
    "hybrid-loop",
    "input-shaper",
    "criteria",
    "power-scaling",
    "three-dof",
    "velocity-estimators",
    "phantom-lag",
    "epfl-paddle",
];

/// Returns names and texts of the shipped studies.
pub fn shipped_texts() -> &'static [(&'static str, &'static str)] {
    STUDIES
}

/// Returns the shipped study of this name.
///
/// # Panics
///
/// When there is none, or when its file is wrong, which a test of each finds.
pub fn shipped(name: &str) -> Comparison {
    let (_, text) = STUDIES.iter().find(|(own, _)| *own == name).unwrap_or_else(|| panic!("no study {name}"));
    let file = format!("testbench/studies/{name}.toml");
    let load = |name: &str, set: &[(String, String)]| {
        let shipped = scene::shipped().iter().find(|scene| scene.name == name);
        let shipped = shipped.ok_or_else(|| Error::new(format_args!("no scene {name}")))?;
        shipped.parse(set).map_err(Error::from)
    };
    let study = read(&file, text.as_bytes(), &[], Arc::new(load));
    study.unwrap_or_else(|errors| panic!("{errors}")).comparison
}
