//! Designs of the user's own, built and simulated by GHDL or Verilator. Each is a process that answers one kind of
//! request: clock so many edges with these inputs.
//!
//! A built model is kept in a folder whose name is the SHA-256 of the design's files, its generics, its interface to
//! the world and the tools.

mod build;
mod cost;
mod ghdl;
mod interface;
mod process;
mod transition;
mod verilator;

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use hpu_cosim::dut::{Design, Designs, Fault, Port};
use hpu_cosim::scene::{DutScene, Engine, SourceFile};

use crate::cache_folder::CacheFolder;
use crate::hdl::Setup;
use crate::tool::{Fault as ToolFault, Tool, ToolError};

pub(crate) use build::Model;
pub use cost::DutCost;
pub(crate) use ghdl::{bench, bridge, simulate};
pub(crate) use interface::interface;
pub(crate) use process::{ANSWER, Process};
pub(crate) use transition::{INVARIANT, Transition};

/// Why a design could not be built or simulated.
#[derive(Debug)]
pub enum DutError {
    /// A tool is missing, or did not do its job.
    Tool(ToolError),
    /// A tool refused the design; its message is shortened.
    Refused {
        /// The tool.
        tool: Tool,
        /// The design's topmost unit.
        top: String,
        /// The tool's message.
        said: String,
    },
    /// The simulation ended, or did not answer.
    Lost {
        /// The fault.
        error: ToolError,
        /// The last clock edge that the simulation answered for.
        edge: u64,
    },
    /// Something that is needed is missing, or the run cannot go on; the text says why.
    Ended(String),
    /// A file could not be read or written.
    Io(PathBuf, std::io::Error),
}

impl fmt::Display for DutError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Tool(error) => error.fmt(f),
            Self::Refused { tool, top, said } => write!(f, "{} refuses `{top}`:\n{}", tool.name(), said.trim_end()),
            Self::Ended(said) => f.write_str(said.trim_end()),
            Self::Lost { error: ToolError { tool, fault, said, .. }, edge } => {
                let tool = tool.name();
                let head = format!("the simulation by {tool} ended");
                match fault {
                    ToolFault::TooLong(limit) => {
                        let limit_s = limit.as_secs_f64();
                        write!(f, "the design does not end a step: {tool} gave no answer for {limit_s} s")?;
                    }
                    ToolFault::Failed(code) => write!(f, "{head} with code {code}")?,
                    ToolFault::Killed(signal) => write!(f, "{head} by signal {signal}")?,
                    ToolFault::Stopped => write!(f, "{head}, for it was stopped,")?,
                    _ => write!(f, "{head} without an answer")?,
                }
                write!(f, " after clock edge {edge}")?;
                if said.trim().is_empty() {
                    f.write_str("; it said nothing")
                } else {
                    write!(f, ":\n{}", said.trim_end())
                }
            }
            Self::Io(path, error) => write!(f, "{}: {error}", path.display()),
        }
    }
}

impl std::error::Error for DutError {}

impl From<Fault> for DutError {
    /// Returns the `DutError` inside a fault of a running simulator; any other fault becomes
    /// [`Ended`](DutError::Ended).
    fn from(fault: Fault) -> Self {
        fault.downcast().map_or_else(|other| Self::Ended(other.to_string()), |error| *error)
    }
}

impl DutError {
    /// Returns the error of a tool that worked on a design: the tool refused the design, or failed by itself.
    fn of(top: &str, error: ToolError) -> Self {
        if error.refused() {
            return Self::Refused { tool: error.tool, top: top.to_string(), said: error.said };
        }
        Self::Tool(error)
    }
}

/// The installed simulators.
#[derive(Clone, Debug)]
pub struct Simulators {
    /// The folder in which built models are kept.
    pub cache: CacheFolder,
    /// The shared library that GHDL calls, and the time limit of a tool.
    pub setup: Setup,
}

impl Simulators {
    /// Builds a design that is compared with a block: VHDL in GHDL, which knows unknown bits, Verilog in Verilator.
    pub(crate) fn of_model(&self, model: &Model) -> Result<Box<dyn Design>, DutError> {
        if is_vhdl(&model.dut.files) {
            return Ok(Box::new(self.ghdl(model, "", false)?));
        }
        Ok(Box::new(self.verilator(model, false)?))
    }

    /// Returns the ports of such a design, of which no program is made.
    pub(crate) fn ports_of_model(&self, model: &Model) -> Result<Vec<Port>, DutError> {
        if is_vhdl(&model.dut.files) {
            return Ok(self.ghdl(model, "", false)?.ports().to_vec());
        }
        self.ports_of_verilog(model)
    }
}

impl Designs for Simulators {
    fn build(&self, scene: &DutScene, inside: bool) -> Result<Arc<dyn Design>, Fault> {
        let (is_vhdl, model) = (is_vhdl(&scene.dut.files), Model::of(scene));
        let built: Result<Arc<dyn Design>, DutError> = match (scene.dut.engine, is_vhdl) {
            (Engine::Ghdl, false) => {
                return Err(scene.error("dut.engine", "GHDL reads VHDL; write \"verilator\" or \"auto\"").into());
            }
            (Engine::Ghdl, true) => self.ghdl(&model, "", inside).map(|design| Arc::new(design) as Arc<dyn Design>),
            (Engine::Verilator, _) | (Engine::Auto, false) => {
                self.verilator(&model, inside).map(|design| Arc::new(design) as _)
            }
            (Engine::Auto, true) => match self.verilator(&model, inside) {
                Ok(design) => Ok(Arc::new(design) as _),
                // A design that GHDL itself refuses is refused. If only the way through Verilog fails, GHDL simulates
                // it.
                Err(DutError::Tool(error)) if error.tool != Tool::Verilator || !error.is_unusable() => {
                    Err(DutError::Tool(error))
                }
                Err(error) => {
                    let why = match &error {
                        DutError::Tool(_) => "; there is no Verilator".to_string(),
                        error => format!("; Verilator does not take it: {}", first_line(&error.to_string())),
                    };
                    self.ghdl(&model, &why, inside).map(|design| Arc::new(design) as _)
                }
            },
        };
        built.map_err(Into::into)
    }
}

/// Joins the head of a message and the line after it.
fn first_line(said: &str) -> String {
    let mut lines = said.lines();
    let (head, next) = (lines.next().unwrap_or_default(), lines.next().unwrap_or_default());
    format!("{} {}", head.trim_end_matches(':'), next.trim()).trim().to_string()
}

/// Returns whether a design is VHDL.
pub(crate) fn is_vhdl(files: &[SourceFile]) -> bool {
    files.iter().any(|(name, _)| name.ends_with(".vhd") || name.ends_with(".vhdl"))
}
