//! The copies against the files that they are copies of.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use hpu_assets::FILES;

/// The repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

#[test]
fn every_file_is_a_copy_of_its_original() {
    for (path, text) in FILES {
        let original = fs::read_to_string(Path::new(ROOT).join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
        assert!(original == *text, "{path} differs from its copy: run testbench/assets.sh");
    }
}

#[test]
fn every_file_of_the_folders_of_originals_is_copied() {
    let copied: BTreeSet<_> = FILES.iter().map(|(path, _)| path.to_string()).collect();
    for folder in ["hdl", "hdl/generated", "testbench/scenes", "testbench/studies"] {
        for entry in fs::read_dir(Path::new(ROOT).join(folder)).expect(folder) {
            let entry = entry.expect("an entry");
            let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
            let is_generated = path.starts_with("hdl/generated/") && path.ends_with("_pkg.vhd");
            let is_left_out = is_generated || path.ends_with("README.md");
            let is_copied = copied.contains(&path);
            assert!(entry.path().is_dir() || is_copied != is_left_out, "{path}: run testbench/assets.sh");
        }
    }
}
