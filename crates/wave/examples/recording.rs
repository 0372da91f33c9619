//! What recording costs: wall times of runs without a waveform and with one, taken in turn, for `testbench/speed.sh`.
//!
//! A line a run, of medians: `alone` without; `events` with every edge run at which something would be written, but
//! nothing written (alone, pulses that only repeat are leapt over); `recorded` with an FST of all signals, written on
//! another thread as `hpu run -o` does; `one thread` with it written on the run's own. Recording `costs` what it adds
//! to the run alone, in units of `events`: 1 where it slows a run by what the events cost that it writes. Then the time
//! of a VCD of 10^6 edges of all signals, the clock among them.

use std::env;
use std::fs::{self, File};
use std::path::Path;
use std::time::Instant;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Driver, Simulation, Wired, WiredSimulation};
use hpu_signal::{Cycle, Observe};
use hpu_wave::{Fst, Layout, Vcd};

/// Name, scene and what is changed in it.
type Run = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const RUNS: [Run; 5] = [
    ("hybrid-wall,2s", "hybrid-wall", &[]),
    ("hybrid-wall,10s", "hybrid-wall", &[("run.duration", "10 s")]),
    ("wandering,averaged", "hybrid-wall", &[("run.duration", "10 s"), ("model.bridge", "averaged")]),
    ("friction-wall", "friction-wall", &[]),
    ("phantom-drop", "phantom-drop", &[]),
];
const TURNS: usize = 15;

fn scene(name: &str, set: &[(&str, &str)]) -> Experiment {
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    shipped.parse(&set).expect("a shipped scene")
}

fn observed(simulation: &WiredSimulation, observer: &mut impl Observe) -> Cycle {
    let mut trace = simulation.brief_trace();
    Cycle(simulation.run(Driver::Events, &mut trace, observer, &Control::default()).edges)
}

/// Looks at every edge at which a word changes, and keeps nothing.
struct Watcher;

impl Observe for Watcher {
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

fn milliseconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    1e3 * start.elapsed().as_secs_f64()
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

fn fst(simulation: &WiredSimulation, path: &Path) -> Fst<File> {
    Fst::new(File::create(path).expect("a file"), &Layout::of(simulation), simulation.clock())
        .expect("a disk with room")
}

fn main() {
    let path = env::temp_dir().join(format!("hpu-recording-{}", std::process::id()));
    println!(
        "{:<22} {:>9} {:>9} {:>9} {:>10} {:>6} {:>10} {:>9}",
        "recording, ms", "alone", "events", "recorded", "one thread", "costs", "one thread", "KiB"
    );
    for (name, shipped, set) in RUNS {
        let scene = scene(shipped, set);
        let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
        let mut walls_ms = [const { Vec::new() }; 4];
        for _ in 0..TURNS {
            walls_ms[0].push(milliseconds(|| {
                observed(&simulation, &mut ());
            }));
            walls_ms[1].push(milliseconds(|| {
                observed(&simulation, &mut Watcher);
            }));
            // Not over a file that is there: to cut it off takes time too.
            let _ = fs::remove_file(&path);
            walls_ms[2].push(milliseconds(|| {
                let mut aside = fst(&simulation, &path).aside();
                let end = observed(&simulation, &mut aside);
                aside.finish(end).expect("a disk with room");
            }));
            let _ = fs::remove_file(&path);
            walls_ms[3].push(milliseconds(|| {
                let mut file = fst(&simulation, &path);
                let end = observed(&simulation, &mut file);
                file.finish(end).expect("a disk with room");
            }));
        }
        let [alone, events, recorded, one_thread] = walls_ms.map(median);
        let (costs, one_costs) = ((recorded - alone) / events, (one_thread - alone) / events);
        let kib = fs::metadata(&path).expect("just written").len() / 1024;
        println!(
            "{name:<22} {alone:>9.2} {events:>9.2} {recorded:>9.2} {one_thread:>10.2} {costs:>6.2} {one_costs:>10.2} \
             {kib:>9}"
        );
    }
    let scene = scene("hybrid-wall", &[("wall.position", "0.05 rad"), ("run.duration", "20 ms")]);
    let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
    let walls = (0..TURNS).map(|_| {
        milliseconds(|| {
            let file = File::create(&path).expect("a file");
            let mut vcd =
                Vcd::new(file, &Layout::of(&simulation).with_clock(), simulation.clock()).expect("a disk with room");
            let end = observed(&simulation, &mut vcd);
            assert_eq!(end, Cycle(1_000_000));
            vcd.finish(end).expect("a disk with room");
        })
    });
    println!("a VCD of 10^6 edges of all signals, the clock among them: {:.0} ms", median(walls.collect()));
    fs::remove_file(&path).expect("just written");
}
