//! The outputs of a run by which models are compared, and the error allowed.

use toml_edit::Item;

use crate::schema::parameter::ParameterValue;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Otherwise, Read, Takes, none_of, quoted};

hpu_signal::named! {
    /// An output of a run, by which models are compared.
    #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
    pub enum Output {
        /// The motion at the plant's rate.
        Trace = "trace",
        /// The angle at the end.
        FinalAngle = "final_angle",
        /// The deepest point in the wall.
        PeakPenetration = "peak_penetration",
        /// The amplitude of the verdict.
        Amplitude = "amplitude",
        /// The frequency of the verdict.
        Frequency = "frequency",
        /// The energy that source and hand have given.
        Energy = "energy",
        /// rms about the steady value at the end of a drop test.
        Rms = "rms",
        /// The verdict on the motion.
        Verdict = "verdict",
    }
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
}

/// The outputs of a run that must be right, and the error allowed.
#[derive(Clone, PartialEq, Debug)]
pub struct Accuracy {
    /// The outputs that count; `None`: those that the verdict makes worth comparing.
    pub outputs: Option<Vec<Output>>,
    /// The relative error allowed.
    pub within: f64,
}

/// A list of some of these outputs.
pub(crate) struct OfOutputs(pub &'static [Output]);

impl OfOutputs {
    fn names(&self) -> Vec<&'static str> {
        self.0.iter().map(|output| output.name()).collect()
    }
}

impl Read for OfOutputs {
    type Value = Vec<Output>;

    fn takes(&self) -> Takes {
        Takes::Names(self.names())
    }

    fn otherwise(&self) -> Otherwise<ParameterValue> {
        Otherwise::Said("by the verdict")
    }

    fn read(&self, s: &Section, key: &str) -> Result<Vec<Output>, SceneError> {
        let list = s.get(key).and_then(Item::as_array).filter(|list| !list.is_empty());
        let list = list.ok_or_else(|| s.error(key, format!("write a list of {}", quoted(&self.names()))))?;
        let mut outputs = Vec::new();
        for (index, value) in list.iter().enumerate() {
            let key = format!("{key}[{index}]");
            let found = self.0.iter().find(|output| value.as_str() == Some(output.name()));
            let output = found.ok_or_else(|| s.error(&key, none_of(&Item::Value(value.clone()), &self.names())))?;
            if outputs.contains(output) {
                return Err(s.error(&key, format!("`{}` stands there already", output.name())));
            }
            outputs.push(*output);
        }
        Ok(outputs)
    }
}
