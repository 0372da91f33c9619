//! The reasons for refusing a search.

use std::fmt;

use hpu_cosim::scene::{Datapath, Experiment, Hand, Loop, Scene};

use super::knob::Knob;

/// Why a search was refused.
#[derive(Clone, PartialEq, Debug)]
pub enum SearchError {
    /// No knob was given.
    NothingToVary,
    /// This width is varied twice.
    Twice(&'static str),
    /// There are too many designs: this many.
    TooMany(u128),
    /// The scene has nothing to search.
    Scene(String),
    /// No scene can have any of the designs: their number, and the reasons with their numbers.
    AllRefused(usize, Vec<(String, usize)>),
    /// The reference cannot be run, or has no stable stiffness.
    Reference(String),
}

impl fmt::Display for SearchError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NothingToVary => write!(f, "nothing to vary"),
            Self::Twice(key) => write!(f, "{key} is varied twice"),
            Self::TooMany(designs) => {
                write!(f, "{designs} designs; at most {MOST_DESIGNS} are searched: narrow a range")
            }
            Self::Scene(why) | Self::Reference(why) => write!(f, "{why}"),
            Self::AllRefused(designs, reasons) => {
                write!(f, "no scene has any of the {designs} designs")?;
                let mut shown = reasons.iter().take(3);
                shown.try_for_each(|(why, count)| write!(f, "\n{count} of them: {why}"))
            }
        }
    }
}

impl std::error::Error for SearchError {}

/// The most designs that a search may have.
const MOST_DESIGNS: u128 = 1 << 21;

/// Returns the scene if the widths of its loop can be searched.
pub(super) fn searchable(experiment: Experiment) -> Result<Scene, SearchError> {
    let refused = |why: &str| Err(SearchError::Scene(why.into()));
    if experiment.auto {
        return refused("model = \"auto\" is chosen for one design; set what hpu fit chooses");
    }
    let Some(scene) = experiment.axis() else {
        return refused("the search is over the widths of an axis's loop; this is a scene of a PHANToM");
    };
    match scene.model.datapath {
        Datapath::Words => {}
        Datapath::Linear => return refused("model.datapath = \"linear\" has no words; write \"words\""),
        Datapath::Law => return refused("model.datapath = \"law\" is computed in floats; write \"words\""),
    }
    match scene.hand {
        Hand::Prescribed { .. } => return refused("the hand imposes the motion, so that no stiffness is unstable"),
        Hand::Capture { .. } => return refused("a recording stands in the place of the device"),
        _ => {}
    }
    if let Loop::Law(law) = scene.method.kind {
        return refused(&format!(
            "method.kind = \"{}\": the search is for the kinds \"hybrid\" and \"conventional\"",
            law.name()
        ));
    }
    if scene.wall.ramp.is_some() {
        return refused("wall.ramp: the words change while the scene runs; the search is of a wall that stays");
    }
    if scene.wall.stiffness_nm_per_rad == 0.0 {
        return refused("wall.stiffness = 0: without a wall there is no stable stiffness");
    }
    Ok(scene)
}

/// Refuses knobs that make no grid; returns the number of designs.
pub(super) fn grid(knobs: &[Knob]) -> Result<usize, SearchError> {
    if knobs.is_empty() {
        return Err(SearchError::NothingToVary);
    }
    for (index, knob) in knobs.iter().enumerate() {
        if knobs[..index].iter().any(|other| other.width == knob.width) {
            return Err(SearchError::Twice(knob.width.key()));
        }
    }
    let designs: u128 = knobs.iter().map(|knob| knob.values() as u128).product();
    if designs > MOST_DESIGNS { Err(SearchError::TooMany(designs)) } else { Ok(designs as usize) }
}
