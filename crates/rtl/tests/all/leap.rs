//! Designs by others as netlists that leap: known answers of Verilator, and whole runs beside Verilator.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hpu_cosim::dut::{Asked, Change, Design, Designs, DutSimulation, Inside};
use hpu_cosim::scene::{DutScene, Experiment, SceneFile};
use hpu_cosim::{Control, Simulation, Summary};
use hpu_rtl::dut::Simulators;
use hpu_rtl::{CacheFolder, Hdl, Setup};
use hpu_signal::{Cycle, Observe};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the project")
}

fn simulators() -> Simulators {
    let cache = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("leap");
    Simulators { cache: CacheFolder::new(Some(cache), "built models").with_programs(), setup: Setup::new(Hdl::Carried) }
}

/// Returns a scene of `testbench/dut` whose text is changed in these places, with an engine.
fn scene(name: &str, changes: &[(&str, &str)], engine: &str) -> DutScene {
    let path = root().join(format!("testbench/dut/{name}.toml"));
    let mut file = SceneFile::find(&path.to_string_lossy()).expect("a scene");
    for (before, after) in changes {
        assert!(file.text.contains(before), "{name}: {before}");
        file.text = file.text.replace(before, after);
    }
    let set = [("dut.engine".to_string(), engine.to_string())];
    match file.parse(&set).unwrap_or_else(|error| panic!("{error}")) {
        Experiment::Dut(scene) => scene,
        _ => panic!("{name} has a design"),
    }
}

fn built(scene: &DutScene) -> Arc<dyn Design> {
    simulators().build(scene, Inside::Nothing).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the polynomial remainder of CRC-32 (IEEE 802.3).
fn crc32(text: &str) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !text.bytes().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(byte), step))
}

/// Clocks a design for two million edges: the reset is active for eight of them; then the lines of an encoder, `enc_a`
/// and `enc_b`, step forward 1100 times, every 1000 edges. Returns a line for each change of an output; all outputs
/// count as 0 before edge 1.
fn stimulated(design: &dyn Design, reset: (&str, u64), constants: &[(&str, u64)]) -> String {
    const EDGES: u64 = 2_000_000;
    let ports: Vec<_> = design.ports().iter().filter(|port| port.name != "clk").collect();
    let mut words = vec![0; ports.len()];
    let place = |name: &str| ports.iter().position(|port| port.name == name).expect("a port");
    for (name, word) in constants {
        words[place(name)] = *word;
    }
    let (a, b, rst) = (place("enc_a"), place("enc_b"), place(reset.0));
    words[rst] = reset.1;
    let mut running = design.start(&words, &vec![false; ports.len()], &mut Vec::new()).expect("a simulation");
    let (mut shown, mut text, mut edge) = (vec![0; ports.len()], String::new(), 0);
    let mut next = |words: &[u64], until: u64| {
        let mut changes = Vec::new();
        while edge < until {
            let done = running.clock(words, until - edge, Asked::Outputs, &mut changes).expect("edges");
            for Change { edge: at, port, bits } in changes.drain(..) {
                let bits = bits.expect("known bits");
                if std::mem::replace(&mut shown[port], bits) != bits {
                    writeln!(text, "{} {} {bits}", edge + at, ports[port].name).expect("memory");
                }
            }
            edge += done;
        }
    };
    next(&words, 8);
    words[rst] = 1 - reset.1;
    for step in 1..=1100 {
        next(&words, 1000 * (step + 1) + 16);
        let phase = step % 4;
        (words[a], words[b]) = (u64::from(phase >= 2), u64::from(phase == 1 || phase == 2));
    }
    next(&words, EDGES);
    text
}

/// The figures are those of Verilator 5.006.
#[test]
fn two_designs_have_the_outputs_that_verilator_has_told() {
    let zero = ("[dut]\n", "[dut]\nregisters = \"zero\"\n");
    let knee = [zero, ("reset = { port = \"rst\" }\n", ""), ("gain = 95\n", "gain = 95\nrst = 0\n")];
    let knee = stimulated(&*built(&scene("knee", &knee, "leap")), ("rst", 1), &[("gain", 95), ("wall", 978)]);
    assert_eq!(knee.lines().take(2).collect::<Vec<_>>(), ["1 dir 1", "2019 position 1"]);
    assert_eq!(knee.lines().rev().take(2).collect::<Vec<_>>(), ["1999974 pwm 1", "1999675 pwm 0"]);
    assert_eq!((knee.lines().count(), crc32(&knee)), (3098, 0x4cbb_80c4));
    let rim =
        [zero, ("reset = { port = \"rst_n\", active = \"low\" }\n", ""), ("[dut.ports]\n", "[dut.ports]\nrst_n = 1\n")];
    let rim = stimulated(&*built(&scene("rim", &rim, "leap")), ("rst_n", 0), &[]);
    assert_eq!(rim.lines().next(), Some("15 gate_al 1"));
    assert_eq!(rim.lines().rev().take(2).collect::<Vec<_>>(), ["1999889 gate_bh 1", "1999884 gate_bl 0"]);
    assert_eq!((rim.lines().count(), crc32(&rim)), (4020, 0xdecc_16f6));
}

/// Every word that an observer is shown, edge by edge.
#[derive(Default, PartialEq)]
struct Shown(Vec<(u64, Vec<i64>)>);

impl Observe for Shown {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.0.last().is_none_or(|(_, last)| last != words) {
            self.0.push((cycle.0, words.to_vec()));
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

fn ran(scene: &DutScene) -> (Shown, Summary, String) {
    let simulators = simulators();
    let simulation = DutSimulation::new(scene, &simulators, Inside::Nothing).unwrap_or_else(|error| panic!("{error}"));
    let (mut trace, mut shown) = (simulation.brief_trace(), Shown::default());
    let summary =
        simulation.run(true, &mut trace, &mut shown, &Control::default()).unwrap_or_else(|error| panic!("{error}"));
    (shown, summary, simulation.engine().to_string())
}

/// Holds a run by leaps against one by Verilator: every word of every port at every edge, and the energies to the bit.
fn same_as_verilator(name: &str, changes: &[(&str, &str)], least: usize) -> Summary {
    let ((leapt, by_leaps, one), (clocked, by_verilator, other)) =
        (ran(&scene(name, changes, "leap")), ran(&scene(name, changes, "verilator")));
    assert!(one.starts_with("hpu's leaps") && other.starts_with("Verilator"), "{one}, {other}");
    assert_eq!(leapt.0.len(), clocked.0.len(), "{name}");
    for (own, other) in leapt.0.iter().zip(&clocked.0) {
        assert_eq!(own, other, "{name}");
    }
    assert!(leapt.0.len() > least, "{name}: {} changes", leapt.0.len());
    assert_eq!(by_leaps.energy, by_verilator.energy, "{name}");
    let counts = |summary: &Summary| (summary.edges, summary.encoder_edges, summary.output_changes);
    assert_eq!(counts(&by_leaps), counts(&by_verilator), "{name}");
    by_leaps
}

/// The energies are those of Verilator 5.006 when the designs came into the repository.
#[test]
fn whole_runs_are_those_of_verilator_to_the_last_bit() {
    let energy = |summary: Summary| (summary.energy.source_j, summary.energy.copper_j);
    let knee = energy(same_as_verilator("knee", &[], 10_000));
    assert_eq!(knee, (10.797_218_678_279_638, 10.803_402_102_578_916));
    let rim = energy(same_as_verilator("rim", &[], 20_000));
    assert_eq!(rim, (10.773_356_039_689_741, 10.767_953_388_357_42));
}
