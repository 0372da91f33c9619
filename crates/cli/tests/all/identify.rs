//! Keys identified from logs: a shorted motor that runs down, integrated here.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_refused, code, json, run, scratch, stdout};

/// Resistance, inductance, torque constant, moment of inertia, Coulomb friction.
const MOTOR: [f64; 5] = [2.0, 0.5e-3, 0.03, 2e-5, 2e-3];
const COUNT: f64 = std::f64::consts::TAU / 2000.0;

const SCENE: &str = r#"
about = "A shorted motor runs down."
clock = { frequency = "1 MHz" }
device.kind = "motor"
device.resistance = "2 Ohm"
device.inductance = "0.5 mH"
device.torque_constant = "30 mN.m/A"
device.rotor_inertia = "150 g.cm2"
device.coulomb_friction = "2.5 mN.m"
device.initial_speed = "60 rad/s"
encoder = { lines = 500 }
method = { kind = "hybrid", sample_rate = "1 kHz", damping_format = "(0,8,4)" }
wall = { position = "3 rad", stiffness = 0 }
hand = { kind = "none" }
run = { duration = "120 ms" }
"#;

/// Returns the counts of the motor at each millisecond, by Heun's method in steps of a microsecond.
fn counts(speed: f64) -> Vec<i64> {
    let [resistance, inductance, constant, inertia, friction] = MOTOR;
    let slope = |[current, speed, _]: [f64; 3]| {
        let torque = constant * current - if speed > 0.0 { friction } else { 0.0 };
        [(-resistance * current - constant * speed) / inductance, torque / inertia, speed]
    };
    let (mut at, mut counts) = ([0.0, speed, 0.0], Vec::new());
    for step in 0..119_000 {
        if step % 1000 == 0 {
            counts.push((at[2] / COUNT).floor() as i64);
        }
        let first = slope(at);
        let then = slope([0, 1, 2].map(|part| at[part] + 1e-6 * first[part]));
        at = [0, 1, 2].map(|part| at[part] + 0.5e-6 * (first[part] + then[part]));
        // Friction stops it; it does not turn it back.
        at[1] = at[1].max(0.0);
    }
    counts
}

fn written(dir: &Path, name: &str, counts: &[i64]) -> String {
    let mut log = "time_ms,count\n".to_string();
    for (row, count) in counts.iter().enumerate() {
        let _ = writeln!(log, "{row},{count}");
    }
    let path = dir.join(name);
    fs::write(&path, log).expect("written");
    path.display().to_string()
}

const FREE: &str = "device.rotor_inertia,device.coulomb_friction";

#[test]
fn a_motor_is_identified_and_predicts_another_log() {
    let dir = scratch("identify");
    let scene = dir.join("motor.toml").display().to_string();
    fs::write(&scene, SCENE).expect("written");
    // The held log begins at another speed, so it has its own scene.
    let log = written(&dir, "log.csv", &counts(60.0));
    written(&dir, "slower.csv", &counts(40.0));
    let slower = dir.join("slower.toml").display().to_string();
    let text = SCENE.replace("60 rad/s", "40 rad/s");
    fs::write(&slower, format!("{text}expect.recording = {{ file = \"slower.csv\" }}\n")).expect("written");
    let out = dir.join("out").display().to_string();
    let output = run(&["identify", &scene, &log, "--free", FREE, "--held", &slower, "-o", &out, "--json"]);
    let said = json(&output);
    assert_eq!((code(&output), &said["explained"]), (0, &true.into()), "{said}");
    for (key, truth) in said["keys"].as_array().expect("keys").iter().zip([MOTOR[3], MOTOR[4]]) {
        let number = |name: &str| key[name].as_f64().expect("a number");
        assert!(number("low") < truth && truth < number("high"), "{key}");
        assert!((number("value") / truth - 1.0).abs() < 0.01, "{key}");
    }
    // Even rounding is all that is left: 0.29 counts.
    for log in said["logs"].as_array().expect("logs") {
        assert!(log["rms_counts"].as_f64().expect("a number") < 0.4, "{log}");
    }
    let found = fs::read_to_string(dir.join("out/identified.toml")).expect("the scene");
    assert!(
        found.starts_with("# Identified by: hpu identify ") && found.contains("# device.rotor_inertia = "),
        "{found}"
    );
    let again = dir.join("out/identified.toml").display().to_string();
    let off = json(&run(&["run", &again, "--against", &log, "--json"]))["log"]["rms_counts"].clone();
    assert!(off.as_f64().expect("a number") < 0.6, "{off}");
    let page = fs::read_to_string(dir.join("out/identify.html")).expect("the report");
    assert_eq!(page.matches("data:image/svg+xml").count(), 2);
}

#[test]
fn a_log_that_the_scene_does_not_explain_is_rejected_with_its_window() {
    let dir = scratch("identify-touched");
    let scene = dir.join("motor.toml").display().to_string();
    fs::write(&scene, SCENE).expect("written");
    let (mut touched, free) = (counts(60.0), counts(60.0));
    touched[40..80].iter_mut().for_each(|count| *count -= 15);
    let [log, held] = [("log.csv", free), ("touched.csv", touched)].map(|(name, counts)| written(&dir, name, &counts));
    let output = run(&["identify", &scene, &log, "--free", FREE, "--held", &held]);
    let page = stdout(&output);
    assert!(code(&output) == 1 && page.contains("touched.csv: REJECTED") && page.contains("from 0.0400 s"), "{page}");
}

#[test]
fn what_cannot_be_identified_is_refused_with_its_reason() {
    let dir = scratch("identify-bad");
    let scene = dir.join("motor.toml").display().to_string();
    fs::write(&scene, SCENE).expect("written");
    let log = written(&dir, "log.csv", &counts(60.0));
    let refused = |exit: i32, words: &[&str], said: &str| {
        assert_refused(&run(&[&["identify", &scene], words].concat()), exit, &[said]);
    };
    let key = "device.coulomb_friction";
    refused(2, &["--free", key], "no log; name one behind the scene");
    refused(2, &[&log, "--free", "device.coulomb_frction"], "did you mean device.coulomb_friction?");
    refused(2, &[&log, "--free", "device.coulomb_friction,device.coulomb_friction"], "twice");
    refused(4, &[&log, "--free", "device.viscous_friction"], "starts at 0");
    refused(4, &[&log, "--free", "wall.position"], "wall.position has no effect on the runs");
    refused(4, &["/nowhere.csv", "--free", key], "cannot read `/nowhere.csv`");
    // An encoder with a fourth of the lines, its counts taken times 4.
    let mut fourth = "time_ms,count\n".to_string();
    (0..20).for_each(|row| _ = writeln!(fourth, "{row},{}", 4 * (5 * row - row * row / 10)));
    for (name, rows, said) in [
        ("again.csv", "time_ms,count\n1,0\n2,0\n2,1\n", "again.csv:4: time must increase"),
        ("back.csv", "time_ms,count\n1,0\n3,0\n2,1\n", "back.csv:4: time must increase"),
        ("half.csv", "time_ms,count\n1,0\n2,19.5\n", "half.csv:3: `19.5` is not a count; write a whole number"),
        ("none.csv", "time_ms,count\n1,0\n2,nan\n", "none.csv:3: "),
        ("units.csv", "time_h,angle_mm\n1,0\n2,19\n", "units.csv:1: "),
        ("fourth.csv", &fourth, "all 20 counts are 4 apart, or a multiple of it"),
        ("few.csv", "time_ms,count\n1,19\n", "1 rows for 1 keys"),
        ("unit.csv", "time_ms,angle_rad\n0,0\n10,31\n20,57\n30,77\n40,93\n50,105\n", "times as far as the run"),
    ] {
        fs::write(dir.join(name), rows).expect("written");
        refused(4, &[&dir.join(name).display().to_string(), "--free", key], said);
    }
}

#[test]
fn positions_between_counts_are_none_of_a_counter() {
    let dir = scratch("identify-between");
    let scene = dir.join("motor.toml").display().to_string();
    fs::write(&scene, format!("{SCENE}expect.recording = {{ file = \"log.csv\", column = \"position\" }}\n"))
        .expect("written");
    let mut log = "time_ms,angle_rad\n".to_string();
    counts(60.0).iter().zip(0..).for_each(|(count, row)| _ = writeln!(log, "{row},{}", (*count as f64 + 0.5) * COUNT));
    fs::write(dir.join("log.csv"), log).expect("written");
    let output = run(&["identify", &scene, "--free", "device.coulomb_friction"]);
    assert_refused(&output, 4, &["counts at 0.000000 s of the run; a counter has whole counts"]);
}

#[test]
fn a_clock_that_drifts_is_told() {
    let dir = scratch("identify-drift");
    let scene = dir.join("motor.toml").display().to_string();
    let recording = "expect.recording = { file = \"log.csv\", shift = 20, step = \"500 us\" }";
    fs::write(&scene, format!("{SCENE}{recording}\n")).expect("written");
    // A clock that is 10 % fast: the later a row, the sooner it lies in the run.
    let mut log = "time_ms,count\n".to_string();
    for (count, row) in counts(60.0).iter().zip(0..) {
        _ = writeln!(log, "{},{count}", 1.1 * f64::from(row));
    }
    fs::write(dir.join("log.csv"), log).expect("written");
    let said = stdout(&run(&["identify", &scene, "--free", "device.resistance"]));
    assert!(said.contains("for its second: a clock drifts"), "{said}");
}

#[test]
fn a_gap_in_a_log_is_told() {
    let dir = scratch("identify-gap");
    let scene = dir.join("motor.toml").display().to_string();
    fs::write(&scene, SCENE).expect("written");
    let mut log = "time_ms,count\n".to_string();
    for (row, count) in counts(60.0).iter().enumerate().filter(|(row, _)| !(30..40).contains(row)) {
        let _ = writeln!(log, "{row},{count}");
    }
    let path = dir.join("gap.csv");
    fs::write(&path, log).expect("written");
    let output = run(&["identify", &scene, &path.display().to_string(), "--free", "device.coulomb_friction"]);
    let said = stdout(&output);
    assert!(said.contains("gap.csv: a gap of 0.011000 s behind row 30"), "{said}");
    let value: Value = json(&run(&["identify", &scene, &path.display().to_string(), "--free", FREE, "--json"]));
    assert_eq!(value["keys"][0]["key"], "device.rotor_inertia");
}

/// Writes the scene of EPFL's paddle for each of its three logs of steps, with the gains and the start of each.
fn paddles(dir: &Path) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the project");
    let scene = fs::read_to_string(root.join("testbench/scenes/epfl-paddle-step.toml")).expect("the scene");
    let logs = [("p05-d0003", "-0.186"), ("p05-d0008", "0.342"), ("p01-d0003", "-0.222")];
    let written = logs.map(|(log, start)| {
        let (kp, kd) = (&log[1..3], &log[5..]);
        let text = scene
            .replace("../recordings", &root.join("testbench/recordings").display().to_string())
            .replace("step-p05-d0003", &format!("step-{log}"))
            .replace("\"-0.186 deg\"", &format!("\"{start} deg\""))
            .replace("\"0.05 N.m/deg\"", &format!("\"0.{kp} N.m/deg\""))
            .replace("\"0.0003 N.m.s/deg\"", &format!("\"0.{kd} N.m.s/deg\""));
        assert!(text.contains(start) && text.contains(&format!("0.{kd} N.m.s/deg")));
        let path = dir.join(format!("{log}.toml"));
        fs::write(&path, text).expect("written");
        path.display().to_string()
    });
    written.to_vec()
}

/// Identifies inertia and friction of the paddle, and one key more. Returns for each key its value and its interval,
/// whose missing side is infinite.
fn of_paddle(scenes: &[String], key: Option<&str>, set: &[&str]) -> Vec<[f64; 3]> {
    let body = |key: &str| format!("device.bodies.paddle.{key}");
    let keys = [Some(body("inertia")), Some(body("coulomb_friction")), key.map(String::from)];
    let free = keys.into_iter().flatten().collect::<Vec<_>>().join(",");
    let logs: Vec<&str> = scenes.iter().map(String::as_str).collect();
    let options = ["--free", &free, "--json", "--set", "model.bridge=averaged"];
    let words = [&["identify", logs[0]], &*logs, &options, set].concat();
    let said = json(&run(&words));
    let number = |key: &Value, name: &str, other: f64| key[name].as_f64().unwrap_or(other);
    let row = |key: &Value| {
        [number(key, "value", f64::NAN), number(key, "low", f64::NEG_INFINITY), number(key, "high", f64::INFINITY)]
    };
    said["keys"].as_array().expect("keys").iter().map(row).collect()
}

/// Inertia and friction are those of a search with another simulator (steps of 1 us, Gauss and Newton), within its
/// intervals: 5.353 +- 0.025 in 1e-4 kg.m2, and 0.693 +- 0.010 mN.m at the motor.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn three_logs_of_the_paddle_tell_its_inertia_and_friction() {
    let scenes = paddles(&scratch("identify-paddle"));
    let found = of_paddle(&scenes, None, &[]);
    assert!((found[0][0] - 5.353e-4).abs() < 0.025e-4, "{found:?}");
    assert!((found[1][0] / 15.0 - 0.693e-3).abs() < 0.010e-3, "{found:?}");
}

/// Each further key beside inertia and friction; for the table of the page.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn three_logs_of_the_paddle_tell_its_other_keys_or_one_side_of_them() {
    let scenes = paddles(&scratch("identify-paddle-keys"));
    let zero = ["--set", "method.zero=exact", "--set", "device.sensors.current.offset=4.83 mA"];
    println!("{:40}{:>14}{:>14}{:>14}", "key, with inertia and friction", "value", "from", "to");
    for (key, set, accepted) in [
        // The half code of a converter that rounds down is in the offset.
        ("device.sensors.current.offset", &zero[..], 4.87e-3..5.51e-3),
        ("device.bodies.paddle.return_spring", &[], 0.0147..0.0183),
        ("device.drive.resistance", &[], 9.5..12.0),
        ("device.drive.inductance", &[], 0.3e-3..1.5e-3),
        ("method.current_share", &[], 0.045..0.052),
        ("method.integral_limit", &[], 5.0..100.0),
        ("device.bodies.paddle.viscous_friction", &[], 0.0..8e-4),
    ] {
        let [value, low, high] = of_paddle(&scenes, Some(key), set)[2];
        println!("{key:40}{value:14.5}{low:14.5}{high:14.5}");
        assert!(accepted.contains(&value), "{key}: {value} {low} {high}");
    }
}
