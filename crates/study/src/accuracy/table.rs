//! Names of a race's results.

use hpu_cosim::scene::{Experiment, Output};

use super::found::Grade;

/// Returns the name of a grade: `exact`, `off`, `verdict_only`, `wrong`.
pub fn grade_name(grade: Grade) -> &'static str {
    match grade {
        Grade::Exact => "exact",
        Grade::Off(_) => "off",
        Grade::VerdictOnly => "verdict_only",
        Grade::Wrong => "wrong",
    }
}

/// Returns the outputs that may have an error in a scene.
pub fn outputs_of(experiment: &Experiment) -> &'static [Output] {
    experiment.setup().outputs()
}
