//! A scene made ready: a wiring, a world, constant inputs; and the operations on any such scene.

use std::ops::Range;

use hpu_datapath::{AnyBlock, AnyWiring, Instance, Wiring};
use hpu_signal::{Clock, Cycle, Observe, Real, Signal, UNKNOWN};

use crate::result::contact::Contact;
use crate::result::forever::Beyond;
use crate::result::outline::{Command, Outline, Waves};
use crate::result::stopwatch::Stopwatch;
use crate::result::summary::Summary;
use crate::result::trace::{ANGLE, Trace};
use crate::result::verdict::Abort;
use crate::run::engine::{ClosedLoop, Comparison, Control, Driver, compare};
use crate::run::law_loop::LawLoop;
use crate::run::untyped::{AnyClosedLoop, Closed};
use crate::world::World;
use hpu_scene::Record;
use hpu_scene::judged::{stride, window_start};
use hpu_scene::method::AxisLoop;

/// The wiring of a scene, to read.
#[derive(Clone, Copy)]
pub enum TheLoop<'s> {
    /// An axis's loop in words.
    Axis(&'s AxisLoop),
    /// An axis's law in floats.
    Law(&'s LawLoop),
    /// The loop of another device.
    Device(&'s dyn AnyWiring),
    /// Its firmware in floats.
    Floats(&'s dyn AnyWiring),
}

impl<'s> TheLoop<'s> {
    /// Returns the wiring without its type.
    pub fn wiring(self) -> &'s dyn AnyWiring {
        match self {
            Self::Axis(axis_loop) => axis_loop.wiring(),
            Self::Law(wiring) => wiring,
            Self::Device(wiring) | Self::Floats(wiring) => wiring,
        }
    }

    /// Returns the wiring as a block.
    pub fn block(self) -> &'s dyn AnyBlock {
        self.wiring()
    }

    /// Returns the wiring's name.
    pub fn name(self) -> &'static str {
        self.block().name()
    }

    /// Returns the nets.
    pub fn nets(self) -> Vec<Signal> {
        self.wiring().nets()
    }

    /// Returns the instances, in the order of the VHDL.
    pub fn instances(self) -> Vec<Instance> {
        self.wiring().instances()
    }

    /// Returns whether there is VHDL of the wiring.
    pub fn is_hardware(self) -> bool {
        !matches!(self, Self::Law(_) | Self::Floats(_))
    }
}

/// `LoopVisitor` is a generic callback: [`Wired::visit`] calls it with the concrete wiring and world types, so that
/// run, compare and the loop without types are each written once.
pub trait LoopVisitor<'s> {
    /// The result of the visit.
    type Out;
    /// Called with the wiring as after reset and the world at edge 0; `input` holds the constant words.
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static;
}

/// A `Simulation` is a scene made ready, whatever closes its loop. Recordings, pictures and verdicts use it.
/// Implemented for axes, arms and designs of the user's own, and by the enums over them.
pub trait Simulation {
    /// Returns the facts that all other functions answer from.
    fn outline(&self) -> &Outline;

    /// Returns the scene's name.
    fn name(&self) -> &str {
        &self.outline().name
    }

    /// Returns the FPGA's clock.
    fn clock(&self) -> Clock {
        self.outline().clock
    }

    /// Returns the clock edges of the whole run.
    fn edges(&self) -> u64 {
        self.outline().edges
    }

    /// Returns the recording's plant rate, and whether it shows the clock.
    fn record(&self) -> Record {
        self.outline().record
    }

    /// Returns the name of the datapath, or of the design, that closes the loop.
    fn closed_by(&self) -> &str {
        &self.outline().closed_by
    }

    /// Returns the nets.
    fn nets(&self) -> Vec<Signal> {
        self.outline().nets.clone()
    }

    /// Returns the continuous outputs of the world.
    fn reals(&self) -> &'static [Real] {
        &self.row()[..self.outline().reals]
    }

    /// Returns the columns of a row of the trace: [`reals`](Self::reals), then means and extremes between rows.
    fn row(&self) -> &'static [Real] {
        self.outline().row
    }

    /// Returns the indices of the columns of [`row`](Self::row) that mean something in this scene; none without a
    /// device.
    fn columns(&self) -> Vec<usize> {
        self.outline().columns.clone()
    }

    /// Returns the nets that command an actuator, each with the column of the effort it asks for and the effort of one
    /// ulp of its word, positive along the positive direction. Of a design of the user's own, only its author knows
    /// them.
    fn commands(&self) -> Vec<Command> {
        self.outline().commands.clone()
    }

    /// Returns how waveforms show the nets, if not as those of an axis.
    fn waves(&self) -> Waves {
        self.outline().waves
    }

    /// Returns whether there is a device, not a recording in its place.
    fn has_device(&self) -> bool {
        self.outline().has_device
    }

    /// Returns the plant's outputs that verdicts and metrics are computed from, as indices into [`reals`](Self::reals).
    fn judged(&self) -> Vec<usize> {
        self.outline().judged.clone()
    }

    /// Returns the index of the net whose word is not 0 while the wall is touched; `None` where no net tells it.
    fn contact_net(&self) -> Option<usize> {
        self.outline().contact
    }

    /// Returns whether the scene has something that its device can touch.
    fn has_contact(&self) -> bool {
        self.outline().has_contact
    }

    /// Returns the column of an axis's position, and the position of its wall; `None` for other devices, and for a
    /// recording.
    fn wall(&self) -> Option<(usize, f64)> {
        self.outline().wall.map(|wall| (ANGLE, wall))
    }

    /// Returns the columns of [`row`](Self::row) that hold mean, least and greatest value of the efforts that pictures
    /// draw.
    fn drawn(&self) -> &[[usize; 3]] {
        &self.outline().drawn
    }

    /// Returns the edges between rows of the trace.
    fn stride(&self) -> u64 {
        stride(self.clock(), self.record().plant_rate_hz)
    }

    /// Returns the first clock edge of the judged window.
    fn window_start(&self) -> u64 {
        window_start(self.edges(), self.stride(), self.outline().still)
    }

    /// Returns an empty trace of the plant and of the nets with these names.
    fn trace(&self, nets: &[&str]) -> Trace {
        let all = self.nets();
        let picks = nets.iter().filter_map(|name| all.iter().position(|net| net.name == *name)).collect();
        Trace::new(self.clock(), self.stride(), (0..self.reals().len()).collect(), picks)
    }

    /// Returns an empty trace as [`trace`](Self::trace) does, with the means and extremes that pictures draw.
    fn drawn_trace(&self, nets: &[&str]) -> Trace {
        self.trace(nets).keeping(&self.outline().drawn)
    }

    /// Returns an empty trace of only the outputs that verdicts and [`metric`](crate::metric) use.
    fn brief_trace(&self) -> Trace {
        Trace::new(self.clock(), self.stride(), self.judged(), Vec::new())
    }

    /// Returns an empty trace as [`brief_trace`](Self::brief_trace) does. It holds only the rows of the judged window,
    /// unless the device's page reads all rows.
    fn verdict_trace(&self) -> Trace {
        let trace = self.brief_trace();
        if self.outline().reads_rows { trace } else { trace.of_window() }
    }
}

/// A `Wired` simulation is a scene made ready whose loop blocks of this project close. Implemented for axes
/// and arms, and by [`WiredSimulation`](crate::WiredSimulation), which is either.
pub trait Wired: Simulation {
    /// Returns the wiring before reset.
    fn wiring(&self) -> TheLoop<'_>;
    /// Calls `visitor` with the concrete wiring and world.
    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out;
    /// Returns the driver that the scene's solver asks for.
    fn driver(&self) -> Driver;
    /// Returns the scene's loop without wiring and clock, if its model asks for that; [`run`](Self::run) then ignores
    /// the driver.
    fn direct(&self) -> Option<Box<dyn Direct + '_>> {
        None
    }

    /// Returns whether the gates drive the device. If not (an averaged bridge, an amplifier), [`run`](Wired::run) stops
    /// the modulator.
    fn gates_drive(&self) -> bool {
        true
    }

    /// Runs the scene to its end, or until stopped, filling the trace anew and showing everything to the observer.
    ///
    /// Not generic over the observer, so that the loops of all wirings and worlds are compiled once, in this crate, and
    /// not in each crate that runs a scene.
    fn run(&self, driver: Driver, trace: &mut Trace, observer: &mut dyn Observe, control: &Control) -> Summary {
        self.run_beyond(driver, trace, observer, control, None)
    }

    /// Runs the scene as [`run`](Self::run) does and, if it is asked, looks on by events after its end for how it goes
    /// on for ever. All else is that of the run to its end.
    fn run_beyond(
        &self,
        driver: Driver,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
        beyond: Option<&Beyond>,
    ) -> Summary;

    /// Returns the loop after reset, at edge 0, without its types.
    fn closed_loop(&self) -> Box<dyn AnyClosedLoop<'_> + '_>;

    /// Runs `events` against `clock` over this many edges, comparing every net and state at every edge.
    fn compare(&self, edges: u64) -> Comparison;
}

/// A scene's loop without wiring and clock. Implemented for each kind of device that a model in steps can move.
pub trait Direct {
    /// Runs to the edge at which the window ends, until stopped, or until the device cannot go on. Returns the edges of
    /// contact in the window, and why the device cannot go on.
    fn run(
        &self,
        window: (u64, u64),
        stride: u64,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
    ) -> (Summary, f64, Option<&'static str>);
}

/// The part of `impl Wired` that is alike in the simulations of all devices.
macro_rules! wired_alike {
    () => {
        fn run_beyond(
            &self,
            driver: $crate::Driver,
            trace: &mut $crate::Trace,
            observer: &mut dyn hpu_signal::Observe,
            control: &$crate::Control,
            beyond: Option<&$crate::Beyond>,
        ) -> $crate::Summary {
            $crate::run::simulation::run(self, driver, trace, (observer, control), beyond)
        }

        fn closed_loop(&self) -> Box<dyn $crate::AnyClosedLoop<'_> + '_> {
            self.visit($crate::run::simulation::Close)
        }

        fn compare(&self, edges: u64) -> $crate::Comparison {
            self.visit($crate::run::simulation::Compare(edges))
        }

        fn driver(&self) -> $crate::Driver {
            self.scene.model.solver.into()
        }
    };
}
pub(crate) use wired_alike;

/// Implements [`Wired::run_beyond`] for any simulation.
pub(crate) fn run<R: Wired>(
    simulation: &R,
    driver: Driver,
    trace: &mut Trace,
    (observer, control): (&mut dyn Observe, &Control),
    beyond: Option<&Beyond>,
) -> Summary {
    let (end, stride, modulated) = (simulation.edges(), simulation.stride(), simulation.gates_drive());
    trace.begin(end / stride + 1, simulation.outline().still);
    let from = simulation.window_start();
    let (summary, contact, over) = match simulation.direct() {
        Some(direct) => direct.run((from, end), stride, trace, observer, control),
        None => {
            let judged = Judged::around_a_wall(simulation, trace, from);
            let observer: Option<&mut dyn Observe> = if observer.watches() { Some(observer) } else { None };
            let observer = (judged, observer);
            let clock = simulation.clock();
            simulation.visit(Run { driver, window: (from, end), stride, modulated, clock, observer, control, beyond })
        }
    };
    judged(simulation, trace, summary, contact, over)
}

/// Runs a simulation's world with another program as the driver, such as a simulator of VHDL. `play` shows the run to
/// the observer as [`Wired::run`] does, and returns its summary and why it ended early, if it did; it also gets the
/// edge from which on the run is judged. Fills the trace anew, with unknown words as 0, and judges it.
///
/// # Errors
///
/// The error that `play` returns.
pub fn follow<R: Simulation, E>(
    simulation: &R,
    trace: &mut Trace,
    observer: &mut dyn Observe,
    play: impl FnOnce(&mut dyn Observe, u64) -> Result<(Summary, Option<&'static str>), E>,
) -> Result<Summary, E> {
    trace.begin(simulation.edges() / simulation.stride() + 1, simulation.outline().still);
    let from = simulation.window_start();
    let known = Known { judged: Judged::around_a_wall(simulation, trace, from), words: Vec::new() };
    let mut both = (known, observer);
    let (summary, over) = play(&mut both, from)?;
    let contact = both.0.judged.contact(summary.edges);
    Ok(judged(simulation, trace, summary, contact, over))
}

/// [`Judged`] of a run with unknown words, which count as 0.
struct Known<'a> {
    judged: Judged<'a>,
    words: Vec<i64>,
}

impl Observe for Known<'_> {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.words.clear();
        self.words.extend(words.iter().map(|&word| if word == UNKNOWN { 0 } else { word }));
        self.judged.nets(cycle, &self.words);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.judged.reals(cycle, values);
    }

    fn row(&mut self, cycle: Cycle, judged: &[f64], shown: &[f64]) {
        self.judged.row(cycle, judged, shown);
    }
}

/// Returns the summary with verdict and figures from the trace of its run.
pub(crate) fn judged<R: Simulation>(
    simulation: &R,
    trace: &Trace,
    mut summary: Summary,
    contact_edges: f64,
    over: Option<&'static str>,
) -> Summary {
    summary.motion_s = simulation.clock().seconds(Cycle(summary.edges));
    summary.aborted = over.map(|why| Abort { at_s: summary.motion_s, why });
    if summary.complete && simulation.has_device() {
        let outline = simulation.outline();
        let verdict = if over.is_none() { outline.without_torque(trace, &summary) } else { None };
        let window = simulation.edges() - simulation.window_start();
        let lost_share = summary.stays.map_or(0.0, |stays| stays.unheld as f64 / window as f64);
        let moved = || outline.judge(trace, summary.aborted).with_lost_position(lost_share);
        summary.verdict = Some(verdict.unwrap_or_else(moved));
        let share = |edges: f64| (over.is_none() && outline.has_contact).then_some(edges / window as f64);
        summary.contact_share = share(contact_edges);
        summary.device_contact_share = outline.wall.and(summary.stays).and_then(|stays| share(stays.inside as f64));
    }
    summary
}

/// All that a run is judged by: its trace, and the edges of contact.
pub(crate) struct Judged<'a> {
    pub(crate) trace: &'a mut Trace,
    contact: Contact,
    /// Number of the plant's outputs.
    reals: usize,
}

impl<'a> Judged<'a> {
    /// Fills this trace of a simulation and counts this contact.
    pub(crate) fn new(simulation: &impl Simulation, trace: &'a mut Trace, contact: Contact) -> Self {
        Self { trace, contact, reals: simulation.reals().len() }
    }

    /// Fills this trace of a loop around a wall, and counts its contact from an edge on.
    fn around_a_wall(simulation: &impl Simulation, trace: &'a mut Trace, from: u64) -> Self {
        let net = simulation.outline().contact.unwrap_or(usize::MAX);
        Self::new(simulation, trace, Contact::of(net, from))
    }

    /// Returns the edges of contact up to an edge.
    pub(crate) fn contact(&self, edge: u64) -> f64 {
        self.contact.edges(edge) as f64
    }
}

impl Observe for Judged<'_> {
    #[inline]
    fn follows(&self, nets: Range<usize>) -> bool {
        nets.contains(&self.contact.net()) || self.trace.follows(nets)
    }
    fn measures(&self) -> bool {
        self.trace.keeps_beyond(self.reals)
    }
    fn reads(&self, columns: Range<usize>) -> bool {
        self.trace.keeps_any(columns)
    }
    fn relates(&self) -> bool {
        self.trace.relates()
    }
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.trace.nets(cycle, words);
        self.contact.see(cycle.0, words);
    }
    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.trace.reals(cycle, values);
    }
    fn row(&mut self, cycle: Cycle, judged: &[f64], _: &[f64]) {
        self.trace.reals(cycle, judged);
    }
    #[inline]
    fn block(&mut self, first: Cycle, stride: u64, width: usize, values: &[f64]) {
        self.trace.block(first, stride, width, values);
    }
    #[inline]
    fn still(&mut self, first: Cycle, stride: u64, count: u64, values: &[f64]) {
        self.trace.still(first, stride, count, values);
    }
}

/// Implements [`Wired::closed_loop`] for any simulation.
pub(crate) struct Close;

impl<'s> LoopVisitor<'s> for Close {
    type Out = Box<dyn AnyClosedLoop<'s> + 's>;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        Box::new(Closed(ClosedLoop::new(wiring.clone(), world, input, u64::MAX), input))
    }
}

/// Implements [`Wired::compare`] for any simulation, over this number of edges.
pub(crate) struct Compare(pub(crate) u64);

impl<'s> LoopVisitor<'s> for Compare {
    type Out = Comparison;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Comparison
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        compare(wiring.clone(), world, input, self.0)
    }
}

struct Run<'a> {
    driver: Driver,
    /// The edges at which the judged window begins and the run ends.
    window: (u64, u64),
    stride: u64,
    modulated: bool,
    clock: Clock,
    observer: (Judged<'a>, Option<&'a mut dyn Observe>),
    control: &'a Control,
    beyond: Option<&'a Beyond<'a>>,
}

impl<'s> LoopVisitor<'s> for Run<'_> {
    /// The summary, the edges of contact in the window, and why the world ended the run.
    type Out = (Summary, f64, Option<&'static str>);
    fn visit<E, W>(mut self, wiring: &W, world: E, input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let start = Stopwatch::start();
        let mut wiring = wiring.clone();
        if !self.modulated {
            wiring.rest_modulator();
        }
        let (from, end) = self.window;
        let run = ClosedLoop::new(wiring, world, input, self.stride).averaged_from(from);
        let mut run = if self.observer.measures() { run.measured(&self.observer) } else { run };
        let complete = run.run(self.driver, end, &mut self.observer, self.control);
        let judged = if complete { run.judged(self.clock.period_s()) } else { None };
        let of_world = run.world.summary();
        let nets = run.wiring.nets().into_iter().zip(run.wiring.uses());
        let nets = nets.map(|(signal, usage)| of_world.used(signal, usage));
        let summary = Summary {
            complete,
            edges: run.edge(),
            wall_s: start.seconds(),
            ticks: run.ticks(),
            output_changes: run.output_changes(),
            averages: judged.map(|(averages, _)| averages),
            stays: judged.map(|(_, stays)| stays),
            recurrence: run.recurrence(),
            nets: nets.collect(),
            ..of_world
        };
        let (contact, over) = (self.observer.0.contact(run.edge()), run.world.over());
        #[cfg(not(target_family = "wasm"))]
        let forever = self.beyond.filter(|_| complete).map(|beyond| {
            // No row is shown beyond the end, so this trace stays empty.
            let mut nothing = Trace::new(self.clock, self.stride, Vec::new(), Vec::new());
            let judged = Judged { trace: &mut nothing, contact: Contact::of(usize::MAX, u64::MAX), reals: 0 };
            run.last(beyond, &mut (judged, None::<&mut dyn Observe>), self.control)
        });
        #[cfg(not(target_family = "wasm"))]
        let summary = Summary { forever, ..summary };
        (summary, contact, over)
    }
}
