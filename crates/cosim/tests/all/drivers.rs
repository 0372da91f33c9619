//! The drivers: leaping and stepping agree, observers change nothing, and recorded pins drive the datapath as the
//! device did.

use hpu_cosim::replay::PinEdge;
use hpu_cosim::scene::{Experiment, Hand, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Summary, Wired, WiredSimulation};
use hpu_signal::{Clock, Cycle, Observe};

/// Edges over which a scene is compared.
const EDGES: u64 = 2_000_000;
/// The same of each shipped scene in the test command.
const FEW: u64 = 400_000;

fn parsed(name: &str, overrides: &[(&str, &str)]) -> Experiment {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn agree(scene: &Experiment, edges: u64) {
    let simulation = WiredSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let comparison = simulation.compare(scene.edges().min(edges));
    assert_eq!(comparison.mismatches, 0, "{}: {:?}", scene.name, comparison.first);
}

#[test]
fn leaping_and_stepping_agree_at_every_edge_of_every_shipped_scene() {
    for scene in shipped() {
        agree(&parsed(scene.name, &[]), FEW);
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn leaping_and_stepping_agree_longer_on_every_shipped_scene() {
    for scene in shipped() {
        agree(&parsed(scene.name, &[]), EDGES);
    }
}

#[test]
fn they_agree_from_the_first_edge_in_contact_under_every_bridge() {
    let moving = [("device.initial_angle", "1.45 rad"), ("device.initial_speed", "60 rad/s")];
    for bridge in [
        &[][..],
        &[("method.pwm.off", "float"), ("bridge.on_resistance", "0.3 Ohm")],
        &[("method.pwm.mode", "locked_antiphase"), ("method.pwm.dead_time", "1 us")],
        &[("method.pwm.duty", "immediate"), ("method.pwm.bits", "9")],
        &[("model.bridge", "averaged")],
        &[("method.settling", "3"), ("method.pwm.duty", "immediate"), ("method.pwm.bits", "9")],
        &[("method.settling", "2"), ("model.bridge", "averaged")],
        &[("device.coulomb_friction", "8 mN.m"), ("method.pwm.off", "float"), ("method.pwm.dead_time", "2 us")],
    ] {
        for name in ["hybrid-wall", "conventional-wall-10khz"] {
            agree(&parsed(name, &[&moving[..], bridge].concat()), EDGES);
        }
    }
}

/// Every change of the nets, and the number of rows of the plant.
#[derive(Default, PartialEq, Debug)]
struct Dense {
    changes: Vec<(Cycle, Vec<i64>)>,
    rows: u64,
}

impl Observe for Dense {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.changes.last().is_none_or(|(_, last)| last != words) {
            self.changes.push((cycle, words.to_vec()));
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {
        self.rows += 1;
    }
}

/// Returns a summary without the wall time of the run.
fn timeless(summary: Summary) -> Summary {
    Summary { wall_s: 0.0, ..summary }
}

#[test]
fn watching_a_run_changes_nothing_of_it() {
    for scene in shipped() {
        let scene = parsed(scene.name, &[]);
        let simulation = WiredSimulation::new(&scene).unwrap();
        let nets: Vec<&str> = simulation.nets().iter().map(|net| net.name).collect();
        let alone = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut (), &Control::default());
        let mut dense = Dense::default();
        let watched = simulation.run(Driver::Events, &mut simulation.trace(&nets), &mut dense, &Control::default());
        assert_eq!(timeless(watched), timeless(alone), "{}", scene.name);
        assert_eq!(dense.rows, scene.edges() / simulation.stride() + 1, "{}", scene.name);
    }
}

#[test]
fn a_hundred_times_as_many_rows_change_neither_words_nor_energy() {
    let run = |rate| {
        let scene = parsed("hybrid-wall", &[("record.plant_rate", rate), ("run.duration", "300 ms")]);
        let simulation = WiredSimulation::new(&scene).unwrap();
        let mut dense = Dense::default();
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut dense, &Control::default());
        // The verdict's numbers depend on the rows that it judged; means and places begin at a row.
        (Summary { verdict: None, averages: None, stays: None, ..timeless(summary) }, dense.changes)
    };
    assert_eq!(run("10 kHz"), run("1 MHz"));
}

/// The pins as a logic analyser records them.
struct Analyser {
    clock: Clock,
    edges: Vec<PinEdge>,
}

impl Observe for Analyser {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        // The pins are the first two nets of every loop.
        let (a, b) = (words[0] != 0, words[1] != 0);
        if self.edges.last().is_none_or(|last| (last.a, last.b) != (a, b)) {
            self.edges.push(PinEdge { picoseconds: self.clock.picoseconds(cycle).cast_signed(), a, b });
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

#[test]
fn recorded_pins_drive_every_net_as_the_device_did() {
    for name in ["hybrid-wall", "hybrid-wall-25mhz", "conventional-wall-1khz", "wrap-product"] {
        let scene = parsed(name, &[]).axis().unwrap();
        let simulation = AxisSimulation::new(&scene).unwrap();
        let mut analyser = Analyser { clock: scene.clock, edges: Vec::new() };
        let mut closed = Dense::default();
        let control = Control::default();
        simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut analyser, &control);
        simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut closed, &control);

        let mut recording = scene.clone();
        recording.hand = Hand::Capture { edges: analyser.edges };
        let simulation = AxisSimulation::new(&recording).unwrap();
        let mut replayed = Dense::default();
        let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut replayed, &control);
        assert!(closed.changes.len() > 1000, "{name}");
        assert_eq!(summary.verdict, None, "{name}");
        let difference = closed.changes.iter().zip(&replayed.changes).find(|(one, other)| one != other);
        assert_eq!(difference, None, "{name}");
        assert_eq!(closed.changes.len(), replayed.changes.len(), "{name}");
    }
}

#[test]
fn a_motion_of_four_counts_an_edge_is_counted_whole() {
    // At 3e5 rad/s the angle passes 3.9 of 4096 counts a revolution at each edge of 50 MHz, and is 3 rad after 10 us.
    let counts = 3.0 * 4096.0 / std::f64::consts::TAU;
    for (path, passed) in [("[[0, 0], [\"20 us\", 6]]", counts.floor()), ("[[0, 0], [\"20 us\", -6]]", counts.ceil())] {
        let fast = [("hand.path", path), ("run.duration", "10 us"), ("record.plant_rate", "1 MHz")];
        let scene = parsed("prescribed-sweep", &fast);
        let simulation = WiredSimulation::new(&scene).unwrap();
        for driver in [Driver::Events, Driver::Clock] {
            let summary = simulation.run(driver, &mut simulation.brief_trace(), &mut (), &Control::default());
            assert_eq!(summary.encoder_edges, passed as u64, "{path}");
        }
    }
}
