//! A run beside a log: a motion that is known in closed form, and logs of it made here, shifted and with errors of a
//! known size.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::{assert_refused, code, json, run, scratch, stdout};

/// One step of the log, in s: 17 550 clock cycles.
const STEP_S: f64 = 351e-6;

/// The motion of `prescribed-sweep`: one radian a second forth and back.
fn path(time_s: f64) -> f64 {
    1.4 + time_s.min(1.0 - time_s)
}

/// Returns a log of every second step, which comes three steps late: whole units of 1e-7 deg, in turn so far above and
/// below the motion.
fn log(error_rad: f64) -> String {
    let mut log = "# a real device\ntick,position_1e7deg,torque\n".to_string();
    for row in 0..1400 {
        let time_s = f64::from(2 * row + 3) * STEP_S;
        let angle = path(time_s) + if row % 2 == 0 { error_rad } else { -error_rad };
        let _ = writeln!(log, "{},{:.0},7", 5000 + 2 * row, 1e7 * angle.to_degrees());
    }
    log
}

/// The scene with a log in the place of its expectations.
fn scene(dir: &Path, name: &str, recording: &str) -> String {
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testbench/scenes/prescribed-sweep.toml");
    let shipped = fs::read_to_string(shipped).expect("the shipped scene");
    let scene = &shipped[..shipped.find("[expect]").expect("its last section")];
    let file = dir.join(name);
    fs::write(&file, format!("{scene}[expect.recording]\n{recording}\n")).expect("written");
    file.display().to_string()
}

const COLUMNS: &str = "time = \"tick [351 us]\", angle = \"position_1e7deg [1e-7 deg]\"";

fn held(scene: &str, more: &[&str]) -> (i32, Value) {
    let output = run(&[&["run", scene, "--json"], more].concat());
    (code(&output), json(&output)["log"].clone())
}

#[test]
fn a_log_is_found_at_its_shift_and_its_error_is_the_one_it_was_made_with() {
    let dir = scratch("against");
    fs::write(dir.join("log.csv"), log(1e-3)).expect("written");
    let recording = |rms: &str| {
        format!("file = {{ path = \"log.csv\", {COLUMNS} }}\nshift = 8\nstep = \"351 us\"\nrms = \"{rms} mrad\"")
    };
    let near = scene(&dir, "near.toml", &recording("1.001"));
    let (exit, log) = held(&near, &[]);
    assert_eq!((exit, &log["shift"], &log["met"], &log["rows"]), (0, &3.into(), &true.into(), &1396.into()), "{log}");
    // A unit of the log is 1.7e-9 rad.
    assert!((log["rms"].as_f64().expect("a number") - 1e-3).abs() < 2e-9, "{log}");
    assert!((log["greatest"].as_f64().expect("a number") - 1e-3).abs() < 2e-9, "{log}");
    assert!(log["mean"].as_f64().expect("a number").abs() < 2e-9, "{log}");
    // Of a shorter run, the scene's log is not judged, as its other expectations are not.
    assert_eq!(held(&near, &["--edges", "1000"]), (0, Value::Null));
    let far = scene(&dir, "far.toml", &recording("0.999"));
    let (exit, log) = held(&far, &[]);
    assert_eq!((exit, &log["met"]), (1, &false.into()), "{log}");
    // A step is a tick less than the least time between two rows, which is the default: then the shift is missed.
    let coarse = format!("file = {{ path = \"log.csv\", {COLUMNS} }}\nshift = 8");
    let (exit, log) = held(&scene(&dir, "coarse.toml", &coarse), &[]);
    assert_eq!((exit, &log["met"]), (0, &Value::Null), "{log}");
    assert!(log["rms"].as_f64().expect("a number") > 1.04e-3, "{log}");
}

#[test]
fn counts_are_held_beside_the_position_counter_and_a_packed_file_is_read() {
    let dir = scratch("against-counts");
    let count = json(&run(&["run", "prescribed-sweep", "--json"]))["realised"]["count_rad"].as_f64().expect("a number");
    let mut log = "time_ms,count\n".to_string();
    // At no time of these is the position within a nanoradian of a count's end.
    for row in 1..999 {
        let time_s = 1e-3 * f64::from(row) + 123e-9;
        let _ = writeln!(log, "{:.6},{}", 1e3 * time_s, (path(time_s) / count).floor());
    }
    let mut gzip = Command::new("gzip")
        .stdin(Stdio::piped())
        .stdout(fs::File::create(dir.join("log.csv.gz")).expect("made"))
        .spawn()
        .expect("gzip");
    std::io::Write::write_all(&mut gzip.stdin.take().expect("a pipe"), log.as_bytes()).expect("written");
    assert!(gzip.wait().expect("an end").success());
    let file = "file = { path = \"log.csv.gz\", offset = 0 }";
    let counts = scene(&dir, "counts.toml", &format!("{file}\nrms = \"1 nrad\""));
    let (exit, log) = held(&counts, &[]);
    assert_eq!((exit, &log["column"], &log["met"]), (0, &"position".into(), &true.into()), "{log}");
    // Beside the position itself, the middle of a count is off by at most half of it, evenly: rms count / sqrt 12.
    let (_, log) = held(&scene(&dir, "angle.toml", &format!("{file}\ncolumn = \"angle\"")), &[]);
    assert!((log["rms_counts"].as_f64().expect("a number") - 12f64.sqrt().recip()).abs() < 0.01, "{log}");
    // The command's own log, from where it runs, read as the scene says; and beside a scene that names none.
    let path = dir.join("log.csv.gz").display().to_string();
    let other = scene(&dir, "other.toml", "file = { path = \"none.csv\", offset = 0 }\nrms = \"1 nrad\"");
    let (exit, log) = held(&other, &["--against", &path]);
    assert_eq!((exit, &log["met"]), (0, &true.into()), "{log}");
    let drawn = dir.join("drawn").display().to_string();
    let output = run(&["run", "prescribed-sweep", "--against", &path, "-o", &drawn]);
    assert!(code(&output) == 0 && stdout(&output).contains("the run less the log: rms"), "{}", stdout(&output));
    // The picture says the command that draws it.
    let picture = fs::read_to_string(Path::new(&drawn).join("against.svg")).expect("a picture");
    assert!(picture.contains("hpu run prescribed-sweep -o drawn --against log.csv.gz"), "{picture}");
}

#[test]
fn a_log_that_cannot_be_held_is_refused_at_its_line() {
    let dir = scratch("against-bad");
    for (name, rows, recording, said) in [
        ("again.csv", "tick,count\n1,0\n2,0\n2,1\n", "time = \"tick [351 us]\"", "again.csv:4: time must increase"),
        ("back.csv", "tick,count\n3,0\n2,0\n", "time = \"tick [351 us]\"", "back.csv:3: time must increase"),
        ("unit.csv", "tick,count\n1,0\n", "time = \"tick [351 furlong]\"", "no unit of the column"),
        ("half.csv", "tick,count\n1,0.5\n", "time = \"tick [351 us]\"", "half.csv:2: `0.5` is not a count"),
        ("none.csv", "tick,count\n1,0\n", "time = \"tick [351 us]\", from = 9", "the log lasts from"),
    ] {
        fs::write(dir.join(name), rows).expect("written");
        let file = scene(&dir, "bad.toml", &format!("file = {{ path = \"{name}\", {recording} }}"));
        assert_refused(&run(&["run", &file]), 4, &["bad.toml", said]);
    }
    fs::write(dir.join("log.csv"), log(0.0)).expect("written");
    let file = format!("file = {{ path = \"log.csv\", {COLUMNS} }}");
    let unknown = scene(&dir, "unknown.toml", &format!("{file}\ncolumn = \"torque\"\n"));
    assert_refused(
        &run(&["run", &unknown]),
        4,
        &["`torque` is no position; write column as one of angle_rad, reference, step, position"],
    );
    let late = scene(&dir, "late.toml", &format!("file = {{ path = \"log.csv\", {COLUMNS}, offset = \"9 s\" }}"));
    assert_refused(&run(&["run", &late]), 4, &["no row of the log lies in the run"]);
    let wide = scene(&dir, "wide.toml", &format!("{file}\nshift = 100000"));
    assert_refused(&run(&["run", &wide]), 4, &["at most 16777216 together"]);
}
