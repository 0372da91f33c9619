//! Commands as a shell reads them, to be shown.

use hpu_cosim::script::{Script, Shell};

/// Returns overrides as options, each after a space.
pub fn set_options(overrides: &[(String, String)]) -> String {
    overrides.iter().map(|(key, value)| format!(" --set {key}={}", quoted(value))).collect()
}

/// Returns a word quoted for a shell.
pub fn quoted(word: &str) -> String {
    Script::<Shell>::word(word).to_string()
}
