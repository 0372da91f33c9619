//! Verdict, contact and energies of a run, in words and as JSON: the summaries of `hpu run` and of the explorer.

use hpu_cosim::scene::{OutcomeKind, Setup, Units};
use hpu_cosim::{
    ANGLE, AxisSimulation, Simulation, Summary, Trace, Unheld, Unseen, Verdict, displayed_stiffness, product_wraps,
    unseen_contact, unseen_growth_per_s,
};
use hpu_signal::Cycle;
use serde_json::{Value, json};

use crate::quantities::{rounded_up, si};

/// Returns an outcome as text and as JSON. `unit` is that of the positions; the window is the judged one, in s.
///
/// # Panics
///
/// Does not: a verdict is an object.
pub fn outcome(verdict: Verdict, unit: &str, window_s: [f64; 2]) -> (String, Value) {
    let growth_per_s = unseen_growth_per_s(window_s[1] - window_s[0]);
    let mut told = serde_json::to_value(verdict).expect("numbers with names");
    match verdict {
        Verdict::Settled { .. } => told["growth_unseen_below_per_s"] = growth_per_s.into(),
        Verdict::Tracking { rms_m, greatest_m } if unit == "rad" => {
            told = json!({ "kind": "tracking", "rms_rad": rms_m, "greatest_rad": greatest_m });
        }
        _ => {}
    }
    (said(verdict, unit, window_s, growth_per_s), told)
}

/// Returns an outcome as text.
fn said(verdict: Verdict, unit: &str, [from_s, to_s]: [f64; 2], growth_per_s: f64) -> String {
    let u = |value| si(value, unit);
    match verdict {
        Verdict::Settled { rms_rad } => {
            let (rms, from, to, below) = (u(rms_rad), si(from_s, "s"), si(to_s, "s"), rounded_up(growth_per_s));
            format!("settled: rms {rms} about the mean, {from} to {to}; growth below {below}/s would not be seen")
        }
        Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz } => {
            let (rms, amplitude, frequency) = (u(rms_rad), u(amplitude_rad), si(frequency_hz, "Hz"));
            format!("limit cycle: amplitude {amplitude}, {frequency}, rms {rms}")
        }
        Verdict::NoWallTorque { effort, depth } => {
            let effort = si(effort, if unit == "rad" { "N.m" } else { "N" });
            format!("inside the wall without its torque: {} deep, pushed out by {effort}", u(depth))
        }
        Verdict::PositionLost { rms_rad, lost_share } => format!(
            "position lost: at rest, rms {} about the mean, but for {} of the judged window the position counter had \
             wrapped",
            u(rms_rad),
            share(lost_share)
        ),
        Verdict::Diverged { at_s, amplitude_rad } => {
            format!("diverged: amplitude {}, growing since {}", u(amplitude_rad), si(at_s, "s"))
        }
        Verdict::Passive { rms_m } => format!("passive: rms {} about the steady value at the end", si(rms_m, "m")),
        Verdict::NonPassive { rms_m } => {
            format!("non-passive: rms {} about the steady value at the end", si(rms_m, "m"))
        }
        Verdict::Tracking { rms_m, greatest_m } => {
            format!("tracking: {} rms from the target, {} at most", u(rms_m), u(greatest_m))
        }
        Verdict::NotTold { rms_rad, amplitude_rad, telling_s, .. } => {
            let (range, rms, telling) = (u(2.0 * amplitude_rad), u(rms_rad), telling_by_decay(telling_s));
            format!("not told: moves over {range} at the end, rms {rms}, and may come to rest; {telling}")
        }
        Verdict::HandMoves { until_s, rms_rad, greatest_rad, telling_s } => {
            let (until, rms, greatest) = (si(until_s, "s"), u(rms_rad), u(greatest_rad));
            let telling = telling(Some(telling_s));
            format!("the hand moves until {until}: {rms} rms from the hand, {greatest} at most; {telling}")
        }
        Verdict::HighlyUnstable { at_s } => format!("highly unstable: aborted at {}", si(at_s, "s")),
    }
}

/// Returns a share of a window as text.
fn share(share: f64) -> String {
    if share == 1.0 { "all".to_string() } else { format!("{:.2} %", 100.0 * share) }
}

/// Returns why a run does not tell whether the motion comes to rest, and what would tell; `None` if it tells.
pub fn untold(outcome: OutcomeKind, telling_s: Option<f64>) -> Option<String> {
    match outcome {
        OutcomeKind::NotTold => {
            Some(format!("not told: the motion may still come to rest; {}", telling_by_decay(telling_s)))
        }
        OutcomeKind::HandMoves => {
            Some(format!("not told: the hand moves in the judged window; {}", telling(telling_s)))
        }
        _ => None,
    }
}

/// Returns as text which duration of the run would tell.
pub fn telling(telling_s: Option<f64>) -> String {
    match telling_s {
        Some(telling_s) => format!("run.duration = \"{}\" would tell", si(telling_s, "s")),
        None => "no run.duration is known that would tell".into(),
    }
}

/// Returns as text which duration would tell how a motion ends that still decays. A beat can look like a decay, so the
/// duration is an extrapolation.
pub fn telling_by_decay(telling_s: Option<f64>) -> String {
    let when = if telling_s.is_some() { " if the decay goes on so" } else { "" };
    format!("{}{when}", telling(telling_s))
}

/// The contact of a run with its wall.
#[derive(Clone, Copy)]
pub struct Touch<'r> {
    /// The summary of the run.
    pub summary: &'r Summary,
    /// The trace of the run.
    pub trace: &'r Trace,
    /// The judged window, in s.
    pub window_s: [f64; 2],
    /// Position and stiffness of an axis's wall, in the units of the trace; the stiffness is 0 where it is unknown.
    pub wall: Option<(f64, f64)>,
    /// The units in which an axis is told, and how many of them one unit of the trace is.
    pub told_in: Option<(Units, f64)>,
    /// The simulation of an axis whose words are known.
    pub axis: Option<&'r AxisSimulation<'r>>,
}

impl Touch<'_> {
    /// Returns a warning beside the verdict when the wall was not reached, or when its product wrapped; otherwise an
    /// empty text.
    pub fn beside(&self) -> String {
        if let Some((axis, Unseen { depth, wrapped })) = self.axis.zip(self.unseen()) {
            let past = si(depth, axis.scene().units().position);
            let why = if wrapped { ": the position counter wrapped" } else { "" };
            return format!("; the datapath saw no contact though the device was {past} past the wall{why}");
        }
        let beside = match (self.summary.contact_share, self.wraps()) {
            (Some(0.0), _) => "; wall not reached in the judged window".to_string(),
            (_, Some(wraps)) => {
                let times = if wraps == 1 { "once" } else { &format!("{wraps} times") };
                format!("; through the wall, whose product has wrapped {times}")
            }
            _ => String::new(),
        };
        let is_said = matches!(self.summary.verdict, Some(Verdict::PositionLost { .. }));
        beside + if self.summary.unheld.is_some() && !is_said { "; the position counter wrapped" } else { "" }
    }

    /// Returns the line about a position counter that wrapped under its device, and its figures as JSON.
    pub fn unheld(&self) -> Option<(String, Value)> {
        let (axis, Unheld { first, edges }) = self.axis.zip(self.summary.unheld)?;
        let (scene, clock) = (axis.scene(), axis.clock());
        let (unit, bits) = (scene.units().position, scene.method.position_bits);
        let [least, most] = scene.held_rad()?.map(|end| scene.scale() * end);
        let share = edges as f64 / self.summary.edges.max(1) as f64;
        // A recording has counts, but no positions.
        let has_positions = self.summary.verdict.is_some();
        let wider = has_positions.then(|| scene.holding_bits([self.trace.least(ANGLE), self.trace.greatest(ANGLE)]));
        let wider = wider.flatten();
        let first_s = clock.seconds(Cycle(first));
        let said = format!(
            "wraps: {bits} bits hold {} to {}; the device was beyond from {} on, {:.2} % of the run{}",
            si(least, unit),
            si(most, unit),
            si(first_s, "s"),
            100.0 * share,
            wider.map_or(String::new(), |wider| format!("; method.position_bits = {wider} holds all of it")),
        );
        let figures = json!({
            "first_s": first_s,
            "edges": edges,
            "share": share,
            "held": [least, most],
            "holding_bits": wider,
        });
        Some((said, figures))
    }

    /// Returns the line about how long the wall was touched, and which torque or force it gives at the final depth.
    pub fn line(&self) -> Option<String> {
        let counted = self.summary.contact_share?;
        let [from, to] = self.window_s.map(|time_s| si(time_s, "s"));
        if counted == 0.0 {
            let before = if self.was_touched() { "; touched before" } else { "" };
            return Some(format!(
                "none in the judged window, {from} to {to}{before}: the outcome says nothing of the wall"
            ));
        }
        let (share, counts) = (share(counted), if self.axis.is_some() { "logic" } else { "encoder" });
        let itself = self.summary.device_contact_share.map(self::share).filter(|itself| *itself != share);
        let itself =
            itself.map_or(String::new(), |itself| format!(" as the {counts} counts it; the device itself {itself}"));
        let said = format!("{share} of the judged window, {from} to {to}{itself}");
        let Some(((units, _), (depth, displayed, ratio))) = self.told_in.zip(self.displayed()) else {
            return Some(said);
        };
        let of = ratio.map(|ratio| format!(", {:.2} % of what its stiffness asks for", 100.0 * ratio));
        let of = of.unwrap_or_default();
        let (deep, effort) = (si(depth, units.position), si(displayed * depth, units.effort));
        Some(format!("{said}; {deep} deep the wall gives {effort}{of}"))
    }

    /// Returns whether an axis saw penetration at any time.
    fn was_touched(&self) -> bool {
        let told = ["penetration", "wall_contact"];
        let penetration = self.summary.nets.iter().find(|net| told.contains(&net.signal.name));
        penetration.is_some_and(|net| net.usage.max > 0)
    }

    /// Returns, for a settled contact of an axis, the depth at the end, the displayed stiffness, and its ratio to the
    /// stiffness that was asked for.
    pub fn displayed(&self) -> Option<(f64, f64, Option<f64>)> {
        let Some(Verdict::Settled { .. }) = self.summary.verdict else { return None };
        let (wall, (_, scale)) = self.wall.zip(self.told_in)?;
        let (displayed, ratio) = displayed_stiffness(wall, self.trace, self.summary.averages)?;
        Some((scale * (self.trace.last(ANGLE)? - wall.0), displayed / (scale * scale), ratio))
    }

    /// Returns how far the device of an axis was past the wall while the datapath saw no contact.
    pub fn unseen(&self) -> Option<Unseen> {
        let axis = self.axis?;
        let unseen = unseen_contact(axis.scene(), &axis.words().realised, self.trace, self.summary)?;
        Some(Unseen { depth: axis.scene().scale() * unseen.depth, ..unseen })
    }

    /// Returns how often the spring's product wrapped, if it did and the motion came to rest in the wall.
    pub fn wraps(&self) -> Option<u64> {
        let axis = self.axis?;
        product_wraps(axis.scene(), &axis.words().realised, self.trace, self.summary)
    }
}
