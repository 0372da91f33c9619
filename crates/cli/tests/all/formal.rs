//! Tests `hpu check --formal`: what is proved, refuted or left open.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::common::{ROOT, code, hpu, json, names, run, scratch, stderr, stdout, text, tools};

#[test]
fn what_is_proved_is_told_block_by_block() {
    let output =
        run(&["check", "--formal", "displacement", "zero_order_hold", "phantom_engine", "--variant", "default"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stdout(&output);
    let line = |block: &str| said.lines().find(|line| line.starts_with(block)).unwrap_or_else(|| panic!("{said}"));
    assert!(line("displacement").ends_with("  proved"), "{said}");
    assert!(line("zero_order_hold").ends_with("  proved"), "{said}");
    assert!(line("phantom_engine").contains("not proved: its clock edge is not told as equations"), "{said}");
    assert!(said.contains("2 of 3 configurations proved for all inputs and states, 0 refuted, 1 not proved"), "{said}");
}

/// The leaves that are not proved in the widths of scenes: the first has no equations, and no solver decides the second
/// in a minute.
const OPEN: [&str; 2] = ["phantom_engine", "gimbal_inverse"];

/// Proves wirings and leaves in the widths of scenes, at least so many leaves and wirings.
fn prove_scenes(names: &[&str], least: [usize; 2]) {
    let asked: Vec<_> = names.iter().flat_map(|name| ["--scene", name]).collect();
    let value = json(&run(&[&["check", "--formal", "--json"], &asked[..]].concat()));
    let rows = value["rows"].as_array().expect("rows");
    let (mut proved, mut wirings) = (0, 0);
    for row in rows {
        let is_open = |row: &Value| OPEN.iter().any(|block| row["block"] == *block);
        let expected = match row["parts"].as_array() {
            Some(parts) => {
                wirings += 1;
                let is_as_expected = |part: &&Value| part["verdict"] == if is_open(part) { "open" } else { "proved" };
                assert_eq!(parts.iter().find(|part| !is_as_expected(part)), None, "{row}");
                if parts.iter().any(is_open) { "wired" } else { "proved" }
            }
            None if is_open(row) => "open",
            None => "proved",
        };
        assert_eq!(row["verdict"], expected, "{row}");
        let is_late = row["why"].as_str().is_some_and(|why| why.contains("no answer within"));
        assert!(row["block"] != "gimbal_inverse" || is_late, "{row}");
        proved += usize::from(expected == "proved");
    }
    assert!(proved >= least[0] && wirings >= least[1], "{proved}, {wirings} of {} scenes", names.len());
    assert_eq!(value["wirings"]["count"], wirings);
    assert_eq!(value["wirings"]["equal"], wirings);
}

/// Scenes of three wirings. The tests of hpu-rtl prove leaves and compare the wirings of all methods and arms in their
/// listed configurations; the next test has every scene.
#[test]
fn every_wiring_and_every_leaf_of_some_scenes_is_proved_in_the_widths_of_that_scene() {
    prove_scenes(&["hybrid-wall", "scaled-wall", "coupled-wall"], [18, 5]);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_wiring_and_every_leaf_of_every_shipped_scene_is_proved_in_the_widths_of_that_scene() {
    let scenes = stdout(&run(&["scenes"]));
    let names: Vec<_> = scenes.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() > 40, "{} scenes", names.len());
    prove_scenes(&names, [50, 25]);
}

/// Proves the default configurations of blocks with the front of an axis among them and, apart, a configuration of the
/// arm's loop, whose engine is not proved. Asserts what each line says.
fn count_wirings(loops: &[&str], engine: &str, total: &str) {
    let said = stdout(&fine(&[&["check", "--formal", "unilateral", "axis_front"], loops, &["--variant", "default"]]));
    let line = |said: &str, block: &str| {
        said.lines().find(|line| line.starts_with(block)).unwrap_or_else(|| panic!("{said}")).to_string()
    };
    let front = "proved: the wiring equals, of proved synchronizer, quadrature_decoder, position_counter, \
                 displacement, unilateral";
    assert!(line(&said, "axis_front").ends_with(front), "{said}");
    assert!(line(&said, "hybrid_loop").contains(&format!("{front}, truncating_multiplier, velocity_register")));
    let leaves = "1 of 1 configurations of leaf blocks proved for all inputs and states, 0 refuted, 0 not proved; ";
    assert!(said.contains(&format!("{leaves}{total}; VHDL")), "{said}");
    let arm = stdout(&fine(&[&["check", "--formal", "phantom_shared_loop", "--variant", engine]]));
    let open = "wired: the wiring equals; not proved: engine (phantom_engine)";
    assert!(line(&arm, "phantom_shared_loop").ends_with(open), "{arm}");
    assert!(arm.contains("1 of 1 wirings equal, 0 of them with all leaves proved; VHDL"), "{arm}");
}

/// Runs the command with these arguments, which it takes.
fn fine(arguments: &[&[&str]]) -> Output {
    let output = run(&arguments.concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    output
}

#[test]
fn wirings_are_counted_apart_from_leaf_blocks_and_name_what_they_rest_on() {
    count_wirings(&["hybrid_loop"], "small", "2 of 2 wirings equal, 2 of them with all leaves proved");
}

/// The sines of the default take seconds.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn wirings_of_which_some_rest_on_what_is_not_proved_are_counted_together() {
    let blocks = ["hybrid_loop", "phantom_shared_loop"];
    count_wirings(&blocks, "default", "3 of 3 wirings equal, 2 of them with all leaves proved");
}

#[test]
fn a_leaf_is_proved_once_in_a_run_whichever_wirings_have_it() {
    let dir = scratch("formal_once");
    let log = dir.join("log");
    let yosys = format!("echo \"$@\" >> '{}'; exec yosys \"$@\"", text(&log));
    let others = ["ghdl", "z3", "yices-smt2", "bitwuzla"].map(|tool| (tool, format!("exec {tool} \"$@\"")));
    let mut scripts: Vec<_> = others.iter().map(|(tool, script)| (*tool, script.as_str())).collect();
    scripts.push(("yosys", &yosys));
    let asked = ["check", "--formal", "unilateral", "axis_front", "hybrid_loop", "--variant", "8_bit"];
    let mut command = hpu();
    // Of proofs made before, none is known.
    command.args(asked).env("PATH", tools(&dir, &scripts)).env("XDG_CACHE_HOME", dir.join("cache"));
    let output = command.output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let log = fs::read_to_string(log).expect("a log");
    assert_eq!(log.matches("prep -top unilateral;").count(), 1, "{log}");
    assert_eq!(log.matches("read_verilog -nodpi wiring.v").count(), 2, "{log}");
}

/// Makes a folder with the VHDL in which one file is changed.
fn changed(dir: &Path, file: &str, from: &str, to: &str) -> PathBuf {
    let place = dir.join("hdl");
    fs::create_dir_all(&place).expect("a folder");
    for folder in ["hdl", "hdl/generated"] {
        for entry in fs::read_dir(Path::new(ROOT).join(folder)).expect("the VHDL").flatten() {
            if entry.path().is_file() {
                fs::copy(entry.path(), place.join(entry.file_name())).expect("a copy");
            }
        }
    }
    let path = place.join(format!("{file}.vhd"));
    let text = fs::read_to_string(&path).expect("VHDL");
    assert!(text.contains(from), "{file}: {from}");
    fs::write(&path, text.replacen(from, to, 1)).expect("VHDL");
    place
}

#[test]
fn a_wiring_that_differs_is_refuted_with_the_place() {
    let dir = scratch("formal_miswired");
    let hdl = changed(&dir, "hybrid_loop", "spring  => spring,", "spring  => penetration,");
    let one = ["check", "--formal", "hybrid_loop", "--variant", "default", "--hdl", text(&hdl)];
    let output = run(&one);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let why =
        "instance sum, port spring: at spring, driven by spring_mult.product here, at wall.penetration in the VHDL";
    let said = stdout(&output);
    assert!(said.contains(&format!("refuted, by its wiring: {why}")), "{said}");
    assert!(said.contains("\n0 of 1 wirings equal, 0 of them with all leaves proved; VHDL"), "{said}");
    let value = json(&run_differing(&[&one[..], &["--json"]].concat()));
    assert_eq!((&value["ok"], &value["refuted"]), (&Value::Bool(false), &1.into()));
    assert_eq!(value["rows"][0]["verdict"], "refuted");
    assert_eq!(value["rows"][0]["why"], why);
}

#[test]
fn a_wiring_of_a_refuted_block_is_refuted_with_the_words_of_that_block() {
    let dir = scratch("formal_leaf");
    let hdl = changed(&dir, "unilateral", "if delta(delta'high) = '1' then", "if delta(delta'high) = '0' then");
    let output = run(&["check", "--formal", "axis_front", "--variant", "8_bit", "--hdl", text(&hdl)]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let said = stdout(&output);
    for part in ["refuted, by its inputs of instance wall, a unilateral:", "penetration(vhdl)", "1 of 1 wirings equal"]
    {
        assert!(said.contains(part), "`{part}` is not in {said}");
    }
}

#[test]
fn what_is_refuted_is_a_row_and_a_waveform() {
    let dir = scratch("formal_refuted");
    let hdl = dir.join("hdl");
    fs::create_dir_all(&hdl).expect("a folder");
    let vhdl = fs::read_to_string(Path::new(ROOT).join("hdl/unilateral.vhd")).expect("VHDL");
    // The wall is wrong at its last count only: one word of 4096, which a directed row need not have.
    let wrong =
        vhdl.replace("if delta(delta'high) = '1' then", "if delta(delta'high) = '1' and delta /= x\"a5c\" then");
    assert_ne!(wrong, vhdl);
    fs::write(hdl.join("unilateral.vhd"), wrong).expect("VHDL");
    let out = dir.join("out");
    let one = ["check", "--formal", "unilateral", "--variant", "default", "--hdl", text(&hdl)];
    let output = run(&[&one[..], &["-o", text(&out)]].concat());
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let said = stdout(&output);
    for part in ["refuted, by its inputs:", "penetration(vhdl)", "a5c", "0 of 1 configurations proved", "1 refuted"] {
        assert!(said.contains(part), "`{part}` is not in {said}");
    }
    assert_eq!(
        names(&out),
        ["formal.json", "formal.txt", "unilateral-default.vcd", "unilateral-default.vcd.gtkw"],
        "{said}"
    );
    let value: Value = json(&run_differing(&[&one[..], &["--json"]].concat()));
    assert_eq!(value["ok"], false);
    let why = &value["rows"][0]["why"];
    assert_eq!(value["rows"][0]["verdict"], "refuted");
    assert!(why["history"][0].as_array().is_some_and(|row| row.iter().any(|word| word == "a5c")), "{why}");
}

#[test]
fn a_proof_is_remembered_while_both_sides_stay_as_they_are() {
    let dir = scratch("formal_remembered");
    let hdl = dir.join("hdl");
    fs::create_dir_all(&hdl).expect("a folder");
    let place = hdl.join("displacement.vhd");
    let vhdl = fs::read_to_string(Path::new(ROOT).join("hdl/displacement.vhd")).expect("VHDL");
    let asked = || {
        let arguments = ["check", "--formal", "displacement", "--hdl", text(&hdl), "--json"];
        let mut output = hpu().args(arguments).env("XDG_CACHE_HOME", dir.join("cache")).output().expect("starts");
        let is_fine = code(&output) == 0;
        output.status = std::process::ExitStatus::default();
        let value: Value = json(&output);
        (is_fine, ["proved", "refuted", "remembered"].map(|key| value[key].as_u64().expect("a count")))
    };
    fs::write(&place, &vhdl).expect("VHDL");
    assert_eq!(asked(), (true, [3, 0, 0]));
    assert_eq!(asked(), (true, [3, 0, 3]));
    // An entry that is not whole must not count.
    let entries = fs::read_dir(dir.join("cache/hpu/proofs")).expect("proofs");
    let entry = entries.map(|entry| entry.expect("an entry").path()).min().expect("a proof");
    let mut bytes = fs::read(&entry).expect("an entry");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&entry, bytes).expect("an entry");
    assert_eq!(asked(), (true, [3, 0, 2]));
    // Nothing is remembered for other VHDL.
    let wrong = vhdl.replacen("unsigned(position) - unsigned", "unsigned(position) + unsigned", 1);
    assert_ne!(wrong, vhdl);
    fs::write(&place, wrong).expect("VHDL");
    assert_eq!(asked(), (false, [0, 3, 0]));
    fs::write(&place, &vhdl).expect("VHDL");
    assert_eq!(asked(), (true, [3, 0, 3]));
}

/// Runs a command that must report a difference; returns its output with the exit code of success.
fn run_differing(arguments: &[&str]) -> std::process::Output {
    let mut output = run(arguments);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    output.status = std::process::ExitStatus::default();
    output
}

#[test]
fn a_solver_that_is_missing_or_answers_nothing_is_named() {
    let dir = scratch("formal_no_solver");
    let all = ["ghdl", "yosys", "yices-smt2"].map(|tool| (tool, format!("exec {tool} \"$@\"")));
    let mut scripts: Vec<_> = all.iter().map(|(tool, script)| (*tool, script.as_str())).collect();
    let with = |scripts: &[(&str, &str)]| {
        let place = tools(&dir, scripts);
        hpu().args(["check", "--formal", "displacement"]).env("PATH", place).output().expect("starts")
    };
    let output = with(&scripts);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(stderr(&output).contains("`z3` is not installed"), "{}", stderr(&output));
    assert_eq!(stdout(&output), "");
    scripts.push(("z3", "case \"$1\" in --version) echo 'Z3 version 5.0.0 - 64 bit'; exit;; esac\nexit 0"));
    scripts[2] = ("yices-smt2", "case \"$1\" in --version) echo 'Yices 2.6.5'; exit;; esac\nexit 0");
    // Bitwuzla is there neither as a program nor in Python.
    let output = with(&scripts);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(stderr(&output).contains("`bitwuzla` is not installed"), "{}", stderr(&output));
    scripts.push(("bitwuzla", "case \"$1\" in --version) echo 0.10.0; exit;; esac\nexit 0"));
    let output = with(&scripts);
    assert_eq!(code(&output), 4, "{}", stdout(&output));
    assert!(stderr(&output).contains("ended without an error and without a verdict"), "{}", stderr(&output));
    assert!(!stdout(&output).contains("  proved"), "{}", stdout(&output));
}
