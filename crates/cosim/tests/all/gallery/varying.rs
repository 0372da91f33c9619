//! Walls that change while a mass rings in them.

use hpu_cosim::Trace;
use hpu_cosim::scene::Scene;

use super::axis::{near, range, rows, run, scene, speeds};

/// Returns the energy of the oscillations of 100 g in a span of time: all of it is kinetic once per oscillation.
fn ringing_j(trace: &Trace, from_s: f64, to_s: f64) -> f64 {
    let (low, high) = range(&speeds(trace)[rows(trace, from_s, to_s)]);
    0.05 * (0.5 * (high - low)).powi(2)
}

/// Returns the energy of the oscillations in the tenth of a second after the ramp over that before it.
fn gain(scene: &Scene) -> f64 {
    let ramp = scene.wall.ramp.expect("a ramp");
    let (_, trace) = run(scene, &[]);
    // 1.1 kN/m and 100 g: a period is 60 ms.
    ringing_j(&trace, ramp.to_s, ramp.to_s + 0.1) / ringing_j(&trace, 0.0, ramp.from_s)
}

#[test]
fn a_wall_that_stiffens_pumps_a_ringing_mass_by_the_root_of_the_ratio() {
    // With the hand's 100 N/m. The ramp's corner matters by the share that the frequency changes in a radian, 10 %.
    near(gain(&scene("stiffening-wall", &[])), (40_100.0f64 / 1100.0).sqrt(), 0.1);
}

#[test]
fn so_does_a_scaled_spring_that_keeps_its_own_energy() {
    // In addition to the root, a hold of 4 us and the root's 33 clocks leak: omega^2 (T / 2 + t_d) a second, on the
    // mean of the ramp. At the corner the frequency changes by 1.5 % in a radian.
    let leak: f64 = 0.5 * (1100.0 + 4100.0) / 0.1 * (0.5 * 4e-6 + 33.0 * 20e-9);
    near(gain(&scene("scaled-wall", &[])), (4100.0f64 / 1100.0).sqrt() * leak.exp(), 0.05);
}

#[test]
fn a_wall_that_changes_while_the_mass_rests_gives_nothing() {
    for name in ["stiffening-wall", "scaled-wall"] {
        let scene = scene(name, &[("device.initial_position", "10.5 mm")]);
        let ramp = scene.wall.ramp.expect("a ramp");
        let (_, trace) = run(&scene, &[]);
        // Compared with the 22 uJ of oscillations of 0.2 mm.
        let after_j = ringing_j(&trace, ramp.to_s, scene.run.duration_s);
        assert!(after_j < 1e-3 * 22e-6, "{name}: {after_j} J");
    }
}
