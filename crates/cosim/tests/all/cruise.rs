//! Leaps over whole periods of the modulator give the same registers as gates switched one by one, and so do edges at
//! which the world coasts.

use std::cell::Cell;
use std::sync::atomic::Ordering;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{
    ClosedLoop, Control, Driver, EnergyAudit, LoopVisitor, Simulation, Summary, Wired, WiredSimulation, World,
};
use hpu_datapath::{Repeat, Wiring};
use hpu_signal::{Cycle, Observe, Real, SignalUse};

/// The most edges of a scene that are compared.
const EDGES: u64 = 20_000_000;
/// The same in `testbench/long.sh`.
const MANY: u64 = 40_000_000;

thread_local! {
    /// Whether the worlds of this thread may coast and cruise.
    static MAY: Cell<bool> = const { Cell::new(false) };
    /// How often a world of this thread has cruised.
    static CRUISES: Cell<u64> = const { Cell::new(0) };
}

/// A world that coasts, and cruises over repeated outputs, only if it may, and counts how often it cruises. It has the
/// layout of the world inside: a reference to that world is a reference to this one, and nothing is copied at an edge.
#[derive(Clone)]
#[repr(transparent)]
struct Permitted<E> {
    world: E,
}

impl<E> Permitted<E> {
    fn around(world: &E) -> &Self {
        // SAFETY: the layout is that of the only field.
        unsafe { &*std::ptr::from_ref(world).cast() }
    }
}

impl<E: World> World for Permitted<E> {
    type In = E::In;
    type Out = E::Out;
    type Row = E::Row;
    const REALS: &'static [Real] = E::REALS;

    fn edge(&self) -> u64 {
        self.world.edge()
    }
    fn place(&self, input: &mut E::In) {
        self.world.place(input);
    }
    fn sense(&mut self) {
        self.world.sense();
    }
    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        self.world.advance(limit, |world, edge| before(Self::around(world), edge));
    }
    fn idles(&mut self, edges: u64) -> u64 {
        if MAY.get() { self.world.idles(edges) } else { 0 }
    }
    fn coast(&mut self, edges: u64) {
        self.world.coast(edges);
    }
    fn drive(&mut self, out: E::Out, words: &[i64]) {
        self.world.drive(out, words);
    }
    fn foresee(&mut self, repeat: &Repeat<E::Out>) -> Option<u64> {
        let end = if MAY.get() { self.world.foresee(repeat) } else { None };
        if let Some(end) = end {
            CRUISES.set(CRUISES.get() + 1);
            let mut ahead = self.world.clone();
            ahead.advance(end - 1, |_, _| {});
            assert_eq!(ahead.edge(), end - 1, "nothing is due before a cruise ends");
        }
        end
    }
    fn reals(&self, edge: u64) -> E::Row {
        self.world.reals(edge)
    }
    fn summary(&self) -> Summary {
        self.world.summary()
    }
    fn over(&self) -> Option<&'static str> {
        self.world.over()
    }
}

/// Every change of the nets, and every row of the plant.
#[derive(Default)]
struct Dense {
    changes: Vec<(Cycle, Vec<i64>)>,
    rows: Vec<Vec<f64>>,
}

impl Observe for Dense {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.changes.last().is_none_or(|(_, last)| last != words) {
            self.changes.push((cycle, words.to_vec()));
        }
    }
    fn reals(&mut self, _: Cycle, values: &[f64]) {
        self.rows.push(values.to_vec());
    }
}

/// The final state and the figures of a run.
#[derive(PartialEq, Debug)]
struct Left {
    words: Vec<i64>,
    uses: Vec<SignalUse>,
    ticks: u64,
    output_changes: u64,
    encoder_edges: u64,
    mode_changes: u64,
    energy: EnergyAudit,
}

/// A visitor that runs a scene to an edge.
struct Run<'o, O> {
    driver: Driver,
    end: u64,
    stride: u64,
    may: bool,
    observer: &'o mut O,
}

impl<'s, O: Observe> LoopVisitor<'s> for Run<'_, O> {
    type Out = (Left, u64);

    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> (Left, u64)
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        MAY.set(self.may);
        CRUISES.set(0);
        let world = Permitted { world };
        let mut run = ClosedLoop::new(wiring.clone(), world, input, self.stride);
        assert!(run.run(self.driver, self.end, self.observer, &Control::default()));
        let Summary { encoder_edges, mode_changes, energy, .. } = run.world.summary();
        let left = Left {
            words: run.wiring.words().to_vec(),
            uses: run.wiring.uses(),
            ticks: run.ticks(),
            output_changes: run.output_changes(),
            encoder_edges,
            mode_changes,
            energy,
        };
        (left, CRUISES.get())
    }
}

fn run(simulation: &WiredSimulation, driver: Driver, end: u64, may: bool, observer: &mut impl Observe) -> (Left, u64) {
    simulation.visit(Run { driver, end, stride: simulation.stride(), may, observer })
}

fn parsed(name: &str, overrides: &[(&str, &str)]) -> Experiment {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).unwrap();
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// Checks that cruising changes no register over this many of the scene's first edges. Returns how often its world
/// cruises.
#[track_caller]
fn agrees(scene: &Experiment, edges: u64) -> u64 {
    let name = &scene.name;
    let simulation = WiredSimulation::new(scene).unwrap_or_else(|error| panic!("{name}: {error}"));
    let end = scene.edges().min(edges);
    let (mut one_by_one, mut cruising) = (Dense::default(), Dense::default());
    let (plain, _) = run(&simulation, Driver::Events, end, false, &mut one_by_one);
    let (watched, cruises) = run(&simulation, Driver::Events, end, true, &mut cruising);
    let (alone, _) = run(&simulation, Driver::Events, end, true, &mut ());
    assert_eq!(alone, watched, "{name}: watching changes nothing");

    let difference = one_by_one.changes.iter().zip(&cruising.changes).find(|(one, other)| one != other);
    assert_eq!(difference, None, "{name}");
    assert_eq!(one_by_one.changes.len(), cruising.changes.len(), "{name}");
    for (row, (one, other)) in one_by_one.rows.iter().zip(&cruising.rows).enumerate() {
        for (one, other) in one.iter().zip(other) {
            assert!((one - other).abs() <= 1e-11 * (1.0 + one.abs()), "{name}, row {row}: {other} is not {one}");
        }
    }
    let flows = |e: &EnergyAudit| [e.source_j, e.hand_j, e.copper_j, e.diodes_j, e.viscous_j, e.coulomb_j];
    for (one, other) in flows(&plain.energy).into_iter().zip(flows(&watched.energy)) {
        assert!((one - other).abs() <= 1e-11 * plain.energy.exchanged_j, "{name}: {other} J is not {one} J");
    }
    let (plain, watched) = (Left { energy: EnergyAudit::default(), ..plain }, watched);
    assert_eq!(Left { energy: EnergyAudit::default(), ..watched }, plain, "{name}");
    cruises
}

fn every_scene_agrees(edges: u64) {
    let cruises: Vec<_> = shipped().iter().map(|scene| (scene.name, agrees(&parsed(scene.name, &[]), edges))).collect();
    let cruising = cruises.iter().filter(|(_, count)| *count > 0).count();
    assert!(cruising >= 10, "{cruises:?}");
}

#[test]
fn every_register_of_every_scene_is_what_gates_switched_one_by_one_make_it() {
    every_scene_agrees(EDGES);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_register_of_every_scene_is_for_longer_what_gates_switched_one_by_one_make_it() {
    every_scene_agrees(MANY);
}

#[test]
fn so_it_is_in_antiphase_with_on_resistance_and_with_friction() {
    for changed in [
        &[("method.pwm.mode", "locked_antiphase")][..],
        &[("bridge.on_resistance", "0.3 Ohm")],
        &[("device.coulomb_friction", "0.1 mN.m")],
        &[("method.pwm.bits", "9")],
        &[("wall.position", "0.05 rad"), ("method.sample_rate", "10 kHz")],
    ] {
        for name in ["hybrid-wall", "conventional-wall-1khz"] {
            assert!(agrees(&parsed(name, changed), EDGES) > 0, "{name} {changed:?}");
        }
    }
}

#[test]
fn a_run_may_end_anywhere_in_a_leap() {
    let scene = parsed("hybrid-wall", &[("device.initial_angle", "1.58 rad"), ("hand.path", "[[\"0 s\", 1.9]]")]);
    let simulation = WiredSimulation::new(&scene).unwrap();
    let mut ended = 0;
    for end in (0..24).map(|k| 150_000 + 1111 * k).chain([154_009 / 4096 * 4096, 154_009 / 4096 * 4096 + 1]) {
        let (alone, cruises) = run(&simulation, Driver::Events, end, true, &mut ());
        let (watched, _) = run(&simulation, Driver::Events, end, true, &mut Dense::default());
        let (stepped, _) = run(&simulation, Driver::Clock, end, true, &mut ());
        assert_eq!(alone, watched, "to {end}");
        assert_eq!(alone, Left { ticks: alone.ticks, ..stepped }, "to {end}");
        ended += u64::from(cruises > 0);
    }
    assert!(ended > 20, "{ended}");
}

/// A visitor that runs a loop to an edge with many stops: every `apart` edges or, with 0, wherever the control stops
/// it. At each stop it compares the loop with one that ticks every edge. Returns the number of stops.
struct Stops {
    end: u64,
    apart: u64,
}

impl<'s> LoopVisitor<'s> for Stops {
    type Out = u64;

    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> u64
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let Self { end, apart } = self;
        let mut clock = ClosedLoop::new(wiring.clone(), world.clone(), input, u64::MAX);
        let mut watched = ClosedLoop::new(wiring.clone(), world.clone(), input, u64::MAX);
        let mut leaping = ClosedLoop::new(wiring.clone(), world, input, u64::MAX);
        let control = Control { most_events: (apart == 0).then_some(1), ..Control::default() };
        let mut stops = 0;
        while leaping.edge() < end {
            let next = if apart == 0 { end } else { (leaping.edge() + apart).min(end) };
            let complete = leaping.run(Driver::Events, next, &mut (), &control);
            assert_eq!(complete, leaping.edge() == next);
            let edge = leaping.edge();
            assert_eq!(control.progress.load(Ordering::Relaxed), edge);
            assert!(clock.run(Driver::Clock, edge, &mut (), &Control::default()));
            assert_eq!(leaping.wiring.words(), clock.wiring.words(), "at {edge}");
            assert_eq!(leaping.wiring.uses(), clock.wiring.uses(), "at {edge}");
            assert_eq!(leaping.output_changes(), clock.output_changes(), "at {edge}");
            // A change of the world that no input shows leaves the datapath behind.
            if leaping.world.edge() == edge {
                let bits = |world: &E| world.reals(edge).as_ref().iter().map(|real| real.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&leaping.world), bits(&clock.world), "at {edge}");
                stops += 1;
            }
        }
        assert!(watched.run(Driver::Events, end, &mut Dense::default(), &Control::default()));
        assert_eq!(leaping.ticks(), watched.ticks(), "stops are no ticks");
        let [one, other] = [&leaping, &clock].map(|run| run.world.summary());
        assert_eq!((one.encoder_edges, one.mode_changes), (other.encoder_edges, other.mode_changes));
        assert_eq!(format!("{:?}", one.energy), format!("{:?}", other.energy));
        stops
    }
}

/// Runs some scenes with many stops, to a share of their ends.
fn stop_anywhere(share: u64) {
    let resting = [("device.initial_angle", "1.55 rad"), ("hand.path", "[[0, 1.8]]")];
    let leaning = [("device.initial_angle", "1.58 rad"), ("hand.path", "[[\"0 s\", 1.9]]")];
    let stepped = [("model.solver", "rk4"), ("model.step", "1 us")];
    let antiphase = [("method.pwm.mode", "locked_antiphase")];
    let averaged = [("model.bridge", "averaged")];
    let settling = [("method.settling", "2")];
    for (name, changed, end) in [
        ("friction-wall", &resting[..], 5_000_000),
        ("friction-wall", &[&resting[..], &antiphase].concat(), 1_000_000),
        ("friction-wall", &[&resting[..], &stepped].concat(), 1_000_000),
        ("hybrid-wall", &leaning, 1_000_000),
        ("hybrid-wall", &[&leaning[..], &averaged, &settling].concat(), 1_000_000),
        ("energy-level-wall", &[&leaning[..], &averaged].concat(), 1_000_000),
    ] {
        let end = end / share;
        let scene = parsed(name, changed);
        let simulation = WiredSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        for (apart, least) in [(7919, end / 7919), (1231, end / 1231), (0, end / 500_000)] {
            let stops = simulation.visit(Stops { end, apart });
            assert!(stops >= least, "{name} {changed:?}, {apart} apart: {stops}");
        }
    }
}

#[test]
fn a_run_may_stop_anywhere_between_changes_of_the_gates_and_go_on() {
    stop_anywhere(2);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_longer_run_may_stop_anywhere_between_changes_of_the_gates_and_go_on() {
    stop_anywhere(1);
}
