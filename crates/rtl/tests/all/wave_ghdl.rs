//! The hierarchy of these waveforms is the one that GHDL dumps for the same design.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_datapath::phantom::{Config, PhantomIo, PhantomLoop, PhantomSharedLoop};
use hpu_datapath::{ConventionalLoop, HybridLoop, LoopConfig, PwmConfig, Wiring};
use hpu_signal::{Clock, Cycle, Real};
use hpu_wave::{Layout, Vcd};
use vcd::{Parser, Scope, ScopeItem};

/// Returns the variables of a dump, in order: path, name, kind, width.
fn variables(dump: &[u8], top: &str) -> Vec<String> {
    fn walk(scope: &Scope, path: &str, list: &mut Vec<String>) {
        let path = format!("{path}{}.", scope.identifier);
        list.push(format!("{} {path}", scope.scope_type));
        for item in &scope.items {
            match item {
                ScopeItem::Var(var) => list.push(format!("{} {} {path}{}", var.var_type, var.size, var.reference)),
                ScopeItem::Scope(inner) => walk(inner, &path, list),
                _ => {}
            }
        }
    }
    let header = Parser::new(dump).parse_header().expect("a VCD header");
    let mut list = Vec::new();
    walk(header.find_scope(&[top]).expect("the top scope"), "", &mut list);
    list
}

fn ghdl(directory: &Path, arguments: &[&str]) {
    let output = Command::new("ghdl").current_dir(directory).args(arguments).output();
    let output = output.expect("ghdl can be started (Debian package ghdl-mcode)");
    assert!(output.status.success(), "ghdl {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Returns the dump of GHDL for an entity of `hdl/`, elaborated with these generics.
fn dumped_by_ghdl(entity: &str, case: &str, generics: &[String]) -> Vec<u8> {
    let directory = std::env::temp_dir().join(format!("hpu-wave-{entity}-{case}-{}", std::process::id()));
    fs::create_dir_all(&directory).expect("a work directory");
    let hdl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl");
    let files = fs::read_dir(&hdl).expect("hdl/").map(|file| file.expect("a file of hdl/").path());
    let files: Vec<PathBuf> = files.filter(|file| file.extension().is_some_and(|kind| kind == "vhd")).collect();
    let mut import = vec!["-i", "--std=08"];
    import.extend(files.iter().map(|file| file.to_str().expect("a path in UTF-8")));
    ghdl(&directory, &import);
    ghdl(&directory, &["-m", "--std=08", entity]);
    let mut run = vec!["-r", "--std=08", entity];
    run.extend(generics.iter().map(String::as_str));
    run.extend(["--ieee-asserts=disable", "--vcd=dump.vcd", "--stop-time=1ns"]);
    ghdl(&directory, &run);
    let dump = fs::read(directory.join("dump.vcd")).expect("the dump");
    fs::remove_dir_all(&directory).expect("the work directory can go");
    dump
}

/// Signals inside blocks at which proofs begin anew. They are not ports, so these waveforms leave them out.
const INSIDE: [(&str, &[&str]); 3] = [
    ("forward", &["r", "height", "reach"]),
    ("jacobian", &["radial", "upper", "fore", "arm_x", "arm_z"]),
    ("room_walls", &["depth_x", "depth_y", "depth_z"]),
];

/// Returns whether a variable, as [`variables`] describes it, is one of these inner signals.
fn is_inside(variable: &str) -> bool {
    let mut path = variable.rsplit(' ').next().unwrap_or_default().rsplit('.');
    let (name, instance) = (path.next().unwrap_or_default(), path.next().unwrap_or_default());
    let name = name.split('[').next().unwrap_or_default();
    INSIDE.iter().any(|(inside, names)| *inside == instance && names.contains(&name))
}

fn agrees<W: Wiring>(wiring: &W, case: &str, generics: &[String]) {
    let reals = [Real { name: "angle_rad", doc: "beside the design" }];
    let layout = Layout::new(wiring, &reals).with_clock();
    let clock = Clock::new(50_000_000).expect("valid");
    let ours = Vcd::new(Vec::new(), &layout, clock).and_then(|vcd| vcd.finish(Cycle(0))).expect("memory");
    let mut theirs = variables(&dumped_by_ghdl(W::NAME, case, generics), W::NAME);
    theirs.retain(|variable| !is_inside(variable));
    assert_eq!(variables(&ours, W::NAME), theirs);
}

#[test]
fn the_hybrid_loop_has_the_variables_that_ghdl_dumps() {
    agrees(&HybridLoop::new(LoopConfig::default()).expect("valid"), "default", &[]);
}

#[test]
fn the_conventional_loop_has_the_variables_that_ghdl_dumps() {
    agrees(&ConventionalLoop::new(LoopConfig::default()).expect("valid"), "default", &[]);
}

#[test]
fn other_widths_are_the_widths_that_ghdl_dumps() {
    let config = LoopConfig {
        position_width: 16,
        velocity_width: 10,
        period_width: 20,
        pwm: PwmConfig { width: 9, ..PwmConfig::default() },
        ..LoopConfig::default()
    };
    let generics = ["POSITION_WIDTH=16", "VELOCITY_WIDTH=10", "PERIOD_WIDTH=20", "PWM_WIDTH=9"];
    let generics = generics.map(|generic| format!("-g{generic}"));
    agrees(&HybridLoop::new(config).expect("valid"), "widths", &generics);
}

#[test]
fn a_loop_that_settles_has_the_variables_of_one_that_does_not() {
    let config = LoopConfig { settling: 2, ..LoopConfig::default() };
    agrees(&HybridLoop::new(config).expect("valid"), "settling", &["-gSETTLING=2".to_string()]);
}

#[test]
fn the_loops_of_a_phantom_have_the_variables_that_ghdl_dumps() {
    agrees(&PhantomLoop::default(), "default", &[]);
    agrees(&PhantomSharedLoop::default(), "default", &[]);
    agrees(&PhantomIo::default(), "default", &[]);
}

#[test]
fn a_phantom_of_other_words_has_the_widths_that_ghdl_dumps() {
    let config = Config { position_width: 18, depth_width: 11, ..Config::plain_q22() };
    let generics = [
        "POSITION_WIDTH=18",
        "DEPTH_WIDTH=11",
        "LENGTH_FRAC=22",
        "LENGTH_1=587203",
        "LENGTH_2=587203",
        "POSITION_INT=9",
        "POSITION_FRAC=22",
        "STIFFNESS_INT=9",
        "STIFFNESS_FRAC=22",
        "FORCE_INT=9",
        "FORCE_FRAC=22",
        "FORCE_LIMIT=35651584",
        "TORQUE_INT=9",
        "TORQUE_FRAC=22",
    ];
    let generics = generics.map(|generic| format!("-g{generic}"));
    agrees(&PhantomLoop::new(config).expect("valid"), "words", &generics);
}
