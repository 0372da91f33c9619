//! Scenes by somebody else: what is executed of them and what is not, and what is believed that lies in a folder.

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use crate::common::{assert_refused, code, hpu, json, names, scratch, stderr, stdout, text, tools};

/// The file that a design makes where it is executed.
const CANARY: &str = "CANARY";

/// Returns a scene of a design in one file.
fn scene(file: &str, more: &str) -> String {
    format!(
        "about = \"somebody's scene\"\n\
         device = {{ kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }}\n\
         clock = {{ frequency = \"10 MHz\" }}\nwall = {{ position = \"1.5 rad\", varies = \"dut.generics.GAIN\" }}\n\
         run = {{ duration = \"10 us\" }}\n\
         hand = {{ kind = \"spring_damper\", stiffness = \"0.3 N.m/rad\", damping = \"0.1 mN.m.s/rad\", \
         path = [[\"0 s\", 0], [\"150 ms\", 1.4]] }}\n\
         [dut]\nfiles = [\"{file}\"]\ntop = \"top\"\nclock = \"clk\"\nreset = {{ port = \"rst\" }}\n\
         ports = {{ a = \"encoder.a\", b = \"encoder.b\", pwm = \"bridge.pwm\", dir = \"bridge.direction\" }}\n\
         generics = {{ GAIN = 3 }}\n{more}\n"
    )
}

const VERILOG: &str = "module top #(parameter GAIN = 3) (input clk, input rst, input a, input b, \
    output reg pwm, output reg dir);\nreg [7:0] c; HERE\n\
    always @(posedge clk) if (rst) begin c <= 0; pwm <= 0; dir <= 0; end \
    else begin c <= c + GAIN; pwm <= c[7] & a; dir <= b; end\nendmodule\n";

/// VHDL that calls `system` of the C library: as a constant of a package is computed, and in a process.
fn vhdl(canary: &Path) -> String {
    let command = format!("touch {}", text(canary));
    let command = format!("\"{command:199}\" & nul");
    format!(
        "package p is\n  subtype cmd is string (1 to 200);\n  function shell (s : cmd) return integer;\n  \
         attribute foreign of shell : function is \"VHPIDIRECT libc.so.6 system\";\nend package;\n\
         package body p is\n  function shell (s : cmd) return integer is begin return 0; end;\nend package body;\n\
         library ieee; use ieee.std_logic_1164.all; use work.p.all;\n\
         entity top is\n  generic (GAIN : integer := 1);\n  \
         port (clk, rst, a, b : in std_logic; pwm, dir : out std_logic);\nend;\n\
         architecture x of top is\n  constant C : integer := shell({command});\nbegin\n  \
         pwm <= '0' when rst = '1' or C = GAIN else a; dir <= b;\n  \
         -- pragma translate_off\n  process variable r : integer; begin r := shell({command}); wait; end process;\n  \
         -- pragma translate_on\nend;\n"
    )
}

/// Puts designs that execute something into a folder, with their scenes.
fn designs(dir: &Path) {
    let canary = dir.join(CANARY);
    let initial = format!("initial $system(\"touch {}\");", text(&canary));
    let dpi = "import \"DPI-C\" function integer abs(integer i); localparam C = abs(-3);";
    for (name, text) in [
        ("system.v", VERILOG.replace("HERE", &initial)),
        ("dpi.v", VERILOG.replace("HERE", dpi)),
        ("foreign.vhd", vhdl(&canary)),
        // A file of this name is what make reads first.
        ("Makefile.v", VERILOG.replace("HERE", "")),
    ] {
        fs::write(dir.join(name), text).expect("a design");
        let (stem, end) = name.split_once('.').expect("an ending");
        let engine = if end == "vhd" { "engine = \"ghdl\"" } else { "" };
        fs::write(dir.join(format!("{stem}.toml")), scene(name, engine)).expect("a scene");
    }
}

/// Runs a command in a folder, with a cache of its own there.
fn within(dir: &Path, arguments: &[&str]) -> Output {
    command(dir, arguments).output().expect("starts")
}

fn command(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = hpu();
    command.args(arguments).current_dir(dir).env("XDG_CACHE_HOME", dir.join("cache"));
    command
}

#[test]
fn only_verbs_that_simulate_run_a_design() {
    let dir = scratch("trust-verbs");
    designs(&dir);
    let canary = dir.join(CANARY);
    // A run does execute the design, or the rest of this test would prove nothing.
    for of in ["system", "foreign"] {
        let output = within(&dir, &["run", &format!("{of}.toml")]);
        assert!(canary.exists(), "{of}: {}{}", stdout(&output), stderr(&output));
        fs::remove_file(&canary).expect("it was made");
    }
    let page = dir.join("page.html");
    fs::write(&page, "<script type=\"application/json\" id=\"start\">{}</script>").expect("a page");
    for of in ["system", "foreign", "dpi", "Makefile"] {
        let scene = format!("{of}.toml");
        for verb in [
            &["cost", "--scene", &scene][..],
            &["scenes", "show", &scene],
            &["keys", "dut"],
            &["explore", &scene, "--page", text(&page), "-o", "explore.html"],
            &["fit", "hybrid-wall", "--set", "run.duration=1 ms"],
            &["run", "hybrid-wall", "--edges", "100"],
            &["report", "hybrid-wall", "--set", "run.duration=1 ms", "-o", "report.html"],
            &["vectors", "saturator", "-o", "vectors"],
        ] {
            let output = within(&dir, verb);
            assert!(!canary.exists(), "{verb:?}: {}{}", stdout(&output), stderr(&output));
            let is_done = code(&output) == 0 || verb[0] == "cost";
            assert!(is_done, "{verb:?}: {}{}", stdout(&output), stderr(&output));
        }
    }
    // Yosys would call the function while it reads Verilog; the constant would be 3.
    let output = within(&dir, &["cost", "--scene", "dpi.toml"]);
    assert_refused(&output, 1, &["yosys refuses `top`", "DPI function"]);
    // A later GHDL may call functions of a library while it synthesises.
    let later = "case \"$1\" in --version) echo 'GHDL 4.0.0';; *) touch CANARY;; esac".replace(CANARY, text(&canary));
    let others = [("yosys", "echo 'Yosys 0.23'"), ("nextpnr-ice40", "echo nextpnr 0.4")];
    let tools = tools(&dir, &[&[("ghdl", &*later)], &others[..]].concat());
    let output = command(&dir, &["cost", "--scene", "foreign.toml"]).env("PATH", tools).output().expect("starts");
    assert_refused(&output, 1, &["ghdl refuses `top`", "attribute foreign", "GHDL 4.0.0"]);
    assert!(!canary.exists());
    // Yosys has no such task.
    assert_refused(&within(&dir, &["cost", "--scene", "system.toml"]), 1, &["yosys refuses `top`", "$system"]);
    let output = within(&dir, &["cost", "--scene", "Makefile.toml", "--json"]);
    assert_eq!(json(&output)["ff"], 10, "eight bits of the counter and two outputs: {}", stderr(&output));
}

#[test]
fn no_verb_simulates_a_design_where_that_is_forbidden() {
    let dir = scratch("trust-forbidden");
    designs(&dir);
    for (of, entity, file) in [("system", "top", "system.v"), ("foreign", "top", "foreign.vhd")] {
        let scene = format!("{of}.toml");
        let study = format!(
            "name = \"s\"\ntitle = \"S\"\n[map]\nscene = \"{scene}\"\nx = \"dut.generics.GAIN=1..2:2\"\n\
             y = \"hand.stiffness=0.1..0.2 N.m/rad:2\"\nfull = true\n"
        );
        fs::write(dir.join("study.toml"), study).expect("a study");
        let axes = ["--x", "dut.generics.GAIN=1..2:2", "--y", "hand.stiffness=0.1..0.2 N.m/rad:2"];
        let map = [&["map", &scene][..], &axes].concat();
        let sweep = format!("-o=sweep-{of}");
        for verb in [
            &["run", &scene][..],
            &["report", &scene, "-o", "report.html"],
            &["limits", &scene, "--range", "1..2"],
            &map,
            &["chart", &scene, "-o", "chart"],
            &["fit", &scene],
            &["widths", &scene],
            &["study", "study.toml"],
            &["sweep", "run", "study.toml", &sweep, "--quiet"],
            &["check", "--entity", entity, "--as", "saturator", file],
        ] {
            let by_flag = within(&dir, &[verb, &["--no-dut"]].concat());
            let by_variable = command(&dir, verb).env("HPU_NO_DUT", "1").output().expect("starts");
            for output in [by_flag, by_variable] {
                let said = stderr(&output) + &stdout(&output);
                assert!(!dir.join(CANARY).exists(), "{verb:?}: {said}");
                assert_ne!(code(&output), 0, "{verb:?}: {said}");
                // Some verbs take no design at all.
                let takes_none = said.contains("asks for blocks of hpu's own");
                assert!(takes_none || code(&output) == 2 && said.contains("--no-dut forbids"), "{verb:?}: {said}");
            }
        }
        let output = command(&dir, &["run", &scene]).env("HPU_NO_DUT", "1").output().expect("starts");
        assert_refused(&output, 2, &["the design `top` is not simulated", "HPU_NO_DUT or --no-dut"]);
    }
    // What simulates no design runs; so does a design where the variable is 0.
    let output = command(&dir, &["cost", "--scene", "Makefile.toml", "--no-dut"]).output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let output = command(&dir, &["run", "Makefile.toml"]).env("HPU_NO_DUT", "0").output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let output = within(&dir, &["run", "hybrid-wall", "--edges", "100", "--no-dut"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

/// Returns the only file of this name below a folder.
fn found(folder: &Path, name: &str) -> PathBuf {
    let output = Command::new("find").arg(folder).args(["-name", name, "-type", "f"]).output().expect("find");
    let said = stdout(&output);
    let all: Vec<_> = said.lines().collect();
    assert_eq!(all.len(), 1, "{name}: {said}");
    PathBuf::from(all[0])
}

#[test]
fn a_model_that_was_changed_is_not_run_and_a_cost_that_was_changed_is_not_believed() {
    let dir = scratch("trust-cache");
    designs(&dir);
    let cache = dir.join("cache/hpu/dut");
    let run = || within(&dir, &["run", "Makefile.toml", "--json", "--set", "dut.engine=verilator"]);
    let cost = || within(&dir, &["cost", "--scene", "Makefile.toml", "--json"]);
    let (motion, price) = (json(&run()), json(&cost()));
    let mode = |path: &Path| fs::metadata(path).expect("it is there").mode() & 0o777;
    assert_eq!((mode(&cache), mode(&dir.join("cache"))), (0o700, 0o700));
    let (model, kept_cost) = (found(&cache, "model"), found(&cache, "cost"));
    let script = format!("#!/bin/sh\ntouch {CANARY}\n");
    let changes: [(&str, &dyn Fn()); 7] = [
        ("a script in the place of the model", &|| fs::write(&model, &script).expect("written")),
        ("a model that ends early", &|| fs::write(&model, &fs::read(&model).expect("read")[..999]).expect("written")),
        ("no model", &|| fs::remove_file(&model).expect("removed")),
        ("a model that others can write", &|| {
            fs::set_permissions(&model, fs::Permissions::from_mode(0o777)).expect("rights");
        }),
        ("a link in the place of the model", &|| {
            fs::write(dir.join("script"), &script).expect("written");
            fs::set_permissions(dir.join("script"), fs::Permissions::from_mode(0o755)).expect("rights");
            fs::remove_file(&model).expect("removed");
            symlink(dir.join("script"), &model).expect("a link");
        }),
        ("another cost", &|| {
            let text = fs::read_to_string(&kept_cost).expect("a cost");
            fs::write(&kept_cost, text.replacen(char::is_numeric, "99", 1)).expect("written");
        }),
        ("no seal", &|| {
            for kept in [&model, &kept_cost] {
                let folder = kept.ancestors().find(|folder| folder.parent() == Some(&cache)).expect("a folder");
                fs::write(folder.join("whole"), "tools").expect("written");
            }
        }),
    ];
    for (what, change) in changes {
        change();
        let (again, cost) = (run(), cost());
        assert_eq!((code(&again), code(&cost)), (0, 0), "{what}: {}{}", stderr(&again), stderr(&cost));
        assert_eq!(json(&again)["final_angle_rad"], motion["final_angle_rad"], "{what}");
        assert_eq!(json(&cost), price, "{what}");
        assert!(!dir.join(CANARY).exists(), "{what}");
    }
    // A file of another user is passed over; only the administrator can make one.
    if fs::metadata(&cache).expect("a folder").uid() == 0 {
        std::os::unix::fs::chown(&kept_cost, Some(12345), None).expect("another owner");
        assert_eq!(code(&cost()), 0);
        assert_eq!(fs::metadata(&kept_cost).expect("a cost").uid(), 0, "it is made again");
    }
    // The parts of Verilator that every model has are linked into the next one. Damaged ones are compiled again and
    // replaced.
    let runtime = names(&cache).into_iter().find(|name| name.starts_with("runtime-")).expect("a folder");
    let runtime = cache.join(runtime).join("verilated.o");
    let whole = fs::read(&runtime).expect("a part");
    // Other models share the file.
    fs::remove_file(&runtime).and_then(|()| fs::write(&runtime, "nothing that can be linked")).expect("written");
    fs::write(dir.join("Makefile.v"), VERILOG.replace("HERE", "// another design")).expect("a design");
    let output = run();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(fs::read(&runtime).expect("a part") == whole, "it is not replaced");
}

#[test]
fn tools_come_from_absolute_folders_of_the_path_alone() {
    let dir = scratch("trust-path");
    designs(&dir);
    let script = format!("#!/bin/sh\ntouch {}\n", text(&dir.join(CANARY)));
    for name in ["ghdl", "yosys", "nextpnr-ice40", "verilator", "make", "z3", "yices-smt2", "bitwuzla", "python3", "sh"]
    {
        for folder in [dir.clone(), dir.join("bin")] {
            fs::create_dir_all(&folder).expect("a folder");
            fs::write(folder.join(name), &script).expect("a script");
            fs::set_permissions(folder.join(name), fs::Permissions::from_mode(0o755)).expect("it may run");
        }
    }
    let path = std::env::var("PATH").expect("a PATH");
    let before = format!(":.:bin:./bin:..:::{path}:");
    let nothing = ["", ":", ".", "bin:."].map(String::from);
    for path in [&before].into_iter().chain(&nothing) {
        for verb in [&["run", "Makefile.toml"][..], &["cost", "--scene", "Makefile.toml"], &["check", "saturator"]] {
            // Without a cache, every tool is asked for.
            let _ = fs::remove_dir_all(dir.join("cache"));
            let output = command(&dir, verb).env("PATH", path).output().expect("starts");
            assert!(!dir.join(CANARY).exists(), "{path:?} {verb:?}: {}{}", stdout(&output), stderr(&output));
            let expected = if nothing.contains(path) { 3 } else { 0 };
            assert_eq!(code(&output), expected, "{path:?} {verb:?}: {}{}", stdout(&output), stderr(&output));
        }
    }
}

#[test]
fn no_module_of_python_comes_from_the_current_folder() {
    let dir = scratch("trust-python");
    let made = format!("import os\nos.system('touch {}')\n", text(&dir.join(CANARY)));
    for module in ["bitwuzla.py", "sys.py", "os.py", "site.py", "usercustomize.py"] {
        fs::write(dir.join(module), &made).expect("a module");
    }
    let version = |said: &str| format!("echo '{said}'");
    let [ghdl, yosys, z3, yices] = ["GHDL 2.0.0", "Yosys 0.23", "Z3 version 4.12", "Yices 2.6.4"].map(version);
    // The real Python, under its own name.
    let python =
        stdout(&Command::new("python3").args(["-c", "import sys; print(sys.executable)"]).output().expect("Python"));
    let python = format!("exec {} \"$@\"", python.trim());
    let all = [("ghdl", &*ghdl), ("yosys", &yosys), ("z3", &z3), ("yices-smt2", &yices), ("python3", &python)];
    let tools = tools(&dir, &all);
    let mut command = command(&dir, &["check", "saturator", "--formal"]);
    let output = command.env("PATH", tools).env("PYTHONPATH", &dir).output().expect("starts");
    assert!(!dir.join(CANARY).exists(), "{}", stderr(&output));
}

#[test]
fn a_shipped_scene_reads_its_own_data() {
    let (dir, other) = (scratch("trust-shipped"), scratch("trust-shipped-elsewhere"));
    fs::write(dir.join("replay-motion.csv"), "time_s,angle_rad\n0,0\n0.5,1.9\n2,1.9\n").expect("a recording");
    let run = |dir: &Path| json(&within(dir, &["run", "replay-motion", "--set", "run.duration=20 ms", "--json"]));
    let [shadowed, plain] = [&dir, &other].map(|dir| run(dir)["final_angle_rad"].clone());
    assert_eq!(shadowed, plain);
    // A file that no shipped scene has is the one where the command runs.
    fs::rename(dir.join("replay-motion.csv"), dir.join("mine.csv")).expect("renamed");
    let set = ["--set", "hand.file=mine.csv", "--set", "run.duration=20 ms"];
    let output = within(&dir, &[&["run", "replay-motion", "--json"][..], &set].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

/// Runs a check with a GHDL that tells the rights of its folder, with this folder for temporary files.
fn checked(dir: &Path, work: &Path) -> Output {
    let ghdl = format!(
        "case \"$1\" in --version) echo 'GHDL 2.0.0'; exit;; -a) stat -c %a . >{}; exit;; esac\nexit 1",
        text(&dir.join("rights"))
    );
    let tools = tools(dir, &[("ghdl", &ghdl)]);
    let mut command = command(dir, &["check", "saturator", "--jobs", "1"]);
    command.env("PATH", tools).env("TMPDIR", work).output().expect("starts")
}

#[test]
fn folders_for_work_are_nobody_elses() {
    let dir = scratch("trust-rights");
    checked(&dir, &dir);
    assert_eq!(fs::read_to_string(dir.join("rights")).expect("GHDL ran"), "700\n");
}

#[test]
fn what_is_foreign_in_the_folder_for_temporary_files_is_passed_over() {
    let dir = scratch("trust-temporary");
    let work = dir.join("work");
    fs::create_dir_all(work.join("target")).expect("a folder");
    fs::write(work.join("target/kept"), "kept").expect("a file");
    let fifo = work.join("hpu-ghdl-work-x");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo").success());
    symlink(work.join("target"), work.join("hpu-ghdl-work-link")).expect("a link");
    symlink("hpu-ghdl-work-x", work.join("hpu-ghdl-work-to-fifo")).expect("a link");
    fs::create_dir(work.join("hpu-ghdl-work-left")).expect("a folder that a killed process has left");
    let mut expected = vec!["hpu-ghdl-work-link", "hpu-ghdl-work-to-fifo", "hpu-ghdl-work-x", "target"];
    if fs::metadata(&dir).expect("a folder").uid() == 0 {
        // Only the administrator can make a folder of another user.
        let other = work.join("hpu-ghdl-work-other");
        fs::create_dir(&other).expect("a folder");
        std::os::unix::fs::chown(&other, Some(12345), None).expect("another owner");
        expected.insert(2, "hpu-ghdl-work-other");
    }
    expected.sort_unstable();
    let start = Instant::now();
    checked(&dir, &work);
    assert!(start.elapsed() < Duration::from_secs(30), "{:?}", start.elapsed());
    assert_eq!(names(&work), expected);
    assert_eq!(names(&work.join("target")), ["kept"]);
    // A FIFO among the results is passed over too.
    let out = dir.join("out");
    fs::create_dir(&out).expect("a folder");
    assert!(Command::new("mkfifo").arg(out.join(".x.hpu-1-1.tmp")).status().expect("mkfifo").success());
    let output = within(&dir, &["run", "free-motion", "--edges", "100", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}
