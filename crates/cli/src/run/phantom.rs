//! The lines about a PHANToM in the summary of a run.

use hpu_cosim::scene::{PhantomLaw, PhantomScene};
use hpu_cosim::{PhantomSession, Rig, Trace};
use hpu_signal::Notation;

use crate::units::si;

/// Returns the platform that computes the force, with its rate.
pub fn platform(scene: &PhantomScene) -> String {
    let (name, period) = (scene.platform.name(), scene.period_clocks());
    let rate = si(scene.clock.frequency_hz() as f64 / period as f64, "Hz");
    let how = if scene.model.law == PhantomLaw::Ideal {
        "the law in floats on the true position".to_string()
    } else if scene.model.law == PhantomLaw::Floats && !scene.platform.is_host() {
        "the law in floats on the counts".to_string()
    } else if scene.platform.is_host() {
        let (samples, latency_s) = (scene.model.delay_samples, scene.model.latency_s);
        let late = if latency_s > 0.0 { format!(" and {}", si(latency_s, "s")) } else { String::new() };
        let unit = if samples == 1.0 { "sample" } else { "samples" };
        format!("floating point, commands late by {samples} {unit}{late}")
    } else {
        let kind = if scene.method.shared { "one multiplier" } else { "all in parallel" };
        format!("the datapath, {kind}")
    };
    format!("{name}: every {period} clocks ({rate}), {how}")
}

/// Returns the final and the deepest position of the tip.
pub fn motion(scene: &PhantomScene, trace: &Trace) -> String {
    let axis = scene.drop.axis;
    format!(
        "tip ends at {} = {}, deepest {} beyond the wall",
        axis.name(),
        si(trace.last(axis.index()).unwrap_or(0.0), "m"),
        si((-scene.room.distance_m - trace.least(axis.index())).max(0.0), "m")
    )
}

/// Returns the stiffness and the walls that the words realise.
pub fn words(session: &PhantomSession, notation: Notation) -> [String; 3] {
    let (scene, words) = (session.scene(), session.words());
    let formats = &scene.method.config.formats;
    [
        format!(
            "stiffness {} of {} is {}, asked {}",
            words.stiffness,
            notation.of(formats.stiffness),
            si(formats.stiffness.to_f64(words.stiffness), "N/m"),
            si(scene.room.stiffness_n_per_m, "N/m")
        ),
        format!(
            "walls at {} of {}: {}, asked {}",
            words.high,
            notation.of(formats.position),
            si(formats.position.to_f64(words.high), "m"),
            si(scene.room.distance_m, "m")
        ),
        realised(session),
    ]
}

/// Returns the size of a count of each encoder and of each DAC, and the apparent mass.
fn realised(session: &PhantomSession) -> String {
    let counts = session.count_rad().map(|count_rad| si(count_rad, "rad")).join(", ");
    let torques: Vec<String> = session.commands().iter().map(|command| si(command.2, "N.m")).collect();
    let mass = session
        .apparent_kg()
        .map_or(String::new(), |mass_kg| format!("; apparent mass {} at the tip", si(1e3 * mass_kg, "g")));
    format!("joints 1, 2, 3: a count is {counts}; a DAC count is {}{mass}", torques.join(", "))
}
