//! Networks in a loop: the drivers agree, the energies add up, and a compliant knob is what it is said to be.

use hpu_cosim::scene::{Experiment, Scene};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

/// A knob on a cable, driven by a current; its wall is that of the handle.
const KNOB: &str = r#"about = "A network."
clock = { frequency = "1024 kHz" }
run = { duration = "100 ms" }
device.kind = "network"
device.units_at = "handle"
device.bodies.rotor = { inertia = "50 g.cm2", coulomb_friction = "3 mN.m" }
device.bodies.handle = { mass = "30 g" }
device.joints.cable.from = "rotor"
device.joints.cable.to = "handle"
device.joints.cable.ratio = 10
device.joints.cable.radius = "60 mm"
device.joints.cable.stiffness = "20 kN/m"
device.joints.cable.damping_ratio = 0.02
device.drive.kind = "current"
device.drive.on = "rotor"
device.drive.torque_constant = "23 mN.m/A"
device.drive.bandwidth = "2 kHz"
device.drive.resistance = "1.1 Ohm"
device.drive.inductance = "0.2 mH"
device.drive.supply = "48 V"
device.drive.dac = { bits = 12, full_scale = "10 A" }
encoder = { on = "rotor", lines = 2000 }
method.kind = "conventional"
method.sample_rate = "4 kHz"
method.position_bits = 16
method.stiffness_format = "(0,10,8)"
method.damping_format = "(0,12,4)"
wall = { position = "6 mm", stiffness = "20 kN/m", damping = "13.9 N.s/m" }
hand.kind = "spring_damper"
hand.on = "handle"
hand.stiffness = "1388.9 N/m"
hand.damping = "27.78 N.s/m"
hand.path = [["0 s", 0], ["25 ms", "12 mm"]]
"#;

/// A wheel between end stops on a bridge, pressed into a wall.
const WHEEL: &str = r#"about = "A network."
clock = { frequency = "1 MHz" }
run = { duration = "100 ms" }
device.kind = "network"
device.bodies.wheel.inertia = "700 g.cm2"
device.bodies.wheel.viscous_friction = "10 uN.m.s/rad"
device.bodies.wheel.return_spring = "20 mN.m/rad"
device.bodies.wheel.stops = { low = "-30 deg", high = "30 deg", stiffness = "40 N.m/rad", damping = "20 mN.m.s/rad" }
device.bodies.wheel.initial_speed = "30 rad/s"
device.drive.kind = "bridge"
device.drive.on = "wheel"
device.drive.torque_constant = "25.9 mN.m/A"
device.drive.resistance = "2.35 Ohm"
device.drive.inductance = "0.226 mH"
encoder = { on = "wheel", lines = 1024 }
method = { kind = "hybrid", sample_rate = "1 kHz", damping_format = "(0,8,4)" }
wall = { position = "20 deg", stiffness = "50 mN.m/rad" }
hand = { kind = "constant_torque", on = "wheel", torque = "30 mN.m" }
"#;

fn scene(text: &str) -> Scene {
    let none = &mut |_: &str| Err(std::io::Error::other("no file"));
    Scene::parse("scene.toml", text, &[], none).unwrap_or_else(|error| panic!("{error}"))
}

fn simulation(experiment: &Experiment) -> WiredSimulation<'_> {
    WiredSimulation::new(experiment).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn leaping_and_stepping_agree_at_every_edge_of_networks() {
    let mass = "hand.mass = \"554 g\"\nhand.own_stiffness = \"135 N/m\"\nhand.own_damping = \"6.45 N.s/m\"\n";
    let hand = format!("{KNOB}{mass}");
    let pi = KNOB.replace("device.drive.kind = \"current\"", "device.drive.kind = \"pi\"");
    let cable = "device.joints.cable.stiffness = \"20 kN/m\"\ndevice.joints.cable.damping_ratio = 0.02\n";
    assert!(KNOB.contains(cable));
    let rigid = KNOB.replace(cable, "");
    for (name, text) in [("knob", KNOB), ("wheel", WHEEL), ("hand", &hand), ("pi", &pi), ("rigid", &rigid)] {
        let experiment = Experiment::Axis(scene(text));
        let simulation = simulation(&experiment);
        let comparison = simulation.compare(20_000);
        assert_eq!(comparison.mismatches, 0, "{name}: {:?}", comparison.first);
    }
}

/// What was exchanged adds up to rounding, although the mode changes often.
#[test]
fn the_energies_of_networks_add_up() {
    for (name, text, changes) in [("knob", KNOB, 4), ("wheel", WHEEL, 3)] {
        let experiment = Experiment::Axis(scene(text));
        let simulation = simulation(&experiment);
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        let energy = &summary.energy;
        assert!(summary.mode_changes >= changes, "{name}: {}", summary.mode_changes);
        assert!(summary.encoder_edges > 100, "{name}: {}", summary.encoder_edges);
        let residual = energy.residual_j.abs() / energy.exchanged_j;
        assert!(residual <= 1e-12, "{name}: {residual:e}: {energy:?}");
    }
}
