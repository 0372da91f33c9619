//! Short runs, one a process, for `testbench/instructions.sh` to count their instructions under callgrind.
//!
//! Without an argument it lists the runs and what they do; with the name of one it does that. Only what happens within
//! `counted` counts: the run and its set-up, not the start of the process nor the parsing of the scene.

use std::env;
use std::io::{self, Cursor, Write};
use std::ops::Range;
use std::process::ExitCode;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Driver, LinearLoop, Simulation, Summary, Wired, WiredSimulation, look};
use hpu_prove::linear::{DrivenSet, usual_range};
use hpu_signal::{Clock, Cycle, Observe};
use hpu_wave::{Fst, Layout, Vcd};

/// Callgrind counts while a run is in here.
#[inline(never)]
fn counted(work: &mut dyn FnMut()) {
    work();
}

/// A run: its name, what it is for, and itself.
type Case = (&'static str, &'static str, fn());

const CASES: [Case; 18] = [
    ("events", "hybrid-wall whole, 10^8 edges, switching bridge, from event to event", || {
        run("hybrid-wall", &[], Driver::Events);
    }),
    ("clock", "its first 10^5 edges, edge by edge", || {
        run("hybrid-wall", &[("run.duration", "2 ms")], Driver::Clock);
    }),
    ("contact", "half a second with the hand in the wall, averaged bridge", || {
        run("hybrid-wall", &[CONTACT, ("model.bridge", "averaged"), ("run.duration", "500 ms")], Driver::Events);
    }),
    ("leaning", "hybrid-wall for ten seconds, averaged bridge: 5 * 10^8 edges", || {
        run("hybrid-wall", &[("model.bridge", "averaged"), ("run.duration", "10 s")], Driver::Events);
    }),
    ("friction", "half a second of friction-wall in contact: stick and slip", || {
        run("friction-wall", &[CONTACT, ("run.duration", "500 ms")], Driver::Events);
    }),
    (
        "resting",
        "200 ms of friction-wall at rest: the ripple moves its wheel to and fro, within a count or over it",
        || {
            let resting =
                [("device.initial_angle", "1.55 rad"), ("hand.path", "[[0, 1.8]]"), ("run.duration", "200 ms")];
            run("friction-wall", &resting, Driver::Events);
        },
    ),
    ("chatter", "700 ms of conventional-wall-1khz: a limit cycle over many counts", || {
        run("conventional-wall-1khz", &[("run.duration", "700 ms")], Driver::Events);
    }),
    ("rail", "rail-drop for two seconds: an amplifier's constant forces, rows that nothing happens between", || {
        run("rail-drop", &[("run.duration", "2 s")], Driver::Events);
    }),
    ("slow", "100 ms of the same at 10 MHz, where an edge is long for the winding", || {
        let slow = [CONTACT, ("clock.frequency", "10 MHz"), ("method.pwm.bits", "10"), ("run.duration", "100 ms")];
        run("friction-wall", &slow, Driver::Events);
    }),
    ("divider", "half a second of energy-level-wall: a law with a sequential divider", || {
        run("energy-level-wall", &[("run.duration", "500 ms")], Driver::Events);
    }),
    ("law", "half a second in contact of the reference law in floats", || {
        let law = [("model.datapath", "law"), ("model.bridge", "averaged"), ("run.duration", "500 ms")];
        run("hybrid-wall", &[&law[..], &[CONTACT]].concat(), Driver::Events);
    }),
    ("limits", "growth rate of the linear loop over 2^15 samples", || {
        let Experiment::Axis(scene) = scene("hybrid-wall", &[("model.datapath", "linear")]) else { unreachable!() };
        counted(&mut || {
            let law = LinearLoop::new(&scene, scene.wall.stiffness_nm_per_rad, scene.wall.damping_nm_s_per_rad);
            assert!(law.growth_per_s(1 << 15).is_finite());
        });
    }),
    (
        "driven",
        "proof of the stiffnesses at which hybrid-wall settles as it is driven, over the words of its format",
        || {
            let Experiment::Axis(scene) = scene("hybrid-wall", &[]) else { unreachable!() };
            let range = usual_range(&scene);
            counted(&mut || {
                let found = DrivenSet::new(&scene, range).expect("a linear loop");
                assert!(found.set.stable.len() == 1 && found.set.open.is_empty());
            });
        },
    ),
    ("drop", "100 ms of phantom-drop from 0.1 mm above the room's wall", || {
        run("phantom-drop", &[("room.distance", "0.1 mm"), ("run.duration", "100 ms")], Driver::Events);
    }),
    ("switching", "as contact, with the switching bridge", || {
        run("hybrid-wall", &[CONTACT, ("run.duration", "500 ms")], Driver::Events);
    }),
    ("rows", "hybrid-wall whole, in 2000 rows with the means and extremes of all outputs", || {
        let scene = scene("hybrid-wall", &[]);
        counted(&mut || {
            let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
            let (mut rows, end) = (Counted(0), simulation.edges());
            assert!(look(&simulation, 0..end, end / 2000, &mut rows, &Control::default()));
            assert_eq!(rows.0, 2000);
        });
    }),
    ("fst", "as switching, all signals into an FST", || {
        let (scene, clock) = recorded("500 ms");
        let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
        counted(&mut || {
            let file = Cursor::new(Vec::new());
            let mut fst = Fst::new(file, &Layout::of(&simulation), clock).expect("memory");
            let end = observed(&simulation, Driver::Events, &mut fst).edges;
            fst.finish(Cycle(end)).expect("memory");
        });
    }),
    ("vcd", "10^5 edges of the same into a VCD, the clock among them", || {
        let (scene, clock) = recorded("2 ms");
        let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
        counted(&mut || {
            let mut vcd = Vcd::new(Vec::new(), &Layout::of(&simulation).with_clock(), clock).expect("memory");
            let end = observed(&simulation, Driver::Events, &mut vcd).edges;
            vcd.finish(Cycle(end)).expect("memory");
        });
    }),
];

/// Counts rows with means and extremes.
struct Counted(u64);

impl Observe for Counted {
    fn measures(&self) -> bool {
        true
    }
    fn follows(&self, _: Range<usize>) -> bool {
        false
    }
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, _: Cycle, _: &[f64]) {
        self.0 += 1;
    }
}

/// Puts the wall where the hand is from the first tenth of a second on.
const CONTACT: (&str, &str) = ("wall.position", "0.05 rad");

fn scene(name: &str, set: &[(&str, &str)]) -> Experiment {
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    shipped.parse(&set).expect("a shipped scene")
}

fn recorded(duration: &str) -> (Experiment, Clock) {
    let scene = scene("hybrid-wall", &[CONTACT, ("run.duration", duration)]);
    let clock = WiredSimulation::new(&scene).expect("a shipped scene").clock();
    (scene, clock)
}

fn observed(simulation: &WiredSimulation, driver: Driver, observer: &mut impl Observe) -> Summary {
    let mut trace = simulation.verdict_trace();
    simulation.run(driver, &mut trace, observer, &Control::default())
}

fn run(name: &str, set: &[(&str, &str)], driver: Driver) {
    let scene = scene(name, set);
    counted(&mut || {
        let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
        assert!(observed(&simulation, driver, &mut ()).complete);
    });
}

fn main() -> ExitCode {
    let Some(name) = env::args().nth(1) else {
        // A reader who has seen enough is no error.
        return ExitCode::from(u8::from(
            CASES.iter().any(|(name, what, _)| writeln!(io::stdout(), "{name:<10} {what}").is_err()),
        ));
    };
    match CASES.iter().find(|case| case.0 == name) {
        Some((.., work)) => work(),
        None => return ExitCode::from(2),
    }
    ExitCode::SUCCESS
}
