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

/// VHDL and emulator, edge by edge.
pub struct Lockstep<'s> {
    nets: Vec<Signal>,
    input: Vec<i64>,
    emulator: Box<dyn Emulator + 's>,
    /// The world that the VHDL's gates drive.
    world: World<'s>,
    /// What the VHDL told of each net: parts of its word, -1 when unknown.
    told: Vec<[i32; PARTS]>,
    outputs: usize,
    command: usize,
    edge: u64,
    edges: u64,
    mismatches: u64,
    first: Option<Mismatch>,
    history: VecDeque<(u64, Vec<u64>, Vec<Option<u64>>)>,
}

impl<'s> Lockstep<'s> {
    /// Both sides of a scene after reset, for so many edges.
    #[must_use]
    pub fn new(session: &'s Session, edges: u64) -> Self {
        let (plant, input) = (session.plant(), session.input());
        let emulator: Box<dyn Emulator> = match session.wiring().clone() {
            TheLoop::Hybrid(wiring) => Box::new(ClosedLoop::new(wiring, plant, input, u64::MAX)),
            TheLoop::Conventional(wiring) => {
                Box::new(ClosedLoop::new(wiring, plant, input, u64::MAX))
            }
        };
        let nets = session.wiring().nets();
        let net = |name: &str| {
            nets.iter()
                .position(|net| net.name == name)
                .expect("every loop has this net")
        };
        let mut constants = Vec::new();
        input.each(|&word| constants.push(word));
        Self {
            outputs: net("a_high"),
            command: net("command"),
            told: vec![[-1; PARTS]; nets.len()],
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
        self.told[net][part] = word;
    }

    /// The bits of a net in the VHDL, unless one is unknown.
    fn got(&self, net: usize) -> Option<u64> {
        let parts = self.nets[net].format.width().div_ceil(PART_BITS) as usize;
        let whole = |bits: u64, &part: &i32| Some(bits << PART_BITS | u64::try_from(part).ok()?);
        self.told[net][..parts].iter().rev().try_fold(0, whole)
    }

    /// After an edge, all nets told: compares them with the emulator's and drives the VHDL's plant.
    pub fn compare(&mut self) {
        self.edge += 1;
        let words = self.emulator.step();
        let expected: Vec<_> = self
            .nets
            .iter()
            .zip(words)
            .map(|(net, &word)| net.format.bits(word))
            .collect();
        let got: Vec<_> = (0..self.nets.len()).map(|net| self.got(net)).collect();
        let differ = |net: &usize| got[*net] != Some(expected[*net]);
        let first = (0..self.nets.len()).find(differ);
        self.mismatches += (0..self.nets.len()).filter(differ).count() as u64;

        // A gate that is unknown is off; the comparison has told it already.
        let word = |net: usize| got[net].map_or(0, |bits| self.nets[net].format.from_bits(bits));
        let mut next = self.outputs..;
        let out = LoopOut::build(|| word(next.next().expect("no end")));
        self.world.drive(out, word(self.command));

        if self.first.is_none() {
            if self.history.len() == KEPT {
                self.history.pop_front();
            }
            self.history.push_back((self.edge, expected, got));
            self.first = first.map(|net| self.mismatch(net));
        }
    }

    /// The mismatch of a net at the latest edge of the history.
    fn mismatch(&self, net: usize) -> Mismatch {
        let format = self.nets[net].format;
        let (_, expected, got) = self.history.back().expect("the latest edge");
        Mismatch {
            row: self.edge,
            signal: self.nets[net].name.to_string(),
            expected: shown(format, Some(expected[net])),
            got: shown(format, got[net]),
            history: self.history.iter().map(|edge| self.line(edge)).collect(),
        }
    }

    /// An edge of the history: every net in hex, with what the VHDL had where that is another word.
    fn line(&self, (edge, expected, got): &(u64, Vec<u64>, Vec<Option<u64>>)) -> String {
        let mut line = format!("edge={edge}");
        for ((net, expected), got) in self.nets.iter().zip(expected).zip(got) {
            write!(line, " {}={expected:x}", net.name).expect("a string grows");
            match got {
                Some(got) if got == expected => {}
                Some(got) => write!(line, "(vhdl {got:x})").expect("a string grows"),
                None => line += "(vhdl unknown)",
            }
        }
        line
    }

    /// What testbenches print: `MISMATCH`, `HISTORY`, `RESULT`.
    #[must_use]
    pub fn result(&self) -> String {
        let mut text = String::new();
        if let Some(Mismatch {
            row,
            signal,
            expected,
            got,
            history,
        }) = &self.first
        {
            text += &format!("MISMATCH row={row} signal={signal} expected={expected} got={got}\n");
            history
                .iter()
                .for_each(|line| text += &format!("HISTORY {line}\n"));
        }
        text + &format!("RESULT rows={} mismatches={}\n", self.edge, self.mismatches)
    }
}

/// A word in bits and in value.
fn shown(format: Format, bits: Option<u64>) -> String {
    let width = format.width() as usize;
    bits.map_or("unknown".to_string(), |bits| {
        format!(
            "{bits:0width$b} ({})",
            format.to_f64(format.from_bits(bits))
        )
    })
}
