//! What several tests need: the shared library, C programs, scenes.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_cosim::SceneFile;

/// The folder of the crate.
pub fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Compiles a C program against the header and the library of this build. Returns the program.
pub fn compiled(source: &str) -> PathBuf {
    // Cargo leaves the library beside the tests.
    let library = env::current_exe().expect("a path").parent().expect("a folder").to_path_buf();
    let source = here().join(source);
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(source.file_stem().expect("a name"));
    let mut cc = Command::new("cc");
    cc.args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-pthread", "-I"]);
    cc.arg(here().join("include")).arg(source).arg("-L").arg(&library).arg("-lhpu").arg("-o").arg(&program);
    cc.arg(format!("-Wl,-rpath,{}", library.display()));
    assert!(cc.status().expect("cc").success(), "{cc:?}");
    program
}

/// Overrides from `KEY=VALUE`.
pub fn set(pairs: &[&str]) -> Vec<(String, String)> {
    let split = |pair: &&str| pair.split_once('=').map(|(key, value)| (key.to_string(), value.to_string()));
    pairs.iter().map(|pair| split(pair).expect("KEY=VALUE")).collect()
}

/// A shipped scene.
pub fn shipped(name: &str) -> SceneFile {
    SceneFile::find(name).expect("a shipped scene")
}
