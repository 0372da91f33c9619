//! Commands as results tell them: each runs again what made the result.

use std::path::Path;

use crate::scene::{quoted, set_options};

/// The text of a command, which grows word by word.
pub struct CommandLine(String);

impl CommandLine {
    /// Begins a command of a verb.
    pub fn new(verb: &str) -> Self {
        Self(format!("hpu {verb}"))
    }

    /// Adds words, quoted for a shell.
    #[must_use]
    pub fn words(self, words: impl IntoIterator<Item = impl ToString>) -> Self {
        Self(words.into_iter().fold(self.0, |text, word| text + " " + &quoted(&word.to_string())))
    }

    /// Adds an option with each of these values, quoted for a shell.
    #[must_use]
    pub fn option(self, name: &str, values: impl IntoIterator<Item = impl ToString>) -> Self {
        self.plain(name, values.into_iter().map(|value| quoted(&value.to_string())))
    }

    /// Adds an option with each of these values, which need no quotes.
    #[must_use]
    pub fn plain(self, name: &str, values: impl IntoIterator<Item = impl ToString>) -> Self {
        Self(values.into_iter().fold(self.0, |text, value| format!("{text} {name} {}", value.to_string())))
    }

    /// Adds an option without a value, if it was given.
    #[must_use]
    pub fn flag(self, name: &str, is_given: bool) -> Self {
        Self(if is_given { self.0 + " " + name } else { self.0 })
    }

    /// Adds the changes of the scene.
    #[must_use]
    pub fn set(self, overrides: &[(String, String)]) -> Self {
        Self(self.0 + &set_options(overrides))
    }

    /// Returns the text.
    pub fn text(self) -> String {
        self.0
    }
}

/// Returns the folder of a command's files as an option.
pub fn out_option(out: Option<&Path>) -> String {
    out.map_or(String::new(), |out| format!(" -o {}", quoted(&out.display().to_string())))
}
