//! One run of a mass on a rail, for a line of a comparison: its verdict in words, and what its trace tells.

use hpu_cosim::scene::{OutcomeKind, Scene};
use hpu_cosim::{Control, Driver, Ready, Rig, Summary, Trace, Verdict, Wired};

use super::beside::shipped_scene;

/// Keys of a scene with their values.
pub(super) type Set = Vec<(&'static str, String)>;

/// A run.
pub(super) struct Made {
    pub scene: Scene,
    pub summary: Summary,
    pub trace: Trace,
}

/// Runs a shipped scene under overrides; `None` when stopped.
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

/// The pieces together.
pub(super) fn with(first: &Set, second: &Set) -> Set {
    first.iter().chain(second).cloned().collect()
}

/// One key.
pub(super) fn key(key: &'static str, value: impl ToString) -> Set {
    vec![(key, value.to_string())]
}

impl Made {
    pub fn settled(&self) -> bool {
        self.summary.outcome() == Some(OutcomeKind::Settled)
    }

    /// The frequency of its limit cycle, if it has one.
    pub fn frequency_hz(&self) -> Option<f64> {
        match self.summary.verdict {
            Some(Verdict::LimitCycle { frequency_hz, .. }) if frequency_hz > 0.0 => Some(frequency_hz),
            _ => None,
        }
    }

    /// The verdict.
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

    /// Positions beyond the wall's surface, as its word has it.
    pub fn beyond_m(&self) -> impl Iterator<Item = f64> + '_ {
        let count_m = self.scene.encoder.count_rad();
        let surface_m = (self.scene.wall.position_rad / count_m).round() * count_m;
        self.trace.angles_rad().iter().map(move |x| x - surface_m)
    }

    /// Forces against the penetration.
    pub fn pushes_n(&self) -> impl Iterator<Item = f64> + '_ {
        self.trace.real(3).iter().map(|force| -force)
    }

    /// Index of the row at a time.
    pub fn row(&self, time_s: f64) -> usize {
        self.trace.times_s().take_while(|time| *time < time_s).count()
    }
}

/// A length with a unit to its size.
pub(super) fn length(length_m: f64) -> String {
    match length_m.abs() {
        size if size < 1e-3 => format!("{:.0} um", length_m * 1e6),
        size if size < 1.0 => format!("{:.1} mm", length_m * 1e3),
        _ => format!("{length_m:.2} m"),
    }
}
