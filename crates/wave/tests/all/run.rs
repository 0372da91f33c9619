//! Waveforms of whole runs: recording changes nothing, both drivers write the same files, and recorded pins can be
//! replayed.

use std::io::Cursor;

use hpu_cosim::replay::{Columns, read_capture};
use hpu_cosim::scene::Scene;
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, Summary, Wired};
use hpu_datapath::{HybridLoop, LoopConfig, Wiring};
use hpu_signal::{Clock, Cycle, Observe};
use hpu_wave::{Fst, Layout, Vcd};

/// Returns the shipped hybrid wall, so near that the hand is in it within hundredths of a second.
fn scene() -> Scene {
    let text = include_str!("../../../../testbench/scenes/hybrid-wall.toml");
    let set = |key: &str, value: &str| (key.to_string(), value.to_string());
    let overrides = [set("wall.position", "0.01 rad"), set("run.duration", "30 ms")];
    let mut load = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    Scene::parse("hybrid-wall.toml", text, &overrides, &mut load).expect("a shipped scene")
}

/// Runs the scene, and sets the wall time, which differs from run to run, to zero.
fn run(simulation: &AxisSimulation, driver: Driver, observer: &mut impl Observe) -> Summary {
    let summary = simulation.run(driver, &mut simulation.trace(&[]), observer, &Control::default());
    Summary { wall_s: 0.0, ..summary }
}

#[test]
fn a_run_with_a_waveform_equals_one_without_and_both_drivers_write_the_same_files() {
    let scene = scene();
    let simulation = AxisSimulation::new(&scene).expect("a shipped scene");
    let end = Cycle(scene.edges());
    let unwatched = run(&simulation, Driver::Events, &mut ());
    assert!(unwatched.output_changes > 100, "the wall is hit: {} gate changes", unwatched.output_changes);
    let record = |driver| {
        let layout = Layout::of(&simulation);
        let mut vcd = Vcd::new(Vec::new(), &layout, scene.clock).expect("memory");
        let mut fst = Fst::new(Cursor::new(Vec::new()), &layout, scene.clock).expect("memory");
        let with_vcd = run(&simulation, driver, &mut vcd);
        let with_fst = run(&simulation, driver, &mut fst);
        assert_eq!(with_vcd, with_fst);
        let fst = fst.finish(end).expect("memory").into_inner();
        (with_vcd, vcd.finish(end).expect("memory"), fst)
    };
    let (by_events, events_vcd, events_fst) = record(Driver::Events);
    let (_, clock_vcd, clock_fst) = record(Driver::Clock);
    assert_eq!(by_events, unwatched);
    assert!(events_vcd == clock_vcd, "the VCD files of the two drivers differ");
    assert!(events_fst == clock_fst, "the FST files of the two drivers differ");
}

#[test]
fn recorded_pins_replay_at_the_edges_they_were_recorded_at() {
    let wiring = HybridLoop::new(LoopConfig::default()).expect("valid");
    let layout = Layout::new(&wiring, &[]);
    // The periods are a whole, a fractional and a repeating number of picoseconds; the last two frequencies are the
    // ends of the range.
    for frequency_hz in [50_000_000, 25_175_000, 33_333_333, 1, 10_000_000_000] {
        let clock = Clock::new(frequency_hz).expect("valid");
        let mut vcd = Vcd::new(Vec::new(), &layout, clock).expect("memory");
        let mut fst = Fst::new(Cursor::new(Vec::new()), &layout, clock).expect("memory");
        let mut words = vec![0; wiring.nets().len()];
        vcd.nets(Cycle(0), &words);
        fst.nets(Cycle(0), &words);
        // Gray code forwards; each state lasts one edge longer than the one before.
        let levels = |count: u64| ((count / 2) % 2 == 1, count.div_ceil(2) % 2 == 1);
        let edge = |count: u64| count * (count + 1) / 2;
        for count in 1..=1_000 {
            let (a, b) = levels(count);
            (words[0], words[1]) = (a.into(), b.into());
            vcd.nets(Cycle(edge(count)), &words);
            fst.nets(Cycle(edge(count)), &words);
        }
        let end = Cycle(edge(1_001));
        for file in [vcd.finish(end).expect("memory"), fst.finish(end).expect("memory").into_inner()] {
            let read = read_capture(&file, "hybrid_loop.a_pin", "hybrid_loop.b_pin", &Columns::default());
            let read = read.expect("a capture");
            let read =
                read.edges.iter().map(|pins| (clock.first_edge_at(pins.picoseconds.unsigned_abs()), (pins.a, pins.b)));
            assert!(read.eq((0..=1_000).map(|count| (Cycle(edge(count)), levels(count)))), "at {frequency_hz} Hz");
        }
    }
}
