//! The models of a gimbal that leave something out: for races of accuracy against speed, and for fits.

use hpu_cosim::scene::{GimbalScene, Setup};

use crate::accuracy::{Contestant, SOLVERS, Variant, rungs};
use crate::fit::Simplifications;

/// The keys that leave out the friction of all servos.
const FRICTIONLESS: [(&str, &str); 2] = [("tilt_servo.coulomb", "0"), ("crank_servo.coulomb", "0")];

/// Returns the neighbouring scenes: the segment 5 % lighter and heavier; of a touch also its spring and its pad softer
/// and stiffer by as much.
pub(super) fn around(scene: &GimbalScene) -> Vec<(&'static str, f64)> {
    let mut all = vec![("device.mass", scene.gimbal.mass_kg)];
    if let Some(probe) = &scene.probe {
        all.extend([
            ("surface.stiffness", scene.stiffness_n_per_m),
            ("finger.stiffness", probe.finger.stiffness_n_per_m),
        ]);
    }
    let both = |(key, value)| [0.95, 1.05].map(|share| (key, share * value));
    all.into_iter().flat_map(both).collect()
}

/// Returns whether a servo has Coulomb friction.
fn has_friction(scene: &GimbalScene) -> bool {
    [scene.tilt_servo, scene.crank_servo].iter().any(|servo| servo.coulomb_nm > 0.0)
}

/// Returns the time between the instants of sensors and samples, which end steps.
fn sample_s(scene: &GimbalScene) -> f64 {
    scene.period_clocks() as f64 * scene.clock.period_s()
}

pub(super) fn contestants(scene: &GimbalScene) -> Vec<Contestant> {
    let mut all = Vec::new();
    let mut variants = vec![Variant::new("", &[])];
    if has_friction(scene) {
        all.push(Contestant::new("frictionless", &FRICTIONLESS));
        variants.push(Variant::new("+frictionless", &FRICTIONLESS));
    }
    let ladder = rungs(1e-5, sample_s(scene));
    for (variant, solver) in variants.iter().flat_map(|variant| SOLVERS.map(|solver| (variant, solver))) {
        all.extend(ladder.iter().map(|step_s| Contestant::solver(solver, Some(*step_s), variant)));
    }
    all
}

pub(super) fn simplifications(scene: &GimbalScene) -> Simplifications {
    let mut list = Simplifications::default();
    if has_friction(scene) {
        list.add("the servos' Coulomb friction", 3, &FRICTIONLESS, &[]);
    }
    if scene.solver().is_exact() {
        let what = |step: &str| format!("what happens within steps of {step} (Runge-Kutta)");
        let steps_s = 4.0 * scene.clock.period_s()..=sample_s(scene);
        list.ladder(&steps_s, what, &[("model.solver", "rk4")], &[], &mut Vec::new());
    }
    list
}
