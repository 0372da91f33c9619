//! The results that a scene expects of its run.

use crate::head::outcome::OutcomeKind;
use crate::head::rows as keys;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, Expected, Key};

/// The expected results of a run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Expect {
    /// The verdict.
    pub outcome: Option<OutcomeKind>,
    /// The numbers.
    pub numbers: Vec<Expectation>,
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
    /// rms about the steady value at the end of a drop test, or of the distance between tip and target, m.
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
            Self::Rms => "rms",
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
    Ok(Expect { outcome: s.given(outcome)?, numbers })
}
