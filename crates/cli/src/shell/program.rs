//! Where this program is, and its fingerprint, by which journals and sweeps tell one build from another.

use std::env;
use std::path::PathBuf;
use std::sync::OnceLock;

use hpu_farm::file_fingerprint;

use crate::shell::exit::Failure;

/// The files of this program, where it is a part of another one, such as Python.
pub struct Files {
    /// The file that starts this command.
    pub starter: PathBuf,
    /// The file with its code.
    pub code: PathBuf,
}

static FILES: OnceLock<Files> = OnceLock::new();

/// Says that this program is a part of another one. Must be called before anything else of this module.
pub fn is_part(files: Files) {
    FILES.get_or_init(|| files);
}

/// Returns the file that starts this command once more.
pub fn starter() -> Result<PathBuf, Failure> {
    place(|files| &files.starter)
}

/// Returns the file with the code of this program. What is made for it lies beside that file.
pub fn code() -> Result<PathBuf, Failure> {
    place(|files| &files.code)
}

fn place(part: impl Fn(&Files) -> &PathBuf) -> Result<PathBuf, Failure> {
    let own = FILES.get().map_or_else(env::current_exe, |files| Ok(part(files).clone()));
    own.map_err(|error| Failure::file(format!("the place of this program: {error}")))
}

/// Returns the [fingerprint](file_fingerprint) of this program.
pub fn fingerprint() -> Result<String, Failure> {
    file_fingerprint(&code()?).map_err(|error| Failure::file(format!("this program cannot read itself: {error}")))
}
