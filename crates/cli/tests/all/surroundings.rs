//! Ordinary surroundings: no HOME as under cron, a cache of no use, a terminal that is gone.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::{ROOT, code, hpu, json, scratch, stderr, stdout, text};

const DESIGN: &str = "module top(input clk, rst, a, b, output pwm, dir);\n\
    assign pwm = rst ? 1'b0 : a;\nassign dir = b;\nendmodule\n";

/// Writes a scene with a design in Verilog, and returns its path.
fn design(dir: &Path, file: &str) -> String {
    fs::write(dir.join(file), DESIGN).expect("a file");
    let scene = format!(
        "about = \"a design\"\ndevice = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\n\
         clock = {{ frequency = \"10 MHz\" }}\nwall = {{ position = \"1.5 rad\" }}\nrun = {{ duration = \"1 ms\" }}\n\
         dut = {{ files = [\"{file}\"], top = \"top\", clock = \"clk\", reset = {{ port = \"rst\" }}, ports = \
         {{ a = \"encoder.a\", b = \"encoder.b\", pwm = \"bridge.pwm\", dir = \"bridge.direction\" }} }}\n\
         hand = {{ kind = \"constant_torque\", torque = \"1 mN.m\" }}\n"
    );
    fs::write(dir.join("scene.toml"), scene).expect("a scene");
    text(&dir.join("scene.toml")).to_string()
}

/// Returns the command without a place for a cache.
fn homeless() -> Command {
    let mut command = hpu();
    command.env_remove("HOME").env_remove("XDG_CACHE_HOME");
    command
}

fn outcome(output: &Output) -> serde_json::Value {
    assert_eq!(code(output), 0, "{}{}", stderr(output), stdout(output));
    let found = json(output);
    assert!(found["outcome"].is_object(), "{found}");
    serde_json::json!([found["outcome"], found["energy"], found["edges"]])
}

#[test]
fn without_a_home_everything_runs_and_a_design_says_why_it_is_built_again() {
    for arguments in [
        &["run", "hybrid-wall", "--edges", "1000"][..],
        &["scenes"],
        &["scenes", "show", "testbench/dut/knee.toml"],
        &["check", "saturator", "--rows", "10"],
    ] {
        let output = homeless().arg("-q").args(arguments).output().expect("it starts");
        assert_eq!(code(&output), 0, "{arguments:?}: {}", stderr(&output));
        assert!(!stderr(&output).contains("HOME"), "{arguments:?}: {}", stderr(&output));
    }
    let (dir, tmp) = (scratch("homeless"), scratch("homeless-tmp"));
    let scene = design(&dir, "design.v");
    let output = homeless().args(["-q", "run", &scene, "--json"]).env("TMPDIR", &tmp).output().expect("it starts");
    outcome(&output);
    let said = stderr(&output);
    assert!(said.starts_with("note: no HOME: ") && said.contains("XDG_CACHE_HOME"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert_eq!(crate::common::names(&tmp), [""; 0], "what is not kept is removed");
    // Proofs are remembered in the cache, too.
    let output = homeless().args(["-q", "check", "--formal", "saturator"]).output();
    let output = output.expect("it starts");
    assert_eq!(code(&output), 0, "{}{}", stderr(&output), stdout(&output));
    assert!(stderr(&output).contains("note: no HOME: proofs stay with this command"), "{}", stderr(&output));
}

#[test]
fn an_empty_environment_and_relative_folders_are_no_fault_of_the_design() {
    let (dir, here) = (scratch("bare"), scratch("bare-here"));
    let scene = design(&dir, "design.v");
    // Verilator, make and the compiler find each other without a PATH.
    let simulated = ["-q", "run", &scene, "--json"];
    let priced = ["-q", "cost", "--scene", &scene, "--json"];
    let relative = [("HOME", "home"), ("XDG_CACHE_HOME", "kept/here"), ("TMPDIR", "work")];
    fs::create_dir(here.join("work")).expect("a folder");
    for (arguments, surroundings) in
        [(&simulated[..], &[][..]), (&priced, &[("TMPDIR", "")]), (&priced, &relative), (&priced, &relative[..2])]
    {
        let mut command = hpu();
        command.env_clear().current_dir(&here).args(arguments).envs(surroundings.iter().copied());
        let output = command.output().expect("it starts");
        assert_eq!(code(&output), 0, "{surroundings:?}: {}", stderr(&output));
        assert!(json(&output).is_object() && stderr(&output).starts_with("note: no HOME: "), "{}", stderr(&output));
        assert_eq!(crate::common::names(&here), ["work"], "{surroundings:?}");
    }
    assert_eq!(crate::common::names(&here.join("work")), [""; 0]);
}

/// Returns a shell's words that mount an own file system at `place` for what follows them, without any right; `None`
/// where the kernel does not let a user do that.
fn mounted(options: &str, place: &Path) -> Option<Command> {
    let script = "mount -t tmpfs -o \"$1\" tmpfs \"$2\" && shift 2 && exec \"$@\"";
    let with = || {
        let mut command = Command::new("unshare");
        command.args(["-r", "-m", "sh", "-c", script, "sh", options]).arg(place);
        command
    };
    let probe = with().arg("true").output().expect("unshare starts");
    probe.status.success().then(with)
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_cache_of_no_use_costs_no_result_and_is_named_with_its_remedy() {
    let dir = scratch("useless-cache");
    let scene = design(&dir, "design.v");
    // Verilator's model is a program, and larger than a netlist.
    let of = ["-q", "run", &scene, "--json", "--set", "dut.engine=verilator"];
    let run = |command: &mut Command| command.args(of).output().expect("it starts");
    let good = outcome(&run(hpu().env("XDG_CACHE_HOME", dir.join("good"))));
    // A folder with a space is a cache like any other.
    let spaced = run(hpu().env("XDG_CACHE_HOME", dir.join("with a space")));
    assert_eq!((outcome(&spaced), stderr(&spaced)), (good.clone(), String::new()));
    assert!(dir.join("with a space/hpu/dut").is_dir());
    fs::write(dir.join("file"), "").expect("a file");
    let of_file = run(hpu().env("XDG_CACHE_HOME", dir.join("file")));
    let mut tried = vec![("Not a directory", of_file)];
    let place = dir.join("mounted");
    fs::create_dir(&place).expect("a folder");
    for (options, why) in [("ro", "Read-only"), ("noexec", "no program"), ("size=300k", "No space left")] {
        let Some(mut command) = mounted(options, &place) else {
            eprintln!("{options}: left out, this kernel lets no user mount");
            continue;
        };
        command.current_dir(ROOT).arg(hpu().get_program()).env("XDG_CACHE_HOME", &place);
        tried.push((why, run(&mut command)));
    }
    for (why, output) in tried {
        let said = stderr(&output);
        assert_eq!(outcome(&output), good, "{why}: {said}");
        for word in ["note: ", why, "hpu/dut", "XDG_CACHE_HOME"] {
            assert!(said.contains(word), "`{word}` is not in: {said}");
        }
    }
}

#[test]
fn a_reader_or_a_terminal_that_is_gone_changes_no_exit() {
    let program = hpu().get_program().to_str().expect("text").to_string();
    let ended = |arguments: &str, rest: &str| {
        let script = format!("set -o pipefail; '{program}' {arguments} {rest}");
        let output = Command::new("bash").args(["-c", &script]).current_dir(ROOT).output().expect("a shell");
        (code(&output), stderr(&output))
    };
    for (arguments, expected) in [
        ("run hybrid-wall --edges 1000", 0),
        ("run hybrid-wall --edges 1000 --json", 0),
        ("run no-such-scene", 4),
        ("run --no-such-option", 2),
        ("check saturator --rows 10", 0),
        ("--help", 0),
    ] {
        for rest in [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", "2>&1 | true", "2>/dev/full"] {
            let (code, said) = ended(arguments, rest);
            assert_eq!(code, expected, "{arguments} {rest}: {said}");
            assert!(!said.contains("panicked"), "{arguments} {rest}: {said}");
        }
    }
}
