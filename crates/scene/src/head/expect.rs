//! The results that a scene expects of its run.

use std::ops::RangeInclusive;

use crate::head::outcome::OutcomeKind;
use crate::head::rows as keys;
use crate::replay::{self, Columns, Motion, ReplayError, Taken, Unit};
use crate::schema::quantity as q;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, Expected, Key};
use crate::text::message::number;

/// The expected results of a run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Expect {
    /// The verdict.
    pub outcome: Option<OutcomeKind>,
    /// The numbers.
    pub numbers: Vec<Expectation>,
    /// The log of a real device, or of another simulator, that the run must follow.
    pub recording: Option<Log>,
}

/// A log of a motion, beside which a run is held.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Log {
    /// Its file, beside the scene.
    pub file: String,
    /// The columns of its times and of its positions or counts.
    pub columns: Columns,
    /// Beginning of the part that counts, as a time of the log; none for its first row.
    pub from_s: Option<f64>,
    /// End of that part; none for its last row.
    pub to_s: Option<f64>,
    /// Time that is added to those of the log, so that they are those of the run; none for as much as lets the part
    /// begin with the run.
    pub offset_s: Option<f64>,
    /// The column held beside it: the device's position, or a net in counts; none for the device's position, or for the
    /// position counter beside a log of counts.
    pub column: Option<String>,
    /// Steps by which the log may be shifted to either side.
    pub shift: u32,
    /// One such step; none for the least time between two rows.
    pub step_s: Option<f64>,
    /// The greatest root mean square of the difference, in rad or m.
    pub rms: Option<f64>,
}

/// The greatest size of a time in a log, in s, and of a position, in rad or m.
const MOST: (f64, f64) = (q::TIME.most, q::ANGLE.most);

impl Log {
    /// Reads the log of a device whose positions are in `unit`: the rows of its part, with the times of the run. The
    /// times begin at 0 unless the log has an offset.
    ///
    /// # Errors
    ///
    /// [`ReplayError`] as [`replay::read_motion`], and where no row is in the part.
    pub fn read(&self, bytes: &[u8], unit: Unit) -> Result<(Motion, Taken), ReplayError> {
        let (motion, taken) = replay::read_motion(bytes, &self.columns, unit, MOST)?;
        let part = self.from_s.unwrap_or(f64::NEG_INFINITY)..=self.to_s.unwrap_or(f64::INFINITY);
        let [from, to] = taken.span_s.map(number);
        let none =
            || ReplayError::new(0, format!("the log lasts from {from} s to {to} s; write from and to within it"));
        let motion = match motion {
            Motion::Positions(points) => Motion::Positions(self.of_run(points, &part).ok_or_else(none)?),
            Motion::Counts(counts) => Motion::Counts(self.of_run(counts, &part).ok_or_else(none)?),
        };
        Ok((motion, taken))
    }

    /// Returns the rows of the part with the times of the run; `None` if there is none.
    fn of_run<T>(&self, mut rows: Vec<(f64, T)>, part: &RangeInclusive<f64>) -> Option<Vec<(f64, T)>> {
        rows.retain(|(time_s, _)| part.contains(time_s));
        let offset_s = self.offset_s.unwrap_or(-rows.first()?.0);
        rows.iter_mut().for_each(|(time_s, _)| *time_s += offset_s);
        Some(rows)
    }
}

/// An expected number, in SI units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Expectation {
    /// The metric.
    pub metric: Metric,
    /// The expected value, in the metric's SI unit.
    pub value: f64,
    /// The greatest deviation accepted, in the same unit.
    pub tolerance: f64,
}

/// A number computed from a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Metric {
    /// Angle at the end, rad.
    FinalAngle,
    /// Greatest angle in the recorded rows, rad.
    PeakAngle,
    /// Greatest angle beyond the wall in the recorded rows, rad.
    PeakPenetration,
    /// Amplitude of the verdict, rad.
    Amplitude,
    /// Frequency of the verdict, Hz.
    Frequency,
    /// Greatest torque of the motor in the recorded rows, N·m.
    PeakTorque,
    /// Share of the edges on which the spring's product did not fit, 0 to 1.
    SpringOverflowShare,
    /// Changes of the encoder's lines.
    EncoderEdges,
    /// Share of the judged window in which the wall sees penetration, 0 to 1.
    ContactShare,
    /// rms about the steady value at the end of a drop test, or of the distance from a target, m or rad.
    Rms,
}

impl Metric {
    /// Returns its key in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::FinalAngle => keys::expect::final_angle.name,
            Self::PeakAngle => keys::expect::peak_angle.name,
            Self::PeakPenetration => keys::expect::peak_penetration.name,
            Self::Amplitude => keys::expect::amplitude.name,
            Self::Frequency => keys::expect::frequency.name,
            Self::PeakTorque => keys::expect::peak_torque.name,
            Self::SpringOverflowShare => keys::expect::spring_overflow_share.name,
            Self::EncoderEdges => keys::expect::encoder_edges.name,
            Self::ContactShare => keys::expect::contact_share.name,
            Self::Rms => keys::expect::rms.name,
        }
    }
}

/// Reads `[expect]`: the numbers that are there, and the verdict.
pub(crate) fn expect(
    s: &Section,
    metrics: &[(Metric, &Key<Expected>)],
    outcome: &Key<Choice<OutcomeKind>>,
) -> Result<Expect, SceneError> {
    let mut numbers = Vec::new();
    for (metric, key) in metrics.iter().filter(|(_, key)| s.has(key.name)) {
        let (value, tolerance) = s.read(key)?;
        numbers.push(Expectation { metric: *metric, value, tolerance });
    }
    Ok(Expect { outcome: s.given(outcome)?, numbers, recording: None })
}
