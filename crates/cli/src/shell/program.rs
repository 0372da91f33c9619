//! The fingerprint of this program. By it, journals and sweeps tell one build from another.

use std::env;

use hpu_farm::file_fingerprint;

use crate::shell::exit::Failure;

/// Returns the [fingerprint](file_fingerprint) of this program.
pub fn fingerprint() -> Result<String, Failure> {
    let print = env::current_exe().and_then(|program| file_fingerprint(&program));
    print.map_err(|error| Failure::file(format!("this program cannot read itself: {error}")))
}
