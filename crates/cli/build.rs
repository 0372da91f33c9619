//! Tells where cargo leaves `libhpu_rtl.so`, the emulator's side of a loop closed around VHDL, so that the program can carry it.
//!
//! `hpu-rtl` is a dependency, so its library is there before the program is compiled, but for what compiles no dependencies
//! whole (`cargo check`, `cargo clippy`): then an empty file stands for it.

use std::env;
use std::fs::File;
use std::io::ErrorKind;
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // <target>/<profile>/build/hpu-<hash>/out
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let profile = out.ancestors().nth(3).expect("it is below the folder of the profile");
    let library = profile.join("deps").join("libhpu_rtl.so");
    match File::create_new(&library) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => panic!("{}: {error}", library.display()),
        _ => println!("cargo:rustc-env=HPU_RTL_LIBRARY={}", library.display()),
    }
}
