//! The PHANToM's wirings closed around the VHDL in GHDL, and vectors recorded from them.

use std::fs;
use std::path::{Path, PathBuf};

use hpu_cosim::scene::{PhantomScene, shipped};
use hpu_cosim::{ClosedLoop, Control, Driver, LoopVisitor, PhantomSimulation, SceneFile, Simulation, Wired, World};
use hpu_datapath::{AnyBlock, Wiring};
use hpu_rtl::{LoopScene, Vectors, closed_loop, scene_vectors};

const EDGES: u64 = 60_000;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns a shipped scene that is thrown so fast that the tip hits the wall within the first 0.3 ms.
fn fast(name: &str, more: &[(&str, &str)]) -> LoopScene {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let thrown =
        [("drop.speed", "2 m/s"), ("room.distance", "0.5 mm"), ("room.walls", "xyz"), ("run.duration", "1.2 ms")];
    let overrides = thrown.iter().chain(more).map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let (name, text) = (format!("{name}.toml"), scene.text.to_string());
    let source = SceneFile { name, text, data: project().join("testbench/scenes"), is_shipped: false };
    LoopScene { source, overrides, edges: EDGES }
}

fn scene(options: &LoopScene) -> PhantomScene {
    let shipped =
        shipped().iter().find(|scene| options.source.name == format!("{}.toml", scene.name)).expect("shipped");
    let scene = shipped.parse(&options.overrides).unwrap_or_else(|error| panic!("{error}"));
    scene.phantom().expect("a PHANToM")
}

/// Asserts that the tip hits the wall and the motors pull in these edges, because otherwise their equality proves
/// nothing.
fn does_something(options: &LoopScene) {
    let scene = scene(options);
    let simulation = PhantomSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let run = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
    assert_eq!((run.edges, run.aborted), (EDGES, None));
    assert!(run.encoder_edges > 40, "{} encoder edges", run.encoder_edges);
    let net = |name: &str| run.nets.iter().find(|net| net.signal.name == name).map(|net| net.usage);
    let pulls = (1..=3).any(|joint| net(&format!("command{joint}")).is_some_and(|usage| usage.max > 100));
    assert!(pulls, "no motor pulls");
    assert!(net("contact").is_none_or(|contact| contact.min == 0 && contact.max > 0), "no contact");
}

fn equal(options: &LoopScene) {
    does_something(options);
    let row = closed_loop(options, &project().join("hdl").into()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((row.vectors, row.mismatches), (EDGES, 0), "{:?}", row.first);
    println!("{} {} edges in {:.2} s", row.variant, row.edges, row.seconds);
}

#[test]
fn the_parallel_loop_in_vhdl_equals_the_emulator_at_every_edge() {
    equal(&fast("phantom-thrown", &[]));
}

#[test]
fn the_loop_of_one_multiplier_in_vhdl_equals_the_emulator_at_every_edge() {
    equal(&fast("phantom-thrown-shared", &[]));
}

#[test]
fn counters_and_motors_around_a_host_equal_the_emulators_at_every_edge() {
    equal(&fast("phantom-thrown-rtos", &[]));
}

#[test]
fn beyond_the_tables_the_vhdl_commands_nothing_as_the_emulator_does() {
    // 8 bits hold 127 counts, which is 4 mm. The wall is at 0.5 mm, and is too soft to stop the tip.
    let options =
        fast("phantom-thrown", &[("method.depth_bits", "8"), ("room.stiffness", "50"), ("drop.speed", "8 m/s")]);
    let scene = scene(&options);
    let simulation = PhantomSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let run = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
    let abort = run.aborted.expect("it leaves the tables");
    assert!(abort.why.contains("tables"), "{abort:?}");
    // The VHDL goes on after the end of the run, for as many edges again.
    let hdl = project().join("hdl").into();
    let row =
        closed_loop(&LoopScene { edges: 2 * run.edges, ..options }, &hdl).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((row.vectors, row.mismatches), (2 * run.edges, 0), "{:?}", row.first);
}

/// Copies the VHDL, and replaces one phrase in one file.
fn patched(file: &str, phrase: &str, by: &str) -> PathBuf {
    let copy = std::env::temp_dir().join(format!("hpu-test-phantom-{file}-{}", std::process::id()));
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

/// Records the words of a net after each edge in the emulator.
struct Of(&'static str);

impl<'s> LoopVisitor<'s> for Of {
    type Out = Vec<i64>;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Vec<i64>
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let net = wiring.nets().iter().position(|net| net.name == self.0).expect("a net");
        let mut run = ClosedLoop::new(wiring.clone(), world, input, u64::MAX);
        let word = |run: &mut ClosedLoop<W, E>| {
            run.step(&mut ());
            run.wiring.words()[net]
        };
        (0..EDGES).map(|_| word(&mut run)).collect()
    }
}

#[test]
fn a_wall_that_pulls_is_caught_at_the_edge_of_the_first_contact() {
    let phrase = "force_y <= push(depth_y, stiffness, room(1));";
    let wrong = "force_y <= push(-depth_y, stiffness, room(1));";
    let hdl = patched("cube_room.vhd", phrase, wrong);
    let options = LoopScene { edges: 30_000, ..fast("phantom-thrown", &[]) };
    let row = closed_loop(&options, &(&hdl).into()).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    let scene = scene(&options);
    let simulation = PhantomSimulation::new(&scene).expect("valid");
    let forces = simulation.visit(Of("force_y"));
    let contact = forces.iter().position(|force| *force != 0).expect("contact");
    let first = row.first.expect("a mismatch");
    assert_eq!((first.row, first.signal.as_str()), (contact as u64 + 1, "force_y"));
    let newtons = |word: i64| format!("({})", word as f64 / 65_536.0);
    assert!(first.expected.ends_with(&newtons(forces[contact])), "{}", first.expected);
    assert!(first.got.ends_with(&newtons(-forces[contact])), "{}", first.got);
}

#[test]
fn a_host_command_held_an_edge_too_long_is_caught_where_it_changes() {
    // The changed register has period 3: it takes the host's word on the first edge and on every third edge after it.
    let hdl = patched("phantom_io.vhd", "period => \"01\"", "period => \"11\"");
    let options = LoopScene { edges: 30_000, ..fast("phantom-thrown-rtos", &[]) };
    let row = closed_loop(&options, &(&hdl).into()).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    let scene = scene(&options);
    let simulation = PhantomSimulation::new(&scene).expect("valid");
    // Samples are 2500 edges apart, so two of three commands change on an edge at which the register does not take
    // them.
    let late = ["command1", "command2", "command3"].map(|name| {
        let commands = simulation.visit(Of(name));
        let changed = |edge: &usize| commands[*edge] != commands[edge - 1];
        // Index 0 has the word after edge 1.
        (1..commands.len())
            .filter(changed)
            .find(|edge| !edge.is_multiple_of(3))
            .map_or(u64::MAX, |edge| edge as u64 + 1)
    });
    let first = row.first.expect("a mismatch");
    let earliest = late.into_iter().min().expect("three");
    assert_eq!(first.row, earliest, "{late:?}");
    let joint = late.iter().position(|edge| *edge == earliest).expect("one of them") + 1;
    assert_eq!(first.signal, format!("command{joint}"));
}

/// Compares each row of each instance's vectors with the nets of the loop.
struct Replay<'a>(&'a [(&'static str, Vectors)]);

impl<'s> LoopVisitor<'s> for Replay<'_> {
    type Out = ();
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In)
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let instances = wiring.instances();
        assert_eq!(self.0.len(), 1 + instances.len());
        let mut run = ClosedLoop::new(wiring.clone(), world, input, u64::MAX);
        // Combinational blocks have one row for each change.
        let mut rows: Vec<_> = instances.iter().map(|_| 0).collect();
        let inputs = AnyBlock::inputs(wiring).len();
        let mut before = run.wiring.words().to_vec();
        for edge in 1..=EDGES as usize {
            run.step(&mut ());
            let after = run.wiring.words().to_vec();
            before[..inputs].copy_from_slice(&after[..inputs]);
            for ((instance, (label, vectors)), row) in instances.iter().zip(&self.0[1..]).zip(&mut rows) {
                assert_eq!(instance.label, *label);
                let (ins, outs) = (vectors.header.inputs.len(), vectors.header.outputs.len());
                let nets = &instance.connections[instance.connections.len() - outs..];
                if instance.model.clocked() {
                    let row = &vectors.rows[edge];
                    for (word, connection) in row[row.len() - outs..].iter().zip(nets) {
                        assert_eq!(*word, after[connection.net], "{label} at edge {edge}");
                    }
                } else {
                    let sampled: Vec<_> =
                        instance.connections[..ins].iter().map(|connection| before[connection.net]).collect();
                    if vectors.rows[*row][..ins] != sampled {
                        *row += 1;
                    }
                    assert_eq!(vectors.rows[*row][..ins], sampled, "{label} at edge {edge}");
                    // Before the first edge the nets have not settled to the scene's words yet.
                    let shown = if edge == 1 { &[] } else { nets };
                    for (word, connection) in vectors.rows[*row][ins..].iter().zip(shown) {
                        assert_eq!(*word, before[connection.net], "{label} at edge {edge}");
                    }
                }
            }
            before = after;
        }
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn vectors_of_the_blocks_inside_each_loop_give_the_nets_that_the_loop_has() {
    for (name, wiring) in [
        ("phantom-thrown", "phantom_loop"),
        ("phantom-thrown-shared", "phantom_shared_loop"),
        ("phantom-thrown-rtos", "phantom_io"),
    ] {
        let scene = scene(&fast(name, &[]));
        let simulation = PhantomSimulation::new(&scene).expect("valid");
        let all = scene_vectors(&simulation, EDGES);
        assert_eq!((all[0].0, all[0].1.rows.len() as u64), (wiring, EDGES + 1));
        simulation.visit(Replay(&all));
        for (label, vectors) in &all {
            let again = Vectors::parse(&vectors.to_text(), vectors.header.clone());
            assert!(again.as_ref() == Ok(vectors), "{name} {label}");
        }
    }
}
