//! `hpu new` and `hpu scenes show`: every combination of flags gives a scene that runs and settles, with its keys
//! explained; shown scenes run again; existing files stay.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_refused, code, json, run, scratch, stderr, stdout, text};

/// Returns the keys of a scene, as `hpu scenes show` lists them.
fn keys(scene: &str) -> Vec<Value> {
    json(&run(&["scenes", "show", scene, "--json"]))["keys"].as_array().expect("keys").clone()
}

fn value(keys: &[Value], section: &str, key: &str) -> Value {
    let found = keys.iter().find(|found| found["section"] == section && found["key"] == key);
    found.unwrap_or_else(|| panic!("no {section}.{key}"))["value"].clone()
}

/// Writes a scene with these flags, and runs it to the outcome that it expects.
fn settles(dir: &Path, name: &str, flags: &[&str]) -> Vec<Value> {
    let place = dir.join(name);
    let made = run(&[&["new", text(&place)], flags].concat());
    assert_eq!((code(&made), stderr(&made)), (0, String::new()), "{flags:?}");
    let scene = format!("{}.toml", text(&place));
    assert!(stdout(&made).contains(&format!("wrote {scene}\n")), "{}", stdout(&made));
    let ran = run(&["run", &scene, "--json"]);
    assert_eq!(code(&ran), 0, "{flags:?}: {}", stderr(&ran));
    assert!(!stderr(&ran).contains("note: "), "{flags:?}: {}", stderr(&ran));
    let summary = json(&ran);
    let outcome = summary["outcome"]["kind"].as_str().expect("an outcome");
    assert!(["settled", "passive"].contains(&outcome), "{flags:?}: {outcome}");
    keys(&scene)
}

#[test]
fn every_combination_of_flags_gives_a_scene_that_runs_and_settles() {
    let dir = scratch("new-all");
    let listed = json(&run(&["keys", "method", "--json"]))["keys"].as_array().expect("keys").clone();
    let kind = listed.iter().find(|key| key["key"] == "kind").expect("a kind");
    let methods: Vec<_> = kind["options"].as_array().expect("options").iter().filter_map(Value::as_str).collect();
    assert!(methods.len() >= 7, "{methods:?}");
    let turns = ["400", "4096", "20000"];
    let devices = [("motor", turns), ("mass", ["20000", "50000", "200000"]), ("network", turns)];
    let clocks = [("25 MHz", 25e6), ("50 MHz", 50e6), ("100 MHz", 100e6)];
    for (device, counts) in devices {
        for method in &methods {
            for (counts, (clock, clock_hz)) in counts.into_iter().zip(clocks) {
                let flags = ["--device", device, "--method", method, "--counts", counts, "--clock", clock];
                let keys = settles(&dir, &format!("{device}-{method}-{counts}"), &flags);
                assert_eq!(value(&keys, "method", "kind"), **method);
                assert_eq!(value(&keys, "device", "kind"), device);
                assert_eq!(value(&keys, "clock", "frequency"), clock_hz);
                let counts: f64 = counts.parse().expect("a number");
                let (key, expected) =
                    if device == "mass" { ("resolution", 1.0 / counts) } else { ("lines", counts / 4.0) };
                assert_eq!(value(&keys, "encoder", key).as_f64(), Some(expected));
            }
        }
    }
    settles(&dir, "plain", &[]);
    for clock in ["25 MHz", "100 MHz"] {
        settles(&dir, &format!("arm-{}", &clock[..2]), &["--device", "phantom", "--clock", clock]);
    }
}

/// The design with the encoder that `new` takes by itself is run by the test of README, and by the long test below.
#[test]
fn a_design_to_begin_with_settles_with_any_encoder() {
    let dir = scratch("new-dut");
    settles(&dir, "fine", &["--dut", "--clock", "20 MHz", "--counts", "20000"]);
    assert!(dir.join("fine.vhd").exists());
}

#[test]
fn a_workflow_checks_designs_and_is_not_overwritten() {
    let dir = scratch("new-ci");
    let place = dir.join("haptics");
    let made = run(&["new", text(&place), "--ci"]);
    assert_eq!(stdout(&made), format!("wrote {}.yml\n", text(&place)), "{}", stderr(&made));
    let workflow = fs::read_to_string(dir.join("haptics.yml")).expect("a workflow");
    assert!(workflow.contains("--junit") && workflow.contains("hpu check --entity"));
    assert_refused(&run(&["new", text(&place), "--ci"]), 2, &["haptics.yml is there already"]);
    assert_refused(&run(&["new", text(&place), "--ci", "--dut"]), 2, &["'--ci' cannot be used with '--dut'"]);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_a_design_to_begin_with_expects_fails_where_the_design_does_nothing() {
    let dir = scratch("new-dead-dut");
    settles(&dir, "mine", &["--dut", "--clock", "10 MHz"]);
    let scene = dir.join("mine.toml");
    let dead: [(&str, &[&str]); 4] = [
        ("exchanged lines", &["dut.ports.enc_a=encoder.b", "dut.ports.enc_b=encoder.a"]),
        ("held in reset", &["dut.reset.active=low"]),
        ("no gain", &["dut.ports.gain=0"]),
        ("a wall elsewhere", &["dut.ports.wall_at=100000"]),
    ];
    for (about, set) in dead {
        let set = set.iter().flat_map(|set| ["--set", set]);
        let output = run(&["run", text(&scene), "--json", "--expect"].into_iter().chain(set).collect::<Vec<_>>());
        let found = json(&output);
        assert_eq!((code(&output), found["expected"][0]["met"].as_bool()), (1, Some(false)), "{about}");
        assert_eq!(found["outcome"]["kind"], "no_wall_torque", "{about}");
    }
}

#[test]
fn every_key_stands_below_its_meaning_and_defaults_can_be_made_keys() {
    let dir = scratch("new-text");
    let scene = dir.join("wall.toml");
    assert_eq!(code(&run(&["new", text(&dir.join("wall"))])), 0);
    let written = fs::read_to_string(&scene).expect("a scene");
    assert!(written.lines().all(|line| line.len() <= 120), "{written}");
    let all = keys(text(&scene));
    for key in &all {
        let [name, meaning] = ["key", "meaning"].map(|of| key[of].as_str().expect("a text"));
        let lines = written.lines().filter(|line| line.trim_start_matches("# ").starts_with(&format!("{name} = ")));
        assert!(lines.count() > 0, "{name} is not in {written}");
        let first = meaning.split_whitespace().take(5).collect::<Vec<_>>().join(" ");
        assert!(written.contains(&format!("# {first}")), "{name}: {meaning}");
    }
    // A default without its `#` is the same scene.
    let open: String = written
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(pair)
                if pair
                    .split_once(" = ")
                    .is_some_and(|(key, value)| !key.contains(' ') && !value.starts_with("...")) =>
            {
                format!("{pair}\n")
            }
            _ => format!("{line}\n"),
        })
        .collect();
    assert!(open.matches("\nsupply = ").count() == 1, "{open}");
    fs::write(dir.join("open.toml"), &open).expect("a scene");
    let values = |all: &[Value]| {
        let plain = |key: &Value| (key["section"].clone(), key["key"].clone(), key["value"].clone());
        all.iter().map(plain).collect::<Vec<_>>()
    };
    assert_eq!(values(&keys(text(&dir.join("open.toml")))), values(&all));
}

#[test]
fn a_comment_that_is_not_the_default_is_told_with_its_line() {
    let dir = scratch("new-defaults");
    let scene = dir.join("wall.toml");
    assert_eq!(code(&run(&["new", text(&dir.join("wall"))])), 0);
    let written = fs::read_to_string(&scene).expect("a scene");
    // As if the defaults of that day had been others: a quantity, a whole number, a word. The comment of a resistance
    // is no default, but the named motor's; a value that the scene gives is no comment.
    let others = [
        ("bridge.supply", "supply = \"24 V\"", "supply = \"12 V\""),
        ("method.pwm.bits", "bits = 12", "bits = 10"),
        ("method.product", "product = \"saturate\"", "product = \"wrap\""),
        ("", "resistance = \"2.3", "resistance = \"3.3"),
    ];
    let mut other = written.clone();
    for (_, now, then) in others {
        assert_eq!(other.matches(&format!("\n# {now}")).count(), 1, "{now}");
        other = other.replace(&format!("\n# {now}"), &format!("\n# {then}"));
    }
    fs::write(&scene, &other).expect("a scene");
    let value = |pair: &str| pair.split_once(" = ").expect("a pair").1.to_string();
    let mut notes: Vec<(usize, String)> = Vec::new();
    for (key, now, then) in others.into_iter().filter(|(key, ..)| !key.is_empty()) {
        let line = 1 + other.lines().position(|line| line == format!("# {then}")).expect("a line");
        let said = format!("the comment says {}; without the key, hpu takes its default, {}", value(then), value(now));
        notes.push((line, format!("note: {}:{line}: {key}: {said}\n", text(&scene))));
    }
    notes.sort_unstable();
    let notes: String = notes.into_iter().map(|(_, note)| note).collect();
    for arguments in [&["scenes", "show"][..], &["run", "--json"]] {
        let ran = run(&[arguments, &[text(&scene)]].concat());
        assert_eq!((code(&ran), stderr(&ran)), (0, notes.clone()), "{arguments:?}");
    }
    // A key that is given has no default, and other scenes may have any comments.
    let given = run(&["scenes", "show", text(&scene), "--set", "bridge.supply=12 V"]);
    assert_eq!(stderr(&given).lines().count(), 2, "{}", stderr(&given));
    fs::write(&scene, format!("# Mine.\n{other}")).expect("a scene");
    assert_eq!(stderr(&run(&["scenes", "show", text(&scene)])), "");
}

#[test]
fn a_shown_scene_runs_to_the_same_summary() {
    let dir = scratch("scene-show");
    for (scene, set) in [("hybrid-wall", "wall.stiffness=2 N.m/rad"), ("phantom-thrown", "room.stiffness=4 kN/m")] {
        let shown = stdout(&run(&["scenes", "show", scene, "--set", set]));
        assert!(shown.contains(&format!("# --set {set}")), "{shown}");
        assert!(
            shown.contains(&format!("# testbench/scenes/{scene}.toml:")) && shown.contains("  # default"),
            "{shown}"
        );
        let again = dir.join(format!("{scene}.toml"));
        fs::write(&again, shown).expect("a scene");
        let figures = |arguments: &[&str]| {
            let summary = json(&run(&[&["run"], arguments, &["--json"]].concat()));
            ["outcome", "edges", "energy", "encoder_edges", "output_changes", "ticks"].map(|key| summary[key].clone())
        };
        let own = figures(&[scene, "--set", set]);
        assert!(own.iter().any(Value::is_object), "{own:?}");
        assert_eq!(figures(&[text(&again)]), own);
    }
}

#[test]
fn what_would_overwrite_or_makes_no_scene_is_refused() {
    let dir = scratch("new-refused");
    let place = dir.join("wall");
    assert_eq!(code(&run(&["new", text(&place)])), 0);
    let before = fs::read_to_string(dir.join("wall.toml")).expect("a scene");
    assert_refused(&run(&["new", text(&place)]), 2, &["wall.toml is there already", "choose another name"]);
    fs::write(dir.join("mine.vhd"), "mine").expect("a file");
    assert_refused(&run(&["new", text(&dir.join("mine")), "--dut"]), 2, &["mine.vhd is there already"]);
    assert!(!dir.join("mine.toml").exists());
    assert_eq!(fs::read_to_string(dir.join("wall.toml")).expect("a scene"), before);
    for (flags, words) in [
        (&["--clock", "fast"][..], "clock.frequency"),
        (&["--device", "phantom", "--counts", "400"], "has its own law and encoders"),
        (&["--device", "mass", "--dut"], "drives a motor"),
        (&["--dut", "--method", "hybrid"], "cannot be used with"),
        (&["--method", "hybrit"], "hybrid"),
    ] {
        assert_refused(&run(&[&["new", text(&dir.join("other"))], flags].concat()), 2, &[words]);
        assert!(!dir.join("other.toml").exists());
    }
}
