//! The outline of a scene made ready: the facts that recordings, pictures and verdicts read.

use std::sync::Arc;

use hpu_plant::REALS;
use hpu_signal::{Clock, Real, Signal};

use crate::result::columns::{AXIS_ROW, CURRENTS, RAIL_ROW, TORQUE_BETWEEN, with_sensors};
use crate::result::summary::Summary;
use crate::result::time_constants::TimeConstants;
use crate::result::trace::{ANGLE, TORQUE, Trace};
use crate::result::verdict::{
    Abort, Verdict, judge_drop, judge_following, judge_hand, judge_rest, judge_target, without_torque,
};
use hpu_scene::judged::{is_enough, stride};
use hpu_scene::{AxisTarget, Device, Head, Push, Record, Sensor, moves_until_s};

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
    /// Whether figures beside verdict and metrics are computed from all rows of these outputs.
    pub(crate) reads_rows: bool,
    /// Whether the device can touch anything: a wall, or a finger that presses on a segment.
    pub(crate) has_contact: bool,
    /// The net that shows contact; `None` of a design of the user's own.
    pub(crate) contact: Option<usize>,
    /// The position of an axis's wall, in the unit of the position's column.
    pub(crate) wall: Option<f64>,
    /// The least torque or force that this wall gives at rest.
    pub(crate) push: Option<Push>,
    pub(crate) waves: Waves,
    pub(crate) rule: Rule,
    /// The edge from which on the hand stands still.
    pub(crate) still: u64,
    /// The greatest time constants of an axis whose wall is known.
    pub(crate) slowest: Option<TimeConstants>,
}

/// The nets as waveforms show them. Nets of several joints are listed without the joint's number.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Waves {
    /// Groups with their names and their nets; empty for those of an axis.
    pub groups: &'static [(&'static str, &'static [&'static str])],
    /// Nets that are drawn as curves, beside those of an axis.
    pub curves: &'static [&'static str],
}

/// The rule of the verdict.
pub(crate) enum Rule {
    /// That of an axis, for the motion in this column, with the motion of one encoder count.
    Rest(usize, f64),
    /// The distance from a hand on this path, which moves until too late, in s, of the motion in this column, with the
    /// motion of one encoder count.
    Hand((usize, f64), Vec<(f64, f64)>, f64),
    /// That of a drop test, with the column of the logged coordinate.
    Drop(usize),
    /// The distance from a target that moves in the judged window, of the motion in this column.
    Target(usize, Arc<AxisTarget>),
    /// The device follows its target, from which it is as far as this column says.
    Follow(usize),
}

impl Outline {
    /// Returns the outline of a scene with this row, of which the first `reals` columns are outputs: each column means
    /// something, nothing is judged and no net commands, shows contact or is drawn between rows.
    pub(crate) fn new(
        head: &Head,
        (row, reals): (&'static [Real], usize),
        (closed_by, nets): (&str, Vec<Signal>),
        rule: Rule,
    ) -> Self {
        Self {
            name: head.name.clone(),
            clock: head.clock,
            edges: head.edges(),
            record: head.record,
            closed_by: closed_by.to_string(),
            nets,
            row,
            reals,
            columns: (0..row.len()).collect(),
            commands: Vec::new(),
            drawn: Vec::new(),
            has_device: true,
            judged: Vec::new(),
            reads_rows: false,
            has_contact: true,
            contact: None,
            wall: None,
            push: None,
            waves: Waves::default(),
            rule,
            still: 0,
            slowest: None,
        }
    }

    /// Returns the outline with a hand on this path: the motion is judged after the last move of the hand, or against
    /// the hand if too little is left.
    pub(crate) fn with_hand(self, path: Vec<(f64, f64)>) -> Self {
        let until_s = moves_until_s(&path);
        let (still, stride) = (self.clock.edges(until_s), stride(self.clock, self.record.plant_rate_hz));
        let is_judged = is_enough(self.edges / stride + 1, still.div_ceil(stride));
        let rule = match self.rule {
            Rule::Rest(column, count) if !is_judged => Rule::Hand((column, count), path, until_s),
            rule => rule,
        };
        Self { still, rule, ..self }
    }

    /// Returns the outline of a device that follows this target. A run whose target moves in the judged window is
    /// judged by the distance to it, else by the motion after the last move of the target. There is no wall.
    pub(crate) fn with_target(self, target: Option<&Arc<AxisTarget>>) -> Self {
        let Some(target) = target else { return self };
        let still = self.clock.edges(target.moves_until_s());
        let stride = stride(self.clock, self.record.plant_rate_hz);
        let is_judged = is_enough(self.edges / stride + 1, still.div_ceil(stride));
        let rule = match self.rule {
            Rule::Rest(column, _) | Rule::Hand((column, _), ..) if !is_judged => Rule::Target(column, target.clone()),
            rule => rule,
        };
        Self { still: still.max(self.still), rule, wall: None, has_contact: false, ..self }
    }

    /// Returns the outline with a column for each of these sensors.
    pub(crate) fn with_sensors(mut self, sensors: &[Sensor]) -> Self {
        let own = self.row.len();
        self.row = with_sensors(self.row, sensors);
        self.columns.extend(own..self.row.len());
        self
    }

    /// Returns the outline of an axis with this device, and a wall at a position that gives a push, if there is one;
    /// without `has_device`, a recording stands in the device's place.
    pub(crate) fn of_axis(
        head: &Head,
        (device, count_rad): (&Device, f64),
        wall: Option<(f64, Push)>,
        closed_by: (&str, Vec<Signal>),
        commands: Vec<Command>,
        has_device: bool,
    ) -> Self {
        let is_mass = matches!(device, Device::Mass(_));
        let row: &[Real] = if is_mass { &RAIL_ROW } else { &AXIS_ROW };
        let is_told = |column: &usize| has_device && !(is_mass && CURRENTS.contains(column));
        let outline = Self::new(head, (row, REALS.len()), closed_by, Rule::Rest(ANGLE, count_rad));
        let contact = outline.net("penetration");
        Self {
            columns: (0..row.len()).filter(is_told).collect(),
            commands,
            drawn: vec![TORQUE_BETWEEN],
            has_device,
            judged: vec![ANGLE, TORQUE],
            contact,
            wall: wall.filter(|_| has_device).map(|(wall_rad, _)| wall_rad),
            push: wall.filter(|_| has_device).map(|(_, push)| push),
            ..outline
        }
    }

    /// Returns the index of the net of this name.
    pub(crate) fn net(&self, name: &str) -> Option<usize> {
        self.nets.iter().position(|net| net.name == name)
    }

    /// Returns the verdict on the motion, from the trace of a complete run.
    pub(crate) fn judge(&self, trace: &Trace, aborted: Option<Abort>) -> Verdict {
        let slowest_s = |position| self.slowest?.at(position);
        match (&self.rule, aborted) {
            (Rule::Rest(..) | Rule::Follow(_) | Rule::Hand(..) | Rule::Target(..), Some(Abort { at_s, .. })) => {
                Verdict::Diverged { at_s, amplitude_rad: f64::INFINITY }
            }
            (Rule::Rest(column, count), None) => judge_rest(trace, *column, *count, slowest_s),
            (Rule::Hand(motion, path, until_s), None) => judge_hand(trace, *motion, (path, *until_s), slowest_s),
            (Rule::Target(column, target), None) => judge_target(trace, *column, target),
            (Rule::Follow(distance), None) => judge_following(trace, *distance),
            (Rule::Drop(logged), aborted) => judge_drop(trace, *logged, aborted),
        }
    }

    /// Returns the verdict on a motion inside an axis's wall that gives no torque, from trace and summary of a complete
    /// run; `None` for any other motion.
    pub(crate) fn without_torque(&self, trace: &Trace, summary: &Summary) -> Option<Verdict> {
        let (wall, [effort, _]) = (self.wall.zip(self.push)?, summary.averages?);
        let deep_s = summary.stays?.deep as f64 * self.clock.period_s();
        without_torque(trace, ANGLE, wall, effort, deep_s)
    }
}
