//! The stiffnesses over which limits are sought, and their unit.

use hpu_cosim::scene::{Datapath, Scene};

/// Returns the default range of stiffnesses for limits: from one word to the greatest word of the scene's format.
/// Without words, from a thousandth to a thousand times the scene's own stiffness, or of 1 where that is 0.
pub fn usual_range(scene: &Scene) -> [f64; 2] {
    if scene.model.datapath != Datapath::Linear
        && let Ok(words) = scene.words()
    {
        let realised = words.realised;
        let format = scene.method.stiffness_format;
        let word = realised.torque_quantum_nm / realised.count_rad * format.lsb();
        return [word, format.max() as f64 * word];
    }
    let own = scene.wall.stiffness_nm_per_rad;
    let around = if own > 0.0 { own } else { 1.0 };
    [1e-3 * around, 1e3 * around]
}

/// Returns the unit of the scene's stiffness.
pub fn unit(scene: &Scene) -> &'static str {
    scene.device.units().stiffness
}
