//! The loop of a design and its world.
//!
//! The simulator is to [`DrivenWorld`] as a program is to libhpu: it reads inputs, drives outputs and moves on through
//! the same methods. Beside them a run reads the world's rows for its observers.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use hpu_signal::{Cycle, Observe, Signal, SignalUse, UNKNOWN};

use super::{Asked, Change, DutSimulation, Fault, Misdriven, RunningDesign, Wire, Wires};
use crate::dut::driven_world::{DrivenWorld, Logic};
use crate::result::contact::Contact;
use crate::result::stays::Stays;
use crate::result::stopwatch::Stopwatch;
use crate::result::summary::{NetUse, Summary};
use crate::result::trace::Trace;
use crate::run::engine::{Control, Rows};
use crate::run::simulation::{Judged, Simulation, judged};
use crate::world::axis_world::AxisWorld;
use hpu_scene::Schedule;

/// The world of a design.
type Driven<'a> = DrivenWorld<'a, AxisWorld<'a>>;

/// The state of the loop.
struct Closed<'a> {
    simulation: &'a DutSimulation<'a>,
    /// The world, at the edge that the design has clocked last, or at the next one, at which the inputs are known.
    world: Driven<'a>,
    running: Box<dyn RunningDesign>,
    /// The words of the ports (`None` if unknown), and their bits.
    words: Vec<Option<i64>>,
    bits: Vec<u64>,
    /// The words of the nets as last shown: the ports, then whether the wall is touched.
    shown: Vec<i64>,
    uses: Vec<SignalUse>,
    changes: Vec<Change>,
    /// The words of the outputs that drive the device, as last taken.
    outputs: Vec<i64>,
    /// The edges that the design has clocked.
    edge: u64,
    /// Whether an output is still unknown before the first clock edge. It then drives the device from that edge on.
    is_unset: bool,
    /// Whether the inputs at the world's edge still have to be shown.
    is_sensed: bool,
    output_changes: u64,
    /// Whether an observer looks at the nets.
    watched: bool,
    /// The nets that are signals inside the design.
    inside: Range<usize>,
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
        trace.begin(end / stride + 1, self.outline().still);
        let from = self.window_start();
        let watched = ranges || observer.watches() || trace.follows(0..self.wires.nets.len());
        let contact = Contact::of(self.wires.wires.len(), from);
        let observer: (_, &mut dyn Observe) = (Judged::new(self, trace, contact), observer);
        let measured = observer.measures();
        let mut watch = Watch { rows: Rows::new(stride).averaged(from, measured), observer };
        let mut closed = self.begin(watched)?;
        if measured {
            closed.world.measure(stride, &watch.observer);
        }
        closed.tell(0, &mut watch);
        let complete = match closed.run(end, &mut watch, control) {
            // The program that stops a run may have ended the simulator first.
            Err(_) if control.stop.load(Ordering::Relaxed) => false,
            ran => ran?,
        };
        let (edge, world, heard) = (closed.edge, closed.world.world(), closed.running.heard());
        // A run that the design has ended is over, but too short to be judged.
        let (over, is_whole) = (closed.world.over(), complete && heard.end.is_none());
        watch.log(world, edge);
        let Watch { rows, observer: (judging, _) } = watch;
        let contact = judging.contact(edge);
        let window = if is_whole { rows.judged(world, edge, self.clock().period_s()) } else { None };
        // What a design makes of a count that wraps is its own matter, so the run's position is not lost: the port is.
        let of_world = Summary { unheld: None, ..closed.world.summary() };
        let lost = closed.world.summary().unheld.map_or(0, |unheld| unheld.edges);
        let counter = self.wires.counter().map(|(index, _)| index);
        let nets = self.wires.nets.iter().cloned().zip(&closed.uses).enumerate().filter(|_| watched);
        let used = |(index, (signal, &usage)): (usize, (Signal, &SignalUse))| match counter {
            Some(counter) if counter == index => {
                NetUse { signal, usage: SignalUse { overflowed: lost, ..usage }, losses_seen: true }
            }
            _ => NetUse { signal, usage, losses_seen: false },
        };
        let summary = Summary {
            complete: is_whole,
            heard,
            edges: edge,
            wall_s: began.seconds(),
            ticks: edge,
            output_changes: closed.output_changes,
            averages: window.map(|(averages, _)| averages),
            stays: window.map(|(_, stays)| Stays { unheld: 0, ..stays }),
            nets: nets.map(used).collect(),
            ..of_world
        };
        let summary = judged(self, judging.trace, summary, contact, over);
        // Nothing touches a wall that is not there.
        let contact_share = summary.contact_share.filter(|_| self.scene.wall_rad.is_some());
        Ok(Summary { complete, contact_share, ..summary })
    }

    /// Returns the loop at edge 0, with the reset done.
    fn begin(&self, watched: bool) -> Result<Closed<'_>, Fault> {
        let (world, wires) = (AxisWorld::new(&self.plant, 0, Schedule::default()), &self.wires.wires);
        let world = Driven::new(Box::new(world), Logic::Design(&self.wires), self.edges());
        // No output has a word until the simulator reports one.
        let (mut words, mut bits) = (vec![None; wires.len()], vec![0; wires.len()]);
        take_inputs(&self.wires, world.inputs(), &mut words, &mut bits);
        let drives: Vec<_> = wires.iter().map(Wire::drives).collect();
        let mut changes = Vec::new();
        let running = Arc::clone(&self.design).start(&bits, &drives, &mut changes)?;
        let mut closed = Closed {
            simulation: self,
            world,
            running,
            shown: Vec::new(),
            uses: vec![SignalUse { min: i64::MAX, max: i64::MIN, rounded: 0, overflowed: 0 }; self.wires.nets.len()],
            words,
            bits,
            changes,
            outputs: vec![0; self.wires.outputs().len()],
            edge: 0,
            is_unset: false,
            is_sensed: false,
            output_changes: 0,
            watched,
            inside: wires.iter().position(|wire| wire.port.is_inside).unwrap_or(wires.len())..wires.len(),
        };
        closed.take_changes(0, None);
        let known = self.wires.known(&closed.words, &mut closed.outputs);
        closed.is_unset = matches!(known, Err(Misdriven::Unknown(_)));
        if !closed.running.is_over() && !closed.is_unset {
            closed.drive()?;
        }
        Ok(closed)
    }
}

/// Takes the words and bits of the input ports from the inputs of the world. Returns whether any of them is new.
fn take_inputs(wires: &Wires, inputs: &[i64], words: &mut [Option<i64>], bits: &mut [u64]) -> bool {
    let mut changed = false;
    for (&index, &word) in wires.given.iter().zip(inputs) {
        if words[index] != Some(word) {
            words[index] = Some(word);
            bits[index] = wires.nets[index].format.bits(word);
            changed = true;
        }
    }
    changed
}

/// The watchers of a run: the rows of the plant, and the trace, contact and observer that see rows and nets in the
/// order of edges.
struct Watch<'a> {
    rows: Rows,
    observer: (Judged<'a>, &'a mut dyn Observe),
}

impl Watch<'_> {
    /// Shows the rows up to an edge that the world has not left yet.
    fn log(&mut self, world: &AxisWorld, edge: u64) {
        self.rows.log(world, edge, &mut self.observer);
    }
}

impl Closed<'_> {
    fn run(&mut self, end: u64, watch: &mut Watch, control: &Control) -> Result<bool, Fault> {
        let mut events = 0;
        while self.edge < end && self.world.over().is_none() && !self.running.is_over() {
            events += 1;
            if !control.goes_on(self.edge, events) {
                return Ok(false);
            }
            // As long as its inputs certainly stay, the design can be clocked in one request.
            let quiet = self.world.edge() + self.world.quiet() - self.edge;
            let edges = if self.is_unset { quiet.min(1) } else { quiet };
            let until = self.edge + edges;
            let changed = edges > 0 && self.clock(edges, watch)?;
            if self.running.is_over() {
                self.go(self.edge, watch);
            } else if changed {
                self.go(self.edge, watch);
                self.drive()?;
            } else if self.edge < until {
                // From here on other signals are asked for, in another request.
            } else if self.edge < end {
                self.go(self.edge + 1, watch);
                self.is_sensed = self.sense();
            }
        }
        if self.edge < self.world.edge() && self.clock(1, watch)? {
            self.drive()?;
        }
        Ok(true)
    }

    /// Moves the world to an edge. At the end of a world, [`DrivenWorld::over`] tells why.
    fn go(&mut self, to: u64, watch: &mut Watch) {
        let edges = to - self.world.edge();
        if edges > 0 {
            watch.log(self.world.world(), to - 1);
            let _ = self.world.advance(edges);
        }
    }

    /// Returns the changes to ask for at the next edge, and for how many edges at most.
    fn asked(&self) -> (Asked, u64) {
        let (next, looked) = (self.edge + 1, &self.simulation.looked);
        match self.watched {
            false => (Asked::Driving, u64::MAX),
            true if self.inside.is_empty() || looked.end <= next => (Asked::Outputs, u64::MAX),
            true if next < looked.start => (Asked::Outputs, looked.start - next),
            true => (Asked::Inside, looked.end - next),
        }
    }

    /// Clocks the design for `edges` edges, or up to the first after which an output that drives the device changes.
    /// Returns whether one did; after the first edge also where an output was unknown before it.
    fn clock(&mut self, edges: u64, watch: &mut Watch) -> Result<bool, Fault> {
        self.changes.clear();
        let before = self.edge;
        let (asked, most) = self.asked();
        let done = self.running.clock(&self.bits, edges.min(most), asked, &mut self.changes)?;
        self.edge += done;
        let drives = |change: &Change| self.simulation.wires.wires[change.port].drives();
        let changed = self.changes.iter().any(drives);
        self.output_changes += u64::from(changed);
        self.take_changes(before, Some(watch));
        Ok(changed || self.is_unset)
    }

    /// Takes the changes of outputs, edge by edge. The world still stands before these changes, driven as before.
    fn take_changes(&mut self, before: u64, mut watch: Option<&mut Watch>) {
        let mut changes = std::mem::take(&mut self.changes);
        let mut sensed = std::mem::take(&mut self.is_sensed).then_some(before + 1);
        // The first time, signals may be shown that have changed before.
        let mut is_first = true;
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
                watch.log(self.world.world(), edge - 1);
                if std::mem::take(&mut is_first) {
                    self.tell(edge, watch);
                } else {
                    self.tell_changes(edge, at, watch);
                }
            }
        }
        if let (Some(watch), Some(first)) = (&mut watch, sensed) {
            self.tell(first, watch);
        }
        changes.clear();
        self.changes = changes;
    }

    /// Shows the nets after an edge at which these alone have changed since the edge that was shown last.
    fn tell_changes(&mut self, edge: u64, changes: &[Change], watch: &mut Watch) {
        for change in changes {
            if let Some(word) = self.words[change.port] {
                self.shown[change.port] = word;
                let usage = &mut self.uses[change.port];
                (usage.min, usage.max) = (usage.min.min(word), usage.max.max(word));
            } else {
                self.shown[change.port] = UNKNOWN;
            }
        }
        watch.observer.nets(Cycle(edge), &self.shown);
    }

    /// Takes the inputs from the world at its edge. Returns whether any of them is new, or whether contact is.
    fn sense(&mut self) -> bool {
        let changed = take_inputs(&self.simulation.wires, self.world.inputs(), &mut self.words, &mut self.bits);
        changed || self.contact() != self.shown.last().copied()
    }

    /// Returns 1 while the wall is touched, else 0.
    fn contact(&self) -> Option<i64> {
        self.world.inputs().last().copied()
    }

    /// Shows the nets after an edge to the observer.
    fn tell(&mut self, edge: u64, watch: &mut Watch) {
        // The words of signals that are not asked for may be old.
        let looked = self.simulation.looked.contains(&edge);
        let asked = if looked { self.words.len() } else { self.inside.start };
        let fresh = if self.shown.is_empty() { self.words.len() } else { asked };
        self.shown.resize(self.words.len(), UNKNOWN);
        for (shown, word) in self.shown.iter_mut().zip(&self.words[..fresh]) {
            *shown = word.unwrap_or(UNKNOWN);
        }
        self.shown.extend(self.contact());
        // Contact is the last net.
        for index in (0..asked).chain(self.words.len()..self.shown.len()) {
            let (usage, word) = (&mut self.uses[index], self.shown[index]);
            if word != UNKNOWN {
                (usage.min, usage.max) = (usage.min.min(word), usage.max.max(word));
            }
        }
        watch.observer.nets(Cycle(edge), &self.shown);
    }

    /// Drives the device with the words of the outputs from the present edge on.
    fn drive(&mut self) -> Result<(), Fault> {
        let (world, outputs) = (&mut self.world, &mut self.outputs);
        let taken = self.simulation.wires.known(&self.words, outputs);
        let first = self.edge == 0 || std::mem::take(&mut self.is_unset);
        let driven = taken.and_then(|()| if first { world.begin(outputs) } else { world.drive(outputs) });
        driven.map_err(|fault| {
            let at = self.simulation.clock().seconds(Cycle(self.edge));
            fault.text(self.edge, at).into()
        })
    }
}
