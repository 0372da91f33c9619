//! Scenes that leave some physics out: the drivers agree on them, and their energy balances.

use hpu_cosim::scene::{Experiment, Scene, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Wired};

fn parsed(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&overrides).map(Experiment::axis).unwrap_or_else(|error| panic!("{error}")).unwrap()
}

const MOVING: [(&str, &str); 2] = [("device.initial_angle", "1.45 rad"), ("device.initial_speed", "60 rad/s")];
const RESISTIVE: [(&str, &str); 2] = [("model.bridge", "averaged"), ("model.winding", "resistive")];
const SMOOTHED: [(&str, &str); 3] =
    [("device.coulomb_friction", "8 mN.m"), ("model.friction", "smoothed"), ("model.friction_speed", "2 rad/s")];

#[test]
fn drivers_agree_without_inductance_and_with_smoothed_friction() {
    for name in ["hybrid-wall", "conventional-wall-10khz"] {
        for less in [
            &RESISTIVE[..],
            &SMOOTHED,
            &[RESISTIVE.as_slice(), &SMOOTHED].concat(),
            &[&RESISTIVE[..], &[("device.coulomb_friction", "8 mN.m")]].concat(),
            &[("device.coulomb_friction", "8 mN.m"), ("model.friction", "none")],
        ] {
            let scene = parsed(name, &[&MOVING[..], less].concat());
            let comparison = AxisSimulation::new(&scene).unwrap().compare(2_000_000);
            assert_eq!(comparison.mismatches, 0, "{name} {less:?}: {:?}", comparison.first);
        }
    }
}

#[test]
fn energy_balances_without_inductance_and_with_smoothed_friction() {
    for less in [&RESISTIVE[..], &SMOOTHED, &[RESISTIVE.as_slice(), &SMOOTHED].concat()] {
        let scene = parsed("hybrid-wall", less);
        let simulation = AxisSimulation::new(&scene).unwrap();
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        let energy = summary.energy;
        assert!(energy.residual_j.abs() <= 1e-11 * energy.exchanged_j, "{less:?}: {energy:?}");
        assert!(energy.copper_j > 0.0);
    }
}

#[test]
fn a_scene_without_friction_dissipates_nothing_in_it() {
    let scene = parsed("hybrid-wall", &[("device.coulomb_friction", "8 mN.m"), ("model.friction", "none")]);
    let simulation = AxisSimulation::new(&scene).unwrap();
    let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
    assert_eq!((summary.energy.coulomb_j, summary.energy.viscous_j > 0.0), (0.0, true));
}

#[test]
fn the_scene_says_which_driver_runs_it() {
    for (solver, driver) in [("events", Driver::Events), ("clock", Driver::Clock)] {
        let scene = parsed("hybrid-wall", &[("model.solver", solver)]);
        assert_eq!(AxisSimulation::new(&scene).unwrap().driver(), driver);
    }
}
