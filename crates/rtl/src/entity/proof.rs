//! Proves a block of the user's own equal to one of ours, for all inputs and states.
//!
//! Against a block without registers, nothing need be known of the user's block: the question is about its answer
//! `latency` clock cycles later, from any state. Against a block with registers, the user must name the registers of
//! theirs that hold ours. The proof also shows that these names hold after the reset, and after every edge before which
//! they hold. A block that is not proved in this way is followed for some edges from the reset, to find a real
//! difference.

use std::collections::BTreeSet;
use std::time::Duration;

use hpu_datapath::{ClockEdge, Register, variants_of};

use super::wires::{What, Wire};
use super::{Connected, Entity, Labelled, model, refused};
use crate::dut::{INVARIANT, Names, Prepared, Simulators, Transition};
use crate::engines::error::Error;
use crate::formal::{Edge, Links, NOT_STRAIGHT, Netlist, Proof, Question, Verdict, decided};

/// The numbers of edges from the reset within which a difference is looked for, in turn.
const EDGES: [usize; 5] = [1, 2, 4, 8, 16];
/// The assumption of a proof about a reset that acts between clock edges too, where ours acts at clock edges.
const RESETS_AT_ONCE: &str = "its reset acts at once: equal outside resets, if each of them lasts over a clock edge";

impl Entity {
    /// Proves the user's block equal to a configuration of ours. Each question has this time.
    ///
    /// # Errors
    ///
    /// When the ports, generics or registers do not fit, the design does not compile, or a tool is missing.
    pub fn prove(&self, (_, block): &Labelled, simulators: &Simulators, limit: Duration) -> Result<Verdict, Error> {
        let Some(equations) = block.equations() else { return Ok(Verdict::Open(NOT_STRAIGHT.to_string())) };
        let Prepared { dut, names } = simulators.prepared(&self.dut(&**block))?;
        let ports = simulators.ports_of_model(&model(&dut, &names))?;
        let Connected { ports, wires, has_clock } = self.connected(&**block, &dut, &ports)?;
        if let Some(Wire { port, .. }) = wires.iter().find(|wire| wire.port.name != ports[wire.place].name) {
            let why =
                format!("`{}` is a part of a port, which is compared by vectors alone (without --formal)", port.name);
            return Ok(Verdict::Refused(why));
        }
        self.shift(&**block, has_clock)?;
        let latency = match (block.clocked(), usize::try_from(self.latency)) {
            (false, Ok(latency)) => latency,
            (true, Ok(0)) if has_clock => 0,
            _ => {
                return Ok(Verdict::Open(format!(
                    "its answers come {} clocks later: only of a block without registers is that proved",
                    self.latency
                )));
            }
        };
        let reset = wires.iter().find(|wire| matches!(wire.what, What::Reset { .. })).map(|wire| &*wire.port.name);
        let Transition { text, top, resets_at_once } = match simulators.transition(&dut, reset, &self.invariants)? {
            Ok(transition) => transition,
            Err(why) => return Ok(Verdict::Refused(why)),
        };
        let registers = &equations.registers;
        let netlist = Netlist::foreign(text, &top, has_clock, self.links(&equations, (&wires, &names)));
        self.known(&netlist, registers)?;
        let edge = Edge::new(&equations, &netlist);
        let mut solvers = Vec::new();
        let questions = if registers.is_empty() {
            vec![Question::Trace { rows: 1, latency, begins: false }]
        } else if has_clock {
            vec![Question::Edge, Question::Reset]
        } else {
            vec![Question::Edge]
        };
        let mut open = None;
        for question in questions {
            open = decided(&edge, question, limit, &mut solvers)?;
            if open.is_some() {
                break;
            }
        }
        let Some(open) = open else {
            return Ok(Verdict::Proved(Proof { by: solvers, given: resets_at_once.then_some(RESETS_AT_ONCE) }));
        };
        if !has_clock {
            return Ok(open);
        }
        for rows in EDGES {
            if let Some(found @ Verdict::Refuted(..)) =
                decided(&edge, Question::Trace { rows, latency, begins: true }, limit, &mut solvers)?
            {
                return Ok(found);
            }
        }
        Ok(Verdict::Open(match open {
            Verdict::Refuted(about, around) => {
                let mut why = format!("by {about}, from a state that it need not come to:\n");
                around.lines(1).iter().for_each(|line| why += &format!("    {line}\n"));
                why + &self.unknown(&netlist, registers)
            }
            Verdict::Open(why) => why,
            Verdict::Proved(_) | Verdict::Refused(_) | Verdict::Wired(_) | Verdict::Miswired(_) => {
                unreachable!("a question is open")
            }
        }))
    }

    /// Returns which ports of the user's block stand for ours.
    fn links(&self, equations: &ClockEdge, (wires, names): (&[Wire], &Names)) -> Links {
        let state = self.of_state(&equations.registers).into_iter();
        let registers = state.map(|(ours, theirs)| (ours, names.path(&theirs))).collect();
        let mut links = Links { registers, ..Links::default() };
        let (inputs, outputs) = (equations.block.inputs(), equations.block.outputs());
        for Wire { port, what, .. } in wires {
            let net = names.own(&port.name).to_string();
            match *what {
                What::Input(index) => links.ports.push((inputs[index].name.to_string(), net)),
                What::Output(index) => links.ports.push((outputs[index].name.to_string(), net)),
                What::Constant(word) => links.constants.push((net, port.format.bits(word))),
                What::Reset { active_low } => links.reset = Some((net, !active_low)),
                What::Open => {}
            }
        }
        links.invariant = (!self.invariants.is_empty()).then(|| INVARIANT.to_string());
        links
    }

    /// Returns the nets that hold our registers, each with our register's name.
    fn of_state(&self, registers: &[Register]) -> Vec<(String, String)> {
        let own = |name: &str| {
            let found = registers.iter().map(Register::path).find(|register| register.eq_ignore_ascii_case(name));
            found.unwrap_or_else(|| name.to_string())
        };
        self.state.iter().map(|(theirs, ours)| (own(ours), theirs.clone())).collect()
    }

    /// Refuses names of registers that do not exist.
    fn known(&self, netlist: &Netlist, registers: &[Register]) -> Result<(), Error> {
        // A configuration may lack some registers of the block.
        let mut all = registers.to_vec();
        for (_, block) in variants_of(|name| name == self.block) {
            all.extend(block.equations().map(|edge| edge.registers).unwrap_or_default());
        }
        for (ours, theirs) in self.of_state(&all) {
            if !all.iter().any(|register| register.path() == ours) {
                let names = named(all.iter().map(Register::path));
                return refused(format!("{} has no register `{ours}`; {names}", self.block));
            }
            if netlist.net(&theirs).is_none() {
                let names = named(netlist.registers());
                return refused(format!("`{}` has no register or signal `{theirs}`; {names}", self.top));
            }
        }
        Ok(())
    }

    /// Returns a text about the states that the user has not described.
    fn unknown(&self, netlist: &Netlist, registers: &[Register]) -> String {
        let ours = registers.iter().map(Register::path).filter(|register| netlist.register(register).is_none());
        let ours = named(ours);
        let known: Vec<_> = registers.iter().filter_map(|register| netlist.register(&register.path())).collect();
        let theirs = netlist.registers().into_iter().filter(|name| {
            let net = netlist.net(name);
            !known.iter().any(|known| net == Some(*known))
        });
        let theirs = named(theirs);
        format!(
            "  registers of {} that --state names none for: {ours}; of `{}`, that it does not name: {theirs}; \
             --invariant says what holds of them",
            self.block, self.top
        )
    }
}

/// Returns the names as a list, each once.
fn named<N: Into<String>>(names: impl IntoIterator<Item = N>) -> String {
    let names: Vec<_> = names.into_iter().map(Into::into).collect::<BTreeSet<_>>().into_iter().collect();
    if names.is_empty() { "none".to_string() } else { names.join(", ") }
}
