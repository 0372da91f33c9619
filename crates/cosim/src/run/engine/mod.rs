//! The engine: cycle-accurate, not cycle-driven.
//!
//! `events` asks the wiring for how many edges it is quiet (its outputs certainly stay) and the world when it next
//! changes, leaps to the earlier of the two, and ticks there. `clock` ticks every edge. Both flow the plant from the
//! same anchors by the same function, so their registers, pins and plant states are identical to the bit at every edge.
//! The third driver, the VHDL itself, lives in the `rtl` crate and uses the same [`World`].
//!
//! # Where it saves
//!
//! - Outputs that only repeat do not stop a leap. A motor *cruises* over periods in which its gates repeat a pulse;
//!   where friction ends modes within them, the world alone is driven with the promised outputs (`ClosedLoop::switch`).
//!   Both end where an observer follows the outputs.
//! - While the datapath changes edge by edge, the world is asked once for how many edges nothing happens
//!   (`World::idles`). The datapath then ticks on alone (`Wiring::tick_on`) until an output changes, or a net that
//!   drives the world or is watched.
//! - Rows are computed from the motion's anchor. Where a command drives the motion and no switching gates, rows wait
//!   until the motion changes (`World::keeps`), and many are shown at once, unless an observer relates them to nets.
//!
//! The engine is compiled here, once: `Wired::run` takes an observer as a trait object. If it were
//! generic, each crate that runs a scene would compile every wiring and its world again.

mod compare;
#[cfg(not(target_family = "wasm"))]
mod forever;
mod recurrence;
mod rows;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use hpu_datapath::{Repeat, Wiring, bundle, flatten};
use hpu_signal::{Cycle, Observe, Ports};

use crate::result::stays::Stays;
use crate::world::World;
use hpu_scene::Solver;

use recurrence::Search;

pub use compare::{Comparison, Difference, compare};
pub(crate) use rows::Rows;

/// How a run advances.
///
/// ```
/// use hpu_cosim::{Control, Driver, SceneFile, Simulation, Wired, WiredSimulation};
/// let overrides = [("run.duration".to_string(), "1 ms".to_string())];
/// let experiment = SceneFile::find("hybrid-wall")?.parse(&overrides)?;
/// let simulation = WiredSimulation::new(&experiment)?;
/// let run = |driver| {
///     let mut trace = simulation.trace(&["position"]);
///     simulation.run(driver, &mut trace, &mut (), &Control::new());
///     trace
/// };
/// let (by_events, by_edges) = (run(Driver::Events), run(Driver::Clock));
/// assert_eq!((by_events.rows(), by_edges.rows()), (11, 11));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Driver {
    /// From event to event.
    Events,
    /// Edge by edge.
    Clock,
}

impl From<Solver> for Driver {
    /// Returns `clock` for the solver of this name; for every other solver `events`, which leaps to the next edge that
    /// matters.
    fn from(solver: Solver) -> Self {
        if solver == Solver::Clock { Self::Clock } else { Self::Events }
    }
}

/// Number of events between two looks at the run's control. An event can take a millisecond: for a body at rest on the
/// edge of a count, each clock edge is decided in double-double.
pub(crate) const TURN: u32 = 256;

/// The most edges at which a datapath is ticked before the world is asked again: a change of an encoder's line takes
/// three edges to the position.
const PIPELINE: u64 = 4;

/// Handles by which other threads stop a run or watch its progress.
#[derive(Debug, Default)]
pub struct Control {
    /// Set by any thread to end the run at the next opportunity.
    pub stop: AtomicBool,
    /// Edges done so far, for a progress display.
    pub progress: AtomicU64,
    /// Number of events after which the run ends incomplete. It depends on the scene alone, as no limit of time does.
    /// An event is a clock edge at which the engine looks at the loop, or a step; events are counted by hundreds.
    pub most_events: Option<u64>,
}

impl Control {
    /// Creates a control that does not stop the run, with any number of events allowed.
    pub const fn new() -> Self {
        Self { stop: AtomicBool::new(false), progress: AtomicU64::new(0), most_events: None }
    }

    /// Records the run's progress and returns whether it may go on after `events` events. Called at every [`TURN`]th
    /// event.
    #[inline]
    pub(crate) fn goes_on(&self, edge: u64, events: u64) -> bool {
        self.progress.store(edge, Ordering::Relaxed);
        !self.stop.load(Ordering::Relaxed) && self.most_events.is_none_or(|most| events < most)
    }
}

/// Outputs that repeat.
struct Repeated<O> {
    repeat: Repeat<O>,
    /// The outputs that begin a period.
    begin: O,
    /// The edge up to which the world goes on by itself.
    cruise: Option<u64>,
    /// The next edge at which the outputs change.
    next: u64,
}

/// A datapath closed around a world.
pub struct ClosedLoop<W, E: World> {
    /// The datapath.
    pub wiring: W,
    /// The world around it.
    pub world: E,
    input: E::In,
    out: E::Out,
    edge: u64,
    ticks: u64,
    output_changes: u64,
    rows: Rows,
    /// The repetition of the outputs from the edge on at which the datapath stands.
    repeated: Option<Repeated<E::Out>>,
    /// Whether the observer of a run is told of overflows.
    tells_overflows: bool,
    /// The nets whose changes are shown to the observer of a run and to the world, a bit each; all bits if every tick
    /// is shown.
    watched: u64,
    /// Whether the world has changed its inputs at the latest tick.
    turned: bool,
    /// Codes that a converter has given; kept for their memory.
    codes: Vec<i64>,
    search: Search<W, E>,
}

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out>> ClosedLoop<W, E> {
    /// Creates the loop after reset, at edge 0. `input` holds the constant words; the world sets those that it drives.
    /// The plant's outputs are shown to the observer every `stride` edges.
    pub fn new(mut wiring: W, world: E, mut input: E::In, stride: u64) -> Self {
        let out = wiring.reset();
        world.place(&mut input);
        Self {
            wiring,
            world,
            input,
            out,
            edge: 0,
            ticks: 0,
            output_changes: 0,
            rows: Rows::new(stride),
            repeated: None,
            tells_overflows: false,
            watched: u64::MAX,
            turned: false,
            codes: Vec::new(),
            search: Search::default(),
        }
    }

    /// Shows rows with the means and extremes that an observer reads, one every `stride` edges, the first at `first`, a
    /// multiple of `stride`. To be called before the loop has run.
    pub(crate) fn show(&mut self, first: u64, stride: u64, observer: &dyn Observe) {
        self.world.measure(stride, observer);
        self.rows = Rows::new(stride);
        (self.rows.next, self.rows.row) = (first, Some(Default::default()));
    }

    /// Returns the loop with the means and extremes in its rows that an observer reads.
    #[must_use]
    pub fn measured(mut self, observer: &dyn Observe) -> Self {
        self.world.measure(self.rows.stride, observer);
        self.rows.row = Some(Default::default());
        self
    }

    /// Returns the loop with means of the actuator's torque and of the position, from the row at this edge on.
    #[must_use]
    pub fn averaged_from(mut self, edge: u64) -> Self {
        self.rows.judge_from(edge);
        self
    }

    /// Returns the means of the actuator's torque and of the position, and the stays of the device, from the requested
    /// row to the present edge. `edge_s` is the clock period in seconds.
    pub fn judged(&self, edge_s: f64) -> Option<([f64; 2], Stays)> {
        self.rows.judged(&self.world, self.edge, edge_s)
    }

    /// Returns the edges done.
    pub fn edge(&self) -> u64 {
        self.edge
    }

    /// Returns the edges at which the datapath was ticked, or would have been if its outputs were observed.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Returns the edges at which an output changed.
    pub fn output_changes(&self) -> u64 {
        self.output_changes
    }

    /// Runs to `end`, or until the world cannot go on, or until `control` ends the run. Returns `false` if `control`
    /// ended it.
    pub fn run<O: Observe>(&mut self, driver: Driver, end: u64, observer: &mut O, control: &Control) -> bool
    where
        W: Clone,
    {
        self.tells_overflows = observer.watches_overflows();
        // Gates that switch move the anchor at each pulse: waiting would gain nothing.
        self.rows.wait = self.world.driven_by() != 0 && !observer.relates() && self.rows.row.is_none();
        self.watched = watched(self.wiring.words().len(), observer) | self.world.driven_by();
        if self.edge == 0 {
            // A copy is settled: words that settle between reset and the first edge do not count as used.
            let mut settled = self.wiring.clone();
            settled.settle(&self.input);
            observer.nets(Cycle(0), settled.words());
            observer.overflows(Cycle(0), settled.overflowing() | self.world.overflowing());
        }
        self.look_from_here();
        self.go(driver, end, observer, control)
    }

    /// Runs on as [`run`](Self::run) does, of which it is the inner loop. What was copied in the search for a
    /// recurrence stays.
    #[inline(always)]
    fn go<O: Observe>(&mut self, driver: Driver, end: u64, observer: &mut O, control: &Control) -> bool
    where
        W: Clone,
    {
        let (mut since, mut events) = (0u32, 0u64);
        while self.edge < end && self.world.over().is_none() {
            since += match driver {
                Driver::Events => {
                    let events = self.leap_over::<true, O>(end, TURN - since, observer);
                    if self.turned {
                        self.look_back(end, observer, control);
                    }
                    events
                }
                Driver::Clock => {
                    self.step(observer);
                    1
                }
            };
            if since == TURN {
                (since, events) = (0, events + u64::from(TURN));
                self.meet();
                if !control.goes_on(self.edge, events) {
                    self.rows.log(&self.world, self.world.edge() - 1, observer);
                    return false;
                }
            }
        }
        self.rows.log(&self.world, self.edge, observer);
        control.progress.store(self.edge, Ordering::Relaxed);
        true
    }

    /// Goes on with other constant words, of which these are those before, from the edge after the present one on.
    pub(crate) fn tune(&mut self, before: &E::In, after: &E::In) {
        self.meet();
        self.repeated = None;
        let mut input = flatten(&self.input);
        for ((word, before), after) in input.iter_mut().zip(flatten(before)).zip(flatten(after)) {
            // Words that the world drives are 0 in both.
            if before != after {
                *word = after;
            }
        }
        self.input = bundle(&input);
        // At the first edge all words are taken.
        if self.edge > 0 {
            self.wiring.take(&self.input);
            // The world may go on by outputs that were promised for the words before.
            self.world.drive(self.out, self.wiring.words());
            self.look_ahead();
        }
    }

    /// Runs one edge.
    #[inline]
    pub fn step<O: Observe>(&mut self, observer: &mut O) {
        let edge = self.edge + 1;
        self.repeated = None;
        // Up to this edge the plant flows as it was driven after the edge before.
        self.rows.log(&self.world, self.edge, observer);
        self.world.sense();
        self.world.place(&mut self.input);
        self.edge = edge;
        let out = self.wiring.tick(self.input);
        self.ticked(Some(out), observer);
    }

    /// Leaps to the next edge at which anything happens, in the world or in the datapath, or to `end`. A change of the
    /// world that no pin shows leaves the datapath where it is.
    #[inline]
    pub fn leap<O: Observe>(&mut self, end: u64, observer: &mut O) {
        self.leap_over::<false, O>(end, 1, observer);
    }

    /// Leaps as [`leap`](Self::leap) does, once or, while the datapath changes edge by edge, up to `most` times, and
    /// returns how often. With `GLIDE` it passes ends of steps on the way, ticks more than once before it shows the
    /// nets, and lets the datapath wait while its outputs repeat; an observer cannot see the loop between.
    #[inline(always)]
    fn leap_over<const GLIDE: bool, O: Observe>(&mut self, end: u64, most: u32, observer: &mut O) -> u32 {
        let mut passed = false;
        if let Some(repeated) = &self.repeated {
            let cruise = repeated.cruise.filter(|&edge| edge <= end);
            let is_watched = observer.follows(outputs(&self.input, &self.out));
            if GLIDE && cruise.is_none() && !is_watched {
                return self.switch(end, most, observer);
            }
            if let Some(edge) = cruise.filter(|_| !is_watched) {
                self.advance(edge, observer);
                self.pass();
                passed = true;
            }
            self.repeated = None;
        }
        // Until a pin changes, the first edge that must be ticked is the edge after the quiet ones.
        let mut quiet = self.wiring.quiet_again(&self.input);
        let mut events = 1;
        while quiet == 0 && !passed {
            let left = u64::from(most + 1 - events).min(end - self.edge);
            let idle = self.world.idles(if GLIDE && self.watched != u64::MAX { left.min(PIPELINE) } else { 1 });
            if idle == 0 {
                break;
            }
            let (edges, out) = self.wiring.tick_on(idle, self.watched, &self.input);
            if !self.rows.wait {
                self.rows.log(&self.world, self.edge + edges - 1, observer);
            }
            self.world.coast(edges);
            self.edge += edges;
            self.ticks += edges - 1;
            events += edges as u32;
            if self.ticked(out, observer) || events > most || self.edge == end {
                return events - 1;
            }
            quiet = self.wiring.quiet_again(&self.input);
        }
        if GLIDE && !passed && self.gather(end, observer) {
            return events;
        }
        let due = self.edge.saturating_add(quiet).saturating_add(1);
        if !passed {
            if GLIDE {
                self.glide(due.min(end), observer);
            }
            self.advance(due.min(end), observer);
        }
        let edge = self.world.edge();
        let changes = !self.world.shows(&self.input);
        if changes || edge == due {
            self.wiring.skip(edge - 1 - self.edge, &self.input);
            self.tick(edge, changes, observer);
        } else if edge == end || self.world.over().is_some() {
            self.wiring.skip(edge - self.edge, &self.input);
            self.edge = edge;
        }
        events
    }

    /// Lets the datapath take codes of a converter, many at a time, before the edge at which anything else happens.
    /// Returns whether there were any.
    #[inline(always)]
    fn gather<O: Observe>(&mut self, end: u64, observer: &mut O) -> bool {
        let (quiet, nets) = self.wiring.gathers();
        if quiet == 0 || nets & self.watched != 0 {
            return false;
        }
        let (edge, rows, mut codes) = (self.edge, &mut self.rows, std::mem::take(&mut self.codes));
        let before = |world: &E, edge: u64| rows.leave(world, edge, observer);
        let (first, period) = self.world.convert(end.min(edge + 1 + quiet), before, &mut codes);
        let has_some = !codes.is_empty();
        if has_some {
            (self.edge, self.turned) = (self.world.edge(), false);
            self.ticks += self.wiring.gather((first - edge, period), &codes);
            self.world.place(&mut self.input);
            codes.clear();
        }
        self.codes = codes;
        has_some
    }

    /// Ticks the datapath at the world's edge, with changed inputs or with those of the tick before.
    #[inline(always)]
    fn tick<O: Observe>(&mut self, edge: u64, changes: bool, observer: &mut O) {
        (self.edge, self.turned) = (edge, changes);
        if changes {
            self.world.place(&mut self.input);
            self.wiring.take(&self.input);
        }
        let out = self.wiring.tick_again(&self.input);
        self.ticked(out, observer);
    }

    /// Passes ends of steps of the world before `limit`.
    #[inline(always)]
    fn glide<O: Observe>(&mut self, limit: u64, observer: &mut O) {
        let rows = &mut self.rows;
        self.world.glide(limit, |world, edge| rows.leave(world, edge, observer));
    }

    /// Moves the world to its next change, or to `limit`.
    #[inline(always)]
    fn advance<O: Observe>(&mut self, limit: u64, observer: &mut O) {
        let rows = &mut self.rows;
        self.world.advance(limit, |world, edge| rows.leave(world, edge, observer));
    }

    /// Moves the datapath, over repeated outputs, to the edge before the world's.
    fn pass(&mut self) {
        let Some(Repeated { repeat, .. }) = &self.repeated else { return };
        let edges = self.world.edge() - 1 - self.edge;
        self.wiring.skip_repeats(edges, &self.input);
        let Repeat { period, first, others, .. } = *repeat;
        let changes = edges / period + (edges + period - first) / period;
        (self.ticks, self.output_changes) = (self.ticks + changes, self.output_changes + changes);
        self.edge += edges;
        if edges % period >= first {
            self.out = others;
        }
    }

    /// Moves the world on under repeated outputs, up to `most` changes of either, and drives it with them. The datapath
    /// waits at the edge that began the repetition, until an input or another net changes or the world cruises. Returns
    /// the number of changes.
    #[inline(never)]
    fn switch<O: Observe>(&mut self, end: u64, most: u32, observer: &mut O) -> u32 {
        let mut events = 1;
        while self.switch_on(end, observer) && events < most {
            events += 1;
        }
        self.search.driven += events;
        events
    }

    /// Moves the world to its next change or to that of the outputs. Returns whether the datapath waits on.
    #[inline(always)]
    fn switch_on<O: Observe>(&mut self, end: u64, observer: &mut O) -> bool {
        let Some(Repeated { repeat, next, .. }) = &self.repeated else { return false };
        let due = self.edge.saturating_add(repeat.edges).saturating_add(1);
        let limit = due.min(*next).min(end);
        self.glide(limit, observer);
        self.advance(limit, observer);
        let edge = self.world.edge();
        let changes = !self.world.shows(&self.input);
        if changes || edge == due {
            self.come(edge - 1);
            self.tick(edge, changes, observer);
            return false;
        }
        let Some(Repeated { repeat, begin, next, .. }) = &mut self.repeated else { return false };
        if edge == *next {
            let begins = self.out == repeat.others;
            let (out, edges) =
                if begins { (*begin, repeat.first) } else { (repeat.others, repeat.period - repeat.first) };
            *next = edge.saturating_add(edges);
            (self.ticks, self.output_changes) = (self.ticks + 1, self.output_changes + 1);
            self.out = out;
            self.rows.drive(&mut self.world, out, self.wiring.words(), observer);
            if begins {
                let left = Repeat { edges: if due == u64::MAX { due } else { due - 1 - edge }, ..*repeat };
                if let Some(cruise) = self.world.foresee(&left) {
                    let next = *next;
                    self.come(edge);
                    self.repeated = Some(Repeated { repeat: left, begin: out, cruise: Some(cruise), next });
                    return false;
                }
            }
        }
        let ends = edge == end || self.world.over().is_some();
        if ends {
            self.meet();
        }
        !ends
    }

    /// Moves the datapath to the world's edge, if it waits while its outputs repeat.
    fn meet(&mut self) {
        if self.repeated.is_some() && self.edge < self.world.edge() {
            self.come(self.world.edge());
        }
    }

    /// Moves the datapath to an edge up to which its outputs repeat.
    fn come(&mut self, edge: u64) {
        let Some(Repeated { repeat, .. }) = self.repeated.take() else { return };
        let edges = edge - self.edge;
        if edges < repeat.first {
            self.wiring.skip(edges, &self.input);
        } else {
            self.wiring.skip_repeats(edges, &self.input);
        }
        self.edge = edge;
    }

    /// Takes the outputs of an edge that was ticked; `None` if they are those of the tick before. Returns whether they
    /// have changed.
    #[inline(always)]
    fn ticked<O: Observe>(&mut self, out: Option<E::Out>, observer: &mut O) -> bool {
        let words = self.wiring.words();
        self.ticks += 1;
        let out = out.filter(|out| *out != self.out);
        let changed = out.is_some();
        if let Some(out) = out {
            self.output_changes += 1;
            self.out = out;
        }
        if changed || !self.world.holds_outputs() {
            self.rows.drive(&mut self.world, self.out, words, observer);
        }
        observer.nets(Cycle(self.edge), words);
        if self.tells_overflows {
            observer.overflows(Cycle(self.edge), self.wiring.overflowing() | self.world.overflowing());
        }
        if self.search.tape.is_some() {
            self.note_nets();
        }
        if changed {
            self.look_ahead();
        }
        changed
    }

    /// Asks the wiring whether its outputs repeat and, if so, the world how far it can cruise on the repetition.
    #[inline(never)]
    fn look_ahead(&mut self) {
        if let Some(repeat) = self.wiring.repeats(&self.input) {
            let cruise = self.world.foresee(&repeat);
            self.repeated = Some(Repeated { begin: self.out, cruise, next: self.edge + repeat.first, repeat });
        }
    }
}

/// Returns the set of the nets that an observer of a run follows, a bit each; all bits if it must be shown every tick.
fn watched(nets: usize, observer: &impl Observe) -> u64 {
    if observer.watches_overflows() || nets > 64 || (0..nets).all(|net| observer.follows(net..net + 1)) {
        return u64::MAX;
    }
    (0..nets).filter(|&net| observer.follows(net..net + 1)).fold(0, |set, net| set | 1 << net)
}

/// Returns the indices of the nets that are outputs: they come after the inputs.
fn outputs(input: &impl Ports<i64>, out: &impl Ports<i64>) -> std::ops::Range<usize> {
    let (mut inputs, mut outputs) = (0, 0);
    input.each(|_| inputs += 1);
    out.each(|_| outputs += 1);
    inputs..inputs + outputs
}
