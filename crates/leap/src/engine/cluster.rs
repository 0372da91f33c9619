//! Clusters: registers whose next words depend on no others but on words that rest, such as a prescaler, a divider or a
//! generator of random bits.
//!
//! While those words rest, a cluster runs through one and the same orbit of states, which is made once by ordinary
//! steps: its registers and cells are then *frozen*, and their words are those of the orbit. The rest of the design
//! sees words of the cluster only that a cell, a register or an output outside takes. Each of these is still until the
//! edge at which the orbit changes it, so this is its horizon, whatever the cluster does. A cluster that matters to
//! nobody now bounds no jump: the rules of cells that it does not reach now take no horizon of its words.
//!
//! A word from outside that a frozen cell takes and that changes marks the cell. The cluster is thawed before anything
//! frozen is evaluated: its registers have the words of now, and all of its cells are evaluated.

use super::{Leap, Line};
use crate::index_set::IndexSet;
use crate::line::FOREVER;

/// The longest orbit, and the longest of a cluster with a register that moves by one difference at equal distances.
const LONGEST: usize = 4096;
const SHORT: usize = 64;
/// The most cells that are evaluated to find an orbit.
const WORK: usize = 1 << 16;

/// A cluster and its place in the orbit.
#[derive(Clone)]
pub(super) struct Cluster {
    /// The words that its registers have, and those of cells that are seen from outside.
    nets: Vec<u32>,
    /// The words of these nets in each state, and the edges until they change next.
    orbit: Vec<Vec<(u64, u64)>>,
    state: usize,
}

/// The movements of a register at the edges at which clusters are looked for.
#[derive(Clone, Copy, Default)]
pub(super) struct Movement {
    difference: u64,
    last: u64,
    distance: u64,
    /// How often it has moved.
    count: u64,
    is_irregular: bool,
}

impl Movement {
    /// Notes that a register moves at an edge.
    pub(super) fn note(&mut self, edge: u64, difference: u64) {
        self.is_irregular |= self.count > 0 && self.difference != difference;
        self.is_irregular |= self.count > 1 && self.distance != edge - self.last;
        *self = Self { difference, distance: edge - self.last, last: edge, count: self.count + 1, ..*self };
    }
}

impl Leap {
    /// Moves the cluster on by so many edges; in a macro-step its words are still in all periods only if a period is a
    /// multiple of the orbit. Marks the users of words that have changed.
    #[inline]
    pub(super) fn move_cluster<const PERIOD: bool>(&mut self, edges: u64) {
        let Some(cluster) = &mut self.cluster else { return };
        let length = cluster.orbit.len() as u64;
        cluster.state = ((cluster.state as u64 + edges % length) % length) as usize;
        let is_still = !PERIOD || self.periods.period.is_multiple_of(length);
        for (net, (word, _)) in cluster.nets.iter().zip(&cluster.orbit[cluster.state]) {
            let made = Line { word: *word, slope: 0, horizon: if is_still { FOREVER } else { 1 } };
            let line = &mut self.lines[*net as usize];
            if super::differ::<PERIOD>(*line, made) {
                *line = made;
                self.users.mark_but(*net, &self.frozen, &mut self.marked);
            }
        }
    }

    /// Tells the lines of the cluster's words for the edges from now on.
    #[inline]
    pub(super) fn tell_cluster(&mut self) {
        let Some(cluster) = &self.cluster else { return };
        for (net, (word, until)) in cluster.nets.iter().zip(&cluster.orbit[cluster.state]) {
            self.lines[*net as usize] = Line { word: *word, slope: 0, horizon: *until };
        }
    }

    /// Returns the number of edges until a word of the cluster changes; none ever does without one.
    #[inline]
    pub(super) fn until_cluster(&self) -> u64 {
        let Some(cluster) = &self.cluster else { return FOREVER };
        cluster.orbit[cluster.state].iter().map(|(_, until)| *until).min().unwrap_or(FOREVER)
    }

    /// Returns the words of the cluster that others may see.
    pub(super) fn seen_of_cluster(&self) -> &[u32] {
        self.cluster.as_ref().map_or(&[], |cluster| &cluster.nets)
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
        let mut found: Option<(u64, (Cluster, IndexSet))> = None;
        for closure in closures {
            let before = found.as_ref().map_or(0, |found| found.0);
            let is_in = |bit: &usize| closure >> bit & 1 != 0;
            let is_regular = (0..active.len()).filter(is_in).any(|bit| !movements[active[bit]].is_irregular);
            let of = |all: u64, most: usize| self.cluster_of((all, &active, &on), most);
            if closure & !before == 0 || of(closure, if is_regular { SHORT } else { LONGEST }).is_none() {
                continue;
            }
            if let Some(cluster) = of(closure | before, LONGEST) {
                found = Some((closure | before, cluster));
            }
        }
        let Some((all, (cluster, frozen))) = found else { return false };
        for (bit, at) in active.iter().enumerate() {
            if all >> bit & 1 != 0 {
                self.pending.set(*at, false);
                self.movers.set(*at, false);
                self.flops[*at].steady = 0;
            }
        }
        (self.cluster, self.frozen) = (Some(cluster), frozen);
        self.find_cone();
        self.cluster.is_some()
    }

    /// Returns the cluster of all these registers and its marks, if its orbit from the state of now on has at most
    /// `most` states and closes. The registers are among the active ones, `on` which each word depends.
    fn cluster_of(&self, (all, active, on): (u64, &[usize], &[u64]), most: usize) -> Option<(Cluster, IndexSet)> {
        let is_in = |bit: &usize| all >> bit & 1 != 0;
        let flops: Vec<_> = (0..active.len()).filter(is_in).map(|bit| active[bit]).collect();
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
        let mut frozen = IndexSet::new(64 * self.marked.parts());
        let mut nets: Vec<_> = flops.iter().map(|at| self.flops[*at].output).collect();
        let mut cells = Vec::new();
        for (at, step) in self.steps.iter().enumerate() {
            // `needed` has the words at rest, and from here on the words of the cluster.
            let is_own = step.operands.iter().all(|net| needed[*net as usize]);
            if on[step.output as usize] != 0 && (needed[step.output as usize] || is_own) {
                needed[step.output as usize] = true;
                frozen.insert(at);
                cells.push(at);
            }
        }
        flops.iter().for_each(|at| frozen.insert(self.steps.len() + at));
        let is_seen = |net: &u32| self.users.any_but(*net, &frozen);
        nets.extend(cells.iter().map(|at| self.steps[*at].output).filter(is_seen));
        let most = most.min(WORK / cells.len().max(1));
        let mut words: Vec<_> = self.lines.iter().map(|line| line.word).collect();
        let mut orbit: Vec<Vec<(u64, u64)>> = Vec::new();
        loop {
            let state: Vec<_> = nets.iter().map(|net| (words[*net as usize], FOREVER)).collect();
            if orbit.first().is_some_and(|first| first[..flops.len()] == state[..flops.len()]) {
                break;
            }
            if orbit.len() == most {
                return None;
            }
            orbit.push(state);
            let next: Vec<_> = flops.iter().map(|at| words[self.flops[*at].data as usize]).collect();
            flops.iter().zip(next).for_each(|(at, word)| words[self.flops[*at].output as usize] = word);
            for at in &cells {
                let step = &self.steps[*at];
                let word = step.operation.word_of(step.widths, |at| words[step.operands[at] as usize]);
                words[step.output as usize] = word;
            }
        }
        // Twice around, from the last state on: the second time it is known when each word changes.
        for at in (0..2 * orbit.len()).rev() {
            let (this, next) = (at % orbit.len(), orbit[(at + 1) % orbit.len()].clone());
            for ((word, until), (then, after)) in orbit[this].iter_mut().zip(next) {
                *until = if *word == then { (after + 1).min(FOREVER) } else { 1 };
            }
        }
        // Words that only the cluster sees do not bound anything.
        for net in (0..nets.len()).filter(|net| !is_seen(&nets[*net])).collect::<Vec<_>>() {
            orbit.iter_mut().for_each(|state| state[net].1 = FOREVER);
        }
        Some((Cluster { nets, orbit, state: 0 }, frozen))
    }
}
