//! The simulation of a netlist.
//!
//! The words are always those of now. A word that changes marks its users: cells, the registers that take it, the
//! outputs that show it, the asynchronous resets that it triggers. Marked cells are evaluated in topological order and
//! mark their own users only if their word has changed. So an edge costs as much as changes at it, whatever the size
//! of the netlist.
//!
//! A register is *pending* if the word that it will take differs from its own. A register that has shown the same
//! pending difference at [`STEADY`] edges in a row is a *mover* from there on. Lines are computed of words that depend
//! on movers, and only where all pending registers are movers: then everything else rests.

mod cluster;
mod periods;

use cluster::{Cluster, Steady};
use periods::{LASTING, Periods};

use crate::index_set::{IndexSet, take_lowest};
use crate::line::Line;
use crate::netlist::{Cell, Net, Netlist, Register};
use crate::operation::{Operation, Widths, mask, signed};

/// Edges in a row with one and the same difference after which a register of more than one bit is taken for a counter.
const STEADY: u8 = 8;
/// A jump over fewer edges is brief: it costs more than it saves.
const BRIEF: u64 = 4;
/// Brief jumps in a row after which the next edges are ordinary ones, and the most edges that are.
const PATIENCE: u32 = 8;
const LONGEST_REST: u64 = 1024;
/// The highest rank of outputs that end a jump where they move.
const STILL: usize = 1;

/// The clock edges of a simulation, and how many of them were leapt over.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Share {
    /// All edges.
    pub edges: u64,
    /// Those within jumps of several edges.
    pub leapt: u64,
    /// The jumps, and the edges outside of them: what the simulation costs.
    pub steps: u64,
}

/// A cell as the simulation needs it, with the range of the users of its word.
#[derive(Clone, Copy)]
struct Step {
    operation: Operation,
    widths: Widths,
    operands: [u32; 3],
    output: u32,
    users: (u32, u32),
}

impl Step {
    /// Returns its word now.
    #[inline(always)]
    fn word(&self, lines: &[Line]) -> u64 {
        self.operation.word_of(self.widths, |at| lines[self.operands[at] as usize].word)
    }

    /// Returns its line from now on.
    #[inline(always)]
    fn line(&self, lines: &[Line]) -> Line {
        let operand = |at: usize| lines[self.operands[at] as usize];
        if self.operation == Operation::Mux && operand(0).rests() {
            return operand(if operand(0).word == 0 { 1 } else { 2 });
        }
        self.operation.line_of(self.widths, self.word(lines), operand)
    }
}

/// A register as the simulation needs it.
#[derive(Clone, Copy)]
struct Flop {
    data: u32,
    output: u32,
    width: u8,
    /// The edges in a row with the same difference, the last of them, and the difference.
    steady: u8,
    last: u64,
    difference: u64,
}

impl Flop {
    fn new(register: &Register, width: u8) -> Self {
        // A register on a clock of its own keeps its word where those on the netlist's clock take theirs.
        let data = if register.clock.is_some() { register.output } else { register.data };
        Self { data: data.0, output: register.output.0, width, steady: 0, last: 0, difference: 0 }
    }
}

/// The users of each word: a range in one list of marks. Marks are numbered: the cells, in topological order; the
/// registers, by their data; the outputs; the registers, by their asynchronous resets; the clocks that are made inside.
#[derive(Clone)]
struct Users {
    from: Vec<u32>,
    /// The place and the bits of a word of the set of marks.
    marks: Vec<(u32, u64)>,
}

impl Users {
    /// Returns who reads each net, of so many: the marks, by the nets that each reads.
    fn new<'n>(nets: usize, read: impl Iterator<Item = &'n [Net]>) -> Self {
        let mut of_net = vec![Vec::new(); nets];
        for (mark, nets) in read.enumerate() {
            for net in nets {
                let (users, part, bit): (&mut Vec<(u32, u64)>, _, _) =
                    (&mut of_net[net.index()], (mark / 64) as u32, 1 << (mark % 64));
                match users.last_mut() {
                    Some((last, bits)) if *last == part => *bits |= bit,
                    _ => users.push((part, bit)),
                }
            }
        }
        let mut users = Self { from: vec![0], marks: Vec::new() };
        for of in of_net {
            users.marks.extend(of);
            users.from.push(users.marks.len() as u32);
        }
        users
    }

    #[inline]
    fn mark(&self, net: u32, marked: &mut IndexSet) {
        self.mark_range((self.from[net as usize], self.from[net as usize + 1]), marked);
    }

    /// Marks those of them that are not in a set.
    fn mark_but(&self, net: u32, set: &IndexSet, marked: &mut IndexSet) {
        for at in self.from[net as usize]..self.from[net as usize + 1] {
            let (part, bits) = self.marks[at as usize];
            marked.insert_into(part as usize, bits & !set.part(part as usize));
        }
    }

    /// Returns whether one of them is not in a set.
    fn any_but(&self, net: u32, set: &IndexSet) -> bool {
        let marks = &self.marks[self.from[net as usize] as usize..self.from[net as usize + 1] as usize];
        marks.iter().any(|(part, bits)| bits & !set.part(*part as usize) != 0)
    }

    #[inline(always)]
    fn mark_range(&self, (from, to): (u32, u32), marked: &mut IndexSet) {
        for at in from..to {
            let (part, bits) = self.marks[at as usize];
            marked.insert_into(part as usize, bits);
        }
    }
}

/// A clock that the design makes.
#[derive(Clone)]
struct Inner {
    net: u32,
    /// The level to which it changes at the edges that count, and its level now.
    active: u64,
    level: u64,
    /// Its registers and their data.
    flops: Vec<(u32, u32)>,
}

impl Inner {
    /// Returns the clocks that the netlist makes for its registers.
    fn all(registers: &[Register]) -> Vec<Self> {
        let mut clocks: Vec<Self> = Vec::new();
        for (at, register) in registers.iter().enumerate() {
            let Some(clock) = register.clock else { continue };
            let (net, active) = (clock.net.0, u64::from(clock.rises));
            let of = clocks.iter().position(|own| (own.net, own.active) == (net, active)).unwrap_or_else(|| {
                // Its first level is none to which it changes.
                clocks.push(Self { net, active, level: active, flops: Vec::new() });
                clocks.len() - 1
            });
            clocks[of].flops.push((at as u32, register.data.0));
        }
        clocks
    }
}

impl Inner {
    /// Returns what it reads: its net, and what its registers take, so that this is seen.
    fn reads(&self) -> Vec<Net> {
        self.flops.iter().map(|(_, data)| Net(*data)).chain([Net(self.net)]).collect()
    }
}

/// A simulation of a netlist, between two clock edges.
#[derive(Clone)]
pub struct Leap {
    steps: Vec<Step>,
    flops: Vec<Flop>,
    inputs: Vec<(u32, u64)>,
    outputs: Vec<(u32, u64)>,
    /// The register, the net, the active level and the word of each asynchronous reset.
    resets: Vec<(u32, u32, u64, u64)>,
    clocks: Vec<Inner>,
    /// The clocks that have had an edge and whose registers have not taken their words yet.
    risen: Vec<u32>,
    users: Users,
    /// Of each net. Slopes and horizons are those of the last pass; nets that no mover reaches rest for ever.
    lines: Vec<Line>,
    marked: IndexSet,
    pending: IndexSet,
    movers: IndexSet,
    /// The words of the outputs that were told last, and the outputs that have others now.
    told: Vec<Option<u64>>,
    news: IndexSet,
    /// The outputs of each rank and below.
    ranks: Vec<IndexSet>,
    /// The outputs that move in a jump, with their lines and the bits of their widths.
    ramps: Vec<(usize, Line, u64)>,
    /// The users of movers, direct or not: cells, registers, outputs, asynchronous resets and clocks.
    cone: Cone,
    /// The cells that were evaluated since horizons were computed; has no parts without a cluster.
    stale: IndexSet,
    /// Whether words may have lines of a jump, and the marks that were evaluated in a macro-step.
    has_lines: bool,
    touched: IndexSet,
    share: Share,
    brief: u32,
    rest: u64,
    /// Whether a mover had another slope than before at the last step that might have been a jump.
    turns: bool,
    /// Words that registers take at an edge, before any of them has it; in a macro-step their lines.
    taken: Vec<(u32, Line)>,
    periods: Periods,
    /// The registers whose words are those of an orbit, the marks of these and of their cells, and whether there were
    /// some since the cone was found.
    cluster: Option<Cluster>,
    frozen: IndexSet,
    is_thawed: bool,
}

/// Returns the outputs of a rank and below.
fn up_to(rank: u8, ranks: &[u8]) -> IndexSet {
    let mut set = IndexSet::new(ranks.len());
    (0..ranks.len()).filter(|at| ranks[*at] <= rank).for_each(|at| set.insert(at));
    set
}

/// Returns for how many edges, or periods of a macro-step, a word certainly has this slope.
#[inline]
fn keeps(line: Line, slope: i64) -> u64 {
    if line.slope == slope { line.horizon } else { 1 }
}

/// Returns whether words differ, in a macro-step whether their lines do.
#[inline]
fn differ<const PERIOD: bool>(one: Line, other: Line) -> bool {
    if PERIOD { one != other } else { one.word != other.word }
}

#[derive(Clone, Default)]
struct Cone {
    steady: Steady,
    /// The data, the words and the widths of movers.
    movers: Vec<(u32, u32, u8)>,
    cells: Vec<Step>,
    /// The places, the data and the words of registers.
    flops: Vec<(u32, u32, u32)>,
    outputs: Vec<u32>,
    /// The nets of asynchronous resets and of clocks that the design makes.
    triggers: Vec<u32>,
    /// The marks of these outputs, resets and clocks.
    ends: IndexSet,
}

impl Leap {
    /// Starts a simulation with these words of the registers and of the inputs; asynchronous resets that are active act
    /// at once, if they act at the start. `ranks` has a rank for each output: a [request](Self::clock) tells of the
    /// outputs up to a rank, and ends where one of rank 0 changes. Outputs of rank 2 and more are for showing: no jump
    /// ends because one of them counts.
    ///
    /// # Panics
    ///
    /// If the numbers of registers, inputs or outputs are others.
    pub fn new(netlist: &Netlist, (initial, given): (&[u64], &[u64]), ranks: &[u8]) -> Self {
        let Netlist { widths, constants, cells, registers, inputs, outputs } = netlist;
        assert_eq!((initial.len(), given.len()), (registers.len(), inputs.len()), "words of registers and inputs");
        assert_eq!(ranks.len(), outputs.len(), "ranks of outputs");
        let mut lines = vec![Line::still(0); widths.len()];
        for (net, word) in constants {
            lines[net.index()].word = *word;
        }
        let flop = |register: &Register| Flop::new(register, netlist.width(register.output));
        let flops: Vec<_> = registers.iter().map(flop).collect();
        for ((_, net), word) in inputs.iter().zip(given) {
            lines[net.index()].word = word & mask(netlist.width(*net));
        }
        for (flop, word) in flops.iter().zip(initial) {
            lines[flop.output as usize].word = word & mask(flop.width);
        }
        let reset = |(at, register): (usize, &Register)| {
            let reset = register.reset?;
            Some((at as u32, reset.net.0, u64::from(reset.active), reset.word & mask(netlist.width(register.output))))
        };
        let resets: Vec<_> = registers.iter().enumerate().filter_map(reset).collect();
        let clocks = Inner::all(registers);
        let marks = cells.len() + flops.len() + outputs.len() + resets.len() + clocks.len();
        let operands = cells.iter().map(|cell| &cell.operands[..cell.operation.operands()]);
        let data: Vec<_> = flops.iter().map(|flop| [Net(flop.data)]).collect();
        let shown = outputs.iter().map(|output| std::slice::from_ref(&output.net));
        let triggers = resets.iter().map(|reset| vec![Net(reset.1)]).chain(clocks.iter().map(Inner::reads));
        let triggers: Vec<_> = triggers.collect();
        let all =
            operands.chain(data.iter().map(|net| &net[..])).chain(shown).chain(triggers.iter().map(Vec::as_slice));
        let users = Users::new(widths.len(), all);
        let step = |cell: &Cell| Step {
            operation: cell.operation,
            widths: cell.widths,
            operands: cell.operands.map(|net| net.0),
            output: cell.output.0,
            users: (users.from[cell.output.index()], users.from[cell.output.index() + 1]),
        };
        let steps: Vec<_> = cells.iter().map(step).collect();
        let mut marked = IndexSet::new(marks);
        (0..marks).for_each(|mark| marked.insert(mark));
        let first = cells.len() + flops.len() + outputs.len();
        let acting = registers.iter().filter_map(|register| register.reset).enumerate();
        acting.for_each(|(at, reset)| marked.set(first + at, reset.at_start));
        let mut leap = Self {
            steps,
            inputs: inputs.iter().map(|(_, net)| (net.0, mask(netlist.width(*net)))).collect(),
            outputs: outputs.iter().map(|output| (output.net.0, mask(netlist.width(output.net)))).collect(),
            resets,
            clocks,
            risen: Vec::new(),
            users,
            lines,
            marked,
            pending: IndexSet::new(flops.len()),
            movers: IndexSet::new(flops.len()),
            told: vec![None; outputs.len()],
            news: IndexSet::new(outputs.len()),
            ranks: (0..=ranks.iter().copied().max().unwrap_or(0)).map(|rank| up_to(rank, ranks)).collect(),
            ramps: Vec::new(),
            cone: Cone { steady: Steady::new(marks, 0), ..Cone::default() },
            stale: IndexSet::default(),
            has_lines: false,
            touched: IndexSet::new(marks),
            share: Share::default(),
            brief: 0,
            rest: 0,
            turns: false,
            taken: Vec::with_capacity(flops.len()),
            periods: Periods::default(),
            cluster: None,
            frozen: IndexSet::new(marks),
            is_thawed: false,
            flops,
        };
        leap.settle::<false>(0);
        leap
    }

    /// Sets the words of all inputs, between two edges. What changes at the outputs is told after the next edge.
    pub fn input(&mut self, words: &[u64]) {
        for (&(net, mask), word) in self.inputs.iter().zip(words) {
            let line = &mut self.lines[net as usize];
            if line.word != word & mask {
                line.word = word & mask;
                self.users.mark(net, &mut self.marked);
            }
        }
        self.settle::<false>(0);
    }

    /// Returns the word of an output now.
    pub fn output(&self, output: usize) -> u64 {
        self.lines[self.outputs[output].0 as usize].word
    }

    /// Takes these words as those that were told last of the outputs; an output without one is told at the next edge at
    /// which it is asked for.
    pub fn tell(&mut self, told: impl IntoIterator<Item = Option<u64>>) {
        for (at, word) in told.into_iter().enumerate().take(self.outputs.len()) {
            self.told[at] = word;
            self.news.set(at, word != Some(self.output(at)));
        }
    }

    /// Returns the words of the registers now.
    pub fn registers(&self) -> impl Iterator<Item = u64> + '_ {
        let hidden = |net: u32| self.cluster.iter().flat_map(Cluster::hidden).find(move |(own, _)| *own == net);
        let word = move |net: u32| hidden(net).map_or(self.lines[net as usize].word, |(_, word)| word);
        self.flops.iter().map(move |flop| word(flop.output))
    }

    /// Returns how many edges there were, and how many of them were leapt over.
    pub fn share(&self) -> Share {
        self.share
    }

    /// Returns the registers that are about to change and are no counters: those that prevent a jump now.
    pub fn restless(&self) -> impl Iterator<Item = usize> + '_ {
        self.pending.iter().filter(|at| !self.movers.contains(*at))
    }

    /// Clocks up to `edges` edges with the inputs as they are, up to the first after which an output of rank 0 has
    /// another word. Returns the number of edges done. `said` is told each change of an output up to the rank `asked`:
    /// the edge, counted from 1 in this request, the output and its word.
    pub fn clock(&mut self, edges: u64, asked: u8, mut said: impl FnMut(u64, usize, u64)) -> u64 {
        let asked = usize::from(asked).min(self.ranks.len() - 1);
        let mut done = 0;
        while done < edges {
            let before = done;
            done += self.step(edges - done, asked);
            if !self.ramps.is_empty() {
                self.ramp((before, done), &mut said);
            }
            if self.has_news(asked) && self.say(asked, done, &mut said) {
                break;
            }
        }
        done
    }

    /// Returns whether an output up to a rank has changed. Callers of other crates may be compiled for their size.
    #[inline(never)]
    fn has_news(&self, asked: usize) -> bool {
        self.news.meets(&self.ranks[asked])
    }

    /// Tells the changes up to a rank. Returns whether an output of rank 0 has changed.
    #[inline(never)]
    fn say(&mut self, asked: usize, edge: u64, said: &mut impl FnMut(u64, usize, u64)) -> bool {
        let mut ends = false;
        for at in 0..self.outputs.len() {
            if self.news.contains(at) && self.ranks[asked].contains(at) {
                let word = self.output(at);
                self.told[at] = Some(word);
                self.news.set(at, false);
                ends |= self.ranks[0].contains(at);
                said(edge, at, word);
            }
        }
        ends
    }

    /// Moves on by an ordinary edge or by a jump of at most `most` edges. Returns the number of edges.
    fn step(&mut self, most: u64, asked: usize) -> u64 {
        if self.is_other() {
            let edges = self.other_step(most, asked);
            if edges > 0 {
                return edges;
            }
        }
        let may_leap = most > 1 && self.rest == 0 && self.pending.is_within(&self.movers);
        let edges = if may_leap && !self.news.meets(&self.ranks[asked]) { self.horizon(most, asked) } else { 1 };
        if edges > 1 {
            for (at, line, bits) in &self.ramps {
                let moved = line.word.wrapping_add((edges - 1).wrapping_mul(line.slope.cast_unsigned()));
                self.told[*at] = Some(moved & *bits);
            }
            self.leap(edges);
            self.share.leapt += edges;
            // Jumps need no periods.
            if self.periods.period > 0 && edges > 2 * self.periods.period {
                self.leave_periods(LASTING);
            }
        } else {
            self.rest = self.rest.saturating_sub(1);
            self.edge();
        }
        self.share.edges += edges;
        self.share.steps += 1;
        edges
    }

    /// Tells the words of the outputs that have counted in a jump, at its edges but for the last one.
    #[inline(never)]
    fn ramp(&mut self, (before, done): (u64, u64), said: &mut impl FnMut(u64, usize, u64)) {
        for edge in before + 1..done {
            for (at, line, bits) in &mut self.ramps {
                line.word = line.word.wrapping_add(line.slope.cast_unsigned()) & *bits;
                said(edge, *at, line.word);
            }
        }
        self.ramps.clear();
    }

    /// An ordinary edge: each pending register takes its next word.
    fn edge(&mut self) {
        let now = self.share.edges;
        let mut is_new = false;
        for part in 0..self.pending.parts() {
            let mut left = self.pending.part(part);
            while let Some(at) = take_lowest(&mut left, part) {
                let flop = &mut self.flops[at];
                let (next, word) = (self.lines[flop.data as usize].word, self.lines[flop.output as usize].word);
                self.taken.push((at as u32, Line::still(next)));
                if flop.steady < STEADY {
                    let difference = next.wrapping_sub(word) & mask(flop.width);
                    let goes_on = flop.last + 1 == now && flop.difference == difference;
                    flop.steady = if goes_on { flop.steady + 1 } else { 1 };
                    (flop.last, flop.difference) = (now, difference);
                    if flop.steady == STEADY && flop.width > 1 {
                        self.movers.insert(at);
                        is_new = true;
                    }
                }
            }
        }
        self.move_cluster::<false>(1);
        self.give::<false>();
        self.settle::<false>(0);
        if is_new {
            self.find_cone();
        }
    }

    /// Gives the registers the words in `taken`, in a macro-step the lines, and marks their users.
    #[inline]
    fn give<const PERIOD: bool>(&mut self) {
        for &(at, taken) in &self.taken {
            let net = self.flops[at as usize].output;
            let line = &mut self.lines[net as usize];
            line.word = taken.word;
            if PERIOD {
                *line = taken;
            }
            // Its data may be as they were, and then the register is pending or not by its own new word.
            self.marked.insert(self.steps.len() + at as usize);
            self.users.mark(net, &mut self.marked);
        }
        self.taken.clear();
    }

    /// Jumps over edges: each pending register moves by its slope at each of them. A word of the cone whose line has a
    /// longer horizon is on that line, because its operands have been on theirs at all edges of the jump and are so
    /// after it; other words of the cone are evaluated.
    fn leap(&mut self, edges: u64) {
        self.move_cluster::<false>(edges);
        let lines = &mut self.lines[..];
        for at in self.pending.iter() {
            let flop = &self.flops[at];
            let line = &mut lines[flop.output as usize];
            line.word = line.after(edges, flop.width);
        }
        for step in &self.cone.cells {
            let line = &mut lines[step.output as usize];
            if line.horizon > edges {
                if line.slope != 0 {
                    line.word = line.after(edges, step.widths.result);
                }
            } else {
                lines[step.output as usize].word = step.word(lines);
            }
        }
        for &(at, data, output) in &self.cone.flops {
            self.pending.set(at as usize, lines[data as usize].word != lines[output as usize].word);
        }
        self.marked.extend(&self.cone.ends);
        self.settle::<false>(0);
    }

    /// Evaluates all that is marked, until no asynchronous reset acts any more and no clock that the design makes has
    /// had an edge. A register that is reset keeps that word until the next edge, so each register is reset at most
    /// once. Clocks that the design makes depend on no register of theirs, so each has at most one edge.
    #[inline]
    fn settle<const PERIOD: bool>(&mut self, asked: usize) {
        loop {
            self.evaluate::<PERIOD>(asked);
            if self.taken.is_empty() {
                if self.risen.is_empty() {
                    break;
                }
                for at in self.risen.drain(..) {
                    let lines = self.clocks[at as usize].flops.iter();
                    self.taken.extend(lines.map(|(flop, data)| (*flop, self.lines[*data as usize])));
                }
            }
            self.give::<PERIOD>();
        }
    }

    /// Evaluates all that is marked, in the order of the marks. Leaves the registers that have to be reset in `taken`.
    /// In a macro-step (`PERIOD`) words have lines, and it is bounded by those of outputs up to the rank `asked`, of
    /// resets and of clocks.
    #[inline]
    fn evaluate<const PERIOD: bool>(&mut self, asked: usize) {
        let lines = &mut self.lines[..];
        let flops = self.steps.len();
        let outputs = flops + self.flops.len();
        let resets = outputs + self.outputs.len();
        let clocks = resets + self.resets.len();
        let mut bound = self.periods.bound;
        let mut part = 0;
        while part < self.marked.parts() {
            // Marks that are set meanwhile are behind the one that sets them.
            let (mut left, frozen) = (self.marked.take(part), self.frozen.part(part));
            if left & frozen != 0 {
                self.marked.insert_into(part, left);
                cluster::thaw(&mut self.cluster, lines, &mut self.marked, &mut self.frozen);
                (self.is_thawed, bound, part) = (true, 1, 0);
                continue;
            }
            let mut all = left;
            while let Some(mark) = take_lowest(&mut left, part) {
                if mark < flops {
                    let step = &self.steps[mark];
                    let made = match PERIOD {
                        true => step.line(lines),
                        false => Line::still(step.word(lines)),
                    };
                    let line = &mut lines[step.output as usize];
                    if differ::<PERIOD>(*line, made) {
                        line.word = made.word;
                        if PERIOD {
                            *line = made;
                        }
                        self.users.mark_range(step.users, &mut self.marked);
                        left |= self.marked.take(part);
                        all |= left;
                        if left & frozen != 0 {
                            self.marked.insert_into(part, std::mem::take(&mut left));
                        }
                    }
                } else if mark < outputs {
                    let flop = &self.flops[mark - flops];
                    let is_pending = differ::<PERIOD>(lines[flop.data as usize], lines[flop.output as usize]);
                    self.pending.set(mark - flops, is_pending);
                } else if mark < resets {
                    let output = mark - outputs;
                    let line = lines[self.outputs[output].0 as usize];
                    self.news.set(output, self.told[output] != Some(line.word));
                    if PERIOD && self.ranks[asked].contains(output) {
                        bound = bound.min(keeps(line, 0));
                    }
                } else if mark < clocks {
                    let (at, net, active, word) = self.resets[mark - resets];
                    let (line, own) = (lines[net as usize], lines[self.flops[at as usize].output as usize]);
                    if line.word == active && differ::<PERIOD>(own, Line::still(word)) {
                        self.taken.push((at, Line::still(word)));
                    }
                    if PERIOD {
                        bound = bound.min(keeps(line, 0));
                    }
                } else {
                    let clock = &mut self.clocks[mark - clocks];
                    let line = lines[clock.net as usize];
                    if PERIOD {
                        bound = bound.min(keeps(line, 0));
                    }
                    let before = std::mem::replace(&mut clock.level, line.word);
                    if before != clock.level && clock.level == clock.active {
                        self.risen.push((mark - clocks) as u32);
                    }
                }
            }
            self.stale.part_mut(part).into_iter().for_each(|bits| *bits |= all);
            if PERIOD {
                self.touched.insert_into(part, all);
            }
            part += usize::from(self.marked.part(part) == 0);
        }
        if PERIOD {
            self.periods.bound = bound;
        }
    }

    /// Returns for how many edges, at most `most`, all registers certainly move by the difference that is pending now,
    /// and the outputs up to the rank `asked`, all asynchronous resets and all clocks certainly keep their words.
    fn horizon(&mut self, most: u64, asked: usize) -> u64 {
        if self.is_thawed {
            self.find_cone();
        }
        self.has_lines = true;
        let mut edges = self.steady_horizon().min(most);
        let mut is_other = false;
        for &(data, output, width) in &self.cone.movers {
            let difference = self.lines[data as usize].word.wrapping_sub(self.lines[output as usize].word);
            let slope = signed(difference & mask(width), width);
            is_other |= std::mem::replace(&mut self.lines[output as usize].slope, slope) != slope;
        }
        // A counter that wraps has its slope again after that edge: a pass would be in vain.
        self.turns = is_other && !self.turns;
        if self.turns {
            return 1;
        }
        let lines = &mut self.lines[..];
        for step in &self.cone.cells {
            let word = lines[step.output as usize].word;
            let operand = |at: usize| lines[step.operands[at] as usize];
            lines[step.output as usize] = step.operation.line_of(step.widths, word, operand);
        }
        for &(_, data, output) in &self.cone.flops {
            edges = edges.min(keeps(lines[data as usize], lines[output as usize].slope));
        }
        for at in self.cone.outputs.iter().map(|at| *at as usize).filter(|at| self.ranks[asked].contains(*at)) {
            let (net, bits) = self.outputs[at];
            let line = lines[net as usize];
            if self.ranks[asked.min(STILL)].contains(at) {
                edges = edges.min(keeps(line, 0));
            } else {
                edges = edges.min(line.horizon);
                self.ramps.extend((line.slope != 0).then_some((at, line, bits)));
            }
        }
        for &net in &self.cone.triggers {
            edges = edges.min(keeps(lines[net as usize], 0));
        }
        if edges == 1 {
            self.ramps.clear();
        }
        if edges >= BRIEF || edges == most {
            (self.brief, self.rest) = (0, 0);
        } else {
            self.brief += 1;
            if self.brief > PATIENCE {
                self.rest = (1 << (self.brief - PATIENCE).min(63)).min(LONGEST_REST);
            }
        }
        edges
    }

    /// Takes the words of cells that are not frozen and that depend on words that move for such, and tells these cells.
    fn reach(&self, moves: &mut [bool], mut tell: impl FnMut(u32)) {
        for (at, step) in self.steps.iter().enumerate().filter(|(at, _)| !self.frozen.contains(*at)) {
            if step.operands.iter().any(|net| moves[*net as usize]) {
                moves[step.output as usize] = true;
                tell(at as u32);
            }
        }
    }

    /// Finds what depends on the movers and on the words of the cluster.
    fn find_cone(&mut self) {
        self.rest_lines();
        self.is_thawed = false;
        let mut moves = vec![false; self.lines.len()];
        self.movers.iter().for_each(|at| moves[self.flops[at].output as usize] = true);
        self.reach(&mut moves, |_| {});
        self.thaw_if(|net| moves[net as usize]);
        let (marks, mut waits) = (64 * self.marked.parts(), moves.clone());
        let mut steady = Steady::new(marks, self.lines.len());
        let mut cone = Cone { ends: IndexSet::new(marks), ..Cone::default() };
        self.cluster.iter().flat_map(Cluster::seen).for_each(|net| waits[net as usize] = true);
        self.reach(&mut waits, |cell| {
            let step = &self.steps[cell as usize];
            match moves[step.output as usize] {
                true => cone.cells.push(*step),
                false => steady.cells.insert(cell as usize),
            }
        });
        // Movers see a word of the cluster through its horizon, the others only bound the jump.
        let is_steady = |net: u32| waits[net as usize] && !moves[net as usize];
        let taken = cone.cells.iter().flat_map(|step| step.operands);
        steady.seen = taken.chain(self.outputs.iter().map(|output| output.0)).filter(|net| is_steady(*net)).collect();
        for (at, flop) in self.flops.iter().enumerate().filter(|(at, _)| !self.frozen.contains(self.steps.len() + at)) {
            if self.movers.contains(at) {
                cone.movers.push((flop.data, flop.output, flop.width));
            }
            if self.movers.contains(at) || moves[flop.data as usize] {
                cone.flops.push((at as u32, flop.data, flop.output));
                steady.seen.extend(Some(flop.data).filter(|net| is_steady(*net)));
            } else if is_steady(flop.data) {
                steady.ends.push(flop.data);
            }
        }
        steady.seen.sort_unstable();
        steady.seen.dedup();
        let mut mark = self.steps.len() + self.flops.len();
        let mut ends = |net: u32| {
            cone.ends.set(mark, moves[net as usize]);
            mark += 1;
            waits[net as usize]
        };
        cone.outputs = (0..).zip(&self.outputs).filter(|(_, (net, _))| ends(*net)).map(|(at, _)| at).collect();
        let triggers = self.resets.iter().map(|reset| reset.1).chain(self.clocks.iter().map(|clock| clock.net));
        let triggers = triggers.filter(|net| ends(*net));
        (steady.ends, cone.triggers) = {
            let (still, moving): (Vec<_>, Vec<_>) = triggers.partition(|net| is_steady(*net));
            (steady.ends.into_iter().chain(still).collect(), moving)
        };
        self.stale = if self.cluster.is_some() { steady.cells.clone() } else { IndexSet::default() };
        self.cone = Cone { steady, ..cone };
    }
}
