//! The PHANToM's worlds: leaping and stepping agree to the bit on every platform, energy is accounted for, and a device
//! that leaves the modelled range ends the run.

use crate::common::{phantom, run};
use hpu_cosim::scene::{PhantomScene, Platform};
use hpu_cosim::{
    ClosedLoop, Control, Driver, LoopVisitor, PhantomSimulation, Simulation, Summary, Verdict, Wired, World,
};
use hpu_datapath::Wiring;

/// Edges over which each platform is compared: 6 ms.
const EDGES: u64 = 300_000;

/// The parts of the drive that are modelled.
const DRIVES: [&[(&str, &str)]; 3] = [
    &[("model.amplifier_lag", "0"), ("model.transmission_stiffness", "0")],
    &[("model.amplifier_lag", "0.4 ms"), ("model.transmission_stiffness", "0")],
    &[("model.amplifier_lag", "0.4 ms"), ("model.transmission_stiffness", "3.5 kN/m")],
];

fn summary(scene: &PhantomScene, driver: Driver) -> Summary {
    let simulation = PhantomSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    simulation.run(driver, &mut simulation.trace(&[]), &mut (), &Control::default())
}

/// Compares the drivers, after checking that the run has contact, counts and energy to compare.
#[track_caller]
fn agree(scene: &PhantomScene, said: &str) {
    let simulation = PhantomSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let whole = summary(scene, Driver::Events);
    assert_eq!((whole.edges, whole.aborted), (EDGES, None), "{said}");
    assert!(whole.encoder_edges > 60, "{said}: {} encoder edges", whole.encoder_edges);
    // There is no force without contact, and no command without force.
    assert!(whole.output_changes > 0, "{said}: no contact");
    let energy = whole.energy;
    assert!(energy.exchanged_j > 1e-4, "{said}: {energy:?}");
    assert!(energy.residual_j.abs() <= 1e-9 * energy.exchanged_j, "{said}: {energy:?}");
    let comparison = simulation.compare(EDGES);
    assert_eq!((comparison.edges, comparison.mismatches), (EDGES, 0), "{said}: {:?}", comparison.first);
}

fn every_drive(platform: Platform, architecture: &str) {
    for (drive, axis) in DRIVES.into_iter().zip(["x", "y", "z"]) {
        let thrown = [
            ("drop.axis", axis),
            ("drop.speed", "1 m/s"),
            ("platform.kind", platform.name()),
            ("method.architecture", architecture),
            ("room.distance", "0.5 mm"),
            ("run.duration", "6 ms"),
        ];
        let scene = phantom("phantom-thrown", &[&thrown, drive].concat());
        agree(&scene, &format!("{} {architecture} {drive:?}", platform.name()));
    }
}

#[test]
fn leaping_and_stepping_agree_on_every_host() {
    for platform in Platform::ALL.into_iter().filter(|platform| platform.is_host()) {
        every_drive(platform, "parallel");
    }
}

#[test]
fn a_host_does_not_ask_what_the_datapath_would_be() {
    for platform in Platform::ALL.into_iter().filter(|platform| platform.is_host()) {
        let of = |architecture| {
            let thrown = [
                ("platform.kind", platform.name()),
                ("method.architecture", architecture),
                ("room.distance", "0.5 mm"),
                ("run.duration", "6 ms"),
            ];
            run(&phantom("phantom-thrown", &thrown)).1.changes
        };
        assert_eq!(of("parallel"), of("shared"), "{}", platform.name());
    }
}

#[test]
fn leaping_and_stepping_agree_on_every_parallel_datapath() {
    for platform in Platform::ALL.into_iter().filter(|platform| !platform.is_host()) {
        every_drive(platform, "parallel");
    }
}

#[test]
fn leaping_and_stepping_agree_on_every_shared_datapath() {
    for platform in Platform::ALL.into_iter().filter(|platform| !platform.is_host()) {
        every_drive(platform, "shared");
    }
}

#[test]
fn they_agree_on_a_premium_1_5_and_on_other_words() {
    for more in [
        [("device.model", "premium_1.5"), ("method.words", "narrow"), ("room.stiffness", "5 kN/m")],
        [("model.law", "ideal"), ("model.friction", "false"), ("model.joints", "tested")],
        [("method.words", "plain_q22"), ("room.stiffness", "500 N/m"), ("model.joints", "tested")],
    ] {
        let thrown = [("drop.speed", "1 m/s"), ("room.distance", "0.5 mm"), ("run.duration", "6 ms")];
        let said = format!("{more:?}");
        agree(&phantom("phantom-thrown", &[&thrown[..], &more].concat()), &said);
    }
}

/// Scenes that end early, and the reason.
const ENDS: [(&str, &[(&str, &str)]); 4] = [
    (
        "a joint left the tables of sines: the datapath says invalid, torques are zero",
        &[("method.depth_bits", "11"), ("drop.speed", "2 m/s")],
    ),
    ("the arm is nearly singular", &[("method.depth_bits", "15"), ("drop.speed", "4 m/s"), ("model.joints", "tested")]),
    (
        "a joint left its limits",
        &[
            ("method.depth_bits", "15"),
            ("drop.speed", "4 m/s"),
            ("model.joints", "tested"),
            ("device.model", "premium_1.5"),
        ],
    ),
    ("the tip reached the opposite wall", &[("drop.speed", "0"), ("drop.weight", "2 N"), ("room.stiffness", "100")]),
];

fn ending(index: usize) -> PhantomScene {
    let soft = [
        ("room.walls", "y"),
        ("room.distance", "1 mm"),
        ("room.stiffness", "5"),
        ("run.duration", "10 s"),
        ("platform.kind", "FPGA-20"),
        ("clock.frequency", "2 MHz"),
        ("model.transmission_stiffness", "0"),
    ];
    let mut overrides = [&soft, ENDS[index].1].concat();
    if index == 3 {
        // With two samples of delay every bounce returns more energy than it took in; only friction could dissipate it.
        overrides.extend([
            ("platform.kind", "RTOS-1"),
            ("model.delay", "4"),
            ("device.coulomb_force", "0"),
            ("device.viscous_damping", "0"),
        ]);
    }
    phantom("phantom-thrown", &overrides)
}

#[test]
fn a_device_that_leaves_what_is_modelled_ends_the_run_with_the_reason() {
    for (index, (why, _)) in ENDS.iter().enumerate() {
        let scene = ending(index);
        let ended = summary(&scene, Driver::Events);
        let abort = ended.aborted.unwrap_or_else(|| panic!("{why}: {:?}", ended.verdict));
        assert_eq!((abort.why, abort.at_s), (*why, scene.clock.seconds(hpu_signal::Cycle(ended.edges))));
        assert_eq!(ended.verdict, Some(Verdict::HighlyUnstable { at_s: abort.at_s }), "{why}");
        assert!(ended.complete && ended.edges < scene.edges(), "{why}");
        // The run ends on the same edge with every driver, and is compared up to that edge.
        let stepped = summary(&scene, Driver::Clock);
        assert_eq!(
            (stepped.edges, stepped.aborted, stepped.energy),
            (ended.edges, ended.aborted, ended.energy),
            "{why}"
        );
        let comparison = PhantomSimulation::new(&scene).expect("valid").compare(scene.edges());
        assert_eq!((comparison.edges, comparison.mismatches), (ended.edges, 0), "{why}: {:?}", comparison.first);
    }
}

#[test]
fn it_ends_on_the_count_that_says_so() {
    let logged_y = |index: usize| {
        let mut scene = ending(index);
        // One row per edge, so that the last row is that of the end.
        scene.record.plant_rate_hz = 2e6;
        let simulation = PhantomSimulation::new(&scene).expect("valid");
        let mut last = Last::default();
        simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut last, &Control::default());
        last.0
    };
    // Only joint 2 has turned: y = l sin of the first count beyond the tables. 11 bits hold -1024; a count is 2 pi /
    // 28000 rad. The other joints of that scene have hardly moved, so the tip is within a count of that height.
    let count_rad = std::f64::consts::TAU / 28_000.0;
    let tables = logged_y(0);
    assert!((tables - 0.14 * (-1025.0 * count_rad).sin()).abs() < 0.14 * count_rad * 20.0, "{tables}");
    // The Jacobian's determinant divided by l^3 is (cos q2 + sin q3) cos(q2 - q3); with q3 below a count it is cos q2
    // squared. It falls below 1 % at 84.26 degrees.
    let singular = logged_y(1);
    let before = -(0.14 * (0.01f64.sqrt().acos() - 2.0 * count_rad).sin());
    let after = -(0.14 * (0.01f64.sqrt().acos() + 2.0 * count_rad).sin());
    assert!((after..=before).contains(&singular), "{singular}");
    // The limit is 55 degrees between the links of a Premium 1.5; a count is 2 pi * 5 / 229376 rad.
    let count_rad = std::f64::consts::TAU * 5.0 / 229_376.0;
    let limited = logged_y(2);
    let limit_rad = 55f64.to_radians();
    let before = -0.215 * limit_rad.sin();
    assert!((before - 0.215 * 2.0 * count_rad..=before).contains(&limited), "{limited} {before}");
    // The wall above the start.
    let opposite = logged_y(3);
    assert!((1e-3..1e-3 + 64e-6).contains(&opposite), "{opposite}");
}

/// The tip's height by the counts, in the last row shown.
#[derive(Default)]
struct Last(f64);

impl hpu_signal::Observe for Last {
    fn nets(&mut self, _: hpu_signal::Cycle, _: &[i64]) {}
    fn reals(&mut self, _: hpu_signal::Cycle, values: &[f64]) {
        self.0 = values[4];
    }
}

/// A visitor that drives the loop on after its run has ended, and returns the words.
struct OnAndOn;

/// The greatest command until the run was over, and the words of validity and commands 200 edges later.
struct Found {
    greatest: i64,
    valid: Vec<i64>,
    commands: Vec<i64>,
}

impl<'s> LoopVisitor<'s> for OnAndOn {
    type Out = Found;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Found
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let nets = wiring.nets();
        let mut run = ClosedLoop::new(wiring.clone(), world, input, u64::MAX);
        let words = |run: &ClosedLoop<W, E>, start: &str| -> Vec<i64> {
            let words = nets.iter().zip(run.wiring.words());
            words.filter(|(net, _)| net.name.starts_with(start)).map(|(_, word)| *word).collect()
        };
        let mut greatest = 0;
        while run.world.over().is_none() {
            run.step(&mut ());
            greatest = words(&run, "command").into_iter().map(i64::abs).fold(greatest, i64::max);
        }
        // Two samples, and all the latencies.
        for _ in 0..250 {
            run.step(&mut ());
        }
        Found { greatest, valid: words(&run, "valid"), commands: words(&run, "command") }
    }
}

#[test]
fn beyond_the_tables_the_datapath_says_invalid_and_commands_nothing() {
    for architecture in ["parallel", "shared"] {
        let mut scene = ending(0);
        scene.method.shared = architecture == "shared";
        if scene.method.shared {
            scene.method.config = scene.method.config.shared();
        }
        let found = PhantomSimulation::new(&scene).expect("valid").visit(OnAndOn);
        // 5 N/m times 3 cm, on a lever of 0.14 m, in counts of 36 uN.m.
        assert!(found.greatest > 500, "{architecture}: {}", found.greatest);
        assert_eq!(found.valid, [1, 0, 1], "{architecture}");
        assert_eq!(found.commands, [0, 0, 0], "{architecture}");
    }
}

#[test]
fn drivers_agree_on_an_arm_that_passes_a_singular_pose() {
    let shipped = hpu_cosim::scene::shipped();
    let scene = shipped.iter().find(|scene| scene.name == "phantom-thrown").expect("a shipped scene");
    let set = [("drop.speed", "90"), ("run.duration", "2 ms")].map(|(key, value)| (key.to_string(), value.to_string()));
    let experiment = scene.parse(&set).unwrap_or_else(|error| panic!("{error}"));
    let simulation = hpu_cosim::WiredSimulation::new(&experiment).expect("a simulation");
    let found = simulation.compare(simulation.edges());
    assert!(found.edges < simulation.edges(), "the run ends in the pose");
    assert_eq!((found.mismatches, found.first), (0, None));
}
