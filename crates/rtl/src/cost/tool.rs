//! Running GHDL, Yosys and nextpnr, each for a limited time.

use std::ffi::OsStr;
use std::fmt;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::Command;

use crate::ghdl::GhdlError;

/// Processor time that a tool may take. What it starts itself is limited likewise, so that nothing is left running.
const LIMIT_S: u32 = 600;
/// Lines of a failing tool that are shown.
const LAST_LINES: usize = 12;

/// A tool of the flow.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Tool {
    Ghdl,
    Yosys,
    Nextpnr,
}

impl Tool {
    /// The command.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ghdl => "ghdl",
            Self::Yosys => "yosys",
            Self::Nextpnr => "nextpnr-ice40",
        }
    }
}

/// Why a block has no cost.
#[derive(Debug)]
pub enum CostError {
    /// GHDL is missing or refused the VHDL, or a file could not be read or written.
    Ghdl(GhdlError),
    /// There is no such command on the PATH.
    Missing(&'static str),
    /// A tool refused or stopped.
    Failed {
        /// The tool.
        tool: &'static str,
        /// The block it was to work on.
        block: String,
        /// The last that it said.
        said: String,
    },
    /// A tool was killed after its processor time, 10 minutes.
    TooLong {
        /// The tool.
        tool: &'static str,
        /// The block it was to work on.
        block: String,
    },
}

impl fmt::Display for CostError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Ghdl(error) => error.fmt(f),
            Self::Missing(tool) => {
                write!(
                    f,
                    "`{tool}` is not installed; on Debian: apt install ghdl-mcode yosys nextpnr-ice40 fpga-icestorm"
                )
            }
            Self::Failed { tool, block, said } => write!(f, "{tool} failed on {block}:\n{}", said.trim_end()),
            Self::TooLong { tool, block } => {
                write!(f, "{tool} was killed on {block}: no end after {} minutes", LIMIT_S / 60)
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

/// Runs a tool in a directory; what it said, first on its standard output, then on its standard error.
pub fn run(
    dir: &Path,
    tool: Tool,
    block: &str,
    arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
) -> Result<String, CostError> {
    limited(dir, tool.name(), block, arguments, LIMIT_S)
}

fn limited(
    dir: &Path,
    tool: &'static str,
    block: &str,
    arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
    limit_s: u32,
) -> Result<String, CostError> {
    let io = |error| CostError::Ghdl(GhdlError::Io(tool.into(), error));
    // The shell's limit is inherited by the tool and by what the tool starts (Yosys runs abc).
    let output = Command::new("/bin/sh")
        .args(["-c", r#"ulimit -t "$0"; exec "$@""#, &limit_s.to_string(), tool])
        .args(arguments)
        .current_dir(dir)
        .output()
        .map_err(io)?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, complaints) = (text(&output.stdout), text(&output.stderr));
    let block = block.to_string();
    match (output.status.code(), output.status.signal()) {
        (Some(0), _) if tool == Tool::Ghdl.name() => Ok(out),
        (Some(0), _) => Ok(out + &complaints),
        (Some(127), _) => Err(CostError::Missing(tool)),
        // The limit ends in SIGXCPU or SIGKILL.
        (_, Some(24 | 9)) => Err(CostError::TooLong { tool, block }),
        _ => Err(CostError::Failed { tool, block, said: last_lines(&(out + &complaints)) }),
    }
}

fn last_lines(said: &str) -> String {
    let lines: Vec<&str> = said.lines().collect();
    lines[lines.len().saturating_sub(LAST_LINES)..].join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sh(script: &str, limit_s: u32) -> Result<String, CostError> {
        limited(&std::env::temp_dir(), "sh", "a block", ["-c", script], limit_s)
    }

    #[test]
    fn a_tool_that_never_ends_is_killed_with_what_it_started() {
        let killed = sh("while :; do :; done", 1);
        assert!(matches!(killed, Err(CostError::TooLong { tool: "sh", .. })), "{killed:?}");
    }

    #[test]
    fn a_tool_that_fails_is_quoted_with_its_last_lines() {
        let failed = sh("for i in $(seq 100); do echo line $i; done; echo 'ERROR: why' >&2; exit 1", 10);
        let message = failed.expect_err("it failed").to_string();
        assert!(message.starts_with("sh failed on a block:\nline 90\n"), "{message}");
        assert!(message.ends_with("line 100\nERROR: why"), "{message}");
    }
}
