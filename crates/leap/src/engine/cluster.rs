//! Clusters: registers whose next words depend on no others but on words that rest, such as a prescaler, a divider or a
//! generator of random bits.
//!
//! While those words rest, each word of a cluster runs through an orbit of its own, which is made once by ordinary
//! steps: registers and cells are then *frozen*, and their words are those of the orbits. The rest of the design sees
//! words of the cluster only that a cell, a register or an output outside takes. Each of these is still until the edge
//! at which the orbit changes it, so this is its horizon, whatever the cluster does. A cluster that matters to nobody
//! now bounds no jump: the rules of cells that it does not reach now take no horizon of its words.
//!
//! A word from outside that a frozen cell takes and that changes marks the cell. The cluster is thawed before anything
//! frozen is evaluated: its registers have the words of now, and all of its cells are evaluated.

use super::{Leap, Line};
use crate::index_set::{IndexSet, take_lowest};
use crate::line::FOREVER;

/// The longest orbit.
const LONGEST: usize = 4096;
/// A register that moves by one difference at equal distances, but where it wraps, is a counter. A longer orbit of one
/// is frozen only if each word that others see changes at most [`RARE`] times at so many edges: a line may tell more of
/// it.
const SHORT: usize = 64;
const RARE: usize = 2;
/// The most cells that are evaluated to find orbits.
const WORK: usize = 1 << 16;

/// A word of a cluster.
#[derive(Clone)]
struct Orbit {
    net: u32,
    /// The words from the edge on at which it was frozen, and the edges until the word changes next.
    words: Vec<(u64, u64)>,
    /// The edge at which it changes next.
    next: u64,
}

impl Orbit {
    #[inline]
    fn at(&self, edge: u64) -> (u64, u64) {
        self.words[(edge % self.words.len() as u64) as usize]
    }

    /// Returns a number of periods for which the word is certainly that of now at this edge of each.
    fn returns(&self, edge: u64, period: u64) -> u64 {
        let length = self.words.len() as u64;
        let (word, mut until) = self.at(edge);
        let mut periods = 0u64;
        for _ in 0..LOOKS {
            periods += until.div_ceil(period);
            // The product is a multiple of both.
            if period.is_multiple_of(length) || periods >= length {
                return FOREVER;
            }
            let then = self.at(edge + periods * period);
            if then.0 != word {
                break;
            }
            until = then.1;
        }
        periods
    }
}

/// How often it is looked for the period in which a word of a cluster changes.
const LOOKS: u32 = 16;

/// Clusters, since they were frozen.
#[derive(Clone, Default)]
pub(super) struct Cluster {
    /// The words that others see, and those of registers that only the cluster sees. The latter are stored when the
    /// cluster is thawed.
    seen: Vec<Orbit>,
    hidden: Vec<Orbit>,
    /// The edges since then, and the edge at which a word that others see changes next.
    edge: u64,
    next: u64,
}

impl Cluster {
    /// Returns the words that others see.
    pub(super) fn seen(&self) -> impl Iterator<Item = u32> + '_ {
        self.seen.iter().map(|orbit| orbit.net)
    }

    /// Returns the words of now of registers that only the cluster sees.
    pub(super) fn hidden(&self) -> impl Iterator<Item = (u32, u64)> + '_ {
        self.hidden.iter().map(|orbit| (orbit.net, orbit.at(self.edge).0))
    }
}

/// Thaws a cluster: registers that only it sees have their words of now, and all of its cells are marked.
pub(super) fn thaw(of: &mut Option<Cluster>, lines: &mut [Line], marked: &mut IndexSet, frozen: &mut IndexSet) {
    of.take().iter().flat_map(Cluster::hidden).for_each(|(net, word)| lines[net as usize].word = word);
    marked.extend(frozen);
    *frozen = IndexSet::new(64 * marked.parts());
}

/// Cells that depend on words of the cluster and on no mover. While nothing else changes their words rest, each until
/// an edge since the cluster was frozen. So the rules of [`Operation::line`](crate::Operation::line), of words without
/// a slope, hold for these edges as for horizons, and have to be used again only where an operand has changed or is
/// still until another edge: such cells are stale.
#[derive(Clone, Default)]
pub(super) struct Steady {
    pub(super) cells: IndexSet,
    /// The words that are seen by cells that depend on movers, by movers, and as outputs.
    pub(super) seen: Vec<u32>,
    /// The data of other registers, resets and clocks that the design makes, and the edge up to which all of them rest.
    pub(super) ends: Vec<u32>,
    next: u64,
    is_new: bool,
    /// The edge until which each word rests.
    until: Vec<u64>,
}

impl Steady {
    pub(super) fn new(marks: usize, nets: usize) -> Self {
        let (cells, until) = (IndexSet::new(marks), vec![FOREVER; nets]);
        Self { cells, until, is_new: true, ..Self::default() }
    }
}

/// The movements of a register at the edges at which clusters are looked for.
#[derive(Clone, Copy, Default)]
pub(super) struct Movement {
    difference: u64,
    last: u64,
    distance: u64,
    /// How often it has moved, and how often by another difference, or after another distance, than the time before.
    count: u64,
    turns: u64,
}

impl Movement {
    /// Notes that a register moves at an edge.
    pub(super) fn note(&mut self, edge: u64, difference: u64) {
        let turns =
            self.count > 0 && self.difference != difference || self.count > 1 && self.distance != edge - self.last;
        self.turns += u64::from(turns);
        *self = Self { difference, distance: edge - self.last, last: edge, count: self.count + 1, ..*self };
    }

    /// Returns whether it moves as a counter does. A counter turns twice where it wraps.
    fn is_counter(&self) -> bool {
        self.turns <= 2 + self.count / 16
    }
}

impl Leap {
    /// Moves the cluster on by so many edges; in a macro-step its words have horizons in periods. Marks the users of
    /// words that have changed.
    #[inline]
    pub(super) fn move_cluster<const PERIOD: bool>(&mut self, edges: u64) {
        let Some(cluster) = &mut self.cluster else { return };
        cluster.edge += edges;
        let is_still = !PERIOD || self.periods.is_periodic;
        if is_still && cluster.edge < cluster.next {
            return;
        }
        cluster.next = u64::MAX;
        for orbit in &mut cluster.seen {
            if !is_still || cluster.edge >= orbit.next {
                let (word, until) = orbit.at(cluster.edge);
                orbit.next = cluster.edge + until;
                let horizon = if is_still { FOREVER } else { orbit.returns(cluster.edge, self.periods.period) };
                let made = Line { word, slope: 0, horizon };
                let line = &mut self.lines[orbit.net as usize];
                if super::differ::<PERIOD>(*line, made) {
                    *line = made;
                    self.users.mark_but(orbit.net, &self.frozen, &mut self.marked);
                }
            }
            cluster.next = cluster.next.min(orbit.next);
        }
    }

    /// Returns the number of edges for which all ends that depend on the cluster and on no mover rest, and gives words
    /// that depend on no mover and that others see their horizons.
    #[inline]
    pub(super) fn steady_horizon(&mut self) -> u64 {
        let Some(cluster) = &self.cluster else { return FOREVER };
        let (steady, lines) = (&mut self.cone.steady, &mut self.lines);
        for orbit in &cluster.seen {
            let until = &mut steady.until[orbit.net as usize];
            if std::mem::replace(until, orbit.next) != orbit.next {
                self.users.mark(orbit.net, &mut self.stale);
                steady.is_new = true;
            }
        }
        let mut is_new = steady.is_new;
        for part in 0..self.stale.parts() {
            let cells = steady.cells.part(part);
            let mut left = self.stale.take(part) & cells;
            is_new |= left != 0;
            while let Some(mark) = take_lowest(&mut left, part) {
                let step = &self.steps[mark];
                let operand = |at: usize| {
                    let net = step.operands[at] as usize;
                    Line { word: lines[net].word, slope: 0, horizon: steady.until[net] }
                };
                let Line { horizon, .. } =
                    step.operation.line_of(step.widths, lines[step.output as usize].word, operand);
                if std::mem::replace(&mut steady.until[step.output as usize], horizon) != horizon {
                    self.users.mark_range(step.users, &mut self.stale);
                    left |= self.stale.take(part) & cells;
                }
            }
        }
        if is_new {
            steady.next = steady.ends.iter().map(|net| steady.until[*net as usize]).min().unwrap_or(FOREVER);
            steady.is_new = false;
        }
        for net in &steady.seen {
            lines[*net as usize].horizon = steady.until[*net as usize] - cluster.edge;
        }
        steady.next - cluster.edge
    }

    /// Returns the number of edges until a word of the cluster that others see changes.
    #[inline]
    pub(super) fn until_cluster(&self) -> u64 {
        self.cluster.as_ref().map_or(FOREVER, |cluster| cluster.next - cluster.edge)
    }

    /// Returns whether a period brings all words of the cluster that others see back to those of now.
    #[inline]
    pub(super) fn is_periodic(&self) -> bool {
        let period = self.periods.period as usize;
        self.cluster.iter().flat_map(|cluster| &cluster.seen).all(|orbit| period.is_multiple_of(orbit.words.len()))
    }

    /// Thaws the cluster if one of its cells or registers takes a word that may move in a jump.
    pub(super) fn thaw_if(&mut self, moves: impl Fn(u32) -> bool) {
        let is_moved = |mark: usize| match self.steps.get(mark) {
            Some(step) => step.operands.iter().any(|net| moves(*net)),
            None => moves(self.flops[mark - self.steps.len()].data),
        };
        if self.frozen.iter().any(is_moved) {
            self.marked.extend(&self.frozen);
            self.settle::<false>(0);
            self.is_thawed = false;
        }
    }

    /// Looks for clusters among the registers that have moved, and freezes them. Returns whether there are some.
    #[inline(never)]
    pub(super) fn find_cluster(&mut self, movements: &[Movement]) -> bool {
        let active: Vec<_> = (0..self.flops.len()).filter(|at| movements[*at].count > 0).collect();
        if active.is_empty() || active.len() > 64 || self.cluster.is_some() {
            return false;
        }
        // The active registers on which each word depends.
        let mut on = vec![0u64; self.lines.len()];
        active.iter().enumerate().for_each(|(bit, at)| on[self.flops[*at].output as usize] = 1 << bit);
        for step in &self.steps {
            on[step.output as usize] = step.operands.iter().fold(0, |all, net| all | on[*net as usize]);
        }
        let closure = |bit: usize| {
            let (mut all, mut before) = (1u64 << bit, 0);
            while all != before {
                before = all;
                for (other, at) in active.iter().enumerate().filter(|(other, _)| before >> other & 1 != 0) {
                    all |= on[self.flops[*at].data as usize] | 1 << other;
                }
            }
            all
        };
        let mut closures: Vec<_> = (0..active.len()).map(closure).collect();
        closures.sort_by_key(|all| all.count_ones());
        closures.dedup();
        let (mut frozen, mut all, mut work) = (IndexSet::new(64 * self.marked.parts()), 0, WORK);
        let mut orbits = Vec::new();
        for closure in closures {
            let of = || (0..active.len()).filter(|bit| closure >> bit & 1 != 0);
            let is_counter = of().any(|bit| movements[active[bit]].is_counter());
            let flops: Vec<_> = of().map(|bit| active[bit]).collect();
            if closure & !all != 0
                && let Some(made) = self.orbits((&flops, is_counter), &on, &mut frozen, &mut work)
            {
                all |= closure;
                orbits.extend(made);
            }
        }
        for (_, at) in active.iter().enumerate().filter(|(bit, _)| all >> bit & 1 != 0) {
            self.pending.set(*at, false);
            self.movers.set(*at, false);
            self.flops[*at].steady = 0;
        }
        if all == 0 {
            return false;
        }
        let (seen, hidden): (Vec<_>, Vec<_>) =
            orbits.into_iter().partition(|orbit| self.users.any_but(orbit.net, &frozen));
        let next = seen.iter().map(|orbit| orbit.next).min().unwrap_or(FOREVER);
        (self.cluster, self.frozen) = (Some(Cluster { seen, hidden, edge: 0, next }), frozen);
        self.find_cone();
        self.cluster.is_some()
    }

    /// Returns the orbits of registers, and of cells that depend on nothing else that moves, as far as no other orbit
    /// has them and others see them, and freezes all of them; `None` if the registers do not come back to their words
    /// of now after at most [`LONGEST`] edges. `on` has the active registers on which each word depends; `work` is the
    /// number of cells that may be evaluated.
    fn orbits(
        &self,
        (flops, is_counter): (&[usize], bool),
        on: &[u64],
        frozen: &mut IndexSet,
        work: &mut usize,
    ) -> Option<Vec<Orbit>> {
        // An asynchronous reset by the cluster itself would thaw it again and again.
        if self.resets.iter().any(|(at, net, ..)| flops.contains(&(*at as usize)) && on[*net as usize] != 0) {
            return None;
        }
        // Constants, and what the data of its registers need. The cells are in topological order.
        let mut needed = vec![true; self.lines.len()];
        let made = self.steps.iter().map(|step| step.output).chain(self.flops.iter().map(|flop| flop.output));
        made.chain(self.inputs.iter().map(|input| input.0)).for_each(|net| needed[net as usize] = false);
        flops.iter().for_each(|at| needed[self.flops[*at].data as usize] = true);
        flops.iter().for_each(|at| needed[self.flops[*at].output as usize] = true);
        for step in self.steps.iter().rev().filter(|step| on[step.output as usize] != 0) {
            if needed[step.output as usize] {
                step.operands.iter().for_each(|net| needed[*net as usize] = true);
            }
        }
        let (mut both, mut cells) = (frozen.clone(), Vec::new());
        flops.iter().for_each(|at| both.insert(self.steps.len() + at));
        for (at, step) in self.steps.iter().enumerate() {
            // `needed` has the words at rest, and from here on the words of the cluster.
            let is_own = step.operands.iter().all(|net| needed[*net as usize]);
            if on[step.output as usize] != 0 && (needed[step.output as usize] || is_own) {
                needed[step.output as usize] = true;
                both.insert(at);
                cells.push(at);
            }
        }
        let is_seen = |net: u32| self.users.any_but(net, &both);
        let registers = flops.iter().filter(|at| !frozen.contains(self.steps.len() + **at));
        let registers = registers.map(|at| self.flops[*at].output);
        let others = cells.iter().filter(|at| !frozen.contains(**at)).map(|at| self.steps[*at].output);
        let orbit = |net| Orbit { net, words: Vec::new(), next: 0 };
        let mut orbits: Vec<_> = registers.chain(others.filter(|net| is_seen(*net))).map(orbit).collect();
        let mut words: Vec<_> = self.lines.iter().map(|line| line.word).collect();
        for states in 1.. {
            for orbit in &mut orbits {
                orbit.words.push((words[orbit.net as usize], FOREVER));
            }
            let next: Vec<_> = flops.iter().map(|at| words[self.flops[*at].data as usize]).collect();
            flops.iter().zip(next).for_each(|(at, word)| words[self.flops[*at].output as usize] = word);
            if flops.iter().map(|at| self.flops[*at].output as usize).all(|net| words[net] == self.lines[net].word) {
                break;
            }
            *work = work.checked_sub(cells.len())?;
            let changes = |orbit: &Orbit| orbit.words.windows(2).filter(|two| two[0].0 != two[1].0).count();
            let is_often = |orbit: &Orbit| is_seen(orbit.net) && changes(orbit) > RARE;
            if states == LONGEST || states == SHORT && is_counter && orbits.iter().any(is_often) {
                return None;
            }
            for at in &cells {
                let step = &self.steps[*at];
                words[step.output as usize] =
                    step.operation.word_of(step.widths, |at| words[step.operands[at] as usize]);
            }
        }
        // Twice around, from the last state on: the second time it is known when each word changes.
        for Orbit { words, next, .. } in &mut orbits {
            for at in (0..2 * words.len()).rev() {
                let (this, (then, after)) = (at % words.len(), words[(at + 1) % words.len()]);
                words[this].1 = if words[this].0 == then { (after + 1).min(FOREVER) } else { 1 };
            }
            *next = words[0].1;
        }
        *frozen = both;
        Some(orbits)
    }
}
