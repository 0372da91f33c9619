//! Programs in C.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use hpu_cosim::{Wired, WiredSimulation};

use crate::common::{LOGIC, PLANT, compiled, folder, said, set, shipped};

/// Steps a scene's wiring and world edge by edge, without a promise of how outputs repeat. Returns the states at the
/// end, then energies supplied, stored and dissipated.
fn stepped(simulation: &WiredSimulation, edges: u64) -> Vec<f64> {
    let start = simulation.closed_loop();
    let (mut wiring, mut world, mut input) = (start.wiring_copy(), start.world().copy(), start.constants());
    let outputs = input.len()..input.len() + wiring.outputs().len();
    wiring.reset();
    world.drive(&vec![0; outputs.len()], &[]);
    for _ in 0..edges {
        world.sense();
        world.place(&mut input);
        wiring.step(&input);
        world.drive(&wiring.words()[outputs.clone()], wiring.words());
    }
    let (energy, mut end) = (world.summary().energy, Vec::new());
    world.exact(edges, &mut end);
    end.extend([energy.supplied_j, energy.stored_j, energy.dissipated_j]);
    end
}

/// The hand meets the wall at 160 ms.
#[test]
fn the_hybrid_wall_in_c_moves_as_the_blocks_do_to_the_bit() {
    let motor = compiled("examples/motor.c", &[], "motor", "motor");
    let duration = "run.duration=200 ms";
    let said = said(Command::new(motor).args(["hybrid-wall", duration]));
    let values: BTreeMap<_, f64> = said
        .lines()
        .filter_map(|line| line.split_once(' '))
        .map(|(name, value)| (name, value.parse().expect("a number")))
        .collect();

    let scene = shipped("hybrid-wall").parse(&set(&[duration])).expect("a scene");
    let simulation = WiredSimulation::new(&scene).expect("a simulation");
    assert_eq!(values["edge"], 10e6);
    let end = stepped(&simulation, 10_000_000);
    let names = ["current_a", "speed_rad_per_s", "angle_rad", "torque_nm", "supplied_j", "stored_j", "dissipated_j"];
    assert_eq!(end.len(), names.len());
    for (name, value) in names.into_iter().zip(end) {
        assert_eq!(values[name].to_bits(), value.to_bits(), "{name}: {} in C, {value} by the blocks", values[name]);
    }
    assert!(values["angle_rad"] > 1.5, "the wall is touched: {said}");
    println!("{said}");
}

#[test]
fn bad_calls_are_refused_with_what_is_accepted() {
    said(&mut Command::new(compiled("tests/c/refused.c", &["-pthread"], "refused", "refused")));
}

/// A logic in C drives the plant of a scene with a method and the same plant alone; the program compares both.
#[test]
fn a_plant_alone_in_c_moves_as_that_of_a_scene_with_a_method() {
    let program = compiled("tests/c/alone.c", &[], "alone", "alone");
    let scene = |name: &str, text: &str| {
        let path = folder("alone").join(name);
        fs::write(&path, text).expect("a file");
        path
    };
    let (alone, method) = (scene("alone.toml", PLANT), scene("method.toml", &[PLANT, LOGIC].concat()));
    assert_eq!(said(Command::new(program).args([alone, method])), "same after 1000000 edges\n");
}
