//! GHDL refuses to synthesise a quotient of reals. `cost_verilog` synthesises every variant of every block in `hdl/`
//! and simulates the result.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs GHDL in a folder, in which it finds the units that it has analysed. Returns its message when it refuses.
fn ghdl(dir: &Path, arguments: &[String]) -> Result<(), String> {
    let (verb, rest) = arguments.split_first().expect("a verb");
    let output = Command::new("ghdl")
        .args([verb, "--std=08"])
        .args(rest)
        .current_dir(dir)
        .output()
        .expect("ghdl runs: install the Debian package ghdl-mcode");
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

/// Makes a folder in which these sources are analysed.
fn analysed(name: &str, sources: &[PathBuf]) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("hpu-synthesis-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for the test");
    let sources = sources.iter().map(|path| path.display().to_string());
    ghdl(&dir, &std::iter::once("-a".to_string()).chain(sources).collect::<Vec<_>>()).expect("it analyses");
    dir
}

/// Synthesises an analysed entity with these generics. Returns GHDL's message when it refuses.
fn synthesise(dir: &Path, entity: &str, generics: Vec<String>) -> Result<(), String> {
    let arguments = [vec!["--synth".to_string()], generics, vec![entity.to_string()]];
    ghdl(dir, &arguments.concat())
}

#[test]
fn a_quotient_of_reals_is_not() {
    let source = std::env::temp_dir().join(format!("hpu-divides-{}.vhd", std::process::id()));
    let text = "entity divides is port (a, b : in integer; q : out real); end entity;\n\
                architecture rtl of divides is begin q <= real(a) / real(b); end architecture;\n";
    std::fs::write(&source, text).expect("a file");
    let dir = analysed("divides", std::slice::from_ref(&source));
    let refused = synthesise(&dir, "divides", Vec::new());
    std::fs::remove_file(source).expect("the file goes");
    std::fs::remove_dir_all(dir).expect("the folder goes");
    assert!(refused.is_err(), "reals are no hardware");
}
