//! A hand that moves within the judged window: the window begins after its last move, or the device is compared with
//! it.

use hpu_cosim::scene::{Experiment, OutcomeKind, shipped};
use hpu_cosim::{Control, Driver, Simulation, Summary, Trace, Verdict, Wired, WiredSimulation, judged_window_s};

/// A mass that a hand pulls by a spring and a damper, far in front of a wall or into it.
const PULLED: &str = r#"
about = "A mass that a hand pulls."
[device]
kind = "mass"
mass = "0.3 kg"
damping = "2 N.s/m"
[encoder]
resolution = "20 um"
[amplifier]
full_scale = "20 N"
[clock]
frequency = "1 MHz"
[method]
kind = "sampled_wall"
sample_rate = "1 kHz"
position_bits = 17
stiffness_format = "(0,16,4)"
damping_format = "(0,20,4)"
[wall]
position = "1 m"
stiffness = "300 N/m"
damping = "60 N.s/m"
[hand]
kind = "spring_damper"
stiffness = "200 N/m"
damping = "5 N.s/m"
path = [[0, 0], ["1 s", "10 mm"]]
[run]
duration = "1 s"
"#;

fn parsed(text: &str, overrides: &[(&str, &str)]) -> Experiment {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    Experiment::parse("pulled.toml", text, &overrides, &mut |_| unreachable!("no file is named"))
        .unwrap_or_else(|error| panic!("{error}"))
}

fn pulled(overrides: &[(&str, &str)]) -> Experiment {
    parsed(PULLED, overrides)
}

fn run(scene: &Experiment, trace: impl Fn(&WiredSimulation) -> Trace) -> Summary {
    let simulation = WiredSimulation::new(scene).unwrap();
    simulation.run(Driver::Events, &mut trace(&simulation), &mut (), &Control::default())
}

fn verdict(scene: &Experiment) -> Verdict {
    run(scene, |simulation| simulation.verdict_trace()).verdict.expect("a device")
}

#[test]
fn a_device_behind_a_moving_hand_is_compared_with_the_hand() {
    let found = verdict(&pulled(&[]));
    let Verdict::HandMoves { until_s, rms_rad, greatest_rad, telling_s } = found else { panic!("{found:?}") };
    // At 10 mm/s the damping of 2 N.s/m takes 20 mN, which is 0.1 mm of the hand's spring. What is left of the start
    // has a time constant of 2 * 0.3 / 7 s: after 0.7 s less than a thousandth.
    assert!((rms_rad - 1e-4).abs() < 2e-7 && (greatest_rad - 1e-4).abs() < 2e-7, "{found:?}");
    // The lag of five counts falls to half a count in 0.2 s; of 1.8 s, the last 30 % begin then.
    assert_eq!((until_s, telling_s), (1.0, 1.8));
    assert!(matches!(verdict(&pulled(&[("run.duration", "1.8 s")])), Verdict::Settled { .. }));
}

#[test]
fn a_hand_that_imposes_the_motion_is_where_the_device_is() {
    let grip = "kind = \"spring_damper\"\nstiffness = \"200 N/m\"\ndamping = \"5 N.s/m\"";
    let found = verdict(&parsed(&PULLED.replace(grip, "kind = \"prescribed\""), &[]));
    assert!(matches!(found, Verdict::HandMoves { rms_rad, .. } if rms_rad < 1e-12), "{found:?}");
}

#[test]
fn a_hand_that_presses_deeper_within_the_window_makes_no_limit_cycle_of_a_stable_wall() {
    let deeper = [
        ("hand.path", r#"[[0, 0], ["150 ms", "20 mm"], ["3.2 s", "20 mm"], ["3.3 s", "22 mm"]]"#),
        ("wall.position", "10 mm"),
        ("run.duration", "5 s"),
    ];
    let scene = pulled(&deeper);
    assert_eq!(judged_window_s(&pulled(&[deeper[1], deeper[2]])), [3.5001, 5.0]);
    assert!(matches!(verdict(&scene), Verdict::Settled { .. }), "{:?}", verdict(&scene));
    // The same press 0.7 s later: the window begins with the hand's rest.
    let later = [("hand.path", r#"[[0, 0], ["150 ms", "20 mm"], ["3.9 s", "20 mm"], ["4 s", "22 mm"]]"#)];
    let scene = pulled(&[&deeper[1..], &later].concat());
    assert_eq!(judged_window_s(&scene), [4.0, 5.0]);
    let found = verdict(&scene);
    // What the press leaves has a time constant of 67 / 500 s: from 4 s on it creeps by half a millimetre and more.
    let Verdict::NotTold { telling_s: Some(telling_s), .. } = found else { panic!("{found:?}") };
    let told = pulled(&[&deeper[1..2], &later, &[("run.duration", &telling_s.to_string())]].concat());
    assert!(matches!(verdict(&told), Verdict::Settled { .. }), "{telling_s} s: {:?}", verdict(&told));
}

#[test]
fn a_tenth_of_the_run_is_enough_and_less_is_not() {
    let until = |time: &str| pulled(&[("hand.path", &format!(r#"[[0, 0], ["{time}", "10 mm"]]"#))]);
    assert_eq!(judged_window_s(&until("900 ms")), [0.9, 1.0]);
    assert_ne!(verdict(&until("900 ms")).outcome(), OutcomeKind::HandMoves);
    assert_eq!(judged_window_s(&until("901 ms")), [0.7001, 1.0]);
    let found = verdict(&until("901 ms"));
    assert!(matches!(found, Verdict::HandMoves { until_s: 0.901, .. }), "{found:?}");
}

#[test]
fn a_point_of_the_path_at_which_the_hand_stands_still_moves_nothing() {
    let still = pulled(&[("hand.path", r#"[[0, "1 mm"], ["200 ms", "2 mm"], ["1 s", "2 mm"]]"#)]);
    assert_eq!(judged_window_s(&still), [0.7001, 1.0]);
    assert!(matches!(verdict(&still), Verdict::Settled { .. }));
}

#[test]
fn every_kind_of_trace_has_the_same_window() {
    let paths = [r#"[[0, 0], ["850 ms", "10 mm"]]"#, r#"[[0, 0], ["1 s", "10 mm"]]"#, r#"[[0, 0], ["100 ms", "1 m"]]"#];
    for path in paths {
        let scene = pulled(&[("hand.path", path)]);
        let judged = |simulation: &WiredSimulation| simulation.judged();
        let all = run(&scene, |simulation| simulation.brief_trace());
        let window = run(&scene, |simulation| simulation.verdict_trace());
        let bounded = run(&scene, |simulation| simulation.brief_trace().bounded(4000, &judged(simulation)));
        assert_eq!((all.verdict, all.contact_share), (window.verdict, window.contact_share), "{path}");
        assert_eq!(all.outcome(), bounded.outcome(), "{path}: {:?}", bounded.verdict);
        assert_eq!((all.contact_share, all.averages), (bounded.contact_share, bounded.averages), "{path}");
    }
}

#[test]
fn shipped_scenes_whose_hand_stands_still_keep_their_window() {
    for shipped in shipped() {
        let scene = shipped.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
        let [from_s, to_s] = judged_window_s(&scene);
        let usual = (0.7 * to_s..0.7 * to_s + 0.02).contains(&from_s);
        let moves = ["capped-coupling", "capped-stiffness", "replay-motion", "slow-friction"].contains(&shipped.name);
        assert_eq!(!usual, moves, "{}: {from_s} s to {to_s} s", shipped.name);
    }
}
