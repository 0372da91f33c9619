//! A running simulation of a netlist.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use hpu_cosim::dut::{Asked, Change, Fault, Heard, RunningDesign};
use hpu_cosim::scene::Registers;
use hpu_leap::{Leap, Netlist, Share};

use super::{INSTANCE, Leaping, Source};
use crate::engines::error::{Error, Reason};
use crate::engines::note::note;

/// Simulations beside the first one while registers may be unset, and the edges after which one is left: as in
/// `main.cpp`.
const OTHERS: u64 = 7;
const SOON: u64 = 64;

/// The edges from which on a run is long enough to tell how much is leapt over.
pub(super) const LONG: u64 = 1 << 16;
/// The edges at which registers are looked at that prevent jumps, and the most of them that are named.
const LOOKED: u64 = 1024;
/// Edges for each step of the simulation below which Verilator is faster, if it is asked seldom.
const LEAST: u64 = 16;
/// A request of Verilator, which is another process, takes longer than to clock this number of edges.
const ASKED: u64 = 64;
/// The most edges of a request for signals inside: each word of a counter is told.
const MOST_SHOWN: u64 = 1 << 12;
const MOST_NAMED: usize = 4;

/// Returns whether fewer than three quarters of the edges were leapt over, or too few at once, so that Verilator is
/// faster although it has to be asked `calls` times.
pub(super) fn is_poor(share: Share, calls: u64) -> bool {
    let Share { edges, leapt, steps } = share;
    (leapt < edges - edges / 4 || edges < LEAST * steps) && edges + ASKED * calls < LEAST * steps
}

/// Returns a share of edges in words.
pub(super) fn percent(share: Share) -> String {
    let tenths = 1000 * share.leapt / share.edges.max(1);
    format!("{}.{} % of the clock edges", tenths / 10, tenths % 10)
}

/// The simulation of a design.
///
/// While a register may have a word that nothing has set, others run beside it whose unset bits are different ones, an
/// edge at a time, until their registers are the same. An output in which one of them differs is unknown.
pub(super) struct Running {
    leap: Leap,
    /// How often it was asked to go on.
    pub(super) calls: u64,
    others: Vec<Leap>,
    sources: Vec<Source>,
    /// The port of each output, the least request that asks for it, and its word as told last: unknown, or not told.
    outputs: Vec<usize>,
    names: Vec<String>,
    /// The names of the registers, and whether outputs that drive depend on them.
    registers: Vec<String>,
    live: Vec<bool>,
    ranks: Vec<u8>,
    told: Vec<Option<Option<u64>>>,
    /// The level of the reset when it is not active.
    passive: u64,
    given: Vec<u64>,
    edge: u64,
    /// The edge at which registers are compared next.
    look: u64,
    unchecked: Vec<String>,
}

/// Returns random bits, from a counter (splitmix64).
fn bits(counter: u64) -> u64 {
    let mut bits = counter.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

/// Returns the first words of all registers. The bits that nothing sets are 0 for fill `None`; those of fill 1 are the
/// inverse of those of fill 0, and others are random.
fn initial(netlist: &Netlist, fill: Option<u64>) -> Vec<u64> {
    let words = netlist.registers().iter().zip(1u64..).map(|(register, at)| {
        let unset = match fill {
            None => 0,
            Some(1) => !bits(at),
            Some(fill) => bits(at + (fill << 32)),
        };
        register.initial | unset & !register.set
    });
    words.collect()
}

impl Running {
    /// Starts a simulation at the end of the reset; see [`Design::start`](hpu_cosim::dut::Design::start).
    pub(super) fn start(design: &Leaping, words: &[u64], drives: &[bool], changes: &mut Vec<Change>) -> Self {
        let netlist = &*design.netlist;
        let outputs = design.outputs.clone();
        let rank = |port: &usize| match (drives[*port], *port < design.inside) {
            (true, _) => Asked::Driving as u8,
            (_, true) => Asked::Outputs as u8,
            _ => Asked::Inside as u8,
        };
        let ranks: Vec<_> = outputs.iter().map(rank).collect();
        let passive = u64::from(design.active_low);
        let given = |reset: u64| -> Vec<u64> {
            let word = |source: &Source| match source {
                Source::Port(port) => words[*port],
                Source::Reset => reset,
            };
            design.inputs.iter().map(word).collect()
        };
        let (before, resets) = (given(passive), given(1 - passive));
        let reset = design.inputs.iter().position(|source| matches!(source, Source::Reset));
        // The reset stays passive from its end on.
        let after = reset.map(|input| netlist.with_input(input, passive));
        let begun = |fill: Option<u64>| {
            let mut leap = Leap::new(netlist, (&initial(netlist, fill), &before), &ranks);
            leap.input(&resets);
            let mut left = design.settle;
            while left > 0 {
                left -= leap.clock(left, u8::MAX, |_, _, _| {});
            }
            leap.input(&before);
            let registers: Vec<_> = leap.registers().collect();
            after.as_ref().map_or(leap, |netlist| Leap::new(netlist, (&registers, &before), &ranks))
        };
        let is_unset =
            netlist.registers().iter().any(|one| one.set.count_ones() < u32::from(netlist.width(one.output)));
        let is_unknown = design.registers == Registers::Unknown && is_unset;
        let fills = 1..1 + if is_unknown { OTHERS } else { 0 };
        let mut running = Self {
            leap: begun(is_unknown.then_some(0)),
            calls: 0,
            others: fills.map(|fill| begun(Some(fill))).collect(),
            sources: design.inputs.clone(),
            names: netlist.outputs().iter().map(|output| output.name.clone()).collect(),
            registers: netlist
                .registers()
                .iter()
                .map(|register| {
                    register
                        .name
                        .strip_prefix(INSTANCE)
                        .and_then(|name| name.strip_prefix('.'))
                        .unwrap_or(&register.name)
                        .to_string()
                })
                .collect(),
            told: vec![None; outputs.len()],
            outputs,
            live: netlist.live(|at| ranks[at] == Asked::Driving as u8),
            ranks,
            passive,
            given: before.clone(),
            edge: 0,
            look: 1,
            unchecked: design.unchecked.clone(),
        };
        running.settle();
        for at in 0..running.outputs.len() {
            let bits = running.known(at);
            running.told[at] = Some(bits);
            changes.push(Change { edge: 0, port: running.outputs[at], bits });
        }
        changes.sort_by_key(|change| change.port);
        let told = running.told.iter().map(|told| told.flatten()).collect::<Vec<_>>();
        running.leap.tell(told);
        running
    }

    /// Leaves the simulations beside the first one that have its words in all registers.
    fn settle(&mut self) {
        let leap = &self.leap;
        self.others.retain(|other| !other.registers().eq(leap.registers()));
    }

    /// Returns the word of an output, if it is the same in all simulations.
    fn known(&self, at: usize) -> Option<u64> {
        let word = self.leap.output(at);
        self.others.iter().all(|other| other.output(at) == word).then_some(word)
    }

    /// Clocks all simulations edge by edge, for as long as there are several. Returns the number of edges, and whether
    /// an output that drives has changed at the last of them.
    fn beside(&mut self, edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<(u64, bool), Fault> {
        let (mut done, mut ends) = (0, false);
        while done < edges && !ends && !self.others.is_empty() {
            done += 1;
            self.edge += 1;
            for leap in self.others.iter_mut().chain([&mut self.leap]) {
                leap.clock(1, u8::MAX, |_, _, _| {});
            }
            for at in 0..self.outputs.len() {
                let bits = self.known(at);
                let drives = self.ranks[at] == Asked::Driving as u8;
                if drives && bits.is_none() {
                    return Err(self.unset(at));
                }
                if self.told[at] == Some(bits) || self.ranks[at] > asked as u8 {
                    continue;
                }
                self.told[at] = Some(bits);
                ends |= drives;
                changes.push(Change { edge: done, port: self.outputs[at], bits });
            }
            if self.edge >= self.look {
                self.look = self.edge + self.edge.min(4096);
                self.settle();
                if self.edge >= SOON {
                    self.others.truncate(1);
                }
            }
        }
        let told = self.told.iter().map(|told| told.flatten()).collect::<Vec<_>>();
        self.leap.tell(told);
        Ok((done, ends))
    }

    /// Returns how many edges there were, and how many of them were leapt over.
    pub(super) fn share(&self) -> Share {
        self.leap.share()
    }

    /// Returns what prevents jumps at the next edges if the inputs stay.
    pub(super) fn prevented(&self) -> String {
        let (mut leap, mut restless) = (self.leap.clone(), BTreeMap::new());
        for _ in 0..LOOKED {
            leap.restless().for_each(|at| *restless.entry(&*self.registers[at]).or_insert(0) += 1);
            leap.clock(1, u8::MAX, |_, _, _| {});
        }
        let at_every = restless.values().any(|edges| *edges == LOOKED);
        let (least, at) = if at_every { (LOOKED, "at every edge") } else { (LOOKED / 8, "at many edges") };
        let mut restless: Vec<_> = restless.into_iter().filter(|(_, edges)| *edges >= least).collect();
        restless.sort_by_key(|(name, edges)| (Reverse(*edges), *name));
        let names: Vec<_> = restless.iter().take(MOST_NAMED).map(|(name, _)| format!("`{name}`")).collect();
        match &names[..] {
            [] => "its counters are compared or changed every few edges".to_string(),
            [name] => format!("register {name} changes {at}"),
            names => format!("registers {} change {at}", names.join(", ")),
        }
    }

    /// Tells how many edges are leapt over and what prevents more, where that are few of a long run.
    fn note_share(&self) {
        let share = self.share();
        if share.edges >= LONG && is_poor(share, self.calls) {
            note(format!(
                "the design leaps over {}: {}; dut.engine = \"verilator\" may be faster",
                percent(share),
                self.prevented()
            ));
        }
    }

    /// Returns the fault of an output that drives the device by a value that nothing has set.
    fn unset(&self, at: usize) -> Fault {
        let word = self.leap.output(at);
        let other = self.others.iter().map(|other| other.output(at)).find(|other| *other != word).unwrap_or(word);
        let (name, edge) = (&self.names[at], self.edge);
        let why = format!(
            "output `{name}` depends on a value that nothing has set; after clock edge {edge} it is {word:x} or \
             {other:x}. Let the reset or an initial value set it, or write dut.registers = \"zero\" for an FPGA that \
             clears its registers; dut.engine = \"verilator\" names the register"
        );
        Error::from(Reason::Unset(why)).into()
    }
}

impl RunningDesign for Running {
    fn clock(&mut self, words: &[u64], edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        self.calls += 1;
        let mut is_new = false;
        for (given, source) in self.given.iter_mut().zip(&self.sources) {
            let word = match source {
                Source::Port(port) => words[*port],
                Source::Reset => self.passive,
            };
            is_new |= std::mem::replace(given, word) != word;
        }
        if is_new {
            for leap in self.others.iter_mut().chain([&mut self.leap]) {
                leap.input(&self.given);
            }
        }
        let from = changes.len();
        let (mut done, mut ends) = (0, false);
        if !self.others.is_empty() {
            (done, ends) = self.beside(edges, asked, changes)?;
        }
        if done < edges && !ends {
            let most = if asked == Asked::Inside { MOST_SHOWN } else { u64::MAX };
            let (outputs, told) = (&self.outputs, &mut self.told);
            let more = self.leap.clock((edges - done).min(most), asked as u8, |edge, at, word| {
                told[at] = Some(Some(word));
                changes.push(Change { edge: done + edge, port: outputs[at], bits: Some(word) });
            });
            self.edge += more;
            done += more;
        }
        changes[from..].sort_unstable_by_key(|change| (change.edge, change.port));
        Ok(done)
    }

    fn state(&self, words: &mut Vec<u64>) -> bool {
        let known = self.others.is_empty();
        let live = self.leap.registers().zip(&self.live).filter(|(_, live)| known && **live);
        words.extend(live.map(|(word, _)| word));
        known
    }

    fn heard(&mut self) -> Heard {
        self.note_share();
        Heard::unchecking(std::mem::take(&mut self.unchecked))
    }
}
