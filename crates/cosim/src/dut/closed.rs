//! The loop of a design and its world.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use hpu_datapath::LoopOut;
use hpu_signal::{Cycle, Observe, SignalUse, UNKNOWN};

use super::{Change, DutSimulation, Fault, RunningDesign};
use crate::axis_world::AxisWorld;
use crate::contact::{Contact, window_start};
use crate::engine::{Control, Rows};
use crate::schedule::Schedule;
use crate::simulation::{Recorder, Simulation, judged};
use crate::stopwatch::Stopwatch;
use crate::summary::{NetUse, Summary};
use crate::trace::Trace;
use crate::world::World;

/// The fewest and the most edges to look ahead. A look of the world costs as much as about a hundred edges of a design,
/// and a simulator has to answer within a fraction of a second.
const LOOK: [u64; 2] = [64, 1 << 14];

/// The state of the loop.
struct Closed<'a> {
    simulation: &'a DutSimulation<'a>,
    world: AxisWorld<'a>,
    running: Box<dyn RunningDesign>,
    start: i64,
    /// The words of the ports (`None` if unknown), and their bits.
    words: Vec<Option<i64>>,
    bits: Vec<u64>,
    /// The words of the nets as last shown: the ports, then whether the wall is touched.
    shown: Vec<i64>,
    uses: Vec<SignalUse>,
    changes: Vec<Change>,
    driven: (LoopOut<i64>, i64),
    /// The edges that the design has clocked, and the edge at which the world stands: the same one, or the next, at
    /// which the inputs are known.
    edge: u64,
    stands: u64,
    /// Whether the inputs at `stands` still have to be shown.
    is_sensed: bool,
    output_changes: u64,
    /// Whether an observer looks at the nets.
    watched: bool,
}

impl DutSimulation<'_> {
    /// Runs the scene to its end, or until stopped. Fills the trace anew and shows everything to the observer: motion,
    /// energy and verdict are those of the design in its own loop. The summary has the ranges of the ports if `ranges`
    /// asks for them or the observer watches.
    ///
    /// # Errors
    ///
    /// When the simulator fails, an output that drives the device has an unknown bit, or both switches of a leg are
    /// closed.
    pub fn run(
        &self,
        ranges: bool,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
    ) -> Result<Summary, Fault> {
        let began = Stopwatch::start();
        let (end, stride) = (self.edges(), self.stride());
        trace.begin(end / stride + 1);
        let from = window_start(end, stride);
        let watched = ranges || observer.watches() || trace.follows(0..self.wires.nets.len());
        let contact = Contact::of(self.wires.wires.len(), from);
        let recorder = Recorder { trace, contact, observer: Some(observer), reals: self.reals().len() };
        let measured = recorder.measures();
        let mut watch = Watch { rows: Rows::new(stride).averaged(from, measured), recorder };
        let mut closed = self.begin(watched)?;
        if measured {
            closed.world.measure(stride, &watch.recorder);
        }
        closed.tell(0, &mut watch);
        let complete = match closed.run(end, &mut watch, control) {
            // The program that stops a run may have ended the simulator first.
            Err(_) if control.stop.load(Ordering::Relaxed) => false,
            ran => ran?,
        };
        let (edge, world) = (closed.edge, &closed.world);
        watch.log(world, edge);
        let Watch { rows, recorder } = watch;
        let contact = recorder.contact.edges(edge) as f64;
        let nets = self.wires.nets.iter().cloned().zip(&closed.uses).filter(|_| watched);
        let summary = Summary {
            complete,
            edges: edge,
            wall_s: began.seconds(),
            ticks: edge,
            output_changes: closed.output_changes,
            averages: if complete { rows.averages(world, edge, self.clock().period_s()) } else { None },
            nets: nets.map(|(signal, &usage)| NetUse { signal, usage, losses_seen: false }).collect(),
            ..world.summary()
        };
        let over = world.over();
        Ok(judged(self, recorder.trace, summary, contact, over))
    }

    /// Returns the loop at edge 0, with the reset done.
    fn begin(&self, watched: bool) -> Result<Closed<'_>, Fault> {
        let world = AxisWorld::new(&self.plant, 0, Schedule::default());
        let wires = &self.wires.wires;
        let start = world.count();
        let encoder = world.encoder_state();
        let mut words: Vec<_> = wires.iter().map(|wire| Some(self.wires.word(wire, encoder, start))).collect();
        let bits = |word: &Option<i64>, format: hpu_signal::Format| word.map_or(0, |word| format.bits(word));
        let bits: Vec<_> = words.iter().zip(&self.wires.nets).map(|(word, net)| bits(word, net.format)).collect();
        let drives: Vec<_> = wires.iter().map(|wire| wire.connection.drives()).collect();
        let mut changes = Vec::new();
        let running = Arc::clone(&self.design).start(&bits, &drives, &mut changes)?;
        // No output has a word until the simulator reports one.
        words.iter_mut().zip(wires).filter(|(_, wire)| !wire.port.is_input).for_each(|(word, _)| *word = None);
        let mut closed = Closed {
            simulation: self,
            world,
            running,
            start,
            shown: Vec::new(),
            uses: vec![SignalUse { min: i64::MAX, max: i64::MIN, rounded: 0, overflowed: 0 }; self.wires.nets.len()],
            words,
            bits,
            changes,
            driven: (LoopOut { a_high: 0, a_low: 0, b_high: 0, b_low: 0 }, 0),
            edge: 0,
            stands: 0,
            is_sensed: false,
            output_changes: 0,
            watched,
        };
        closed.take_changes(0, None);
        closed.drive()?;
        Ok(closed)
    }
}

/// The watchers of a run: the rows of the plant, and the trace, contact and observer that see rows and nets in the
/// order of edges.
struct Watch<'a> {
    rows: Rows,
    recorder: Recorder<'a>,
}

impl Watch<'_> {
    /// Shows the rows up to an edge that the world has not left yet.
    fn log(&mut self, world: &AxisWorld, edge: u64) {
        self.rows.log(world, edge, &mut self.recorder);
    }
}

impl Closed<'_> {
    fn run(&mut self, end: u64, watch: &mut Watch, control: &Control) -> Result<bool, Fault> {
        let [least, most] = LOOK;
        let mut look = least;
        let mut events = 0;
        while self.edge < end && self.world.over().is_none() {
            events += 1;
            if !control.goes_on(self.edge, events) {
                return Ok(false);
            }
            let before = self.edge;
            // The edge at which the inputs may differ from those that the design has. Up to the edge before it, the
            // design can be clocked in one request.
            let next = if self.stands == end { end + 1 } else { self.world.next_change((self.stands + look).min(end)) };
            if next > before + 1 && self.clock(next - 1 - before, watch)? {
                let here = self.edge;
                self.go(here, watch);
                self.drive()?;
            } else if next <= end {
                self.go(next, watch);
                self.is_sensed = self.sense();
            }
            look = (2 * (self.edge - before)).clamp(least, most);
        }
        if self.edge < self.stands && self.clock(1, watch)? {
            self.drive()?;
        }
        Ok(true)
    }

    /// Moves the world to an edge.
    fn go(&mut self, to: u64, watch: &mut Watch) {
        if to > self.stands {
            self.world.advance(to, |world, edge| watch.log(world, edge - 1));
            self.stands = to;
        }
    }

    /// Clocks the design for `edges` edges, or up to the first after which an output that drives the device changes.
    /// Returns whether one did.
    fn clock(&mut self, edges: u64, watch: &mut Watch) -> Result<bool, Fault> {
        self.changes.clear();
        let before = self.edge;
        let done = self.running.clock(&self.bits, edges, self.watched, &mut self.changes)?;
        self.edge += done;
        let drives = |change: &Change| self.simulation.wires.wires[change.port].connection.drives();
        let changed = self.changes.iter().any(drives);
        self.output_changes += u64::from(changed);
        self.take_changes(before, Some(watch));
        Ok(changed)
    }

    /// Takes the changes of outputs, edge by edge. The world still stands before these changes, driven as before.
    fn take_changes(&mut self, before: u64, mut watch: Option<&mut Watch>) {
        let mut changes = std::mem::take(&mut self.changes);
        let mut sensed = std::mem::take(&mut self.is_sensed).then_some(before + 1);
        for at in changes.chunk_by(|one, two| one.edge == two.edge) {
            let edge = before + at[0].edge;
            if let (Some(watch), Some(first)) = (&mut watch, sensed.take_if(|first| *first < edge)) {
                self.tell(first, watch);
            }
            for &Change { port, bits, .. } in at {
                let format = self.simulation.wires.nets[port].format;
                self.words[port] = bits.map(|bits| format.from_bits(bits));
            }
            if let (true, Some(watch)) = (self.watched || sensed.take().is_some(), &mut watch) {
                watch.log(&self.world, edge - 1);
                self.tell(edge, watch);
            }
        }
        if let (Some(watch), Some(first)) = (&mut watch, sensed) {
            self.tell(first, watch);
        }
        changes.clear();
        self.changes = changes;
    }

    /// Sets the inputs from the world at the edge at which it stands. Returns whether any of them is new.
    fn sense(&mut self) -> bool {
        let (encoder, simulation) = (self.world.encoder_state(), self.simulation);
        let mut changed = false;
        for (index, wire) in simulation.wires.wires.iter().enumerate().filter(|(_, wire)| wire.port.is_input) {
            let word = simulation.wires.word(wire, encoder, self.start);
            if self.words[index] != Some(word) {
                self.words[index] = Some(word);
                self.bits[index] = simulation.wires.nets[index].format.bits(word);
                changed = true;
            }
        }
        changed || self.touched() != self.shown.last().is_some_and(|word| *word != 0)
    }

    fn touched(&self) -> bool {
        self.world.count() > self.simulation.wires.wall
    }

    /// Shows the nets after an edge to the observer.
    fn tell(&mut self, edge: u64, watch: &mut Watch) {
        self.shown.clear();
        self.shown.extend(self.words.iter().map(|word| word.unwrap_or(UNKNOWN)));
        self.shown.push(i64::from(self.touched()));
        for (usage, &word) in self.uses.iter_mut().zip(&self.shown) {
            if word != UNKNOWN {
                (usage.min, usage.max) = (usage.min.min(word), usage.max.max(word));
            }
        }
        watch.recorder.nets(Cycle(edge), &self.shown);
    }

    /// Drives the device with the words of the outputs from the present edge on.
    fn drive(&mut self) -> Result<(), Fault> {
        let at = self.simulation.clock().seconds(Cycle(self.edge));
        let driven = self.simulation.wires.drive(&self.words).map_err(|fault| fault.text(self.edge, at))?;
        if driven != self.driven || self.edge == 0 {
            self.driven = driven;
            self.world.drive(driven.0, &[driven.1]);
        }
        Ok(())
    }
}
