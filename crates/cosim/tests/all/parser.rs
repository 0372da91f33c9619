//! The parser of scenes knows data, never a thing that runs: no simulation, world or engine.

use std::fs;
use std::path::Path;

/// The modules outside of `scene` that its files may name: constant lists, the arithmetic of the judged window,
/// text of messages, the list of methods, numbers drawn from a seed, and words that change.
const KNOWN: [&str; 7] = ["joined", "judged", "method", "random", "scene", "schedule", "text"];

#[test]
fn the_reader_of_scenes_names_no_module_that_runs() {
    let (mut folders, mut files) = (vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene")], 0);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder of the parser") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            files += 1;
            let text = fs::read_to_string(&path).expect("a source");
            for (at, rest) in text.match_indices("crate::") {
                let begun = text[..at].chars().next_back();
                let named: String =
                    text[at + rest.len()..].chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect();
                let foreign = begun.is_some_and(|c| c == '_' || c.is_alphanumeric());
                assert!(foreign || KNOWN.contains(&named.as_str()), "{} names crate::{named}", path.display());
            }
        }
    }
    assert!(files > 30, "{files} files");
}
