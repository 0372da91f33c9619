//! The loops of the segment on a gimbal closed around the VHDL in GHDL.

use std::path::Path;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Driver, GimbalSimulation, SceneFile, Simulation, Wired};
use hpu_rtl::{LoopScene, closed_loop};

const EDGES: u64 = 60_000;

/// Closes the loop of a scene with a slow clock, so that 60 000 edges hold 120 samples, around its VHDL. Asserts that
/// the drive of the roll moves, because otherwise the equality proves nothing. Returns the extremes of `shear_x`.
fn equal(name: &str, more: &[(&str, &str)]) -> Option<[i64; 2]> {
    let slow = [
        ("clock.frequency", "1 MHz"),
        ("method.sample_rate", "2 kHz"),
        ("target", "{ kind = 'path', path = [[0, '12 mm', 0, 0], ['60 ms', '13 mm', 0.1, 0.2]] }"),
        ("run.duration", "60 ms"),
        ("expect", "{}"),
    ];
    let overrides: Vec<_> = slow.iter().chain(more).map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let Experiment::Gimbal(scene) = shipped.parse(&overrides).unwrap_or_else(|error| panic!("{error}")) else {
        panic!("{name} is no gimbal")
    };
    let simulation = GimbalSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let run = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
    assert_eq!((run.edges, run.aborted), (EDGES, None));
    let net = |name: &str| run.nets.iter().find(|net| net.signal.name == name).map(|net| net.usage);
    let drive = net("drive2").expect("a net");
    assert!(drive.max - drive.min > 20, "{name}: {drive:?}");
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let (name, text, data) = (format!("{name}.toml"), shipped.text.to_string(), project.join("testbench/scenes"));
    let options = LoopScene { source: SceneFile { name, text, data, is_shipped: false }, overrides, edges: EDGES };
    let row = closed_loop(&options, &project.join("hdl").into()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((row.vectors, row.mismatches), (EDGES, 0), "{:?}", row.first);
    println!("{} {} edges in {:.2} s", row.variant, row.edges, row.seconds);
    net("shear_x").map(|net| [net.min, net.max])
}

#[test]
fn the_shear_loop_in_vhdl_equals_the_emulator_at_every_edge() {
    for (order, memory, viscosity) in [("0.5", "254", "2 kPa.s"), ("1.5", "20", "20 Pa.s")] {
        let set = [("shear.order", order), ("shear.memory", memory), ("shear.viscosity", viscosity)];
        let [least, most] = equal("gimbal-shear", &set).expect("the net of the shear");
        assert!(most - least > 100, "order {order}: {least} to {most}");
    }
}

#[test]
fn the_loop_without_shear_in_vhdl_equals_the_emulator_at_every_edge() {
    assert_eq!(equal("gimbal-shape", &[]), None);
}
