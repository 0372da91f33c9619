//! The work of a sweep, by the verb that its points belong to.

use super::manifest::Manifest;
use crate::answers::read_words;
use crate::exit::Failure;
use crate::map::{Args as MapArgs, Cells};
use crate::widths::Args as WidthsArgs;
use crate::work::{Find, Source, Work};

/// The verbs whose points a sweep can split.
pub const VERBS: [&str; 2] = ["map", "widths"];

/// Returns the work of a verb under these words. `find` returns a scene by its name.
pub fn work(verb: &str, words: &[String], find: Find) -> Result<Box<dyn Work>, Failure> {
    Ok(match verb {
        "map" => Box::new(Cells::new(read_words::<MapArgs>("map", words)?, find)?),
        "widths" => Box::new(read_words::<WidthsArgs>("widths", words)?.waves(find)?),
        _ => return Err(Failure::usage(format!("a sweep cannot split `{verb}`; it can: {}", VERBS.join(", ")))),
    })
}

/// Returns the work of a manifest.
pub fn of(manifest: &Manifest) -> Result<Box<dyn Work>, Failure> {
    work(&manifest.verb, &manifest.words, &mut |name| scene_of(manifest, name))
}

/// Returns a scene of a manifest.
pub fn scene_of(manifest: &Manifest, name: &str) -> Result<Source, Failure> {
    let found = manifest.scenes.iter().find(|(own, _)| own == name);
    let (_, scene) = found.ok_or_else(|| Failure::file(format!("the manifest has no scene {name}")))?;
    Ok(Source { scene: scene.clone(), file: None })
}
