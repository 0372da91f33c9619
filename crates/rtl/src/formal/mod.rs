//! Proofs: a block's VHDL equals the emulator for all inputs in all states, not only on vectors.
//!
//! GHDL synthesises the VHDL, with the same repairs as for costs. Yosys writes the netlist as a transition in SMT-LIB;
//! every unknown bit in it may be 0 or 1. The block's equations ([`AnyStep`]) become terms over the same inputs, and
//! over registers read from the netlist's. A solver looks for a state and inputs for which an output, or a register
//! after the edge, differs: *unsatisfiable* is the proof. The proof assumes the formats of registers in the state, and
//! shows them in the next state. A second query does the same for the reset.
//!
//! A block made of blocks has no equations of its own. [`Prover`] compares its netlist with the wiring that the
//! emulator states ([`AnyBlock::parts`]), and proves each block inside once.

mod cache;
mod cells;
mod netlist;
mod prover;
mod query;
mod solver;
mod tried;
mod wiring;

use std::fmt;
use std::time::Duration;

use hpu_datapath::{AnyBlock, AnyStep};
use hpu_wave::Around;

use crate::cost::CostError;
use crate::entity::EntityError;
use crate::hdl::Setup;
use crate::tool::{Tool, ToolError};

use query::Query;
use solver::Answer;

pub use cache::Proofs;
pub(crate) use netlist::{FLAT, Links, Netlist, TRANSITION};
pub use prover::{Part, Prover};
pub(crate) use query::Edge;

/// The result of a block's proof.
#[derive(Clone, PartialEq, Debug)]
pub enum Verdict {
    /// Proved for all inputs and states. The names are the solvers that answered each query, or GHDL if it tried all
    /// inputs.
    Proved(Vec<&'static str>),
    /// Refuted: an output or a register after the edge differs. The text says whether an edge or the reset was asked
    /// about; the row shows the edge. A register's word after the edge has its name with a prime.
    Refuted(String, Around),
    /// Not proved, and the reason.
    Open(String),
    /// The wiring of a block made of blocks is equal. The parts are the blocks on which it rests, with their verdicts.
    Wired(Vec<Part>),
    /// The wiring of a block made of blocks differs; this is the first difference.
    Miswired(String),
}

/// The reason why a proof could not be tried.
#[derive(Debug)]
pub enum ProofError {
    /// A tool is missing, or failed.
    Tool(ToolError),
    /// The VHDL, or the netlist made of it, was refused.
    Cost(CostError),
    /// The netlist and the equations do not belong together.
    Netlist(String),
    /// The request about a block of the user's own is impossible, or its tools failed.
    Entity(EntityError),
}

impl fmt::Display for ProofError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Tool(error) => error.fmt(f),
            Self::Cost(error) => error.fmt(f),
            Self::Netlist(why) => f.write_str(why),
            Self::Entity(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ProofError {}

impl ProofError {
    /// Returns the tool that failed, if one did.
    pub fn tool(&self) -> Option<&ToolError> {
        match self {
            Self::Tool(error) => Some(error),
            Self::Cost(error) => error.tool(),
            Self::Netlist(_) | Self::Entity(_) => None,
        }
    }
}

impl<E: Into<EntityError>> From<E> for ProofError {
    fn from(error: E) -> Self {
        Self::Entity(error.into())
    }
}

impl From<ToolError> for ProofError {
    fn from(error: ToolError) -> Self {
        Self::Tool(error)
    }
}

impl From<CostError> for ProofError {
    fn from(error: CostError) -> Self {
        Self::Cost(error)
    }
}

/// The reason why a block without equations is open.
pub const NOT_STRAIGHT: &str = "its clock edge is not told as equations; its vectors stand";

/// Proves a block's VHDL equal to the block. Each query has this time.
///
/// # Errors
///
/// [`ProofError`] when a tool is missing, the VHDL does not synthesise, or its registers are not those of the block.
pub fn prove(block: &dyn AnyBlock, setup: impl Into<Setup>, limit: Duration) -> Result<Verdict, ProofError> {
    let Some(equations) = block.equations() else { return Ok(Verdict::Open(NOT_STRAIGHT.to_string())) };
    let setup = setup.into();
    solver::known(setup.timeout)?;
    if tried::can_be(equations) {
        return tried::tried(equations, &setup, limit);
    }
    ask(equations, &Netlist::new(block, &setup)?, limit)
}

fn ask(equations: &dyn AnyStep, netlist: &Netlist, limit: Duration) -> Result<Verdict, ProofError> {
    let registers = AnyStep::registers(equations);
    let edge = Edge::new(equations, netlist, &registers);
    let mut solvers = Vec::new();
    let mut is_so = |query: Query| -> Result<bool, ProofError> {
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
    let whole = if is_shown { None } else { Some(edge.edge(&[])?) };
    for query in whole.into_iter().chain(edge.reset()).chain(query::claims(equations)) {
        if let Some(other) = decided(equations.name(), &query, limit, &mut solvers)? {
            return Ok(other);
        }
    }
    Ok(Verdict::Proved(solvers))
}

/// Returns the verdict that a question gives where it does not prove the block.
pub(crate) fn decided(
    name: &'static str,
    query: &Query,
    limit: Duration,
    solvers: &mut Vec<&'static str>,
) -> Result<Option<Verdict>, ProofError> {
    Ok(match answered(query, limit, solvers)? {
        Answer::Unsatisfiable => None,
        Answer::Satisfiable(model) => Some(Verdict::Refuted(query.about.clone(), query.read(name, &model))),
        Answer::Unknown(why) => Some(Verdict::Open(format!("about {}, {why}", query.about))),
    })
}

/// Returns the answer to a question. An impossible premise is refused, because everything would follow from it.
fn answered(query: &Query, limit: Duration, solvers: &mut Vec<&'static str>) -> Result<Answer, ProofError> {
    let (answer, solver) = solver::race(query, limit)?;
    if matches!(answer, Answer::Unsatisfiable) {
        if !solver::is_possible(query, limit)? {
            let about = &query.about;
            return Err(ProofError::Netlist(format!("no state is possible in what is asked about {about}")));
        }
        solvers.push(solver);
    }
    Ok(answer)
}

/// The tools that a proof needs.
pub const TOOLS: [Tool; 5] = [Tool::Ghdl, Tool::Yosys, Tool::Z3, Tool::Yices, Tool::Bitwuzla];
