//! The outputs of a run by which models are compared, and the error allowed.

use super::quantity as q;
use super::section::Section;
use super::section::Sense::Within;
use super::source::SceneError;

/// An output of a run, by which models are compared.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Output {
    /// The motion at the plant's rate.
    Trace,
    /// The angle at the end.
    FinalAngle,
    /// The deepest point in the wall.
    PeakPenetration,
    /// The amplitude of the verdict.
    Amplitude,
    /// The frequency of the verdict.
    Frequency,
    /// The energy that source and hand have given.
    Energy,
    /// rms about the steady value at the end of a drop test.
    Rms,
    /// The verdict on the motion.
    Verdict,
}

impl Output {
    /// The outputs of an axis.
    pub const OF_AN_AXIS: [Self; 7] = [
        Self::Trace,
        Self::FinalAngle,
        Self::PeakPenetration,
        Self::Amplitude,
        Self::Frequency,
        Self::Energy,
        Self::Verdict,
    ];
    /// The outputs of a PHANToM.
    pub const OF_A_PHANTOM: [Self; 3] = [Self::Trace, Self::Rms, Self::Verdict];

    /// Returns its name in a scene.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Trace => "trace",
            Self::FinalAngle => "final_angle",
            Self::PeakPenetration => "peak_penetration",
            Self::Amplitude => "amplitude",
            Self::Frequency => "frequency",
            Self::Energy => "energy",
            Self::Rms => "rms",
            Self::Verdict => "verdict",
        }
    }
}

/// The outputs of a run that must be right, and the error allowed.
#[derive(Clone, PartialEq, Debug)]
pub struct Accuracy {
    /// The outputs that count; `None`: those that the verdict makes worth comparing.
    pub outputs: Option<Vec<Output>>,
    /// The relative error allowed.
    pub within: f64,
}

/// Reads `[accuracy]`; `all` holds the outputs of this kind of scene.
pub(super) fn accuracy(s: &Section, all: &[Output]) -> Result<Accuracy, SceneError> {
    s.accept(&["outputs", "within"])?;
    let within = s.quantity("within", &q::RATIO, Within(1e-9, 1e3), Some(0.01))?;
    Ok(Accuracy { outputs: if s.has("outputs") { Some(outputs(s, all)?) } else { None }, within })
}

fn outputs(s: &Section, all: &[Output]) -> Result<Vec<Output>, SceneError> {
    let accepted = || all.iter().map(|output| format!("\"{}\"", output.name())).collect::<Vec<_>>().join(", ");
    let list = s.get("outputs").and_then(|item| item.as_array());
    let list = list.filter(|list| !list.is_empty());
    let list = list.ok_or_else(|| s.error("outputs", format!("write a list of {}", accepted())))?;
    let mut outputs = Vec::new();
    for (index, value) in list.iter().enumerate() {
        let key = format!("outputs[{index}]");
        let found = all.iter().find(|output| value.as_str() == Some(output.name()));
        let output = found.ok_or_else(|| {
            s.error(&key, format!("`{}` is none of {}", value.to_string().trim().trim_matches('"'), accepted()))
        })?;
        if outputs.contains(output) {
            return Err(s.error(&key, format!("`{}` stands there already", output.name())));
        }
        outputs.push(*output);
    }
    Ok(outputs)
}
