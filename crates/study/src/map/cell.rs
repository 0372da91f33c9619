//! A cell: the scene, run and judged.

use std::num::NonZeroU32;
use std::sync::atomic::Ordering;
use std::time::Duration;

use hpu_cosim::dut::{self, Inside};
use hpu_cosim::scene::{Experiment, OutcomeKind};
use hpu_cosim::{
    AnySimulation, Control, Driver, Forever, Simulation, Summary, Verdict, Wired, WiredSimulation, displayed_stiffness,
    product_wraps, unseen_contact,
};

use hpu_farm::form;
#[cfg(not(target_family = "wasm"))]
use hpu_prove::lasting;
use hpu_signal::Observe;
use serde::{Deserialize, Serialize};

use super::device::{Device, Switching};
use crate::watch::limited;
use crate::{Error, Kind};

/// The result of a cell; positions in rad, of a mass or an arm in m, of a network in the units of its wall. Its keys as
/// a row are the columns of a sweep.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Cell {
    /// The outcome of the motion.
    #[serde(with = "outcome")]
    pub outcome: OutcomeKind,
    /// The rms about the mean at the end; of a motion that follows a hand or a target, of the distance from it.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub rms: Option<f64>,
    /// Half of the range of a motion that did not end.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<f64>,
    /// Frequency of a limit cycle, in Hz.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub frequency_hz: Option<f64>,
    /// Energy that the hand gave, in J.
    #[serde(with = "form::number")]
    pub hand_j: f64,
    /// Energy that the supply gave, or motors that are driven as torques, in J.
    #[serde(with = "form::number")]
    pub source_j: f64,
    /// Energy that became heat, in J.
    #[serde(with = "form::number")]
    pub dissipated_j: f64,
    /// The stiffness that is felt in a settled contact.
    #[serde(flatten)]
    pub displayed: Option<Displayed>,
    /// Share of the judged window in which the wall sees penetration; `None` for a motion that was aborted.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub contact_share: Option<f64>,
    /// Share of the judged window in which the device itself is beyond the wall; `None` also for more than one axis.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub device_contact_share: Option<f64>,
    /// How often the spring's product had wrapped when the motion came to rest in the wall: the hand is through it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub product_wraps: Option<NonZeroU32>,
    /// Whether the device was past its wall in the judged window while the datapath saw no contact.
    #[serde(with = "form::digit")]
    pub contact_unseen: bool,
    /// Share of the clock edges at which the position counter had wrapped under the device.
    #[serde(with = "form::number")]
    pub position_lost_share: f64,
    /// The stiffness that the fixed-point words realise divided by the stiffness that the scene asks for, less 1.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub stiffness_error: Option<f64>,
    /// Share of the clock edges at which the net that overflowed most had overflowed.
    #[serde(with = "form::number")]
    pub overflow_share: f64,
    /// The switches of a control; `None` of a device whose control does not switch.
    #[serde(flatten)]
    pub switching: Option<Box<Switching>>,
    /// What is told of the time after the run; `None` if it was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub for_ever: Option<ForEver>,
    /// Number of clock edges that were run.
    pub edges: u64,
    /// The duration of a run that would tell how the motion ends, if this one does not tell and such a duration is
    /// known.
    #[serde(rename = "telling_duration_s")]
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub telling_s: Option<f64>,
}

/// What is told of the time after a run, as [`Forever`] says more fully.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ForEver {
    /// It has settled, and no count of the encoder ever arrives again.
    Quiet,
    /// It has settled, and friction holds the shaft for ever.
    Stuck,
    /// It has settled, and what repeats for ever has less than one count rms, or stays within one count for ever.
    Settled,
    /// It repeats for ever, and has not settled.
    Repeats,
    /// It stays within bounds for ever, which do not tell that it stays settled.
    Bounded,
    /// It leaves for ever.
    Grows,
    /// Nothing is told.
    NotTold,
}

impl ForEver {
    fn of(summary: &Summary) -> Option<Self> {
        let settled = summary.is_settled_for_ever();
        Some(match summary.forever.as_ref()? {
            Ok(Forever::Quiet(quiet)) if settled => {
                if quiet.is_stuck {
                    Self::Stuck
                } else {
                    Self::Quiet
                }
            }
            Ok(Forever::Recurs { .. } | Forever::Bounded { .. }) if settled => Self::Settled,
            Ok(Forever::Recurs { .. }) => Self::Repeats,
            Ok(Forever::Bounded { .. } | Forever::InContact(_)) => Self::Bounded,
            Ok(Forever::Grows { .. }) => Self::Grows,
            _ => Self::NotTold,
        })
    }

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Stuck => "stuck",
            Self::Settled => "settled",
            Self::Repeats => "repeats",
            Self::Bounded => "bounded",
            Self::Grows => "grows",
            Self::NotTold => "not_told",
        }
    }

    /// Whether the device stays settled, by proof or because the emulator repeats.
    pub fn is_settled(self) -> bool {
        matches!(self, Self::Quiet | Self::Stuck | Self::Settled)
    }
}

/// A stiffness that is felt.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Displayed {
    /// The felt stiffness, in N·m/rad or N/m.
    #[serde(rename = "displayed_stiffness", with = "form::number")]
    pub stiffness: f64,
    /// The stiffness that the scene asks for, in the same unit; 0 if it asks for none.
    #[serde(rename = "asked_stiffness", with = "form::number")]
    pub asked: f64,
}

impl Displayed {
    /// Returns the felt stiffness divided by the stiffness that the scene asks for.
    pub fn ratio(self) -> Option<f64> {
        (self.asked > 0.0).then(|| self.stiffness / self.asked)
    }
}

/// Returns the name of a cell's outcome; `failed` for a cell without one.
pub fn outcome_name(outcome: Option<OutcomeKind>) -> &'static str {
    outcome.map_or("failed", OutcomeKind::name)
}

/// Outcomes of rows, by their names.
mod outcome {
    use hpu_cosim::scene::OutcomeKind;
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub fn serialize<S: Serializer>(outcome: &OutcomeKind, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(outcome.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<OutcomeKind, D::Error> {
        let name = String::deserialize(from)?;
        let outcome = OutcomeKind::ALL.into_iter().find(|kind| kind.name() == name);
        outcome.ok_or_else(|| de::Error::custom(format!("{name} is no outcome")))
    }
}

/// How far a cell is run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellLimits {
    /// Greatest number of events; a cell with more has failed. The effect of this limit depends on the scene alone.
    pub events: u64,
    /// Wall time after which a cell is given up. It has not failed then: it may end on a faster machine or on an idle
    /// one.
    pub guard: Duration,
    /// How long a cell looks on after its end, if it is asked how it goes on for ever.
    pub for_ever: Option<Duration>,
}

impl CellLimits {
    /// Limits without a guard, for studies that need the run in order to go on.
    pub const UNGUARDED: Self = Self { events: 100_000_000, guard: Duration::MAX, for_ever: None };
}

impl Default for CellLimits {
    /// Returns the usual limits: nearly two hundred times the events of the longest shipped scene, and half an hour.
    fn default() -> Self {
        Self { events: 300_000_000, guard: Duration::from_secs(1800), for_ever: None }
    }
}

/// Returns the error of a run that ended because it had too many events.
pub(crate) fn more_events(most: u64) -> Error {
    Error::of(Kind::Events, format_args!("more than {most} events"))
}

/// Greatest number of rows of a recording that a cell may hold.
const MOST_ROWS: u64 = 20_000_000;

impl Cell {
    /// Runs an experiment; returns `None` when `control` or the guard stopped it.
    ///
    /// # Errors
    ///
    /// Returns why the experiment could not be run to its end; too many events are such a reason.
    pub fn run(experiment: &Experiment, limits: CellLimits, control: &Control) -> Result<Option<Self>, Error> {
        let simulation = any_simulation(experiment)?;
        let rows = simulation.edges() / simulation.stride();
        if rows > MOST_ROWS {
            let most = format!("{rows} rows would be recorded, a cell may have {MOST_ROWS}");
            return Err(format!("{most}: lower record.plant_rate or run.duration").into());
        }
        let (CellLimits { events, guard, .. }, mut trace) = (limits, simulation.brief_trace());
        let mut switches = experiment.switches(&simulation);
        let mut nothing = ();
        let run = |own: &Control| match &simulation {
            AnySimulation::Ours(ours) => {
                let observer: &mut dyn Observe = match &mut switches {
                    Some(switches) => &mut **switches,
                    None => &mut nothing,
                };
                #[cfg(not(target_family = "wasm"))]
                if let Some(longest) = limits.for_ever {
                    let ask = |asked: &hpu_cosim::Beyond| {
                        ours.run_beyond(Driver::Events, &mut trace, &mut *observer, own, Some(asked))
                    };
                    return Ok(lasting::beyond(experiment, longest.as_secs_f64(), ask));
                }
                Ok(ours.run(Driver::Events, &mut trace, observer, own))
            }
            AnySimulation::Dut(dut) => {
                #[cfg(not(target_family = "wasm"))]
                if let Some(longest) = limits.for_ever {
                    let ask = |asked: &hpu_cosim::Beyond| dut.run_beyond(false, &mut trace, &mut (), own, Some(asked));
                    return lasting::beyond(experiment, longest.as_secs_f64(), ask).map_err(Error::design);
                }
                dut.run(false, &mut trace, &mut (), own).map_err(Error::design)
            }
        };
        let (summary, late) = limited(Some(events), guard, control, run);
        let summary = summary?;
        if let Some(unfit) = summary.heard.unfit(simulation.clock()) {
            return Err(Error::design(unfit.into()));
        }
        if !summary.complete {
            let stopped = late || control.stop.load(Ordering::Relaxed);
            return if stopped { Ok(None) } else { Err(more_events(events)) };
        }
        let verdict = summary.verdict.ok_or("a recording has no verdict")?;
        let (scale, is_settled) = (experiment.setup().scale(), matches!(verdict, Verdict::Settled { .. }));
        let (rms, amplitude, frequency_hz) = numbers(verdict.in_units(scale));
        let displayed = wall(experiment).filter(|_| is_settled).and_then(|wall| {
            let [stiffness, asked] = [displayed_stiffness(wall, &trace, summary.averages)?.0, wall.1];
            Some(Displayed { stiffness: stiffness / (scale * scale), asked: asked / (scale * scale) })
        });
        let words = match experiment {
            Experiment::Axis(scene) => scene.words().ok().map(|words| (scene, words.realised)),
            _ => None,
        };
        let wraps = words.and_then(|(scene, realised)| product_wraps(scene, &realised, &trace, &summary));
        let wraps = wraps.and_then(|wraps| NonZeroU32::new(u32::try_from(wraps).unwrap_or(u32::MAX)));
        let share = |edges: u64| edges as f64 / summary.edges.max(1) as f64;
        let unseen = words.and_then(|(scene, realised)| unseen_contact(scene, &realised, &trace, &summary));
        Ok(Some(Self {
            outcome: summary.outcome().ok_or("a recording has no verdict")?,
            rms,
            amplitude,
            frequency_hz,
            hand_j: summary.energy.hand_j,
            source_j: summary.energy.source_j,
            dissipated_j: summary.energy.dissipated_j,
            displayed,
            contact_share: summary.contact_share,
            device_contact_share: summary.device_contact_share,
            product_wraps: wraps,
            contact_unseen: unseen.is_some(),
            position_lost_share: share(summary.unheld.map_or(0, |unheld| unheld.edges)),
            stiffness_error: experiment.setup().stiffness_error(),
            overflow_share: share(summary.nets.iter().map(|net| net.usage.overflowed).max().unwrap_or(0)),
            switching: switches.map(|switches| Box::new(switches.switching())),
            for_ever: ForEver::of(&summary),
            edges: summary.edges,
            telling_s: verdict.telling_s(),
        }))
    }
}

/// Returns the surface and the stiffness of the wall that a scene has, both in SI units; of a design, whose wall has no
/// stiffness that is known, 0.
fn wall(experiment: &Experiment) -> Option<(f64, f64)> {
    match experiment {
        Experiment::Axis(scene) => {
            scene.target.is_none().then_some((scene.wall.position_rad, scene.wall.stiffness_nm_per_rad))
        }
        Experiment::Dut(scene) => scene.wall_rad.map(|wall_rad| (wall_rad, 0.0)),
        Experiment::Foc(scene) => scene.wall.as_ref().map(|wall| (wall.position_rad, wall.stiffness_nm_per_rad)),
        _ => None,
    }
}

/// Returns any scene made ready to run. If it has a design of the user's own, this is built by what the program has
/// provided.
pub(crate) fn any_simulation(experiment: &Experiment) -> Result<AnySimulation<'_>, Error> {
    match experiment {
        Experiment::Dut(_) => {
            let made = dut::provided().and_then(|designs| AnySimulation::new(experiment, designs, Inside::Nothing));
            made.map_err(Error::design)
        }
        ours => WiredSimulation::new(ours).map(AnySimulation::Ours).map_err(Error::from),
    }
}

/// Returns rms, amplitude and frequency of a verdict.
fn numbers(verdict: Verdict) -> (Option<f64>, Option<f64>, Option<f64>) {
    match verdict {
        Verdict::Settled { rms_rad } | Verdict::PositionLost { rms_rad, .. } => (Some(rms_rad), None, None),
        Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz } => {
            (Some(rms_rad), Some(amplitude_rad), Some(frequency_hz))
        }
        Verdict::NotTold { rms_rad, amplitude_rad, .. } => (Some(rms_rad), Some(amplitude_rad), None),
        Verdict::HandMoves { rms_rad, .. } => (Some(rms_rad), None, None),
        Verdict::Diverged { amplitude_rad, .. } => (None, Some(amplitude_rad), None),
        Verdict::Passive { rms_m } | Verdict::NonPassive { rms_m } | Verdict::Tracking { rms_m, .. } => {
            (Some(rms_m), None, None)
        }
        Verdict::HighlyUnstable { .. } | Verdict::NoWallTorque { .. } => (None, None, None),
    }
}
