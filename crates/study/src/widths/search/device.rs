//! The loops of a scene's device, asked through its designs and knobs.

use hpu_cosim::scene::Experiment;

use super::knob::{Design, Knob};
use super::loops::Loops;
use crate::Error;

/// The reason why a study of widths does not take a design of the user's own.
pub(crate) const OF_YOURS: &str = "the words of a design of yours are its own";

/// A `Device` has the loops whose widths are searched. Implemented by the scene of each kind of device.
pub trait Device {
    /// Returns the loops that a search of widths varies, or why there are none.
    fn loops(&self) -> Result<&'static dyn Loops, Error> {
        Err(OF_YOURS.into())
    }
}
impl Knob {
    /// Returns the knobs of a scene when none is named; none for a scene that no search takes.
    pub fn usual(scene: &Experiment) -> Vec<Self> {
        scene.loops().map_or(Vec::new(), |loops| loops.usual(scene))
    }
}

impl Design {
    /// Returns the widths of a scene.
    ///
    /// # Errors
    ///
    /// When no search takes its device.
    pub fn of(scene: &Experiment) -> Result<Self, Error> {
        Ok(Self::new(scene.loops()?.keys(), scene))
    }

    /// Returns the scene with this loop.
    ///
    /// # Errors
    ///
    /// Why no scene can have it: a width beyond the range of scenes, or words that do not hold the scene's values.
    pub fn scene(&self, base: &Experiment) -> Result<Experiment, Error> {
        base.loops()?.scene(self, base)
    }
}
