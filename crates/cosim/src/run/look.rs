//! A closer look at a part of a run.

use std::ops::Range;

use hpu_signal::Observe;

use crate::run::engine::{Control, TURN};
use crate::run::simulation::Wired;

/// Runs a scene's loop again, to the same bits, up to the end of a window of edges, and shows the observer the rows
/// inside the window: one every `stride` edges, at multiples of it, with the means and extremes since the row before
/// that the observer reads. Nets are shown from the first event on. Returns whether `control` let the loop reach the
/// end.
///
/// The loop of a scene that runs without a clock ([`Wired::direct`]) is no other view of that run: it moves by events.
pub fn look(
    simulation: &impl Wired,
    window: Range<u64>,
    stride: u64,
    observer: &mut dyn Observe,
    control: &Control,
) -> bool {
    let stride = stride.max(1);
    let mut closed = simulation.closed_loop();
    if !simulation.gates_drive() {
        closed.wiring_mut().rest_modulator();
    }
    closed.show(window.start.next_multiple_of(stride), stride, observer);
    let (mut since, mut events) = (0, 0);
    while closed.edge() < window.end && closed.world().over().is_none() {
        closed.leap(window.end, observer);
        since += 1;
        if since == TURN {
            (since, events) = (0, events + u64::from(TURN));
            if !control.goes_on(closed.edge(), events) {
                return false;
            }
        }
    }
    true
}
