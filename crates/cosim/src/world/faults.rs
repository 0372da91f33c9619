//! Faults between device and logic: wrong levels of the encoder's lines, and switches that do not follow their gates.
//!
//! The device moves as it is driven, and the encoder counts as it moves. The lines show that count with errors:
//! displaced by edges that were missed or doubled, shaken by bounce, held by a late clock, one line inverted, or both
//! exchanged. All faults happen at clock edges, on which the world stops as on any other change, so that every driver
//! sees the same.
//!
//! A clock that jitters comes up to `J` before its ideal edge, evenly spread. An edge of the encoder falls at any time
//! of the period `T` before; it is then seen one clock later with probability `J / 2T`. The gates switch on ideal
//! edges.

use std::collections::BTreeMap;

use hpu_datapath::LoopOut;
use hpu_signal::Clock;

use crate::result::summary::Mark;
use crate::world::encoder::Pins;
use hpu_scene::SplitMix64;
use hpu_scene::{EncoderLine, Faults, Run, Stuck, Switch, Times};

/// The faults of a scene, on clock edges.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct FaultPlan {
    /// Faults that wait for an edge of the encoder, in order, each with the clock edge from which it waits.
    at_edges: Vec<(u64, AtEdge)>,
    /// Faults at clock edges, in order.
    timed: Vec<(u64, Action)>,
    doubled_clocks: u64,
    bounces: u64,
    bounce_clocks: u64,
    glitch_clocks: u64,
    lost_index: bool,
    stuck: Option<(Switch, bool)>,
    /// Probability, in 2^-32, that an edge of the encoder is seen one clock late.
    late: u64,
    seed: u64,
}

/// A fault of one edge of the encoder.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum AtEdge {
    Missed,
    Doubled,
    Bounce,
}

/// A change at a clock edge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Action {
    /// Displaces the lines by this number of counts in addition, for good.
    Displace(i64),
    /// Displaces the lines by this number of counts for a while.
    Shake(i64),
    /// Ends `Shake` and a late clock's hold: the lines show the count again.
    Release,
    /// Inverts a line for some clocks, or ends that.
    Glitch(EncoderLine, bool),
    Swap,
    Invert(EncoderLine),
    LoseIndex,
    /// Lets the switch stick, or follow its gate again.
    Stick(bool),
}

impl FaultPlan {
    /// Creates the faults of a scene that runs for `edges` clock edges.
    pub(crate) fn new(faults: &Faults, clock: Clock, run: Run, edges: u64) -> Self {
        let at = |seconds: f64| clock.edges(seconds).max(1);
        // Each kind has its own random times: a greater number of one kind keeps the times there were and adds others.
        let times = |times: &Times, kind: u64| match times {
            Times::At(all) => all.iter().map(|&seconds| at(seconds)).collect::<Vec<_>>(),
            Times::Random(count) => {
                let mut random = SplitMix64::new(run.seed.wrapping_mul(8).wrapping_add(kind));
                (0..*count).map(|_| 1 + random.below(edges.max(1))).collect()
            }
        };
        let kinds = [
            (&faults.missed_edge, AtEdge::Missed),
            (&faults.doubled_edge, AtEdge::Doubled),
            (&faults.bounce, AtEdge::Bounce),
        ];
        let mut at_edges: Vec<_> = (0..)
            .zip(kinds)
            .flat_map(|(kind, (all, what))| times(all, kind).into_iter().map(move |edge| (edge, what)))
            .collect();
        at_edges.sort_by_key(|(edge, _)| *edge);
        let line = faults.glitch_line;
        let mut timed: Vec<_> =
            times(&faults.glitch, 3).into_iter().map(|edge| (edge, Action::Glitch(line, true))).collect();
        timed.extend(faults.swapped_from_s.map(|from| (at(from), Action::Swap)));
        timed.extend(faults.inverted.map(|(line, from)| (at(from), Action::Invert(line))));
        timed.extend(faults.lost_index.then_some((1, Action::LoseIndex)));
        if let Some(Stuck { from_s, to_s, .. }) = faults.stuck {
            timed.push((at(from_s), Action::Stick(true)));
            timed.extend(to_s.map(|to| (at(to), Action::Stick(false))));
        }
        timed.sort_by_key(|(edge, _)| *edge);
        Self {
            at_edges,
            timed,
            doubled_clocks: faults.doubled_clocks,
            bounces: faults.bounces,
            bounce_clocks: faults.bounce_clocks,
            glitch_clocks: faults.glitch_clocks,
            lost_index: faults.lost_index,
            stuck: faults.stuck.map(|stuck| (stuck.switch, stuck.closed)),
            late: (faults.jitter_s / clock.period_s() / 2.0 * 2f64.powi(32)) as u64,
            seed: run.seed,
        }
    }
}

/// The state of a scene's faults.
#[derive(Clone)]
pub(crate) struct FaultState<'p> {
    plan: &'p FaultPlan,
    /// Indices of the next entries in the plan's two lists.
    next_at_edge: usize,
    next_timed: usize,
    /// Changes that faults already begun still have to make, by their clock edges.
    begun: BTreeMap<u64, Vec<Action>>,
    displaced: i64,
    shaken: i64,
    /// The count that a late clock still sees.
    held: Option<i64>,
    /// Whether lines A and B are inverted now: by a glitch, and for good.
    glitched: [bool; 2],
    inverted: [bool; 2],
    swapped: bool,
    is_stuck: bool,
    is_short: bool,
    random: SplitMix64,
    marks: Vec<Mark>,
}

impl<'p> FaultState<'p> {
    pub(crate) fn new(plan: &'p FaultPlan) -> Self {
        Self {
            plan,
            next_at_edge: 0,
            next_timed: 0,
            begun: BTreeMap::new(),
            displaced: 0,
            shaken: 0,
            held: None,
            glitched: [false; 2],
            inverted: [false; 2],
            swapped: false,
            is_stuck: false,
            is_short: false,
            random: SplitMix64::new(plan.seed.wrapping_mul(8).wrapping_add(7)),
            marks: Vec::new(),
        }
    }

    /// Returns the clock edge at which something happens next.
    pub(crate) fn next(&self) -> Option<u64> {
        let timed = self.plan.timed.get(self.next_timed).map(|(edge, _)| *edge);
        timed.into_iter().chain(self.begun.keys().next().copied()).min()
    }

    /// Returns the faults so far.
    pub(crate) fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// Returns how many faults still wait for an edge of the encoder.
    pub(crate) fn waiting(&self) -> u64 {
        (self.plan.at_edges.len() - self.next_at_edge) as u64
    }

    fn mark(&mut self, edge: u64, what: &'static str) {
        self.marks.push(Mark { edge, what });
    }

    fn later(&mut self, edge: u64, action: Action) {
        self.begun.entry(edge).or_default().push(action);
    }

    /// Tells the faults that the encoder's count has changed at an edge.
    pub(crate) fn moved(&mut self, edge: u64, from: i64, to: i64) {
        let way = (to - from).signum();
        if let Some(&(_, what)) = self.plan.at_edges.get(self.next_at_edge).filter(|(due, _)| *due <= edge) {
            self.next_at_edge += 1;
            match what {
                AtEdge::Missed => {
                    self.mark(edge, "missed_edge");
                    self.displaced -= way;
                }
                AtEdge::Doubled => {
                    self.mark(edge, "doubled_edge");
                    self.later(edge + self.plan.doubled_clocks, Action::Displace(way));
                }
                AtEdge::Bounce => {
                    self.mark(edge, "bounce");
                    let mut at = edge;
                    for turn in 0..2 * self.plan.bounces {
                        at += 1 + self.random.below(self.plan.bounce_clocks);
                        self.later(at, Action::Shake(if turn % 2 == 0 { -way } else { 0 }));
                    }
                }
            }
        }
        if self.plan.late > 0 && self.random.below(1 << 32) < self.plan.late {
            self.mark(edge, "clock_jitter");
            self.held = Some(from);
            self.later(edge + 1, Action::Release);
        }
    }

    /// Carries out what is due up to an edge. Returns whether the switches have changed.
    pub(crate) fn happen(&mut self, edge: u64) -> bool {
        let before = self.is_stuck;
        while let Some(&(at, action)) = self.plan.timed.get(self.next_timed).filter(|(at, _)| *at <= edge) {
            self.next_timed += 1;
            self.act(at, action);
        }
        while let Some(entry) = self.begun.first_entry().filter(|entry| *entry.key() <= edge) {
            let (at, actions) = entry.remove_entry();
            actions.into_iter().for_each(|action| self.act(at, action));
        }
        self.is_stuck != before
    }

    fn act(&mut self, edge: u64, action: Action) {
        match action {
            Action::Displace(counts) => self.displaced += counts,
            Action::Shake(counts) => self.shaken = counts,
            Action::Release => self.held = None,
            Action::Glitch(line, begins) => {
                self.glitched[line as usize] = begins;
                if begins {
                    self.mark(edge, "glitch");
                    self.later(edge + self.plan.glitch_clocks, Action::Glitch(line, false));
                }
            }
            Action::Swap => {
                self.mark(edge, "swapped");
                self.swapped = true;
            }
            Action::Invert(line) => {
                self.mark(edge, "inverted");
                self.inverted[line as usize] = true;
            }
            Action::LoseIndex => self.mark(edge, "lost_index"),
            Action::Stick(begins) => {
                if begins {
                    self.mark(edge, "stuck_switch");
                }
                self.is_stuck = begins;
            }
        }
    }

    /// Returns the count that the lines show.
    pub(crate) fn count(&self, count: i64) -> i64 {
        self.held.unwrap_or(count) + self.displaced + self.shaken
    }

    /// Returns the levels of the lines.
    pub(crate) fn pins(&self, count: i64) -> Pins {
        let Pins { a, b } = Pins::at(self.count(count));
        let is_other = |line: usize| i64::from(self.glitched[line] != self.inverted[line]);
        let (a, b) = (a ^ is_other(0), b ^ is_other(1));
        if self.swapped { Pins { a: b, b: a } } else { Pins { a, b } }
    }

    /// Returns whether the index pulse works.
    pub(crate) fn has_index(&self) -> bool {
        !self.plan.lost_index
    }

    /// Returns the levels that the switches follow, given the outputs of the logic.
    pub(crate) fn drive(&mut self, mut out: LoopOut<i64>) -> LoopOut<i64> {
        if let (Some((switch, closed)), true) = (self.plan.stuck, self.is_stuck) {
            // Leg A of the wirings hangs on the motor's minus terminal.
            let (stuck, other) = match switch {
                Switch::PlusHigh => (&mut out.b_high, out.b_low),
                Switch::PlusLow => (&mut out.b_low, out.b_high),
                Switch::MinusHigh => (&mut out.a_high, out.a_low),
                Switch::MinusLow => (&mut out.a_low, out.a_high),
            };
            // If both switches of a leg are closed, the run ends; until then the leg counts as open.
            self.is_short |= closed && other != 0;
            *stuck = i64::from(closed && other == 0);
        }
        out
    }

    /// Returns whether a switch may at some time not follow its gate.
    pub(crate) fn may_stick(&self) -> bool {
        self.plan.stuck.is_some()
    }

    /// Returns why the run cannot go on, or `None` if it can.
    pub(crate) fn over(&self) -> Option<&'static str> {
        self.is_short.then_some("a switch that is stuck and the other one of its leg short the supply")
    }
}
