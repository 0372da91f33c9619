//! Why this crate could not do its job.

use std::fmt;
use std::io;
use std::path::PathBuf;

use hpu_cosim::dut::Unfit;
use hpu_datapath::ConfigError;

use crate::engines::fault::Fault;
use crate::engines::tool::{Tool, ToolError};

/// Why VHDL, a design of the user's own, or a tool did not do what was asked. The text names the place, and the remedy
/// where there is one.
#[derive(Debug)]
pub struct Error(Box<Reason>);

/// What an [`Error`] asks of the user.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cause {
    /// A tool, or the emulator's shared library, is missing, too old, or cannot be started.
    NoTool,
    /// A tool was stopped because the program is ending.
    Stopped,
    /// A tool failed by itself.
    Tool,
    /// VHDL or a design did not pass: a tool refuses it, or its simulation ended.
    Design,
    /// The request cannot be met.
    Usage,
    /// A file, a scene or a netlist is wrong, or a tool refused VHDL that is not under test.
    File,
}

/// The reasons, for this crate.
#[derive(Debug)]
pub(crate) enum Reason {
    /// A tool is missing, or did not do its job.
    Tool(ToolError),
    /// The simulation of a design ended, or did not answer, after this clock edge.
    Lost(ToolError, u64),
    /// An output that drives the device depends on a value that nothing has set; the text names both.
    Unset(String),
    /// A tool refused its input.
    Refused {
        /// What was refused, in words.
        what: String,
        /// The tool's message.
        said: String,
        /// Whether the input is what is under test.
        is_under_test: bool,
    },
    /// The value of a generic of this name cannot be written in the design's language; the text says why.
    Generic(String, String),
    /// The value of a scene's key is wrong; the text says why.
    Key(String, String),
    /// A port of this name cannot be connected; the text says why.
    Port(String, String),
    /// A file could not be read or written.
    Io(PathBuf, io::Error),
    /// Anything else, in words.
    Other(Cause, String),
}

impl Error {
    /// Returns the error of a file that could not be read or written.
    pub(crate) fn io(path: impl Into<PathBuf>, error: io::Error) -> Self {
        Reason::Io(path.into(), error).into()
    }

    /// Returns the error of a wrong file, scene or netlist.
    pub(crate) fn file(why: impl fmt::Display) -> Self {
        Reason::Other(Cause::File, why.to_string()).into()
    }

    /// Returns the error of a request that cannot be met.
    pub(crate) fn usage(why: impl fmt::Display) -> Self {
        Reason::Other(Cause::Usage, why.to_string()).into()
    }

    /// Returns the error of a design whose run cannot go on.
    pub(crate) fn ended(why: impl fmt::Display) -> Self {
        Reason::Other(Cause::Design, why.to_string().trim_end().to_string()).into()
    }

    /// Returns the error of a generic whose value cannot be written.
    pub(crate) fn generic(name: impl fmt::Display, why: impl fmt::Display) -> Self {
        Reason::Generic(name.to_string(), why.to_string()).into()
    }

    /// Returns the error of a port that cannot be connected.
    pub(crate) fn port(name: impl Into<String>, why: impl Into<String>) -> Self {
        Reason::Port(name.into(), why.into()).into()
    }

    /// Returns the error of a scene's key, or of the option in its place.
    pub(crate) fn key(key: impl Into<String>, why: impl Into<String>) -> Self {
        Reason::Key(key.into(), why.into()).into()
    }

    /// Returns the error of a tool that refused what is under test.
    pub(crate) fn refused(what: String, said: impl Into<String>) -> Self {
        Reason::Refused { what, said: said.into(), is_under_test: true }.into()
    }

    /// Returns the error of VHDL that GHDL refused, or that ended its own run with a failure, at this step.
    pub(crate) fn failed(step: &str, said: impl Into<String>) -> Self {
        Self::refused(format!("ghdl could not {step}"), said)
    }

    /// Returns the error of GHDL: a message about the VHDL, or a fault of the tool.
    pub(crate) fn of_ghdl(error: ToolError) -> Self {
        if error.tool == Tool::Ghdl && error.refused() { Self::failed(&error.step, error.said) } else { error.into() }
    }

    /// Returns the same error of VHDL that is not under test, but is read for a cost or a proof.
    #[must_use]
    pub(crate) fn of_input(mut self) -> Self {
        if let Reason::Refused { is_under_test, .. } = &mut *self.0 {
            *is_under_test = false;
        }
        self
    }

    /// Returns the same error of a file with more words behind it.
    #[must_use]
    pub(crate) fn with(self, more: &str) -> Self {
        match *self.0 {
            Reason::Io(path, error) => Self::io(path, io::Error::new(error.kind(), format!("{error}{more}"))),
            reason => reason.into(),
        }
    }

    /// Returns the reason.
    pub(crate) fn reason(&self) -> &Reason {
        &self.0
    }

    /// Returns the reason.
    pub(crate) fn into_reason(self) -> Reason {
        *self.0
    }

    /// Returns what the error asks of the user.
    pub fn cause(&self) -> Cause {
        match self.reason() {
            Reason::Tool(error) if error.is_stopped() => Cause::Stopped,
            Reason::Tool(error) if error.is_unusable() => Cause::NoTool,
            Reason::Tool(_) => Cause::Tool,
            Reason::Lost(..) | Reason::Unset(_) | Reason::Refused { is_under_test: true, .. } => Cause::Design,
            Reason::Refused { .. } | Reason::Generic(..) | Reason::Key(..) | Reason::Port(..) | Reason::Io(..) => {
                Cause::File
            }
            Reason::Other(cause, _) => *cause,
        }
    }

    /// Returns whether a tool read its input and refused it.
    pub fn is_refusal(&self) -> bool {
        matches!(self.reason(), Reason::Refused { .. })
    }

    /// Returns whether a file could not be read or written.
    pub fn is_io(&self) -> bool {
        matches!(self.reason(), Reason::Io(..))
    }

    /// Returns the message of the tool that refused its input; empty for any other error.
    pub fn said(&self) -> &str {
        match self.reason() {
            Reason::Refused { said, .. } => said,
            _ => "",
        }
    }

    /// Returns the tool that is missing or failed by itself, if one is.
    pub(crate) fn tool(&self) -> Option<&ToolError> {
        match self.reason() {
            Reason::Tool(error) => Some(error),
            _ => None,
        }
    }

    /// Returns why a tool failed by itself, if one did.
    pub fn fault(&self) -> Option<&Fault> {
        self.tool().map(|error| &error.fault)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.reason() {
            Reason::Tool(error) => error.fmt(f),
            Reason::Refused { what, said, .. } => write!(f, "{what}:\n{}", said.trim_end()),
            Reason::Generic(name, why) => write!(f, "generic `{name}`: {why}"),
            Reason::Io(path, error) => write!(f, "{}: {error}", path.display()),
            Reason::Key(_, why) | Reason::Port(_, why) | Reason::Unset(why) | Reason::Other(_, why) => f.write_str(why),
            Reason::Lost(ToolError { tool, fault, said, .. }, edge) => {
                let tool = tool.name();
                let head = format!("the simulation by {tool} ended");
                match fault {
                    Fault::TooLong(limit) => {
                        let limit_s = limit.as_secs_f64();
                        write!(f, "the design does not end a step: {tool} gave no answer for {limit_s} s")?;
                    }
                    Fault::Failed(code) => write!(f, "{head} with code {code}")?,
                    Fault::Killed(signal) => write!(f, "{head} by signal {signal}")?,
                    Fault::Stopped => write!(f, "{head}, for it was stopped,")?,
                    _ => write!(f, "{head} without an answer")?,
                }
                write!(f, " after clock edge {edge}")?;
                if said.trim().is_empty() {
                    f.write_str("; it said nothing")
                } else {
                    write!(f, ":\n{}", said.trim_end())
                }
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<Reason> for Error {
    fn from(reason: Reason) -> Self {
        Self(Box::new(reason))
    }
}

impl From<ToolError> for Error {
    fn from(error: ToolError) -> Self {
        Reason::Tool(error).into()
    }
}

impl From<ConfigError> for Error {
    fn from(error: ConfigError) -> Self {
        Self::usage(error)
    }
}

/// The error inside a fault of a simulator; a design that has failed its own checks; any other fault is of a file.
impl From<hpu_cosim::dut::Fault> for Error {
    fn from(fault: hpu_cosim::dut::Fault) -> Self {
        let unfit = |fault: hpu_cosim::dut::Fault| fault.downcast::<Unfit>().map_or_else(Self::file, Self::ended);
        fault.downcast().map_or_else(unfit, |error| *error)
    }
}
