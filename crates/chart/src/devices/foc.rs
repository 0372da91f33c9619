//! The pictures of a loop behind field-oriented control.

use hpu_cosim::{FocSimulation, Summary, Trace};

use crate::motion::{Motion, wheel_ratio};
use crate::{Picture, motion_pictures, rate, thinned, verdict};

/// The nets that a trace must hold for [`foc_pictures`], in this order.
pub const FOC_NETS: [&str; 4] = ["penetration", "target", "d", "q"];

/// Returns the pictures of a run of the loop. Its trace holds the [`FOC_NETS`].
pub fn foc_pictures(simulation: &FocSimulation, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture> {
    let (scene, words) = (simulation.scene(), simulation.words());
    let (units, clock) = (scene.device.units(), rate(scene.clock.frequency_hz() as f64));
    let has_wall = scene.wall.is_some();
    let penetration = if has_wall { trace.words(0) } else { &[] };
    motion_pictures(&Motion {
        title: format!("{}: {}", scene.name, verdict(summary, (units, 1.0))),
        conditions: format!(
            "sampled at {}, currents at {}, a clock of {clock}{}",
            rate(scene.method.sample_rate_hz),
            rate(0.5 * scene.clock.frequency_hz() as f64 / f64::from(words.config.foc.steps)),
            thinned(trace)
        ),
        command,
        told_in: (units, 1.0),
        body: None,
        wheel_ratio: wheel_ratio(&scene.device),
        hand: &scene.hand,
        duration_s: scene.run.duration_s,
        motion_s: summary.motion_s,
        clock: scene.clock,
        modulator: Some(2 * u64::from(words.config.foc.steps)),
        wall_rad: scene.wall.as_ref().map(|wall| wall.position_rad),
        target: None,
        trace,
        faults: &summary.faults,
        contact: penetration,
        counted: has_wall.then_some((penetration, 1e3 * words.count_rad)),
        asked: Some((trace.words(1), 1e3 * words.unit[1])),
    })
    .into()
}
