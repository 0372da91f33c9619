//! What of a run has to be right, and how right: what models are compared by.

use super::keys;
use super::section::Section;
use super::source::SceneError;

/// Something that a run tells, by which models are compared.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Output {
    /// The motion at the plant's rate.
    Trace,
    /// Where it ends.
    FinalAngle,
    /// The deepest point in the wall.
    PeakPenetration,
    /// The amplitude of the verdict.
    Amplitude,
    /// The frequency of the verdict.
    Frequency,
    /// What source and hand have given.
    Energy,
    /// rms about the steady value at the end of a drop test.
    Rms,
    /// What became of the motion.
    Verdict,
}

impl Output {
    /// Those of an axis.
    pub const OF_AN_AXIS: [Self; 7] = [
        Self::Trace,
        Self::FinalAngle,
        Self::PeakPenetration,
        Self::Amplitude,
        Self::Frequency,
        Self::Energy,
        Self::Verdict,
    ];
    /// Those of a PHANToM.
    pub const OF_A_PHANTOM: [Self; 3] = [Self::Trace, Self::Rms, Self::Verdict];

    /// Its name in a scene.
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

/// What of a run has to be right, and how right.
#[derive(Clone, PartialEq, Debug)]
pub struct Accuracy {
    /// The outputs that count; `None`: those that the verdict makes worth comparing.
    pub outputs: Option<Vec<Output>>,
    /// The relative error that is allowed.
    pub within: f64,
}

/// Reads `[accuracy]` of a kind of scene; `all` are the outputs there are.
pub(super) fn accuracy(s: &Section, all: &[Output], scene: &str) -> Result<Accuracy, SceneError> {
    s.accept(&[scene])?;
    let within = s.read(&keys::accuracy_all::within)?;
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
