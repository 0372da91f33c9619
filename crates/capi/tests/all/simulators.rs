//! Testbenches in GHDL and Verilator around the plant, as `simulators/` lets others write them.

use std::path::Path;
use std::process::Command;

use hpu::Plant;

use crate::common::{compiled, folder, here, library, said, set, shipped};

/// The hand meets the wall after a millisecond.
const SCENE: [&str; 3] = ["hybrid-wall", "run.duration=2 ms", "wall.position=0.0016 rad"];

/// Asserts that a testbench tells the clock edges and states that the program in C tells, digit by digit.
fn same_as_in_c(said_by: &str, testbench: &str) {
    let motor = compiled("examples/motor.c", &[], testbench, "motor");
    let in_c = said(Command::new(motor).args(SCENE));
    let names = ["edge ", "current_a ", "speed_rad_per_s ", "angle_rad "];
    let states = |text: &str| {
        let lines = text.lines().filter(|line| names.iter().any(|name| line.starts_with(name)));
        lines.map(str::to_string).collect::<Vec<_>>()
    };
    assert_eq!(states(said_by), states(&in_c));
    assert_eq!(states(&in_c).len(), names.len(), "{in_c}");
    let position = in_c.lines().find_map(|line| line.strip_prefix("position ")?.parse::<i64>().ok());
    assert!(position > Some(1), "the wall at a count is touched: {in_c}");
}

#[test]
fn a_testbench_in_vhdl_moves_the_plant_as_the_program_in_c() {
    let work = "ghdl";
    let hdl = here().join("../../hdl");
    let blocks = [
        "synchronizer",
        "quadrature_decoder",
        "position_counter",
        "displacement",
        "unilateral",
        "rounding_pkg",
        "truncating_multiplier",
        "velocity_register",
        "torque_sum",
        "command_limiter",
        "pwm",
        "hybrid_loop",
    ];
    let mut files: Vec<_> = blocks.iter().map(|block| hdl.join(format!("{block}.vhd"))).collect();
    files.extend(["simulators/hpu_plant.vhd", "examples/motor_tb.vhd"].map(|file| here().join(file)));
    said(ghdl(work).args(["-a", "--std=08"]).args(files));
    let scene = format!("-gSCENE={}", SCENE.join(";"));
    let ran = said(ghdl(work).args(["-r", "--std=08", "motor_tb", "--ieee-asserts=disable", &scene]));
    same_as_in_c(&ran, "ghdl");
}

/// GHDL in the folder of this name, with the functions of `hpu_sim.c`.
fn ghdl(work: &str) -> Command {
    let shim = compiled("simulators/hpu_sim.c", &["-shared", "-fPIC"], work, "libhpu_sim.so");
    let places = [shim.parent().expect("a folder"), &library()].map(|path| path.display().to_string());
    let mut ghdl = Command::new("ghdl");
    ghdl.current_dir(folder(work)).env("LD_LIBRARY_PATH", places.join(":"));
    ghdl
}

#[test]
fn a_testbench_in_vhdl_drives_a_word_as_the_library_does() {
    let work = "ghdl-push";
    let files = ["simulators/hpu_plant.vhd", "tests/push_tb.vhd"].map(|file| here().join(file));
    said(ghdl(work).args(["-a", "--std=08"]).args(files));
    let ran = said(ghdl(work).args(["-r", "--std=08", "push_tb", "--ieee-asserts=disable"]));
    let position = ran.trim().strip_prefix("position_m ").and_then(|value| value.parse::<f64>().ok());

    let mut plant = Plant::open(&shipped("rail-drop"), &set(&["run.duration=20 ms"])).expect("a plant");
    plant.drive(&[300]).expect("a command");
    plant.advance(100_000).expect("a run");
    let state = plant.states().position(|state| state.name == "position_m").expect("a position");
    assert_eq!(position, Some(plant.state(state).expect("a state")), "{ran}");
}

#[test]
fn a_testbench_in_systemverilog_moves_the_plant_as_the_program_in_c() {
    let work = folder("verilator");
    let (folder, include) = (library().display().to_string(), here().join("include").display().to_string());
    let mut verilator = Command::new("verilator");
    verilator.args(["--binary", "--timing", "--top-module", "motor_tb", "--Mdir"]).arg(&work);
    // Compiled fast, not to be fast.
    verilator.args(["-j", "2", "-MAKEFLAGS", "OPT_FAST=-O0 OPT_SLOW=-O0 OPT_GLOBAL=-O0"]);
    verilator.arg("-CFLAGS").arg(format!("-I{include}"));
    verilator.arg("-LDFLAGS").arg(format!("-L{folder} -lhpu -Wl,--disable-new-dtags,-rpath,{folder}"));
    let files = ["simulators/hpu_plant.sv", "examples/motor_tb.sv", "simulators/hpu_sim.c"];
    said(verilator.args(files.map(|file| here().join(file))));
    let program = Path::new(&work).join("Vmotor_tb");
    let ran = said(Command::new(program).arg(format!("+scene={}", SCENE.join(";"))));
    same_as_in_c(&ran, "verilator");
}
