//! A design that leaps for as long as that pays, and that another simulator takes over where it does not.

use std::sync::{Arc, OnceLock};

use hpu_cosim::dut::{Asked, Change, Design, Fault, Heard, Inside, Port, RunningDesign};
use hpu_cosim::scene::DutScene;
use hpu_leap::Share;

use super::super::build::Model;
use super::super::fallback::wires;
use super::super::past::{Again, Past};
use super::super::{Prepared, Simulators, at, with_reason};
use super::Leaping;
use super::running::{LONG, Running, is_poor, percent};
use crate::engines::error::{Error, Reason};
use crate::engines::note::note;

/// A design as a netlist, and as Verilator or GHDL simulate it, once that was asked for.
#[derive(Clone)]
struct Automatic(Arc<Both>);

struct Both {
    simulators: Simulators,
    scene: DutScene,
    prepared: Prepared,
    leaping: Leaping,
    other: OnceLock<Arc<dyn Design>>,
    /// The engine as the first run that has ended tells it.
    told: OnceLock<String>,
}

impl Simulators {
    /// Builds a design of a scene, as it was prepared, that leaps for as long as that pays, or tells why it cannot.
    ///
    /// # Errors
    ///
    /// As [`leaping`](Self::leaping).
    pub(in crate::dut) fn leaping_at_first(
        &self,
        model: &Model,
        scene: &DutScene,
        inside: Inside,
    ) -> Result<Result<Arc<dyn Design>, String>, Error> {
        let leaping = match self.leaping(model, inside)? {
            Ok(leaping) => leaping,
            Err(why) => return Ok(Err(why)),
        };
        let (simulators, scene) = (self.clone(), scene.clone());
        let prepared = Prepared { dut: model.dut.clone(), names: model.names.clone() };
        let (other, told) = (OnceLock::new(), OnceLock::new());
        let both = Both { simulators, scene, prepared, leaping, other, told };
        Ok(Ok(Arc::new(Automatic(Arc::new(both)))))
    }
}

impl Both {
    /// Returns the design in the simulator that takes it over.
    fn other(&self) -> Result<&Arc<dyn Design>, Fault> {
        if let Some(built) = self.other.get() {
            return Ok(built);
        }
        let model = Model::of(&self.scene, &self.prepared);
        let shown: Vec<_> = self.leaping.ports().iter().filter(|port| port.is_inside).map(|port| &port.name).collect();
        let takes = |path: &str| shown.iter().any(|name| *name == path);
        let inside = if shown.is_empty() { Inside::Nothing } else { Inside::Chosen(&takes) };
        let built = self.simulators.clocked(&model, &self.scene, inside, None);
        let built = built.map_err(|error| at(error, &self.scene))?;
        let same = |one: &Port, other: &Port| one.name == other.name && one.format == other.format;
        let (own, others) = (self.leaping.ports(), built.ports());
        if own.len() != others.len() || !own.iter().zip(others).all(|(one, other)| same(one, other)) {
            return Err("another simulator has other ports than the netlist".into());
        }
        Ok(self.other.get_or_init(|| built))
    }
}

impl Design for Automatic {
    fn ports(&self) -> &[Port] {
        self.0.leaping.ports()
    }

    fn hidden(&self) -> &[Port] {
        self.0.leaping.hidden()
    }

    fn ignores_case(&self) -> bool {
        self.0.leaping.ignores_case()
    }

    fn engine(&self) -> &str {
        self.0.told.get().map_or(self.0.leaping.engine(), String::as_str)
    }

    fn start(
        &self,
        words: &[u64],
        drives: &[bool],
        changes: &mut Vec<Change>,
    ) -> Result<Box<dyn RunningDesign>, Fault> {
        let from = changes.len();
        let running = Running::start(&self.0.leaping, words, drives, changes);
        let past = Past::new(words, drives, &changes[from..]);
        let (design, drives) = (self.clone(), drives.to_vec());
        Ok(Box::new(Either {
            design,
            drives,
            state: State::Leaping(Box::new(running)),
            past: Some(past),
            next: LONG,
            seen: (Share::default(), 0),
        }))
    }
}

/// The simulator of a run.
enum State {
    Leaping(Box<Running>),
    /// The other one, and why it has taken over.
    Other(Again, String),
}

/// A run that leaps, or has leapt up to an edge.
struct Either {
    design: Automatic,
    drives: Vec<bool>,
    state: State,
    /// Nothing once the other simulator runs, or where none will.
    past: Option<Past>,
    /// The edge at which it is looked again whether leaps pay, and what there was up to the look before: edges and
    /// requests. A design may leap well until it has started.
    next: u64,
    seen: (Share, u64),
}

impl Either {
    /// Lets the other simulator take over, after the edges so far.
    fn hand_over(&mut self, why: String) -> Result<(), Fault> {
        let Some(past) = self.past.take() else { return Ok(()) };
        let other = self.design.0.other()?;
        let again = past.again(|changes| other.start(&past.first, &past.drives, changes))?;
        if let Some(change) = again.difference {
            let name = &wires(&self.design.0.prepared.dut, self.design.ports())[change.port].name;
            let text = format!(
                "the netlist and Verilator have different words at output `{name}` after clock edge {}; write \
                 dut.engine = \"verilator\"",
                change.edge
            );
            return Err(Error::ended(text).into());
        }
        self.state = State::Other(again, format!("from clock edge {} on; before, {why}", past.edge));
        Ok(())
    }

    /// Decides whether the run goes on by leaps: once enough edges have shown what they save, again after twice as
    /// many, and so on, and at last where the past is full.
    fn decide(&mut self) {
        let (State::Leaping(running), Some(past)) = (&self.state, &self.past) else { return };
        let is_full = past.is_full();
        if !is_full && past.edge < self.next {
            return;
        }
        let ((now, calls), (before, earlier)) = ((running.share(), running.calls), self.seen);
        let share =
            Share { edges: now.edges - before.edges, leapt: now.leapt - before.leapt, steps: now.steps - before.steps };
        (self.seen, self.next) = ((now, calls), 2 * past.edge);
        // What was often asked for once, as in a wall, may be so again.
        if !is_poor(share, calls - earlier) || !is_poor(now, calls) {
            if is_full {
                self.past = None;
            }
            return;
        }
        let why = format!("leaps come to {} only, because {}", percent(share), running.prevented());
        match self.hand_over(why.clone()) {
            Err(fault) => note(format!("{why}; no other simulator takes over: {fault}")),
            Ok(()) => note(format!("{} simulates `{}`: {why}", self.simulator(), self.design.0.scene.dut.top)),
        }
    }

    /// Returns the other simulator's name.
    fn simulator(&self) -> &str {
        let engine = self.design.0.other.get().map_or("", |other| other.engine());
        engine.split([',', ';']).next().unwrap_or_default()
    }

    /// Clocks the netlist. Returns `None` where the other simulator has to, because a word is not known.
    fn leap(
        &mut self,
        words: &[u64],
        (edges, asked): (u64, Asked),
        changes: &mut Vec<Change>,
    ) -> Option<Result<u64, Fault>> {
        let State::Leaping(running) = &mut self.state else { return None };
        let plain = self.design.0.leaping.inside;
        let from = changes.len();
        let Some(past) = &mut self.past else { return Some(running.clock(words, edges, asked, changes)) };
        let most = edges.min(self.next.saturating_sub(past.edge).max(1));
        let done = running.clock(words, most, asked, changes);
        let is_unset = match &done {
            Ok(_) => changes[from..].iter().any(|change| change.bits.is_none() && change.port < plain),
            Err(fault) => matches!(fault.downcast_ref::<Error>().map(Error::reason), Some(Reason::Unset(_))),
        };
        if is_unset {
            changes.truncate(from);
            return None;
        }
        if let Ok(done) = done {
            past.keep(words, (done, asked), &changes[from..]);
        }
        Some(done)
    }
}

impl RunningDesign for Either {
    fn clock(&mut self, words: &[u64], edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault> {
        let mut done = 0;
        while done < edges {
            self.decide();
            let from = changes.len();
            let more = match self.leap(words, (edges - done, asked), changes) {
                Some(more) => more?,
                None => {
                    if matches!(self.state, State::Leaping(_)) {
                        self.hand_over(
                            "leaps, up to an output that depends on a value that nothing has set".to_string(),
                        )?;
                    }
                    let State::Other(again, _) = &mut self.state else {
                        return Err("a run by leaps has no past".into());
                    };
                    again.clock(words, (edges - done, asked), changes, &self.drives)?
                }
            };
            changes[from..].iter_mut().for_each(|change| change.edge += done);
            done += more;
            let ends = self.is_over() || changes[from..].iter().any(|change| self.drives[change.port]);
            // Of signals inside there are many changes.
            if ends || asked == Asked::Inside {
                break;
            }
        }
        Ok(done)
    }

    fn state(&self, words: &mut Vec<u64>) -> bool {
        matches!(&self.state, State::Leaping(running) if running.state(words))
    }

    fn is_over(&self) -> bool {
        match &self.state {
            State::Leaping(_) => false,
            State::Other(again, _) => again.running.is_over(),
        }
    }

    fn heard(&mut self) -> Heard {
        let own = self.design.0.leaping.engine();
        let (heard, told) = match &mut self.state {
            State::Leaping(running) => {
                let share = format!("{} leapt over", percent(running.share()));
                (running.heard(), with_reason(own, &share))
            }
            State::Other(again, why) => {
                let engine = self.design.0.other.get().map_or(own, |other| other.engine());
                (again.running.heard(), with_reason(engine, why))
            }
        };
        let _ = self.design.0.told.set(told);
        heard
    }
}
