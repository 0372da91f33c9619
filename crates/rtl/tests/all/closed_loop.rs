//! The loop closed around the VHDL in GHDL: every net equals the emulator's at every edge.

use std::fs;
use std::path::{Path, PathBuf};

use hpu_cosim::scene::{Scene, shipped, shipped_file};
use hpu_cosim::{AxisSimulation, AxisWorld, Control, Driver, NetUse, SceneFile, Schedule, Simulation, Wired, World};
use hpu_datapath::{AnyBlock, Wiring};
use hpu_rtl::{LoopScene, closed_loop, scene_vectors};

const EDGES: u64 = 60_000;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns a shipped scene that is thrown at the wall so fast that even a millisecond has hundreds of encoder edges.
fn fast(name: &str, more: &[(&str, &str)]) -> LoopScene {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let thrown = [
        ("device.initial_speed", "300 rad/s"),
        ("wall.position", "0.05 rad"),
        ("wall.damping", "1e-4 N.m.s/rad"),
        ("run.duration", "1.2 ms"),
    ];
    let overrides = thrown.iter().chain(more).map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let (name, text) = (format!("{name}.toml"), scene.text.to_string());
    let source = SceneFile { name, text, data: project().join("testbench/scenes"), is_shipped: false };
    LoopScene { source, overrides, edges: EDGES }
}

fn scene(options: &LoopScene) -> Scene {
    let scene = Scene::parse(&options.source.name, &options.source.text, &options.overrides, &mut shipped_file);
    scene.unwrap_or_else(|error| panic!("{error}"))
}

/// Asserts that the scene does something in these edges, because otherwise their equality proves nothing: it touches
/// the wall, the torque is not always full, and (in the emulator, which is equal) the velocity was sampled.
fn does_something(options: &LoopScene) -> Vec<NetUse> {
    let scene = scene(options);
    let simulation = AxisSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let run = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
    assert!(run.encoder_edges > 100, "{} encoder edges", run.encoder_edges);
    let find = |name| run.nets.iter().find(|net| net.signal.name == name);
    let net = |name| find(name).expect("a net").usage;
    assert!(net("contact").min == 0 && net("contact").max == 1);
    let memory = if find("velocity").is_some() { "velocity" } else { "memory" };
    assert!(net(memory).max > 0 && net("command").max > 0);
    assert!(net("a_high").max + net("b_high").max > 0);
    run.nets
}

fn equal(options: &LoopScene) {
    does_something(options);
    let row = closed_loop(options, &project().join("hdl").into()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((row.vectors, row.mismatches), (EDGES, 0), "{:?}", row.first);
    println!("{} {} edges in {:.2} s", row.variant, row.edges, row.seconds);
}

#[test]
fn the_hybrid_loop_in_vhdl_equals_the_emulator_at_every_edge() {
    equal(&fast("hybrid-wall", &[]));
}

#[test]
fn the_hybrid_loop_with_dead_time_and_locked_antiphase_equals_the_emulator_at_every_edge() {
    let pwm = [("method.pwm.mode", "locked_antiphase"), ("method.pwm.dead_time", "200 ns"), ("method.pwm.bits", "9")];
    equal(&fast("hybrid-wall", &pwm));
}

#[test]
fn a_loop_that_holds_its_command_back_equals_the_emulator_at_every_edge() {
    let late = [("method.settling", "5"), ("method.pwm.duty", "immediate"), ("method.pwm.bits", "9")];
    equal(&fast("hybrid-wall", &late));
    equal(&fast("conventional-wall-10khz", &late));
}

#[test]
fn the_conventional_loop_in_vhdl_equals_the_emulator_at_every_edge() {
    equal(&fast("conventional-wall-10khz", &[]));
}

#[test]
fn the_loop_of_every_method_in_vhdl_equals_the_emulator_at_every_edge() {
    for name in ["bounded-wall", "coupled-wall", "observed-wall", "dual-rate-wall", "energy-level-wall", "shaped-wall"]
    {
        equal(&fast(
            name,
            &[("method.sample_rate", "20 kHz"), ("device.initial_angle", "0"), ("hand", "{ kind = \"none\" }")],
        ));
    }
}

#[test]
fn the_wrapping_product_in_vhdl_wraps_as_the_emulators_does() {
    let options = fast("wrap-product", &[("wall.position", "1.42 rad")]);
    let spring = does_something(&options).into_iter().find(|net| net.signal.name == "spring").expect("a net");
    assert!(spring.usage.overflowed > 0, "no product overflowed");
    equal(&options);
}

/// Copies the VHDL, and replaces one phrase in one file.
fn patched(file: &str, phrase: &str, by: &str) -> PathBuf {
    let copy = std::env::temp_dir().join(format!("hpu-test-loop-{}", std::process::id()));
    fs::create_dir_all(&copy).expect("a temporary directory");
    for entry in fs::read_dir(project().join("hdl")).expect("the VHDL") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "vhd") {
            fs::copy(&path, copy.join(path.file_name().expect("a file"))).expect("a copy");
        }
    }
    let text = fs::read_to_string(copy.join(file)).expect("the block");
    assert!(text.contains(phrase), "{file} no longer says `{phrase}`");
    fs::write(copy.join(file), text.replace(phrase, by)).expect("a patched block");
    copy
}

#[test]
fn a_wall_that_pulls_is_caught_at_the_edge_where_it_first_matters() {
    // The changed wall is in contact everywhere. It is wrong from the first edge on, because the wall lies ahead.
    let hdl = patched("unilateral.vhd", "contact     <= not delta(delta'high);", "contact     <= '1';");
    let options = LoopScene { edges: 100, ..fast("hybrid-wall", &[]) };
    let row = closed_loop(&options, &(&hdl).into()).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    let first = row.first.expect("a mismatch");
    assert_eq!((first.row, first.signal.as_str()), (1, "contact"));
    assert_eq!((first.expected.as_str(), first.got.as_str()), ("0 (0)", "1 (1)"));
    let (columns, rows) = first.around.table(first.row);
    let place = columns.iter().position(|name| name == "contact").expect("a net");
    assert_eq!(
        (columns[place + 1].as_str(), &rows[0][place..place + 2]),
        ("contact(vhdl)", &["0", "1"].map(String::from)[..])
    );
    // The edges after the mismatch are kept too. An edge of the waveform is an edge of the scene's clock.
    assert_eq!(first.around.rows.len(), 1 + 64);
    let changes = hpu_wave::mismatch_vcd(&first.around).into_bytes();
    assert_eq!(crate::read_back::changes(changes)["hybrid_loop.vhdl.contact"], [(20_000, "1".to_string())]);
}

#[test]
fn a_scene_that_is_refused_is_refused_with_its_own_message() {
    let options = fast("hybrid-wall", &[("wall.stifness", "1")]);
    let error = closed_loop(&options, &project().join("hdl").into()).expect_err("an unknown key").to_string();
    assert!(error.contains("wall.stifness"), "{error}");
}

#[test]
fn vectors_recorded_from_a_scene_are_the_runs_pins_and_gates_edge_by_edge() {
    let scene = scene(&fast("hybrid-wall", &[]));
    let simulation = AxisSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let all = scene_vectors(&simulation, EDGES);
    let (name, vectors) = &all[0];
    assert_eq!(*name, "hybrid_loop");
    let mut world = AxisWorld::new(simulation.plant(), 0, Schedule::default());
    assert_eq!(vectors.rows.len() as u64, EDGES + 1);
    assert_eq!(vectors.rows[0][0], 1);
    // Columns: rst, a_pin, b_pin, five constants, four gates. The gates drive the plant, which returns the pins.
    for row in &vectors.rows[1..] {
        let mut input = simulation.input();
        world.sense();
        world.place(&mut input);
        assert_eq!(row[..3], [0, input.a_pin, input.b_pin]);
        let [a_high, a_low, b_high, b_low] = row[8..] else { panic!("four gates") };
        world.drive(hpu_datapath::LoopOut { a_high, a_low, b_high, b_low }, row);
    }
    assert!(world.summary().encoder_edges > 100);
}

#[test]
fn vectors_of_the_blocks_inside_a_loop_give_the_nets_that_the_loop_has() {
    let scene = scene(&fast("hybrid-wall", &[]));
    let simulation = AxisSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let Some(hpu_cosim::AxisLoop::Hybrid(wiring)) = simulation.axis_loop() else { panic!("a hybrid loop") };
    let all = scene_vectors(&simulation, EDGES);
    let mut run = hpu_cosim::ClosedLoop::new(
        wiring.clone(),
        AxisWorld::new(simulation.plant(), 0, Schedule::default()),
        simulation.input(),
        u64::MAX,
    );
    let instances = wiring.instances();
    assert_eq!(all.len(), 1 + instances.len());
    for edge in 1..=EDGES as usize {
        run.step(&mut ());
        for (instance, (label, vectors)) in instances.iter().zip(&all[1..]) {
            assert_eq!(instance.label, *label);
            // The output of a limiter without registers depends on its inputs before the edge.
            if !instance.model.clocked() || instance.label == "limiter" {
                continue;
            }
            let outputs = AnyBlock::outputs(&*instance.model).len();
            let row = &vectors.rows[edge];
            let nets = &instance.connections[instance.connections.len() - outputs..];
            for (word, connection) in row[row.len() - outputs..].iter().zip(nets) {
                assert_eq!(*word, run.wiring.words()[connection.net], "{label} at edge {edge}");
            }
        }
    }
    let spring = &all.iter().find(|(label, _)| *label == "spring_mult").expect("a spring").1;
    assert!(spring.rows.iter().any(|row| row[2] > 0), "the wall was touched");
}
