//! Lists the VHDL that the program carries: every block of `hdl/`, and the loops that are generated from the emulator.

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    let hdl = Path::new(&env::var("CARGO_MANIFEST_DIR").expect("set by cargo")).join("../../hdl");
    let mut list = String::from("&[\n");
    for folder in [hdl.clone(), hdl.join("generated")] {
        println!("cargo::rerun-if-changed={}", folder.display());
        let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
        files.sort();
        for file in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "vhd")) {
            let name = file.file_stem().and_then(|name| name.to_str()).expect("the name of an entity");
            // The packages are generated anew where they are needed.
            if !name.ends_with("_pkg") {
                let path = fs::canonicalize(file).expect("a file");
                writeln!(list, "    ({name:?}, include_str!({path:?})),").expect("memory");
            }
        }
    }
    list.push_str("]\n");
    let out = env::var("OUT_DIR").expect("set by cargo");
    fs::write(Path::new(&out).join("carried.rs"), list).expect("cargo's folder is writable");
}
