//! The energy audit of every shipped scene with a device, over its whole length.

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

#[test]
fn supply_less_store_less_losses_is_a_billionth_of_the_energy_exchanged() {
    for shipped in shipped() {
        let scene = shipped.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
        let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        assert!(summary.complete, "{}", shipped.name);
        let energy = summary.energy;
        if matches!(scene, Experiment::Transfer(_)) {
            assert_eq!(energy.exchanged_j, 0.0, "{}: energy is not defined of a transfer function", shipped.name);
            continue;
        }
        if !simulation.has_device() {
            assert_eq!(energy.exchanged_j, 0.0, "{}: a recording has no device", shipped.name);
            continue;
        }
        assert!(energy.exchanged_j > 0.0, "{}", shipped.name);
        assert!(energy.residual_j.abs() <= 1e-9 * energy.exchanged_j, "{}: {energy:?}", shipped.name);
        // Each sum is the sum of its parts, and nothing that only dissipates supplies energy.
        assert_eq!(energy.supplied_j, energy.source_j + energy.hand_j, "{}", shipped.name);
        for loss_j in [energy.copper_j, energy.diodes_j, energy.viscous_j, energy.coulomb_j, energy.transmission_j] {
            assert!(loss_j >= 0.0, "{}: {energy:?}", shipped.name);
        }
    }
}

/// Returns the residual of a law in floats without a clock, as a share of the energy exchanged.
fn residual(name: &str, more: &[(&str, &str)]) -> f64 {
    let set = [&[("model.datapath", "law"), ("model.bridge", "averaged")], more].concat();
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect(name);
    let scene = scene.parse(&set).unwrap_or_else(|error| panic!("{error}"));
    let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    assert!(simulation.direct().is_some(), "{name} {more:?}: no clock");
    let summary = simulation.run(simulation.driver(), &mut simulation.trace(&[]), &mut (), &Control::default());
    assert!(summary.complete && summary.output_changes > 1000, "{name} {more:?}");
    summary.energy.residual_j / summary.energy.exchanged_j
}

#[test]
fn without_a_clock_no_change_of_the_drive_leaves_energy_out_of_the_audit() {
    // The residual of steps is the error of the trapezoid rule, a quarter for half the step; energy left out at changes
    // of the drive would stay.
    for name in ["hybrid-wall", "conventional-wall-10khz"] {
        for winding in ["inductive", "resistive"] {
            let winding = ("model.winding", winding);
            let exact = residual(name, &[winding, ("model.solver", "sample")]);
            assert!(exact.abs() < 1e-15, "{name} {winding:?}: {exact:e}");
            for method in ["midpoint", "rk4"] {
                let at = |step| residual(name, &[winding, ("model.solver", method), ("model.step", step)]);
                let ratio = at("10 us") / at("5 us");
                assert!((ratio - 4.0).abs() < 0.6, "{name} {winding:?} {method}: {ratio}");
            }
        }
    }
}
