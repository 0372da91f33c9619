//! Runs that refute a proof: a motion in contact that goes on for ever.

use std::time::Duration;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, Scene};

use super::MOST_EVENTS;
use crate::map::{Cell, CellLimits, ForEver};

/// How long a run looks on after its end for its state to come back.
const LOOKS_ON: Duration = Duration::from_secs(10);

/// Runs a scene. If the device is beyond its wall throughout the judged window, swings there by one count rms at least,
/// and its state comes back to the last bit, it swings so for ever. Returns the rms in counts then.
pub fn swings(scene: &Scene, control: &Control) -> Option<f64> {
    let limits = CellLimits { events: MOST_EVENTS, guard: Duration::MAX, for_ever: Some(LOOKS_ON) };
    let cell = Cell::run(&Experiment::Axis(scene.clone()), limits, control).ok()??;
    let rms_counts = cell.rms? / scene.encoder.count_rad();
    let is_so = cell.for_ever == Some(ForEver::Repeats) && cell.device_contact_share == Some(1.0) && rms_counts >= 1.0;
    is_so.then_some(rms_counts)
}
