//! The loops of a scene's device, asked through its designs and knobs.

use std::str::FromStr;

use hpu_cosim::scene::Experiment;

use super::knob::{Design, Knob, SYNTAX};
use super::loops::Loops;
use super::refused::SearchError;
use crate::devices::{LOOPS, device};

/// Returns the loops of a scene's device.
pub(super) fn loops(scene: &Experiment) -> Result<&'static dyn Loops, SearchError> {
    device(scene).loops().map_err(SearchError::Scene)
}

impl Knob {
    /// Returns the knobs of a scene when none is named; none for a scene that no search takes.
    pub fn usual(scene: &Experiment) -> Vec<Self> {
        loops(scene).map_or(Vec::new(), |loops| loops.usual(scene))
    }
}

impl FromStr for Knob {
    type Err = String;

    /// Reads `KEY=FROM..TO`; both ends are values: `position_bits=8..16`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, range) = text.split_once('=').ok_or(SYNTAX)?;
        let name = name.trim();
        let bare = name.strip_prefix("method.").unwrap_or(name);
        let key = LOOPS.iter().flat_map(|loops| loops.keys().all).find(|key| key.name == bare).ok_or_else(|| {
            let [first, others @ ..] = LOOPS;
            let others =
                others.map(|loops| format!("; of {} one of {}", loops.keys().device, loops.keys().names())).concat();
            format!("{name} is no width that a search varies; write one of {}{others}", first.keys().names())
        })?;
        Self::read(*key, name, range)
    }
}

impl Design {
    /// Returns the widths of a scene.
    ///
    /// # Errors
    ///
    /// When no search takes its device.
    pub fn of(scene: &Experiment) -> Result<Self, SearchError> {
        Ok(Self::new(loops(scene)?.keys(), scene))
    }

    /// Returns the scene with this loop.
    ///
    /// # Errors
    ///
    /// Why no scene can have it: a width beyond the range of scenes, or words that do not hold the scene's values.
    pub fn scene(&self, base: &Experiment) -> Result<Experiment, String> {
        loops(base).map_err(|error| error.to_string())?.scene(self, base)
    }
}
