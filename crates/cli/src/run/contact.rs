//! The contact with the wall, as the summary reports it beside the verdict.

use hpu_page::summary::Touch;

use crate::run::device::shown;
use crate::run::simulate::Ran;

/// Returns the contact of a run.
pub fn of<'r>(ran: &'r Ran) -> Touch<'r> {
    let device = shown(ran.simulation);
    Touch {
        summary: &ran.summary,
        trace: &ran.trace,
        window_s: ran.window_s,
        wall: device.wall().zip(device.units()),
        axis: device.axis(),
    }
}
