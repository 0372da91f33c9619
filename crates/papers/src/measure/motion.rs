//! Measures of runs: verdict, energies, and what is read from the trace of an axis.

use hpu_cosim::scene::{Experiment, OutcomeKind, Scene};
use hpu_cosim::{ANGLE, Control, Driver, Simulation, Summary, Trace, Verdict, Wired, WiredSimulation};
use hpu_page::summary::untold;

use super::{Asked, LONGEST, Taken, numbers, text};
use crate::Error;
use crate::template::{Value, Values, length};

/// A finished run.
pub(super) struct Made {
    experiment: Experiment,
    summary: Summary,
    trace: Trace,
}

/// Runs the scene under its overrides and further ones.
pub(super) fn make(asked: &Asked, more: &[(String, String)], control: &Control) -> Result<Made, Error> {
    let experiment = asked.experiment(more)?;
    let simulation = WiredSimulation::new(&experiment)?;
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), control);
    Ok(Made { experiment, summary, trace })
}

/// Runs the scene as [`make`] does; if it is too short to tell, makes it as long as it takes, up to [`LONGEST`].
fn make_told(asked: &Asked, more: &[(String, String)], control: &Control) -> Result<Made, Error> {
    let mut made = make(asked, more, control)?;
    let longest_s = LONGEST * made.experiment.run.duration_s;
    while let Some(telling_s) = made.summary.verdict.and_then(Verdict::telling_s)
        && (made.experiment.run.duration_s..=longest_s).contains(&telling_s)
    {
        let longer = ("run.duration".to_string(), format!("{telling_s} s"));
        made = make(asked, &[more, &[longer]].concat(), control)?;
    }
    Ok(made)
}

impl Made {
    /// Returns whether the motion comes to rest.
    ///
    /// # Errors
    ///
    /// Returns why the run does not tell, and what would tell.
    pub(super) fn settled(&self) -> Result<bool, Error> {
        let verdict = self.summary.verdict;
        match verdict.and_then(|verdict| untold(verdict.outcome(), verdict.telling_s())) {
            Some(why) => Err(why.into()),
            None => Ok(matches!(self.summary.outcome(), Some(OutcomeKind::Settled | OutcomeKind::Passive))),
        }
    }

    /// Returns the frequency of a motion that swings to the end, in Hz, if it has one.
    fn frequency_hz(&self) -> Option<f64> {
        match self.summary.verdict {
            Some(Verdict::LimitCycle { frequency_hz, .. }) => Some(frequency_hz),
            Some(Verdict::NotTold { frequency_hz, .. }) if frequency_hz > 0.0 => Some(frequency_hz),
            _ => None,
        }
    }

    /// Returns the verdict as text.
    fn outcome(&self) -> String {
        let is_angle = self.axis().is_some_and(|scene| scene.device.units().position == "rad");
        let size = |size: f64| if is_angle { format!("{size:.3e} rad") } else { length(size) };
        match self.summary.verdict {
            Some(Verdict::LimitCycle { amplitude_rad, frequency_hz, .. }) => {
                format!("chatters, {frequency_hz:.3} Hz, {}", size(amplitude_rad))
            }
            Some(Verdict::NotTold { frequency_hz: 0.0, .. }) => "moving to the end, without a period".into(),
            Some(Verdict::NotTold { amplitude_rad, frequency_hz, .. }) => {
                format!("may come to rest, {frequency_hz:.3} Hz, {}", size(amplitude_rad))
            }
            Some(Verdict::HandMoves { until_s, .. }) => format!("follows the hand, until {until_s:.2} s"),
            Some(Verdict::Diverged { at_s, .. }) => format!("diverges, watched since {at_s:.0} s"),
            Some(Verdict::NoWallTorque { depth, .. }) => format!("is {} in the wall without its torque", size(depth)),
            Some(Verdict::PositionLost { .. }) => "rests where its counter has wrapped".into(),
            Some(Verdict::NonPassive { rms_m }) => format!("is not passive, {} rms", length(rms_m)),
            Some(Verdict::HighlyUnstable { at_s }) => format!("aborted at {at_s:.2} s"),
            Some(Verdict::Tracking { rms_m, .. }) => format!("tracks its target, {} rms", length(rms_m)),
            _ => "settles".into(),
        }
    }

    fn axis(&self) -> Option<&Scene> {
        match &self.experiment {
            Experiment::Axis(scene) => Some(scene),
            _ => None,
        }
    }

    /// Returns the positions relative to the wall's surface, positive beyond it. The surface is where its fixed-point
    /// word places it.
    fn beyond(&self, scene: &Scene) -> impl Iterator<Item = f64> + '_ {
        let count = scene.encoder.count_rad();
        let surface = (scene.wall.position_rad / count).round() * count;
        self.trace.angles_rad().iter().map(move |x| x - surface)
    }

    /// Returns the torques or forces against the penetration.
    fn pushes(&self) -> impl Iterator<Item = f64> + '_ {
        self.trace.real(3).iter().map(|force| -force)
    }

    /// Returns the index of the row at a time.
    fn row(&self, time_s: f64) -> usize {
        self.trace.times_s().take_while(|time| *time < time_s).count()
    }

    /// Returns the index of the first row after a time that lies before the wall, or of the last row if there is none.
    fn leaves(&self, scene: &Scene, after_s: f64) -> usize {
        let after = self.row(after_s);
        let rows = self.trace.angles_rad().len();
        self.beyond(scene).skip(after).position(|x| x < 0.0).map_or(rows - 1, |row| after + row)
    }
}

/// The values that a run gives, besides those of its windows: those of every run, then those of an axis.
pub(super) const RUN_GIVES: &[&str] = &[
    "outcome",
    "settles",
    "rms",
    "amplitude",
    "frequency",
    "events",
    "edges",
    "hand_energy",
    "source_energy",
    "dissipated",
    "residual",
    "torque",
    "penetration",
    "end",
    "low",
    "high",
    "most",
    "left",
    "pressing",
    "held",
    "held_at",
    "held_by",
];

/// Runs a scene.
pub(super) fn run(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let made = make(asked, &[], control)?;
    let Summary { energy, .. } = made.summary;
    let (rms, amplitude) = match made.summary.verdict {
        Some(Verdict::Settled { rms_rad }) => (rms_rad, 0.0),
        Some(Verdict::LimitCycle { rms_rad, amplitude_rad, .. } | Verdict::NotTold { rms_rad, amplitude_rad, .. }) => {
            (rms_rad, amplitude_rad)
        }
        Some(Verdict::HandMoves { rms_rad, .. }) => (rms_rad, 0.0),
        Some(Verdict::Passive { rms_m } | Verdict::NonPassive { rms_m } | Verdict::Tracking { rms_m, .. }) => {
            (rms_m, 0.0)
        }
        Some(Verdict::Diverged { amplitude_rad, .. }) => (f64::INFINITY, amplitude_rad),
        _ => (f64::INFINITY, f64::INFINITY),
    };
    let mut values = numbers([
        ("rms", rms),
        ("amplitude", amplitude),
        ("frequency", made.frequency_hz().unwrap_or(0.0)),
        ("events", made.summary.events() as f64),
        ("edges", made.summary.edges as f64),
        ("hand_energy", energy.hand_j),
        ("source_energy", energy.source_j),
        ("dissipated", energy.dissipated_j),
        ("residual", energy.residual_j),
    ]);
    values.extend([text("outcome", made.outcome())]);
    values.insert("settles".into(), made.settled().map(|settled| Value::Number(f64::from(u8::from(settled)))));
    let torque = made.summary.averages.map(|[torque, _]| Value::Number(torque));
    values.insert("torque".into(), torque.ok_or_else(|| "stopped before its end".into()));
    if let Some(scene) = made.axis() {
        values.extend(of_axis(asked, &made, scene));
    }
    Ok(values)
}

/// Returns what the trace of an axis tells.
fn of_axis(asked: &Asked, made: &Made, scene: &Scene) -> Values {
    let positions = made.trace.angles_rad();
    let rows = positions.len();
    let judged = rows - made.trace.judged_rows(ANGLE).len()..rows;
    let [low, high] = ends(&positions[judged.clone()]);
    let pairs: Vec<(f64, f64)> = made.beyond(scene).zip(made.pushes()).collect();
    let (held_at, held_by) = mean(&pairs[judged]);
    let mut values = numbers([
        ("penetration", made.beyond(scene).fold(0.0, f64::max)),
        ("end", positions[rows - 1]),
        ("low", low),
        ("high", high),
        ("most", made.pushes().fold(0.0, f64::max)),
        ("held", held_by / held_at),
        ("held_at", held_at),
        ("held_by", held_by),
    ]);
    if let Some(after_s) = asked.number("after") {
        let left = made.leaves(scene, after_s);
        values.extend([text(
            "left",
            match left + 1 == rows {
                true => "never leaves it".into(),
                false => format!("first leaves it at {:.2} s", made.trace.time_s(left)),
            },
        )]);
    }
    if let &[from_s, to_s] = asked.numbers("press") {
        let pressing: Vec<_> = pairs[made.row(from_s)..made.row(to_s)].chunks(50).map(mean).collect();
        values.extend(numbers([("pressing", slope(&pressing))]));
    }
    if let Some(Taken::Windows(windows)) = asked.options.get("swing") {
        for (name, [from_s, to_s]) in windows {
            let [low, high] = ends(&positions[made.row(*from_s)..made.row(*to_s)]);
            values.insert(name.clone(), Ok(Value::Number(0.5 * (high - low))));
        }
    }
    values
}

fn ends(positions: &[f64]) -> [f64; 2] {
    positions.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)])
}

fn mean(pairs: &[(f64, f64)]) -> (f64, f64) {
    let sum = pairs.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
    (sum.0 / pairs.len() as f64, sum.1 / pairs.len() as f64)
}

/// Returns the slope of the straight line through pairs, by least squares.
pub fn slope(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let (x, y) = pairs.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0 / count, sum.1 + pair.1 / count));
    let [across, square] = pairs.iter().fold([0.0; 2], |[across, square], pair| {
        [across + (pair.0 - x) * (pair.1 - y), square + (pair.0 - x) * (pair.0 - x)]
    });
    across / square
}

/// Runs a scene, and again under the overrides `other`.
pub(super) fn apart(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let Some(Taken::Set(other)) = asked.options.get("other") else { return Err("other is missing".into()) };
    let (one, other) = (make(asked, &[], control)?, make(asked, other, control)?);
    let scenes = one.axis().zip(other.axis());
    let (scene, other_scene) =
        scenes.ok_or_else(|| Error::new(format_args!("{} is no scene of an axis", asked.scene)))?;
    let apart = |rows: usize| {
        let pairs = one.trace.angles_rad().iter().zip(other.trace.angles_rad()).take(rows);
        pairs.fold(0.0, |most: f64, (one, other)| most.max((one - other).abs()))
    };
    let after_s = asked.number("after").unwrap_or(0.0);
    let left = one.leaves(scene, after_s).min(other.leaves(other_scene, after_s));
    let leaves = one.trace.time_s(left);
    Ok(numbers([("until", apart(left)), ("to_the_end", apart(usize::MAX)), ("leaves", leaves)]))
}

/// Runs a scene at each value of a key. Gives the last value that settles below the first that does not, the first that
/// does not, and the frequency of its limit cycle in Hz; all infinite if every value settles.
pub(super) fn ladder(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let (mut rungs, mut turn) = (Vec::new(), None);
    let unit = asked.text("unit");
    for &value in asked.numbers("values") {
        let made = make_told(asked, &[(asked.text("key").to_string(), format!("{value} {unit}"))], control)?;
        let settled = made.settled()?;
        if !settled && turn.is_none() {
            let below = rungs.last().map_or(0.0, |(value, ..): &(f64, bool, String)| *value);
            turn = Some([below, value, made.frequency_hz().unwrap_or(f64::INFINITY)]);
        }
        rungs.push((value, settled, made.outcome()));
    }
    let [below, at, frequency] = turn.unwrap_or([f64::INFINITY; 3]);
    let mut values = numbers([("below", below), ("at", at), ("frequency", frequency)]);
    values.extend([text("text", told(&rungs, unit))]);
    Ok(values)
}

/// Returns as text up to where a ladder settles, what its next rung does, and whether any settles beyond.
pub fn told(rungs: &[(f64, bool, String)], unit: &str) -> String {
    let Some(first) = rungs.iter().position(|(_, settled, _)| !settled) else {
        return "settles throughout".into();
    };
    let (at, _, outcome) = &rungs[first];
    let below = first.checked_sub(1).map_or("nowhere".into(), |last| format!("up to {} {unit}", rungs[last].0));
    let again: Vec<_> = rungs[first..].iter().filter(|rung| rung.1).map(|rung| rung.0.to_string()).collect();
    let again = if again.is_empty() { String::new() } else { format!("; settles again at {}", again.join(", ")) };
    format!("settles {below}; at {at} {outcome}{again}")
}
