//! Rows that wait until the motion changes are those that are shown at once, and a trace of the judged window alone has
//! the figures of a trace of all rows.

use std::ops::Range;

use hpu_cosim::scene::{Experiment, Metric, shipped};
use hpu_cosim::{Control, Driver, Simulation, Trace, Wired, WiredSimulation, judged_window_s, metric};
use hpu_signal::{Cycle, Observe};

fn parsed(name: &str, set: &[(&str, &str)]) -> Experiment {
    let set: Vec<_> = set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    scene.parse(&set).unwrap_or_else(|error| panic!("{error}"))
}

/// Holds every row, by the way in which the run shows it: in the order of the edges, or as it likes.
#[derive(Default)]
struct Shown {
    in_order: bool,
    rows: Vec<(u64, Vec<u64>)>,
    /// The last edge of which nets were shown, and the most edges by which a row came after it.
    nets: u64,
    late: u64,
}

impl Observe for Shown {
    fn follows(&self, _: Range<usize>) -> bool {
        false
    }
    fn relates(&self) -> bool {
        self.in_order
    }
    fn nets(&mut self, cycle: Cycle, _: &[i64]) {
        self.nets = cycle.0;
    }
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.late = self.late.max(self.nets.saturating_sub(cycle.0));
        self.rows.push((cycle.0, values.iter().map(|x| x.to_bits()).collect()));
    }
}

/// Runs a scene and returns its rows and its summary without the time that it took.
fn shown(scene: &Experiment, driver: Driver, in_order: bool, control: &Control) -> (Shown, String) {
    let simulation = WiredSimulation::new(scene).expect("a simulation");
    let mut rows = Shown { in_order, ..Shown::default() };
    let mut summary = simulation.run(driver, &mut simulation.brief_trace(), &mut rows, control);
    summary.wall_s = 0.0;
    (rows, format!("{summary:?}"))
}

const CONTACT: (&str, &str) = ("wall.position", "0.05 rad");

#[test]
fn rows_that_wait_are_those_that_are_shown_in_order() {
    let mut late = Vec::new();
    let dense = ("record.plant_rate", "1 MHz");
    let each = ("record.plant_rate", "50 MHz");
    let scenes: [(&str, &[(&str, &str)]); 13] = [
        ("rail-drop", &[("run.duration", "500 ms")]),
        ("rail-drop", &[("run.duration", "150 ms"), dense, ("device.initial_position", "19 mm")]),
        ("hybrid-wall", &[CONTACT, ("model.bridge", "averaged"), ("run.duration", "300 ms")]),
        ("hybrid-wall", &[CONTACT, ("run.duration", "200 ms")]),
        ("friction-wall", &[CONTACT, ("model.bridge", "averaged"), ("run.duration", "300 ms"), dense]),
        ("friction-wall", &[CONTACT, ("run.duration", "200 ms")]),
        ("free-motion", &[("run.duration", "300 ms")]),
        ("shaped-wall", &[("run.duration", "300 ms")]),
        ("count-cycle", &[("run.duration", "300 ms")]),
        ("thrown-conventional", &[("run.duration", "300 ms")]),
        ("energy-level-wall", &[("run.duration", "200 ms")]),
        ("phantom-drop", &[("room.distance", "0.1 mm"), ("run.duration", "20 ms")]),
        // A row at each edge, also while the datapath changes edge by edge.
        ("hybrid-wall", &[("device.initial_speed", "20 rad/s"), ("run.duration", "3 ms"), each]),
    ];
    for (name, set) in scenes {
        let scene = parsed(name, set);
        let (waited, summary) = shown(&scene, Driver::Events, false, &Control::default());
        let (ordered, other) = shown(&scene, Driver::Events, true, &Control::default());
        assert!(waited.rows == ordered.rows && summary == other, "{name} {set:?}");
        assert_eq!(ordered.late, 0, "{name} {set:?}");
        late.push(waited.late);
    }
    // A fall between two samples of the law is one motion over many counts.
    assert!(late[0] > 10_000 && late[1] > 10_000 && late[2] > 1000, "{late:?}");
}

#[test]
fn rows_that_wait_are_those_of_every_edge() {
    let rate = ("record.plant_rate", "1 MHz");
    let places: [(usize, &[(&str, &str)]); 3] = [
        (6001, &[("device.initial_position", "19.9 mm"), ("run.duration", "6 ms"), rate]),
        (6001, &[("device.initial_position", "20.2 mm"), ("run.duration", "6 ms"), rate]),
        // A fall of three million edges, which have four digits to base 128.
        (601, &[("run.duration", "60 ms")]),
    ];
    for (rows, set) in places {
        let scene = parsed("rail-drop", set);
        let (waited, _) = shown(&scene, Driver::Events, false, &Control::default());
        let (stepped, _) = shown(&scene, Driver::Clock, false, &Control::default());
        assert_eq!(waited.rows.len(), rows);
        assert!(waited.rows == stepped.rows, "{set:?}");
    }
}

#[test]
fn a_run_that_is_stopped_has_shown_the_rows_that_waited() {
    let scene = parsed("rail-drop", &[]);
    let control = || Control { most_events: Some(1024), ..Control::default() };
    let (waited, summary) = shown(&scene, Driver::Events, false, &control());
    let (ordered, other) = shown(&scene, Driver::Events, true, &control());
    assert!(waited.rows == ordered.rows && summary == other && !waited.rows.is_empty());
}

const METRICS: [Metric; 10] = [
    Metric::FinalAngle,
    Metric::PeakAngle,
    Metric::PeakPenetration,
    Metric::Amplitude,
    Metric::Frequency,
    Metric::PeakTorque,
    Metric::SpringOverflowShare,
    Metric::EncoderEdges,
    Metric::ContactShare,
    Metric::Rms,
];

/// Returns verdict, metrics, extremes and rows of the window, as bits.
fn figures(scene: &Experiment, all: bool, control: &Control) -> (String, Vec<u64>, usize) {
    let simulation = WiredSimulation::new(scene).expect("a simulation");
    let mut trace = if all { simulation.brief_trace() } else { simulation.verdict_trace() };
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), control);
    let judged = simulation.judged();
    if trace.rows() > 0 {
        let last = Cycle((trace.came() - 1) * simulation.stride());
        assert_eq!(trace.time_s(trace.rows() - 1), simulation.clock().seconds(last));
    }
    let mut bits: Vec<u64> = Vec::new();
    for &index in &judged {
        let last = trace.last(index).unwrap_or(f64::NAN);
        bits.extend([trace.least(index), trace.greatest(index), trace.greatest_size(index), last].map(f64::to_bits));
        if summary.complete && summary.aborted.is_none() {
            let [from_s, _] = judged_window_s(scene);
            let first = (from_s / (simulation.stride() as f64 * simulation.clock().period_s())).round() as usize;
            bits.extend(rows_of_window(&trace, index, first).iter().map(|x| x.to_bits()));
        }
    }
    let numbers: Vec<_> = if matches!(scene, Experiment::Axis(_)) {
        METRICS.map(|of| metric(of, scene, &summary, &trace).map(f64::to_bits)).to_vec()
    } else {
        Vec::new()
    };
    (format!("{:?} {numbers:?} {}", summary.verdict, trace.came()), bits, trace.rows())
}

/// Returns the rows of the judged window, which begins at row `first` of the run.
fn rows_of_window(trace: &Trace, index: usize, first: usize) -> Vec<f64> {
    let held = trace.real(index);
    let rows = &held[held.len() - (trace.came() as usize - first)..];
    assert_eq!(trace.judged_rows(index), rows);
    rows.to_vec()
}

#[test]
fn a_trace_of_the_window_has_the_verdict_and_the_metrics_of_all_rows() {
    let mut fewer = 0;
    for shipped in shipped() {
        // Scenes that a design of somebody else's closes are not run by blocks of this project.
        let Ok(scene) = shipped.parse(&[]) else { continue };
        if WiredSimulation::new(&scene).is_err() || matches!(scene, Experiment::Phantom(_)) {
            continue;
        }
        let (text, bits, held) = figures(&scene, false, &Control::default());
        let (all_text, all_bits, all_held) = figures(&scene, true, &Control::default());
        assert!(text == all_text && bits == all_bits, "{}: {text} {all_text}", shipped.name);
        assert!(held <= all_held);
        fewer += usize::from(held < all_held / 2);
    }
    assert!(fewer > 10, "{fewer} scenes");
    // Steps without a clock, few rows, and runs that end early.
    let steps = [("model.datapath", "law"), ("model.bridge", "averaged"), ("model.solver", "midpoint")];
    for (name, set) in [
        ("hybrid-wall", &[&steps[..], &[("model.step", "5 us")]].concat()[..]),
        ("rail-drop", &[("run.duration", "1 ms")]),
        ("rail-drop", &[("run.duration", "102.4 ms")]),
        ("rail-drop", &[("run.duration", "146.4 ms")]),
        ("phantom-drop", &[("room.distance", "0.1 mm"), ("run.duration", "300 ms")]),
    ] {
        let scene = parsed(name, set);
        let [few, all] = [false, true].map(|all| figures(&scene, all, &Control::default()));
        assert!((&few.0, &few.1) == (&all.0, &all.1), "{name} {set:?}: {} {}", few.0, all.0);
    }
    for events in [256, 1024, 4096, 8192] {
        let scene = parsed("rail-drop", &[]);
        let control = || Control { most_events: Some(events), ..Control::default() };
        let [few, all] = [false, true].map(|all| figures(&scene, all, &control()));
        assert!((&few.0, &few.1) == (&all.0, &all.1), "{events} events: {} {}", few.0, all.0);
    }
}
