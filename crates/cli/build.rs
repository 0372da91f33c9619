//! Tells the command its version, with the commit, and makes the page that it carries.

#[path = "build/commit.rs"]
mod commit;

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    println!("cargo::rustc-env=HPU_VERSION={}", commit::version(root, env!("CARGO_PKG_VERSION")));
    println!("cargo::rerun-if-changed=build/commit.rs");
    for path in commit::watched(root) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    if env::var_os("CARGO_FEATURE_EXPLORER").is_some() {
        println!("cargo::rustc-env=HPU_EXPLORER={}", page(root).display());
    }
}

/// Returns the explorer's page: the one in this package, where it is published, else the one that the repository makes.
fn page(root: &Path) -> PathBuf {
    let published = Path::new(env!("CARGO_MANIFEST_DIR")).join("explorer.html");
    println!("cargo::rerun-if-changed={}", published.display());
    if published.exists() {
        return published;
    }
    println!("cargo::rerun-if-changed={}", root.join("crates/web").display());
    let target = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("explorer");
    let mut script = Command::new(root.join("testbench/explorer.sh"));
    // A build of its own, for another machine.
    script.env("CARGO_TARGET_DIR", &target).env_remove("CARGO_ENCODED_RUSTFLAGS").env_remove("RUSTC_WORKSPACE_WRAPPER");
    let ended = script.status().unwrap_or_else(|error| panic!("testbench/explorer.sh: {error}"));
    assert!(ended.success(), "testbench/explorer.sh: {ended}");
    target.join("explorer.html")
}
