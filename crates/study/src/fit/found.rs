//! What was found: a model, what it leaves out, and why it leaves out no more.

use std::fmt;

use hpu_cosim::scene::Output;

/// Something that the model leaves out.
#[derive(Clone, PartialEq, Debug)]
pub struct LeftOut {
    /// What.
    pub what: String,
    /// The output that it changes most.
    pub output: Output,
    /// By how much, relative.
    pub effect: f64,
    /// How many times faster the model is without it.
    pub gain: f64,
}

/// Something that the model has to keep.
#[derive(Clone, PartialEq, Debug)]
pub struct Kept {
    /// What.
    pub what: String,
    /// Why.
    pub why: String,
}

/// The least model of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// What to set in the scene to have it; nothing when all of it is needed.
    pub set: Vec<(String, String)>,
    /// The tolerance asked for.
    pub within: f64,
    /// Errors of the outputs that were judged, against the reference, relative.
    pub errors: Vec<(Output, f64)>,
    /// Errors of all other outputs, which may be larger than the tolerance: the trace of a motion without end drifts in
    /// phase.
    pub not_judged: Vec<(Output, f64)>,
    /// The worst error in the scenes around.
    pub around: f64,
    /// Share of the judged window in which the wall sees penetration, in the scene as written; see
    /// [`hpu_cosim::Summary`].
    pub contact_share: Option<f64>,
    /// Wall time of the reference over that of the model.
    pub speedup: f64,
    /// The wall time of the model, in s.
    pub wall_s: f64,
    /// What is not in it.
    pub left_out: Vec<LeftOut>,
    /// What is.
    pub kept: Vec<Kept>,
    /// Models that were tried.
    pub tried: usize,
    /// Runs of any scene.
    pub runs: usize,
}

/// Why there is no fit.
#[derive(Clone, PartialEq, Debug)]
pub enum FitError {
    /// The scene itself cannot be run, or judged.
    Scene(String),
    /// Stopped.
    Stopped,
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Scene(why) => f.write_str(why),
            Self::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for FitError {}

/// A relative error as people read it.
#[must_use]
pub fn percent(error: f64) -> String {
    match error {
        0.0 => "nothing".into(),
        e if e.is_infinite() => "everything".into(),
        e if e < 1e-6 => format!("{:.0e} %", 100.0 * e),
        e => format!("{:.2} %", 100.0 * e),
    }
}
