//! A design that leaps, with Verilator beside it: every word of every output at every edge, compared.

use std::sync::{Arc, Mutex, PoisonError};

use hpu_cosim::dut::{Asked, Change, Design, Designs, Fault, Heard, Inside, Port, RunningDesign};
use hpu_cosim::scene::DutScene;

use super::super::build::Model;
use super::super::fallback::wires;
use super::super::{Simulators, allowed, at};
use super::Leaping;
use crate::engines::error::Error;

/// An output that has another word by leaps than in Verilator.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Difference {
    /// The clock edge after which it has.
    pub edge: u64,
    /// Its name.
    pub port: String,
    /// Its bits by leaps and in Verilator; `None` if one of them is unknown.
    pub bits: [Option<u64>; 2],
}

/// The findings of a comparison so far.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Found {
    /// The changes that outputs have had.
    pub changes: u64,
    /// The changes after which an output has different words.
    pub mismatches: u64,
    /// The first of them.
    pub first: Option<Difference>,
}

/// Builds designs that leap with Verilator beside them. The device is driven by the leaps.
pub struct LeapsBeside {
    simulators: Simulators,
    found: Arc<Mutex<Found>>,
}

impl LeapsBeside {
    /// Takes the installed simulators.
    pub fn new(simulators: Simulators) -> Self {
        Self { simulators, found: Arc::default() }
    }

    /// Returns what the runs of all designs have found so far.
    pub fn found(&self) -> Found {
        self.found.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Designs for LeapsBeside {
    fn build(&self, scene: &DutScene, _: Inside) -> Result<Arc<dyn Design>, Fault> {
        allowed(&scene.dut)?;
        let of = |error| at(error, scene);
        let prepared = self.simulators.prepared(&scene.dut).map_err(of)?;
        let model = Model::of(scene, &prepared);
        let leaping = self.simulators.leaping(&model, Inside::Nothing).map_err(of)?;
        let leaping = leaping.map_err(|why| {
            Error::usage(format!("--compare holds leaps against Verilator, but `{}` cannot leap: {why}", scene.dut.top))
        })?;
        let other = self.simulators.verilator(&model, Inside::Nothing).map_err(of)?;
        let ports = wires(&prepared.dut, leaping.ports());
        let names = ports.into_iter().map(|port| port.name.clone()).collect();
        Ok(Arc::new(Both { leaping, other: Box::new(other), names, found: Arc::clone(&self.found) }))
    }
}

struct Both {
    leaping: Leaping,
    other: Box<dyn Design>,
    names: Vec<String>,
    found: Arc<Mutex<Found>>,
}

impl Design for Both {
    fn ports(&self) -> &[Port] {
        self.leaping.ports()
    }

    fn ignores_case(&self) -> bool {
        self.leaping.ignores_case()
    }

    fn engine(&self) -> &str {
        self.leaping.engine()
    }

    fn start(
        &self,
        words: &[u64],
        drives: &[bool],
        changes: &mut Vec<Change>,
    ) -> Result<Box<dyn RunningDesign>, Fault> {
        let from = changes.len();
        let leaping = self.leaping.start(words, drives, changes)?;
        let mut others = Vec::new();
        let other = self.other.start(words, drives, &mut others)?;
        let shown = [vec![None; words.len()], vec![None; words.len()]];
        let (names, found) = (self.names.clone(), Arc::clone(&self.found));
        let mut beside = Beside { leaping, other, shown, names, found, edge: 0 };
        beside.compare(&changes[from..], &others);
        Ok(Box::new(beside))
    }
}

/// Two simulations of a design with the same inputs.
struct Beside {
    leaping: Box<dyn RunningDesign>,
    other: Box<dyn RunningDesign>,
    /// The words of the ports in both.
    shown: [Vec<Option<u64>>; 2],
    names: Vec<String>,
    found: Arc<Mutex<Found>>,
    edge: u64,
}

impl Beside {
    /// Compares the words after each change that one of two answers to a request has.
    fn compare(&mut self, leaps: &[Change], others: &[Change]) {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let all = leaps.iter().map(|change| (0, change)).chain(others.iter().map(|change| (1, change)));
        let mut all: Vec<_> = all.collect();
        all.sort_by_key(|(of, change)| (change.edge, change.port, *of));
        for same in all.chunk_by(|one, two| (one.1.edge, one.1.port) == (two.1.edge, two.1.port)) {
            let Change { edge, port, .. } = *same[0].1;
            for (of, change) in same {
                self.shown[*of][port] = change.bits;
            }
            let bits = [self.shown[0][port], self.shown[1][port]];
            found.changes += 1;
            if bits[0] != bits[1] {
                found.mismatches += 1;
                let difference = Difference { edge: self.edge + edge, port: self.names[port].clone(), bits };
                found.first.get_or_insert(difference);
            }
        }
    }
}

impl RunningDesign for Beside {
    fn clock(&mut self, words: &[u64], edges: u64, _: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        let from = changes.len();
        let done = self.leaping.clock(words, edges, Asked::Outputs, changes)?;
        let (mut others, mut clocked) = (Vec::new(), 0);
        while clocked < done {
            let before = others.len();
            let more = self.other.clock(words, done - clocked, Asked::Outputs, &mut others)?;
            others[before..].iter_mut().for_each(|change| change.edge += clocked);
            clocked += more;
        }
        self.compare(&changes[from..], &others);
        self.edge += done;
        Ok(done)
    }

    fn heard(&mut self) -> Heard {
        self.other.heard();
        self.leaping.heard()
    }
}
