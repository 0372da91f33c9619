//! The command `hpu`, for the entry point of the package.

use std::ffi::OsString;
use std::panic::catch_unwind;
use std::path::PathBuf;

use pyo3::prelude::*;

/// Exit code of a Rust program that has panicked.
const PANICKED: u8 = 101;

/// Runs the command and returns its exit code. `words` are its name and its arguments, `starter` is the file that
/// starts it, and `code` is this module's file. SIGINT must have no handler.
#[pyfunction]
pub fn _command(py: Python, words: Vec<OsString>, starter: PathBuf, code: PathBuf) -> u8 {
    py.detach(|| catch_unwind(|| hpu_cli::ran_in(&words, starter, code)).unwrap_or(PANICKED))
}
