//! The exit codes of the program. They are a contract.

use std::fmt;
use std::path::Path;

use hpu_cosim::scene::SceneError;
use hpu_rtl::dut::was_refused;
use hpu_rtl::{Cause, Error};
use hpu_study::Kind;

/// An exit code.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Exit {
    /// Everything is well.
    Fine = 0,
    /// A mismatch, or an expectation that is not met.
    Differs = 1,
    /// Wrong usage. A place for output that cannot be used is wrong usage, too.
    Usage = 2,
    /// A needed tool is missing, or too old.
    NoTool = 3,
    /// A bad scene, vector or data file, a file that could not be written to its end (a full disk), or a tool that
    /// failed.
    BadFile = 4,
    /// Interrupted by SIGINT, or by a signal of another number.
    Interrupted = 130,
}

impl Exit {
    /// Returns the failure with this code, if it is one that a command ends with by itself.
    pub fn of(code: i32) -> Option<Self> {
        [Self::Differs, Self::Usage, Self::NoTool, Self::BadFile].into_iter().find(|exit| *exit as i32 == code)
    }

    /// Returns `Fine` if `holds`, else `Differs`.
    pub fn when(holds: bool) -> Self {
        if holds { Self::Fine } else { Self::Differs }
    }
}

/// The reason why the program could not do its job, with the exit code.
#[derive(Debug)]
pub struct Failure {
    exit: Exit,
    message: String,
}

impl Failure {
    /// Returns a failure with any exit code.
    pub fn new(exit: Exit, message: impl fmt::Display) -> Self {
        Self { exit, message: message.to_string() }
    }

    /// Returns a failure of usage.
    pub fn usage(message: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, message)
    }

    /// Returns a failure of a bad file.
    pub fn file(message: impl fmt::Display) -> Self {
        Self::new(Exit::BadFile, message)
    }

    /// Returns the failure of a file that could not be read, or not be written to its end.
    pub fn at(path: &Path, error: impl fmt::Display) -> Self {
        Self::file(format!("{}: {error}", path.display()))
    }

    /// Returns the failure of a command that a signal has stopped.
    pub fn interrupted() -> Self {
        Self::new(Exit::Interrupted, "interrupted")
    }

    /// Returns the exit code.
    pub fn exit(&self) -> Exit {
        self.exit
    }
}

/// Returns the failure of a command that has refused to simulate a design, and so has no whole result.
pub fn refused() -> Option<Failure> {
    let why = "a design is code that runs on this machine, and HPU_NO_DUT or --no-dut forbids to simulate it";
    was_refused().then(|| Failure::usage(why))
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

/// All errors of the scene, not the first alone.
impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::file(format!("{error:#}"))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let exit = match error.cause() {
            Cause::NoTool => Exit::NoTool,
            Cause::Stopped => Exit::Interrupted,
            Cause::Tool | Cause::File => Exit::BadFile,
            // VHDL or a design that a tool refuses, or that ends its simulation, has not passed the check.
            Cause::Design => Exit::Differs,
            Cause::Usage => Exit::Usage,
        };
        Self::new(exit, error)
    }
}

impl From<hpu_cosim::dut::Fault> for Failure {
    fn from(fault: hpu_cosim::dut::Fault) -> Self {
        Error::from(fault).into()
    }
}

/// A study of scenes ends as a run of one of them does.
impl From<hpu_study::Error> for Failure {
    fn from(error: hpu_study::Error) -> Self {
        let (kind, message) = (error.kind(), error.to_string());
        match (kind, error.into_fault()) {
            (_, Some(fault)) if fault.to_string() == message => fault.into(),
            (_, Some(fault)) => Self { message, ..fault.into() },
            (Kind::Usage, None) => Self::usage(message),
            _ => Self::file(message),
        }
    }
}
