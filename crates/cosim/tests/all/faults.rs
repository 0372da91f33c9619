//! Faults between device and logic, on a motion with known counts: the hand moves the shaft evenly to 1.4 rad, short of
//! the wall, over 912 counts.

use std::f64::consts::TAU;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Driver, Mark, Simulation, Summary, Wired, WiredSimulation};

const COUNT_RAD: f64 = TAU / 4096.0;
/// Whole counts in 1.4 rad.
const COUNTS: i64 = 912;
/// The clock's frequency in Hz.
const HZ: f64 = 50e6;

fn parsed(name: &str, overrides: &[(&str, &str)]) -> Result<Experiment, String> {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    scene.parse(&overrides).map_err(|error| error.to_string())
}

/// Runs the even motion at 1 rad/s with these faults.
fn sweep(faults: &[(&str, &str)]) -> Summary {
    let path = [("hand.path", "[[0, 0], [1.4, 1.4], [1.5, 1.4]]"), ("run.duration", "1.45 s")];
    let scene = parsed("prescribed-sweep", &[&path, faults].concat()).unwrap_or_else(|error| panic!("{error}"));
    let simulation = WiredSimulation::new(&scene).expect("a scene");
    simulation.run(Driver::Events, &mut simulation.brief_trace(), &mut (), &Control::default())
}

/// Returns the least and the greatest word of a net.
fn range(summary: &Summary, net: &str) -> (i64, i64) {
    let found = summary.nets.iter().find(|found| found.signal.name == net).expect("a net");
    (found.usage.min, found.usage.max)
}

fn kinds(summary: &Summary) -> Vec<&str> {
    summary.faults.iter().map(|mark| mark.what).collect()
}

#[test]
fn the_motion_without_faults_has_its_counts() {
    assert_eq!((1.4 / COUNT_RAD) as i64, COUNTS);
    let summary = sweep(&[]);
    assert_eq!((summary.encoder_edges as i64, range(&summary, "position")), (COUNTS, (0, COUNTS)));
    assert!(summary.faults.is_empty() && summary.faults_waiting == 0);
}

#[test]
fn edges_that_are_missed_or_doubled_are_counts_that_are_lost_or_won() {
    let missed = sweep(&[("faults.missed_edge", "[0.1, 0.2, \"0.3 s\"]")]);
    assert_eq!(range(&missed, "position"), (0, COUNTS - 3));
    // Each fault strikes the first edge from its time on: the edge of the next whole count.
    for (mark, at_s) in missed.faults.iter().zip([0.1, 0.2, 0.3]) {
        let edge_s = (at_s / COUNT_RAD).ceil() * COUNT_RAD;
        assert!((mark.edge as f64 / HZ - edge_s).abs() < 2.0 / HZ, "{mark:?}");
    }
    let doubled = sweep(&[("faults.doubled_edge", "[0.1, 0.2]")]);
    assert_eq!(range(&doubled, "position"), (0, COUNTS + 2));
    // One clock apart there are still two edges, each with its direction.
    let near = sweep(&[("faults.doubled_edge", "[0.1]"), ("faults.doubled_clocks", "1")]);
    assert_eq!((range(&near, "position").1, range(&near, "error")), (COUNTS + 1, (0, 0)));
    // No edge comes after the end of the motion.
    let late = sweep(&[("faults.missed_edge", "[1.42, 1.43]")]);
    assert_eq!((range(&late, "position").1, late.faults.len(), late.faults_waiting), (COUNTS, 0, 2));
}

#[test]
fn bounce_and_glitches_that_the_clock_samples_count_back_and_forth() {
    for (fault, happened) in [("bounce", "bounce"), ("glitch", "glitch")] {
        let key = format!("faults.{fault}");
        let summary = sweep(&[(&key, "[0.1, 0.5, 0.9]")]);
        assert_eq!((range(&summary, "position"), kinds(&summary)), ((0, COUNTS), vec![happened; 3]));
        // Each bounce returns three times, and each glitch moves its line there and back: both cause steps of -1.
        assert_eq!(range(&summary, "step"), (-1, 1), "{fault}");
    }
    assert_eq!(range(&sweep(&[]), "step"), (0, 1));
    // During a glitch in which the other line changes, the count stays, and so does the direction.
    let long =
        sweep(&[("faults.glitch", "[0.1]"), ("faults.glitch_clocks", "2000000"), ("faults.glitch_line", "encoder.b")]);
    // For 40 ms, about 26 counts, the lines run backwards; after that they are where they were, modulo 4.
    let lost = COUNTS - range(&long, "position").1;
    assert!((48..=54).contains(&lost) && range(&long, "error") == (0, 0), "{lost} counts lost");
}

#[test]
fn lines_that_are_exchanged_or_inverted_count_backwards() {
    let wrapped = (0, 4095);
    for faults in
        [&[("faults.swapped", "true")][..], &[("faults.inverted", "encoder.a")], &[("faults.inverted", "encoder.b")]]
    {
        let summary = sweep(faults);
        assert_eq!(range(&summary, "position"), wrapped, "{faults:?}");
    }
    // Both faults at once count forwards again.
    let both = sweep(&[("faults.swapped", "true"), ("faults.inverted", "encoder.a")]);
    assert_eq!(range(&both, "position"), (0, COUNTS));
    // From the middle of the motion on, the count goes back as far as it had come.
    let middle = sweep(&[("faults.swapped", "true"), ("faults.swapped_from", "0.7 s")]);
    let (least, greatest) = range(&middle, "position");
    let there = (0.7 / COUNT_RAD) as i64;
    assert!((there..=there + 1).contains(&greatest) && least == 0, "{least} to {greatest}");
}

#[test]
fn a_clock_that_jitters_is_late_as_often_as_the_period_is_short() {
    let clock_s = 1.0 / HZ;
    for share in [0.1, 0.5, 1.0] {
        let summary = sweep(&[("faults.clock_jitter", &(share * clock_s).to_string())]);
        assert_eq!(range(&summary, "position"), (0, COUNTS));
        // Each of the edges is late with probability J / 2T: the number is within four standard deviations of a
        // binomial.
        let (n, p) = (COUNTS as f64, share / 2.0);
        let late = summary.faults.len() as f64;
        assert!((late - n * p).abs() < 4.0 * (n * p * (1.0 - p)).sqrt(), "{late} of {n} at {share}");
    }
}

#[test]
fn random_faults_follow_the_seed_and_more_of_them_are_those_and_others() {
    let marks = |count: &str, seed: &str| sweep(&[("faults.glitch", count), ("run.seed", seed)]).faults;
    let (few, more) = (marks("5", "1"), marks("20", "1"));
    assert_eq!((few.len(), more.len()), (5, 20));
    assert!(few.iter().all(|mark| more.contains(mark)), "{few:?} {more:?}");
    assert_eq!(marks("5", "1"), few);
    assert_ne!(marks("5", "2"), few);
    // The faults are spread evenly over the run: the mean of 2000 is within four of its standard deviations.
    let many = marks("2000", "3");
    let mean = many.iter().map(|mark| mark.edge as f64 / HZ).sum::<f64>() / 2000.0;
    assert!((mean - 0.725).abs() < 4.0 * 1.45 / (12.0 * 2000f64).sqrt(), "{mean}");
}

#[test]
fn a_switch_that_is_stuck_open_drives_nothing_and_one_that_shorts_its_leg_ends_the_run() {
    let run = |name: &str, faults: &[(&str, &str)]| {
        let scene = parsed(name, faults).unwrap_or_else(|error| panic!("{error}"));
        let simulation = WiredSimulation::new(&scene).expect("a scene");
        simulation.run(Driver::Events, &mut simulation.brief_trace(), &mut (), &Control::default())
    };
    // The wall pushes back through the motor's minus terminal: without its high switch the supply gives nothing.
    let stuck = run("hybrid-wall", &[("faults.stuck_switch", "bridge.minus_high")]);
    assert!(stuck.energy.source_j <= 0.0, "{:?}", stuck.energy);
    assert!(run("hybrid-wall", &[]).energy.source_j > 0.1);
    let short = run(
        "hybrid-wall",
        &[("faults.stuck_switch", "bridge.minus_high"), ("faults.stuck", "closed"), ("faults.stuck_from", "100 ms")],
    );
    // At rest the bridge brakes with its low switches.
    let aborted = short.aborted.expect("it ends");
    assert!((aborted.at_s - 0.1).abs() < 1.0 / HZ && aborted.why.contains("short"), "{aborted:?}");
    assert_eq!(short.faults, [Mark { edge: 5_000_000, what: "stuck_switch" }]);
}

/// Compares both drivers in a run of this duration from a motion into the wall, under each kind of fault.
fn agree_under_every_fault(duration: &str) {
    // Faults that are given as a number are spread over the run.
    let moving =
        [("device.initial_angle", "1.4 rad"), ("device.initial_speed", "60 rad/s"), ("run.duration", duration)];
    let all: [&[(&str, &str)]; 7] = [
        &[("faults.missed_edge", "40"), ("faults.doubled_edge", "40"), ("run.seed", "2")],
        &[("faults.bounce", "200"), ("faults.bounces", "9"), ("faults.bounce_clocks", "5000")],
        &[("faults.glitch", "500"), ("faults.glitch_line", "encoder.b"), ("faults.glitch_clocks", "300")],
        &[("faults.swapped", "true"), ("faults.swapped_from", "4 ms"), ("faults.clock_jitter", "20 ns")],
        &[("faults.inverted", "encoder.a"), ("faults.inverted_from", "5 ms")],
        &[("faults.stuck_switch", "bridge.minus_high"), ("faults.stuck_from", "3 ms"), ("faults.stuck_to", "6 ms")],
        &[("faults.stuck_switch", "bridge.plus_low"), ("faults.stuck_from", "1 ms"), ("faults.stuck_to", "7 ms")],
    ];
    for faults in all {
        for name in ["hybrid-wall", "conventional-wall-10khz", "friction-wall"] {
            for bridge in [&[][..], &[("method.pwm.dead_time", "1 us")]] {
                let scene =
                    parsed(name, &[&moving[..], faults, bridge].concat()).unwrap_or_else(|error| panic!("{error}"));
                let simulation = WiredSimulation::new(&scene).expect("a scene");
                let comparison = simulation.compare(scene.edges());
                assert_eq!(comparison.mismatches, 0, "{name} {faults:?}: {:?}", comparison.first);
                let run = simulation.run(Driver::Events, &mut simulation.brief_trace(), &mut (), &Control::default());
                assert!(!run.faults.is_empty(), "{name} {faults:?}");
            }
        }
    }
}

#[test]
fn leaping_and_stepping_agree_at_every_edge_under_every_fault() {
    agree_under_every_fault("9 ms");
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn leaping_and_stepping_agree_longer_under_every_fault() {
    agree_under_every_fault("40 ms");
}

#[test]
fn faults_of_what_is_not_there_are_refused() {
    let refused = |name: &str, faults: &[(&str, &str)], says: &str| {
        let error = parsed(name, faults).expect_err("a refusal");
        assert!(error.contains(says), "{error}");
    };
    let wall = "hybrid-wall";
    refused(wall, &[("faults.missed", "3")], "unknown key; accepted here: missed_edge, doubled_edge");
    refused(wall, &[("faults.missed_edge", "often")], "is not a number of times at random, as 3, or a list of times");
    refused(wall, &[("faults.missed_edge", "-1")], "a whole number from 0 to 100000");
    refused(wall, &[("faults.missed_edge", "[0.1, \"late\"]")], "faults.missed_edge[1]");
    refused(wall, &[("faults.glitch_clocks", "3")], "without glitch it says nothing");
    refused(wall, &[("faults.stuck_switch", "a_high")], "is none of \"none\", \"bridge.plus_high\"");
    refused(wall, &[("faults.clock_jitter", "21 ns")], "accepted: 0, or");
    refused(wall, &[("faults.lost_index", "true")], "nothing is connected to encoder.index");
    let stuck =
        [("faults.stuck_switch", "bridge.plus_low"), ("faults.stuck_from", "2 ms"), ("faults.stuck_to", "1 ms")];
    refused(wall, &stuck, "0.001 s is no clock after stuck_from, 0.002 s");
    refused(wall, &[stuck[0], ("model.bridge", "averaged")], "driven by a word and not by switches");
    refused(
        wall,
        &[("faults.glitch", "1"), ("model.datapath", "linear"), ("model.bridge", "averaged")],
        "write model.datapath = \"words\"",
    );
    refused("phantom-drop", &[("faults.glitch", "1")], "unknown key");
}
