//! Proofs: a block's VHDL equals the emulator for all inputs in all states, not only on vectors.
//!
//! GHDL synthesises the VHDL, with the same repairs as for costs. Yosys writes the netlist as a transition in SMT-LIB;
//! every unknown bit in it may be 0 or 1. The block's equations ([`ClockEdge`]) become terms over the same inputs, and
//! over registers read from the netlist's. A solver looks for a state and inputs for which an output, or a register
//! after the edge, differs: *unsatisfiable* is the proof. The proof assumes the formats of registers in the state, and
//! shows them in the next state. A second query does the same for the reset.
//!
//! A block made of blocks has no equations of its own. [`Prover`] compares its netlist with the wiring that the
//! emulator states ([`AnyBlock::parts`]), and proves each block inside once.
//!
//! # What is proved, what is trusted
//!
//! The netlist, from equal states with equal inputs, stays equal for ever. Three questions make a proof: no state with
//! any inputs has another output or next state; the reset leaves the registers as it does in the emulator; and such
//! states are possible at all. Lemmas beside the equations claim what a block computes over several edges (each digit
//! of divider and root keeps its invariant), and `Word::cut` names a net at which a proof may begin anew.
//!
//! Trusted are GHDL's synthesis, the repairs of its Verilog (compared with the emulator by Icarus Verilog), Yosys, the
//! solver that answered (for tables, GHDL's simulation), and rustc. That a loop's `tick` computes what its parts do is
//! tested (`datapath/tests/all/parts.rs`), not proved.
//!
//! Not proved are `phantom_engine`, whose sequence is not told as equations, FOAW's `wide` configuration, whose
//! products exceed 128 bits, and the widest `gimbal_inverse`, which no solver decides in a minute; they stay under
//! vectors. So the gimbal's loops are proved with all leaves in short words, and wired in the paper's.
//!
//! `testbench/mutants.py` puts one error at a time into the VHDL (`--rust`: into the equations), and
//! `mutants_clocks.py` sows errors of clocks, resets, latches and Z: solvers or the wiring refute each, or prove it
//! equivalent, else vectors kill it.

mod cache;
mod netlist;
mod prover;
mod query;
mod solver;
mod tried;

use std::time::Duration;

use hpu_datapath::{AnyBlock, ClockEdge};
use hpu_wave::Around;

use crate::engines::error::Error;
use crate::engines::hdl::Setup;
use crate::engines::tool::Tool;

use query::Query;
use solver::Answer;

pub use cache::{Proofs, tools};
pub(crate) use netlist::{Links, Netlist};
pub use prover::{Part, Prover};
pub(crate) use query::{Edge, Question};

/// The result of a block's proof.
#[derive(Clone, PartialEq, Debug)]
pub enum Verdict {
    /// Proved for all inputs and states.
    Proved(Proof),
    /// Refuted: an output or a register after the edge differs. The text says whether an edge or the reset was asked
    /// about; the row shows the edge. A register's word after the edge has its name with a prime.
    Refuted(String, Around),
    /// Refused before anything was asked, because the netlist's step is not one rising edge of the clock: a register
    /// has another clock, or sets itself between clock edges. The text says which.
    Refused(String),
    /// Not proved, and the reason.
    Open(String),
    /// The wiring of a block made of blocks is equal. The parts are the blocks on which it rests, with their verdicts.
    Wired(Vec<Part>),
    /// The wiring of a block made of blocks differs; this is the first difference.
    Miswired(String),
}

/// A proof of a block.
#[derive(Clone, PartialEq, Debug)]
pub struct Proof {
    /// The solvers that answered each query, or GHDL if it tried all inputs.
    pub by: Vec<&'static str>,
    /// What the proof assumes of the inputs, if not everything is allowed.
    pub given: Option<&'static str>,
}

impl Proof {
    /// Returns a proof that assumes nothing.
    pub(crate) fn new(by: Vec<&'static str>) -> Self {
        Self { by, given: None }
    }
}

/// The reason why a block without equations is open.
pub const NOT_STRAIGHT: &str = "its clock edge is not told as equations; its vectors stand";

/// Proves a block's VHDL equal to the block. Each query has this time.
///
/// # Errors
///
/// [`Error`] when a tool is missing, the VHDL does not synthesise, or its registers are not those of the block.
pub fn prove(block: &dyn AnyBlock, setup: impl Into<Setup>, limit: Duration) -> Result<Verdict, Error> {
    let setup = setup.into();
    let Some(equations) = block.equations() else {
        return Ok(match Netlist::new(block, &setup)? {
            Ok(_) => Verdict::Open(NOT_STRAIGHT.to_string()),
            Err(why) => Verdict::Refused(why),
        });
    };
    solver::known(setup.timeout)?;
    if tried::can_be(&equations) {
        return tried::tried(&equations, &setup, limit);
    }
    match Netlist::new(block, &setup)? {
        Ok(netlist) => ask(&equations, &netlist, limit),
        Err(why) => Ok(Verdict::Refused(why)),
    }
}

fn ask(equations: &ClockEdge, netlist: &Netlist, limit: Duration) -> Result<Verdict, Error> {
    let edge = Edge::new(equations, netlist);
    let mut solvers = Vec::new();
    let mut is_so = |query: Query| -> Result<bool, Error> {
        Ok(matches!(answered(&query, limit, &mut solvers)?, Answer::Unsatisfiable))
    };
    // A net that is proved equal to the equations' number may be anything in later queries. A difference that a solver
    // then finds need not lie in a reachable state, and nets may share bits. So fewer nets are left free at each try,
    // and at last none.
    let mut nets = Vec::new();
    for net in edge.nets()? {
        if is_so(edge.net(&net, &nets)?)? || !nets.is_empty() && is_so(edge.net(&net, &[])?)? {
            nets.push(net);
        }
    }
    let mut is_shown = false;
    for first in 0..nets.len() {
        is_shown = is_shown || is_so(edge.edge(&nets[first..])?)?;
    }
    let mut questions = Vec::new();
    questions.extend((!is_shown).then_some(Question::Edge));
    questions.extend(netlist.is_clocked.then_some(Question::Reset));
    for question in questions {
        if let Some(other) = decided(&edge, question, limit, &mut solvers)? {
            return Ok(other);
        }
    }
    for query in query::claims(equations) {
        if let Some(other) = told(equations.block.name(), &query, answered(&query, limit, &mut solvers)?) {
            return Ok(other);
        }
    }
    Ok(Verdict::Proved(Proof::new(solvers)))
}

/// Returns the verdict that a question gives where it does not prove the block. A refutation says which outputs and
/// registers unknown bits reach, if any.
pub(crate) fn decided(
    edge: &Edge,
    question: Question,
    limit: Duration,
    solvers: &mut Vec<&'static str>,
) -> Result<Option<Verdict>, Error> {
    let query = edge.pose(question)?;
    let mut verdict = told(edge.name(), &query, answered(&query, limit, solvers)?);
    if let Some(Verdict::Refuted(about, around)) = &mut verdict
        && let Some(query) = edge.about_unknown(question)?
        && let (Answer::Satisfiable(model), _) = solver::race(&query, limit)?
    {
        *about += &format!(", where {} is unknown (X, Z or driven by nothing)", query.reached(&model).join(", "));
        *around = query.read(edge.name(), &model);
    }
    Ok(verdict)
}

/// Returns the verdict of an answer that proves nothing.
fn told(name: &'static str, query: &Query, answer: Answer) -> Option<Verdict> {
    match answer {
        Answer::Unsatisfiable => None,
        Answer::Satisfiable(model) => Some(Verdict::Refuted(query.about.clone(), query.read(name, &model))),
        Answer::Unknown(why) => Some(Verdict::Open(format!("about {}, {why}", query.about))),
    }
}

/// Returns the answer to a question. An impossible premise is refused, because everything would follow from it.
fn answered(query: &Query, limit: Duration, solvers: &mut Vec<&'static str>) -> Result<Answer, Error> {
    let (answer, solver) = solver::race(query, limit)?;
    if matches!(answer, Answer::Unsatisfiable) {
        if !solver::is_possible(query, limit)? {
            let about = &query.about;
            return Err(Error::file(format!("no state is possible in what is asked about {about}")));
        }
        solvers.push(solver);
    }
    Ok(answer)
}

/// The tools that a proof needs.
pub(crate) const TOOLS: [Tool; 5] = [Tool::Ghdl, Tool::Yosys, Tool::Z3, Tool::Yices, Tool::Bitwuzla];
