//! The range of a generic in a block's header is also in the entity, and is the range that the emulator accepts.

use std::fs;
use std::path::Path;
use std::process::Command;

use hpu_datapath::{VelocityConfig, VelocityRegister};

const HDL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../hdl");

#[test]
fn every_period_has_2_to_30_bits_in_the_header_and_in_the_generic() {
    let mut entities = 0;
    let generated = fs::read_dir(format!("{HDL}/generated")).expect("the generated VHDL");
    for file in fs::read_dir(HDL).expect("the VHDL").chain(generated).map(|entry| entry.expect("an entry").path()) {
        let Ok(text) = fs::read_to_string(&file) else { continue };
        let declared = |line: &&str| line.trim_start().starts_with("PERIOD_WIDTH") && line.contains(" := ");
        let Some(generic) = text.lines().find(declared) else { continue };
        let header = text.lines().find(|line| line.starts_with("--") && line.contains("PERIOD_WIDTH  "));
        assert!(generic.contains("positive range 2 to 30 := "), "{}: {generic}", file.display());
        assert!(header.is_some_and(|line| line.contains("period, 2 to 30")), "{}: {header:?}", file.display());
        entities += 1;
    }
    assert!(entities > 20, "{entities}");
}

#[test]
fn a_period_of_30_bits_elaborates_and_one_of_31_is_refused_by_the_vhdl_and_by_the_emulator() {
    let config = |period_width| VelocityConfig { period_width, ..VelocityConfig::default() };
    assert!(VelocityRegister::new(config(30)).is_ok() && VelocityRegister::new(config(31)).is_err());
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("generics");
    fs::create_dir_all(&dir).expect("a folder");
    let ghdl = |arguments: &[&str]| {
        let output = Command::new("ghdl").args(arguments).current_dir(&dir).output().expect("GHDL starts");
        (
            output.status.success(),
            format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr)),
        )
    };
    let (analysed, said) = ghdl(&["-a", "--std=08", &format!("{HDL}/velocity_register.vhd")]);
    assert!(analysed, "{said}");
    for (bits, fine) in [("30", true), ("31", false)] {
        let generic = format!("-gPERIOD_WIDTH={bits}");
        let (ran, said) = ghdl(&["--elab-run", "--std=08", "velocity_register", &generic, "--stop-time=1ns"]);
        assert_eq!(ran, fine, "{bits}: {said}");
    }
}
