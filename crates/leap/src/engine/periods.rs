//! Macro-steps: jumps over whole periods of several edges.
//!
//! Where a prescaler lets a counter move at every tenth edge, or a divider clocks one, no register but the prescaler
//! moves at every edge, and no jump is longer than its period. The state then moves by lines *a period*: a register is
//! assumed to have moved by `slope k` after `k` periods. [`Leap::macro_step`] does the edges of one period as ordinary
//! ones, but with the lines of all words in `k` instead of words alone: the line of a word after an edge of the period
//! is what the word is after that edge of each later period. Where each register has, after the period, the line that
//! was assumed and moved by its slope, it follows by induction that it moves so for as many periods as the least
//! horizon tells; the outputs, asynchronous resets and clocks must rest at each edge of the period. Then all these
//! periods are one jump. A wrong assumption costs time, never a word: the edges of the period are done by then.
//!
//! The period is found as the distance at which the differences of the pending registers repeat.

use super::cluster::{Cluster, Movement};
use super::{Leap, STILL, keeps};
use crate::index_set::take_lowest;
use crate::line::{FOREVER, Line};
use crate::operation::{mask, signed};

/// Steps after which it is looked whether they were short, and the edges a step below which they are.
const LOOK: u64 = 256;
const SHORT: u64 = 32;
/// The edges in which a period is looked for, and the longest one.
const SEEN: usize = 256;
const LONGEST: usize = 64;
/// Edges between two searches that find a cluster after which it has lasted, and those for which no period is looked
/// for after jumps needed none.
pub(super) const LASTING: u64 = 1 << 14;
/// Edges of macro-steps without a jump after which another period is tried.
const CREDIT: u64 = 1024;
/// The most periods of ordinary steps behind an event.
const LONGEST_WAIT: u64 = 4;
/// The least and the most edges for which no period is looked for after none was found.
const SHORTEST_REST: u64 = 1 << 9;
const LONGEST_REST: u64 = 1 << 20;

/// The period of a simulation, and how it is found.
#[derive(Clone, Default)]
pub(super) struct Periods {
    /// The edges of a period; 0 if there is none.
    pub(super) period: u64,
    /// Whether it brings all words of the cluster that others see back to those of before.
    pub(super) is_periodic: bool,
    /// The slope of each register a period, and the difference over the period that was seen last.
    slopes: Vec<i64>,
    seen: Vec<u64>,
    /// A number for the differences of the pending registers at each edge, while a period is looked for.
    hashes: Vec<u64>,
    movements: Vec<Movement>,
    is_looking: bool,
    /// The edges that macro-steps may still take without a jump.
    credit: u64,
    /// The number of steps at which it is looked next, and what there was the last time: edges and steps.
    next: u64,
    before: (u64, u64),
    /// The edge up to which a jump over periods has ended with an event, so that ordinary steps follow; for how many
    /// periods they do, and whether no macro-step has followed them yet.
    event: u64,
    waits: u64,
    is_behind_event: bool,
    /// The edge at which a cluster was found last.
    found: u64,
    /// The edge up to which no period is looked for, and the rest after the next failure.
    until: u64,
    rest: u64,
    /// The least horizon of the macro-step, in periods, and the words with which it began.
    pub(super) bound: u64,
    begun: Vec<u64>,
}

impl Leap {
    /// Looks whether the steps were short, and begins to look for a period.
    #[inline(never)]
    pub(super) fn look_at_steps(&mut self) {
        let before = self.periods.before;
        let (edges, steps) = (self.share.edges - before.0, self.share.steps - before.1);
        self.leave_periods(0);
        self.periods.is_looking = edges < SHORT * steps && self.share.edges >= self.periods.until;
        self.periods.hashes.clear();
        self.periods.movements = vec![Movement::default(); self.flops.len()];
    }

    /// Leaves the period, if there is one. It is looked at the steps again after some more, and for a period after
    /// `rest` edges at the earliest.
    pub(super) fn leave_periods(&mut self, rest: u64) {
        let periods = &mut self.periods;
        periods.until = periods.until.max(self.share.edges + rest);
        (periods.period, periods.is_looking) = (0, false);
        (periods.next, periods.before) = (self.share.steps + LOOK, (self.share.edges, self.share.steps));
    }

    /// Returns whether the next step is one that [`other_step`](Self::other_step) makes.
    #[inline]
    pub(super) fn is_other(&self) -> bool {
        self.periods.period > 0 || self.periods.is_looking || self.share.steps >= self.periods.next
    }

    /// Makes a step of at most `most` edges in which a period is looked for or leapt over. Returns the number of edges;
    /// none where an ordinary step is to follow.
    pub(super) fn other_step(&mut self, most: u64, asked: usize) -> u64 {
        if self.periods.is_looking {
            let mut hash = 1u64;
            for at in self.pending.iter() {
                let flop = &self.flops[at];
                let [next, word] = [flop.data, flop.output].map(|net| self.lines[net as usize].word);
                let difference = next.wrapping_sub(word) & mask(flop.width);
                self.periods.movements[at].note(self.share.edges, difference);
                hash ^= (at as u64) << 32 ^ difference;
                hash = hash.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
            }
            self.periods.hashes.push(hash);
            self.edge();
            if self.periods.hashes.len() == SEEN {
                let movements = std::mem::take(&mut self.periods.movements);
                if self.find_cluster(&movements) {
                    // One that is thawed again and again is no gain.
                    if self.share.edges - self.periods.found > LASTING {
                        self.periods.rest = 0;
                    }
                    self.periods.found = self.share.edges;
                    self.rest_from_periods();
                    self.leave_periods(0);
                } else {
                    self.find_period();
                }
            }
            self.share.edges += 1;
            self.share.steps += 1;
            return 1;
        }
        let period = self.periods.period;
        if period == 0 {
            self.look_at_steps();
        }
        if period == 0 || self.news.meets(&self.ranks[asked]) {
            return 0;
        }
        if self.share.edges < self.periods.event {
            // Where no register is pending, nothing changes before the cluster's words do.
            let rests = if self.pending.is_empty() { self.until_cluster().min(most) } else { 0 };
            if rests > 1 {
                self.move_cluster::<false>(rests - 1);
                self.edge();
                self.share.edges += rests;
                self.share.leapt += rests;
                self.share.steps += 1;
            }
            return if rests > 1 { rests } else { 0 };
        }
        if most < 2 * period || asked > STILL {
            return 0;
        }
        self.macro_step(most, asked)
    }

    /// Finds the period with which the differences of the last edges repeat. One of a single edge may be several of a
    /// register that has one bit.
    fn find_period(&mut self) {
        let periods = &mut self.periods;
        periods.is_looking = false;
        let repeats = |period: &usize| {
            let last = &periods.hashes[SEEN - 4 * (*period).max(8)..];
            last[*period..].iter().zip(last).all(|(now, before)| now == before)
        };
        match (1..=LONGEST).find(repeats) {
            Some(period) => self.begin_period(period.max(2) as u64),
            None => self.rest_from_periods(),
        }
    }

    fn begin_period(&mut self, period: u64) {
        let periods = &mut self.periods;
        (periods.period, periods.credit, periods.waits) = (period, CREDIT, 1);
        periods.slopes = vec![0; self.flops.len()];
        (periods.seen, periods.begun) = (vec![0; self.flops.len()], vec![0; self.flops.len()]);
    }

    /// Gives periods up for a time, which doubles.
    fn rest_from_periods(&mut self) {
        let periods = &mut self.periods;
        periods.period = 0;
        periods.rest = (2 * periods.rest).clamp(SHORTEST_REST, LONGEST_REST);
        periods.until = self.share.edges + periods.rest;
    }

    /// Makes the edges of a period, and leaps over further ones where that is proved.
    fn macro_step(&mut self, most: u64, asked: usize) -> u64 {
        let period = self.periods.period;
        if std::mem::take(&mut self.has_lines) {
            self.rest_lines();
        }
        self.periods.bound = FOREVER;
        let registers = self.flops.iter().zip(&mut self.periods.slopes).zip(&mut self.periods.begun);
        for (at, ((flop, slope), begun)) in registers.enumerate() {
            let line = &mut self.lines[flop.output as usize];
            *begun = line.word;
            if *slope != 0 {
                line.slope = *slope;
                self.marked.insert(self.steps.len() + at);
                self.users.mark(flop.output, &mut self.marked);
            }
        }
        // A register does not move while it is reset.
        for (at, net, active, _) in &self.resets {
            if self.lines[*net as usize].word == *active && self.periods.slopes[*at as usize] != 0 {
                self.periods.bound = 1;
            }
        }
        // Where no register is pending, nothing changes before the cluster's words do. The words of these edges are in
        // later periods those behind the last edge of the period before, so those have the lines.
        self.periods.is_periodic = self.is_periodic();
        let waits = self.periods.is_periodic && self.pending.is_empty();
        let mut edges = if waits { self.until_cluster().min(period) } else { 0 };
        let (mut steps, mut moves) = (u64::from(waits), false);
        self.move_cluster::<true>(edges);
        self.settle::<true>(asked);
        while edges < period && !self.news.meets(&self.ranks[asked]) {
            let (flops, lines) = (&self.flops, &self.lines);
            self.taken.extend(self.pending.iter().map(|at| (at as u32, lines[flops[at].data as usize])));
            moves |= !self.taken.is_empty();
            let rests = if self.taken.is_empty() && self.periods.is_periodic {
                self.until_cluster().min(period - edges)
            } else {
                1
            };
            self.move_cluster::<true>(rests);
            self.give::<true>();
            self.settle::<true>(asked);
            (edges, steps) = (edges + rests, steps + 1);
        }
        let is_whole = edges == period && !self.news.meets(&self.ranks[asked]);
        for at in self.pending.iter().filter(|_| waits) {
            let [data, own] = [self.flops[at].data, self.flops[at].output].map(|net| self.lines[net as usize]);
            let is_same = (data.word, data.slope) == (own.word, own.slope);
            let bound = if is_same { data.horizon.min(own.horizon) } else { 1 };
            self.periods.bound = self.periods.bound.min(bound);
        }
        let jump = if is_whole { self.proved().min((most - period) / period) } else { 0 };
        self.leap_periods(jump);
        let leapt = jump * period;
        self.share.edges += edges + leapt;
        // What an event sets off may take several periods: a macro-step within them would be in vain.
        if std::mem::take(&mut self.periods.is_behind_event) && leapt == 0 && self.periods.waits < LONGEST_WAIT {
            self.periods.waits += 1;
        }
        if leapt > 0 && leapt + 2 * period <= most {
            self.periods.event = self.share.edges + self.periods.waits * period;
            self.periods.is_behind_event = true;
        }
        self.share.leapt += leapt;
        self.share.steps += steps;
        // Where the cluster alone moves, plain jumps reach as far.
        if moves {
            self.pay(edges, leapt)
        } else {
            self.rest_from_periods()
        }
        edges + leapt
    }

    /// Leaps over periods from the lines of a macro-step on, and lets all words rest. As in a jump over edges, a word
    /// with a longer horizon is on its line; others that were evaluated in the macro-step are evaluated.
    fn leap_periods(&mut self, jump: u64) {
        self.move_cluster::<false>(jump * self.periods.period);
        let lines = &mut self.lines;
        for net in self.cluster.iter().flat_map(Cluster::seen) {
            lines[net as usize].horizon = FOREVER;
        }
        for (flop, slope) in self.flops.iter().zip(&self.periods.slopes) {
            let line = &mut lines[flop.output as usize];
            let moved = jump.wrapping_mul(slope.cast_unsigned());
            *line = Line::still(line.word.wrapping_add(moved) & mask(flop.width));
        }
        let flops = self.steps.len();
        for part in 0..self.touched.parts() {
            let mut left = self.touched.take(part);
            while let Some(mark) = take_lowest(&mut left, part) {
                if let Some(step) = self.steps.get(mark) {
                    let line = lines[step.output as usize];
                    let word = match line.horizon > jump {
                        true => line.after(jump, step.widths.result),
                        false => step.word(lines),
                    };
                    lines[step.output as usize] = Line::still(word);
                } else if let Some(flop) = self.flops.get(mark - flops) {
                    let is_pending = lines[flop.data as usize].word != lines[flop.output as usize].word;
                    self.pending.set(mark - flops, is_pending);
                } else {
                    self.marked.insert(mark);
                }
            }
        }
        self.settle::<false>(0);
    }

    /// Returns for how many periods after the one that is done all registers certainly move by their slopes. Learns the
    /// slopes from two periods with one difference.
    fn proved(&mut self) -> u64 {
        let Periods { slopes, seen, begun, bound, .. } = &mut self.periods;
        let mut least = *bound;
        let registers = self.flops.iter().zip(slopes).zip(seen).zip(begun);
        for (at, (((flop, slope), seen), begun)) in registers.enumerate() {
            let line = self.lines[flop.output as usize];
            let is_resting = line == Line::still(*begun) && *slope == 0;
            if is_resting || self.frozen.contains(self.steps.len() + at) {
                *seen = 0;
                continue;
            }
            let difference = line.word.wrapping_sub(*begun) & mask(flop.width);
            let is_it = difference == slope.cast_unsigned() & mask(flop.width);
            least = least.min(if is_it { keeps(line, *slope) } else { 1 });
            if std::mem::replace(seen, difference) == difference {
                *slope = signed(difference, flop.width);
            }
        }
        least.saturating_sub(1)
    }

    /// Takes macro-steps without jumps from the credit, and tries a longer period or none once it is used up.
    fn pay(&mut self, edges: u64, leapt: u64) {
        let periods = &mut self.periods;
        if leapt >= 8 * edges {
            (periods.credit, periods.rest) = (CREDIT, 0);
        } else if let Some(left) = periods.credit.checked_sub(edges) {
            periods.credit = left;
        } else if 2 * periods.period <= LONGEST as u64 {
            self.begin_period(2 * self.periods.period);
        } else {
            self.rest_from_periods();
        }
    }

    /// Lets all words rest for ever.
    pub(super) fn rest_lines(&mut self) {
        for line in &mut self.lines {
            (line.slope, line.horizon) = (0, FOREVER);
        }
    }
}
