//! How the program ends: exit codes are a contract.

use std::fmt;
use std::path::Path;

/// An exit code.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Exit {
    /// All is well.
    Fine = 0,
    /// A mismatch, or an unmet expectation.
    Differs = 1,
    /// Wrong usage; a place for output that cannot be used is wrong usage too.
    Usage = 2,
    /// A needed tool is missing.
    NoTool = 3,
    /// A bad scene, vector or data file, or a file that could not be written to its end (a full disk).
    BadFile = 4,
    /// Interrupted.
    Interrupted = 130,
}

impl Exit {
    /// Fine when something holds.
    pub fn when(holds: bool) -> Self {
        if holds { Self::Fine } else { Self::Differs }
    }
}

/// Why the program could not do what it was asked.
#[derive(Debug)]
pub struct Failure {
    exit: Exit,
    message: String,
}

impl Failure {
    /// With any exit code.
    pub fn new(exit: Exit, message: impl fmt::Display) -> Self {
        Self { exit, message: message.to_string() }
    }

    /// Wrong usage.
    pub fn usage(message: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, message)
    }

    /// A bad file.
    pub fn file(message: impl fmt::Display) -> Self {
        Self::new(Exit::BadFile, message)
    }

    /// A file that could not be read, or not be written to its end.
    pub fn at(path: &Path, error: impl fmt::Display) -> Self {
        Self::file(format!("{}: {error}", path.display()))
    }

    /// The code to end with.
    pub fn exit(&self) -> Exit {
        self.exit
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.message)
    }
}
