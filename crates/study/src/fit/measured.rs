//! A run, what it told and how long it took.

use std::time::{Duration, Instant};

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Control, PASSIVE_RMS_M, Rig, Verdict, Wired};

use crate::accuracy::{Outputs, ready};

/// What a run told and how long it took.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Measured {
    /// What it told.
    pub outputs: Outputs,
    /// Share of the judged window in which the wall sees penetration.
    pub contact_share: Option<f64>,
    /// Whether the verdict hangs on little: the rms that it is made of is within twice of its limit.
    pub thin: bool,
    /// Wall time, from a parsed scene to a verdict, in s: the best of a few runs while they are short.
    pub wall_s: f64,
}

impl Measured {
    /// Runs an experiment, a few times while that is short.
    ///
    /// # Errors
    ///
    /// Why it cannot be run, or that `control` stopped it.
    pub fn of(experiment: &Experiment, control: &Control) -> Result<Self, String> {
        Self::best_of(5, experiment, control)
    }

    /// The same, once.
    pub fn once(experiment: &Experiment, control: &Control) -> Result<Self, String> {
        Self::best_of(1, experiment, control)
    }

    fn best_of(turns: usize, experiment: &Experiment, control: &Control) -> Result<Self, String> {
        let begin = Instant::now();
        let mut best: Option<Self> = None;
        // The memory of the rows is not the model's: repeated runs take it over from each other.
        let mut rows = None;
        for _ in 0..turns {
            let start = Instant::now();
            let ready = ready(experiment)?;
            let trace = rows.get_or_insert_with(|| ready.brief_trace());
            let summary = ready.run(ready.driver(), trace, &mut (), control);
            if !summary.complete {
                return Err("stopped".to_string());
            }
            let wall_s = start.elapsed().as_secs_f64();
            let outputs = Outputs::new(experiment, &summary, trace)?;
            let thin = thin(experiment, summary.verdict);
            let wall_s = best.map_or(wall_s, |best: Self| best.wall_s.min(wall_s));
            best = Some(Self { outputs, contact_share: summary.contact_share, thin, wall_s });
            if begin.elapsed() > Duration::from_millis(20) {
                break;
            }
        }
        Ok(best.expect("it has run"))
    }
}

/// Whether a verdict by its rms would be another with half or twice as much.
fn thin(experiment: &Experiment, verdict: Option<Verdict>) -> bool {
    let (rms, limit) = match (verdict, experiment) {
        (
            Some(Verdict::Settled { rms_rad: rms } | Verdict::LimitCycle { rms_rad: rms, .. }),
            Experiment::Axis(scene),
        ) => (rms, scene.encoder.count_rad()),
        (Some(Verdict::Passive { rms_m: rms } | Verdict::NonPassive { rms_m: rms }), _) => (rms, PASSIVE_RMS_M),
        _ => return false,
    };
    (0.5 * limit..2.0 * limit).contains(&rms)
}
