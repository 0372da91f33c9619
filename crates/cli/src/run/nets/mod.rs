//! `hpu run SCENE --beside OURS --compare PORT=NET`: compares ports of a design of the user's own, or signals inside
//! it, with nets of a scene of ours, at every clock edge.

mod overflow;
mod shift;

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use hpu_cosim::{AnySimulation, Control, Simulation, Wired, WiredSimulation, did_you_mean};
use hpu_page::{Cell, Column, Page, Table};
use hpu_signal::{Cycle, Observe, Signal, UNKNOWN};
use serde_json::{Value, json};

pub(crate) use self::overflow::Overflows;
use self::shift::Shift;
use crate::shell::{Failure, verdict};
use crate::units::si;

/// Rows that are shown before a difference.
const ROWS: usize = 16;
/// Changes of our nets that are sent in one batch, and the most batches that wait.
const BATCH: usize = 4096;
const WAITING: usize = 16;

/// The most names that a message lists.
const LISTED: usize = 24;

/// A port of theirs, or a signal inside, and a net of ours.
#[derive(Clone, PartialEq, Debug)]
struct Pair {
    port: Signal,
    net: Signal,
    theirs: usize,
    ours: usize,
}

impl Pair {
    fn differs(&self, theirs: i64, ours: i64) -> bool {
        self.bits(theirs) != Some(self.net.format.bits(ours))
    }

    /// Returns the bits of theirs; `None` if some are unknown.
    fn bits(&self, theirs: i64) -> Option<u64> {
        (theirs != UNKNOWN).then(|| self.port.format.bits(theirs))
    }
}

/// The ports and nets that are compared, and the number of edges by which theirs come later than ours.
#[derive(Clone, PartialEq, Debug)]
pub struct Pairs(Vec<Pair>, i64);

impl Pairs {
    /// Finds the ports and nets by name in two scenes. Words are compared bit by bit, so a port and its net must have
    /// the same width.
    pub fn new(
        theirs: &AnySimulation,
        ours: &WiredSimulation,
        (names, latency): (&[(String, String)], i64),
    ) -> Result<Self, Failure> {
        if theirs.clock() != ours.clock() {
            let [of_theirs, of_ours] =
                [theirs.clock(), ours.clock()].map(|clock| si(clock.frequency_hz() as f64, "Hz"));
            return Err(Failure::usage(format!(
                "{} runs at {of_theirs}, {} at {of_ours}; edges are compared at one clock",
                theirs.name(),
                ours.name()
            )));
        }
        let (ports, nets) = (theirs.nets(), ours.nets());
        let inside = match theirs {
            AnySimulation::Dut(design) => design.hidden(),
            AnySimulation::Ours(_) => &[],
        };
        let find = |all: &[Signal], name: &str, of: &str, what: &str| {
            all.iter().position(|signal| signal.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
                let names: Vec<_> = all.iter().map(|signal| signal.name).collect();
                let known: Vec<_> = names.iter().copied().chain(inside.iter().map(|port| &*port.name)).collect();
                let near = did_you_mean(name, if what == "port" { &known } else { &names });
                let listed = names[..names.len().min(LISTED)].join(", ");
                let more = if names.len() > LISTED { ", ..." } else { "" };
                let others = if near.is_empty() { format!("; it has {listed}{more}") } else { near };
                Failure::usage(format!("{of} has no {what} `{name}`{others}"))
            })
        };
        let pairs = names.iter().map(|(port, net)| {
            let theirs = find(&ports, port, theirs.name(), "port")?;
            let ours = find(&nets, net, ours.name(), "net")?;
            let pair = Pair { port: ports[theirs].clone(), net: nets[ours].clone(), theirs, ours };
            let widths = [&pair.port, &pair.net].map(|signal| signal.format.width());
            if widths[0] != widths[1] {
                return Err(Failure::usage(format!(
                    "{port} has {} bits, {net} has {}; only words of the same width are compared",
                    widths[0], widths[1]
                )));
            }
            Ok(pair)
        });
        Ok(Self(pairs.collect::<Result<_, _>>()?, latency))
    }
}

/// Words of the compared nets from an edge on, until the next row.
type NetChange = (u64, Vec<i64>);

/// Observes our nets and sends their changes, with the edges at which theirs are to have them.
struct Send<'p> {
    pairs: &'p [Pair],
    latency: i64,
    last: Vec<i64>,
    batch: Vec<NetChange>,
    to: SyncSender<Vec<NetChange>>,
}

impl Observe for Send<'_> {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.last.iter().zip(self.pairs).any(|(last, pair)| *last != words[pair.ours]) || self.last.is_empty() {
            self.last = self.pairs.iter().map(|pair| words[pair.ours]).collect();
            // What is before the first edge has happened at its start.
            self.batch.push((cycle.0.saturating_add_signed(self.latency), self.last.clone()));
            if self.batch.len() == BATCH {
                // The receiver is gone only when the comparison has ended.
                let _ = self.to.send(std::mem::take(&mut self.batch));
            }
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// The first difference.
#[derive(Clone, PartialEq, Debug)]
pub struct First {
    /// The clock edge.
    pub edge: u64,
    /// Index of the pair.
    pair: usize,
    /// The rows up to the difference: edge, our words, their words.
    rows: Vec<(u64, Vec<i64>, Vec<i64>)>,
}

/// The result of a comparison.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct NetComparison {
    pairs: Pairs,
    /// The name of our scene.
    pub beside: String,
    /// Edges that were compared, and the number of words that differed at these edges.
    pub edges: u64,
    pub mismatches: u64,
    /// For each pair the number of its words that differed, and the edges by which theirs were ours, later or earlier,
    /// if they were.
    each: Vec<(u64, Option<i64>)>,
    /// The first difference.
    pub first: Option<First>,
}

/// Observes theirs, compares it with ours, and passes its nets on with one more net: whether any word has differed.
struct Beside<'a> {
    inner: &'a mut dyn Observe,
    pairs: &'a [Pair],
    receiver: Receiver<Vec<NetChange>>,
    waiting: VecDeque<NetChange>,
    theirs: Vec<i64>,
    ours: Vec<i64>,
    /// The edge of the last change of either side.
    since: u64,
    /// The edges that are compared.
    compared: Range<u64>,
    /// The number of words of each pair that differed, and its shift.
    mismatches: Vec<u64>,
    shifts: Vec<Shift>,
    rows: VecDeque<(u64, Vec<i64>, Vec<i64>)>,
    first: Option<First>,
    words: Vec<i64>,
}

impl Beside<'_> {
    /// Returns our next change; `None` when there are no more.
    fn next(&mut self) -> Option<&NetChange> {
        while self.waiting.is_empty() {
            self.waiting.extend(self.receiver.recv().ok()?);
        }
        self.waiting.front()
    }

    /// Counts the differences from the last change up to an edge at which one side changes.
    fn stand(&mut self, edge: u64) {
        if self.theirs.is_empty() || self.ours.is_empty() {
            return;
        }
        // Before the first edge both sides come out of their resets, so nothing is counted.
        let edges = edge.min(self.compared.end).saturating_sub(self.since.max(self.compared.start));
        let all = self.pairs.iter().zip(self.theirs.iter().zip(&self.ours));
        for (mismatches, (pair, (theirs, ours))) in self.mismatches.iter_mut().zip(all) {
            *mismatches += if pair.differs(*theirs, *ours) { edges } else { 0 };
        }
        self.since = edge;
    }

    /// Compares both sides after all changes of an edge.
    fn look(&mut self, edge: u64) {
        if self.first.is_some() || self.theirs.is_empty() || self.ours.is_empty() {
            return;
        }
        if self.rows.len() == ROWS {
            self.rows.pop_front();
        }
        self.rows.push_back((edge, self.ours.clone(), self.theirs.clone()));
        let mut all = self.pairs.iter().zip(self.theirs.iter().zip(&self.ours));
        let differs = all.position(|(pair, (theirs, ours))| pair.differs(*theirs, *ours));
        if let (Some(pair), true) = (differs, self.compared.contains(&edge)) {
            self.first = Some(First { edge, pair, rows: self.rows.iter().cloned().collect() });
        }
    }

    /// Takes our changes before an edge.
    fn come_to(&mut self, edge: u64) {
        while self.next().is_some_and(|(at, _)| *at < edge) {
            let (at, words) = self.waiting.pop_front().expect("the next one");
            self.stand(at);
            self.take_ours(at, words);
            self.look(at);
        }
    }

    fn take_ours(&mut self, edge: u64, words: Vec<i64>) {
        for (shift, (pair, word)) in self.shifts.iter_mut().zip(self.pairs.iter().zip(&words)) {
            shift.ours(edge, pair.net.format.bits(*word));
        }
        self.ours = words;
    }
}

impl Observe for Beside<'_> {
    fn measures(&self) -> bool {
        self.inner.measures()
    }

    fn follows(&self, _: Range<usize>) -> bool {
        true
    }

    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.come_to(cycle.0);
        self.stand(cycle.0);
        while self.next().is_some_and(|(at, _)| *at == cycle.0) {
            let (_, words) = self.waiting.pop_front().expect("the next one");
            self.take_ours(cycle.0, words);
        }
        self.theirs.clear();
        self.theirs.extend(self.pairs.iter().map(|pair| words[pair.theirs]));
        for (shift, (pair, word)) in self.shifts.iter_mut().zip(self.pairs.iter().zip(&self.theirs)) {
            shift.theirs(cycle.0, pair.bits(*word));
        }
        self.look(cycle.0);
        self.words.clear();
        self.words.extend_from_slice(words);
        self.words.push(self.first.is_some().into());
        self.inner.nets(cycle, &self.words);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.inner.reals(cycle, values);
    }
}

/// Runs theirs by `run`, and ours beside it. The observer sees their nets and one net more. It is 1 once a word has
/// differed, and is updated when theirs changes.
pub fn hold<T>(
    pairs: Pairs,
    ours: &WiredSimulation,
    observer: &mut dyn Observe,
    run: impl FnOnce(&mut dyn Observe) -> Result<(T, u64), Failure>,
) -> Result<(T, NetComparison), Failure> {
    let (to, from) = sync_channel(WAITING);
    let control = Control::new();
    // Ours end before an edge at which theirs would have their words earlier.
    let last = ours.edges().saturating_add_signed(pairs.1.min(0));
    std::thread::scope(|scope| {
        let (Pairs(all, latency), control) = (&pairs, &control);
        let side = scope.spawn(move || {
            let mut send = Send { pairs: all, latency: *latency, last: Vec::new(), batch: Vec::new(), to };
            let mut trace = ours.brief_trace();
            ours.run(ours.driver(), &mut trace, &mut send, control);
            let _ = send.to.send(send.batch);
        });
        let mut beside = Beside {
            inner: observer,
            pairs: &pairs.0,
            receiver: from,
            waiting: VecDeque::new(),
            theirs: Vec::new(),
            ours: Vec::new(),
            since: 0,
            compared: 1 + u64::try_from(pairs.1).unwrap_or(0)..last + 1,
            mismatches: vec![0; pairs.0.len()],
            shifts: vec![Shift::default(); pairs.0.len()],
            rows: VecDeque::new(),
            first: None,
            words: Vec::new(),
        };
        let ran = run(&mut beside).map(|(ran, edges)| {
            let edges = edges.min(last);
            beside.come_to(edges + 1);
            beside.stand(edges + 1);
            (ran, edges)
        });
        control.stop.store(true, std::sync::atomic::Ordering::Relaxed);
        let Beside { receiver, mismatches, shifts, first, .. } = beside;
        // Our side may be waiting for the receiver.
        drop(receiver);
        side.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let (ran, edges) = ran?;
        let beside = ours.name().to_string();
        let found = shifts.iter().map(|shift| shift.found(edges));
        let each: Vec<_> = mismatches.iter().copied().zip(found).collect();
        let mismatches = mismatches.iter().sum();
        Ok((ran, NetComparison { pairs: pairs.clone(), beside, edges, mismatches, each, first }))
    })
}

impl NetComparison {
    /// Returns whether no word differed.
    pub fn ok(&self) -> bool {
        self.mismatches == 0
    }

    /// Returns the edges to add to the latency so that all words that differ are the same: theirs are ours, only later
    /// or earlier.
    pub fn offset(&self) -> Option<i64> {
        let mut shifts = self.each.iter().filter(|(mismatches, _)| *mismatches > 0).map(|(_, shift)| *shift);
        let first = shifts.next()??;
        shifts.all(|shift| shift == Some(first)).then_some(first)
    }

    /// Returns what was found, in a few words.
    pub fn said(&self) -> String {
        match self.offset() {
            None => format!("{} mismatches", self.mismatches),
            Some(by) => {
                let Pairs(_, latency) = self.pairs;
                format!("equal when shifted by {}: --latency {}", edges(by), latency + by)
            }
        }
    }

    /// Returns the page of the comparison, with the rows of the first difference unless an offset in time explains it.
    pub fn page(&self, period_s: f64) -> Page {
        let said = verdict(&self.said(), self.ok());
        let Pairs(all, latency) = &self.pairs;
        let pairs = all.iter().map(|pair| format!("{}={}", pair.port.name, pair.net.name));
        let pairs = pairs.collect::<Vec<_>>().join(" ");
        let mut page = Page::default();
        let late = if *latency == 0 { String::new() } else { format!(" with --latency {latency}") };
        page.line("compared", format!("{} edges beside {}{late}, {said}: {pairs}", self.edges, self.beside));
        page.data("beside", &self.beside).data("edges", self.edges).data("mismatches", self.mismatches);
        page.data("latency_edges", *latency).data("offset_edges", self.offset());
        for (pair, (mismatches, offset)) in all.iter().zip(&self.each) {
            let mut part = Page::default();
            part.data("port", pair.port.name).data("net", pair.net.name).data("mismatches", *mismatches);
            part.data("offset_edges", *offset);
            page.section("pairs", part);
            if let (true, Some(by), None) = (*mismatches > 0, offset, self.offset()) {
                page.note(format!("{} is {} when shifted by {}", pair.port.name, pair.net.name, edges(*by)));
            }
        }
        page.data("first_difference", Value::Null);
        let Some(First { edge, pair, rows }) = &self.first else { return page };
        let (port, net) = (self.pairs.0[*pair].port.name, self.pairs.0[*pair].net.name);
        let at = si(*edge as f64 * period_s, "s");
        let difference = json!({ "edge": edge, "port": port, "net": net });
        if self.offset().is_some() {
            page.data("first_difference", difference);
            return page;
        }
        let said = format!("first difference at edge {edge} ({at}): {port} is not {net} of {}", self.beside);
        page.fact("first_difference", "", difference, said);
        let heads =
            self.pairs.0.iter().flat_map(|pair| [format!("{}(ours)", pair.net.name), pair.port.name.to_string()]);
        let heads = [String::new(), "edge".to_string()].into_iter().chain(heads);
        let mut table = Table::new("", heads.map(|head| Column::text("", &head).least(2)));
        for (edge, ours, theirs) in rows {
            let words = self.pairs.0.iter().zip(ours.iter().zip(theirs));
            let words = words
                .flat_map(|(pair, (ours, theirs))| [pair.net.shown(*ours).to_string(), shown(&pair.port, *theirs)]);
            let row = [String::new(), edge.to_string()].into_iter().chain(words);
            table.add(row.map(Cell::from));
        }
        page.table(table);
        page
    }
}

/// Returns a number of edges, as in `3 edges`; below 0 theirs come earlier.
fn edges(by: i64) -> String {
    format!("{by} edge{}", if by.abs() == 1 { "" } else { "s" })
}

fn shown(port: &Signal, word: i64) -> String {
    if word == UNKNOWN { "unknown".to_string() } else { port.shown(word).to_string() }
}
