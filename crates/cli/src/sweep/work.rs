//! The work of a sweep, by the verb that its points belong to.

use std::sync::Arc;

use super::manifest::Manifest;
use crate::answers::read_words;
use crate::exit::Failure;
use crate::map::{Args as MapArgs, Cells};
use crate::study::Lines;
use crate::widths::Args as WidthsArgs;
use crate::work::{Find, Source, Work};

/// The verbs whose points a sweep can split; `study` is for the lines of a study.
pub const VERBS: [&str; 3] = ["map", "widths", "study"];

/// Returns the work of a verb under these words; of `study` they are name and text. `find` returns a scene by its name.
pub fn work(verb: &str, words: &[String], find: Find) -> Result<Box<dyn Work>, Failure> {
    Ok(match (verb, words) {
        ("map", _) => Box::new(Cells::new(read_words::<MapArgs>("map", words)?, find)?),
        ("widths", _) => Box::new(read_words::<WidthsArgs>("widths", words)?.waves(find)?),
        ("study", [name, text]) => Box::new(Lines::new(name, text, find)?),
        _ => return Err(Failure::usage(format!("a sweep cannot split `{verb}`; it can: {}", VERBS.join(", ")))),
    })
}

/// Returns the work of a manifest.
pub fn of(manifest: &Manifest) -> Result<Box<dyn Work>, Failure> {
    work(&manifest.verb, &manifest.words, scenes(manifest))
}

/// Returns the function that finds a manifest's scenes.
pub fn scenes(manifest: &Manifest) -> Find {
    let scenes = manifest.scenes.clone();
    Arc::new(move |name| {
        let found = scenes.iter().find(|(own, _)| own == name);
        let (_, scene) = found.ok_or_else(|| Failure::file(format!("the manifest has no scene {name}")))?;
        Ok(Source { scene: scene.clone(), file: None })
    })
}
