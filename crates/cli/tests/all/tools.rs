//! Tools that hang, flood, die, print nothing or are too old are named in the error, and do not count as a mismatch.

use std::fs;
use std::process::Output;
use std::time::{Duration, Instant};

use crate::common::{code, hpu, names, scratch, stderr, stdout, text, tools};

/// Runs a command with these tools. No temporary file may be left.
fn with(test: &str, scripts: &[(&str, &str)], arguments: &[&str]) -> Output {
    let dir = scratch(test);
    let (tools, work) = (tools(&dir, scripts), dir.join("work"));
    fs::create_dir_all(&work).expect("a folder");
    let start = Instant::now();
    let output = hpu().args(arguments).env("PATH", tools).env("TMPDIR", &work).output().expect("starts");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    assert_eq!(names(&work), [""; 0], "temporary files");
    output
}

fn assert_blamed(output: &Output, expected: i32, words: &[&str]) {
    let said = stderr(output);
    assert_eq!(code(output), expected, "{said}{}", stdout(output));
    for word in words {
        assert!(said.contains(word), "`{word}` is not in: {said}");
    }
    assert!(!stdout(output).contains("all agree"), "{}", stdout(output));
}

/// Returns a script for a GHDL that runs `running` instead of a simulation.
fn ghdl(running: &str) -> String {
    format!("case \"$1\" in --version) echo 'GHDL 2.0.0'; exit;; -a | -e) exit;; esac\n{running}")
}

const LOOP: [&str; 4] = ["run", "short-contact", "--driver", "rtl"];

#[test]
fn a_ghdl_that_is_missing_or_too_old_is_named() {
    for arguments in [&["check", "saturator"][..], &LOOP, &["cost", "pwm", "--cache", "/nowhere"]] {
        let output = with("tool-none", &[], arguments);
        if arguments[0] != "cost" {
            assert_blamed(&output, 3, &["error: `ghdl` is not installed", "apt install ghdl-mcode"]);
        }
        let old = [("ghdl", "echo 'GHDL 0.29 (20100109) [Sokcho edition]'")];
        assert_blamed(&with("tool-old", &old, arguments), 3, &["error: `ghdl` is version 0.29", "1.0 or later"]);
    }
    let mute = [("ghdl", "exit 0")];
    let words = ["ghdl ended without an error and without a version when asked to tell its version"];
    assert_blamed(&with("tool-mute", &mute, &["check", "saturator"]), 4, &words);
}

#[test]
fn a_ghdl_that_hangs_is_killed_and_named_with_its_last_words() {
    let hanging = ghdl("echo half a result; sleep 1000");
    let all = [
        ("tool-hang-check", &["check", "saturator"][..], "tb_saturator"),
        ("tool-hang-run", &LOOP, "bench_hybrid_loop_0"),
    ];
    for (test, arguments, unit) in all {
        let output = with(test, &[("ghdl", &hanging)], &[arguments, &["--tool-timeout", "0.5"]].concat());
        let killed = format!("ghdl was killed: no end after 0.5 s (--tool-timeout) when asked to run {unit}");
        assert_blamed(&output, 4, &[&killed, "half a result"]);
    }
    let hanging = [("ghdl", "[ \"$1\" = --version ] && echo 'GHDL 2.0.0' && exit; while :; do :; done")];
    let output = with("tool-hang-analysis", &hanging, &["check", "--tool-timeout", "0.5"]);
    assert_blamed(&output, 4, &["ghdl was killed: no end after 0.5 s", "analyse the VHDL; it said nothing"]);
}

#[test]
fn a_ghdl_that_floods_is_killed_and_named() {
    let output = with("tool-flood", &[("ghdl", &ghdl("exec yes and so on"))], &["check", "saturator", "--jobs", "1"]);
    assert_blamed(
        &output,
        4,
        &["ghdl was killed: more than 64 MiB of output when asked to run tb_saturator", "and so on"],
    );
    assert!(stderr(&output).len() < 10_000);
}

#[test]
fn a_ghdl_that_dies_or_says_nothing_is_no_mismatch() {
    let ways = [
        ("echo before; kill -SEGV $$", "ghdl was killed by signal 11 (SIGSEGV) when asked to", "run"),
        ("exit 0", "ghdl ended without an error and without a result when asked to", "run"),
        ("echo hello", "ghdl ended without an error and without a result when asked to", "finish"),
        ("exit 7", "ghdl ended with code 7 when asked to", "run"),
    ];
    for (script, words, step) in ways {
        // A loop's bench answers at every step; a block's bench prints its result at the end.
        let both = [(&["check", "saturator"][..], format!("{step} tb_")), (&LOOP, "run bench_".to_string())];
        for (arguments, asked) in both {
            assert_blamed(&with("tool-dies", &[("ghdl", &ghdl(script))], arguments), 4, &[&format!("{words} {asked}")]);
        }
    }
}

#[test]
fn vhdl_that_stops_its_run_or_does_not_analyse_is_a_failed_row() {
    let failing = ghdl("echo 'saturator.vhd:9:3:@5ns:(assertion failure): no' >&2; exit 1");
    let output = with("tool-assertion", &[("ghdl", &failing)], &["check", "saturator"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(stdout(&output).contains("assertion failure") && stdout(&output).contains("3 of 3 differ"));
    let refusing =
        [("ghdl", "[ \"$1\" = --version ] && echo 'GHDL 2.0.0' && exit; echo 'pwm.vhd:1:1: no' >&2; exit 1")];
    let output = with("tool-refuses", &refusing, &["check"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(stdout(&output).contains("ghdl could not analyse the VHDL:\n  pwm.vhd:1:1: no"), "{}", stdout(&output));
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn the_tools_of_synthesis_are_named_too() {
    let ghdl = ("ghdl", "case \"$1\" in --version) echo 'GHDL 2.0.0';; --synth) echo netlist;; esac");
    let nextpnr = ("nextpnr-ice40", "echo 'nextpnr (Version 9.9)'");
    let yosys = |script: &str| format!("[ \"$1\" = -V ] && echo 'Yosys 9.9' && exit\n{script}");
    let stat = yosys("echo '  SB_LUT4   5' > ice40.txt");
    let cases = [
        ("exec yes", &["yosys was killed: more than 64 MiB of output when asked to synthesise torque_sum"][..]),
        ("kill -ABRT $$", &["yosys was killed by signal 6 (SIGABRT) when asked to synthesise torque_sum"]),
        ("echo done", &["yosys ended without an error and without a table of cells when asked to synthesise", "done"]),
    ];
    let arguments = |cache| ["cost", "torque_sum", "--variant", "8_bit", "--cache", cache];
    let cache = scratch("tool-cache");
    for (script, words) in cases {
        let script = yosys(script);
        let output = with("tool-yosys", &[ghdl, ("yosys", &script), nextpnr], &arguments(text(&cache)));
        assert_blamed(&output, 4, words);
    }
    let output = with("tool-nextpnr", &[ghdl, ("yosys", &stat), nextpnr], &arguments(text(&cache)));
    assert_blamed(
        &output,
        4,
        &["nextpnr-ice40 ended without an error and without a number of cells when asked to pack"],
    );
    let old = [ghdl, ("yosys", "echo 'Yosys 0.8 (git sha1 5706e90)'"), nextpnr];
    assert_blamed(&with("tool-old-yosys", &old, &arguments(text(&cache))), 3, &["`yosys` is version 0.8", "0.10"]);
    let hanging = yosys("echo begun; sleep 1000");
    let page = ["widths", "one-tick", "--no-trials", "--price", "--tool-timeout", "2", "--cache", text(&cache)];
    let output = with("tool-price", &[ghdl, ("yosys", &hanging), nextpnr], &page);
    assert_blamed(&output, 4, &["yosys was killed: no end after 2 s (--tool-timeout)", "begun"]);
    assert_eq!(names(&cache), [""; 0]);
}

#[test]
fn the_time_limit_of_tools_holds_for_their_versions() {
    let hanging = [("ghdl", "sleep 1000"), ("yosys", "sleep 1000"), ("verilator", "sleep 1000")];
    let knee = "testbench/dut/knee.toml";
    for (arguments, tool) in [
        (&["check", "saturator"][..], "ghdl"),
        (&LOOP, "ghdl"),
        (&["cost", "pwm", "--cache", "/nowhere"], "ghdl"),
        (&["cost", "--scene", knee], "yosys"),
        (&["run", knee], "verilator"),
        (&["check", "saturator", "--formal"], "ghdl"),
    ] {
        let start = Instant::now();
        let output = with("tool-hang-version", &hanging, &[arguments, &["--tool-timeout", "0.5"]].concat());
        let killed = format!("{tool} was killed: no end after 0.5 s (--tool-timeout) when asked to tell its version");
        assert_blamed(&output, 4, &[&killed]);
        assert!(start.elapsed() < Duration::from_secs(20), "{arguments:?}: {:?}", start.elapsed());
    }
}

/// Nine runs of a design on one thread: each tool tells its version once.
#[test]
fn a_study_asks_each_tool_for_its_version_once() {
    let asked = scratch("tool-version-asked").join("asked");
    let script = |tool: &str, option: &str| {
        let note = format!("echo {tool} >> '{}'", text(&asked));
        format!("if [ \"$1\" = {option} ]; then {note}; fi\nexec {tool} \"$@\"")
    };
    let scripts = [("verilator", script("verilator", "--version")), ("yosys", script("yosys", "-V"))];
    let scripts = scripts.each_ref().map(|(name, script)| (*name, script.as_str()));
    let axes = ["--x", "dut.ports.gain=50..150:3", "--y", "hand.stiffness=0.1..0.3 N.m/rad:3"];
    let map = ["map", "testbench/dut/knee.toml", "--set", "run.duration=10 ms", "--jobs", "1"];
    let output = with("tool-version-once", &scripts, &[&map[..], &axes].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let mut told: Vec<_> = fs::read_to_string(&asked).expect("questions").lines().map(str::to_string).collect();
    told.sort();
    assert_eq!(told, ["verilator", "yosys"]);
}

#[test]
fn the_time_limit_of_tools_holds_for_the_commands_of_slurm() {
    let dir = scratch("tool-slurm");
    let study = "name = \"s\"\ntitle = \"S\"\n[map]\nscene = \"hybrid-wall\"\nx = \"wall.stiffness=0.5..1 N.m/rad:2\"\n\
                 y = \"wall.damping=0..0.4 mN.m.s/rad:2\"\nfull = true\nset = [\"run.duration=1 ms\"]\n";
    let (file, out) = (dir.join("study.toml"), dir.join("sweep"));
    fs::write(&file, study).expect("a study");
    let output = hpu().args(["sweep", "plan", text(&file), "-o", text(&out)]).output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let hangs = "echo begun >&2; sleep 1000";
    for (name, scripts) in [
        ("squeue", [("squeue", hangs), ("sbatch", "echo 1"), ("scontrol", "exit 1")]),
        ("sbatch", [("squeue", "exit 0"), ("sbatch", hangs), ("scontrol", hangs)]),
    ] {
        let submit = ["sweep", "submit", text(&out), "--engine", "slurm", "--tool-timeout", "0.5"];
        let output = with("tool-hang-slurm", &scripts, &submit);
        assert_blamed(&output, 4, &[&format!("error: {name}: killed: no end after 0.5 s (--tool-timeout)")]);
    }
}
