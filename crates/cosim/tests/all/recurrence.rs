//! Recurrence: a run that comes back to a state repeats, and periods that are shown again are those that would have
//! been computed.

use std::ops::Range;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{
    ClosedLoop, Control, Driver, Recurrence, Simulation, SplitMix64, Summary, Trace, Wired, WiredSimulation, World,
};
use hpu_datapath::{HybridLoop, LoopConfig, LoopIn, LoopOut, PwmConfig, Wiring};
use hpu_signal::{Cycle, Observe, Real};

/// Scenes that recur, and durations that contain some periods from there on.
const RECUR: [(&str, &str); 10] = [
    ("bounded-impulse-engine", "4 s"),
    ("conventional-wall-100hz", "7.7 s"),
    ("conventional-wall-1khz", "3 s"),
    ("coupled-wall", "1.9 s"),
    ("dual-rate-wall", "2.6 s"),
    ("energy-level-wall", "2.1 s"),
    ("friction-wall", "6.5 s"),
    ("hybrid-wall", "6.7 s"),
    ("stiff-conventional-1khz", "2.5 s"),
    ("wrap-product", "2.5 s"),
];

fn experiment(name: &str, duration: &str, more: &[(&str, &str)]) -> Experiment {
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let overrides: Vec<_> = [("run.duration", duration)]
        .iter()
        .chain(more)
        .map(|(key, value)| (key.to_string(), value.to_string()))
        .collect();
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// An observer that counts how often it is shown nets. If it must be shown rows and nets in their order, every period
/// is computed.
#[derive(Default)]
struct Counting {
    in_order: bool,
    shown: u64,
}

impl Observe for Counting {
    fn nets(&mut self, _: Cycle, _: &[i64]) {
        self.shown += 1;
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
    fn follows(&self, _: Range<usize>) -> bool {
        false
    }
    fn relates(&self) -> bool {
        self.in_order
    }
}

/// Runs a scene twice: as it is run if nobody looks, and with every period computed. Asserts that both are the same,
/// and that the first computes less. Returns summary and rows.
fn both(scene: &Experiment, about: &str) -> (Summary, Trace) {
    let (mut some, mut all) = (Counting::default(), Counting { in_order: true, shown: 0 });
    let (shown, rows) = run(scene, Driver::Events, &mut some);
    let (computed, computed_rows) = run(scene, Driver::Events, &mut all);
    assert_eq!(shown, computed, "{about}");
    assert_eq!(rows, computed_rows, "{about}");
    assert!(some.shown < all.shown, "{about}: {} of {} ticks computed", some.shown, all.shown);
    (computed, computed_rows)
}

/// Runs a scene, and returns the summary without the wall time, and all rows.
fn run(scene: &Experiment, driver: Driver, observer: &mut dyn Observe) -> (Summary, Trace) {
    let simulation = WiredSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.brief_trace();
    let summary = simulation.run(driver, &mut trace, observer, &Control::default());
    assert!(summary.complete, "{}", scene.name);
    (Summary { wall_s: 0.0, ..summary }, trace)
}

#[test]
fn periods_that_are_shown_again_are_those_that_are_computed() {
    let mut in_and_out_of_contact = 0;
    for (name, duration) in RECUR {
        let scene = experiment(name, duration, &[]);
        let (computed, all) = both(&scene, name);
        // What is said to recur does: every row is that of a period before, to the last bit.
        let found = computed.recurrence.unwrap_or_else(|| panic!("{name} does not recur"));
        assert!(scene.edges() > found.from + 3 * found.period, "{name}: {found:?} leaves too little");
        let stride = all.edges_apart();
        let (first, apart) = (found.from.div_ceil(stride) as usize, (found.period / stride) as usize);
        assert_eq!(found.period % stride, 0, "{name}");
        for index in WiredSimulation::new(&scene).unwrap().judged() {
            let bits: Vec<u64> = all.real(index)[first..].iter().map(|value| value.to_bits()).collect();
            assert!(bits.len() > 2 * apart, "{name}");
            assert_eq!(bits[apart..], bits[..bits.len() - apart], "{name}");
        }
        in_and_out_of_contact += u32::from(computed.contact_share.is_some_and(|share| share > 0.0 && share < 1.0));
    }
    assert!(in_and_out_of_contact > 0, "no scene comes and goes");
}

#[test]
fn the_clock_says_the_same_of_periods_that_were_shown_again() {
    let scene = experiment("coupled-wall", "1.6 s", &[]);
    let (shown, rows) = run(&scene, Driver::Events, &mut ());
    let (clocked, all) = run(&scene, Driver::Clock, &mut ());
    let found = shown.recurrence.expect("a recurrence");
    assert!(found.from + 3 * found.period < scene.edges(), "{found:?}");
    assert_eq!(rows, all);
    assert_eq!(clocked.recurrence, None);
    // The clock ticks at every edge.
    assert_eq!(Summary { recurrence: None, ticks: clocked.ticks, redecided: clocked.redecided, ..shown }, clocked);
}

/// Stops a run when it is shown a row at or after an edge.
struct Stopping<'c> {
    control: &'c Control,
    at: u64,
    rows: Vec<(u64, Vec<u64>)>,
}

impl Observe for Stopping<'_> {
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.rows.push((cycle.0, values.iter().map(|value| value.to_bits()).collect()));
        if cycle.0 >= self.at {
            self.control.stop.store(true, std::sync::atomic::Ordering::Relaxed);
        }
    }
    fn follows(&self, _: Range<usize>) -> bool {
        false
    }
}

/// A run that is stopped while periods are shown again ends between two of them, with the rows up to there.
#[test]
fn a_run_that_is_stopped_among_periods_shown_again_is_a_shorter_one() {
    let scene = experiment("coupled-wall", "40 s", &[]);
    let simulation = WiredSimulation::new(&scene).expect("a shipped scene");
    let run = |at: u64| {
        let control = Control::default();
        let mut observer = Stopping { control: &control, at, rows: Vec::new() };
        let summary = simulation.run(Driver::Events, &mut simulation.brief_trace(), &mut observer, &control);
        (summary, observer.rows)
    };
    let (whole, all) = run(u64::MAX);
    let found = whole.recurrence.expect("a recurrence");
    let (stopped, rows) = run(found.from + 5 * found.period);
    assert!(whole.complete && !stopped.complete);
    assert!(stopped.edges < found.from + 8 * found.period, "{} edges", stopped.edges);
    assert_eq!(rows, all[..rows.len()]);
    let shown = rows.last().expect("rows").0;
    assert!(shown <= stopped.edges && shown + 2 * (all[1].0 - all[0].0) > stopped.edges);
}

/// A state that comes back under a plan is none: the hand goes on 100 ms before the end.
#[test]
fn nothing_recurs_while_something_is_planned() {
    let path = r#"[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["400 ms", 1.2], ["500 ms", 1.8], ["2.9 s", 1.8]]"#;
    let scene = experiment("conventional-wall-1khz", "3 s", &[("hand.path", path)]);
    assert_eq!(run(&scene, Driver::Events, &mut ()).0.recurrence, None);
}

/// Rows every 4096, 15 000 and 50 edges: the second come back to their places after three periods of 256 ms.
#[test]
fn rows_at_any_rate_come_back_to_their_places() {
    for rate in ["12207.03125 Hz", "3333.3333333333335 Hz", "1 MHz"] {
        let scene = experiment("coupled-wall", "4 s", &[("record.plant_rate", rate)]);
        both(&scene, rate);
    }
    // Rows every 5556 edges would do so after 1389 periods. The run is the same, and computed to its end.
    let scene = experiment("coupled-wall", "4 s", &[("record.plant_rate", "9 kHz")]);
    let (summary, _) = run(&scene, Driver::Events, &mut Counting::default());
    assert!(summary.recurrence.is_some());
    assert_eq!(summary, run(&scene, Driver::Events, &mut Counting { in_order: true, shown: 0 }).0);
}

/// Walls, motors and modulators at random, with samples and periods so short that many runs come back to a state.
#[test]
fn so_are_those_of_walls_at_random() {
    let mut random = SplitMix64::new(7);
    let mut recurred = 0;
    for round in 0..100 {
        let mut pick = |options: &[&'static str]| options[random.below(options.len() as u64) as usize];
        let name = pick(&["hybrid-wall", "conventional-wall-1khz", "coupled-wall", "energy-level-wall"]);
        let chosen = [
            ("clock.frequency", "4.096 MHz"),
            ("method.sample_rate", pick(&["500 Hz", "1 kHz", "2 kHz", "4 kHz"])),
            ("method.pwm.bits", pick(&["10", "11", "12"])),
            ("wall.stiffness", pick(&["0.8 N.m/rad", "1.5 N.m/rad", "2 N.m/rad", "3 N.m/rad"])),
            ("wall.damping", pick(&["0 N.m.s/rad", "2.5 mN.m.s/rad"])),
            ("device.coulomb_friction", pick(&["0 N.m", "0 N.m", "0.3 mN.m", "1.2 mN.m"])),
            ("model.bridge", pick(&["switching", "switching", "averaged"])),
            ("record.plant_rate", pick(&["1 kHz", "8 kHz", "16 kHz"])),
        ];
        let scene = experiment(name, pick(&["1.5 s", "2.3 s"]), &chosen);
        let (shown, rows) = run(&scene, Driver::Events, &mut ());
        let (computed, all) = run(&scene, Driver::Events, &mut Counting { in_order: true, shown: 0 });
        assert_eq!(shown, computed, "{round}: {name} {chosen:?}");
        assert_eq!(rows, all, "{round}: {name} {chosen:?}");
        recurred += u32::from(computed.recurrence.is_some());
    }
    assert!(recurred >= 33, "{recurred} recurred");
}

/// An encoder that goes to and fro between two counts, whatever the outputs.
#[derive(Clone)]
struct Swing {
    edge: u64,
    period: u64,
    /// Whether it says of itself that it recurs.
    recurs: bool,
}

impl World for Swing {
    type In = LoopIn<i64>;
    type Out = LoopOut<i64>;
    type Row = [f64; 0];
    const REALS: &'static [Real] = &[];

    fn edge(&self) -> u64 {
        self.edge
    }
    fn place(&self, input: &mut LoopIn<i64>) {
        input.b_pin = i64::from(self.edge % self.period >= self.period / 2);
    }
    fn sense(&mut self) {
        self.edge += 1;
    }
    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let edge = limit.min((self.edge / (self.period / 2) + 1) * (self.period / 2));
        before(self, edge);
        self.edge = edge;
    }
    fn drive(&mut self, _: LoopOut<i64>, _: &[i64]) {}
    fn reals(&self, _: u64) -> [f64; 0] {
        []
    }
    fn mark(&self) -> Option<u64> {
        Some((self.edge % self.period) << 32)
    }
    fn recurs(&self, earlier: &Self) -> bool {
        self.recurs && self.edge % self.period == earlier.edge % self.period
    }
    fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        self.edge += times * (now.edge - then.edge);
    }
    fn summary(&self) -> Summary {
        Summary::default()
    }
}

/// Runs a hybrid loop, with a modulator whose period is 32 edges, around a swing. Returns the recurrence that was
/// found, ticks, changes of the outputs, and the use of the nets.
fn swings(sample: i64, recurs: bool, in_order: bool) -> (Option<Recurrence>, u64, u64, String) {
    let config = LoopConfig { pwm: PwmConfig { width: 5, ..PwmConfig::default() }, ..LoopConfig::default() };
    let wiring = HybridLoop::new(config).expect("a loop");
    let input = LoopIn { a_pin: 0, b_pin: 0, reference: 0, stiffness: 5, damping: 3, period: sample, scale: 256 };
    let mut closed = ClosedLoop::new(wiring, Swing { edge: 0, period: 960, recurs }, input, 480);
    let observer = &mut Counting { in_order, shown: 0 };
    assert!(closed.run(Driver::Events, 100_000, observer, &Control::new()));
    assert_eq!((closed.edge(), closed.world.edge()), (100_000, 100_000));
    (closed.recurrence(), closed.ticks(), closed.output_changes(), format!("{:?}", closed.wiring.uses()))
}

#[test]
fn a_world_that_recurs_is_not_enough_nor_is_a_wiring() {
    // A sample of 96 edges begins anew with each swing of 960, a longer one with every second or seventh.
    let (found, ..) = swings(96, true, false);
    assert_eq!(found.map(|found| found.period), Some(960));
    for sample in [96, 1920, 6720] {
        let found = swings(sample, true, false);
        assert!(found.0.is_none_or(|found| found.period % sample.unsigned_abs() == 0), "{sample}: {found:?}");
        assert_eq!(found, swings(sample, true, true), "{sample}");
    }
    assert_eq!(swings(96, false, false).0, None);
}
