//! Reading `[hand]`: the hand that moves the device, and the recordings it may name.

use std::fmt::Display;
use std::io;

use crate::axis::file::{Covered, FileOfHand};
use crate::axis::parts::{Hand, PathPoint};
use crate::axis::rows as keys;
use crate::head::Head;
use crate::replay::{self, Motion, Recording, Taken, Unit, smooth};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::text::message::number;

/// Reads a file that the scene names.
pub(crate) type Load<'a> = &'a mut dyn FnMut(&str) -> io::Result<Vec<u8>>;

/// Reads the angle, or length, of one encoder count.
type Count<'a> = &'a dyn Fn() -> Result<f64, SceneError>;

/// A recording, and the part of a run that it covers.
pub(crate) struct Recorded {
    recording: Recording,
    covered: Covered,
}

impl Recorded {
    /// Returns the recording, unless it covers nothing of the run or of its judged window.
    pub(crate) fn check(self, head: &Head) -> Result<Recording, SceneError> {
        self.covered.check(head).map(|()| self.recording)
    }
}

/// Reads the hand, and the recording that it may name. `device` is the kind of a device that adds keys. `count` is
/// called only for a motion that is recorded in encoder counts.
pub(crate) fn hand(
    s: &Section,
    device: &[&'static str],
    load: Load,
    count: Count,
) -> Result<(Hand, Option<Recorded>), SceneError> {
    let kind = s.read(&keys::hand::kind)?;
    s.accept(&[&[kind], device].concat())?;
    match kind {
        "none" => Ok((Hand::None, None)),
        "constant_torque" => Ok((Hand::ConstantTorque { torque_nm: s.read(&keys::hand_torque::torque)? }, None)),
        "spring_damper" => {
            let stiffness_nm_per_rad = s.read(&keys::hand_grip::stiffness)?;
            let damping_nm_s_per_rad = s.read(&keys::hand_grip::damping)?;
            let (path, recorded) = motion(s, load, count)?;
            Ok((Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, path }, recorded))
        }
        "prescribed" => motion(s, load, count).map(|(path, recorded)| (Hand::Prescribed { path }, recorded)),
        _ => {
            let FileOfHand { path: file, columns, part } = s.read(&keys::hand_capture::file)?;
            let channel_a = s.read(&keys::hand_capture::channel_a)?;
            let channel_b = s.read(&keys::hand_capture::channel_b)?;
            let bytes = read(s, &file, load)?;
            let capture = replay::read_capture(&bytes, &channel_a, &channel_b, &columns)
                .map_err(|error| s.error("file", format!("{file}:{error}")))?;
            let (edges, covered) = part.of_capture(&capture).map_err(|reason| s.error("file", reason))?;
            let [first, last] = [capture.edges.first().map_or(0, |edge| edge.picoseconds), capture.end_picoseconds];
            let span_s = [first, last].map(|picoseconds| picoseconds as f64 / 1e12);
            let columns = capture.times.into_iter().chain([channel_a, channel_b]).collect();
            let rows = capture.edges.len();
            let recording = Recording { file, taken: Taken { columns, span_s, rows, notes: capture.notes } };
            Ok((Hand::Capture { edges }, Some(Recorded { recording, covered })))
        }
    }
}

fn read(s: &Section, file: &str, load: Load) -> Result<Vec<u8>, SceneError> {
    let accepted = "write the name of a file beside the scene";
    load(file).map_err(|error| s.error("file", format!("cannot read `{file}` ({error}); {accepted}")))
}

/// Returns the points of `path`, or those of `file`.
fn motion(s: &Section, load: Load, count: Count) -> Result<(Vec<PathPoint>, Option<Recorded>), SceneError> {
    match (s.has("path"), s.has("file")) {
        (true, true) => Err(s.error("file", "a path is given too; write one of path, file")),
        (false, false) => Err(s.error("path", "missing; write path = [[time, angle], ...], or file = \"motion.csv\"")),
        (true, false) => path(s).map(|path| (path, None)),
        (false, true) => {
            let FileOfHand { path: file, columns, part } = s.read(&keys::hand_motion::file)?;
            let bytes = read(s, &file, load)?;
            let refused = |error: &dyn Display| s.error("file", format!("{file}:{error}"));
            let most = (q::TIME.most, s.axis().position.most);
            let unit = if s.axis().position.si == "m" { Unit::Length } else { Unit::Angle };
            let read = replay::read_motion(&bytes, &columns, unit, most);
            let (motion, taken) = read.map_err(|error| refused(&error))?;
            let points = match motion {
                Motion::Positions(points) => points,
                Motion::Counts(mut recording) => {
                    recording.retain(|(time_s, _)| part.has(*time_s));
                    behind(&recording, count()?, most.1).map_err(|error| refused(&error))?
                }
            };
            let (points, covered) = part.of_motion(&points).map_err(|reason| s.error("file", reason))?;
            let points = points.into_iter().map(|(time_s, angle_rad)| PathPoint { time_s, angle_rad });
            Ok((points.collect(), Some(Recorded { recording: Recording { file, taken }, covered })))
        }
    }
}

/// Returns the smooth motion behind a recording of encoder counts; no angle may exceed `most_rad`.
fn behind(recording: &[(f64, i64)], count_rad: f64, most_rad: f64) -> Result<Vec<(f64, f64)>, String> {
    // A position is up to a count farther than its count.
    let beyond = |count: i64| (count.unsigned_abs() + 1) as f64 * count_rad > most_rad;
    if let Some((time_s, count)) = recording.iter().find(|(_, count)| beyond(*count)) {
        let most = (most_rad / count_rad - 1.0).max(0.0).floor();
        let [at, most] = [*time_s, most].map(number);
        return Err(format!(" the count {count} at {at} s; accepted with this encoder: -{most} to {most}"));
    }
    let positions = smooth(recording).ok_or(" no smooth motion is found; write times at more even distances")?;
    Ok(recording.iter().zip(positions).map(|((time_s, _), counts)| (*time_s, counts * count_rad)).collect())
}

/// Reads the points of `path` of a hand or of a target.
pub(crate) fn path(s: &Section) -> Result<Vec<PathPoint>, SceneError> {
    let accepted = format!("write {}", keys::PATH);
    let points = s.get("path").and_then(|item| item.as_array()).filter(|points| !points.is_empty());
    let points = points.ok_or_else(|| s.error("path", format!("not a path; {accepted}")))?;
    let mut path: Vec<PathPoint> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let key = format!("path[{index}]");
        let pair = point.as_array().filter(|pair| pair.len() == 2);
        let pair = pair.ok_or_else(|| s.error(&key, format!("not a pair; {accepted}")))?;
        let quantity = |at: usize, dimension, sense| {
            let item = toml_edit::Item::Value(pair.get(at).expect("one of two").clone());
            s.quantity_of(&format!("{key}[{at}]"), &item, dimension, sense, |_| None)
        };
        let time_s = quantity(0, &q::TIME, NotNegative)?;
        let angle_rad = quantity(1, s.axis().position, Any)?;
        if let Some(before) = path.last().filter(|before| time_s <= before.time_s) {
            let reason = format!("times must increase: {} s follows {} s", number(time_s), number(before.time_s));
            return Err(s.error(&format!("{key}[0]"), reason));
        }
        path.push(PathPoint { time_s, angle_rad });
    }
    let points = path.iter().map(|point| format!("[{}, {}]", number(point.time_s), number(point.angle_rad)));
    let text = format!("[{}]", points.collect::<Vec<_>>().join(", "));
    let unit = if s.axis().position.si == "m" { "s, m" } else { "s, rad" };
    s.note("path", ParameterValue::Text(text), unit, Origin::Scene);
    Ok(path)
}
