//! Why a block has no cost.

use std::fmt;

use crate::ghdl::GhdlError;
use crate::tool::{Tool, ToolError};

/// Why a block has no cost.
#[derive(Debug)]
pub enum CostError {
    /// A tool is missing or at fault, GHDL refused the VHDL, or a file could not be read or written.
    Ghdl(GhdlError),
    /// A tool refused what it was given.
    Failed {
        /// The tool.
        tool: Tool,
        /// The block it was to work on.
        block: String,
        /// The last that it said.
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
    /// Of a tool that was to work on a block.
    pub(super) fn of(block: &str, error: ToolError) -> Self {
        if error.refused() {
            return Self::Failed { tool: error.tool, block: block.to_string(), said: error.said };
        }
        error.into()
    }

    /// The tool that is to blame, if one is.
    #[must_use]
    pub fn tool(&self) -> Option<&ToolError> {
        match self {
            Self::Ghdl(error) => error.tool(),
            Self::Failed { .. } => None,
        }
    }
}
