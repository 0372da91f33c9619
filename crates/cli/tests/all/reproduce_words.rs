//! `hpu reproduce` for the PHANToM's words, sines and cost: files, one JSON object, and refused arguments.

use std::fs;

use crate::common::{ROOT, assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text};

#[test]
fn formats_and_sines_write_text_csv_and_pictures_and_print_the_text() {
    for (study, expected) in [
        ("phantom-formats", &["formats.csv", "formats.png", "formats.svg", "formats.txt", "workspace.csv"][..]),
        ("phantom-sines", &["sines.csv", "sines.png", "sines.svg", "sines.txt"][..]),
    ] {
        let out = scratch(study).join("out");
        let output = run(&["--quiet", "reproduce", study, "-o", text(&out)]);
        assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
        assert_eq!(names(&out), expected);
        let written = expected.iter().find(|name| name.ends_with(".txt")).expect("a text");
        let written = fs::read_to_string(out.join(written)).expect("a text");
        assert!(stdout(&output).starts_with(&written));
        assert!(written.contains(&format!("$ hpu reproduce {study}\n")), "{written}");
        if study == "phantom-formats" {
            assert_summed_up(&stdout(&output));
        }
    }
}

/// Asserts that the text about formats ends with what plain words cannot hold, and a summing-up.
fn assert_summed_up(said: &str) {
    let (found, summed) = said.split_once("\nSumming up: ").expect("a summing-up");
    assert!(found.trim_end().lines().last().expect("lines").starts_with("Plain (1,9,22) cannot hold the stiffness"));
    assert!(summed.contains("(a)   not confirmed") && summed.contains("wraps: stiffness\n"), "{summed}");
    // 88.5 % of the box at 13 bits, according to the count.
    assert!(summed.contains("(b)   confirmed") && summed.contains("13 address bits: 88.5 %"), "{summed}");
    assert!(said.lines().any(|line| line.contains("proved") && line.contains("measured")));
}

#[test]
fn json_is_one_object_with_every_signal_and_source() {
    let result = json(&run(&["reproduce", "phantom-formats", "--json"]));
    let configurations = result["configurations"].as_array().expect("configurations");
    assert_eq!(configurations.len(), 5);
    for configuration in configurations {
        assert_eq!(configuration["signals"].as_array().expect("signals").len(), 23);
    }
    let plain = configurations.iter().find(|of| of["name"] == "plain_q22").expect("plain");
    let signal = |name: &str| plain["signals"].as_array().expect("signals").iter().find(|of| of["name"] == name);
    let stiffness = signal("stiffness").expect("a stiffness");
    assert_eq!((&stiffness["overflow"], &stiffness["format"]), (&"wraps".into(), &serde_json::json!([0, 9, 22])));
    assert_eq!(signal("force_x").expect("a force")["proved_error"], serde_json::Value::Null);
    let findings = result["claims"].as_array().expect("claims").iter().map(|claim| claim["finding"].clone());
    assert_eq!(findings.collect::<Vec<_>>(), ["not confirmed", "confirmed"]);
    assert_eq!(result["workspace"]["held"].as_array().expect("depths").len(), 5);

    let result = json(&run(&["reproduce", "phantom-sines", "--json"]));
    let sources = result["sources"].as_array().expect("sources");
    assert_eq!(sources.iter().filter(|source| source["default"] == true).count(), 4);
}

#[test]
fn what_a_study_does_not_take_is_wrong_usage() {
    let out = scratch("reproduce-words-refused").join("out");
    for arguments in [
        &["phantom-formats", "--axes", "x"][..],
        &["phantom-sines", "--trials", "3"],
        &["phantom-cost", "--blocks", "phantom_lop"],
        &["phantom-cost", "--stiffness", "5"],
        &["phantom-tables"],
        &[],
    ] {
        let arguments = [&["reproduce"], arguments, &["-o", text(&out)]].concat();
        let output = run(&arguments);
        assert_eq!((code(&output), stdout(&output).as_str()), (2, ""), "{arguments:?}");
        assert!(!out.exists(), "{arguments:?}");
    }
}

#[test]
fn a_missing_tool_is_named_and_nothing_is_written() {
    let dir = scratch("reproduce-cost-tools");
    let out = dir.join("out");
    let output =
        hpu().args(["reproduce", "phantom-cost", "-o", text(&out)]).env("PATH", &dir).output().expect("starts");
    assert_refused(&output, 3, &["ghdl", "not installed", "apt install"]);
    assert_eq!(names(&dir), [""; 0]);
}

#[test]
fn vhdl_that_is_not_there_is_a_bad_file() {
    let dir = scratch("reproduce-cost-hdl");
    assert_refused(&run(&["reproduce", "phantom-cost", "--hdl", text(&dir)]), 4, &["trig_quarter.vhd"]);
}

#[test]
fn a_register_costs_its_flip_flops_and_a_finished_synthesis_is_not_done_again() {
    let dir = scratch("reproduce-cost");
    let (out, cache) = (dir.join("out"), dir.join("cache"));
    let own = ["--blocks", "command_register", "-o", text(&out), "--cache", text(&cache)];
    let arguments = [&["--quiet", "reproduce", "phantom-cost"], &own[..]].concat();
    let output = run(&arguments);
    assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
    assert_eq!(names(&out), ["phantom-cost.csv", "phantom-cost.txt"]);
    let csv = fs::read_to_string(out.join("phantom-cost.csv")).expect("a CSV");
    let lines: Vec<&str> = csv.lines().collect();
    assert!(lines[0].starts_with("# ghdl ") && lines[0].contains("yosys ") && lines[0].contains("nextpnr-ice40 "));
    let row: Vec<&str> = lines[2].split(',').collect();
    assert_eq!(row.len(), lines[1].split(',').count());
    assert_eq!(row[..3], ["command_register", "default", "ice40-hx8k"]);
    // Three commands of 16 bits and a countdown of 24, which begins at 8.
    assert_eq!(row[4], "72");
    let before = stdout(&output);

    // A cost that is remembered is not measured again, nor is its file written again.
    let kept = || {
        let files = fs::read_dir(&cache).expect("a cache").map(|file| file.expect("a file"));
        files.map(|file| (file.file_name(), file.metadata().expect("a file").modified().expect("a time")))
    };
    let first: Vec<_> = kept().collect();
    assert_eq!(first.len(), 1, "{first:?}");
    assert_eq!(stdout(&run(&arguments)), before);
    assert_eq!(kept().collect::<Vec<_>>(), first);
}

#[test]
fn the_record_is_of_the_plan_and_names_its_tools_alone() {
    let record = format!("{ROOT}/testbench/record/phantom-cost.csv");
    let csv = fs::read_to_string(&record).expect("the record");
    let lines: Vec<&str> = csv.lines().collect();
    assert!(lines[0].starts_with("# ghdl ") && !lines[0].contains('/'), "{}", lines[0]);
    let fields = |line: &str| line.split(',').count();
    assert!(lines[1..].iter().all(|line| fields(line) == fields(lines[1]) && !line.contains("/tmp")));
    for name in ["phantom_engine", "phantom_shared_loop", "phantom_loop", "trig_table"] {
        assert!(lines.iter().any(|line| line.starts_with(&format!("{name},"))), "{name}");
    }
    // In the loops with one multiplier, more fraction bits cost more cells and reduce the error.
    let of = |label: &str, column: usize| -> f64 {
        let line = lines.iter().find(|line| line.starts_with(&format!("phantom_shared_loop,{label},"))).expect(label);
        line.split(',').nth(column).and_then(|field| field.parse().ok()).expect("a number")
    };
    let column = |name: &str| lines[1].split(',').position(|field| field == name).expect(name);
    let (cells, error) = (column("hx8k_cells"), column("position_error_13_bits_um"));
    for pair in ["fraction_14", "fraction_18", "fraction_22"].windows(2) {
        assert!(of(pair[0], cells) < of(pair[1], cells) && of(pair[0], error) > of(pair[1], error), "{pair:?}");
    }
}
