//! The result of a fit: a model, the things that it leaves out, and why it leaves out no more.

use hpu_cosim::scene::Output;

use crate::timing::Spread;

/// A thing that the model leaves out.
#[derive(Clone, PartialEq, Debug)]
pub struct LeftOut {
    /// Name of the thing, as a noun.
    pub what: String,
    /// The output that leaving it out changes most.
    pub output: Output,
    /// Size of that change, relative.
    pub effect: f64,
    /// How many times faster the model is because of it.
    pub gain: Spread,
}

/// A thing that the model has to keep.
#[derive(Clone, PartialEq, Debug)]
pub struct Kept {
    /// Name of the thing, as a noun.
    pub what: String,
    /// Why it has to be kept.
    pub why: String,
}

/// A model whose run on the scene itself was measured.
#[derive(Clone, PartialEq, Debug)]
pub struct Tried {
    /// Keys to set in the scene to get the model; empty for the scene as written.
    pub set: Vec<(String, String)>,
    /// The worst error of a judged output against the reference, relative; infinity for another verdict.
    pub error: f64,
    /// Wall time of the reference divided by that of the model; the median if both were timed in turn.
    pub speedup: f64,
    /// Whether it is the least model.
    pub chosen: bool,
}

/// The least model of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// Keys to set in the scene to get the model; empty if nothing can be left out.
    pub set: Vec<(String, String)>,
    /// The tolerance asked for.
    pub within: f64,
    /// Errors of the judged outputs against the reference, relative.
    pub errors: Vec<(Output, f64)>,
    /// Errors of all other outputs, relative. They may exceed the tolerance: the trace of a motion without end drifts
    /// in phase.
    pub not_judged: Vec<(Output, f64)>,
    /// The worst error in the neighbouring scenes.
    pub around: f64,
    /// Share of the judged window in which the wall sees penetration, in the scene as written; see
    /// [`hpu_cosim::Summary`].
    pub contact_share: Option<f64>,
    /// Wall time of the reference divided by that of the model.
    pub speedup: Spread,
    /// The wall time of the model, in s.
    pub wall_s: f64,
    /// The things that the model leaves out.
    pub left_out: Vec<LeftOut>,
    /// The things that the model keeps.
    pub kept: Vec<Kept>,
    /// Number of models that were tried.
    pub tried: usize,
    /// The models that could be run: those tried, and those that were run to judge them.
    pub models: Vec<Tried>,
    /// Number of runs, of all models and scenes.
    pub runs: usize,
}

/// Returns a relative error as text for people.
pub fn percent(error: f64) -> String {
    match error {
        0.0 => "nothing".into(),
        e if e.is_infinite() => "everything".into(),
        e if e < 1e-6 => format!("{:.0e} %", 100.0 * e),
        e => format!("{:.2} %", 100.0 * e),
    }
}
