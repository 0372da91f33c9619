//! Compiles the shared library that GHDL loads, so that this crate can carry it as bytes. Cargo says nowhere where it
//! leaves a shared library of its own; this one lies in the folder that cargo gives to build scripts.

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=src");
    println!("cargo::rustc-check-cfg=cfg(shared_library)");
    let var = |name: &str| env::var(name).unwrap_or_else(|_| panic!("cargo sets {name}"));
    let library = PathBuf::from(var("OUT_DIR")).join("libhpu_vhpi.so");
    if env::var_os("CARGO_CFG_UNIX").is_none() {
        fs::write(&library, []).expect("cargo's folder is writable");
        return;
    }
    let mut command = Command::new(var("RUSTC"));
    command.args(["--edition=2024", "--crate-name=hpu_vhpi", "--crate-type=cdylib", "--cfg=shared_library"]);
    command.args(["-Copt-level=2", "-Cstrip=debuginfo", "src/lib.rs", "--target", &var("TARGET"), "-o"]).arg(library);
    if let Ok(linker) = env::var("RUSTC_LINKER") {
        command.arg(format!("-Clinker={linker}"));
    }
    command
        .args(env::var("CARGO_ENCODED_RUSTFLAGS").iter().flat_map(|all| all.split('\x1f')).filter(|f| !f.is_empty()));
    let status = command.status().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(status.success(), "{command:?}: {status}");
}
