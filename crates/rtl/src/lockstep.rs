//! A loop closed around VHDL, edge by edge. The outputs of the VHDL drive a plant, the emulator runs beside it with a
//! plant of its own, and every net is compared after every edge.
//!
//! The simulator gets requests of many edges. For this, the emulator runs ahead: as long as both sides agree, the
//! emulator's next inputs are the ones that the VHDL will get, up to the edge at which a word that drives the plant
//! changes.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;

use hpu_cosim::dut::{Asked, Change, RunningDesign};
use hpu_cosim::{Control, Summary, Sums, Wired};
use hpu_signal::{Cycle, Format, Observe, Signal, SignalUse, UNKNOWN};
use hpu_wave::{Around, ComparedRow};

use crate::engines::error::Error;
use crate::engines::tool::{Fault, Tool, ToolError};
use crate::vectors::around::{AFTER, BEFORE};
use crate::vectors::coverage::Coverage;
use crate::vectors::late::{Late, touching};
use crate::vectors::report::{Contact, Mismatch, Tally};
use crate::vectors::side::{Pair, Sides};
use crate::vectors::vector::{digits, hex};

/// The largest number of edges that the emulator runs ahead. With it the simulator answers within a fraction of a
/// second.
const AHEAD: usize = 1024;

/// The words of all nets after an edge, in the emulator and in the VHDL.
#[derive(Default)]
struct Edge {
    edge: u64,
    expected: Vec<i64>,
    got: Vec<Option<i64>>,
}

/// The first mismatch.
struct Found {
    edge: u64,
    net: usize,
    expected: i64,
    got: Option<i64>,
}

/// The observer of the VHDL's world, and the state that it was shown.
struct Shown<'s> {
    observer: &'s mut dyn Observe,
    /// Edges between the rows of the plant's outputs.
    stride: u64,
    /// The edge from which on the motion is judged, and the sums of the world up to it.
    from: u64,
    before: Option<Sums>,
    /// The words that were shown last, with [`UNKNOWN`] for unknown words, and at the end whether any net has ever
    /// differed.
    words: Vec<i64>,
    ranges: Vec<(i64, i64)>,
    /// The present row: as it is judged, and as it is shown.
    row: [Vec<f64>; 2],
}

/// The result of a motion that was shown to its end.
pub(crate) struct Played {
    /// The summary of the VHDL's world, with the edges done.
    pub(crate) summary: Summary,
    /// Why the world ended the run, if it did.
    pub(crate) over: Option<&'static str>,
    /// The emulator's use of its words.
    pub(crate) uses: Vec<SignalUse>,
    /// The least and the greatest word of each net from the first edge on, without unknown words.
    pub(crate) ranges: Vec<(i64, i64)>,
}

/// The VHDL and the emulator, compared edge by edge.
pub(crate) struct Lockstep<'s> {
    nets: Vec<Signal>,
    /// Index of the first output.
    outputs: usize,
    /// Whether each net drives the world.
    drives: Vec<bool>,
    pair: Pair<'s>,
    /// The words of all nets after each edge that the emulator has run ahead of the VHDL.
    ahead: VecDeque<Vec<i64>>,
    spare: Vec<Vec<i64>>,
    /// The words of the inputs that the next edge samples.
    input: Vec<i64>,
    /// The words of the VHDL; `None` where a bit is unknown.
    got: Vec<Option<i64>>,
    /// The same words, with 0 for an unknown word.
    words: Vec<i64>,
    edge: u64,
    edges: u64,
    mismatches: u64,
    first: Option<Found>,
    history: VecDeque<Edge>,
    /// Nets of which at least one is not 0 in contact, and the number of edges in contact so far.
    touching: Vec<usize>,
    touched: u64,
    late: Option<Late>,
    coverage: Coverage,
    shown: Option<Shown<'s>>,
}

impl<'s> Lockstep<'s> {
    /// Returns both sides of a scene after reset, for a comparison of `edges` edges: from the start of the scene or, if
    /// `late`, from shortly before the wall is reached.
    pub(crate) fn new(simulation: &'s impl Wired, edges: u64, late: bool) -> Self {
        let modulated = simulation.gates_drive();
        let Sides { pair, input, nets, late, homing } = Sides::of(simulation, late.then_some(edges));
        let outputs = input.len();
        let ports = simulation.wiring().block().outputs().len();
        let drives = (0..nets.len()).map(|net| {
            let is_output = (outputs..outputs + ports).contains(&net);
            is_output || !modulated && nets[net].name == "command"
        });
        Self {
            touching: touching(&nets),
            touched: 0,
            late,
            coverage: Coverage::of_nets(&nets, outputs, ports),
            shown: None,
            outputs,
            drives: drives.collect(),
            got: vec![None; nets.len()],
            words: vec![0; nets.len()],
            nets,
            input,
            pair,
            ahead: VecDeque::new(),
            spare: Vec::new(),
            edge: 0,
            edges: edges + homing,
            mismatches: 0,
            first: None,
            history: VecDeque::with_capacity(BEFORE + AFTER),
        }
    }

    /// Shows the VHDL's world to an observer, with a row of the plant's outputs every `stride` edges. The motion is
    /// judged from the edge `from` on.
    pub(crate) fn show(&mut self, observer: &'s mut dyn Observe, stride: u64, from: u64) {
        self.pair.measure(stride, observer);
        let ranges = vec![(i64::MAX, i64::MIN); self.nets.len() + 1];
        let (words, row) = (Vec::new(), Default::default());
        self.shown = Some(Shown { observer, stride, from, before: None, words, ranges, row });
    }

    /// Runs to the end of the comparison, or until a world that is shown ends the run. `ports` has the net of each port
    /// of the simulation. `start` starts the simulation, with the bits of the ports and whether they drive the world.
    ///
    /// # Errors
    ///
    /// An error when the simulator fails or does not answer, and when the control has stopped the run.
    pub(crate) fn run<S: RunningDesign>(
        &mut self,
        ports: &[Option<usize>],
        start: impl FnOnce(&[u64], &[bool], &mut Vec<Change>) -> Result<S, Error>,
        control: &Control,
    ) -> Result<(), Error> {
        let drives: Vec<_> = ports.iter().map(|port| port.is_some_and(|net| self.drives[net])).collect();
        let mut changes = Vec::new();
        let mut running = start(&self.bits(ports), &drives, &mut changes)?;
        self.take(ports, &changes);
        self.note(true);
        while self.edge < self.edges && !self.is_over() {
            control.progress.store(self.edge, Ordering::Relaxed);
            if control.stop.load(Ordering::Relaxed) {
                return Err(ToolError::new(Tool::Ghdl, "close a loop", Fault::Stopped, "").into());
            }
            self.pair.sense(&mut self.input);
            let (edges, agrees) = (self.plan(), self.mismatches == 0);
            changes.clear();
            let bits = self.bits(ports);
            let done = running.clock(&bits, edges, Asked::Outputs, &mut changes)?;
            let mut told = changes.chunk_by(|one, two| one.edge == two.edge).peekable();
            for edge in 1..=done {
                if edge > 1 {
                    if self.is_over() {
                        break;
                    }
                    self.pair.sense(&mut self.input);
                    assert_eq!(self.bits(ports), bits, "both worlds agree as long as both sides do");
                }
                let changes = told.next_if(|changes| changes[0].edge == edge).unwrap_or_default();
                self.take(ports, changes);
                self.compare(agrees, !changes.is_empty() || edge == 1);
            }
        }
        Ok(())
    }

    /// Returns the bits of the input ports that the next edge samples.
    fn bits(&self, ports: &[Option<usize>]) -> Vec<u64> {
        let input = |net: usize| self.input.get(net).map_or(0, |&word| self.nets[net].format.bits(word));
        ports.iter().map(|port| port.map_or(0, input)).collect()
    }

    /// Returns the number of edges for the next request. While both sides agree, it is the number up to the first edge
    /// after which an output that drives the world changes, or before which the world's inputs to the FPGA change.
    fn plan(&mut self) -> u64 {
        self.foresee(1);
        let mut count = 1;
        while self.mismatches == 0 && count < AHEAD && self.edge + (count as u64) < self.edges {
            let before = count.checked_sub(2).map_or(&self.words, |before| &self.ahead[before]);
            let last = &self.ahead[count - 1];
            if (0..self.nets.len()).any(|net| self.drives[net] && last[net] != before[net]) {
                break;
            }
            self.foresee(count + 1);
            if self.ahead[count][..self.outputs] != self.ahead[count - 1][..self.outputs] {
                break;
            }
            count += 1;
        }
        count as u64
    }

    /// Runs the emulator until it is `edges` edges ahead.
    fn foresee(&mut self, edges: usize) {
        while self.ahead.len() < edges {
            let mut words = self.spare.pop().unwrap_or_default();
            words.clear();
            words.extend_from_slice(self.pair.step());
            self.ahead.push_back(words);
        }
    }

    /// Takes changed words of the VHDL's nets.
    fn take(&mut self, ports: &[Option<usize>], changes: &[Change]) {
        for &Change { port, bits, .. } in changes {
            if let Some(net) = ports[port] {
                self.got[net] = bits.map(|bits| self.nets[net].format.from_bits(bits));
            }
        }
        // The VHDL has the inputs that it was given.
        for (got, &word) in self.got.iter_mut().zip(&self.input) {
            *got = Some(word);
        }
    }

    /// Compares the nets after an edge and drives the VHDL's plant. `agrees`: both sides were equal at every edge
    /// before the present request.
    fn compare(&mut self, agrees: bool, told: bool) {
        self.edge += 1;
        // The edges before the first mismatch are kept, and as many after it.
        let oldest = if self.first.is_none() && self.history.len() == BEFORE { self.history.pop_front() } else { None };
        let mut latest = oldest.unwrap_or_default();
        latest.edge = self.edge;
        let expected = self.ahead.pop_front().expect("the emulator goes ahead");
        self.spare.push(std::mem::replace(&mut latest.expected, expected));
        latest.got.clone_from(&self.got);
        self.coverage.see(latest.expected.iter().copied());
        let mut different = 0;
        let mut first = None;
        for (net, (&expected, &got)) in latest.expected.iter().zip(&latest.got).enumerate() {
            if got != Some(expected) {
                different += 1;
                first = first.or(Some(Found { edge: self.edge, net, expected, got }));
            }
        }
        let is_first = self.mismatches == 0 && different > 0;
        self.mismatches += different;
        if !self.pair.is_homing() {
            self.touched += u64::from(self.touching.iter().any(|&net| latest.expected[net] != 0));
        }
        self.first = self.first.take().or(first);
        if self.first.as_ref().is_none_or(|first| self.edge - first.edge <= AFTER as u64) {
            self.history.push_back(latest);
        }

        // An output that is unknown counts as 0; the comparison has reported it already.
        for (word, got) in self.words.iter_mut().zip(&self.got) {
            *word = got.unwrap_or(0);
        }
        self.pair.drive(&self.words, agrees);
        self.note(told || is_first);
    }

    /// Shows the words and outputs that are new at the present edge.
    fn note(&mut self, told: bool) {
        let Some(shown) = &mut self.shown else { return };
        // The first edge is always shown, because the use of the words is counted from there.
        if told || self.edge == 1 {
            let unknown = |(word, net): (&Option<i64>, &Signal)| match word {
                Some(word) => *word,
                None if net.format.width() < 64 => UNKNOWN,
                None => 0,
            };
            shown.words.clear();
            shown.words.extend(self.got.iter().zip(&self.nets).map(unknown));
            shown.words.push(i64::from(self.mismatches > 0));
            if self.edge > 0 {
                for ((least, greatest), &word) in shown.ranges.iter_mut().zip(&shown.words) {
                    if word != UNKNOWN {
                        (*least, *greatest) = ((*least).min(word), (*greatest).max(word));
                    }
                }
            }
            shown.observer.nets(Cycle(self.edge), &shown.words);
        }
        if self.edge == shown.from {
            shown.before = Some(self.pair.sums(self.edge));
        }
        if self.edge.is_multiple_of(shown.stride) {
            self.pair.row(self.edge, &mut shown.row);
            let [judged, row] = &shown.row;
            shown.observer.row(Cycle(self.edge), judged, row);
        }
    }

    /// Returns whether the world has ended a run that is shown. A comparison without an observer goes on.
    fn is_over(&self) -> bool {
        self.shown.is_some() && self.pair.over().is_some()
    }

    /// Returns the result of the comparison, with the rows around a mismatch under the columns of `around`.
    pub(crate) fn tally(&self, around: &Around) -> Tally {
        let first = self.first.as_ref().map(|&Found { edge, net, expected, got }| {
            let Signal { name, format, .. } = self.nets[net];
            let rows = self.history.iter().map(|edge| self.row(edge)).collect();
            Mismatch {
                row: edge,
                signal: name.to_string(),
                expected: told(format, Some(expected)),
                got: told(format, got),
                around: Around { rows, ..around.clone() },
            }
        });
        let contact = self.late.map(|late| Contact { late, edges: self.touched });
        Tally { rows: self.edge, mismatches: self.mismatches, first, contact, coverage: self.coverage.clone() }
    }

    /// Returns the result of a motion that was shown. `edge_s` is the clock period in seconds.
    pub(crate) fn played(self, edge_s: f64) -> Played {
        let judged = self.shown.as_ref().and_then(|&Shown { from, before, .. }| {
            self.pair.sums(self.edge).since(&before?, (self.edge - from) as f64 * edge_s)
        });
        let summary = Summary {
            edges: self.edge,
            ticks: self.edge,
            averages: judged.map(|(averages, _)| averages),
            stays: judged.map(|(_, stays)| stays),
            ..self.pair.summary()
        };
        let (over, uses) = (self.pair.over(), self.pair.uses());
        Played { summary, over, uses, ranges: self.shown.map(|shown| shown.ranges).unwrap_or_default() }
    }

    /// Returns an edge of the history as a row: the words of every net in the emulator, and in the VHDL, in hex.
    fn row(&self, Edge { edge, expected, got }: &Edge) -> ComparedRow {
        let unknown = |format: Format| "X".repeat(digits(format));
        let nets = || self.nets.iter().map(|net| net.format);
        ComparedRow {
            number: *edge,
            expected: nets().zip(expected).map(|(format, &word)| hex(format, word)).collect(),
            got: nets()
                .zip(got)
                .map(|(format, word)| word.map_or_else(|| unknown(format), |word| hex(format, word)))
                .collect(),
        }
    }
}

/// Returns a word's bits and its value as text.
fn told(format: Format, word: Option<i64>) -> String {
    let width = format.width() as usize;
    word.map_or("unknown".to_string(), |word| format!("{:0width$b} ({})", format.bits(word), format.to_f64(word)))
}
