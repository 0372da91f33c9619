//! Commands as a shell reads them.

/// Returns overrides as options, each after a space.
pub fn set_options(overrides: &[(String, String)]) -> String {
    overrides.iter().map(|(key, value)| format!(" --set {key}={}", quoted(value))).collect()
}

/// Returns a word quoted for a shell.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-+/:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}
