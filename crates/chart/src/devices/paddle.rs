//! The pictures of the loop of EPFL's haptic paddle.

use hpu_cosim::{PaddleSimulation, Summary, Trace};

use crate::motion::{Motion, wheel_ratio};
use crate::{Picture, motion_pictures, rate, thinned, verdict};

/// The nets that a trace must hold for [`paddle_pictures`], in this order.
pub const PADDLE_NETS: [&str; 6] = ["angle", "filtered", "aim", "sum", "current", "command"];

/// Returns the pictures of a run of the paddle's loop. Its trace holds the [`PADDLE_NETS`].
pub fn paddle_pictures(simulation: &PaddleSimulation, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
    let scene = simulation.scene();
    let (units, clock) = (scene.device.units(), rate(scene.clock.frequency_hz() as f64));
    motion_pictures(&Motion {
        title: format!("{}: {}", scene.name, verdict(summary, (units, 1.0))),
        conditions: format!("the paddle's two controllers at {clock}{}", thinned(trace)),
        command,
        told_in: (units, 1.0),
        body: Some(scene.network.wall_name()),
        wheel_ratio: wheel_ratio(&scene.device),
        hand: &scene.hand,
        duration_s: scene.run.duration_s,
        motion_s: summary.motion_s,
        clock: scene.clock,
        modulator: None,
        wall_rad: None,
        target: None,
        trace,
        faults: &summary.faults,
        contact: &[],
        counted: None,
        asked: None,
    })
    .into()
}
