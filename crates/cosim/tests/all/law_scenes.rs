//! Scenes of the methods: refusals, and the agreement of a datapath in words with its law in floats.

use hpu_cosim::scene::{Experiment, OutcomeKind, shipped};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};

fn experiment(name: &str, set: &[(&str, &str)]) -> Result<Experiment, String> {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    scene.parse(&set).map_err(|error| error.to_string())
}

/// Checks that the conventional wall at 1 kHz is refused with these keys, by a message with these parts.
#[track_caller]
fn refused(set: &[(&str, &str)], expected: &[&str]) {
    let message = experiment("conventional-wall-1khz", set).expect_err("refused");
    for part in expected {
        assert!(message.contains(part), "{message} does not say {part}");
    }
}

fn outcome(name: &str, set: &[(&str, &str)]) -> OutcomeKind {
    let experiment = experiment(name, set).expect("a scene");
    let simulation = WiredSimulation::new(&experiment).expect("ready");
    let mut trace = simulation.trace(&[]);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    summary.outcome().expect("a device")
}

#[test]
fn a_method_that_needs_the_future_is_refused() {
    refused(&[("method.kind", "midpoint_spring")], &["method.kind", "not causal", "passive_spring"]);
}

#[test]
fn a_sample_shorter_than_the_laws_latency_is_refused_with_the_rate_that_fits() {
    // ENERGY_WIDTH + 2 = 34 edges: a sample takes at least 35 clocks, 50 MHz / 35.
    let set = [("wall.damping", "0"), ("method.kind", "passivity_controller"), ("method.sample_rate", "1.5 MHz")];
    refused(&set, &["method.sample_rate", "33 clocks a sample", "passivity_controller take 34", "1428571 Hz"]);
}

#[test]
fn constants_that_no_law_can_have_are_refused() {
    let bounded = |c1, c2| [("method.kind", "energy_bounding"), ("method.c1", c1), ("method.c2", c2)];
    refused(&bounded("0.2", "0.3"), &["method.c2", "0 < c2 <= c1"]);
    refused(&bounded("1 MN.m/rad", "0.3"), &["method.c1", "does not fit (0,10,4)"]);
    refused(&[("method.kind", "energy_bounding")], &["method.c1", "missing"]);
    let set =
        [("method.kind", "energy_bounding"), ("method.form", "force_bound"), ("method.c1", "1"), ("method.c2", "1")];
    refused(&set, &["method.c2", "one constant"]);
    refused(&[("method.kind", "virtual_coupling")], &["method.coupling_stiffness", "missing"]);
    let set = [("method.kind", "passive_spring"), ("method.alpha", "0")];
    refused(&set, &["method.alpha"]);
}

#[test]
fn keys_of_another_law_or_estimator_are_refused() {
    refused(
        &[("method.kind", "energy_bounding"), ("method.c1", "1"), ("method.window", "3")],
        &["method.window", "unknown key"],
    );
    refused(&[("method.kind", "sampled_wall"), ("method.window", "3")], &["method.window", "estimator"]);
    refused(&[("method.c1", "1")], &["method.c1", "unknown key"]);
    refused(&[("method.shaper.cutoff", "2.5 Hz")], &["method.shaper", "no place for a shaper", "sampled_wall"]);
    refused(&[("method.kind", "sampled_wall"), ("method.velocity_bits", "9")], &["velocity_bits", "unknown key"]);
}

#[test]
fn a_law_runs_where_there_is_something_to_run_it() {
    let law = ("model.datapath", "law");
    refused(&[law], &["model.datapath", "no gates", "averaged"]);
    let set = [("method.kind", "energy_bounding"), ("method.c1", "1"), ("model.datapath", "linear")];
    refused(&set, &["model.datapath", "energy_bounding", "\"law\""]);
    let set = [("method.kind", "sampled_wall"), ("method.estimator", "foaw"), law, ("model.bridge", "averaged")];
    refused(&set, &["method.estimator", "difference"]);
}

#[test]
fn a_ramp_is_of_what_the_method_reads() {
    let ramp = |inner| ("wall.ramp", inner);
    refused(&[ramp("{ scale = 2, from = \"1 s\", to = \"2 s\" }")], &["wall.ramp.scale", "passive_spring"]);
    let coupled = [("method.kind", "virtual_coupling"), ("method.coupling_stiffness", "0.3")];
    let ramp = ramp("{ stiffness = 2, from = \"1 s\", to = \"2 s\" }");
    refused(&[coupled[0], coupled[1], ramp], &["wall.ramp", "coupling"]);
    let from_nothing = [("wall.stiffness", "0"), ("model.datapath", "law"), ("model.bridge", "averaged"), ramp];
    refused(&from_nothing, &["wall.ramp", "share", "above"]);
}

#[test]
fn words_and_law_come_to_the_same_verdict_where_the_methods_differ_most() {
    // The plain wall is three times too stiff for this rate; bounded or coupled it holds.
    let plain = [("method.kind", "sampled_wall")];
    let bounded = [("method.kind", "energy_bounding"), ("method.c1", "0.28 N.m/rad")];
    let coupled = [("method.kind", "virtual_coupling"), ("method.coupling_stiffness", "0.28 N.m/rad")];
    let cases: [(&[(&str, &str)], _); 3] =
        [(&plain, OutcomeKind::LimitCycle), (&bounded, OutcomeKind::Settled), (&coupled, OutcomeKind::Settled)];
    for (set, expected) in cases {
        for model in [&[("model.bridge", "averaged")][..], &[("model.bridge", "averaged"), ("model.datapath", "law")]] {
            let set = [set, model].concat();
            assert_eq!(outcome("conventional-wall-1khz", &set), expected, "{set:?}");
        }
    }
}

#[test]
fn events_and_clock_agree_on_a_law_in_floats() {
    let set = [
        ("model.bridge", "averaged"),
        ("model.datapath", "law"),
        ("run.duration", "20 ms"),
        ("device.initial_angle", "1.49 rad"),
        ("device.initial_speed", "30 rad/s"),
    ];
    let experiment = experiment("conventional-wall-1khz", &set).expect("a scene");
    let simulation = WiredSimulation::new(&experiment).expect("ready");
    let found = simulation.compare(simulation.edges());
    assert_eq!((found.mismatches, found.first), (0, None));
}
