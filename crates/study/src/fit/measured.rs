//! A run's outputs and its wall time.

use std::time::{Duration, Instant};

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Control, PASSIVE_RMS_M, Simulation, Verdict, Wired};

use crate::Error;
use crate::accuracy::{Outputs, simulation};

/// A run's outputs and its wall time.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Measured {
    /// The outputs.
    pub outputs: Outputs,
    /// Share of the judged window in which the wall sees penetration.
    pub contact_share: Option<f64>,
    /// Whether the verdict is near its limit: the rms that decides it is between half of the limit and twice the limit.
    pub thin: bool,
    /// Wall time from a parsed scene to a verdict, in s: the best of a few runs while runs are short.
    pub wall_s: f64,
}

impl Measured {
    /// Runs an experiment, a few times while a run is short.
    ///
    /// # Errors
    ///
    /// Returns why the experiment cannot be run, or that `control` stopped it.
    pub fn of(experiment: &Experiment, control: &Control) -> Result<Self, Error> {
        Self::best_of(5, experiment, control)
    }

    /// Runs an experiment once.
    pub fn once(experiment: &Experiment, control: &Control) -> Result<Self, Error> {
        Self::best_of(1, experiment, control)
    }

    fn best_of(turns: usize, experiment: &Experiment, control: &Control) -> Result<Self, Error> {
        let begin = Instant::now();
        let mut best: Option<Self> = None;
        // The memory of the rows is not part of the model's cost: repeated runs take it over from each other.
        let mut rows = None;
        for _ in 0..turns {
            let start = Instant::now();
            let simulation = simulation(experiment)?;
            let trace = rows.get_or_insert_with(|| simulation.brief_trace());
            let summary = simulation.run(simulation.driver(), trace, &mut (), control);
            if !summary.complete {
                return Err("stopped".into());
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

/// Whether the verdict would differ if its rms were half or twice as large.
fn thin(experiment: &Experiment, verdict: Option<Verdict>) -> bool {
    let (rms, limit) = match (verdict, experiment) {
        (
            Some(
                Verdict::Settled { rms_rad: rms }
                | Verdict::LimitCycle { rms_rad: rms, .. }
                | Verdict::NotTold { rms_rad: rms, .. },
            ),
            Experiment::Axis(scene),
        ) => (rms, scene.encoder.count_rad()),
        (Some(Verdict::Passive { rms_m: rms } | Verdict::NonPassive { rms_m: rms }), _) => (rms, PASSIVE_RMS_M),
        _ => return false,
    };
    (0.5 * limit..2.0 * limit).contains(&rms)
}
