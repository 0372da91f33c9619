//! The devices that studies know. A new device is a module with its [`Device`], and a line in each list here.

use hpu_cosim::scene::{DutScene, Experiment, Scene};

use crate::device::Device;
use crate::widths::search::Loops;
use crate::{axis, phantom};

/// A design of the user's own has no words that a study could know.
impl Device for DutScene {
    fn limited(&self) -> Result<&Scene, String> {
        Err(format!("{} has a design of yours", self.name))
    }
}

/// Returns the device of a scene.
pub fn device(scene: &Experiment) -> &dyn Device {
    match scene {
        Experiment::Axis(scene) => scene,
        Experiment::Phantom(scene) => scene,
        Experiment::Gimbal(scene) => scene,
        Experiment::Dut(scene) => scene,
    }
}

/// The loops of all devices that a search of widths takes.
pub(crate) const LOOPS: [&dyn Loops; 2] = [&axis::Loop, &phantom::Loop];
