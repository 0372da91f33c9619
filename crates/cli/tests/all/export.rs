//! `hpu export fmu`: what is written, and what is refused. testbench/oracle/fmu.py holds units against libhpu by FMPy.

use std::fs;
use std::io::Read;

use crate::common::{assert_refused, code, names, run, scratch, stderr, text};

#[test]
fn a_unit_is_an_archive_of_description_library_and_scene() {
    let dir = scratch("export");
    let (library, other, one) = (dir.join("library"), dir.join("other"), dir.join("one.fmu"));
    let two = dir.join("two.fmu");
    // Of libraries the first bytes tell the system: ELF for x86-64, and a program of Windows, whose header is at 64.
    let (elf, windows) = (format!("\x7fELF\x02\x01{}>\0", "\0".repeat(12)), format!("MZ{}", "\0".repeat(58)));
    let windows = format!("{windows}@{}PE\0\0", "\0".repeat(3)).into_bytes();
    fs::write(&library, &elf).expect("a file");
    fs::write(&other, [windows, vec![0x64, 0x86]].concat()).expect("a file");
    let export = |out: &std::path::Path, more: &[&str]| {
        let all = [&["export", "fmu", "replay-motion", "-o", text(out), "--library", text(&library)], more].concat();
        let done = run(&all);
        assert_eq!(code(&done), 0, "{}", stderr(&done));
        fs::read(out).expect("an archive")
    };
    let bytes = export(&one, &["--set", "wall.stiffness=2"]);
    assert_eq!(bytes, export(&two, &["--set", "wall.stiffness=2"]), "the same scene gives other bytes");
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
    let places: Vec<String> = archive.file_names().map(String::from).collect();
    let expected = [
        "modelDescription.xml",
        "resources/scene.toml",
        "resources/export.txt",
        "binaries/x86_64-linux/hpu.so",
        "resources/replay-motion.csv",
    ];
    assert_eq!(places, expected);
    let mut read = |place: &str| {
        let mut content = String::new();
        archive.by_name(place).expect("a part").read_to_string(&mut content).expect("text");
        content
    };
    assert_eq!(read("binaries/x86_64-linux/hpu.so"), elf);
    let shipped = fs::read_to_string("../../testbench/scenes/replay-motion.toml").expect("a scene");
    assert_eq!(read("resources/scene.toml"), shipped);
    let (said, description) = (read("resources/export.txt"), read("modelDescription.xml"));
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!((lines[0], lines[2], lines.len()), ("plant", "wall.stiffness=2", 3));
    assert!(description.contains(&format!("instantiationToken=\"{}\"", lines[1])), "{description}");
    // Another change is another unit.
    let other = export(&two, &["--set", "wall.stiffness=3", "--library", text(&other)]);
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(other)).expect("an archive");
    // With a second library the unit is for two systems.
    assert_eq!(archive.by_name("binaries/x86_64-windows/hpu.dll").expect("a part").size(), 70);
    let mut said = String::new();
    archive.by_name("resources/export.txt").expect("a part").read_to_string(&mut said).expect("text");
    assert!(said.lines().nth(1) != Some(lines[1]), "{said}");
}

#[test]
fn what_is_no_unit_is_refused_and_nothing_is_written() {
    let dir = scratch("export-refused");
    let (library, out) = (dir.join("library"), dir.join("x.fmu"));
    fs::write(&library, b"\x7fELF\x02\x01\0\0\0\0\0\0\0\0\0\0\0\0>\0").expect("a file");
    let (library, out) = (text(&library), text(&out));
    let export = |more: &[&str]| run(&[&["export", "fmu", "-o", out], more].concat());
    assert_refused(&export(&["no-such-scene", "--library", library]), 4, &["no scene `no-such-scene`"]);
    assert_refused(&export(&["hybrid-wall", "--library", "/nowhere"]), 4, &["/nowhere"]);
    let twice = ["hybrid-wall", "--library", library, "--library", library];
    assert_refused(&export(&twice), 4, &["binaries/x86_64-linux/hpu.so: two libraries are for this system"]);
    assert_refused(
        &export(&["hybrid-wall", "--library", "Cargo.toml"]),
        4,
        &["library 1 of 1 is no library for Linux, Windows or macOS"],
    );
    assert_refused(&export(&["hybrid-wall", "--library", library, "--set", "wall.none=1"]), 4, &["wall.none"]);
    let design = "testbench/dut/knee.toml";
    assert_refused(&export(&[design, "--library", library, "--loop"]), 4, &["design"]);
    assert_eq!(names(&dir), ["library"]);
}
