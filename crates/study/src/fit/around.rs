//! The neighbouring scenes that a model is also judged in.

use hpu_cosim::scene::Experiment;

type Set = Vec<(String, String)>;

/// Multiples of [`PHASE`] by which the wall is moved, nearer and farther. Fixed-point words hold the wall at a whole
/// count: these moves reach each of the counts nearby. A law in floats holds the wall between counts: there each move
/// gives another phase. The last multiple, farther away, is tried once, because a motion may be much longer or shorter
/// there.
const PHASES: [f64; 7] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0];
/// Unit of the moves, in encoder counts.
const PHASE: f64 = 0.94;

/// Returns the neighbouring scenes: the wall 5 % softer and stiffer, and a few counts nearer and farther.
pub(super) fn around(experiment: &Experiment) -> Vec<Set> {
    let one = |key: &str, value: f64| vec![(key.to_string(), format!("{value:?}"))];
    match experiment {
        Experiment::Axis(scene) => {
            let (k, position) = (scene.wall.stiffness_nm_per_rad, scene.wall.position_rad);
            let count = scene.encoder.count_rad();
            let stiffness = [0.95, 1.05].map(|share| one("wall.stiffness", share * k));
            let places = PHASES.into_iter().flat_map(|phase| [-phase, phase]);
            let places = places.map(|phase| one("wall.position", position + PHASE * phase * count));
            let stiffness = stiffness.into_iter().filter(|_| k > 0.0);
            stiffness.chain(places).collect()
        }
        Experiment::Phantom(scene) => {
            let (k, distance) = (scene.room.stiffness_n_per_m, scene.room.distance_m);
            let stiffness = [0.95, 1.05].map(|share| one("room.stiffness", share * k));
            let places = [-5.3, -1.6, 0.7, 3.7].map(|counts| one("room.distance", distance + counts * 29e-6));
            stiffness.into_iter().chain(places).collect()
        }
        Experiment::Dut(_) => Vec::new(),
    }
}
