//! Words without a clock: a counter that is loaded at samples, and by a live spring at every step.

use hpu_cosim::scene::{Experiment, Scene, shipped};
use hpu_cosim::{AxisSimulation, Control, Simulation, Trace, Wired};

type Set<'a> = &'a [(&'a str, &'a str)];

fn read(name: &str, set: Set) -> Result<Scene, String> {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    scene
        .parse(&set)
        .map(|experiment| Experiment::axis(experiment).expect("an axis"))
        .map_err(|error| error.to_string())
}

fn run(name: &str, set: Set, nets: &[&str]) -> Trace {
    let scene = read(name, set).unwrap_or_else(|error| panic!("{error}"));
    let simulation = AxisSimulation::new(&scene).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut trace = simulation.trace(nets);
    let summary = simulation.run(simulation.driver(), &mut trace, &mut (), &Control::default());
    assert!(summary.complete, "{name}");
    trace
}

const STEPS: Set = &[("model.encoder", "loaded"), ("model.solver", "rk4"), ("model.step", "1 us")];

/// The bound is the greatest difference of angles, in rad or m. For masses it is rounding. The mean over a step has the
/// area and first moment of events but not the higher moments, and a buzzing motion (the first scene) amplifies the
/// difference.
#[test]
fn every_loop_that_is_loaded_moves_as_its_words_do() {
    let averaged = ("model.bridge", "averaged");
    let all: [(&str, Set, f64); 10] = [
        ("conventional-wall-1khz", &[averaged, ("run.duration", "0.6 s")], 1e-4),
        ("thrown-hybrid", &[averaged, ("run.duration", "2 ms")], 3e-5),
        ("dual-rate-wall", &[averaged, ("run.duration", "30 ms")], 1e-5),
        ("coupled-wall", &[averaged, ("run.duration", "30 ms")], 1e-6),
        ("bounded-wall", &[averaged, ("run.duration", "30 ms")], 1e-6),
        ("shaped-wall", &[averaged, ("run.duration", "30 ms")], 1e-6),
        ("energy-level-wall", &[averaged, ("run.duration", "30 ms")], 3e-6),
        ("popc-credit-bounded", &[("run.duration", "0.5 s")], 1e-9),
        // Its motion begins one count beyond the lines that the decoder sees first.
        ("dead-spring", &[("run.duration", "0.1 s")], 1e-9),
        ("power-scaling", &[("run.duration", "12 s")], 1e-9),
    ];
    for (name, set, bound) in all {
        let [by_events, in_steps] = [set.to_vec(), [set, STEPS].concat()].map(|set| run(name, &set, &[]));
        assert_eq!(by_events.rows(), in_steps.rows(), "{name}");
        let angles = by_events.real(2).iter().zip(in_steps.real(2));
        let worst = angles.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= bound, "{name}: {worst:e}");
    }
}

#[test]
fn what_a_loaded_loop_computes_at_a_sample_is_what_its_clocked_words_do_to_the_bit() {
    // Rows in the middle between two samples, where every law has finished.
    for (name, nets) in [
        ("dead-spring", &["torque", "memory", "command"][..]),
        ("popc-credit-bounded", &["torque", "memory", "command"]),
        ("bounded-impulse-engine", &["torque", "memory", "command"]),
        ("negative-damping", &["torque", "memory", "command"]),
        ("capped-coupling", &["torque", "memory", "command"]),
        ("rail-drop", &["velocity", "command"]),
        ("impulse-engine", &["command"]),
        ("weak-wall", &["command"]),
    ] {
        let rate = format!("{:?} Hz", 2.0 / read(name, &[]).expect("it is shipped").sample_period_s());
        let set = [("record.plant_rate", rate.as_str()), ("run.duration", "0.3 s")];
        let [clocked, loaded] = [set.to_vec(), [&set[..], STEPS].concat()].map(|set| run(name, &set, nets));
        let middles: Vec<usize> = (1..clocked.rows()).step_by(2).collect();
        for (column, net) in nets.iter().enumerate() {
            let words = |trace: &Trace| middles.iter().map(|&row| trace.words(column)[row]).collect::<Vec<_>>();
            let (clocked, loaded) = (words(&clocked), words(&loaded));
            let first = clocked.iter().zip(&loaded).position(|(a, b)| a != b);
            assert_eq!(first, None, "{name} {net}: row {first:?} of {}", middles.len());
            assert!(clocked.iter().any(|&word| word != 0), "{name} {net} never moves");
        }
    }
}

#[test]
fn a_loaded_counter_is_refused_where_there_is_none_to_load() {
    let loaded = ("model.encoder", "loaded");
    let steps = [loaded, ("model.solver", "sample")];
    let cases: [(&str, Set, &str); 4] = [
        ("dead-spring", &[loaded], "\"loaded\" is read once a step, and \"events\" has none"),
        ("hybrid-wall", STEPS, "write bridge = \"averaged\" beside it"),
        ("dead-spring", &[&steps[..], &[("model.datapath", "law")]].concat(), "\"loaded\" is the words' counter"),
        (
            "observed-wall",
            &[&steps[..], &[("model.bridge", "averaged"), ("method", EDGE_TIMER)]].concat(),
            "no lines to time",
        ),
    ];
    for (name, set, what) in cases {
        let error = read(name, set).expect_err(name);
        assert!(error.contains(what), "{name}: {error}");
    }
}

const EDGE_TIMER: &str = "{ kind = \"sampled_wall\", sample_rate = \"5 kHz\", estimator = \"edge_timer\" }";
