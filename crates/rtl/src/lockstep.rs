//! The emulator's side of a loop closed around VHDL: a plant driven by the VHDL's gates, the emulator beside it with a
//! plant of its own, and every net compared after every edge. What the VHDL's plant does can be recorded.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use hpu_cosim::Wired;
use hpu_signal::{Format, Signal, UNKNOWN};

use crate::around::{AFTER, BEFORE};
use crate::late::{Late, touching};
use crate::motion::Recorder;
use crate::side::{Pair, Pairing, Sides, Totals};
use crate::vector::{digits, hex};

/// Bits of a word that cross the border to VHDL at a time.
const PART_BITS: u32 = 30;
/// Added to the pins when a word of several bits has changed.
const WORDS_CHANGED: i32 = 1 << 24;
/// Parts of the widest word.
const PARTS: usize = 3;

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
    signal: &'static str,
    expected: String,
    got: String,
}

/// VHDL and emulator, edge by edge.
pub struct Lockstep<'s> {
    nets: Vec<Signal>,
    /// The words of the inputs, as the next edge samples them.
    input: Vec<i64>,
    before: Vec<i64>,
    pair: Box<dyn Pair + 's>,
    /// What the VHDL told of each net: parts of its word, -1 when unknown.
    told: Vec<[i32; PARTS]>,
    /// The words made of them, unless a bit is unknown.
    got: Vec<Option<i64>>,
    /// The same, an unknown one as 0.
    words: Vec<i64>,
    /// Index of the first output.
    outputs: usize,
    edge: u64,
    edges: u64,
    mismatches: u64,
    first: Option<Found>,
    history: VecDeque<Edge>,
    /// Nets of which one is not 0 in contact, and the edges in contact so far.
    touching: Vec<usize>,
    touched: u64,
    late: Option<Late>,
    record: Option<Record>,
}

/// What the VHDL's world does, on its way out.
struct Record {
    to: Recorder,
    /// Edges between rows of the plant's outputs.
    stride: u64,
    /// Whether the VHDL has told a word since the last ones were recorded.
    is_told: bool,
    /// The words of its nets, unknown ones as [`UNKNOWN`], and whether they have ever differed.
    words: Vec<i64>,
    reals: Vec<f64>,
}

impl<'s> Lockstep<'s> {
    /// Both sides of a scene after reset, for so many edges: from its start or, `late`, from shortly before the wall is
    /// reached.
    #[must_use]
    pub fn new(session: &'s impl Wired, edges: u64, late: bool) -> Self {
        let late = late.then(|| (edges, session.edges()));
        let Sides { pair, input, nets, late, homing } =
            session.visit(Pairing { late, modulated: session.gates_drive() });
        Self {
            touching: touching(&nets),
            touched: 0,
            late,
            record: None,
            outputs: input.len(),
            told: vec![[-1; PARTS]; nets.len()],
            got: vec![None; nets.len()],
            words: vec![0; nets.len()],
            nets,
            before: input.clone(),
            input,
            pair,
            edge: 0,
            edges: edges + homing,
            mismatches: 0,
            first: None,
            history: VecDeque::with_capacity(BEFORE + AFTER),
        }
    }

    /// Records what the VHDL's world does in a file or a pipe, with rows of the plant's outputs so many edges apart.
    ///
    /// # Errors
    ///
    /// When it cannot be opened.
    pub fn record(&mut self, path: &Path, stride: u64) -> io::Result<()> {
        let words = Vec::with_capacity(self.nets.len() + 1);
        self.pair.measure(stride);
        self.record = Some(Record { to: Recorder::open(path)?, stride, is_told: true, words, reals: Vec::new() });
        Ok(())
    }

    /// Part of the word of an input.
    #[must_use]
    pub fn input(&self, net: usize, part: usize) -> i32 {
        let bits = self.nets[net].format.bits(self.input[net]) >> (PART_BITS * part as u32);
        Format::unsigned(PART_BITS).from_bits(bits) as i32
    }

    /// Flows the world to the next edge: the inputs of one bit which that edge samples, the first port lowest, and
    /// [`WORDS_CHANGED`] when a wider one has changed; `None` after the last edge, which a recorded world may bring on.
    pub fn pins(&mut self) -> Option<i32> {
        if self.edge == 0 {
            self.note();
        }
        if self.edge == self.edges || self.is_over() {
            self.complete();
            return None;
        }
        std::mem::swap(&mut self.before, &mut self.input);
        self.pair.sense(&mut self.input);
        let (mut pins, mut place) = (0, 0);
        for (net, (now, before)) in self.nets.iter().zip(self.input.iter().zip(&self.before)) {
            if net.format.width() == 1 {
                pins += i32::from(*now != 0) << place;
                place += 1;
            } else if now != before {
                pins |= WORDS_CHANGED;
            }
        }
        Some(pins)
    }

    /// The VHDL tells a part of a net's word.
    pub fn tell(&mut self, net: usize, part: usize, word: i32) {
        let format = self.nets[net].format;
        self.told[net][part] = word;
        if let Some(record) = &mut self.record {
            record.is_told = true;
        }
        let parts = format.width().div_ceil(PART_BITS) as usize;
        let whole = |bits: u64, &part: &i32| Some(bits << PART_BITS | u64::try_from(part).ok()?);
        let bits = self.told[net][..parts].iter().rev().try_fold(0, whole);
        self.got[net] = bits.map(|bits| format.from_bits(bits));
    }

    /// After an edge, all nets told: compares them with the emulator's and drives the VHDL's plant.
    pub fn compare(&mut self) {
        self.edge += 1;
        // From the first mismatch on, the edges after it are kept too, so many.
        let oldest = if self.first.is_none() && self.history.len() == BEFORE { self.history.pop_front() } else { None };
        let mut latest = oldest.unwrap_or_default();
        latest.edge = self.edge;
        latest.expected.clear();
        latest.expected.extend_from_slice(self.pair.step());
        latest.got.clone_from(&self.got);
        let mut different = 0;
        let mut first = None;
        for (net, (&expected, &got)) in latest.expected.iter().zip(&latest.got).enumerate() {
            if got != Some(expected) {
                different += 1;
                first = first.or(Some(net));
            }
        }
        self.mismatches += different;
        if !self.pair.is_homing() {
            self.touched += u64::from(self.touching.iter().any(|&net| latest.expected[net] != 0));
        }
        if let (None, Some(net)) = (&self.first, first) {
            self.first = Some(self.mismatch(net, &latest));
        }
        if self.first.as_ref().is_none_or(|first| self.edge - first.edge <= AFTER as u64) {
            self.history.push_back(latest);
        }

        // An output that is unknown is 0; the comparison has told it already.
        for (word, got) in self.words.iter_mut().zip(&self.got) {
            *word = got.unwrap_or(0);
        }
        self.pair.drive(self.outputs, &self.words, self.mismatches == 0);
        self.note();
    }

    /// Records what is new at the present edge.
    fn note(&mut self) {
        let Some(record) = &mut self.record else { return };
        // The first edge is recorded in any case: from there on the use of the words is told.
        if record.is_told || self.edge == 1 {
            let unknown = |(word, net): (&Option<i64>, &Signal)| match word {
                Some(word) => *word,
                None if net.format.width() < 64 => UNKNOWN,
                None => 0,
            };
            record.words.clear();
            record.words.extend(self.got.iter().zip(&self.nets).map(unknown));
            record.words.push(i64::from(self.mismatches > 0));
            record.to.nets(self.edge, &record.words);
            record.is_told = false;
        }
        if self.edge.is_multiple_of(record.stride) {
            self.pair.reals(self.edge, &mut record.reals);
            record.to.reals(self.edge, &record.reals);
        }
    }

    /// Whether the world has ended a run that is recorded. A mere comparison goes on.
    fn is_over(&self) -> bool {
        self.record.is_some() && self.pair.over().is_some()
    }

    /// Completes the record.
    fn complete(&mut self) {
        if let Some(record) = self.record.take() {
            record.to.complete(&Totals { edges: self.edge, ..self.pair.totals() });
        }
    }

    /// The mismatch of a net at the latest edge.
    fn mismatch(&self, net: usize, latest: &Edge) -> Found {
        let format = self.nets[net].format;
        Found {
            edge: self.edge,
            signal: self.nets[net].name,
            expected: shown(format, Some(latest.expected[net])),
            got: shown(format, latest.got[net]),
        }
    }

    /// An edge of the history: every net of the emulator in hex, then every net of the VHDL.
    fn line(&self, Edge { edge, expected, got }: &Edge) -> String {
        let mut line = format!("row={edge}");
        for (net, &word) in self.nets.iter().zip(expected) {
            write!(line, " {}", hex(net.format, word)).expect("a string grows");
        }
        line += " got";
        for (net, word) in self.nets.iter().zip(got) {
            let unknown = || "X".repeat(digits(net.format));
            write!(line, " {}", word.map_or_else(unknown, |word| hex(net.format, word))).expect("a string grows");
        }
        line
    }

    /// What testbenches print: `MISMATCH`, `HISTORY`, `RESULT`.
    #[must_use]
    pub fn result(&self) -> String {
        let mut text = String::new();
        if let Some(Found { edge, signal, expected, got }) = &self.first {
            text += &format!("MISMATCH row={edge} signal={signal} expected={expected} got={got}\n");
            self.history.iter().for_each(|edge| text += &format!("HISTORY {}\n", self.line(edge)));
        }
        text += &format!("RESULT rows={} mismatches={}", self.edge, self.mismatches);
        if let Some(Late { from_edge, reached, is_long }) = self.late {
            let reached = reached.map_or("never".to_string(), |edge| edge.to_string());
            text += &format!(" from={from_edge} reached={reached} long={is_long} touched={}", self.touched);
        }
        text + if self.pair.over().is_some() { " over\n" } else { "\n" }
    }
}

/// A word in bits and in value.
fn shown(format: Format, word: Option<i64>) -> String {
    let width = format.width() as usize;
    word.map_or("unknown".to_string(), |word| format!("{:0width$b} ({})", format.bits(word), format.to_f64(word)))
}
