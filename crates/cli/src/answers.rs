//! The results of verbs for programs that have no terminal, such as the Python package.
//!
//! Options are those of the command, as its words. A [`Watch`] of the caller stops the work and hears of its progress.
//! Nothing is printed, no signal is handled, no file is written.

use clap::Args;
use serde_json::Value;

use crate::shell::modes;
use crate::{fit as fits, identify as identified, keys as all_keys, limits as sets, map as maps, widths as bits};

pub use crate::page::Answer;
pub use crate::run::{Finished, Recorded, finished as run, table, unseen};
pub use crate::scene::{Named, first_sentence};
pub use crate::shell::exit::Failure;
pub use crate::shell::progress::Watch;
pub use crate::waves::{Chosen, layout};

/// Maps a scene over two of its keys, as `hpu map`; `None` when stopped. `words` are the options.
///
/// # Errors
///
/// As the command.
pub fn map((name, source): &Named, words: &[String], watch: Watch) -> Result<Option<Answer>, Failure> {
    maps::answer(&read("map", words, &[name])?, source, watch)
}

/// Finds the limits of a scene's wall, as `hpu limits`; `None` when stopped. `words` are the options.
///
/// # Errors
///
/// As the command.
pub fn limits((name, source): &Named, words: &[String], watch: Watch) -> Result<Option<Answer>, Failure> {
    sets::answer(&read("limits", words, &[name])?, source, watch)
}

/// Finds the least model of a scene, as `hpu fit`; `None` when stopped. `words` are the options. It has no picture.
///
/// # Errors
///
/// As the command.
pub fn fit((name, source): &Named, words: &[String], watch: Watch) -> Result<Option<Answer>, Failure> {
    let page = fits::answer(&read("fit", words, &[name])?, name, source, watch)?;
    Ok(page.map(|page| Answer { page, pictures: Vec::new() }))
}

/// Finds the values of a scene's keys that logs tell, as `hpu identify`; `None` when stopped. `words` are the options.
///
/// # Errors
///
/// As the command.
pub fn identify(
    (name, source): &Named,
    logs: &[String],
    words: &[String],
    watch: Watch,
) -> Result<Option<Answer>, Failure> {
    let scene_and_logs: Vec<&str> = [name].into_iter().chain(logs).map(String::as_str).collect();
    identified::answer(&read("identify", words, &scene_and_logs)?, source, watch)
}

/// Finds the bits that the signals of these scenes need, as `hpu widths` without its search and its prices; `None` when
/// stopped. `words` are the options.
///
/// # Errors
///
/// As the command.
pub fn widths(scenes: &[Named], words: &[String], watch: Watch) -> Result<Option<Answer>, Failure> {
    let names: Vec<&str> = scenes.iter().map(|(name, _)| &**name).collect();
    bits::answer(&read("widths", words, &names)?, scenes, watch)
}

/// Returns the keys of a section of a scene, those with a word in name or meaning, or all, as `hpu keys --json`.
///
/// # Errors
///
/// The sections that there are, when the word finds no key.
pub fn keys(word: Option<&str>) -> Result<Value, Failure> {
    all_keys::matching(word).map(|found| all_keys::as_data(&found))
}

/// Reads the options of a verb, and the names of its scenes.
pub(crate) fn read<A: Args>(verb: &'static str, words: &[String], scenes: &[&str]) -> Result<A, Failure> {
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--"]).chain(scenes.iter().copied()).collect();
    read_words(verb, &words)
}

/// Reads the words of a verb: its options, `--`, its scenes.
pub(crate) fn read_words<A: Args>(verb: &'static str, words: &[impl AsRef<str>]) -> Result<A, Failure> {
    let words = words.iter().map(AsRef::as_ref);
    let command = A::augment_args(clap::Command::new(verb).no_binary_name(true));
    let refused = |refusal: clap::Error| {
        // Usage and help follow, which are those of the command.
        let said = refusal.to_string();
        let said = said.split("\n\n").next().unwrap_or_default();
        Failure::usage(said.trim_start_matches("error: "))
    };
    let matches = command.try_get_matches_from(words).map_err(refused)?;
    modes::unread(verb, &matches)?;
    A::from_arg_matches(&matches).map_err(refused)
}
