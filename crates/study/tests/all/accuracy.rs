//! Speed against accuracy: errors of known differences, the front, and which contestants a scene has.

use std::num::NonZeroUsize;
use std::time::Duration;

use hpu_cosim::scene::{Experiment, OutcomeKind, Output, shipped};
use hpu_cosim::{Control, Driver};
use hpu_prove::criteria;
use hpu_study::accuracy::{Chart, Grade, Outputs, Plan, Race, SOLVERS, contestants, front, named, usual, worst};
use proptest::prelude::*;

fn scene(name: &str, set: &[(&str, &str)]) -> Experiment {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    shipped.parse(&set).expect("a scene")
}

fn run(experiment: &Experiment, driver: Driver) -> Outputs {
    Outputs::printed(experiment, driver, &Control::default()).expect("runs").0.expect("to its end")
}

/// Returns outputs with a motion over a range of 4 that goes 0.5 deep into a wall, and with 3 J given of 8 J exchanged.
fn reference() -> Outputs {
    Outputs {
        trace: vec![-1.0, 0.0, 3.0, 2.0],
        peak_penetration: 0.5,
        amplitude: 0.25,
        frequency_hz: 50.0,
        given_j: 3.0,
        exchanged_j: 8.0,
        rms_m: None,
        outcome: OutcomeKind::LimitCycle,
        print: Some(7),
    }
}

fn error(of: Output, ours: &Outputs, theirs: &Outputs) -> f64 {
    ours.errors(theirs).into_iter().find(|(output, _)| *output == of).expect("is compared").1
}

#[test]
fn known_differences_have_known_errors() {
    let theirs = reference();
    assert!(theirs.errors(&theirs).iter().all(|(_, error)| *error == 0.0), "against itself all is 0 exactly");
    let ours = Outputs {
        // Off by 0.5 throughout, over a range of 4.
        trace: theirs.trace.iter().map(|x| x + 0.5).collect(),
        peak_penetration: 0.75,
        amplitude: 0.125,
        frequency_hz: 51.0,
        given_j: 2.0,
        exchanged_j: 1e9,
        print: Some(8),
        ..theirs.clone()
    };
    let expected = [
        (Output::Trace, 0.125),
        (Output::FinalAngle, 0.125),
        (Output::PeakPenetration, 0.5),
        (Output::Amplitude, 0.5),
        (Output::Frequency, 0.02),
        (Output::Energy, 0.125),
        (Output::Verdict, 0.0),
    ];
    assert_eq!(ours.errors(&theirs), expected);
    assert_eq!(worst(&expected, &[Output::Trace, Output::Frequency]), 0.125);
    // Two rows of four are off by 1: the rms of the difference is 1 / sqrt(2), over the range of 4.
    let half = Outputs { trace: vec![-1.0, 1.0, 2.0, 2.0], ..theirs.clone() };
    assert!((error(Output::Trace, &half, &theirs) - 0.5f64.sqrt() / 4.0).abs() < 1e-15);
}

#[test]
fn what_is_wrong_altogether_has_an_infinite_error_and_what_does_not_swing_one_of_all() {
    let theirs = reference();
    let rests = Outputs { amplitude: 0.0, frequency_hz: 0.0, outcome: OutcomeKind::Settled, ..theirs.clone() };
    assert_eq!(error(Output::Verdict, &rests, &theirs), f64::INFINITY);
    assert_eq!(error(Output::Amplitude, &rests, &theirs), 1.0);
    assert_eq!(error(Output::Frequency, &rests, &theirs), 1.0);
    let lost = Outputs { trace: vec![f64::NAN; 4], given_j: f64::NAN, ..theirs.clone() };
    for output in [Output::Trace, Output::FinalAngle, Output::Energy] {
        assert_eq!(error(output, &lost, &theirs), f64::INFINITY);
    }
    // For a reference that never touched the wall, the error of the depth is relative to its range of motion.
    let apart = Outputs { peak_penetration: 0.0, ..theirs.clone() };
    assert_eq!(error(Output::PeakPenetration, &theirs, &apart), 0.125);
    // An output that the reference does not have is not compared.
    assert!(theirs.errors(&rests).iter().all(|(output, _)| !matches!(output, Output::Amplitude | Output::Frequency)));
}

#[test]
fn a_drop_test_is_compared_by_trace_rms_and_verdict() {
    let passive = Outputs { rms_m: Some(1e-6), outcome: OutcomeKind::Passive, ..reference() };
    let outputs: Vec<_> = passive.errors(&passive).into_iter().map(|(output, _)| output).collect();
    assert_eq!(outputs, [Output::Trace, Output::Rms, Output::Verdict]);
    // The error is relative to the 30 um that decide the verdict; beyond them it is relative to the reference itself.
    let other = Outputs { rms_m: Some(4e-6), ..passive.clone() };
    assert!((error(Output::Rms, &other, &passive) - 0.1).abs() < 1e-12);
    let chatters = Outputs { rms_m: Some(200e-6), outcome: OutcomeKind::NonPassive, ..passive.clone() };
    let more = Outputs { rms_m: Some(250e-6), ..chatters.clone() };
    assert!((error(Output::Rms, &more, &chatters) - 0.25).abs() < 1e-12);
}

#[test]
fn the_phase_of_a_motion_without_end_is_not_compared_unless_asked_for() {
    for outcome in [OutcomeKind::LimitCycle, OutcomeKind::NonPassive, OutcomeKind::Diverged] {
        assert!(!usual(outcome).contains(&Output::Trace));
    }
    assert!(usual(OutcomeKind::Settled).contains(&Output::Trace));
}

proptest! {
    #[test]
    fn the_front_is_what_no_other_point_beats(
        points in prop::collection::vec(((0u8..12).prop_map(f64::from), (0u8..12).prop_map(f64::from)), 0..40),
    ) {
        let beats = |a: (f64, f64), b: (f64, f64)| a.0 >= b.0 && a.1 <= b.1 && a != b;
        let mut expected: Vec<usize> =
            (0..points.len()).filter(|&i| !points.iter().any(|&other| beats(other, points[i]))).collect();
        let mut found = front(&points);
        prop_assert!(found.windows(2).all(|pair| points[pair[0]].0 <= points[pair[1]].0), "the slowest first");
        found.sort_unstable();
        expected.sort_unstable();
        prop_assert_eq!(found, expected);
    }
}

#[test]
fn points_without_a_number_are_on_no_front() {
    assert_eq!(front(&[(1.0, f64::INFINITY), (f64::NAN, 0.0), (2.0, 0.5), (1.0, f64::NAN)]), [2]);
}

#[test]
fn the_contestants_of_a_motor_are_of_every_family() {
    let all = contestants(&scene("hybrid-wall", &[]));
    let families: Vec<&str> = all.iter().map(|contestant| contestant.family.as_str()).collect();
    for family in ["events", "clock", "sample", "averaged", "law", "resistive", "criterion"] {
        assert!(families.contains(&family), "{family}: {families:?}");
    }
    for solver in SOLVERS {
        for variant in ["", "+averaged", "+law"] {
            let rungs = all.iter().filter(|contestant| contestant.family == format!("{solver}{variant}"));
            let steps: Vec<f64> = rungs.filter_map(|contestant| contestant.step_s).collect();
            assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
            // From a clock period at 50 MHz to a sample period at 1 kHz, with decades in between.
            assert_eq!((steps[0], steps[steps.len() - 1]), (20e-9, 1e-3));
            for decade in [100e-9, 1e-6, 10e-6, 100e-6] {
                assert!(steps.contains(&decade), "{steps:?}");
            }
        }
    }
    // The scene has no Coulomb friction, so there is none to smooth.
    assert!(!families.contains(&"smoothed") && !families.contains(&"frictionless"));
    assert!(contestants(&scene("friction-wall", &[])).iter().any(|one| one.name == "smoothed"));
    let mut names: Vec<&String> = all.iter().map(|contestant| &contestant.name).collect();
    names.sort();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "a name is one contestant's");
}

#[test]
fn only_what_differs_from_the_scene_as_written_runs_beside_it() {
    let averaged = contestants(&scene("hybrid-wall", &[("model.bridge", "averaged")]));
    assert!(averaged.iter().any(|one| one.name == "switching"));
    assert!(!averaged.iter().any(|one| one.name == "averaged" || one.family == "rk4+averaged"));
    let mass = contestants(&scene("rail-drop", &[]));
    assert!(!mass.iter().any(|one| ["averaged", "switching", "resistive"].contains(&one.name.as_str())));
    assert!(mass.iter().any(|one| one.family == "rk4+law"));
    let rigid = contestants(&scene("phantom-late", &[("model", "{ friction = true }")]));
    assert!(!rigid.iter().any(|one| one.name == "rigid"));
    let flexible = scene("phantom-flexible", &[]);
    for contestant in contestants(&flexible).iter().filter(|one| one.name != "clock") {
        let set: Vec<_> = contestant.overrides.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        let simpler = scene("phantom-flexible", &set);
        assert!(contestant.name == "events" || simpler != flexible, "{}", contestant.name);
    }
}

#[test]
fn names_choose_contestants_ladders_and_variants_and_an_unknown_one_is_told_what_there_is() {
    let all = contestants(&scene("hybrid-wall", &[]));
    let choose = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
        named(&all, &names).map(|chosen| chosen.into_iter().map(|one| one.name).collect::<Vec<_>>())
    };
    assert_eq!(choose(&["rk4@1us", "events"]).expect("both are there"), ["events", "rk4@1us"]);
    assert_eq!(choose(&["rk4"]).expect("a ladder").len(), 10);
    assert!(choose(&["criterion"]).expect("a family").len() > 1);
    let refused = choose(&["rk5"]).expect_err("there is none");
    for word in ["`rk5`", "rk4", "clock", "criterion:routh", "euler@20ns"] {
        assert!(refused.to_string().contains(word), "{word}: {refused}");
    }
}

#[test]
fn clock_has_every_edge_of_events() {
    for name in ["hybrid-wall", "rail-drop", "phantom-thrown"] {
        let experiment = scene(name, &[("run.duration", "20 ms")]);
        let (events, clock) = (run(&experiment, Driver::Events), run(&experiment, Driver::Clock));
        assert!(clock.same_edges(&events), "{name}");
        assert!(clock.errors(&events).iter().all(|(_, error)| *error == 0.0), "{name}");
    }
    // A wall that is one word stiffer changes the hash.
    let moved = [("run.duration", "20 ms"), ("device.initial_angle", "1.6 rad")];
    let stiff = scene("hybrid-wall", &[&moved[..], &[("wall.stiffness", "1.55 N.m/rad")]].concat());
    assert!(!run(&stiff, Driver::Events).same_edges(&run(&scene("hybrid-wall", &moved), Driver::Events)));
}

#[test]
fn steps_that_are_passed_between_events_are_those_that_every_edge_sees() {
    let (count, contact) = ("0.05 ms", ("device.initial_angle", "1.55 rad"));
    let moves =
        [("run.duration", "12 ms"), ("record.plant_rate", "7 kHz"), contact, ("device.initial_speed", "4 rad/s")];
    for (solver, step) in [("euler", "20 ns"), ("semi_implicit", "60 ns"), ("midpoint", "1 us"), ("rk4", count)] {
        for bridge in ["switching", "averaged"] {
            for winding in ["inductive", "resistive"] {
                if (bridge, winding) == ("switching", "resistive") {
                    continue;
                }
                let model = [
                    ("model.solver", solver),
                    ("model.step", step),
                    ("model.bridge", bridge),
                    ("model.winding", winding),
                ];
                let experiment = scene("friction-wall", &[&moves[..], &model].concat());
                let (events, clock) = (run(&experiment, Driver::Events), run(&experiment, Driver::Clock));
                assert!(clock.same_edges(&events), "{model:?}");
                assert_eq!((events.given_j, events.exchanged_j), (clock.given_j, clock.exchanged_j), "{model:?}");
                assert_eq!(events.trace, clock.trace, "{model:?}");
            }
        }
    }
}

/// A mass on a rail that slows down in a viscous medium and reaches no wall: a smooth, linear motion.
fn coasting(names: &[&str]) -> Chart {
    let shipped = shipped().iter().find(|shipped| shipped.name == "rail-drop").expect("a shipped scene");
    let set = [
        ("device.coulomb", "0"),
        ("device.damping", "10 N.s/m"),
        ("device.initial_speed", "1 m/s"),
        // The run ends where a step of every rung ends.
        ("run.duration", "30 ms"),
        ("accuracy.outputs", "[\"final_angle\"]"),
    ];
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
    let mut load = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let race = Race::new((shipped.name, shipped.text), &set, &names, &mut load).expect("a race");
    let plan = Plan { repeats: 1, ..Plan::usual(NonZeroUsize::MIN) };
    race.run(plan, &Control::default()).expect("runs").expect("to its end")
}

#[test]
fn in_a_race_clock_is_exact_and_a_ladder_s_error_falls_with_its_step_by_the_solver_s_order() {
    let chart = coasting(&["events", "clock", "euler", "rk4"]);
    let row = |name: &str| {
        let entry = chart.entries.iter().find(|entry| entry.contestant.name == name).expect("a contestant");
        entry.row.as_ref().unwrap_or_else(|why| panic!("{name}: {why}"))
    };
    assert_eq!((row("events").grade, row("clock").grade), (Grade::Exact, Grade::Exact));
    let error = |name: &str| row(name).grade.error().unwrap_or(f64::INFINITY);
    // A tenth of the step gives a tenth of Euler's error. For the classic method of order 4, a third of the step is
    // enough.
    for (solver, order, rungs) in [("euler", 1.0, ["1ms", "100us"]), ("rk4", 4.0, ["1ms", "300us"])] {
        let [long, short] = rungs.map(|rung| error(&format!("{solver}@{rung}")));
        let shorter: f64 = if rungs[1] == "100us" { 10.0 } else { 10.0 / 3.0 };
        let fall = (long / short).ln() / shorter.ln();
        assert!((fall - order).abs() < 0.1 * order, "{solver}: {long:e} to {short:e}");
    }
    let ladder = ["rk4@1ms", "rk4@300us", "rk4@100us", "rk4@30us"].map(error);
    assert!(ladder.windows(2).all(|pair| pair[1] < pair[0]), "{ladder:?}");
    let fastest = chart.fastest_within().expect("events is within");
    assert!(chart.entries[fastest].row.as_ref().is_ok_and(|row| row.grade.error() <= Some(chart.within)));
}

#[test]
fn a_run_that_takes_too_long_is_shortened_with_its_reference_and_says_so() {
    let shipped = shipped().iter().find(|shipped| shipped.name == "hybrid-wall").expect("a shipped scene");
    let set = [("run.duration".to_string(), "100 s".to_string())];
    let mut load = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let race = Race::new((shipped.name, shipped.text), &set, &["clock".to_string()], &mut load).expect("a race");
    let plan = Plan { longest: Duration::from_millis(150), repeats: 1, ..Plan::usual(NonZeroUsize::MIN) };
    let chart = race.run(plan, &Control::default()).expect("runs").expect("to its end");
    let row = chart.entries[0].row.as_ref().expect("ran");
    let shortened_s = row.shortened_s.expect("100 s of edges take longer");
    assert!(shortened_s < 100.0 && row.speed.motion_s <= shortened_s * 1.001);
    assert_eq!(row.grade, Grade::Exact, "against the reference of the same length");
}

#[test]
fn a_long_run_by_edges_or_steps_is_timed_over_its_first_part_and_says_so() {
    let shipped = shipped().iter().find(|shipped| shipped.name == "hybrid-wall").expect("a shipped scene");
    let set = [("run.duration".to_string(), "200 ms".to_string())];
    let mut load = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let names = ["events", "clock", "euler@100ns", "euler@1ms+law"].map(String::from);
    let race = Race::new((shipped.name, shipped.text), &set, &names, &mut load).expect("a race");
    let plan = Plan { enough: Duration::from_millis(20), ..Plan::usual(NonZeroUsize::MIN) };
    let control = Control::default();
    let chart = race.run(plan, &control).expect("runs").expect("to its end");
    let rows: Vec<_> = chart.entries.iter().map(|entry| entry.row.as_ref().expect("ran")).collect();
    for (name, row) in names.iter().zip(&rows) {
        assert_eq!((row.speed.motion_s, row.speed.edges, row.shortened_s), (0.2, 10_000_000, None), "{name}");
    }
    assert_eq!((rows[0].speed.timed_s, rows[3].speed.timed_s), (None, None), "leaps, and a run of 200 steps");
    assert_eq!(rows[0].speed.timed(), "whole");
    for row in [rows[1], rows[2]] {
        let timed_s = row.speed.timed_s.expect("ten million edges and two million steps take longer");
        assert!(timed_s > 0.0 && timed_s < 0.2 && row.speed.wall_s().median.is_finite(), "{row:?}");
        // At most two digits, however slow the machine is at that moment.
        let timed = row.speed.timed();
        let digits = timed
            .strip_prefix("first 0.")
            .and_then(|rest| rest.strip_suffix(" s"))
            .map(|rest| rest.trim_start_matches('0'));
        assert!(digits.is_some_and(|digits| (1..=2).contains(&digits.len())), "{timed}");
    }
    assert_eq!(rows[1].grade, Grade::Exact, "over the whole motion");
    let done = control.progress.load(std::sync::atomic::Ordering::Relaxed);
    assert_eq!(done, race.work(plan), "all of the work is counted, and no more");
}

#[test]
fn every_criterion_has_its_name() {
    let Experiment::Axis(axis) = scene("rail-drop", &[]) else { panic!("an axis") };
    for name in criteria::NAMES {
        match criteria::named(name, &axis) {
            Some(Ok(criterion)) => assert_eq!(criterion.name, name),
            Some(Err(silent)) => assert_eq!(silent.name, name),
            None => assert_eq!(name, "low_frequency", "there for motors alone"),
        }
    }
    assert!(criteria::named("telepathy", &axis).is_none());
}
