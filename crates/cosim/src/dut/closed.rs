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
use crate::result::forever::{Beyond, Recurrence};
#[cfg(not(target_family = "wasm"))]
use crate::result::forever::{Forever, NotTold, Period};
use crate::result::stays::Stays;
use crate::result::stopwatch::Stopwatch;
use crate::result::summary::{NetUse, Summary};
#[cfg(not(target_family = "wasm"))]
use crate::result::trace::ANGLE;
use crate::result::trace::Trace;
use crate::run::engine::{Control, Rows};
use crate::run::simulation::{Judged, Simulation, judged};
use crate::world::World;
use crate::world::axis_world::AxisWorld;
use hpu_scene::Schedule;

/// Parts of the time beyond the end of a run, of which the first is one; each part that follows is twice as long.
#[cfg(not(target_family = "wasm"))]
const PARTS: u64 = 1 << 10;
/// Rows of a period, at least.
#[cfg(not(target_family = "wasm"))]
const LEAST_ROWS: u64 = 256;

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
    /// The search beyond the end of the run.
    far: Option<Far<'a>>,
}

/// The search for a state that comes back after the end of a run: each state after a change of the outputs is compared
/// with one of them, which is replaced after 1, 2, 4 and so on more (Brent 1980).
#[derive(Default)]
struct Far<'a> {
    kept: Option<Kept<'a>>,
    /// The states until it is replaced, and how many that were at its beginning.
    left: u64,
    of: u64,
    found: Option<Recurrence>,
}

/// The state of the loop after an edge: the words of the design on which its driving outputs depend, and all words and
/// motions between design and world.
struct Kept<'a> {
    edge: u64,
    state: Vec<u64>,
    outputs: Vec<i64>,
    bits: Vec<u64>,
    world: AxisWorld<'a>,
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
        self.run_beyond(ranges, trace, observer, control, None)
    }

    /// Runs the scene as [`run`](Self::run), and then looks how it goes on for ever, if that is asked for. The observer
    /// is shown nothing beyond the end.
    ///
    /// # Errors
    ///
    /// As [`run`](Self::run).
    pub fn run_beyond(
        &self,
        ranges: bool,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
        beyond: Option<&Beyond>,
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
        let (edge, world) = (closed.edge, closed.world.world());
        // A run that the design has ended is over, but too short to be judged.
        let (over, is_whole) = (closed.world.over(), complete && !closed.running.is_over());
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
            edges: edge,
            wall_s: began.seconds(),
            ticks: edge,
            output_changes: closed.output_changes,
            averages: window.map(|(averages, _)| averages),
            stays: window.map(|(_, stays)| Stays { unheld: 0, ..stays }),
            nets: nets.map(used).collect(),
            ..of_world
        };
        #[cfg(not(target_family = "wasm"))]
        let summary =
            Summary { forever: beyond.filter(|_| is_whole).map(|asked| closed.last(asked, control)), ..summary };
        let summary = Summary { heard: closed.running.heard(), ..summary };
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
            far: None,
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
            if self.far.as_ref().is_some_and(|far| far.found.is_some()) {
                return Ok(true);
            }
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
                self.look_back();
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

    /// Compares the state after a change of the outputs with the one that was kept.
    fn look_back(&mut self) {
        let Some(far) = self.far.as_mut().filter(|_| self.world.world().edge() == self.edge) else { return };
        let mut state = Vec::new();
        if !self.running.state(&mut state) {
            return;
        }
        let world = self.world.world();
        let is_it = |kept: &&Kept| {
            let same = (&kept.state, &kept.outputs, &kept.bits) == (&state, &self.outputs, &self.bits);
            same && world.recurs(&kept.world)
        };
        if let Some(kept) = far.kept.as_ref().filter(is_it) {
            far.found = Some(Recurrence { from: kept.edge, period: self.edge - kept.edge });
        } else if far.left > 0 {
            far.left -= 1;
        } else {
            (far.left, far.of) = (far.of, (2 * far.of).max(1));
            let (outputs, bits) = (self.outputs.clone(), self.bits.clone());
            far.kept = Some(Kept { edge: self.edge, state, outputs, bits, world: world.clone() });
        }
    }

    /// Looks on after the end of the run. Tells of a state that comes back; a rest without one is not told.
    #[cfg(not(target_family = "wasm"))]
    fn last(&mut self, beyond: &Beyond, control: &Control) -> Result<Forever, NotTold> {
        if let Some(why) = self.world.over() {
            return Err(why.into());
        }
        let count_rad = self.world.world().left_alone()?;
        if !self.running.state(&mut Vec::new()) {
            return Err("the words of the registers are not known: the design is not simulated by leaps".into());
        }
        (self.watched, self.far) = (false, Some(Far::default()));
        let last = self.edge.saturating_add(beyond.edges);
        let mut part = (beyond.edges / PARTS).max(1);
        while self.edge < last {
            let next = last.min(self.edge + part).min(self.world.world().reach());
            part *= 2;
            self.go_far(next, control)?;
            if let Some(recurrence) = self.far.as_ref().and_then(|far| far.found) {
                self.far = None;
                return self.period(beyond, recurrence, count_rad, control);
            }
        }
        Err("no state came back to the last bit".into())
    }

    /// Runs on, watched by nobody.
    #[cfg(not(target_family = "wasm"))]
    fn go_far(&mut self, end: u64, control: &Control) -> Result<(), NotTold> {
        if end <= self.edge || end > self.world.world().reach() {
            return Err("no count or pulse comes for longer than the motion is tabulated".into());
        }
        self.world.go_on(end);
        let mut nothing = Trace::new(self.simulation.clock(), 1, Vec::new(), Vec::new());
        let judging = Judged::new(self.simulation, &mut nothing, Contact::of(usize::MAX, u64::MAX));
        let mut watch = Watch { rows: Rows::never(), observer: (judging, &mut ()) };
        let ran = self.run(end, &mut watch, control).map_err(|fault| fault.to_string())?;
        match self.world.over() {
            Some(why) => Err(why.into()),
            None if !ran || self.running.is_over() => Err("it was stopped".into()),
            None => Ok(()),
        }
    }

    /// Runs one period, and gathers its position and what happens.
    #[cfg(not(target_family = "wasm"))]
    fn period(
        &mut self,
        beyond: &Beyond,
        recurrence: Recurrence,
        count_rad: f64,
        control: &Control,
    ) -> Result<Forever, NotTold> {
        let (mut sum, mut squares, mut rows) = (0.0, 0.0, 0.0);
        // Odd, so that rows are at all phases of a modulator.
        let (end, stride) = (self.edge + recurrence.period, (recurrence.period / LEAST_ROWS) | 1);
        let (start, before, changes) = (self.world.real(ANGLE), self.world.summary(), self.output_changes);
        while self.edge < end {
            self.go_far(end.min(self.edge + stride), control)?;
            let off = (self.world.real(ANGLE) - start) / count_rad;
            (sum, squares, rows) = (sum + off, squares + off * off, rows + 1.0);
        }
        let (mean, after): (f64, _) = (sum / rows, self.world.summary());
        let period = Period {
            edges: recurrence.period,
            events: self.output_changes - changes + after.encoder_edges - before.encoder_edges,
            mode_changes: after.mode_changes - before.mode_changes,
            redecided: after.redecided - before.redecided,
            angle_rad: self.world.real(ANGLE),
        };
        let rms_counts = (squares / rows - mean * mean).max(0.0).sqrt();
        Ok(Forever::Recurs { recurrence, rms_counts, model_counts: (beyond.follow)(&period) })
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
