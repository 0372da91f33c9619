//! A design in VHDL that Verilator simulates for as long as it can tell what VHDL does.
//!
//! VHDL gives a meaning to bits that nothing has set: U takes the choice `when others`, and a number or an enumeration
//! begins at the left end of its range. Synthesis drops that, so in Verilator such a bit is unknown. Where one comes to
//! matter, GHDL simulates the same clock edges again, with the inputs that the design has had, and goes on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use hpu_cosim::dut::{Asked, Change, Design, Fault, Heard, Inside, Port, RunningDesign};
use hpu_cosim::scene::{Dut, DutScene};

use super::build::Model;
use super::ghdl::Analysed;
use super::past::{Again, Past};
use super::verilator::Verilated;
use super::{Prepared, Simulators, at, note_of_ghdl};
use crate::engines::error::{Error, Reason};

/// A design in VHDL, with both of its simulators.
#[derive(Clone)]
pub(super) struct Fallback(Arc<Both>);

struct Both {
    simulators: Simulators,
    scene: DutScene,
    prepared: Prepared,
    verilated: Verilated,
    /// The design in GHDL, once it was asked for.
    ghdl: OnceLock<Analysed>,
    /// Whether a run needed it.
    needed: AtomicBool,
}

impl Fallback {
    /// Takes a design of a scene as it was prepared, and as it was built for Verilator.
    pub(super) fn new(simulators: &Simulators, scene: &DutScene, model: &Model, verilated: Verilated) -> Self {
        let (simulators, scene) = (simulators.clone(), scene.clone());
        let prepared = Prepared { dut: model.dut.clone(), names: model.names.clone() };
        let (ghdl, needed) = (OnceLock::new(), AtomicBool::new(false));
        Self(Arc::new(Both { simulators, scene, prepared, verilated, ghdl, needed }))
    }
}

impl Both {
    fn ghdl(&self) -> Result<&Analysed, Fault> {
        if let Some(built) = self.ghdl.get() {
            return Ok(built);
        }
        let why = "; in Verilator it depends on a value that only VHDL defines";
        let shown = self.verilated.ports().iter().filter(|port| port.is_inside);
        let shown: Vec<_> = shown.map(|port| port.name.to_lowercase()).collect();
        let takes = |path: &str| shown.contains(&path.to_lowercase());
        let inside = if shown.is_empty() { Inside::Nothing } else { Inside::Chosen(&takes) };
        let built = self.simulators.ghdl(&Model::of(&self.scene, &self.prepared), why, inside);
        let built = built.map_err(|error| at(error, &self.scene))?;
        Ok(self.ghdl.get_or_init(|| built))
    }

    /// Notes that GHDL simulates, and why.
    fn needs_ghdl(&self, why: &str) {
        let why = why.split(". ").next().unwrap_or(why);
        note_of_ghdl(&self.prepared.dut, why, "give the register an initial value");
        self.needed.store(true, Ordering::Relaxed);
    }

    /// Starts GHDL's simulation with its ports numbered as those of Verilator.
    fn in_ghdl(&self, words: &[u64], drives: &[bool], changes: &mut Vec<Change>) -> Result<InGhdl, Fault> {
        let ghdl = self.ghdl()?;
        let (ours, theirs) =
            (wires(&self.prepared.dut, self.verilated.ports()), wires(&self.prepared.dut, ghdl.ports()));
        let place = |port: &&Port| ours.iter().position(|own| own.name.eq_ignore_ascii_case(&port.name));
        let places: Vec<_> = theirs.iter().map(place).collect();
        let driving: Vec<_> = places.iter().map(|place| place.is_some_and(|place| drives[place])).collect();
        let from = changes.len();
        let running = ghdl.start(&placed(&places, words), &driving, changes)?;
        let running = InGhdl { running, places };
        running.renumber(changes, from);
        Ok(running)
    }
}

/// Returns the ports that a request has bits for: all but clocks and reset.
pub(super) fn wires<'p>(dut: &Dut, ports: &'p [Port]) -> Vec<&'p Port> {
    let named = |name: &str| {
        let mut clocks = dut.clocks.iter().map(|clock| &clock.port);
        clocks.any(|port| port.eq_ignore_ascii_case(name))
            || dut.reset.iter().any(|reset| reset.port.eq_ignore_ascii_case(name))
    };
    ports.iter().filter(|port| port.is_inside || !named(&port.name)).collect()
}

fn placed(places: &[Option<usize>], words: &[u64]) -> Vec<u64> {
    places.iter().map(|place| place.map_or(0, |place| words[place])).collect()
}

/// A simulation in GHDL, whose ports have the numbers that Verilator's have.
struct InGhdl {
    running: Box<dyn RunningDesign>,
    /// The number in Verilator of each port of GHDL.
    places: Vec<Option<usize>>,
}

impl InGhdl {
    /// Gives the changes from here on their numbers, and leaves out those of signals that Verilator does not show.
    fn renumber(&self, changes: &mut Vec<Change>, from: usize) {
        let new = changes.split_off(from);
        let place = |change: Change| Some(Change { port: self.places[change.port]?, ..change });
        changes.extend(new.into_iter().filter_map(place));
    }
}

impl RunningDesign for InGhdl {
    fn clock(&mut self, words: &[u64], edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        let from = changes.len();
        let done = self.running.clock(&placed(&self.places, words), edges, asked, changes)?;
        self.renumber(changes, from);
        Ok(done)
    }

    fn is_over(&self) -> bool {
        self.running.is_over()
    }

    fn heard(&mut self) -> Heard {
        self.running.heard()
    }
}

impl Design for Fallback {
    fn ports(&self) -> &[Port] {
        self.0.verilated.ports()
    }

    fn hidden(&self) -> &[Port] {
        self.0.verilated.hidden()
    }

    fn ignores_case(&self) -> bool {
        true
    }

    fn engine(&self) -> &str {
        let needed = self.0.ghdl.get().filter(|_| self.0.needed.load(Ordering::Relaxed));
        needed.map_or_else(|| self.0.verilated.engine(), Design::engine)
    }

    fn start(
        &self,
        words: &[u64],
        drives: &[bool],
        changes: &mut Vec<Change>,
    ) -> Result<Box<dyn RunningDesign>, Fault> {
        if self.0.needed.load(Ordering::Relaxed) {
            return Ok(Box::new(self.0.in_ghdl(words, drives, changes)?));
        }
        let from = changes.len();
        let running = self.0.verilated.start(words, drives, changes)?;
        let past = Past::new(words, drives, &changes[from..]);
        let design = self.clone();
        Ok(Box::new(Either { design, running, past: Some(past), again: None, drives: drives.to_vec() }))
    }
}

/// A simulation by Verilator, or by GHDL from the edge on at which Verilator could not go on.
struct Either {
    design: Fallback,
    running: Box<dyn RunningDesign>,
    drives: Vec<bool>,
    /// Nothing once GHDL simulates, or where the past is too long. A design that comes to depend on an unset value does
    /// so early.
    past: Option<Past>,
    /// GHDL's simulation.
    again: Option<Again>,
}

impl RunningDesign for Either {
    fn clock(&mut self, words: &[u64], edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        let from = changes.len();
        if let Some(again) = &mut self.again {
            return again.clock(words, (edges, asked), changes, &self.drives);
        }
        let done = self.running.clock(words, edges, asked, changes);
        let Some(past) = &mut self.past else { return done };
        let unset = match &done {
            Ok(_) if self.drives.contains(&true) => None,
            // Where no output drives the device, each that is shown matters.
            Ok(_) => {
                let ports = wires(&self.design.0.prepared.dut, self.design.ports());
                let is_one = |change: &&Change| change.bits.is_none() && !ports[change.port].is_inside;
                changes[from..].iter().find(is_one).map(|change| self.design.unset(change.port))
            }
            Err(fault) => match fault.downcast_ref::<Error>().map(Error::reason) {
                Some(Reason::Unset(why)) => Some(why.clone()),
                _ => None,
            },
        };
        let Some(why) = unset else {
            let done = done?;
            past.keep(words, (done, asked), &changes[from..]);
            if past.is_full() {
                self.past = None;
            }
            return Ok(done);
        };
        changes.truncate(from);
        self.design.0.needs_ghdl(&why);
        let past = self.past.take().expect("it is there");
        let goes_on = self
            .design
            .again(&past)
            .and_then(|again| self.again.insert(again).clock(words, (edges, asked), changes, &self.drives));
        let is_known = |change: &Change| !self.drives[change.port] || change.bits.is_some();
        match (goes_on, done) {
            // What VHDL does not define either is told with the name of its register.
            (Ok(_), Err(fault)) if !changes[from..].iter().all(is_known) => Err(fault),
            (goes_on, _) => goes_on,
        }
    }

    fn is_over(&self) -> bool {
        self.again.as_ref().map_or_else(|| self.running.is_over(), |again| again.running.is_over())
    }

    fn heard(&mut self) -> Heard {
        match &mut self.again {
            Some(again) => again.running.heard(),
            None => self.running.heard(),
        }
    }
}

impl Fallback {
    /// Returns the reason to leave Verilator for an output.
    fn unset(&self, port: usize) -> String {
        let name = &wires(&self.0.prepared.dut, self.0.verilated.ports())[port].name;
        format!("output `{name}` depends on a value that nothing has set")
    }

    /// Simulates a past again in GHDL.
    fn again(&self, past: &Past) -> Result<Again, Fault> {
        let again = past.again(|changes| Ok(Box::new(self.0.in_ghdl(&past.first, &past.drives, changes)?)))?;
        if let Some(change) = again.difference {
            let name = &wires(&self.0.prepared.dut, self.ports())[change.port].name;
            let text = format!(
                "Verilator and GHDL have different words at output `{name}` after clock edge {}, before a value that \
                 nothing has set comes to matter; write dut.engine = \"ghdl\"",
                change.edge
            );
            return Err(Error::ended(text).into());
        }
        Ok(again)
    }
}
