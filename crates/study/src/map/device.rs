//! The questions of a map to a device.

use crate::Error;
use hpu_cosim::Simulation;
use hpu_farm::form;
use hpu_signal::Observe;
use serde::{Deserialize, Serialize};

/// The switches of a control, as a map's cell has them.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Switching {
    /// Their number in the whole run.
    #[serde(rename = "switches")]
    pub count: u64,
    /// The greatest leap of the drive at a switch, as a force in N at a tip that rests.
    #[serde(with = "form::number")]
    pub bump_n: f64,
    /// Energy that the drive gave per switch in the judged window, in J; `None` without a switch there.
    #[serde(with = "form::figure", default, skip_serializing_if = "Option::is_none")]
    pub switch_j: Option<f64>,
}

/// A `SwitchWatch` observes a run and counts the switches of its control. Implemented by the watch of each device whose
/// control switches; [`Device::switches`] returns it.
pub trait SwitchWatch: Observe {
    /// Returns the switches so far.
    fn switching(&self) -> Switching;
}

/// A `Device` says what a map tells of a cell beyond its motion. Implemented by the scene of each kind of device.
pub trait Device {
    /// Returns whether criteria speak of a touch of the device, whatever the values of its keys; if not,
    /// [`predictions`](Self::predictions) has none.
    fn predicts(&self) -> bool {
        false
    }

    /// Returns of each criterion its name and whether it predicts, without a run, that a touch fails.
    fn predictions(&self) -> Result<Vec<(&'static str, bool)>, Error> {
        Err("no criterion speaks of a touch of this device".into())
    }

    /// Returns what watches the switches of the control in a run of this simulation of the scene.
    fn switches(&self, _simulation: &dyn Simulation) -> Option<Box<dyn SwitchWatch>> {
        None
    }
}
