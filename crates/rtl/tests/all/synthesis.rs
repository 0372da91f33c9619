//! Everything in `hdl/` is synthesisable, in every variant that the vectors cover.

use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_datapath::variants;
use hpu_rtl::literal;

/// `ghdl --synth` of an entity with its generics; what it said when it refused.
fn synthesise(sources: &[PathBuf], entity: &str, generics: &[String]) -> Result<(), String> {
    let output = Command::new("ghdl")
        .args(["--synth", "--std=08"])
        .args(generics)
        .args(sources)
        .args(["-e", entity])
        .output()
        .expect("ghdl runs: install the Debian package ghdl-mcode");
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
fn every_variant_of_every_block_is_synthesisable() {
    let hdl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hdl");
    let mut sources: Vec<PathBuf> = std::fs::read_dir(hdl)
        .expect("hdl/ is readable")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "vhd"))
        .collect();
    // Blocks before the loops that instantiate them.
    sources.sort_by_key(|path| (path.to_string_lossy().ends_with("_loop.vhd"), path.clone()));
    let mut done = 0;
    for (label, block) in variants() {
        let generics: Vec<String> =
            block.generics().into_iter().map(|(name, value)| format!("-g{name}={}", literal(value))).collect();
        synthesise(&sources, block.name(), &generics).unwrap_or_else(|said| panic!("{} {label}: {said}", block.name()));
        done += 1;
    }
    assert!(done > 50, "{done} variants");
}

#[test]
fn a_broken_block_is_not() {
    let dir = std::env::temp_dir().join(format!("hpu-synthesis-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    let file = dir.join("broken.vhd");
    std::fs::write(&file, "entity broken is end entity;\narchitecture rtl of broken is begin x <= '1'; end;\n")
        .expect("a file");
    let refused = synthesise(&[file], "broken", &[]);
    std::fs::remove_dir_all(&dir).expect("the folder goes");
    assert!(refused.is_err_and(|said| said.contains("\"x\"")));
}
