//! The outline of a scene made ready: the facts that recordings, pictures and verdicts read.

use hpu_plant::REALS;
use hpu_signal::{Clock, Real, Signal};

use crate::columns::{
    ARM_REALS, ARM_ROW, AXIS_ROW, CURRENTS, ERROR, FORCE, GIMBAL_REALS, GIMBAL_ROW, RADIUS, RAIL_ROW, STRESSES,
    TORQUE_BETWEEN,
};
use crate::scene::{Device, Head, Record};
use crate::trace::{ANGLE, TORQUE, Trace};
use crate::verdict::{Abort, Verdict, judge, judge_drop, judge_following};

/// A net that commands an actuator, the column of the effort that it asks for, and the effort of one ulp of its word.
pub(crate) type Command = (&'static str, &'static str, f64);

/// The facts about a scene made ready. Each kind of scene fills one; [`Simulation`](crate::Simulation) answers from it
/// and says what each fact means.
pub struct Outline {
    pub(crate) name: String,
    pub(crate) clock: Clock,
    pub(crate) edges: u64,
    pub(crate) record: Record,
    pub(crate) closed_by: String,
    pub(crate) nets: Vec<Signal>,
    pub(crate) row: &'static [Real],
    /// Number of the continuous outputs, the first columns of a row.
    pub(crate) reals: usize,
    pub(crate) columns: Vec<usize>,
    pub(crate) commands: Vec<Command>,
    pub(crate) drawn: Vec<[usize; 3]>,
    pub(crate) has_device: bool,
    pub(crate) judged: Vec<usize>,
    /// Whether the device can touch anything: a wall, or a finger that presses on a segment.
    pub(crate) has_contact: bool,
    rule: Rule,
}

/// The rule of the verdict.
enum Rule {
    /// That of an axis, with the angle of one encoder count.
    Axis(f64),
    /// That of a drop test, with the index of the logged coordinate among the outputs.
    Drop(usize),
    /// That of an axis, for the radius of a segment, with the radius of one count of the crank.
    Radius(f64),
    /// A segment follows its target.
    Follow,
}

impl Outline {
    /// Returns the outline of an axis with this device; without `has_device`, a recording stands in its place.
    pub(crate) fn of_axis(
        head: &Head,
        (device, count_rad): (&Device, f64),
        (closed_by, nets): (&str, Vec<Signal>),
        commands: Vec<Command>,
        has_device: bool,
    ) -> Self {
        let is_mass = matches!(device, Device::Mass(_));
        let row: &[Real] = if is_mass { &RAIL_ROW } else { &AXIS_ROW };
        let is_told = |column: &usize| has_device && !(is_mass && CURRENTS.contains(column));
        Self {
            name: head.name.clone(),
            clock: head.clock,
            edges: head.edges(),
            record: head.record,
            closed_by: closed_by.to_string(),
            nets,
            row,
            reals: REALS.len(),
            columns: (0..row.len()).filter(is_told).collect(),
            commands,
            drawn: vec![TORQUE_BETWEEN],
            has_device,
            judged: vec![ANGLE, TORQUE],
            has_contact: true,
            rule: Rule::Axis(count_rad),
        }
    }

    /// Returns the outline of an arm's drop test along an axis.
    pub(crate) fn of_drop(
        head: &Head,
        axis: usize,
        (closed_by, nets): (&str, Vec<Signal>),
        commands: Vec<Command>,
    ) -> Self {
        let logged = 3 + axis;
        Self {
            name: head.name.clone(),
            clock: head.clock,
            edges: head.edges(),
            record: head.record,
            closed_by: closed_by.to_string(),
            nets,
            row: &ARM_ROW,
            reals: ARM_REALS.len(),
            columns: (0..ARM_ROW.len()).collect(),
            commands,
            drawn: Vec::new(),
            has_device: true,
            judged: vec![axis, logged],
            has_contact: true,
            rule: Rule::Drop(logged),
        }
    }

    /// Returns the outline of a segment on a gimbal, whose target stands still in the judged window if its radius is to
    /// come to rest within `still_within_m`. Without a finger it has no contact, and without shear no stresses.
    pub(crate) fn of_gimbal(
        head: &Head,
        (still_within_m, has_contact, has_shear): (Option<f64>, bool, bool),
        (closed_by, nets): (&str, Vec<Signal>),
        commands: Vec<Command>,
    ) -> Self {
        Self {
            name: head.name.clone(),
            clock: head.clock,
            edges: head.edges(),
            record: head.record,
            closed_by: closed_by.to_string(),
            nets,
            row: &GIMBAL_ROW,
            reals: if has_shear { GIMBAL_REALS.len() } else { STRESSES[0] },
            columns: (0..GIMBAL_ROW.len()).filter(|column| has_shear || !STRESSES.contains(column)).collect(),
            commands,
            drawn: Vec::new(),
            has_device: true,
            judged: [RADIUS, ERROR, FORCE].into_iter().chain(STRESSES.into_iter().filter(|_| has_shear)).collect(),
            has_contact,
            rule: still_within_m.map_or(Rule::Follow, Rule::Radius),
        }
    }

    /// Returns the verdict on the motion, from the trace of a complete run.
    pub(crate) fn judge(&self, trace: &Trace, aborted: Option<Abort>) -> Verdict {
        match (&self.rule, aborted) {
            (Rule::Axis(_) | Rule::Radius(_) | Rule::Follow, Some(Abort { at_s, .. })) => {
                Verdict::Diverged { at_s, amplitude_rad: f64::INFINITY }
            }
            (Rule::Axis(count_rad), None) => judge(trace, ANGLE, *count_rad),
            (Rule::Radius(count_m), None) => judge(trace, RADIUS, *count_m),
            (Rule::Follow, None) => judge_following(trace, ERROR),
            (Rule::Drop(logged), aborted) => judge_drop(trace, *logged, aborted),
        }
    }
}
