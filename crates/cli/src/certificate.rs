//! Certificates of runs as text: what `--for-ever` tells, and the scene of which it is told.

use std::time::Duration;

use hpu_cosim::SceneFile;
use hpu_cosim::scene::Experiment;
use serde_json::Value;
use toml_edit::{Array, DocumentMut, Item, value};

use crate::shell::Failure;

/// The claim of a certificate of a run.
pub const CLAIM: &str = "so this run goes on, for ever";

/// Checks that a certificate can carry a scene: its text is all of it.
///
/// # Errors
///
/// Returns a failure of usage if the scene reads files or has a design of the user's own.
pub fn agree(source: &SceneFile, set: &[(String, String)]) -> Result<(), Failure> {
    let none = &mut |_: &str| Err(std::io::Error::other("a certificate carries no file"));
    match Experiment::parse(&source.name, &source.text, set, none) {
        Ok(Experiment::Dut(_)) => Err(Failure::usage("--certificates: a certificate carries no design of your own")),
        Ok(_) => Ok(()),
        Err(error) => Err(Failure::usage(format!("--certificates: {error}"))),
    }
}

/// Returns the text of a certificate: the scene's text, what replaces its keys, how long the run looked on, and what
/// `hpu run --json` says of `for_ever`.
pub fn certificate(source: &SceneFile, set: &[(String, String)], longest: Duration, found: &Value) -> String {
    let mut document = DocumentMut::new();
    let pairs = set.iter().map(|(key, value)| Array::from_iter([key.as_str(), value.as_str()]));
    document["claim"] = value(CLAIM);
    document["name"] = value(&source.name);
    document["set"] = value(pairs.collect::<Array>());
    document["looked_on_s"] = value(longest.as_secs_f64());
    document["found"] = value(found.to_string());
    document["scene"] = value(&source.text);
    format!("# `hpu certify` runs this scene again, and holds what it finds against this.\n{document}")
}

/// Whether a text claims to be a certificate of a run.
pub fn is_of_run(text: &str) -> bool {
    let document = text.parse::<DocumentMut>();
    document.is_ok_and(|document| document.get("claim").and_then(Item::as_str) == Some(CLAIM))
}
