//! The summary of a run: its verdict, its energy, its words.

use hpu_plant::Energy;
use hpu_signal::{Signal, SignalUse};
use serde::Serialize;

use crate::result::forever::{Forever, NotTold, Recurrence};
use crate::result::heard::Heard;
use crate::result::stays::Stays;
use crate::result::trace::{ANGLE, TORQUE, Trace};
use crate::result::verdict::{Abort, Verdict};
use hpu_scene::{Experiment, Metric, OutcomeKind};

/// A fault that has happened.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mark {
    /// The clock edge at which it began.
    pub edge: u64,
    /// Its name, as in scenes.
    pub what: &'static str,
}

impl Mark {
    /// All names of faults.
    pub const KINDS: [&'static str; 9] = [
        "missed_edge",
        "doubled_edge",
        "bounce",
        "glitch",
        "swapped",
        "inverted",
        "lost_index",
        "stuck_switch",
        "clock_jitter",
    ];
}

/// The energies supplied, stored and dissipated, in J.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct EnergyAudit {
    /// Supplied by the source, or by motors that are driven as torques.
    pub source_j: f64,
    /// Supplied by the hand.
    pub hand_j: f64,
    /// Supplied by both.
    pub supplied_j: f64,
    /// Stored in inductance and inertia, minus the energy stored at the start.
    pub stored_j: f64,
    /// Dissipated in winding and switches.
    pub copper_j: f64,
    /// Dissipated in diodes.
    pub diodes_j: f64,
    /// Dissipated in viscous friction.
    pub viscous_j: f64,
    /// Dissipated in Coulomb friction.
    pub coulomb_j: f64,
    /// Dissipated in the damping of a flexible transmission.
    pub transmission_j: f64,
    /// Dissipated in all of these.
    pub dissipated_j: f64,
    /// Sum of the sizes of all flows.
    pub exchanged_j: f64,
    /// Supplied minus stored minus dissipated: zero but for rounding.
    pub residual_j: f64,
}

impl EnergyAudit {
    /// Returns the audit of an axis, given the energy that it has stored since the start.
    pub(crate) fn of(energy: &Energy, stored_j: f64) -> Self {
        Self {
            source_j: energy.source_j(),
            hand_j: energy.hand_j(),
            supplied_j: energy.supplied_j(),
            stored_j,
            copper_j: energy.copper_j(),
            diodes_j: energy.diodes_j(),
            viscous_j: energy.viscous_j(),
            coulomb_j: energy.coulomb_j(),
            dissipated_j: energy.dissipated_j(),
            exchanged_j: energy.exchanged_j(),
            residual_j: energy.supplied_j() - stored_j - energy.dissipated_j(),
            ..Self::default()
        }
    }
}

/// A position counter that wrapped under its device: the distance to the wall did not fit its width.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Unheld {
    /// The clock edge at which it was so first.
    pub first: u64,
    /// The number of clock edges at which it was so.
    pub edges: u64,
}

/// How often a design has started samples of a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Starts {
    /// Samples taken.
    pub taken: u64,
    /// Starts without a sample, because the sensor was still converting the one before.
    pub missed: u64,
}

/// The frames of a chip on a bus.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Frames {
    /// All of them.
    pub all: u64,
    /// Frames of another length, with a wrong parity, or with a command, an address or data that the chip does not
    /// take.
    pub wrong: u64,
    /// Frames with a clock that is faster than the chip's data sheet allows.
    pub fast: u64,
}

/// The use of a net in a run.
#[derive(Clone, PartialEq, Debug)]
pub struct NetUse {
    /// The net.
    pub signal: Signal,
    /// Its range, and the number of edges at which it had lost bits.
    pub usage: SignalUse,
    /// Whether lost bits were seen. Of VHDL that differs from the emulator only the words are known, not the lost bits.
    pub losses_seen: bool,
}

/// The summary of a run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Summary {
    /// The verdict on the motion; `None` for a recording, which has no device.
    pub verdict: Option<Verdict>,
    /// Share of the judged window, the last 30 % of the run without the time in which the hand moves, in which the wall
    /// sees penetration; 0 if the wall is not reached. `None` for a run that did not come to its end and for a
    /// recording.
    pub contact_share: Option<f64>,
    /// Share of the judged window in which the device itself is beyond the wall. `None` as for `contact_share`, and for
    /// a device with more than one axis.
    pub device_contact_share: Option<f64>,
    /// The places of an axis in the judged window, in clock edges.
    pub stays: Option<Stays>,
    /// The loss of the position counter, if the device was out of its reach.
    pub unheld: Option<Unheld>,
    /// The early end and its reason, if the world ended the run.
    pub aborted: Option<Abort>,
    /// Whether the run reached its end, or the end that its world set; false if it was stopped or used up its events.
    pub complete: bool,
    /// Clock edges simulated.
    pub edges: u64,
    /// Seconds of motion.
    pub motion_s: f64,
    /// Seconds of wall time.
    pub wall_s: f64,
    /// Edges at which the datapath was ticked.
    pub ticks: u64,
    /// Edges of the encoder's lines.
    pub encoder_edges: u64,
    /// Edges at which an output changed: a gate, a motor's command.
    pub output_changes: u64,
    /// Changes of the plant's mode: stick and slip, diodes.
    pub mode_changes: u64,
    /// Steps of a device that moves in steps; 0 for one that flows.
    pub steps: u64,
    /// Decisions for which `f64` was not exact enough, made again in higher precision: on which side of a count an
    /// angle lies, whether a mode has ended.
    pub redecided: u64,
    /// The energy audit.
    pub energy: EnergyAudit,
    /// Exact means, over the judged part of the run, of the actuator's torque or force and of the position; for an axis
    /// whose run reached that part.
    pub averages: Option<[f64; 2]>,
    /// A state that came back to the last bit, if a run by events has found one: the run then repeats for ever.
    pub recurrence: Option<Recurrence>,
    /// How the run goes on for ever, or why that is not told; `None` if it was not asked.
    pub forever: Option<Result<Forever, NotTold>>,
    /// The faults that have happened, among those that the scene asks for.
    pub faults: Vec<Mark>,
    /// The number of faults that still wait for an edge of the encoder.
    pub faults_waiting: u64,
    /// The samples that a design of the user's own has started, of each sensor that waits for it, by its index.
    pub starts: Vec<(usize, Starts)>,
    /// The frames of each chip on a bus, by the index of its sensor.
    pub frames: Vec<(usize, Frames)>,
    /// The use of every net.
    pub nets: Vec<NetUse>,
    /// What a design of the user's own has said: failed assertions, messages, and its end of the run.
    pub heard: Heard,
}

impl Summary {
    /// Returns the number of events of all kinds: ticks of the datapath, changes of the plant's mode, and its steps. A
    /// law that runs without a clock ticks with the steps, which then count once.
    pub fn events(&self) -> u64 {
        let steps = if self.nets.is_empty() { 0 } else { self.steps };
        self.ticks + self.mode_changes + steps
    }

    /// Returns the share of the clock edges at which anything happened.
    pub fn activity(&self) -> f64 {
        self.ticks as f64 / self.edges.max(1) as f64
    }

    /// Returns the use of a net whose wiring has counted all losses but one: a loop reads through the wrap of its
    /// position counter as long as the device is within reach, which only the world knows.
    pub fn used(&self, signal: Signal, usage: SignalUse) -> NetUse {
        let unheld = self.unheld.filter(|_| signal.name == "position").map_or(0, |unheld| unheld.edges);
        NetUse { signal, usage: SignalUse { overflowed: usage.overflowed + unheld, ..usage }, losses_seen: true }
    }

    /// Returns whether the run has settled and stays so for ever: it is proved that no count arrives, or the emulator
    /// repeats with less than one count rms, or the motion is proved to come within one count of its rest.
    pub fn is_settled_for_ever(&self) -> bool {
        let stays = match &self.forever {
            Some(Ok(Forever::Quiet(_))) => true,
            Some(Ok(Forever::Recurs { rms_counts: off, .. } | Forever::Bounded { off_counts: off, .. })) => *off < 1.0,
            _ => false,
        };
        stays && self.outcome() == Some(OutcomeKind::Settled)
    }

    /// Returns the kind of the verdict.
    pub fn outcome(&self) -> Option<OutcomeKind> {
        self.verdict.map(Verdict::outcome)
    }
}

/// Returns a number that a scene may expect, in the scene's units, from summary and trace of a run; `None` if it has no
/// meaning.
pub fn metric(metric: Metric, experiment: &Experiment, summary: &Summary, trace: &Trace) -> Option<f64> {
    // A recording has no motion, but its edges and its words are counted.
    if !matches!(metric, Metric::EncoderEdges | Metric::SpringOverflowShare) {
        summary.verdict?;
    }
    let scale = experiment.setup().scale();
    Some(match metric {
        Metric::FinalAngle => scale * trace.last(ANGLE)?,
        Metric::PeakAngle => scale * trace.greatest(ANGLE),
        Metric::PeakPenetration => scale * (trace.greatest(ANGLE) - experiment.setup().wall_position()).max(0.0),
        Metric::Amplitude => match summary.verdict?.in_units(scale) {
            Verdict::LimitCycle { amplitude_rad, .. }
            | Verdict::NotTold { amplitude_rad, .. }
            | Verdict::Diverged { amplitude_rad, .. } => amplitude_rad,
            _ => 0.0,
        },
        Metric::Frequency => match summary.verdict? {
            Verdict::LimitCycle { frequency_hz, .. } | Verdict::NotTold { frequency_hz, .. } => frequency_hz,
            _ => 0.0,
        },
        Metric::PeakTorque => trace.greatest_size(TORQUE) / scale.abs(),
        Metric::SpringOverflowShare => {
            let spring = summary.nets.iter().find(|net| net.signal.name == "spring" && net.losses_seen)?;
            spring.usage.overflowed as f64 / summary.edges.max(1) as f64
        }
        Metric::EncoderEdges => summary.encoder_edges as f64,
        Metric::ContactShare => summary.contact_share?,
        Metric::Rms => match summary.verdict?.in_units(scale) {
            Verdict::Passive { rms_m } | Verdict::NonPassive { rms_m } | Verdict::Tracking { rms_m, .. } => rms_m,
            _ => return None,
        },
    })
}
