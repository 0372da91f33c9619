//! Why a block's cost could not be determined.

use std::fmt;

use crate::engines::ghdl::GhdlError;
use crate::engines::tool::{Tool, ToolError};

/// Why a block's cost could not be determined.
#[derive(Debug)]
pub enum CostError {
    /// A tool is missing or at fault, GHDL refused the VHDL, or a file could not be read or written.
    Ghdl(GhdlError),
    /// A tool refused its input.
    Failed {
        /// The tool.
        tool: Tool,
        /// The block it was working on.
        block: String,
        /// The end of its output.
        said: String,
    },
}

impl fmt::Display for CostError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Ghdl(error) => error.fmt(f),
            Self::Failed { tool, block, said } => {
                write!(f, "{} failed on {block}:\n{}", tool.name(), said.trim_end())
            }
        }
    }
}

impl std::error::Error for CostError {}

impl From<GhdlError> for CostError {
    fn from(error: GhdlError) -> Self {
        Self::Ghdl(error)
    }
}

impl From<ToolError> for CostError {
    fn from(error: ToolError) -> Self {
        Self::Ghdl(GhdlError::Tool(error))
    }
}

impl CostError {
    /// Returns the error of a tool that was working on a block.
    pub(super) fn of(block: &str, error: ToolError) -> Self {
        if error.refused() {
            return Self::Failed { tool: error.tool, block: block.to_string(), said: error.said };
        }
        error.into()
    }

    /// Returns the tool at fault, if a tool is at fault.
    pub fn tool(&self) -> Option<&ToolError> {
        match self {
            Self::Ghdl(error) => error.tool(),
            Self::Failed { .. } => None,
        }
    }
}
