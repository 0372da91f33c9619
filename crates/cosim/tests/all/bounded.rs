//! A trace that may hold few rows of a run gives the same verdict and metrics as one that holds all rows.

use hpu_cosim::scene::{Experiment, Metric, shipped};
use hpu_cosim::{Control, Driver, Simulation, Summary, Trace, Verdict, Wired, WiredSimulation, metric};

/// Runs a shipped scene under overrides, with its rows held whole or within this number of values.
fn run(name: &str, set: &[(&str, &str)], values: Option<usize>) -> (Experiment, Summary, Trace) {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let experiment = scene.parse(&set).unwrap_or_else(|error| panic!("{error}"));
    let simulation = WiredSimulation::new(&experiment).expect("a simulation");
    let mut trace = simulation.trace(&["position", "command", "command1"]);
    if let Some(values) = values {
        trace = trace.bounded(values, &simulation.judged());
    }
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    drop(simulation);
    (experiment, summary, trace)
}

/// Returns the numbers of a verdict: rms, amplitude, frequency, time.
///
/// # Panics
///
/// For a verdict that no scene here has.
fn numbers(verdict: Verdict) -> [f64; 4] {
    match verdict {
        Verdict::Settled { rms_rad: rms } | Verdict::Passive { rms_m: rms } | Verdict::NonPassive { rms_m: rms } => {
            [rms, 0.0, 0.0, 0.0]
        }
        Verdict::Tracking { rms_m, greatest_m } => [rms_m, greatest_m, 0.0, 0.0],
        Verdict::NoWallTorque { effort, depth } => [effort, depth, 0.0, 0.0],
        Verdict::LimitCycle { rms_rad, amplitude_rad, frequency_hz } => [rms_rad, amplitude_rad, frequency_hz, 0.0],
        Verdict::Diverged { at_s, amplitude_rad } => [0.0, amplitude_rad, 0.0, at_s],
        Verdict::NotTold { rms_rad, amplitude_rad, frequency_hz, telling_s } => {
            [rms_rad, amplitude_rad, frequency_hz, telling_s.expect("a duration")]
        }
        Verdict::HighlyUnstable { at_s } => [0.0, 0.0, 0.0, at_s],
        Verdict::HandMoves { .. } | Verdict::PositionLost { .. } => panic!("{verdict:?}"),
    }
}

const SCENES: [(&str, &[(&str, &str)]); 11] = [
    ("hybrid-wall", &[]),
    ("friction-wall", &[]),
    ("free-motion", &[]),
    ("thrown-conventional", &[]),
    ("count-cycle", &[]),
    ("conventional-wall-100hz", &[]),
    // Runs that are too short: creep toward rest, and swings that fall.
    ("floating-motor", &[]),
    ("power-scaling", &[]),
    // Rows of whole steps, without a clock: with the law in floats, and with words.
    (
        "hybrid-wall",
        &[
            ("model.datapath", "law"),
            ("model.bridge", "averaged"),
            ("model.solver", "midpoint"),
            ("model.step", "5 us"),
        ],
    ),
    ("rail-drop", &[]),
    ("phantom-drop", &[("run.duration", "1 s")]),
];

#[test]
fn a_run_of_more_rows_than_are_held_has_the_verdict_and_the_metrics_of_all_of_them() {
    let mut outcomes = Vec::new();
    for (name, set) in SCENES {
        let (experiment, summary, whole) = run(name, set, None);
        let (_, other, few) = run(name, set, Some(3000));
        assert!(few.every() >= 4 && few.came() == whole.rows() as u64, "{name}: {} of {}", few.rows(), whole.rows());
        assert_eq!(other.outcome(), summary.outcome(), "{name}");
        outcomes.extend(summary.outcome());
        let (expected, found) = (numbers(summary.verdict.unwrap()), numbers(other.verdict.unwrap()));
        assert!(
            (found[0] - expected[0]).abs() <= 1e-12 * expected[0] + 10.0 * f64::EPSILON,
            "{name}: rms {} of {}",
            found[0],
            expected[0]
        );
        assert_eq!([found[1], found[3]], [expected[1], expected[3]], "{name}");
        // Each end of the count is located to one of the held rows, and the count runs over at least three tenths of
        // half of them.
        let counted = 0.15 * few.rows() as f64;
        assert!(
            (found[2] - expected[2]).abs() <= 2.0 / counted * expected[2],
            "{name}: {} Hz, {}",
            found[2],
            expected[2]
        );
        if matches!(experiment, Experiment::Axis(_)) {
            for which in [Metric::FinalAngle, Metric::PeakAngle, Metric::PeakPenetration, Metric::PeakTorque] {
                let of = |summary: &Summary, trace: &Trace| metric(which, &experiment, summary, trace);
                assert_eq!(of(&other, &few), of(&summary, &whole), "{name}: {}", which.name());
            }
        }
    }
    outcomes.sort_by_key(|outcome| format!("{outcome:?}"));
    outcomes.dedup();
    assert!(outcomes.len() >= 3, "{outcomes:?}");
}

#[test]
fn rows_that_are_held_are_every_so_many_of_all_and_never_more_than_may_be() {
    for (name, set) in [SCENES[0], SCENES[6]] {
        let (_, _, whole) = run(name, set, None);
        for values in [60, 1000, 20_000] {
            let (_, _, few) = run(name, set, Some(values));
            // Four outputs and two nets per row.
            assert!(6 * few.rows() <= values && 12 * few.rows() >= values, "{name}: {} rows", few.rows());
            let (every, of_all) = (few.every() as usize, |row: usize| row * few.every() as usize);
            assert_eq!(few.rows(), whole.rows().div_ceil(every));
            for row in 0..few.rows() {
                assert_eq!(few.time_s(row), whole.time_s(of_all(row)));
                for real in 0..4 {
                    assert_eq!(few.real(real)[row].to_bits(), whole.real(real)[of_all(row)].to_bits(), "{name} {real}");
                }
                for net in 0..2 {
                    assert_eq!(few.words(net)[row], whole.words(net)[of_all(row)], "{name}");
                }
            }
        }
    }
}

#[test]
fn a_run_that_fits_is_held_and_judged_as_one_without_a_bound() {
    for (name, set) in SCENES {
        let (_, summary, whole) = run(name, set, None);
        let (_, other, held) = run(name, set, Some(Trace::USUAL));
        assert_eq!((held.every(), held.rows()), (1, whole.rows()), "{name}");
        assert_eq!(other.verdict, summary.verdict, "{name}");
        assert!((0..4).all(|real| held.real(real) == whole.real(real)), "{name}");
    }
}
