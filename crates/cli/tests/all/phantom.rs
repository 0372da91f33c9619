//! `hpu` with scenes and blocks of a PHANToM.

use std::fs;
use std::io::Write;
use std::process::Stdio;

use serde_json::Value;

use crate::common::{assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text};

#[test]
fn the_shipped_scenes_of_a_phantom_are_listed_with_their_first_sentence() {
    let said = stdout(&run(&["scenes"]));
    for (name, start) in [
        ("phantom-drop ", "The drop test of Sevcik et al. (2009): the weighted tip"),
        ("phantom-drop-rtos ", "The drop test of phantom-drop on a wall of 10 kN/m"),
        ("phantom-thrown ", "The tip of a Premium 1.0 thrown at a wall 1 mm away: contact within 2 ms"),
        ("phantom-thrown-shared ", "A Premium 1.5 thrown at a wall 1 mm away along z"),
        ("phantom-thrown-rtos ", "The tip of a Premium 1.0 thrown at a wall 1 mm away along x"),
    ] {
        let line = said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {said}"));
        assert!(line[name.len()..].trim_start().starts_with(start), "{line}");
    }
}

#[test]
fn a_run_tells_platform_motion_words_energy_and_whether_it_was_as_expected() {
    let output = run(&["run", "phantom-thrown-rtos"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stdout(&output);
    // 50 MHz / 20 kHz are 2500 clocks; 5 kN/m times 4 are 20000; 1 mm times 2^24 is 16777.2.
    for line in [
        "scene      phantom-thrown-rtos, phantom_io at 50 MHz",
        "outcome    non-passive: rms ",
        "platform   RTOS-20: every 2500 clocks (20 kHz), floating point, commands late by 1 sample",
        "motion     tip ends at x = ",
        "words      stiffness 20000 of (0,16,2) is 5 kN/m, asked 5 kN/m",
        "words      walls at 16777 of (1,0,24): ",
        "energy     dissipated in viscous friction ",
        "expected   outcome non_passive: met",
    ] {
        assert!(said.lines().any(|said| said.starts_with(line)), "`{line}` is not in:\n{said}");
    }
    assert!(!said.contains("copper"), "an arm has no winding: {said}");
    let of = |more: &[&str]| stdout(&run(&[&["run", "phantom-thrown", "--edges", "1000"], more].concat()));
    assert!(of(&[]).contains("FPGA-400: every 125 clocks (400 kHz), the datapath, all in parallel"));
    let shared = of(&["--set", "method.architecture=shared"]);
    assert!(shared.contains("phantom_shared_loop") && shared.contains("the datapath, one multiplier"), "{shared}");
    assert!(of(&["--set", "model.law=ideal"]).contains("the law in floats on the true position"));
}

#[test]
fn the_json_of_a_run_has_the_keys_of_the_contract() {
    let output = run(&["run", "phantom-thrown", "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value = json(&output);
    assert_eq!((&value["scene"], &value["driver"]), (&"phantom-thrown".into(), &"events".into()));
    assert_eq!((&value["complete"], &value["aborted"]), (&true.into(), &serde_json::Value::Null));
    assert_eq!(value["outcome"]["kind"], "non_passive");
    assert!(value["outcome"]["rms_m"].as_f64().is_some_and(|rms_m| rms_m >= 30e-6), "{}", value["outcome"]);
    // 40 ms at 50 MHz.
    assert_eq!((value["edges"].as_u64(), value["motion_s"].as_f64()), (Some(2_000_000), Some(0.04)));
    for key in ["wall_s", "edges_per_s", "activity", "ticks", "events", "encoder_edges", "output_changes"] {
        assert!(value[key].as_f64().is_some_and(|number| number > 0.0), "{key}: {}", value[key]);
    }
    let energy = |key: &str| value["energy"][key].as_f64().unwrap_or_else(|| panic!("energy.{key}"));
    assert!(energy("residual_j").abs() <= 1e-9 * energy("exchanged_j"));
    for key in ["viscous_j", "coulomb_j", "transmission_j"] {
        assert!(energy(key) > 0.0, "{key}");
    }
    for key in ["copper_j", "diodes_j", "hand_j"] {
        assert_eq!(energy(key), 0.0, "{key}");
    }
    // 0.001 * 2^24 is 16777.216; 5000 N/m and 400 kHz are exact.
    let wall_m = value["realised"]["wall_position_m"].as_f64().expect("a position");
    // Reading a number from JSON may be off by its last bit.
    assert!((wall_m / (16_777.0 / 16_777_216.0) - 1.0).abs() <= f64::EPSILON, "{wall_m}");
    assert_eq!(value["realised"]["stiffness_n_per_m"].as_f64(), Some(5000.0));
    assert_eq!(value["realised"]["sample_rate_hz"].as_f64(), Some(400_000.0));
    let signals = value["signals"].as_array().expect("signals");
    let signal = |name: &str| signals.iter().find(|signal| signal["name"] == name).unwrap_or_else(|| panic!("{name}"));
    assert_eq!(signal("force_y")["format"], serde_json::json!([1, 4, 16]));
    assert_eq!((&signal("x_low")["unit"], &signal("force_y")["unit"]), (&"m".into(), &"N".into()));
    assert_eq!(signal("period")["max"].as_f64(), Some(125.0));
    assert!(signal("contact")["max"].as_f64().is_some_and(|most| most > 0.0));
    assert_eq!(value["expected"], serde_json::json!([{ "name": "outcome", "value": "non_passive", "met": true }]));
}

#[test]
fn a_folder_gets_waves_trace_pictures_and_summary() {
    let out = scratch("phantom-files").join("out");
    let output = run(&["run", "phantom-thrown-rtos", "--vcd", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let expected = [
        "drop.png",
        "drop.svg",
        "force.png",
        "force.svg",
        "summary.json",
        "trace.csv",
        "wave.fst",
        "wave.fst.gtkw",
        "wave.fst.sucl",
        "wave.vcd",
        "wave.vcd.gtkw",
        "wave.vcd.sucl",
    ];
    assert_eq!(names(&out), expected);
    for name in ["drop", "force"] {
        let svg = fs::read_to_string(out.join(format!("{name}.svg"))).expect("a picture");
        assert!(svg.contains("hpu run phantom-thrown-rtos -o "), "{name}");
    }
    let trace = fs::read_to_string(out.join("trace.csv")).expect("a trace");
    let header = trace.lines().next().expect("a header");
    let start = "time_s,tip_x_m,tip_y_m,tip_z_m,logged_x_m,logged_y_m,logged_z_m,torque1_nm,torque2_nm,torque3_nm,";
    assert!(header.starts_with(start), "{header}");
    assert!(header.ends_with("command1_dac_count,command2_dac_count,command3_dac_count"), "{header}");
    // 40 ms at 20 kHz, both ends, and the header.
    assert_eq!(trace.lines().count(), 802);
    let vcd = fs::read_to_string(out.join("wave.vcd")).expect("a waveform");
    for said in ["$scope module phantom_io $end", "$scope module hold $end", "logged_x_m"] {
        assert!(vcd.contains(said), "{said}");
    }
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("summary.json")).expect("a summary")).expect("JSON");
    assert_eq!(summary["files"].as_array().expect("files").len(), expected.len());
}

#[test]
fn drivers_are_compared_and_tell_the_same_run() {
    let output = run(&["run", "phantom-thrown-shared", "--compare", "--edges", "150000"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("150000 edges, 0 mismatches"), "{}", stdout(&output));
    let told = |driver: &str| {
        let mut value = json(&run(&["run", "phantom-thrown", "--driver", driver, "--edges", "20000", "--json"]));
        for key in ["driver", "wall_s", "edges_per_s", "events", "activity", "ticks", "rtl", "trace"] {
            value[key].take();
        }
        value
    };
    assert_eq!(told("events"), told("clock"));
    assert_eq!(told("events"), told("rtl"));
}

/// A throw through a wall that is too soft to stop it, until a joint leaves the tables of sines.
const OUT_OF_THE_TABLES: [&str; 6] =
    ["--set", "room.stiffness=5", "--set", "drop.speed=2 m/s", "--set", "method.depth_bits=9"];

#[test]
fn a_run_that_was_aborted_tells_when_and_why() {
    let arguments = [&["run", "phantom-thrown"][..], &OUT_OF_THE_TABLES].concat();
    let output = run(&[&arguments[..], &["--expect"]].concat());
    assert_eq!(code(&output), 1, "it was expected to be non-passive");
    let said = stdout(&output);
    assert!(said.contains("outcome    highly unstable: aborted at "), "{said}");
    assert!(
        said.contains(": a joint left the tables of sines: the datapath says invalid, torques are zero\n"),
        "{said}"
    );
    assert!(said.contains("outcome non_passive: NOT MET"), "{said}");

    let value = json(&run(&[&arguments[..], &["--json"]].concat()));
    assert_eq!((&value["outcome"]["kind"], &value["complete"]), (&"highly_unstable".into(), &true.into()));
    let at_s = value["aborted"]["at_s"].as_f64().expect("a time");
    assert_eq!(value["outcome"]["at_s"].as_f64(), Some(at_s));
    // 256 counts of 2 pi / 28000 rad times 0.14 m are 8 mm, passed at about 2 m/s.
    assert!((3.9e-3..4.5e-3).contains(&at_s), "{at_s}");
    assert_eq!(value["edges"].as_f64(), Some((at_s * 50e6).round()));
    assert!(value["aborted"]["why"].as_str().is_some_and(|why| why.starts_with("a joint left the tables")));
    // The drivers are compared up to the abort.
    let compared = json(&run(&[&arguments[..], &["--compare", "--json"]].concat()));
    assert_eq!((&compared["edges"], &compared["mismatches"]), (&value["edges"], &0.into()));
}

#[test]
fn two_phantoms_are_not_drawn_side_by_side_and_leave_no_files() {
    let out = scratch("phantom-beside").join("out");
    let output = run(&["run", "phantom-thrown", "--beside", "phantom-thrown-rtos", "-o", text(&out)]);
    assert_refused(&output, 2, &["only scenes of an axis are drawn side by side"]);
    assert!(!out.exists() || names(&out).is_empty(), "{:?}", names(&out));
}

#[test]
fn limits_of_a_phantom_are_refused_with_where_they_are_found() {
    assert_refused(&run(&["limits", "phantom-drop"]), 2, &["limits are those of an axis", "hpu reproduce"]);
}

#[test]
fn a_bad_key_of_a_phantom_is_refused_with_what_is_accepted() {
    let refused = |set: &str, words: &[&str]| assert_refused(&run(&["run", "phantom-drop", "--set", set]), 4, words);
    refused("room.stifness=1", &["--set room.stifness=1", "accepted here: distance, stiffness, walls"]);
    refused("room.distance=30 cm", &["--set room.distance=30 cm", "the links do not reach it; write less"]);
    refused("platform.kind=FPGA-1", &["`FPGA-1` is none of \"PMOS-1\""]);
    refused("model.motor_share=1", &["below 1: the arm has some of the mass"]);
}

/// Ticks a block with a table from stdin.
fn tick(block: &str, table: &str) -> String {
    let mut child = hpu()
        .args(["block", block, "--inputs", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    child.stdin.take().expect("a pipe").write_all(table.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    stdout(&output)
}

/// Reads a row of decimal words.
fn words(row: &str) -> Vec<f64> {
    row.split(',').map(|word| word.parse().expect("a number")).collect()
}

#[test]
fn the_forward_kinematics_of_a_table_are_the_textbooks() {
    let table_of = |postures: &[[f64; 3]]| {
        let mut table = "sine1,cosine1,sine2,cosine2,sine3,cosine3\n".to_string();
        for angles_rad in postures {
            let words = angles_rad.map(|angle_rad: f64| {
                let word = |value: f64| (value * 22f64.exp2()).round();
                format!("{},{}", word(angle_rad.sin()), word(angle_rad.cos()))
            });
            table += &(words.join(",") + "\n");
        }
        table
    };
    let postures = [[0.0, 0.0, 0.0], [0.2, 0.3, 0.5], [-0.7, 0.4, -0.2], [0.1, -0.9, 0.3]];
    let said = tick("phantom_forward", &table_of(&postures));
    let mut lines = said.lines();
    assert_eq!(lines.next(), Some("sine1,cosine1,sine2,cosine2,sine3,cosine3,x,y,z,radius"));
    let mut rows = lines.map(words);
    for [t1, t2, t3] in postures {
        let l = 0.14;
        let radius = l * t2.cos() + l * t3.sin();
        let exact = [t1.sin() * radius, l - l * t3.cos() + l * t2.sin(), t1.cos() * radius - l, radius];
        let row = rows.next().expect("a row");
        for (word, exact) in row[6..].iter().zip(exact) {
            // A sine has an error of half of 2^-22, a length and a sum each of half of 2^-24. So each product with l
            // (or of two such sums) has an error of at most 0.14 * 2^-23 + 2^-25. The bound has two products, the error
            // of the radius, and one rounding.
            let bound =
                4.0 * (0.14 * (-23f64).exp2() + (-25f64).exp2()) + 2.0 * (-25f64).exp2() + 0.28 * (-23f64).exp2();
            assert!((word * (-24f64).exp2() - exact).abs() <= bound, "{word}, {exact}");
        }
    }
    // For the published posture, the tip is published to 8 digits for links of 0.1397 m. It is proportional to the
    // links.
    let published = [0.03982054, 0.05838589, 0.05674087];
    let row = words(said.lines().nth(2).expect("the second posture"));
    for (word, tip) in row[6..9].iter().zip(published) {
        assert!((word * (-24f64).exp2() / 0.14 * 0.1397 - tip).abs() < 3e-7, "{word}, {tip}");
    }
}

#[test]
fn every_block_of_the_phantom_lists_its_ports() {
    for (block, port) in [
        ("trig_table", "cosine"),
        ("sample_register", "count3"),
        ("phantom_forward", "radius"),
        ("cube_room", "contact"),
        ("phantom_torque", "torque2"),
        ("command_scaler", "command"),
        ("command_register", "q1"),
        ("phantom_engine", "force_z"),
        ("phantom_loop", "command3"),
        ("phantom_shared_loop", "stiffness"),
        ("phantom_io", "host2"),
    ] {
        let value = json(&run(&["block", block, "--json"]));
        let ports = value["ports"].as_array().expect("ports");
        assert!(ports.iter().any(|listed| listed["name"] == port), "{block} {port}");
    }
}

#[test]
fn a_summary_says_what_the_named_model_says_and_what_counts_are_worth() {
    let summary =
        |scene: &str, more: &[&str]| json(&run(&[&["run", scene, "--edges", "1000", "--json"], more].concat()));
    let found = summary("phantom-drop", &["--set", "device.forearm=150 mm"]);
    let of = |found: &Value, key: &str| {
        let parameters = found["parameters"].as_array().expect("parameters");
        parameters.iter().find(|parameter| parameter["key"] == key).unwrap_or_else(|| panic!("{key}")).clone()
    };
    assert_eq!(of(&found, "device.upper_arm")["source"], "model premium_1.0");
    assert_eq!(of(&found, "device.forearm")["source"], "--set");
    assert_eq!(of(&found, "method.depth_bits")["unit"], "bit");
    let thrown = summary("popc-held-force", &[]);
    assert_eq!(of(&thrown, "method.energy_bits")["unit"], "bit");
    // Encoders with 4000 counts a turn and motors with 0.17 N.m at 32768 DAC counts, behind gears of 115/15, 7 and 7.
    for (joint, ratio) in [115.0 / 15.0, 7.0, 7.0].into_iter().enumerate() {
        let near = |key: &str, wanted: f64| {
            let value =
                found["realised"][key][joint].as_f64().unwrap_or_else(|| panic!("{key}: {}", found["realised"]));
            assert!((value / wanted - 1.0).abs() < 1e-12, "{key} of joint {joint}: {value}, {wanted}");
        };
        near("count_rad", std::f64::consts::TAU / (4000.0 * ratio));
        near("torque_quantum_nm", 0.17 * ratio / 32768.0);
    }
    assert_eq!(found["realised"]["apparent_mass_kg"], 0.075);
    let said = stdout(&run(&["run", "phantom-drop", "--edges", "1000"]));
    assert!(said.contains("a DAC count is 39.775 uN.m, 36.316 uN.m, 36.316 uN.m; apparent mass 75 g"), "{said}");
}
