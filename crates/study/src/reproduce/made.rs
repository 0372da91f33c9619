//! One run of a mass on a rail, for a line of a comparison: its verdict as text, and figures read from its trace.

use hpu_cosim::scene::{OutcomeKind, Scene};
use hpu_cosim::{Control, Driver, Ready, Rig, Summary, Trace, Verdict, Wired};

use super::beside::shipped_scene;

/// Keys of a scene with their values.
pub(super) type Set = Vec<(&'static str, String)>;

/// A finished run.
pub(super) struct Made {
    pub scene: Scene,
    pub summary: Summary,
    pub trace: Trace,
}

/// Runs a shipped scene under overrides; returns `None` when stopped.
pub(super) fn run(name: &str, set: &Set, control: &Control) -> Option<Result<Made, String>> {
    let set: Vec<(&str, &str)> = set.iter().map(|(key, value)| (*key, value.as_str())).collect();
    let experiment = match shipped_scene(name, &set) {
        Ok(experiment) => experiment,
        Err(error) => return Some(Err(error)),
    };
    let (summary, trace) = match Ready::new(&experiment) {
        Ok(ready) => {
            let mut trace = ready.brief_trace();
            (ready.run(Driver::Events, &mut trace, &mut (), control), trace)
        }
        Err(error) => return Some(Err(error.to_string())),
    };
    let complete = summary.complete;
    let made = experiment.axis().map(|scene| Made { scene, summary, trace });
    complete.then(|| made.ok_or_else(|| format!("{name} is no scene of an axis")))
}

/// Returns both lists of overrides as one.
pub(super) fn with(first: &Set, second: &Set) -> Set {
    first.iter().chain(second).cloned().collect()
}

/// Returns an override of a single key.
pub(super) fn key(key: &'static str, value: impl ToString) -> Set {
    vec![(key, value.to_string())]
}

impl Made {
    pub fn settled(&self) -> bool {
        self.summary.outcome() == Some(OutcomeKind::Settled)
    }

    /// Returns the frequency of the run's limit cycle, in Hz, if it has one.
    pub fn frequency_hz(&self) -> Option<f64> {
        match self.summary.verdict {
            Some(Verdict::LimitCycle { frequency_hz, .. }) if frequency_hz > 0.0 => Some(frequency_hz),
            _ => None,
        }
    }

    /// Returns the verdict as text.
    pub fn outcome(&self) -> String {
        match self.summary.verdict {
            Some(Verdict::LimitCycle { amplitude_rad, frequency_hz, .. }) if frequency_hz > 0.0 => {
                format!("chatters, {frequency_hz:.3} Hz, {}", length(amplitude_rad))
            }
            Some(Verdict::LimitCycle { .. }) => "moving to the end, without a period".into(),
            Some(Verdict::Diverged { at_s, .. }) => format!("diverges, watched since {at_s:.0} s"),
            _ => "settles".into(),
        }
    }

    /// Returns the positions relative to the wall's surface, in m, positive beyond it. The surface is where its
    /// fixed-point word places it.
    pub fn beyond_m(&self) -> impl Iterator<Item = f64> + '_ {
        let count_m = self.scene.encoder.count_rad();
        let surface_m = (self.scene.wall.position_rad / count_m).round() * count_m;
        self.trace.angles_rad().iter().map(move |x| x - surface_m)
    }

    /// Returns the forces against the penetration, in N.
    pub fn pushes_n(&self) -> impl Iterator<Item = f64> + '_ {
        self.trace.real(3).iter().map(|force| -force)
    }

    /// Returns the index of the row at a time.
    pub fn row(&self, time_s: f64) -> usize {
        self.trace.times_s().take_while(|time| *time < time_s).count()
    }
}

/// Returns a length as text, in the unit that suits its size.
pub(super) fn length(length_m: f64) -> String {
    match length_m.abs() {
        size if size < 1e-3 => format!("{:.0} um", length_m * 1e6),
        size if size < 1.0 => format!("{:.1} mm", length_m * 1e3),
        _ => format!("{length_m:.2} m"),
    }
}
