//! Waveforms of a PHANToM's run, read back by another project's parser: every net and every plant output, change by
//! change.

use std::io::Cursor;

use hpu_cosim::scene::{PhantomScene, shipped};
use hpu_cosim::{Control, Driver, PhantomSimulation, Simulation, Wired};
use hpu_signal::{Cycle, Observe};
use hpu_wave::{Fst, Layout, Vcd};

use crate::read_back::{self, Changes};

/// Returns a shipped scene of 4 ms with contact.
fn scene(name: &str) -> PhantomScene {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let set = |key: &str, value: &str| (key.to_string(), value.to_string());
    let overrides = [set("run.duration", "4 ms"), set("room.distance", "0.5 mm"), set("drop.speed", "1 m/s")];
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}")).phantom().expect("a PHANToM")
}

/// Records all words and reals that the engine shows.
#[derive(Default)]
struct Shown {
    nets: Vec<(Cycle, Vec<i64>)>,
    reals: Vec<(Cycle, Vec<f64>)>,
}

impl Observe for Shown {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.nets.push((cycle, words.to_vec()));
    }
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.reals.push((cycle, values.to_vec()));
    }
}

fn put(changes: &mut Changes, name: String, time_ps: u64, value: String) {
    let list = changes.entry(name).or_default();
    if list.last().is_none_or(|(_, last)| *last != value) {
        list.push((time_ps, value));
    }
}

#[test]
fn every_word_and_every_output_of_the_plant_is_read_back_by_another_parser() {
    for name in ["phantom-thrown", "phantom-thrown-shared", "phantom-thrown-rtos"] {
        let scene = scene(name);
        let simulation = PhantomSimulation::new(&scene).expect("valid");
        let layout = Layout::of(&simulation);
        let mut shown = Shown::default();
        let mut vcd = Vcd::new(Vec::new(), &layout, scene.clock).expect("memory");
        let mut fst = Fst::new(Cursor::new(Vec::new()), &layout, scene.clock).expect("memory");
        let control = Control::default();
        let alone = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut shown, &control);
        assert!(alone.output_changes > 0, "{name}: no contact");
        simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut vcd, &control);
        simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut fst, &control);

        // At 50 MHz an edge takes 20000 ps.
        let (nets, wiring) = (simulation.nets(), simulation.wiring().name());
        let mut expected = Changes::new();
        for (cycle, words) in &shown.nets {
            for (net, &word) in nets.iter().zip(words) {
                let width = net.format.width();
                let bits = format!("{:0width$b}", i128::from(word).rem_euclid(1 << width), width = width as usize);
                put(&mut expected, format!("{wiring}.{}", net.name), 20_000 * cycle.0, bits);
            }
        }
        for (cycle, values) in &shown.reals {
            for (real, value) in simulation.reals().iter().zip(values) {
                put(&mut expected, format!("plant.{}", real.name), 20_000 * cycle.0, format!("{value:?}"));
            }
        }
        let end = Cycle(alone.edges);
        let files = [vcd.finish(end).expect("memory"), fst.finish(end).expect("memory").into_inner()];
        for found in files.map(read_back::changes) {
            for (variable, changes) in &expected {
                assert!(found[variable] == *changes, "{name}: {variable}");
            }
            if wiring == "phantom_io" {
                // This register takes its input on every edge, because its period is tied to 1.
                assert_eq!(found["phantom_io.hold.period"], [(0, "01".to_string())]);
            }
            assert_eq!(found[&format!("{wiring}.rst")], [(0, "0".to_string())]);
        }
    }
}
