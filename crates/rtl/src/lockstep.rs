//! The emulator's side of a loop closed around VHDL: a plant driven by the VHDL's gates, the emulator beside it with a
//! plant of its own, and every net compared after every edge.

use std::collections::VecDeque;
use std::fmt::Write as _;

use hpu_cosim::{ClosedLoop, Session, TheLoop, World};
use hpu_datapath::{LoopOut, Wiring};
use hpu_signal::{Format, Ports, Signal};

use crate::report::Mismatch;

/// Edges that a mismatch is shown with.
const KEPT: usize = 16;
/// Bits of a word that cross the border to VHDL at a time.
const PART_BITS: u32 = 30;
/// Parts of the widest word.
const PARTS: usize = 3;

/// The emulator of either wiring.
trait Emulator {
    /// One edge; the words of all nets after it.
    fn step(&mut self) -> &[i64];
}

impl<W: Wiring> Emulator for ClosedLoop<'_, W> {
    fn step(&mut self) -> &[i64] {
        ClosedLoop::step(self, &mut ());
        self.wiring.words()
    }
}

/// The words of all nets after an edge, in the emulator and in the VHDL.
#[derive(Default)]
struct Edge {
    edge: u64,
    expected: Vec<i64>,
    got: Vec<Option<i64>>,
}

/// VHDL and emulator, edge by edge.
pub struct Lockstep<'s> {
    nets: Vec<Signal>,
    input: Vec<i64>,
    emulator: Box<dyn Emulator + 's>,
    /// The world that the VHDL's gates drive.
    world: World<'s>,
    /// What the VHDL told of each net: parts of its word, -1 when unknown.
    told: Vec<[i32; PARTS]>,
    /// The words made of them, unless a bit is unknown.
    got: Vec<Option<i64>>,
    outputs: usize,
    command: usize,
    edge: u64,
    edges: u64,
    mismatches: u64,
    first: Option<Mismatch>,
    history: VecDeque<Edge>,
}

impl<'s> Lockstep<'s> {
    /// Both sides of a scene after reset, for so many edges.
    #[must_use]
    pub fn new(session: &'s Session, edges: u64) -> Self {
        let (plant, input) = (session.plant(), session.input());
        let emulator: Box<dyn Emulator> = match session.wiring().clone() {
            TheLoop::Hybrid(wiring) => Box::new(ClosedLoop::new(wiring, plant, input, u64::MAX)),
            TheLoop::Conventional(wiring) => Box::new(ClosedLoop::new(wiring, plant, input, u64::MAX)),
        };
        let nets = session.wiring().nets();
        let net = |name: &str| nets.iter().position(|net| net.name == name).expect("every loop has this net");
        let mut constants = Vec::new();
        input.each(|&word| constants.push(word));
        Self {
            outputs: net("a_high"),
            command: net("command"),
            told: vec![[-1; PARTS]; nets.len()],
            got: vec![None; nets.len()],
            nets,
            input: constants,
            emulator,
            world: World::new(plant),
            edge: 0,
            edges,
            mismatches: 0,
            first: None,
            history: VecDeque::with_capacity(KEPT),
        }
    }

    /// Part of the constant word of an input.
    #[must_use]
    pub fn input(&self, net: usize, part: usize) -> i32 {
        let bits = self.nets[net].format.bits(self.input[net]) >> (PART_BITS * part as u32);
        Format::unsigned(PART_BITS).from_bits(bits) as i32
    }

    /// Flows the plant to the next edge: the lines `[a, b]` which that edge samples; `None` after the last edge.
    pub fn pins(&mut self) -> Option<[i64; 2]> {
        (self.edge < self.edges).then(|| {
            let pins = self.world.sense();
            [pins.a, pins.b]
        })
    }

    /// The VHDL tells a part of a net's word.
    pub fn tell(&mut self, net: usize, part: usize, word: i32) {
        let format = self.nets[net].format;
        self.told[net][part] = word;
        let parts = format.width().div_ceil(PART_BITS) as usize;
        let whole = |bits: u64, &part: &i32| Some(bits << PART_BITS | u64::try_from(part).ok()?);
        let bits = self.told[net][..parts].iter().rev().try_fold(0, whole);
        self.got[net] = bits.map(|bits| format.from_bits(bits));
    }

    /// After an edge, all nets told: compares them with the emulator's and drives the VHDL's plant.
    pub fn compare(&mut self) {
        self.edge += 1;
        let oldest = if self.history.len() == KEPT { self.history.pop_front() } else { None };
        let mut latest = oldest.unwrap_or_default();
        latest.edge = self.edge;
        latest.expected.clear();
        latest.expected.extend_from_slice(self.emulator.step());
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
        self.history.push_back(latest);
        if let (None, Some(net)) = (&self.first, first) {
            self.first = Some(self.mismatch(net));
        }

        // A gate that is unknown is off; the comparison has told it already.
        let word = |net: usize| self.got[net].unwrap_or(0);
        let mut next = self.outputs..;
        let out = LoopOut::build(|| word(next.next().expect("no end")));
        self.world.drive(out, word(self.command));
    }

    /// The mismatch of a net at the latest edge of the history.
    fn mismatch(&self, net: usize) -> Mismatch {
        let format = self.nets[net].format;
        let latest = self.history.back().expect("the latest edge");
        Mismatch {
            row: self.edge,
            signal: self.nets[net].name.to_string(),
            expected: shown(format, Some(latest.expected[net])),
            got: shown(format, latest.got[net]),
            history: self.history.iter().map(|edge| self.line(edge)).collect(),
        }
    }

    /// An edge of the history: every net in hex, with what the VHDL had where that is another word.
    fn line(&self, Edge { edge, expected, got }: &Edge) -> String {
        let mut line = format!("edge={edge}");
        for ((net, &expected), &got) in self.nets.iter().zip(expected).zip(got) {
            let hex = |word| format!("{:x}", net.format.bits(word));
            write!(line, " {}={}", net.name, hex(expected)).expect("a string grows");
            if got != Some(expected) {
                write!(line, "(vhdl {})", got.map_or("unknown".to_string(), hex)).expect("a string grows");
            }
        }
        line
    }

    /// What testbenches print: `MISMATCH`, `HISTORY`, `RESULT`.
    #[must_use]
    pub fn result(&self) -> String {
        let mut text = String::new();
        if let Some(Mismatch { row, signal, expected, got, history }) = &self.first {
            text += &format!("MISMATCH row={row} signal={signal} expected={expected} got={got}\n");
            history.iter().for_each(|line| text += &format!("HISTORY {line}\n"));
        }
        text + &format!("RESULT rows={} mismatches={}\n", self.edge, self.mismatches)
    }
}

/// A word in bits and in value.
fn shown(format: Format, word: Option<i64>) -> String {
    let width = format.width() as usize;
    word.map_or("unknown".to_string(), |word| format!("{:0width$b} ({})", format.bits(word), format.to_f64(word)))
}
