//! Designs by others in the loop: those of `testbench/dut`, which were written from an interface alone, and our own
//! loop as if it were by others.

use std::collections::BTreeMap;
use std::fs;
use std::io::BufReader;
use std::path::Path;

use serde_json::Value;
use vcd::{Command, IdCode, Parser, ScopeItem};

use crate::common::{ROOT, assert_refused, code, json, names, run, scratch, stderr, stdout, text};

/// Stall torque of the motor at 24 V in N.m, and the angle of a count in rad.
const STALL_NM: f64 = 0.265;
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn three_designs_of_others_settle_on_the_wall_that_their_gains_make() {
    // The gain in sixteenths of a PWM count per count, and the PWM counts of a period, according to the READMEs.
    for (scene, gain, period) in [("knee", 95.0, 1023.0), ("rim", 95.0, 1024.0), ("paddle", 190.0, 2047.0)] {
        let path = format!("testbench/dut/{scene}.toml");
        let lines = fs::read_to_string(Path::new(ROOT).join(&path)).expect("a scene").lines().count();
        assert!(lines <= 25, "{scene}: {lines} lines");
        let value = json(&run(&["run", &path, "--json"]));
        assert_eq!(value["outcome"]["kind"], "settled", "{scene}");
        assert_eq!(number(&value["contact_share"]), 1.0, "{scene}");
        // The spring sees whole counts: up to one count less than the depth, which is about 45 counts.
        let asked = gain / 16.0 / period * STALL_NM / COUNT_RAD;
        let share = number(&value["displayed_stiffness"]) / asked;
        assert!((0.97..1.003).contains(&share), "{scene}: {share} of {asked}");
        let energy = &value["energy"];
        assert!(number(&energy["residual_j"]).abs() < 1e-12 * number(&energy["exchanged_j"]), "{scene}");
        let engine = value["dut"]["engine"].as_str().expect("a text");
        let leaps = engine.starts_with("hpu's leaps") && engine.ends_with("% of the clock edges leapt over)");
        assert!(leaps, "{scene}: {engine}");
    }
}

/// Field-oriented control in Verilog and six steps in VHDL-93, both around a motor with three phases.
#[test]
fn two_designs_turn_a_motor_with_three_phases_and_settle_on_their_wall() {
    let quick = ["--set", "run.duration=250 ms", "--set", "hand.path=[[0, 0], [0.1, 0.6]]", "--json"];
    for (scene, start) in [
        ("foc", "hpu's leaps over Yosys' netlist of the Verilog ("),
        ("hall", "hpu's leaps over Yosys' netlist of the Verilog of GHDL's"),
    ] {
        let path = format!("testbench/dut/{scene}.toml");
        let value = json(&run(&[&["run", &path][..], &quick].concat()));
        assert_eq!(value["outcome"]["kind"], "settled", "{scene}");
        let energy = &value["energy"];
        assert!(number(&energy["residual_j"]).abs() < 1e-12 * number(&energy["exchanged_j"]), "{scene}");
        let engine = value["dut"]["engine"].as_str().expect("a text");
        assert!(engine.starts_with(start), "{scene}: {engine}");
        if scene == "foc" {
            // The gain is in sixteenths of a step of current, 33 A / 4096, for a count, a turn / 16384.
            let asked = 32.0 / 16.0 * (33.0 / 4096.0) * 0.05 / (std::f64::consts::TAU / 16384.0);
            let share = number(&value["displayed_stiffness"]) / asked;
            assert!((0.97..1.01).contains(&share), "{share} of {asked}");
        }
    }
}

/// Returns the least and the greatest value of a column of a run's trace from a time on.
fn swing(scene: &str, sets: &[&str], column: &str, from_s: f64) -> (f64, f64) {
    let dir = scratch("swing");
    let out = ["run", scene, "--wave", "ports", "--no-plot", "-o", dir.to_str().expect("text")];
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    assert_eq!(code(&run(&out.into_iter().chain(sets).collect::<Vec<_>>())), 0, "{scene}");
    let trace = fs::read_to_string(dir.join("trace.csv")).expect("a trace");
    let mut lines = trace.lines();
    let at = lines.next().and_then(|names| names.split(',').position(|name| name == column)).expect("a column");
    let cells = lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect::<Vec<f64>>());
    let all = cells.filter(|cells| cells[0] >= from_s).map(|cells| cells[at]);
    all.fold((f64::MAX, f64::MIN), |(least, most), value| (least.min(value), most.max(value)))
}

/// The scene says at which angle the knob rests.
#[test]
fn a_knob_behind_field_oriented_control_rests_in_a_detent() {
    let value = json(&run(&["run", "testbench/dut/foc-knob.toml", "--json"]));
    let expected = value["expected"].as_array().expect("expectations");
    assert!(expected.len() == 2 && expected.iter().all(|one| one["met"] == true), "{expected:?}");
    let engine = value["dut"]["engine"].as_str().expect("a text");
    assert!(engine.starts_with("hpu's leaps"), "{engine}");
}

/// The hand's torque swings by the cogging, of 5 mN.m, or by what is left of it: the legs' dead time makes six waves in
/// a turn of the field too, as many as the cogging has, which the current's controllers leave in part.
#[test]
fn cogging_is_felt_and_a_design_takes_it_out() {
    let brief = ["hand.path=[[0, 0], [0.5, 1]]", "run.duration=0.4"];
    let amplitude = |ripple: &str| {
        let (least, most) =
            swing("testbench/dut/foc-cogging.toml", &[&brief[..], &[ripple]].concat(), "hand_torque_nm", 0.2);
        (most - least) / 2.0
    };
    let felt = amplitude("dut.ports.ripple=0");
    assert!((4.5e-3..6e-3).contains(&felt), "{felt}");
    let left = amplitude("dut.ports.ripple=100");
    assert!(left < felt / 3.0, "{left} of {felt}");
}

/// A sample a period later: with d periods between a sample and the first current that its duties make, a loop of a
/// gain k, times the change of a current in a period at 1 V, is unstable beyond k = 1 for d = 1 and 0.64 for d = 2. At
/// 5.6 V/A k is 0.90, at 1.9 V/A 0.30.
#[test]
fn a_current_sensor_that_is_late_makes_the_loop_swing() {
    let amplitude = |latency: &str, gain: &str| {
        let sets = [
            format!("device.sensors.ia.latency={latency}"),
            format!("device.sensors.ib.latency={latency}"),
            format!("dut.ports.proportional={gain}"),
            "run.duration=100 ms".to_string(),
        ];
        let sets: Vec<_> = sets.iter().map(String::as_str).collect();
        let (least, most) = swing("testbench/dut/foc-late.toml", &sets, "current_a", 0.05);
        (most - least) / 2.0
    };
    assert!(amplitude("1 us", "500000") < 0.1);
    assert!(amplitude("30 us", "500000") > 1.0);
    assert!(amplitude("30 us", "169300") < 0.02);
}

/// The project's own loop for three phases as a foreign design; the scene says which angle its current holds.
#[test]
fn our_own_current_loops_hold_a_torque_as_a_foreign_design() {
    let value = json(&run(&["run", "testbench/dut/foc-loop.toml", "--json"]));
    let expected = value["expected"].as_array().expect("expectations");
    assert!(expected.len() == 2 && expected.iter().all(|one| one["met"] == true), "{expected:?}");
    let engine = value["dut"]["engine"].as_str().expect("a text");
    assert!(engine.starts_with("hpu's leaps"), "{engine}");
}

#[test]
fn faults_of_a_design_around_three_phases_are_told() {
    let foc = |more: &[&str]| {
        let quick = ["run", "testbench/dut/foc.toml", "--set", "run.duration=2 ms", "--set", "expect={}"];
        run(&[&quick[..], more].concat())
    };
    let shorted = foc(&["--set", "dut.ports.a_low=not bridge.a_low"]);
    assert_ne!(code(&shorted), 0);
    let said = "both switches of the a leg are closed at clock edge";
    assert!(stderr(&shorted).contains(said), "{}", stderr(&shorted));
    let never = foc(&["--set", "dut.ports.adc_start=open"]);
    let said = "ia: 0 samples, 0 starts while it was converting; the design never started one";
    assert!(stdout(&never).contains(said), "{}", stdout(&never));
    // A converter that takes longer than the design's period misses starts.
    let slow = foc(&["--set", "device.sensors.ia.latency=60 us", "--set", "device.sensors.ib.latency=60 us"]);
    assert!(stdout(&slow).contains("ia: 20 samples, 20 starts while it was converting"), "{}", stdout(&slow));
    // At 200 MHz the bus has a clock of 25 MHz, and the chip's data sheet allows 10.
    let fast = json(&foc(&["--set", "clock.frequency=200 MHz", "--json"]));
    assert_eq!((&fast["frames"][0]["wrong"], &fast["frames"][0]["fast"]), (&0.into(), &fast["frames"][0]["frames"]));
    assert!(fast["frames"][0]["frames"].as_u64().expect("a count") > 100, "{}", fast["frames"]);
    // The design samples while all low switches are closed, so shunts below them show the same currents.
    let brief =
        ["--set", "run.duration=40 ms", "--set", "wall.position=2 mrad", "--set", "hand.path=[[0, 0], [0.02, 0.3]]"];
    let energy = |shunt: &str| {
        let shunts = [format!("device.sensors.ia.shunt={shunt}"), format!("device.sensors.ib.shunt={shunt}")];
        let sets = ["--set", &shunts[0], "--set", &shunts[1], "--set", "expect={}", "--json"];
        json(&run(&[&["run", "testbench/dut/foc.toml"][..], &brief, &sets].concat()))["energy"].clone()
    };
    assert_eq!(energy("in_line"), energy("low_side"));
    assert!(number(&energy("low_side")["copper_j"]) > 1e-3);
}

/// The hand holds the rotor at 1 rad, 651.9 of 4096 words, and later at 1.5 rad, 977.8 of them.
#[test]
fn a_chip_on_i2c_is_read_by_a_design_of_the_interface_alone() {
    let angle = |more: &[&str]| json(&run(&[&["run", "testbench/dut/angle.toml", "--json"][..], more].concat()));
    let value = angle(&[]);
    let frames = &value["frames"][0];
    assert_eq!((&frames["wrong"], &frames["fast"]), (&0.into(), &0.into()), "{frames}");
    let net = |value: &Value, name: &str| {
        let nets = value["signals"].as_array().expect("nets");
        let net = nets.iter().find(|net| net["name"] == name).expect("a net").clone();
        (number(&net["min"]), number(&net["max"]))
    };
    assert_eq!((net(&value, "angle"), net(&value, "refused")), ((0.0, 977.0), (0.0, 0.0)));
    let still = angle(&["--set", "hand.path=[[0, 1]]"]);
    assert_eq!(net(&still, "angle"), (0.0, 651.0));
    // At 200 MHz the bus has a clock of 1.6 MHz, and the chip's data sheet allows 1.
    let fast = angle(&["--set", "clock.frequency=200 MHz"]);
    assert_eq!(fast["frames"][0]["fast"], fast["frames"][0]["frames"]);
    // Before its power-up the chip acknowledges nothing.
    let late = angle(&["--set", "device.sensors.angle.power_up=1 ms"]);
    assert!(net(&late, "refused").1 > 0.0);
}

/// A zero of the angle that is wrong by 45 electrical degrees leaves the cosine of the torque.
#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_wrong_zero_of_a_design_leaves_the_cosine_of_the_torque() {
    let quick = ["--set", "run.duration=250 ms", "--set", "hand.path=[[0, 0], [0.1, 0.6]]", "--json"];
    let stiffness = |zero: f64| {
        let zero = format!("dut.parameters.ZERO={}", (zero / 360.0 * 16384.0 / 7.0).round());
        let value = json(&run(&[&["run", "testbench/dut/foc.toml", "--set", &zero][..], &quick].concat()));
        number(&value["displayed_stiffness"])
    };
    let share = stiffness(45.0) / stiffness(0.0);
    assert!((share - 0.5f64.sqrt()).abs() < 0.02, "{share}");
}

#[test]
fn what_is_inside_a_design_is_in_the_waveform_and_has_its_ranges() {
    let dir = scratch("inside_a_design");
    for (scene, inside) in [("knee", "u_duty.ramp"), ("rim", "encoder.pipe")] {
        let (path, out) = (format!("testbench/dut/{scene}.toml"), dir.join(scene));
        let output = run(&["run", &path, "--set", "run.duration=1 ms", "--vcd", "--no-plot", "-o", text(&out)]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let summary = fs::read_to_string(out.join("summary.json")).expect("a summary");
        let summary: Value = serde_json::from_str(&summary).expect("JSON");
        let signals = summary["signals"].as_array().expect("signals");
        let signal = signals.iter().find(|signal| signal["name"] == inside).expect("a signal inside");
        if scene == "knee" {
            // According to its README, a period is 2^PW - 1 clocks.
            assert_eq!((number(&signal["min"]), number(&signal["max"])), (0.0, 1022.0));
        }
        let (scope, leaf) = inside.split_once('.').expect("a path");
        let vcd = fs::read_to_string(out.join("wave.vcd")).expect("a waveform");
        let (_, within) = vcd.split_once(&format!("$scope module {scope} $end")).expect("a scope");
        assert!(within.split("$upscope").next().is_some_and(|vars| vars.contains(leaf)), "{scene}");
        assert!(!vcd.contains("_o["), "{scene}: a name that synthesis gave");
        // The table has only the ports.
        let table = fs::read_to_string(out.join("trace.csv")).expect("the trace");
        assert!(!table.lines().next().expect("heads").contains(leaf), "{scene}");
    }
}

/// Returns a run's result, without the keys that differ from one program to another.
pub fn told(mut value: Value) -> Value {
    for key in ["wall_s", "edges_per_s", "dut", "parameters", "files"] {
        value[key].take();
    }
    value
}

/// A wall only three counts away, for 4 ms, so that GHDL reaches it.
const NEAR: [&str; 4] =
    ["wall.position=4.6 mrad", "dut.generics.WALL_AT=3", "run.duration=4 ms", "hand.path=[[0, 0], [0.002, 0.03]]"];

/// Returns the words of each signal of a waveform by its path, with the times at which they begin.
pub fn words(waveform: &Path) -> BTreeMap<String, Vec<(u64, String)>> {
    fn note(items: &[ScopeItem], path: &str, names: &mut Vec<(IdCode, String)>) {
        for item in items {
            match item {
                ScopeItem::Scope(scope) => note(&scope.items, &format!("{path}{}.", scope.identifier), names),
                ScopeItem::Var(var) => {
                    // Without the range of its bits, which is smaller where synthesis knows the range of a number.
                    let name = var.reference.split('[').next().unwrap_or_default();
                    names.push((var.code, format!("{path}{name}")));
                }
                _ => {}
            }
        }
    }
    let mut parser = Parser::new(BufReader::new(fs::File::open(waveform).expect("a waveform")));
    let header = parser.parse_header().expect("a header");
    let (mut names, mut time) = (Vec::new(), 0);
    note(&header.items, "", &mut names);
    let mut words: BTreeMap<String, Vec<(u64, String)>> = BTreeMap::new();
    for command in parser {
        let (code, word) = match command.expect("VCD") {
            Command::Timestamp(at) => {
                time = at;
                continue;
            }
            Command::ChangeScalar(code, value) => (code, value.to_string()),
            Command::ChangeVector(code, vector) => (code, vector.to_string().trim_start_matches('0').to_string()),
            _ => continue,
        };
        for (_, name) in names.iter().filter(|(known, _)| *known == code) {
            let before = words.entry(name.clone()).or_default();
            if before.last().is_none_or(|(_, last)| *last != word) {
                before.push((time, word.clone()));
            }
        }
    }
    words
}

#[test]
fn ghdl_shows_inside_a_design_what_verilator_shows() {
    let dir = scratch("inside_by_ghdl");
    let with = |engine: &str| {
        let (set, out) = (format!("dut.engine={engine}"), dir.join(engine));
        let scene = ["run", "testbench/dut/rim.toml", "--vcd", "--no-plot", "-o", text(&out), "--set", &set];
        let output = run(&scene.into_iter().chain(NEAR.iter().flat_map(|set| ["--set", set])).collect::<Vec<_>>());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        words(&out.join("wave.vcd"))
    };
    let (ghdl, verilator) = (with("ghdl"), with("verilator"));
    // Signals of its source, of each kind and depth. GHDL's synthesis adds signals of its own, and keeps every number.
    let inside = ["count", "calm", "encoder.tally", "encoder.settle", "encoder.marked", "bridge.a.left", "bridge.saw"];
    for name in inside {
        assert!(ghdl.contains_key(&format!("rim_stop.{name}")), "{name}: {:?}", ghdl.keys());
    }
    for (name, told) in ghdl.iter().filter(|(name, _)| name.starts_with("rim_stop.")) {
        let same = verilator.get(name).unwrap_or_else(|| panic!("Verilator shows no {name}"));
        assert!(told == same, "{name}");
    }
    assert!(ghdl["rim_stop.encoder.tally"].len() > 5, "it moves");
    let stands_still = |words: &BTreeMap<String, _>| words.keys().any(|name| name.ends_with(".clk"));
    assert!(!stands_still(&ghdl) && !stands_still(&verilator), "a clock, seen at its edges");
}

#[test]
fn ghdl_and_verilator_move_the_device_alike() {
    let with = |engine: &str| {
        let engine = format!("dut.engine={engine}");
        let scene = ["run", "testbench/dut/rim.toml", "--json", "--set", &engine];
        json(&run(&scene.into_iter().chain(NEAR.iter().flat_map(|set| ["--set", set])).collect::<Vec<_>>()))
    };
    let (ghdl, verilator) = (with("ghdl"), with("verilator"));
    assert!(ghdl["dut"]["engine"].as_str().is_some_and(|engine| engine.starts_with("GHDL")));
    assert!(verilator["dut"]["engine"].as_str().is_some_and(|engine| engine.starts_with("Verilator")));
    assert!(number(&ghdl["contact_share"]) > 0.0, "{}", ghdl["contact_share"]);
    assert!(number(&ghdl["output_changes"]) > 20.0);
    assert_eq!(told(ghdl), told(verilator));
}

/// Returns a scene with our own hybrid loop as if it were by others, and the wall of hybrid-wall, but nearer.
fn own(dir: &Path, engine: &str, stiffness: i64, duration: &str) -> String {
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
    let hdl = fs::canonicalize(Path::new(ROOT).join("hdl")).expect("the folder");
    let files: Vec<_> = blocks.iter().map(|block| format!("\"{}/{block}.vhd\"", hdl.display())).collect();
    let scene = dir.join(format!("own-{engine}-{stiffness}.toml"));
    let shipped = fs::read_to_string(Path::new(ROOT).join("testbench/scenes/hybrid-wall.toml")).expect("a scene");
    let hand = shipped.split("[hand]").nth(1).and_then(|rest| rest.split("[run]").next()).expect("its hand");
    let toml = format!(
        "about = \"our own\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\nwheel_ratio = 7\n[clock]\n\
         frequency = \"50 MHz\"\n[dut]\nfiles = [{}]\ntop = \"hybrid_loop\"\nengine = \"{engine}\"\nclock = \"clk\"\n\
         reset = {{ port = \"rst\", clocks = 1 }}\ngenerics = {{ DAMPING_FRAC = 4 }}\n[dut.ports]\na_pin = \
         \"encoder.a\"\nb_pin = \"encoder.b\"\nreference = \"wall.count\"\nstiffness = {stiffness}\ndamping = 38\n\
         period = 50000\nscale = 0\na_high = \"bridge.minus_high\"\na_low = \"bridge.minus_low\"\nb_high = \
         \"bridge.plus_high\"\nb_low = \"bridge.plus_low\"\n[wall]\nposition = \"4 mrad\"\n[hand]{hand}\n[run]\n\
         duration = \"{duration}\"\n",
        files.join(", ")
    );
    fs::write(&scene, toml).expect("a scene");
    text(&scene).to_string()
}

/// Returns hybrid-wall with its wall equally near.
fn ours(dir: &Path) -> String {
    let scene = dir.join("ours.toml");
    let shipped = fs::read_to_string(Path::new(ROOT).join("testbench/scenes/hybrid-wall.toml")).expect("a scene");
    fs::write(&scene, shipped.replace("position = \"1.5 rad\"", "position = \"4 mrad\"")).expect("a scene");
    text(&scene).to_string()
}

const NETS: [&str; 10] = [
    "a_pin=a_pin",
    "b_pin=b_pin",
    "reference=reference",
    "stiffness=stiffness",
    "damping=damping",
    "period=period",
    "a_high=a_high",
    "a_low=a_low",
    "b_high=b_high",
    "b_low=b_low",
];

fn compared(dir: &Path, engine: &str, stiffness: i64, duration: &str) -> (i32, Value) {
    let (own, ours) = (own(dir, engine, stiffness, duration), ours(dir));
    let arguments = [&["run", &own, "--json", "--beside", &ours, "--compare"][..], &NETS].concat();
    let output = run(&arguments);
    assert!(stderr(&output).lines().all(|line| !line.starts_with("error")), "{}", stderr(&output));
    (code(&output), json(&output))
}

#[test]
fn our_own_loop_taken_for_foreign_has_the_nets_of_the_emulator() {
    let dir = scratch("own_as_foreign");
    for (engine, duration, edges) in [("verilator", "100 ms", 5_000_000), ("ghdl", "4 ms", 200_000)] {
        let (exit, value) = compared(&dir, engine, 36, duration);
        let found = &value["compared"];
        assert_eq!((exit, &found["edges"], &found["mismatches"]), (0, &edges.into(), &0.into()), "{engine}: {found}");
        assert!(number(&value["contact_share"]) > 0.5, "{engine}: {}", value["contact_share"]);
        assert!(number(&value["gate_changes"]) > 20.0);
    }
}

#[test]
fn faults_strike_a_design_as_they_strike_ours() {
    let dir = scratch("faults_of_both");
    let faults = "[faults]\nmissed_edge = [\"1 ms\", \"3 ms\"]\ndoubled_edge = [\"2 ms\"]\n\
                  bounce = [\"4 ms\", \"5 ms\"]\n\
                  glitch = [\"6 ms\"]\nglitch_clocks = 700\nclock_jitter = \"15 ns\"\nstuck_switch = \
                  \"bridge.minus_high\"\nstuck_from = \"8 ms\"\nstuck_to = \"11 ms\"\n";
    let scenes = [own(&dir, "verilator", 36, "20 ms"), ours(&dir)];
    for scene in &scenes {
        let toml = fs::read_to_string(scene).expect("a scene");
        fs::write(scene, format!("{toml}\n{faults}")).expect("a scene");
    }
    let arguments = [&["run", &scenes[0], "--json", "--beside", &scenes[1], "--compare"][..], &NETS].concat();
    let output = run(&arguments);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let value = json(&output);
    let struck = value["faults"].as_array().expect("a list");
    let count = |kind: &str| struck.iter().filter(|mark| mark["kind"] == kind).count();
    let counts = ["missed_edge", "doubled_edge", "bounce", "glitch", "stuck_switch"].map(count);
    assert_eq!(counts, [2, 1, 2, 1, 1], "{struck:?}");
    assert!(count("clock_jitter") > 3, "{struck:?}");
    assert_eq!(value["compared"]["mismatches"], 0, "{}", value["compared"]);
}

#[test]
fn a_stiffness_that_is_one_more_is_found_at_once() {
    let dir = scratch("own_but_stiffer");
    let (exit, value) = compared(&dir, "verilator", 37, "4 ms");
    let first = &value["compared"]["first_difference"];
    // The word itself differs, from the first edge on.
    assert_eq!((exit, &first["edge"], &first["port"]), (1, &1.into(), &"stiffness".into()), "{first}");
    // In the gates alone, the difference is seen when the first pulse in contact ends a clock later.
    let (own, ours) = (own(&dir, "verilator", 37, "4 ms"), ours(&dir));
    let out = dir.join("out");
    let arguments = ["run", &own, "-o", text(&out), "--beside", &ours, "--compare", "a_high=a_high", "b_high=b_high"];
    let output = run(&arguments);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let said = stdout(&output);
    assert!(said.contains("first difference at edge") && said.contains("a_high(ours)"), "{said}");
    assert!(names(&out).contains(&"wave.fst.gtkw".to_string()));
    let save = fs::read_to_string(out.join("wave.fst.gtkw")).expect("a save file");
    assert!(save.contains("comparison.differs"), "{save}");
}

#[test]
fn a_map_shows_for_which_gains_a_design_rings() {
    let dir = scratch("map_of_a_design");
    let arguments = |more: &[&'static str]| {
        let out = text(&dir);
        let mut all = vec!["map", "testbench/dut/knee.toml", "--x", "dut.ports.gain=95..600:2", "--y"];
        all.extend(["hand.stiffness=0.25..0.35 N.m/rad:2", "--full", "-o", out]);
        all.extend(more);
        run(&all)
    };
    let output = arguments(&["--json"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let rows = fs::read_to_string(dir.join("map.csv")).expect("the map");
    let cells: Vec<_> = rows.lines().filter(|line| !line.starts_with('#')).skip(1).collect();
    assert_eq!(cells.len(), 4, "{rows}");
    for cell in cells {
        let outcome = if cell.contains("gain=600") { "limit_cycle" } else { "settled" };
        assert!(cell.contains(outcome), "{cell}");
    }
    // The second time every cell is read from the journal.
    let again = arguments(&["--json"]);
    assert_eq!(stdout(&again), stdout(&output));
}

#[test]
fn limits_go_over_what_makes_a_design_stiffer() {
    let dir = scratch("limits_of_a_design");
    let at = |more: &[&str]| {
        let scene = ["limits", "testbench/dut/knee.toml", "--range", "95..600", "--words", "2", "--phases", "1"];
        run(&[&scene[..], more].concat())
    };
    let output = at(&["--json", "-o", text(&dir)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let words = &json(&output)["words"];
    // According to its README, 95 makes 1.0 N.m/rad and the hand rests; at 600 the loop rings.
    let groups = words["groups"].as_array().expect("groups");
    let told: Vec<_> =
        groups.iter().map(|group| (group["settle"].as_str().expect("a text"), number(&group["from"]))).collect();
    assert_eq!(told, [("all", 95.0), ("none", 600.0)]);
    assert_eq!((&words["words"], &words["runs"]), (&506.into(), &2.into()));
    assert!(names(&dir).contains(&"limits.png".to_string()));
    let refused = |arguments: &[&str], said: &[&str]| assert_refused(&run(arguments), 2, said);
    refused(&["limits", "testbench/dut/knee.toml"], &["--range A..B, whole numbers"]);
    refused(
        &["limits", "testbench/dut/knee.toml", "--range", "9..3"],
        &["write whole numbers from 1 on, the smaller first"],
    );
    refused(&["limits", "testbench/dut/rim.toml", "--range", "1..3"], &["does not say what makes its wall stiffer"]);
    let varies = ["limits", "testbench/dut/knee.toml", "--range", "1..3", "--set", "wall.varies=hand.stiffness"];
    assert_refused(&run(&varies), 4, &["wall.varies", "is not the key of a generic or constant"]);
}

#[test]
fn a_scene_of_ours_is_drawn_beside_a_design_of_yours() {
    let out = scratch("beside_a_design").join("out");
    let scene = ["run", "testbench/dut/knee.toml", "--beside", "hybrid-wall", "--set", "run.duration=0.3s"];
    let output = run(&[&scene[..], &["-o", text(&out)]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let svg = fs::read_to_string(out.join("side-by-side.svg")).expect("a picture");
    assert!(svg.contains("knee") && svg.contains("hybrid-wall") && svg.contains("torque, its mean"));
}

/// Writes a scene around a design of `testbench/dut/bad` or of a test's own.
fn scene_of(dir: &Path, name: &str, files: &[&str], top: &str, ports: &str, more: &str) -> String {
    let path = dir.join(format!("{name}.toml"));
    let bad = fs::canonicalize(Path::new(ROOT).join("testbench/dut/bad")).expect("the folder");
    let files: Vec<_> = files.iter().map(|file| format!("\"{}\"", bad.join(file).display())).collect();
    let toml = format!(
        "about = \"bad\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\n[clock]\nfrequency = \"10 MHz\"\n\
         [dut]\nfiles = [{}]\ntop = \"{top}\"\n{more}\n[dut.ports]\nenc_a = \"encoder.a\"\nenc_b = \"encoder.b\"\n\
         {ports}\n[wall]\nposition = \"1 rad\"\n[hand]\nkind = \"prescribed\"\npath = [[0, 0], [0.001, 0.1]]\n[run]\n\
         duration = \"1 ms\"\n",
        files.join(", ")
    );
    fs::write(&path, toml).expect("a scene");
    text(&path).to_string()
}

const PWM: &str = "pwm = \"bridge.pwm\"\ndir = \"bridge.direction\"";
const CLOCKED: &str = "clock = \"clk\"\nreset = { port = \"rst\" }";

#[test]
fn designs_that_are_broken_are_named_with_what_is_wrong() {
    let dir = scratch("broken_designs");
    let gates = "a_high = \"bridge.plus_high\"\na_low = \"bridge.plus_low\"\nb_high = \"bridge.minus_high\"\nb_low = \
                 \"bridge.minus_low\"";
    let ghdl = format!("{CLOCKED}\nengine = \"ghdl\"");
    let plain = "clock = \"clk\"";
    /// Files, top, outputs, clock and reset, exit code, words of the message.
    type Case<'a> = (&'a [&'a str], &'a str, &'a str, &'a str, i32, &'a [&'a str]);
    let cases: [Case; 8] = [
        (&["x_out.vhd"], "x_out", PWM, &ghdl, 4, &["output `dir` has an unknown bit", "at clock edge 1"]),
        (&["short.v"], "short", gates, CLOCKED, 4, &["both switches of the plus leg are closed at clock edge"]),
        (&["loop.v"], "loop", PWM, CLOCKED, 1, &["did not converge", "loop.v"]),
        (&["syntax.v"], "syntax", PWM, plain, 1, &["verilator refuses `syntax`", "syntax.v:11"]),
        (&["syntax.vhd"], "syntax", PWM, plain, 1, &["ghdl refuses `syntax`", "syntax.vhd:18"]),
        (&["order_b.vhd"], "order_b", PWM, CLOCKED, 1, &["order_pkg", "not found"]),
        (
            &["uninit.v"],
            "uninit",
            PWM,
            CLOCKED,
            1,
            &["output `pwm` depends on a value that nothing has set: that of register `phase`;", "\"zero\""],
        ),
        (&["finish.v"], "finnish", PWM, CLOCKED, 1, &["finnish"]),
    ];
    for (files, top, ports, more, exit, words) in cases {
        let scene = scene_of(&dir, top, files, top, ports, more);
        assert_refused(&run(&["run", &scene]), exit, words);
    }
}

#[test]
fn registers_that_nothing_sets_begin_at_0_or_at_random_where_the_scene_says_so() {
    let dir = scratch("unset_registers");
    let scene = scene_of(&dir, "uninit", &["uninit.v"], "uninit", PWM, CLOCKED);
    let ran = |registers: &str, seed: &str| {
        let registers = format!("dut.registers={registers}");
        let ports = json(&run(&["run", &scene, "--json", "--set", &registers, "--set", &format!("run.seed={seed}")]));
        (ports["dut"]["engine"].as_str().expect("a text").to_string(), told(ports))
    };
    let (engine, zero) = ran("zero", "3");
    assert!(engine.ends_with("; registers that nothing sets begin at 0"), "{engine}");
    let (engine, random) = ran("random", "3");
    assert!(engine.ends_with("begin at random, by run.seed = 3"), "{engine}");
    assert_eq!(ran("random", "3").1, random, "the same seed");
    // The phase of the pulse within its period of 256 clocks begins elsewhere.
    assert_ne!(zero, random);
    let vhdl = scene_of(&dir, "x_out", &["x_out.vhd"], "x_out", PWM, &format!("{CLOCKED}\nregisters = \"zero\""));
    let words = ["dut.registers", "in GHDL a register begins as VHDL says"];
    assert_refused(&run(&["run", &vhdl, "--set", "dut.engine=ghdl"]), 4, &words);
}

/// A decoder whose registers have no initial value: VHDL's `when others` takes them, so its count is defined.
const UNSET_DECODER: &str = "library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity unset is
  port (clk, enc_a, enc_b : in std_logic; count : out std_logic_vector(7 downto 0); pwm, dir : out std_logic);
end;
architecture rtl of unset is
  signal n : unsigned(7 downto 0) := (others => '0');
  signal old, now : std_logic_vector(1 downto 0);
begin
  process (clk) begin
    if rising_edge(clk) then
      now <= enc_b & enc_a;
      old <= now;
      case now & old is
        when \"0001\" | \"0111\" | \"1110\" | \"1000\" => n <= n + 1;
        when \"0010\" | \"1011\" | \"1101\" | \"0100\" => n <= n - 1;
        when others => null;
      end case;
    end if;
  end process;
  count <= std_logic_vector(n);
  pwm <= n(1);
  dir <= enc_a;
end;
";

#[test]
fn a_value_that_only_vhdl_defines_is_simulated_by_ghdl_with_a_note_that_names_the_register() {
    let dir = scratch("unset_vhdl");
    fs::write(dir.join("unset.vhd"), UNSET_DECODER).expect("a file");
    let own = text(&dir.join("unset.vhd")).to_string();
    let scene = scene_of(&dir, "unset", &[&own], "unset", PWM, "clock = \"clk\"");
    let with = |engine: &str| run(&["run", &scene, "--json", "--set", &format!("dut.engine={engine}")]);
    let auto = with("auto");
    for said in ["note: GHDL simulates `unset`", "output `pwm` depends on a value", "that of register `"] {
        assert!(stderr(&auto).contains(said), "{}", stderr(&auto));
    }
    let (auto, ghdl) = (json(&auto), json(&with("ghdl")));
    assert!(auto["dut"]["engine"].as_str().is_some_and(|engine| engine.starts_with("GHDL")));
    assert!(number(&ghdl["output_changes"]) > 5.0);
    assert_eq!(told(auto), told(ghdl));
    let ways = ["register `", "dut.registers = \"zero\"", "dut.engine = \"ghdl\""];
    assert_refused(&with("verilator"), 1, &ways);
}

#[test]
fn a_design_that_does_not_end_a_step_is_given_up() {
    let dir = scratch("hanging_design");
    let scene = scene_of(&dir, "hang", &["hang.v"], "hang", PWM, CLOCKED);
    // The model is built first, so that the time limit is only that of an answer.
    let short = scene_of(&dir, "hang-not-yet", &["hang.v"], "hang", PWM, CLOCKED);
    let built = run(&["run", &short, "--set", "run.duration=1 us"]);
    assert_eq!(code(&built), 0, "{}", stderr(&built));
    assert_refused(&run(&["run", &scene, "--tool-timeout", "2"]), 1, &["does not end a step", "no answer for 2 s"]);
}

#[test]
fn connections_that_cannot_be_are_refused_with_the_names_there_are() {
    let dir = scratch("bad_connections");
    let knee = |name: &str, from: &str, to: &str| {
        let path = dir.join(format!("{name}.toml"));
        let folder = fs::canonicalize(Path::new(ROOT).join("testbench/dut")).expect("the folder");
        let scene = fs::read_to_string(folder.join("knee.toml")).expect("a scene");
        assert!(scene.contains(from), "{from}");
        let scene = scene.replace("\"knee/", &format!("\"{}/knee/", folder.display())).replace(from, to);
        fs::write(&path, scene).expect("a scene");
        run(&["run", text(&path), "--set", "run.duration=1 us"])
    };
    let gain = "gain = 95\n";
    for (name, from, to, words) in [
        ("no-port", gain, "gain = 95\nhalt = 1\n", &["dut.ports.halt", "has no port `halt`", "gain (in, 10 bits)"][..]),
        ("unmapped", gain, "", &["input gain (in, 10 bits) is connected to nothing", "encoder.count"]),
        ("too-wide", gain, "gain = 1024\n", &["dut.ports.gain", "1024 does not fit gain (in, 10 bits)"]),
        ("width", gain, "gain = \"encoder.a\"\n", &["gain (in, 10 bits) has not the 1 bit(s) of encoder.a"]),
        ("direction", gain, "gain = \"bridge.enable\"\n", &["gain (in, 10 bits) cannot be connected to bridge.enable"]),
        ("drivers", "pwm = \"bridge.pwm\"", "pwm = \"bridge.pwm\"\ntouching = \"bridge.pwm\"", &["two drivers"]),
        ("undriven", "pwm = \"bridge.pwm\"", "", &["nothing is connected to bridge.pwm"]),
        ("no-clock", "clock = \"clk\"", "", &["dut.clock", "no clock"]),
        ("clock", "clock = \"clk\"", "clock = \"ck\"", &["has no port `ck`", "clk (in, 1 bit)"]),
        ("wide-clock", "clock = \"clk\"", "clock = \"gain\"", &["ports.gain", "is a clock or the reset already"]),
        ("nonsense", gain, "gain = \"bridge.torque\"\n", &["`bridge.torque` is nothing that a port can be"]),
        ("format", "pwm = \"bridge.pwm\"", "pwm = \"bridge.duty\"", &["bridge.duty needs a format"]),
        ("file", "QuadTrack.v", "QuadTrick.v", &["dut.files[0]", "cannot read"]),
        ("language", "QuadTrack.v", "QuadTrack.c", &["neither VHDL", "nor Verilog"]),
        ("method", "[dut]\n", "[method]\nkind = \"hybrid\"\n[dut]\n", &["or a [dut] of yours; leave one out"]),
        (
            "stiffness",
            "position = \"1.5 rad\"",
            "position = \"1.5 rad\", stiffness = 1",
            &["wall.stiffness", "position"],
        ),
    ] {
        assert_refused(&knee(name, from, to), 4, words);
    }
    let parameter = knee("parameter", "[dut.ports]", "parameters = { KPX = 3 }\n[dut.ports]");
    assert_refused(&parameter, 1, &["verilator refuses `KneeCtl`", "KPX"]);
    let rim = ["run", "testbench/dut/rim.toml", "--set", "dut.generics.STIFNESS=3", "--set", "dut.engine=ghdl"];
    assert_refused(&run(&rim), 1, &["`rim_stop` has no generic `STIFNESS`", "DAMPING", "STIFFNESS"]);
}

#[test]
fn verbs_about_our_own_words_refuse_a_design_of_yours() {
    for arguments in [
        &["limits", "testbench/dut/knee.toml", "--hands"][..],
        &["fit", "testbench/dut/knee.toml"],
        &["chart", "testbench/dut/knee.toml", "--x", "dut.ports.gain=1..2:2", "--y", "hand.damping=0..1 N.m.s/rad:2"],
        &["check", "--scene", "testbench/dut/knee.toml"],
        &["run", "testbench/dut/knee.toml", "--driver", "clock"],
        &["run", "testbench/dut/paddle.toml", "--compare", "--set", "dut.registers=random"],
        &["run", "testbench/dut/knee.toml", "--compare", "pwm=a_high"],
    ] {
        let output = run(arguments);
        assert!([2, 4].contains(&code(&output)), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).starts_with("error: "), "{arguments:?}: {}", stderr(&output));
    }
}

/// The simulators of a design are the points of its chart: each has every word of the scene as written.
#[test]
fn the_simulators_of_a_design_are_charted() {
    for (scene, simulators) in [
        ("knee", &["leap", "verilator"][..]),
        ("rim", &["leap", "verilator", "ghdl"]),
        ("paddle", &["leap", "verilator"]),
    ] {
        let scene = format!("testbench/dut/{scene}.toml");
        let value = json(&run(&["chart", &scene, "--set", "run.duration=2 ms", "--json"]));
        let all = value["contestants"].as_array().expect("contestants");
        let exact: Vec<_> =
            all.iter().filter(|entry| entry["grade"] == "exact").filter_map(|entry| entry["name"].as_str()).collect();
        assert_eq!(exact, simulators, "{scene}: {value:#}");
    }
}

#[test]
fn leaps_are_compared_with_verilator_output_by_output() {
    let value = json(&run(&["run", "testbench/dut/knee.toml", "--compare", "--edges", "3000000", "--json"]));
    assert_eq!((&value["edges"], &value["mismatches"]), (&3_000_000.into(), &0.into()), "{value}");
    assert!(number(&value["changes"]) > 1000.0 && value["first"].is_null(), "{value}");
    let output = run(&["run", "testbench/dut/rim.toml", "--compare", "--edges", "500000"]);
    assert!(stdout(&output).contains("leaps against Verilator, 500000 edges, "), "{}", stdout(&output));
    let output = run(&["run", "testbench/dut/paddle.toml", "--compare", "--edges", "500000"]);
    assert!(stdout(&output).contains("leaps against Verilator, 500000 edges, "), "{}", stdout(&output));
    let refused = run(&["run", "testbench/dut/paddle.toml", "--compare", "--set", "dut.registers=random"]);
    assert_refused(&refused, 2, &["`PaddleDrive` cannot leap: dut.registers = \"random\""]);
}

/// A design of two flip-flops. It drives forward while both lines of the encoder are 1.
const TINY: &str = "module tiny (input clk, a, b, output reg pwm = 0, output reg dir = 0);
  always @(posedge clk) begin
    pwm <= a & b;
    dir <= 1'b1 ^ (a & ~b & pwm);
  end
endmodule
";

/// Writes a scene around this design.
fn tiny(dir: &Path, expect: &str) -> String {
    fs::write(dir.join("tiny.v"), TINY).expect("a file");
    let scene = dir.join("tiny.toml");
    let toml = format!(
        "about = \"two flip-flops\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\n\
         [clock]\nfrequency = \"1 MHz\"\n[dut]\nfiles = [\"tiny.v\"]\ntop = \"tiny\"\nclock = \"clk\"\n\
         [dut.ports]\na = \"encoder.a\"\nb = \"encoder.b\"\npwm = \"bridge.pwm\"\ndir = \"bridge.direction\"\n\
         [wall]\nposition = \"1 rad\"\n[hand]\nkind = \"none\"\n[run]\n\
         duration = \"20 ms\"\n[expect]\noutcome = \"{expect}\"\n"
    );
    fs::write(&scene, toml).expect("a scene");
    text(&scene).to_string()
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn what_a_design_costs_is_counted_and_its_clocks_are_held_against_those_that_are_asked() {
    let dir = scratch("cost_of_a_design");
    let cache = dir.join("cache");
    let cost = |scene: &str, set: &[&str]| {
        json(&run(&[&["cost", "--scene", scene, "--cache", text(&cache), "--json"], set].concat()))
    };
    let scene = tiny(&dir, "settled");
    let value = cost(&scene, &[]);
    // The design has two registers, each behind at most one table of four inputs.
    assert_eq!((&value["ff"], &value["fits"], &value["carry"]), (&2.into(), &true.into(), &0.into()), "{value}");
    assert!(value["lut4"].as_u64().is_some_and(|count| (1..=2).contains(&count)), "{value}");
    let clock = &value["clocks"][0];
    assert_eq!((&clock["port"], &clock["in_time"]), (&"clk".into(), &true.into()), "{value}");
    let mut placed: Vec<f64> = clock["placed_mhz"].as_array().expect("a list").iter().map(number).collect();
    placed.sort_by(f64::total_cmp);
    assert_eq!((placed.len(), number(&clock["fmax_mhz"])), (3, placed[1]));
    assert_eq!(cost(&scene, &[]), value, "it is remembered");
    let fast = cost(&scene, &["--set", "clock.frequency=9 GHz"]);
    assert_eq!(fast["clocks"][0]["in_time"], false, "{fast}");
    // VHDL is priced through GHDL.
    let value = cost("testbench/dut/rim.toml", &[]);
    assert!(value["tools"].as_str().is_some_and(|tools| tools.starts_with("ghdl")), "{value}");
    assert!(value["cells"].as_u64() >= value["ff"].as_u64() && value["clocks"][0]["in_time"] == true, "{value}");
    // Yosys reports, with file and line, the text that it cannot read.
    let refused = run(&["cost", "--scene", "testbench/dut/paddle.toml", "--cache", text(&cache)]);
    assert_refused(&refused, 1, &["yosys refuses `PaddleDrive`", "WallSpring.sv:"]);
}

#[test]
fn a_run_is_reported_as_tests_and_takes_other_files() {
    let dir = scratch("junit_of_a_run");
    let report = dir.join("report.xml");
    let read = || fs::read_to_string(&report).expect("a report");
    for (expect, failures, exit) in [("settled", 0, 0), ("diverged", 1, 1)] {
        let output = run(&["run", &tiny(&dir, expect), "--junit", text(&report)]);
        assert_eq!(code(&output), exit, "{}{}", stdout(&output), stderr(&output));
        let xml = read();
        assert!(xml.contains(&format!("tests=\"3\" failures=\"{failures}\"")), "{xml}");
        assert!(xml.contains("classname=\"tiny\" name=\"run\"") && xml.contains("name=\"outcome\""), "{xml}");
    }
    assert!(read().contains("expected diverged, found settled"), "{}", read());
    // Another file in the place of the scene's. Its missing ports are reported at once.
    let other = dir.join("other.v");
    fs::write(
        &other,
        TINY.replace("input clk, a, b", "input clk, a, c")
            .replace("b)", "c)")
            .replace("~b", "~c")
            .replace("& b", "& c"),
    )
    .expect("a file");
    let scene = tiny(&dir, "settled");
    assert_refused(&run(&["run", &scene, "--dut", text(&other)]), 4, &["`tiny` has no port `b`; it has", "c"]);
    assert_refused(&run(&["run", &scene, "--dut", "nowhere.v"]), 4, &["nowhere.v: No such file"]);
    // A shipped scene of ours has no files.
    assert_eq!(code(&run(&["run", "hybrid-wall", "--dut", text(&other)])), 2);
    let value = json(&run(&["run", &scene, "--dut", text(&dir.join("tiny.v")), "--json"]));
    assert!(value["expected_not_judged"].as_str().is_some_and(|why| why.contains("--dut")), "{value}");
}

/// The scene of an end stop whose reset is active low, with encoder lines and a level of the reset. A slow
/// clock is enough, with as many samples a second as at 50 MHz.
fn end_stop(dir: &Path, name: &str, lines: [&str; 2], active: &str) -> String {
    let file = fs::canonicalize(Path::new(ROOT).join("testbench/dut/blocks/end_stop.vhd")).expect("the design");
    let [a, b] = lines;
    let toml = format!(
        "about = \"An end stop.\"\nclock.frequency = \"10 MHz\"\nrun.duration = \"500 ms\"\n[device]\nkind = \
         \"motor\"\nresistance = \"2 Ohm\"\ninductance = \"0.5 mH\"\ntorque_constant = \"60 mN.m/A\"\nrotor_inertia = \
         \"80 g.cm2\"\n[dut]\nfiles = [\"{}\"]\ntop = \"end_stop\"\nclock = \"sys_clk\"\nreset = {{ port = \
         \"nreset\", active = \"{active}\" }}\n[dut.generics]\nSTOP_AT = 652\nDIVIDER = 10000\n[dut.ports]\nqa = \
         \"{a}\"\nqb = \"{b}\"\nin1 = \"bridge.plus\"\nin2 = \"bridge.minus\"\n[wall]\nposition = \"1 rad\"\nvaries = \
         \"dut.generics.KP\"\n[hand]\nkind = \"spring_damper\"\nstiffness = \"0.5 N.m/rad\"\ndamping = \
         \"1 mN.m.s/rad\"\npath = [[\"0 s\", 0], [\"200 ms\", 1.3]]\n[expect]\noutcome = \"settled\"\n",
        file.display()
    );
    let scene = dir.join(format!("{name}.toml"));
    fs::write(&scene, toml).expect("a scene");
    text(&scene).to_string()
}

#[test]
fn a_design_that_does_nothing_is_inside_its_wall_without_torque() {
    let dir = scratch("dead_designs");
    let (right, exchanged) = (["encoder.a", "encoder.b"], ["encoder.b", "encoder.a"]);
    let scene = end_stop(&dir, "right", right, "low");
    let output = run(&["run", &scene, "--json"]);
    let found = json(&output);
    assert_eq!((code(&output), &found["outcome"]["kind"], &found["suspect"]), (0, &"settled".into(), &Value::Null));
    for (name, lines, active, suspect) in
        [("exchanged", exchanged, "low", "counts_reversed"), ("reset", right, "high", "held_in_reset")]
    {
        let scene = end_stop(&dir, name, lines, active);
        let output = run(&["run", &scene, "--json"]);
        let found = json(&output);
        let outcome = &found["outcome"];
        assert_eq!((code(&output), &outcome["kind"]), (1, &"no_wall_torque".into()), "{name}");
        // Nothing holds the shaft: the hand takes it to its own place, 300 mrad behind the wall.
        assert!((number(&outcome["depth"]) - 0.3).abs() < COUNT_RAD, "{name}: {outcome}");
        assert!(number(&outcome["effort"]).abs() < 1e-9, "{name}: {outcome}");
        assert_eq!(found["suspect"], suspect, "{name}");
        let said = stdout(&run(&["run", &scene]));
        assert!(said.contains("outcome    inside the wall without its torque: 300 mrad deep"), "{said}");
        assert!(said.contains("expected   outcome settled: NOT MET"), "{said}");
        if name == "exchanged" {
            assert!(
                said.contains("its counts run against the device: with encoder.a and encoder.b exchanged"),
                "{said}"
            );
        }
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn studies_take_a_wall_without_torque_for_a_class_of_its_own() {
    let dir = scratch("dead_design_in_studies");
    let scene = end_stop(&dir, "exchanged", ["encoder.b", "encoder.a"], "low");
    let limits =
        |range: &str, more: &[&str]| run(&[&["limits", &scene, "--range", range, "--phases", "2"], more].concat());
    let found = json(&limits("22..24", &["--json"]));
    let words = &found["words"];
    assert_eq!((&words["runs_without_wall_torque"], &words["runs"]), (&6.into(), &6.into()), "{words}");
    assert_eq!(words["groups"][0]["settle"], "none");
    let said = stdout(&limits("23..24", &[]));
    assert!(said.contains("4 runs are inside the wall without its torque, and count as not settled"), "{said}");
    let axes = ["--x", "dut.generics.KP=20..24:2", "--y", "hand.stiffness=0.4..0.5 N.m/rad:2", "--full"];
    let out = dir.join("map");
    let found = json(&run(&[&["map", &scene, "--json", "-o", text(&out)][..], &axes].concat()));
    assert_eq!(found["methods"][0]["outcomes"]["no_wall_torque"], 4);
    let said = stdout(&run(&[&["map", &scene, "-o", text(&out)][..], &axes].concat()));
    assert!(said.contains("0 no_wall_torque        4"), "{said}");
}

#[test]
fn a_count_that_does_not_fit_its_port_is_told_beside_the_verdict() {
    // The hand turns the paddle by 500 rad in 0.1 ms; its port of 18 bits holds up to 2^18 counts of 4096 a turn.
    let hand = "hand={ kind = \"prescribed\", path = [[0, 0], [\"0.1 ms\", 500]] }";
    let words = ["run", "testbench/dut/paddle.toml", "--set", hand, "--set", "run.duration=1 ms"];
    let said = stdout(&run(&words));
    let (_, told) =
        said.split_once("position   wraps: the count does not fit the 18 bits of port pos at ").expect("a line");
    let (share, _) = told.split_once(" % of the clock cycles").expect("a share");
    let leaves_s = f64::from(1 << 18) * COUNT_RAD / 500.0 * 0.1e-3;
    assert!((share.parse::<f64>().expect("a number") - 100.0 * (1e-3 - leaves_s) / 1e-3).abs() < 0.01, "{share} %");
    // What the design makes of it is its own matter: it may follow the wraps.
    assert!(said.contains("outcome    settled"), "{said}");
}

#[test]
fn a_wall_that_does_not_fit_its_port_is_refused() {
    let dir = scratch("wall_port");
    let own = own(&dir, "verilator", 36, "1 ms");
    // 3 rad are 1956 counts of 4096; the port `reference` has 12 bits.
    let output = run(&["run", &own, "--set", "wall.position=6.3 rad"]);
    assert_refused(&output, 4, &["dut.ports.reference", "the wall is 4107 counts from the start", "wall.wraps = true"]);
    for set in ["wall.position=3 rad", "wall.position=-1 rad", "wall={ position = 6.3, wraps = true }"] {
        let output = run(&["run", &own, "--set", set]);
        assert_eq!(code(&output), 0, "{set}: {}", stderr(&output));
    }
}
