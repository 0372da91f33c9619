//! The command carries everything that it needs: it works from any folder, without the project or its own library
//! beside it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::common::{assert_refused, code, hpu, json, run, scratch, stderr, stdout};

/// Puts the program alone into a folder, as `cargo install` does.
fn alone(dir: &Path) -> PathBuf {
    let program = dir.join("bin").join("hpu");
    fs::create_dir_all(program.parent().expect("a folder")).expect("a folder");
    let built = env!("CARGO_BIN_EXE_hpu");
    fs::hard_link(built, &program).or_else(|_| fs::copy(built, &program).map(drop)).expect("the program");
    program
}

fn in_folder(program: &Path, folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).current_dir(folder).output().expect("the command starts")
}

#[test]
fn vhdl_is_checked_far_from_any_clone() {
    let dir = scratch("anywhere");
    let program = alone(&dir);
    let output = in_folder(&program, Path::new("/"), &["check", "saturator", "--scene", "one-tick", "--edges", "2000"]);
    let said = stdout(&output);
    assert_eq!(code(&output), 0, "{said}{}", stderr(&output));
    assert!(said.contains("all agree") && said.ends_with("; VHDL carried by hpu\n"), "{said}");
    assert!(stderr(&output).starts_with("VHDL carried by hpu: 3 configurations, 1 scene; about "), "{said}");
    let output = in_folder(&program, Path::new("/"), &["run", "short-contact", "--driver", "rtl", "--edges", "2000"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stdout(&output).contains("0 mismatches; VHDL carried by hpu"), "{}", stdout(&output));
}

#[test]
fn a_folder_of_vhdl_is_taken_before_what_is_carried() {
    let dir = scratch("anywhere-folder");
    let program = alone(&dir);
    // A folder `hdl` of the user's own, without any of the blocks.
    fs::create_dir_all(dir.join("hdl")).expect("a folder");
    fs::write(dir.join("hdl/adder.vhd"), "entity adder is end entity;\n").expect("a file");
    let output = in_folder(&program, &dir, &["check", "saturator", "--json"]);
    assert_eq!((code(&output), json(&output)["hdl"].as_str()), (0, Some("carried by hpu")));
    let output = in_folder(&program, &dir, &["check", "saturator", "--hdl", "hdl"]);
    assert_refused(&output, 4, &["hdl/", ".vhd: No such file"]);
    // With a block it is a folder of VHDL, and the block in it is checked.
    fs::write(dir.join("hdl/saturator.vhd"), "nonsense").expect("a file");
    let output = in_folder(&program, &dir, &["check", "saturator"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(stdout(&output).contains("hdl/saturator.vhd:1:1: missing entity"), "{}", stdout(&output));
    let output = run(&["check", "saturator", "--json"]);
    assert_eq!((code(&output), json(&output)["hdl"].as_str()), (0, Some("hdl")));
}

/// Returns a report without its seconds.
fn without_seconds(mut report: Value) -> Value {
    for group in ["blocks", "loops"] {
        for entry in report[group].as_array_mut().expect("rows") {
            let rows = match entry.get_mut("variants") {
                Some(variants) => variants.as_array_mut().expect("variants").iter_mut().collect(),
                None => vec![entry],
            };
            rows.into_iter().for_each(|row| row["seconds"] = Value::Null);
        }
    }
    report
}

/// Returns the report of a check of a few blocks and scenes, with this number of runs at a time on a back end of GHDL.
/// One of the runs takes several times as long as the others.
fn checked(jobs: &str, back_end: &str) -> Value {
    let arguments = ["check", "pwm", "saturator", "displacement", "--rows", "300", "--edges", "5000", "--json"];
    let scenes = ["--scene", "one-tick", "--scene", "short-contact", "--jobs", jobs];
    let output = hpu().args(arguments).args(scenes).env("GHDL_BACKEND", back_end).output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains(&format!("s by their rows and edges (an estimate), {jobs} at a time\n")));
    without_seconds(json(&output))
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_check_is_the_same_however_many_runs_are_at_a_time() {
    assert_eq!(checked("1", "mcode"), checked("4", "mcode"));
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_check_is_the_same_where_ghdl_writes_a_program_for_each_bench() {
    let version = Command::new("ghdl").arg("--version").env("GHDL_BACKEND", "llvm").output().expect("GHDL");
    assert!(stdout(&version).contains("llvm code generator"), "no ghdl-llvm: {}", stdout(&version));
    assert_eq!(checked("1", "mcode"), checked("4", "llvm"));
}
