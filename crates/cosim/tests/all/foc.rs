//! The loop behind field-oriented control: its drivers to the bit, its torques against those of the equations, and what
//! its models leave out.

use hpu_cosim::scene::{Experiment, SceneFile};
use hpu_cosim::{Control, Driver, Simulation, Summary, Trace, Wired, WiredSimulation};

/// Columns of a row: current across the flux, angle, torque, and the mean torque since the row before.
const CURRENT: usize = 0;
const ANGLE: usize = 2;
const TORQUE: usize = 3;

fn scene(name: &str, sets: &[(&str, &str)]) -> Experiment {
    let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    SceneFile::find(name).unwrap().parse(&sets).unwrap_or_else(|error| panic!("{error}"))
}

fn run(name: &str, sets: &[(&str, &str)], driver: Driver) -> (Summary, Trace) {
    let experiment = scene(name, sets);
    let simulation = WiredSimulation::new(&experiment).unwrap();
    let mut trace = simulation.trace(&["target", "q", "duty_a"]);
    let summary = simulation.run(driver, &mut trace, &mut (), &Control::new());
    (summary, trace)
}

/// A torque that is the wanted one.
const IDEAL: (&str, &str) = ("model", "{ bridge = \"averaged\", currents = \"ideal\" }");

/// The logic in floats.
const FLOATS: (&str, &str) = ("model.datapath", "float64");

/// A hand that pushes from the start.
const PUSHED: (&str, &str) = ("hand", "{ kind = \"constant_torque\", torque = \"60 mN.m\" }");

#[test]
fn events_and_clock_agree_to_the_bit_whatever_is_modelled() {
    for (name, model) in [
        ("foc-detents", ("model.bridge", "switching")),
        ("foc-detents", ("model.bridge", "averaged")),
        ("foc-detents", IDEAL),
        ("foc-wall", ("model.bridge", "switching")),
        ("foc-wall", ("model.bridge", "averaged")),
        ("foc-wall", ("method.enable_after", "1 ms")),
        ("foc-detents", FLOATS),
        ("foc-wall", FLOATS),
    ] {
        let near = if name == "foc-wall" { ("wall.position", "1 mrad") } else { ("method.spacing", "8") };
        let sets = [model, PUSHED, near, ("expect", "{}"), ("run.duration", "5 ms")];
        let experiment = scene(name, &sets);
        let comparison = WiredSimulation::new(&experiment).unwrap().compare(100_000);
        assert_eq!((comparison.edges, comparison.mismatches), (100_000, 0), "{name} {model:?}");
        let [events, clock] = [Driver::Events, Driver::Clock].map(|driver| run(name, &sets, driver));
        for column in [CURRENT, ANGLE, TORQUE] {
            assert_eq!(events.1.real(column), clock.1.real(column), "{name} {model:?}");
        }
        assert_eq!(events.0.nets, clock.0.nets, "{name} {model:?}");
        assert_eq!((events.0.energy, events.0.encoder_edges), (clock.0.energy, clock.0.encoder_edges));
        assert!(events.0.encoder_edges > 10, "{name} {model:?}: {}", events.0.encoder_edges);
        assert!(events.0.ticks < 40_000 && clock.0.ticks == 250_000, "{name} {model:?}: {}", events.0.ticks);
    }
}

/// The words are the floats but for their rounding: a scene's motion is the same within two counts of its position. Its
/// torque at an instant depends on when a count falls, its mean error is a hundredth of its greatest at most.
/// The torque of one code of the converters: 3.3 V of 12 bits at 100 mV/A, and 50 mN.m/A.
const CODE_NM: f64 = 3.3 / 4096.0 / 0.1 * 0.05;

#[test]
fn floats_are_the_words_without_their_rounding() {
    for name in ["foc-detents", "foc-wall"] {
        let sets = [PUSHED, ("expect", "{}"), ("run.duration", "60 ms")];
        let mut floats = sets.to_vec();
        floats.push(FLOATS);
        let [(_, words), (_, floats)] = [run(name, &sets, Driver::Events), run(name, &floats, Driver::Events)];
        let off = |column: usize| {
            let pairs = words.real(column).iter().zip(floats.real(column));
            pairs.map(|(one, other)| (one - other).abs()).collect::<Vec<f64>>()
        };
        let most = |all: &[f64]| all.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let (far, strong) = (most(words.real(ANGLE)), most(words.real(TORQUE)));
        let angle = most(&off(ANGLE));
        let torque = off(TORQUE).iter().sum::<f64>() / words.real(TORQUE).len() as f64;
        println!("{name}: {angle:e} of {far:e} rad, {torque:e} of {strong:e} N.m");
        assert!(angle < 3e-3 && far > 0.05, "{name}: {angle:e} of {far:e}");
        // Both read the same codes. On average they are a few of them apart, where a whole torque is many.
        assert!(torque < 4.0 * CODE_NM && torque > 0.0 && strong > 40.0 * CODE_NM, "{name}: {torque:e} of {strong:e}");
    }
}

/// A knob on a compliant joint with an encoder and stops, and a shunt with a lag.
const KNOB: [(&str, &str); 5] = [
    ("device.bodies.rotor", "{ return_spring = \"10 mN.m/rad\" }"),
    (
        "device.bodies.knob",
        "{ inertia = \"50 g.cm2\", coulomb_friction = \"0.5 mN.m\", \
         stops = { low = -0.002, high = 0.002, stiffness = \"50 N.m/rad\", damping = \"2 mN.m.s/rad\" } }",
    ),
    ("device.joints.shaft", "{ from = \"rotor\", to = \"knob\", ratio = 2, stiffness = \"20 N.m/rad\" }"),
    ("device.sensors.top", "{ kind = \"encoder\", on = \"knob\", lines = 20000 }"),
    ("device.sensors.ia.corner", "100 kHz"),
];

#[test]
fn events_and_clock_agree_to_the_bit_with_bodies_stops_and_an_imposed_motion() {
    let pushed = "{ on = \"knob\", kind = \"constant_torque\", torque = \"60 mN.m\" }";
    let swept = "{ kind = \"prescribed\", path = [[0, 0], [0.002, 0.01], [0.005, -0.01]] }";
    let turned = "{ on = \"knob\", kind = \"prescribed\", path = [[0, 0], [0.002, 0.01], [0.005, -0.01]] }";
    for (name, hand) in [("foc-detents", pushed), ("foc-wall", pushed), ("foc-detents", swept), ("foc-wall", turned)] {
        for model in [("model.bridge", "switching"), ("model.bridge", "averaged"), IDEAL] {
            let mut sets = vec![("hand", hand), ("expect", "{}"), ("run.duration", "5 ms"), model];
            sets.extend(KNOB);
            let [events, clock] = [Driver::Events, Driver::Clock].map(|driver| run(name, &sets, driver));
            for column in [CURRENT, ANGLE, TORQUE] {
                assert_eq!(events.1.real(column), clock.1.real(column), "{name} {hand}");
            }
            assert_eq!(events.0.nets, clock.0.nets, "{name} {hand}");
            assert_eq!((events.0.energy, events.0.encoder_edges), (clock.0.energy, clock.0.encoder_edges));
            assert!(events.0.ticks < 40_000 && events.0.encoder_edges > 0, "{name} {hand}: {}", events.0.encoder_edges);
        }
    }
}

/// Returns the greatest distance of the angles of two runs at rows of the same instants, and the greatest angle.
fn apart([one, other]: [&[(&str, &str)]; 2]) -> (f64, f64) {
    let traces = [one, other].map(|sets| run("foc-wall", sets, Driver::Events).1);
    let [one, other] = traces.each_ref().map(|trace| trace.real(ANGLE));
    let pairs = one.iter().zip(other);
    pairs.fold((0.0f64, 0.0f64), |(far, most), (a, b)| (far.max((a - b).abs()), most.max(a.abs())))
}

/// A knob on a joint of ratio 1 behind the rotor, pushed to a wall.
const BEHIND: [(&str, &str); 6] = [
    ("device.bodies.knob", "{ inertia = \"200 g.cm2\", viscous_friction = \"1 mN.m.s/rad\" }"),
    ("device.joints.shaft", "{ from = \"rotor\", to = \"knob\", stiffness = \"20 N.m/rad\" }"),
    ("hand", "{ on = \"knob\", kind = \"constant_torque\", torque = \"60 mN.m\" }"),
    ("wall.position", "0.05 rad"),
    ("expect", "{}"),
    ("run.duration", "60 ms"),
];

#[test]
fn rigid_joints_are_those_without_a_stiffness_whatever_else_is_modelled() {
    let rigid = ("device.joints.shaft", "{ from = \"rotor\", to = \"knob\" }");
    for model in [("model.bridge", "switching"), ("model.bridge", "averaged"), IDEAL] {
        let by_model = [&BEHIND[..], &[model, ("model.joints", "rigid")]].concat();
        let by_joint = [&BEHIND[..], &[model, rigid]].concat();
        let (far, most) = apart([&by_model, &by_joint]);
        assert!(far == 0.0 && most > 0.05, "{model:?}: {far:e} of {most}");
        // One body with the inertia and the friction of both.
        let one = [
            ("device.rotor_inertia", "500 g.cm2"),
            ("device.viscous_friction", "1.02 mN.m.s/rad"),
            ("hand", "{ kind = \"constant_torque\", torque = \"60 mN.m\" }"),
            model,
        ];
        let (far, most) = apart([&by_model, &[&one[..], &BEHIND[3..]].concat()]);
        assert!(far < 1e-10 && most > 0.05, "{model:?}: {far:e} of {most}");
        // A joint ten times as stiff stretches a tenth as far.
        let stiff = |stiffness: &'static str| {
            apart([&by_model, &[&BEHIND[..], &[model, ("device.joints.shaft.stiffness", stiffness)]].concat()]).0
        };
        let [soft, hard] = ["20 N.m/rad", "200 N.m/rad"].map(stiff);
        assert!((8.0..12.5).contains(&(soft / hard)), "{model:?}: {soft:e} and {hard:e}");
    }
}

#[test]
fn ideal_currents_are_the_limit_of_faster_loops_with_bodies_on_a_joint() {
    let ideal = [&BEHIND[..], &[IDEAL]].concat();
    let off = |bandwidth: &str| {
        let loops = [("model.bridge", "averaged"), ("method.current_bandwidth", bandwidth)];
        apart([&ideal, &[&BEHIND[..], &loops].concat()])
    };
    // A loop of twice the bandwidth lags by half as long.
    let all = ["125 Hz", "250 Hz", "500 Hz", "1000 Hz"].map(|bandwidth| off(bandwidth).0);
    for pair in all.windows(2) {
        assert!((1.8..2.2).contains(&(pair[0] / pair[1])), "{all:?}");
    }
}

/// A rotor that nothing but a stop holds, against a torque: it rests where the stop's spring has it.
#[test]
fn a_knob_rests_in_its_stop() {
    let stops = "{ stops = { low = -1, high = 0.01, stiffness = \"20 N.m/rad\", damping = \"20 mN.m.s/rad\" } }";
    let hand = "{ kind = \"constant_torque\", torque = \"60 mN.m\" }";
    let sets = [
        ("device.bodies.rotor", stops),
        ("hand", hand),
        ("expect", "{}"),
        ("run.duration", "200 ms"),
        ("method.enable_after", "1 s"),
        ("device.coulomb_friction", "0 N.m"),
        ("device.stiction", "0 N.m"),
    ];
    let (summary, trace) = run("foc-wall", &sets, Driver::Events);
    let angle = trace.real(ANGLE).last().copied().unwrap();
    assert!((angle - (0.01 + 60e-3 / 20.0)).abs() < 1e-9, "{angle}");
    assert!(summary.energy.residual_j.abs() < 1e-12 * summary.energy.exchanged_j, "{:?}", summary.energy);
}

#[test]
fn a_wall_gives_its_stiffness_times_the_depth_as_torque_and_as_current() {
    // The hand rests against 1 N.m/rad with 40 mN.m; the motor gives 50 mN.m/A.
    let sets = [
        ("hand", "{ kind = \"constant_torque\", torque = \"40 mN.m\" }"),
        ("wall", "{ position = \"20 mrad\", stiffness = \"1 N.m/rad\", damping = \"4 mN.m.s/rad\" }"),
        ("device.coulomb_friction", "0"),
        ("device.viscous_friction", "1 mN.m.s/rad"),
        ("method.position", "encoder"),
        ("expect", "{}"),
        ("run.duration", "400 ms"),
    ];
    for model in [("model.bridge", "switching"), ("model.bridge", "averaged"), IDEAL] {
        let (_, trace) = run("foc-wall", &[&sets[..], &[model]].concat(), Driver::Events);
        let mean = |column: usize| {
            let last = &trace.real(column)[trace.real(column).len() - 1000..];
            last.iter().sum::<f64>() / last.len() as f64
        };
        // A count is 1.53 mrad: the mean depth of counts lies within one of the depth.
        let count_rad = std::f64::consts::TAU / 4096.0;
        assert!((mean(ANGLE) - 60e-3).abs() < 1.5 * count_rad, "{model:?}: {}", mean(ANGLE));
        assert!((mean(TORQUE) + 40e-3).abs() < 1e-3, "{model:?}: {}", mean(TORQUE));
        if model.0 == "model.bridge" {
            assert!((mean(CURRENT) + 0.8).abs() < 0.02, "{model:?}: {}", mean(CURRENT));
        }
    }
}

#[test]
fn a_field_half_a_turn_off_pulls_the_hand_into_the_wall() {
    // Seven pole pairs: half a turn of the field is pi / 7.
    let (_, trace) = run("foc-wall", &[("method.zero", "0.4487990 rad"), ("expect", "{}")], Driver::Events);
    assert!(trace.last(ANGLE).unwrap() > 0.6, "{:?}", trace.last(ANGLE));
}

#[test]
fn no_current_flows_before_the_switches_are_enabled() {
    let sets = [PUSHED, ("method.enable_after", "20 ms"), ("expect", "{}"), ("run.duration", "40 ms")];
    for bridge in ["switching", "averaged"] {
        let (_, trace) = run("foc-detents", &[&sets[..], &[("model.bridge", bridge)]].concat(), Driver::Events);
        let currents = trace.real(CURRENT);
        assert!(currents[..200].iter().all(|current| *current == 0.0), "{bridge}");
        assert!(currents[210..].iter().any(|current| current.abs() > 0.1), "{bridge}");
    }
}

#[test]
fn sensors_take_no_sample_before_they_are_up() {
    let sets = [
        ("device.sensors.ia.power_up", "10 ms"),
        ("device.sensors.ib.power_up", "10 ms"),
        ("device.sensors.angle.power_up", "10 ms"),
        ("device.initial_angle", "0.1 rad"),
        ("hand", "{ kind = \"none\" }"),
        ("method.enable_after", "12 ms"),
        ("expect", "{}"),
        ("run.duration", "20 ms"),
    ];
    let (summary, _) = run("foc-wall", &sets, Driver::Events);
    // 20 starts a millisecond, of which those before edge 500 000 are missed; the first one comes at edge 1.
    let starts: Vec<_> = summary.starts.iter().map(|(_, starts)| (starts.taken, starts.missed)).collect();
    assert_eq!(starts, [(200, 200); 2]);
    // The word of the angle stays 0, then it is that of 0.1 rad in 2^14 of a turn.
    let (is_up, word) = (10_000 * 50, (0.1 / std::f64::consts::TAU * 16384.0) as i64);
    let experiment = scene("foc-wall", &sets);
    let simulation = WiredSimulation::new(&experiment).unwrap();
    let mut closed = simulation.closed_loop();
    let code = closed.wiring().nets().iter().position(|net| net.name == "code").unwrap();
    for (edge, known) in [(1000, 0), (is_up - 1, 0), (is_up + 1000, word)] {
        while closed.edge() < edge {
            closed.leap(edge, &mut ());
        }
        assert_eq!(closed.wiring().words()[code], known, "edge {edge}");
    }
}
