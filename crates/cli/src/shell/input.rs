//! Files and the standard input as text, with the command's failures.

use std::path::Path;

use crate::shell::exit::Failure;

/// Reads, as text, a file that the command line names; it may be a pipe.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    hpu_cosim::read_text(path).map_err(Failure::file)
}

/// Reads the standard input as text.
pub fn read_stdin() -> Result<String, Failure> {
    hpu_cosim::read_stdin().map_err(Failure::file)
}
