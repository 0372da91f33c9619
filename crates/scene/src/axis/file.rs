//! The file of a hand: its name, the columns of a table, and the part of a recording that counts.

use hpu_signal::Cycle;

use crate::head::Head;
use crate::head::expect::Log;
use crate::judged::{stride, window_start};
use crate::replay::{Capture, Columns, PinEdge};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive};
use crate::schema::section::{Section, shown};
use crate::schema::source::SceneError;
use crate::schema::value::said;
use crate::schema::{Group, Key, Otherwise, Quantity, Read, Shape, Takes, Text, Whole, keys};
use crate::text::message::number;

keys! { hand_file: "hand.file" of [];
    /// Name of the file.
    path: Text = Text("the name of a file beside the scene", Required);
    /// Beginning of the part that counts, as a time of the recording.
    from: Quantity = Quantity::new(&q::TIME, Any, Said("its beginning"));
    /// End of that part. The last position or level is kept up to a later time than the recording's end.
    to: Quantity = Quantity::new(&q::TIME, Any, Said("its end"));
    /// Time that is added to those of the recording, so that they are those of the run.
    offset: Quantity = Quantity::new(&q::TIME, Any, Said("0, or with `from` as much as makes that the run's start"));
    /// Column of a table's times, as in the header; a unit that the header does not have stands behind it, as in
    /// `t [ms]`. Columns without a header have numbers, as in `1 [ms]`.
    time: Text = Text("the name of a column, as in \"t [ms]\"", Said("the one with a unit of time"));
    /// Character between two columns of a table; a blank also stands for several.
    delimiter: Text = Text("one character, as in \";\"", Said("a tab, `;`, `,` or blank: the first in most rows"));
}

keys! { hand_file_motion: "hand.file" of ["spring_damper", "prescribed"];
    /// Column of the angles, positions or counts, in the same way.
    angle: Text = Text("the name of a column, as in \"knob [deg]\"", Said("the one with a unit of the motion"));
}

keys! { expect_recording: "expect.recording" of [];
    /// Table with the log, beside the scene, as the table of a hand's motion. Unless the file has an offset, its part
    /// begins with the run.
    file: OfFile = OfFile("the name of a table beside the scene (CSV)", Required);
    /// Column held beside it: the device's position, or a net in counts, which counts from the run's start.
    column: Text = Text(
        "the name of a column of the trace, as in \"position\"",
        Said("the device's position; beside counts the position counter"),
    );
    /// Greatest root mean square of the difference.
    rms: Quantity = Quantity::along(|axis| axis.position, NotNegative, Said("not judged"));
    /// Steps by which the log may be shifted, to either side, where it is not known when it began; the best of these
    /// shifts is told.
    shift: Whole<u32> = Whole::new(0, 100_000, Is(0));
    /// One such step.
    step: Quantity = Quantity::new(&q::TIME, Positive, Said("the least time between two rows"));
}

/// A file: a name alone, or a section. The fields are a description of the file, and the default.
pub(crate) struct OfFile(pub &'static str, pub Otherwise<&'static str>);

/// A file that a hand names.
pub(crate) struct FileOfHand {
    pub path: String,
    pub columns: Columns,
    pub part: Part,
}

impl Read for OfFile {
    type Value = FileOfHand;

    fn takes(&self) -> Takes {
        Takes::Own(Shape::File, self.0)
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        said(self.1, |text| ParameterValue::Text(text.to_string()))
    }

    fn read(&self, s: &Section, name: &str) -> Result<FileOfHand, SceneError> {
        let Some(item) = s.get(name) else {
            return Err(s.error(name, format!("missing; write {}", self.0)));
        };
        if item.is_table_like() {
            // A log is read as a motion is.
            let kind = s.get("kind").and_then(|kind| kind.as_str()).unwrap_or("prescribed");
            return file(&s.section(name)?, kind);
        }
        let path = item.as_str().filter(|path| !path.trim().is_empty());
        let path = path.ok_or_else(|| s.error(name, format!("{} is not {}", shown(item), self.0)))?.to_string();
        s.note(name, ParameterValue::Text(path.clone()), "", Origin::Default);
        Ok(FileOfHand { path, columns: Columns::default(), part: Part::default() })
    }
}

/// Reads the section of a file.
fn file(s: &Section, kind: &str) -> Result<FileOfHand, SceneError> {
    use {hand_file as key, hand_file_motion as of_motion};
    s.accept_as("hand.file", &[kind])?;
    let separator = match s.given(&key::delimiter)?.map(|text| text.chars().collect::<Vec<_>>()) {
        None => None,
        Some(one) => match one[..] {
            [one] if one.is_ascii() && one != '"' && one != '\n' => Some(one),
            _ => return Err(s.error(key::delimiter.name, "write one character, as in \";\" or \"\\t\"")),
        },
    };
    let part = Part { from_s: s.given(&key::from)?, to_s: s.given(&key::to)?, offset_s: s.given(&key::offset)? };
    if let (Some(from_s), Some(to_s)) = (part.from_s, part.to_s)
        && to_s <= from_s
    {
        return Err(s.error(key::to.name, format!("{} s; write a time after from, {} s", number(to_s), number(from_s))));
    }
    let columns = Columns { time: s.given(&key::time)?, position: s.given(&of_motion::angle)?, separator };
    Ok(FileOfHand { path: s.read(&key::path)?, columns, part })
}

/// Reads `[expect.recording]`.
pub(crate) fn log(s: &Section) -> Result<Log, SceneError> {
    use expect_recording as key;
    s.accept(&[])?;
    let FileOfHand { path: file, columns, part } = s.read(&key::file)?;
    let Part { from_s, to_s, offset_s } = part;
    let (column, step_s, rms) = (s.given(&key::column)?, s.given(&key::step)?, s.given(&key::rms)?);
    Ok(Log { file, columns, from_s, to_s, offset_s, column, shift: s.read(&key::shift)?, step_s, rms })
}

/// The part of a recording that counts, in times of the recording, and the time that is added to them.
#[derive(Clone, Copy, Default)]
pub(crate) struct Part {
    from_s: Option<f64>,
    to_s: Option<f64>,
    offset_s: Option<f64>,
}

/// The part of a run that a recording covers, in s.
#[derive(Clone, Copy)]
pub(crate) struct Covered {
    begin_s: f64,
    /// Infinite if the last position or level is to be kept.
    end_s: f64,
}

impl Part {
    fn offset_s(&self) -> f64 {
        self.offset_s.or_else(|| self.from_s.map(|from_s| -from_s)).unwrap_or(0.0)
    }

    /// Returns the part of a run that a recording of these times covers; refuses one that begins before the run, unless
    /// the scene says so.
    fn covered(&self, [first_s, last_s]: [f64; 2]) -> Result<Covered, String> {
        let (from_s, to_s) = (self.from_s.unwrap_or(first_s), self.to_s.unwrap_or(last_s));
        let [first, last] = [first_s, last_s].map(number);
        if from_s > last_s || to_s < first_s {
            return Err(format!("the recording lasts from {first} s to {last} s; write from and to within it"));
        }
        let offset_s = self.offset_s();
        let begin_s = from_s.max(first_s) + offset_s;
        if begin_s < 0.0 && self.from_s.is_none() && self.offset_s.is_none() {
            return Err(format!(
                "the recording begins at {first} s, before the run; write file = {{ path = \"...\", from = \"{first} \
                 s\" }}, or another beginning"
            ));
        }
        let end_s = if to_s > last_s { f64::INFINITY } else { to_s + offset_s };
        Ok(Covered { begin_s, end_s })
    }

    /// Returns whether a time of the recording is within the part.
    pub(crate) fn has(&self, time_s: f64) -> bool {
        (self.from_s.unwrap_or(f64::NEG_INFINITY)..=self.to_s.unwrap_or(f64::INFINITY)).contains(&time_s)
    }

    /// Returns the points of a motion within the part, with the times of the run.
    pub(crate) fn of_motion(&self, points: &[(f64, f64)]) -> Result<(Vec<(f64, f64)>, Covered), String> {
        let [Some(first), Some(last)] = [points.first(), points.last()] else { return Err("no point".into()) };
        let covered = self.covered([first.0, last.0])?;
        let offset_s = self.offset_s();
        let low_s = self.from_s.unwrap_or(f64::NEG_INFINITY).max(-offset_s);
        let high_s = self.to_s.unwrap_or(f64::INFINITY);
        let between = |time_s: f64| {
            let after = points.partition_point(|point| point.0 <= time_s);
            let (from, to) = (points[after.max(1) - 1], points[after.min(points.len() - 1)]);
            let share = if to.0 > from.0 { (time_s - from.0) / (to.0 - from.0) } else { 0.0 };
            (time_s, libm::fma(share.clamp(0.0, 1.0), to.1 - from.1, from.1))
        };
        let mut part: Vec<_> = points.iter().copied().filter(|(time_s, _)| (low_s..=high_s).contains(time_s)).collect();
        if first.0 < low_s && part.first().is_none_or(|point| point.0 > low_s) {
            part.insert(0, between(low_s));
        }
        if last.0 > high_s && part.last().is_none_or(|point| point.0 < high_s) {
            part.push(between(high_s));
        }
        if part.is_empty() {
            // All of it lies before the run's start.
            part.push((low_s, last.1));
        }
        Ok((part.into_iter().map(|(time_s, position)| (time_s + offset_s, position)).collect(), covered))
    }

    /// Returns the levels of a capture within the part, with the times of the run; the first is at 0.
    pub(crate) fn of_capture(&self, capture: &Capture) -> Result<(Vec<PinEdge>, Covered), String> {
        let picoseconds = |time_s: f64| (time_s * 1e12).round() as i64;
        let (first, last) = (capture.edges.first().map_or(0, |edge| edge.picoseconds), capture.end_picoseconds);
        let covered = self.covered([first, last].map(|picoseconds| picoseconds as f64 / 1e12))?;
        let offset = picoseconds(self.offset_s());
        let low = self.from_s.map_or(i64::MIN, picoseconds).max(offset.saturating_neg());
        let high = self.to_s.map_or(i64::MAX, picoseconds);
        let mut edges: Vec<PinEdge> = Vec::new();
        for edge in capture.edges.iter().filter(|edge| edge.picoseconds <= high) {
            let at_start = edge.picoseconds <= low || edges.is_empty();
            let edge = PinEdge { picoseconds: edge.picoseconds.saturating_add(offset), ..*edge };
            if at_start {
                edges.clear();
                edges.push(PinEdge { picoseconds: 0, ..edge });
            } else {
                edges.push(edge);
            }
        }
        Ok((edges, covered))
    }
}

impl Covered {
    /// Refuses a recording that covers nothing of the run, or nothing of its judged window.
    pub(crate) fn check(self, head: &Head) -> Result<(), SceneError> {
        let duration_s = head.run.duration_s;
        // Rounded to picoseconds: sums of times have rounding errors.
        let [begin, end, duration] = [self.begin_s, self.end_s, duration_s].map(|s| number((s * 1e12).round() / 1e12));
        if self.begin_s >= duration_s {
            let reason = format!(
                "the recording begins at {begin} s, and the run ends at {duration} s; write file = {{ path = \"...\", \
                 offset = \"-{begin} s\" }}"
            );
            return Err(head.error("hand.file", reason));
        }
        let window = window_start(head.edges(), stride(head.clock, head.record.plant_rate_hz), 0);
        let window_s = head.clock.seconds(Cycle(window));
        if self.end_s < window_s {
            let reason = format!(
                "the recording ends at {end} s, before the judged window, which begins at {} s; write a shorter \
                 run.duration, or file = {{ path = \"...\", to = \"{duration} s\" }} to keep what it ends with",
                number(window_s)
            );
            return Err(head.error("hand.file", reason));
        }
        Ok(())
    }
}
