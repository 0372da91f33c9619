//! One drop trial: the scene, run and judged.

use hpu_cosim::scene::{Shipped, shipped};
use hpu_cosim::{Control, Driver, Simulation, Verdict as Outcome, Wired, WiredSimulation};
use hpu_farm::form;
use serde::{Deserialize, Serialize};

use super::SCENE;
use crate::Error;

/// The result of a trial. Its keys as a row are the columns of a sweep.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Trial {
    /// Verdict on the trial.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// Number of clock edges that were run.
    pub edges: u64,
    /// Why the trial was aborted, if it was.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub why: String,
}

/// The verdict on a drop trial.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Verdict {
    /// The arm came to rest on the wall.
    Passive {
        /// The rms about the steady value, in m.
        #[serde(rename = "rms", with = "form::number")]
        rms_m: f64,
    },
    /// The arm kept chattering.
    NonPassive {
        /// The rms about the steady value, in m.
        #[serde(rename = "rms", with = "form::number")]
        rms_m: f64,
    },
    /// The trial was aborted.
    HighlyUnstable {
        /// Time of the abortion, in s.
        #[serde(rename = "at", with = "form::number")]
        at_s: f64,
    },
}

impl Verdict {
    /// Returns the rms about the steady value, in m, of a trial that was not aborted.
    pub fn rms_m(&self) -> Option<f64> {
        match self {
            Self::Passive { rms_m } | Self::NonPassive { rms_m } => Some(*rms_m),
            Self::HighlyUnstable { .. } => None,
        }
    }
}

/// Runs the scene under these overrides; returns `None` when it was stopped.
///
/// # Errors
///
/// Returns why the scene could not be run.
pub fn run_trial(overrides: &[(String, String)], control: &Control) -> Result<Option<Trial>, Error> {
    let experiment = scene().parse(overrides)?;
    let simulation = WiredSimulation::new(&experiment)?;
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), control);
    if !summary.complete {
        return Ok(None);
    }
    let verdict = match summary.verdict {
        Some(Outcome::Passive { rms_m }) => Verdict::Passive { rms_m },
        Some(Outcome::NonPassive { rms_m }) => Verdict::NonPassive { rms_m },
        Some(Outcome::HighlyUnstable { at_s }) => Verdict::HighlyUnstable { at_s },
        other => return Err(format!("{SCENE} is judged as no drop trial is: {other:?}").into()),
    };
    let why = summary.aborted.map_or(String::new(), |abort| abort.why.to_string());
    Ok(Some(Trial { verdict, edges: summary.edges, why }))
}

/// Returns the scene as shipped.
///
/// # Panics
///
/// If the scene is not shipped.
pub fn scene() -> &'static Shipped {
    shipped().iter().find(|scene| scene.name == SCENE).expect("the scene of the drop trial is shipped")
}
