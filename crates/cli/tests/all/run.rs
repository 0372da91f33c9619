//! `hpu run`, `hpu scenes`, `hpu limits`: the shapes of the JSON, names, overrides, expectations.

use std::fs;

use crate::common::{ROOT, code, json, names, run, scratch, stderr, stdout, text};

#[test]
fn the_json_of_a_run_has_the_keys_of_the_contract() {
    let output = run(&["run", "wrap-product", "--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value = json(&output);
    assert_eq!(value["scene"], "wrap-product");
    assert_eq!(value["driver"], "events");
    let kinds = ["settled", "limit_cycle", "diverged"];
    assert!(kinds.contains(&value["outcome"]["kind"].as_str().expect("a kind")));
    for key in ["motion_s", "wall_s", "edges_per_s", "activity"] {
        assert!(value[key].as_f64().is_some_and(|number| number > 0.0), "{key}: {}", value[key]);
    }
    for key in ["edges", "events"] {
        assert!(value[key].as_u64().is_some_and(|number| number > 0), "{key}: {}", value[key]);
    }
    // The clock is exactly 50 MHz.
    assert_eq!(value["edges"].as_f64(), value["motion_s"].as_f64().map(|motion_s| (motion_s * 50e6).round()));
    let energy = |key: &str| value["energy"][key].as_f64().unwrap_or_else(|| panic!("energy.{key}"));
    let residual_j = energy("supplied_j") - energy("stored_j") - energy("dissipated_j");
    // Reading a number from JSON may be off by its last bit.
    assert!((residual_j - energy("residual_j")).abs() <= 4.0 * f64::EPSILON * energy("exchanged_j"));
    assert_eq!(value["files"], serde_json::json!([]));
    let signals = value["signals"].as_array().expect("signals");
    let spring = signals.iter().find(|signal| signal["name"] == "spring").expect("the spring's product");
    assert_eq!(spring["format"], serde_json::json!([0, 12, 0]));
    assert!(spring["overflowed"].as_u64().is_some_and(|edges| edges > 0), "the product wraps: {spring}");
    assert_eq!(spring["rounded"], 0);
    assert!(spring["max"].as_f64().is_some_and(|most| most <= 4095.0), "{spring}");
}

#[test]
fn a_recording_has_edges_and_no_outcome() {
    let value = json(&run(&["run", "replay-capture", "--json"]));
    assert!(value["outcome"].is_null());
    assert!(value["encoder_edges"].as_u64().is_some_and(|edges| edges > 0));
}

#[test]
fn every_driver_tells_the_same_run() {
    let told = |driver: &str| {
        let mut value = json(&run(&["run", "wrap-product", "--driver", driver, "--edges", "30000", "--json"]));
        for key in ["driver", "wall_s", "edges_per_s", "events", "activity", "ticks", "rtl", "trace"] {
            value[key].take();
        }
        value
    };
    assert_eq!(told("events"), told("clock"));
    assert_eq!(told("events"), told("rtl"));
}

#[test]
fn a_scene_runs_by_its_path_as_by_its_name() {
    let outcome = |scene: &str| json(&run(&["run", scene, "--json"]))["outcome"].clone();
    assert_eq!(outcome("testbench/scenes/free-motion.toml"), outcome("free-motion"));
}

#[test]
fn the_shipped_scenes_are_those_in_the_folder_one_line_each() {
    let mut expected: Vec<_> = names(format!("{ROOT}/testbench/scenes").as_ref())
        .into_iter()
        .filter_map(|name| name.strip_suffix(".toml").map(str::to_string))
        .collect();
    let said = stdout(&run(&["scenes"]));
    let mut listed: Vec<_> = said.lines().map(|line| line.split(' ').next().expect("a name").to_string()).collect();
    listed.sort();
    expected.sort();
    assert_eq!(listed, expected);
    let rows = json(&run(&["scenes", "--json"]))["scenes"].as_array().expect("scenes").len();
    assert_eq!(rows, expected.len());
}

#[test]
fn an_override_changes_the_word_that_is_computed_of_it() {
    // A count is 2 pi / 4096, and a PWM count is 24 V * 25.9 mN.m/A / 2.3457 Ohm / 4096. So 2 N.m/rad are 47.42 PWM
    // counts a count.
    let value = json(&run(&["run", "hybrid-wall", "--set", "wall.stiffness=2", "--edges", "10", "--json"]));
    let signals = value["signals"].as_array().expect("signals").clone();
    let stiffness = signals.iter().find(|signal| signal["name"] == "stiffness").expect("a stiffness");
    assert_eq!((stiffness["min"].as_f64(), stiffness["max"].as_f64()), (Some(47.0), Some(47.0)));
}

#[test]
fn an_unmet_expectation_is_exit_code_1_and_is_shown() {
    let output = run(&["run", "free-motion", "--set", "expect={ outcome = \"diverged\" }"]);
    assert_eq!(code(&output), 1);
    assert!(stdout(&output).contains("outcome diverged: NOT MET"), "{}", stdout(&output));
    let expect = "expect={ peak_angle = { value = 0, tolerance = \"1 urad\" } }";
    let output = run(&["run", "free-motion", "--set", expect, "--json"]);
    assert_eq!(code(&output), 1);
    assert_eq!(json(&output)["expected"][0]["met"], false);
    // A part of the run is not judged.
    let expect = "expect={ outcome = \"diverged\" }";
    assert_eq!(code(&run(&["run", "free-motion", "--edges", "1000", "--set", expect])), 0);
}

#[test]
fn expectations_are_of_the_scene_as_written_unless_they_are_asked_for() {
    let changed = ["run", "hybrid-wall", "--set", "wall.stiffness=2.5", "--set", "method.pwm.bits=10"];
    let output = run(&changed);
    assert_eq!(code(&output), 0, "{}", stdout(&output));
    let said = stdout(&output);
    assert!(said.contains("expected   not judged: they are of the scene as written, and --set changes it"), "{said}");
    let value = json(&run(&[&changed[..], &["--json"]].concat()));
    assert_eq!(value["expected"], serde_json::json!([]));
    assert!(value["expected_not_judged"].as_str().is_some_and(|why| why.contains("--expect")), "{value}");
    // With `--expect` the expectations are judged. At a stiffer wall the hand comes to rest 17 mrad earlier.
    let asked = run(&[&changed[..], &["--expect"]].concat());
    assert_eq!(code(&asked), 1);
    assert!(stdout(&asked).contains("1.5333 rad, NOT MET"), "{}", stdout(&asked));
    // The scene as written is judged, and so is a scene with changes that do not change the run.
    for set in [&[][..], &["--set", "accuracy.within=2%"]] {
        let value = json(&run(&[&["run", "hybrid-wall", "--json"], set].concat()));
        assert_eq!(value["expected"].as_array().map(Vec::len), Some(2));
        assert_eq!(value["expected_not_judged"], serde_json::Value::Null);
    }
    // For a scene without expectations, none are mentioned.
    let none = run(&["run", "hybrid-wall", "--set", "expect={}", "--set", "wall.stiffness=2.5"]);
    assert!(!stdout(&none).contains("expected"), "{}", stdout(&none));
}

#[test]
fn the_trace_has_units_in_its_header_and_a_row_an_interval() {
    let dir = scratch("trace");
    let out = dir.join("out");
    let arguments = ["run", "hybrid-wall", "--set", "run.duration=50 ms", "--no-plot", "-o", text(&out)];
    assert_eq!(code(&run(&arguments)), 0);
    let trace = fs::read_to_string(out.join("trace.csv")).expect("a trace");
    let mut lines = trace.lines();
    let header = lines.next().expect("a header");
    assert!(header.starts_with("time_s,current_a,speed_rad_per_s,angle_rad,torque_nm,current_mean_a,"), "{header}");
    assert!(header.ends_with(",command_pwm_count"), "{header}");
    let columns = header.split(',').count();
    let times: Vec<_> = lines
        .map(|line| {
            assert_eq!(line.split(',').count(), columns, "{line}");
            line.split(',').next().expect("a time").parse::<f64>().expect("a number")
        })
        .collect();
    // 10 kHz over 50 ms, both ends included.
    assert_eq!(times.len(), 501);
    assert!(times.iter().enumerate().all(|(row, time_s)| (time_s - row as f64 * 1e-4).abs() < 1e-12));
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("summary.json")).expect("a summary")).expect("JSON");
    assert_eq!(summary["files"].as_array().expect("files").len(), names(&out).len());
    let told: Vec<_> = summary["trace"]["columns"].as_array().expect("columns").iter().map(|c| &c["name"]).collect();
    assert_eq!(told, header.split(',').collect::<Vec<_>>());
    assert!(header.split(',').all(|name| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')), "{header}");
}

#[test]
fn a_wall_pushes_back_with_a_negative_torque_in_every_column() {
    let dir = scratch("signs");
    let out = dir.join("out");
    let leaning = ["--set", "device.initial_angle=1.55 rad", "--set", "hand.path=[[0, 1.8]]"];
    let arguments = ["run", "hybrid-wall", "--set", "run.duration=20 ms", "--no-plot", "--vcd", "-o", text(&out)];
    assert!(code(&run(&[&arguments[..], &leaning].concat())) <= 1, "the expectations are those of the whole scene");
    let trace = fs::read_to_string(out.join("trace.csv")).expect("a trace");
    let (names, last) = (trace.lines().next().expect("a header"), trace.lines().last().expect("rows"));
    let of = |name: &str| -> f64 {
        let at = names.split(',').position(|other| other == name).unwrap_or_else(|| panic!("{name} in {names}"));
        last.split(',').nth(at).expect("a value").parse().expect("a number")
    };
    for name in ["torque_mean_nm", "torque_least_nm", "torque_greatest_nm", "wall_torque_nm"] {
        assert!(of(name) < 0.0, "{name}: {last}");
    }
    for name in ["hand_torque_nm", "command_pwm_count", "penetration_count", "hand_angle_rad"] {
        assert!(of(name) > 0.0, "{name}: {last}");
    }
    let waves = fs::read_to_string(out.join("wave.vcd")).expect("a waveform");
    assert!(waves.contains("torques and forces are positive along the positive direction"), "{}", &waves[..400]);
}

#[test]
fn pictures_come_as_svg_and_as_png_and_tell_the_command_that_made_them() {
    let dir = scratch("pictures");
    let out = dir.join("out");
    let output = run(&["run", "wrap-product", "--beside", "wrap-saturated", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    for name in ["position", "torque", "bits", "side-by-side"] {
        let svg = fs::read_to_string(out.join(format!("{name}.svg"))).expect("a picture");
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{name}");
        // The command without the folder of this test.
        let command = "hpu run wrap-product -o out";
        assert!(svg.contains(command), "{name} does not say `{command}`");
        let png = fs::read(out.join(format!("{name}.png"))).expect("a picture");
        assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n", "{name}");
    }
    // A recording has no motion to draw.
    let out = dir.join("recording");
    assert_eq!(code(&run(&["run", "replay-capture", "-o", text(&out)])), 0);
    assert!(out.join("bits.svg").exists() && !out.join("position.svg").exists());
}

#[test]
fn a_comparison_of_drivers_prints_edges_and_mismatches() {
    let output = run(&["run", "wrap-product", "--compare", "--edges", "200000"]);
    assert_eq!(code(&output), 0);
    assert!(stdout(&output).contains("200000 edges, 0 mismatches"), "{}", stdout(&output));
    let value = json(&run(&["run", "wrap-product", "--compare", "--edges", "1000", "--json"]));
    assert_eq!((&value["edges"], &value["mismatches"]), (&1000.into(), &0.into()));
}

#[test]
fn the_json_of_limits_has_the_keys_of_the_contract() {
    let pushed = "hand={ kind = \"constant_torque\", torque = 0.02 }";
    let range = ["--range", "0.5..4 N.m/rad", "--phases", "2"];
    let shown = ["limits", "hybrid-wall", "--set", "wall.damping=0", "--set", pushed, "--json"];
    let output = run(&[&shown[..], &range].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value = json(&output);
    // The published limit of this motor, which is due to the inductance of its winding.
    let stable = &value["linear"]["stable"];
    assert_eq!(
        (stable.as_array().map(Vec::len), &stable[0]["from"]),
        (Some(1), &serde_json::json!({ "at": 0.5, "beyond": null }))
    );
    for end in ["at", "beyond"] {
        let limit = stable[0]["to"][end].as_f64().expect("a limit");
        assert!((limit - 2.981_951_18).abs() < 1e-8, "{limit}");
    }
    assert_eq!(
        (&value["linear"]["unit"], &value["linear"]["open"]),
        (&serde_json::json!("N.m/rad"), &serde_json::json!([]))
    );
    assert_eq!(value["range"], serde_json::json!([0.5, 4.0]));
    for criterion in value["criteria"].as_array().expect("criteria") {
        assert!(criterion["name"].is_string() && criterion["limit"].is_number() && criterion["unit"].is_string());
        assert!(criterion["assumptions_met"].is_boolean());
        let not_met = criterion["not_met"].as_array().expect("those not met").len();
        assert_eq!(not_met == 0, criterion["assumptions_met"] == true, "{criterion}");
    }
    // The set in words stands beside it. A word is 265 mN.m / 4096 for 2 pi / 4096 rad.
    let words = &value["words"];
    assert!((words["word"].as_f64().expect("a word") - 0.042_176).abs() < 1e-5, "{words}");
    let number = |key: &str| words[key].as_f64().unwrap_or_else(|| panic!("{key}: {words}"));
    assert!(number("all_up_to") < number("lowest_failed") && number("highest_settled") < 3.0, "{words}");
    let seen = words["seen"].as_array().expect("stiffnesses").len();
    assert_eq!((&words["phases"], &words["runs"]), (&serde_json::json!(2), &serde_json::json!(2 * seen)));
    assert!(value["words_reason"].is_null());
    // Without friction the criterion of a fall does not apply.
    let silent = value["silent"].as_array().expect("silent criteria");
    assert!(silent.iter().any(|criterion| criterion["name"] == "drop_threshold" && criterion["reason"].is_string()));
}

#[test]
fn limits_print_each_assumption_once_and_mark_those_that_the_scene_does_not_meet() {
    let output = run(&["limits", "prescribed-sweep"]);
    let text = stdout(&output);
    assert!(text.contains("in words                  the hand imposes the motion"), "{text}");
    assert_eq!(text.matches("  no Coulomb friction\n").count(), 1, "{text}");
    let unmet = |line: &&str| line.starts_with('!') && line.contains("a hand that is absent");
    assert_eq!(text.lines().filter(unmet).count(), 1, "{text}");
    assert!(text.contains("; here: the hand imposes the motion\n"), "{text}");
}

#[test]
fn limits_say_of_each_criterion_how_many_assumptions_are_met_and_what_the_scene_has_instead() {
    let output = run(&["limits", "conventional-wall-1khz", "--range", "0.3..0.5", "--phases", "1"]);
    let text = stdout(&output);
    // Colgate and Schenkel's six assumptions: the spring is sampled (met), the drive is a motor's, the modulator waits
    // longer than a hundredth of a sample, the law is in words, there is no friction (met), the hand is a spring and
    // damper (met).
    let row = text.lines().find(|line| line.starts_with("colgate_schenkel")).expect("its row");
    assert_eq!(row.split_once("N.m/rad").expect("a unit").1.split_whitespace().next(), Some("3"), "{row}");
    assert!(row.contains(" 3 of 6 "), "{row}");
    assert!(!text.contains(" NO "), "{text}");
    for (wanted, came) in [
        ("a spring that is not sampled", "sampled every 0.001 s"),
        ("a rigid body driven by an ideal force or current", "a motor with a winding, behind a bridge"),
        ("a wall without damping", "0.0001 N.m.s/rad"),
        ("pulling as well as pushing", "conventional in words"),
    ] {
        let told =
            |line: &str| line.starts_with('!') && line.contains(wanted) && line.ends_with(&format!("; here: {came}"));
        assert!(text.lines().any(told), "{wanted}: {text}");
    }
    let met = text.lines().filter(|line| line.starts_with(' ') && line.contains("; here: "));
    assert_eq!(met.count(), 0, "{text}");
}

#[test]
fn limits_say_what_linear_loop_and_ripple_leave_out() {
    let page = |scene: &str, set: &[&str]| {
        let sets: Vec<_> = set.iter().flat_map(|set| ["--set", set]).collect();
        let few = ["limits", scene, "--range", "0.2..0.25", "--words", "2", "--phases", "1"];
        stdout(&run(&[&few[..], &sets].concat()))
    };
    let (ripple, friction) = ("alone one count rms or more", "without the device's Coulomb friction");
    // A sample a period of the modulator: the loop repeats at once, and its proof takes no time.
    let each = "method.sample_rate=762.939453125";
    let text = page("slow-pwm", &[each]);
    assert!(text.contains(ripple) && text.contains("no wall settles there") && !text.contains(friction), "{text}");
    // Friction of 10 mN.m holds the wheel against a part of the ripple: walls up to 0.227 N.m/rad settle at all phases.
    let text = page("slow-pwm", &[each, "device.coulomb_friction=10 mN.m"]);
    assert!(text.contains(ripple) && !text.contains("no wall settles there") && text.contains(friction), "{text}");
    let text = page("slow-pwm", &[each, "device.coulomb_friction=10 mN.m", "model.friction=none"]);
    assert!(text.contains("no wall settles there") && !text.contains(friction), "{text}");
    // One unit of the format is 4.2176e-5 N.m.s/rad.
    let text = page("hybrid-wall", &["wall.damping=6e-5", "method.damping_format=(0,12,0)"]);
    assert!(text.contains("wall.damping misses what is asked for by -29.7"), "{text}");
    let text = page("hybrid-wall", &["wall.ramp.stiffness=1", "wall.ramp.from=0.1", "wall.ramp.to=0.3"]);
    assert!(text.contains("a stiffness is that before the ramp") && !text.contains("proved"), "{text}");
}

#[test]
fn the_table_of_nets_stays_aligned_whatever_the_words_hold() {
    let output = run(&["run", "phantom-thrown", "--edges", "1000000"]);
    let text = stdout(&output);
    let head = text.lines().find(|line| line.contains("overflowed  unit")).expect("a head");
    let [min, max, unit] = ["min ", "max ", "unit"].map(|name| head.find(name).expect("a column"));
    let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("net ")).collect();
    // Words with 22 fraction bits need more digits than a column is wide.
    assert!(
        rows.iter().any(|row| row.contains("e-05") || row.split_whitespace().any(|cell| cell.len() > 18)),
        "{text}"
    );
    for row in rows {
        // Numbers end where their heads end, and the unit begins below its own head.
        for end in [min + 3, max + 3] {
            assert!(row.as_bytes()[end - 1].is_ascii_digit() && row.as_bytes()[end] == b' ', "{row}\n{head}");
        }
        assert!(row.as_bytes()[unit - 1] == b' ' && row.as_bytes()[unit] != b' ', "{row}\n{head}");
    }
}

#[test]
fn a_scene_runs_by_the_solver_that_its_model_names() {
    let told = |sets: &[&str]| {
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let output = run(&[&["run", "rail-drop", "--edges", "5000000", "--json"][..], &sets].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let value = json(&output);
        ["driver", "solver", "steps"].map(|key| value[key].to_string())
    };
    let words = ["model.solver=rk4", "model.step=1 us"];
    assert_eq!(told(&["model.solver=clock"]), ["\"clock\"", "\"clock\"", "0"]);
    assert_eq!(told(&words), ["\"events\"", "\"rk4\"", "100000"]);
    assert_eq!(told(&[&words[..], &["model.datapath=law"]].concat()), ["\"rk4\"", "\"rk4\"", "100001"]);
}

#[test]
fn a_law_in_steps_has_no_driver_to_choose_and_none_to_compare() {
    for arguments in [&["--driver", "clock"][..], &["--compare"]] {
        let law = ["run", "rail-drop", "--set", "model.datapath=law", "--set", "model.solver=sample"];
        let output = run(&[&law[..], arguments].concat());
        assert_eq!(code(&output), 2);
        assert!(stderr(&output).contains("leave out --driver and --compare"), "{}", stderr(&output));
    }
}

#[test]
fn a_law_in_steps_leaves_its_trace_and_its_motion_and_no_bits() {
    let out = scratch("law-in-steps").join("out");
    let law = ["--set", "model.datapath=law", "--set", "model.solver=rk4", "--set", "model.step=10 us"];
    let output = run(&[&["run", "rail-drop", "--edges", "5000000", "--vcd", "-o", text(&out)][..], &law].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let written = names(&out);
    assert!(written.iter().any(|name| name == "position.svg"), "{written:?}");
    assert!(written.iter().all(|name| name != "bits.svg"), "{written:?}");
    // 0.1 s at 10 kHz, both ends included.
    let trace = fs::read_to_string(out.join("trace.csv")).expect("a trace");
    assert_eq!(trace.lines().count(), 1 + 1_001);
}

#[test]
fn a_step_longer_than_what_is_run_of_it_is_run_in_part() {
    let set =
        ["run", "hybrid-wall", "--set", "model.solver=sample", "--set", "model.bridge=averaged", "--edges", "1000"];
    let output = run(&set);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}
