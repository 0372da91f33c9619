//! `hpu chart`: tables, pictures, maps, interruptions, and refused charts. No test reads a wall time.

use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::common::{assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text};

/// A scene of 40 ms inside the wall, with a hand that stands still.
const SHORT: [&str; 12] = [
    "chart",
    "hybrid-wall",
    "--set",
    "run.duration=40 ms",
    "--set",
    "device.initial_angle=1.5 rad",
    "--set",
    "hand.path=[[0, 1.55]]",
    "--contestants",
    "events,clock,averaged,law,criterion:routh",
    "--jobs",
    "2",
];

#[test]
fn a_chart_writes_a_table_and_a_picture_and_says_what_is_exact() {
    let out = scratch("chart-short").join("out");
    let output = run(&[&SHORT[..], &["-o", text(&out)]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(names(&out), ["chart.csv", "chart.png", "chart.svg"]);
    let said = stdout(&output);
    let line = |name: &str| {
        let found = said.lines().find(|line| line.get(2..).is_some_and(|line| line.starts_with(&format!("{name} "))));
        found.unwrap_or_else(|| panic!("{name}: {said}"))
    };
    assert!(line("events").contains("0: every register edge equal"), "{said}");
    assert!(line("clock").contains("0: every register edge equal"), "{said}");
    assert!(!line("averaged").contains("every register edge"), "{said}");
    assert!(line("events").contains(" whole "), "{said}");
    let svg = fs::read_to_string(out.join("chart.svg")).expect("a picture");
    for word in
        ["$ hpu chart hybrid-wall --contestants", "hybrid-wall: speed against accuracy", "averaged", "1 % allowed"]
    {
        assert!(svg.contains(word), "{word}");
    }
    let csv = fs::read_to_string(out.join("chart.csv")).expect("a table");
    let rows: Vec<&str> = csv.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(rows.len(), 1 + 5, "{csv}");
    let columns = rows[0].split(',').count();
    for row in &rows[1..] {
        // The last column is a quoted command, which has commas of its own.
        let commas: usize = row.split('"').step_by(2).map(|part| part.matches(',').count()).sum();
        assert_eq!(1 + commas, columns, "{row}");
    }
}

#[test]
fn json_is_one_object_with_the_error_of_every_output_and_a_command_that_runs() {
    let result = json(&run(&[&SHORT[..], &["--json"]].concat()));
    assert_eq!(result["complete"], true);
    let contestants = result["contestants"].as_array().expect("a list");
    assert_eq!(contestants.len(), 5);
    let of = |name: &str| contestants.iter().find(|one| one["name"] == name).expect("a contestant");
    for name in ["events", "clock"] {
        assert_eq!(of(name)["grade"], "exact");
        assert_eq!(of(name)["error"], 0.0);
    }
    for output in ["trace", "final_angle", "peak_penetration", "energy", "verdict"] {
        assert!(of("averaged")["errors"][output].is_number(), "{output}: {}", of("averaged"));
    }
    assert!(of("averaged")["errors"]["trace"].as_f64() > Some(0.0));
    assert_eq!((&of("averaged")["timed"], &of("averaged")["timed_s"]), (&"whole".into(), &serde_json::Value::Null));
    assert_eq!(of("criterion:routh")["edges"], 0, "a criterion runs nothing");
    let replay = of("averaged")["replay"].as_str().expect("a command");
    assert!(
        replay.starts_with("hpu run hybrid-wall --set ") && replay.ends_with("--set model.bridge=averaged"),
        "{replay}"
    );
}

#[test]
fn what_a_scene_refuses_is_told_beside_those_that_ran() {
    // The start is in the wall, without a hand. The law in floats takes a ramp as a share of the wall's stiffness,
    // which is 0 here.
    let set = ["wall.stiffness=0", "wall.ramp={ stiffness = 1, from = 0, to = \"10 ms\" }", "run.duration=20 ms"];
    let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    let output = run(&[&["chart", "hybrid-wall", "--contestants", "events,law"][..], &set].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("not of this scene: law: "), "{}", stdout(&output));
}

#[test]
fn a_map_tells_the_share_of_wrong_verdicts_and_goes_on_from_its_journal() {
    let out = scratch("chart-map").join("out");
    let command = [
        "chart",
        "conventional-wall-1khz",
        "--x",
        "wall.stiffness=0.1..3 N.m/rad:3:log",
        "--y",
        "method.sample_rate=1..2 kHz:2",
        "--set",
        "run.duration=600 ms",
        "--contestants",
        "events,averaged,criterion:low_frequency",
        "-o",
        text(&out),
    ];
    let output = run(&command);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(names(&out), ["chart.csv", "chart.png", "chart.svg", "journal.txt"]);
    let journal = fs::read_to_string(out.join("journal.txt")).expect("a journal");
    // Three layers (the reference, events, averaged) of six cells, and six cells of the criteria.
    assert_eq!(journal.lines().count(), 1 + 3 * 6 + 6);
    let again = json(&run(&[&command[..], &["--json"]].concat()));
    assert_eq!(fs::read_to_string(out.join("journal.txt")).expect("a journal"), journal, "nothing is run again");
    let of = |name: &str| {
        let all = again["contestants"].as_array().expect("a list");
        all.iter().find(|one| one["name"] == name).expect("a contestant").clone()
    };
    assert_eq!(of("events")["wrong"], 0);
    for name in ["events", "averaged", "criterion:low_frequency"] {
        assert_eq!(of(name)["cells"], 6, "{name}");
    }
    let svg = fs::read_to_string(out.join("chart.svg")).expect("a picture");
    assert!(svg.contains("how often the verdict is wrong") && svg.contains("low frequency"));
}

#[test]
fn an_interrupted_chart_leaves_nothing() {
    let dir = scratch("chart-interrupt");
    let out = dir.join("out");
    let long = ["chart", "hybrid-wall", "--contestants", "clock", "--set", "run.duration=1000 s", "-o", text(&out)];
    let child = hpu().args(long).stdout(Stdio::piped()).spawn().expect("starts");
    while !out.exists() {
        sleep(Duration::from_millis(1));
    }
    sleep(Duration::from_millis(100));
    let kill = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(kill.expect("a shell").success());
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 130, "{}", stdout(&output));
    assert!(stdout(&output).contains("interrupted"), "{}", stdout(&output));
    assert_eq!(names(&dir), [""; 0]);
}

#[test]
fn what_is_no_chart_is_refused_with_its_reason_before_anything_is_written() {
    let dir = scratch("chart-refused");
    let out = dir.join("out");
    let refused = |arguments: &[&str], exit: i32, words: &[&str]| {
        assert_refused(&run(&[&["chart"], arguments, &["-o", text(&out)]].concat()), exit, words);
    };
    refused(&["hybrid-wall", "--contestants", "telepathy"], 2, &["`telepathy`", "events", "clock", "rk4"]);
    refused(&["hybrid-wall", "--contestants", "rk4@7us"], 2, &["`rk4@7us`", "@20ns"]);
    refused(&["phantom-drop", "--contestants", "averaged"], 2, &["`averaged`", "one-joint"]);
    refused(&["replay-capture"], 4, &["recording", "no device"]);
    refused(&["no-such-scene"], 4, &["no-such-scene", "hybrid-wall"]);
    refused(&["hybrid-wall", "--set", "wall.stifness=2"], 4, &["wall.stifness", "unknown key"]);
    refused(&["hybrid-wall", "--set", "accuracy.outputs=[\"beauty\"]"], 4, &["accuracy.outputs[0]", "beauty", "trace"]);
    refused(&["hybrid-wall", "--set", "accuracy.within=0"], 4, &["accuracy.within", "above zero"]);
    refused(&["hybrid-wall", "--set", "model.datapath=linear"], 4, &["linear"]);
    let (x, y) = ("wall.stiffness=0.1..3 N.m/rad:3", "wall.damping=0..0.1 mN.m.s/rad:2");
    refused(&["hybrid-wall", "--x", x], 2, &["--y"]);
    refused(&["hybrid-wall", "--x", x, "--y", x], 2, &["both axes"]);
    refused(&["replay-capture", "--x", x, "--y", y], 4, &["recording"]);
    assert_eq!(names(&dir), [""; 0]);
}
