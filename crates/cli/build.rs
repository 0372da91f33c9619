//! Tells the command its version, with the commit.

#[path = "build/commit.rs"]
mod commit;

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    println!("cargo::rustc-env=HPU_VERSION={}", commit::version(root, env!("CARGO_PKG_VERSION")));
    println!("cargo::rerun-if-changed=build/commit.rs");
    for path in commit::watched(root) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}
