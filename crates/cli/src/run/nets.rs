//! `hpu run SCENE --beside OURS --compare PORT=NET`: compares ports of a design of the user's own with nets of a scene
//! of ours, at every clock edge.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use hpu_cosim::{Control, Simulation, Wired, WiredSimulation};
use hpu_page::{Cell, Column, Page, Table};
use hpu_signal::{Cycle, Observe, Signal, UNKNOWN};
use serde_json::{Value, json};

use crate::shell::{Failure, verdict};
use crate::units::si;

/// Rows that are shown before a difference.
const ROWS: usize = 16;
/// Changes of our nets that are sent in one batch, and the most batches that wait.
const BATCH: usize = 4096;
const WAITING: usize = 16;

/// A port of theirs and a net of ours.
#[derive(Clone, PartialEq, Debug)]
struct Pair {
    port: Signal,
    net: Signal,
    theirs: usize,
    ours: usize,
}

impl Pair {
    fn differs(&self, theirs: i64, ours: i64) -> bool {
        theirs == UNKNOWN || self.port.format.bits(theirs) != self.net.format.bits(ours)
    }
}

/// The ports and nets that are compared.
#[derive(Clone, PartialEq, Debug)]
pub struct Pairs(Vec<Pair>);

impl Pairs {
    /// Finds the ports and nets by name in two scenes. Words are compared bit by bit, so a port and its net must have
    /// the same width.
    pub fn new(theirs: &impl Simulation, ours: &WiredSimulation, names: &[(String, String)]) -> Result<Self, Failure> {
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
        let find = |all: &[Signal], name: &str, of: &str, what: &str| {
            all.iter().position(|signal| signal.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
                let names: Vec<_> = all.iter().map(|signal| signal.name).collect();
                Failure::usage(format!("{of} has no {what} `{name}`; it has {}", names.join(", ")))
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
        pairs.collect::<Result<_, _>>().map(Self)
    }
}

/// Words of the compared nets from an edge on, until the next row.
type NetChange = (u64, Vec<i64>);

/// Observes our nets and sends their changes.
struct Send<'p> {
    pairs: &'p [Pair],
    last: Vec<i64>,
    batch: Vec<NetChange>,
    to: SyncSender<Vec<NetChange>>,
}

impl Observe for Send<'_> {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.last.iter().zip(self.pairs).any(|(last, pair)| *last != words[pair.ours]) || self.last.is_empty() {
            self.last = self.pairs.iter().map(|pair| words[pair.ours]).collect();
            self.batch.push((cycle.0, self.last.clone()));
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
    /// The first difference.
    pub first: Option<First>,
}

/// Observes theirs, compares it with ours, and passes its nets on with one more net: whether any word has differed.
struct Beside<'a> {
    inner: &'a mut dyn Observe,
    pairs: &'a [Pair],
    from: Receiver<Vec<NetChange>>,
    waiting: VecDeque<NetChange>,
    theirs: Vec<i64>,
    ours: Vec<i64>,
    /// The edge of the last change of either side.
    since: u64,
    mismatches: u64,
    rows: VecDeque<(u64, Vec<i64>, Vec<i64>)>,
    first: Option<First>,
    words: Vec<i64>,
}

impl Beside<'_> {
    /// Returns our next change; `None` when there are no more.
    fn next(&mut self) -> Option<&NetChange> {
        while self.waiting.is_empty() {
            self.waiting.extend(self.from.recv().ok()?);
        }
        self.waiting.front()
    }

    /// Counts the differences from the last change up to an edge at which one side changes.
    fn stand(&mut self, edge: u64) {
        if self.theirs.is_empty() || self.ours.is_empty() {
            return;
        }
        let differ = self.pairs.iter().zip(self.theirs.iter().zip(&self.ours));
        let differ = differ.filter(|(pair, (theirs, ours))| pair.differs(**theirs, **ours)).count() as u64;
        // Before the first edge both sides come out of their resets, so nothing is counted.
        self.mismatches += differ * edge.saturating_sub(self.since.max(1));
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
        if let (Some(pair), true) = (differs, edge > 0) {
            self.first = Some(First { edge, pair, rows: self.rows.iter().cloned().collect() });
        }
    }

    /// Takes our changes before an edge.
    fn come_to(&mut self, edge: u64) {
        while self.next().is_some_and(|(at, _)| *at < edge) {
            let (at, words) = self.waiting.pop_front().expect("the next one");
            self.stand(at);
            self.ours = words;
            self.look(at);
        }
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
        if self.next().is_some_and(|(at, _)| *at == cycle.0) {
            self.ours = self.waiting.pop_front().expect("the next one").1;
        }
        self.theirs.clear();
        self.theirs.extend(self.pairs.iter().map(|pair| words[pair.theirs]));
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
    std::thread::scope(|scope| {
        let (all, control) = (&pairs.0, &control);
        let side = scope.spawn(move || {
            let mut send = Send { pairs: all, last: Vec::new(), batch: Vec::new(), to };
            let mut trace = ours.brief_trace();
            ours.run(ours.driver(), &mut trace, &mut send, control);
            let _ = send.to.send(send.batch);
        });
        let mut beside = Beside {
            inner: observer,
            pairs: &pairs.0,
            from,
            waiting: VecDeque::new(),
            theirs: Vec::new(),
            ours: Vec::new(),
            since: 0,
            mismatches: 0,
            rows: VecDeque::new(),
            first: None,
            words: Vec::new(),
        };
        let ran = run(&mut beside).map(|(ran, edges)| {
            let edges = edges.min(ours.edges());
            beside.come_to(edges + 1);
            beside.stand(edges + 1);
            (ran, edges)
        });
        control.stop.store(true, std::sync::atomic::Ordering::Relaxed);
        let Beside { from, mismatches, first, .. } = beside;
        // Our side may be waiting for the receiver.
        drop(from);
        side.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let (ran, edges) = ran?;
        let beside = ours.name().to_string();
        Ok((ran, NetComparison { pairs: pairs.clone(), beside, edges, mismatches, first }))
    })
}

impl NetComparison {
    /// Returns whether no word differed.
    pub fn ok(&self) -> bool {
        self.mismatches == 0
    }

    /// Returns the page of the comparison, with the rows of the first difference.
    pub fn page(&self, period_s: f64) -> Page {
        let said = verdict(&format!("{} mismatches", self.mismatches), self.ok());
        let pairs = self.pairs.0.iter().map(|pair| format!("{}={}", pair.port.name, pair.net.name));
        let pairs = pairs.collect::<Vec<_>>().join(" ");
        let mut page = Page::default();
        page.line("compared", format!("{} edges beside {}, {said}: {pairs}", self.edges, self.beside));
        page.data("beside", &self.beside).data("edges", self.edges).data("mismatches", self.mismatches);
        for pair in &self.pairs.0 {
            let mut part = Page::default();
            part.data("port", pair.port.name).data("net", pair.net.name);
            page.section("pairs", part);
        }
        page.data("first_difference", Value::Null);
        let Some(First { edge, pair, rows }) = &self.first else { return page };
        let (port, net) = (self.pairs.0[*pair].port.name, self.pairs.0[*pair].net.name);
        let at = si(*edge as f64 * period_s, "s");
        page.fact(
            "first_difference",
            "",
            json!({ "edge": edge, "port": port, "net": net }),
            format!("first difference at edge {edge} ({at}): {port} is not {net} of {}", self.beside),
        );
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

fn shown(port: &Signal, word: i64) -> String {
    if word == UNKNOWN { "unknown".to_string() } else { port.shown(word).to_string() }
}
