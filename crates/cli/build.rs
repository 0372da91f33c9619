//! Tells the command its version, with the commit, and where cargo leaves the library that it carries.

#[path = "build/commit.rs"]
mod commit;

use std::env;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    tell_version();
    tell_library();
}

fn tell_version() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    println!("cargo::rustc-env=HPU_VERSION={}", commit::version(root, env!("CARGO_PKG_VERSION")));
    println!("cargo::rerun-if-changed=build/commit.rs");
    for path in commit::watched(root) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}

/// Tells where cargo leaves `libhpu_vhpi.so`, which GHDL loads, so that the program can carry it.
///
/// `hpu-rtl` depends on `hpu-vhpi`, so its library is there before the program is compiled, but for what compiles no
/// dependencies whole (`cargo check`, `cargo clippy`): then an empty file stands for it.
fn tell_library() {
    // <target>/<profile>/build/hpu-<hash>/out
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let profile = out.ancestors().nth(3).expect("it is below the folder of the profile");
    let library = profile.join("deps").join("libhpu_vhpi.so");
    match File::create_new(&library) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => panic!("{}: {error}", library.display()),
        _ => println!("cargo::rustc-env=HPU_VHPI_LIBRARY={}", library.display()),
    }
}
