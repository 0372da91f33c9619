//! The loop of EPFL's haptic paddle: its firmware in float32 against currents that were computed with 40 digits
//! elsewhere, and its words against the firmware.

use hpu_cosim::scene::{Experiment, SceneFile};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

/// A locked rotor, whose target asks for 0.3 A from the first edge on: 0.02421 N·m/deg times 10 degrees over 15 and
/// 53.8 mN·m/A. The converter begins with the modulator, and has another bit, so that it does not clamp.
const LOCKED: [(&str, &str); 12] = [
    ("device.sensors.current.phase", "5.9523810 ns"),
    ("device.sensors.current.bits", "13"),
    ("device.sensors.current.range", "5.0012210 V"),
    ("device.bodies.paddle.coulomb_friction", "1000 N.m"),
    ("device.bodies.paddle.return_spring", "0"),
    ("device.bodies.paddle.initial_position", "0"),
    ("method.target_from", "0"),
    ("method.kp", "0.02421 N.m/deg"),
    ("method.kd", "0"),
    ("method.zero", "exact"),
    ("run.duration", "5.2 ms"),
    ("expect", "{}"),
];

fn scene(name: &str, sets: &[(&str, &str)]) -> Experiment {
    let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    SceneFile::find(name).unwrap().parse(&sets).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the command in steps after ticks 1 to 100 of the current controller, the currents at these ticks, and the
/// current 5100 us after the step. The modulator begins at edge 1, which is the instant of the step.
fn locked(more: &[(&str, &str)]) -> (Vec<i64>, Vec<f64>, f64) {
    let experiment = scene("epfl-paddle-step", &[&LOCKED, more].concat());
    let simulation = WiredSimulation::new(&experiment).unwrap();
    let mut closed = simulation.closed_loop();
    let nets = closed.wiring().nets();
    let command = nets.iter().position(|net| net.name == "command").unwrap();
    let (mut commands, mut currents) = (Vec::new(), Vec::new());
    let mut go = |edge: u64| {
        while closed.edge() < edge {
            closed.leap(edge, &mut ());
        }
        (closed.wiring().words()[command], closed.world().real(edge, 0))
    };
    for tick in 1..=99 {
        let (_, current_a) = go(8568 * tick + 1);
        // The controller's edge is the next one.
        let (steps, _) = go(8568 * tick + 2);
        commands.push(511 + steps);
        currents.push(current_a);
    }
    let (_, last) = go(856_801);
    (commands, currents, last)
}

const AVERAGED: [i64; 30] = [
    1011, 1011, 1011, 1011, 1011, 872, 661, 441, 249, 114, 64, 140, 296, 476, 670, 849, 974, 1011, 997, 896, 740, 555,
    379, 244, 171, 172, 248, 386, 550, 714,
];
const SWITCHED: [i64; 30] = [
    1011, 1011, 1011, 1011, 1011, 869, 657, 426, 225, 87, 46, 147, 312, 496, 688, 860, 982, 1011, 1007, 908, 748, 551,
    359, 214, 138, 148, 249, 396, 566, 731,
];

#[test]
fn a_locked_rotor_has_the_currents_and_codes_of_exact_exponentials() {
    for (bridge, codes, [at_10, at_99, last], code_99) in [
        ("averaged", AVERAGED, [0.384_289_644_355, -0.003_963_068_780_17, -0.149_561_373_651_56], 417),
        ("switching", SWITCHED, [0.304_040_110_107, -0.099_877_672_698_7, -0.172_257_005_704_37], 358),
    ] {
        let (commands, currents, after) = locked(&[("model.datapath", "float32"), ("model.bridge", bridge)]);
        assert_eq!(commands[..30], codes, "{bridge}");
        assert_eq!(commands[98], code_99, "{bridge}");
        for (is, known) in [(currents[9], at_10), (currents[98], at_99), (after, last)] {
            assert!((is - known).abs() < 1e-10, "{bridge}: {is} for {known}");
        }
    }
}

#[test]
fn words_ask_for_the_firmwares_codes_within_a_few_steps() {
    let floats = locked(&[("model.datapath", "float32")]).0;
    let words = locked(&[]).0;
    let most = floats.iter().zip(&words).map(|(float, word)| (float - word).abs()).max();
    assert!(most <= Some(3), "{floats:?} {words:?}");
}

#[test]
fn events_and_clock_agree_to_the_bit_in_words_and_floats_by_encoder_and_hall_sensor() {
    for (name, more) in [
        ("epfl-paddle-step", ("model.datapath", "words")),
        ("epfl-paddle-step", ("model.datapath", "float32")),
        ("epfl-paddle-step", ("model.bridge", "averaged")),
        ("epfl-paddle-cycle", ("model.datapath", "words")),
    ] {
        let experiment = scene(name, &[more, ("method.target_from", "100 us"), ("run.duration", "400 us")]);
        let comparison = WiredSimulation::new(&experiment).unwrap().compare(60_000);
        assert_eq!((comparison.edges, comparison.mismatches), (60_000, 0), "{name} {more:?}");
    }
    // A run takes the converter's codes many at a time.
    for (name, more) in [("epfl-paddle-cycle", "switching"), ("epfl-paddle-step", "averaged")] {
        let sets = [("model.bridge", more), ("method.target_from", "10 us"), ("run.duration", "160 us")];
        let experiment = scene(name, &sets);
        let simulation = WiredSimulation::new(&experiment).unwrap();
        let [events, clock] = [Driver::Events, Driver::Clock].map(|driver| {
            let mut trace = simulation.trace(&["command"]);
            let summary = simulation.run(driver, &mut trace, &mut (), &Control::new());
            (trace.words(0).to_vec(), summary.nets, summary.energy, summary.encoder_edges)
        });
        assert_eq!(events, clock, "{name} {more}");
    }
}

#[test]
fn what_the_loop_cannot_have_is_refused_at_its_key() {
    let refused = |name: &str, sets: &[(&str, &str)]| {
        let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
        SceneFile::find(name).unwrap().parse(&sets).err().map(|error| error.to_string()).unwrap_or_default()
    };
    for (name, sets, parts) in [
        ("epfl-paddle-step", [("method.current", "curent")], ["method.current", "did you mean"]),
        ("epfl-paddle-cycle", [("method.current", "hall")], ["method.current", "kind \"current\""]),
        ("epfl-paddle-step", [("method.position", "current")], ["method.position", "kind \"absolute\""]),
        ("epfl-paddle-step", [("method.code_angle", "1 deg")], ["method.code_angle", "no codes"]),
        ("epfl-paddle-step", [("method.kp", "200 N.m/deg")], ["method.kp", "does not fit (0,16,14)"]),
        ("epfl-paddle-step", [("method.torque_limit", "50 N.m")], ["method.torque_limit", "20 at most"]),
        ("epfl-paddle-step", [("method.target", "120 deg")], ["method.target", "to either side"]),
        ("epfl-paddle-step", [("method.haptic_period", "1 s")], ["method.haptic_period", "16777215"]),
        ("epfl-paddle-step", [("method.sample_rate", "1 kHz")], ["method.sample_rate", "unknown key"]),
        ("epfl-paddle-step", [("model.friction", "smoothed")], ["friction", "speed"]),
        ("epfl-paddle-step", [("encoder.on", "rotor")], ["encoder.on", "paddle"]),
    ] {
        let text = refused(name, &sets);
        assert!(parts.iter().all(|part| text.contains(part)), "{sets:?}: {text}");
    }
}
