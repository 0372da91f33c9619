//! The reasons why VHDL could not be run.

use std::fmt;
use std::io;
use std::path::PathBuf;

use crate::engines::tool::{Tool, ToolError};

/// Why VHDL could not be run.
#[derive(Debug)]
pub enum GhdlError {
    /// A tool is missing, or did not do its job.
    Tool(ToolError),
    /// A file could not be read or written.
    Io(PathBuf, io::Error),
    /// The scene cannot be run in VHDL.
    Scene(String),
    /// GHDL refused the VHDL, or the VHDL ended its own run with a failure.
    Failed {
        /// The step that failed.
        step: String,
        /// GHDL's message.
        said: String,
    },
}

impl fmt::Display for GhdlError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Tool(error) => error.fmt(f),
            Self::Io(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Scene(why) => f.write_str(why),
            Self::Failed { step, said } => write!(f, "ghdl could not {step}:\n{}", said.trim_end()),
        }
    }
}

impl std::error::Error for GhdlError {}

impl From<ToolError> for GhdlError {
    /// Converts a fault of a tool: a message of GHDL about the VHDL becomes [`Failed`](GhdlError::Failed), everything
    /// else stays a fault of the tool.
    fn from(error: ToolError) -> Self {
        if error.tool == Tool::Ghdl && error.refused() {
            return Self::Failed { step: error.step, said: error.said };
        }
        Self::Tool(error)
    }
}

impl GhdlError {
    /// Returns the tool at fault, if a tool is at fault.
    pub fn tool(&self) -> Option<&ToolError> {
        match self {
            Self::Tool(error) => Some(error),
            _ => None,
        }
    }
}
