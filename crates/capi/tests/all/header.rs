//! The header declares what the library exports.

use std::collections::BTreeSet;
use std::env;
use std::process::Command;

const HEADER: &str = include_str!("../../include/hpu.h");
const SOURCE: &str = include_str!("../../src/abi.rs");

/// The type of an argument or a field, in C.
fn in_c(rust: &str) -> String {
    match rust {
        "*const *const c_char" => "const char *const *".to_string(),
        _ if rust.starts_with("*const ") => format!("const {} *", in_c(&rust[7..])),
        _ if rust.starts_with("*mut ") => format!("{} *", in_c(&rust[5..])),
        "u64" => "uint64_t".to_string(),
        "i64" => "int64_t".to_string(),
        "i32" => "int32_t".to_string(),
        "u32" => "uint32_t".to_string(),
        "usize" => "size_t".to_string(),
        "f64" => "double".to_string(),
        "c_char" => "char".to_string(),
        "CError" => "hpu_error".to_string(),
        "CSignal" => "hpu_signal".to_string(),
        "CEnergy" => "hpu_energy".to_string(),
        other => panic!("no C for {other}"),
    }
}

/// A declaration of a name, with an array's length behind the name and a pointer's star before it.
fn declared(name: &str, rust: &str) -> String {
    if let Some((element, length)) = rust.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')?.split_once("; ")) {
        return format!("{} {name}[{length}]", in_c(element));
    }
    let c = in_c(rust);
    if c.ends_with('*') { format!("{c}{name}") } else { format!("{c} {name}") }
}

/// The text with every run of blanks as one.
fn joined(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The header without comments. Handles are numbers of 64 bits.
fn bare_header() -> String {
    let mut bare = String::new();
    let mut rest = HEADER;
    while let Some((before, comment)) = rest.split_once("/*") {
        bare.push_str(before);
        rest = comment.split_once("*/").expect("a comment ends").1;
    }
    joined(&(bare + rest))
        .replace("hpu_handle *handle", "uint64_t *handle")
        .replace("hpu_handle handle", "uint64_t handle")
}

#[test]
fn prototypes_structs_and_exported_symbols_are_those_of_the_library() {
    let header = bare_header();
    let mut names = BTreeSet::new();
    for function in SOURCE.split("pub extern \"C\" fn ").skip(1) {
        let (name, rest) = function.split_once('(').expect("arguments");
        let (arguments, rest) = rest.split_once(") -> ").expect("a result");
        let result = in_c(rest.split_once(' ').expect("a body").0);
        let arguments: Vec<_> = arguments.split(',').map(str::trim).filter(|argument| !argument.is_empty()).collect();
        let arguments = arguments.iter().map(|argument| {
            let (name, of) = argument.split_once(": ").expect("a type");
            declared(name, of)
        });
        let arguments = arguments.collect::<Vec<_>>().join(", ");
        let arguments = if arguments.is_empty() { "void".to_string() } else { arguments };
        let prototype = format!("{result} {name}({arguments});");
        assert!(header.contains(&prototype), "the header lacks: {prototype}");
        names.insert(name.to_string());
    }
    assert_eq!(header.matches("); ").count(), names.len(), "the header has more prototypes than the library");
    for (rust, c) in [("CError", "hpu_error"), ("CSignal", "hpu_signal"), ("CEnergy", "hpu_energy")] {
        let body =
            SOURCE.split_once(&format!("struct {rust} {{")).expect("a struct").1.split_once('}').expect("its end").0;
        let fields = body.split(",\n").map(str::trim).filter(|field| !field.is_empty()).map(|field| {
            let (name, of) = field.split_once(": ").expect("a type");
            format!("{}; ", declared(name, of))
        });
        let whole = format!("typedef struct {c} {{ {}}} {c};", fields.collect::<String>());
        assert!(header.contains(&whole), "the header lacks: {whole}");
    }
    let library = env::current_exe().expect("a path").with_file_name("libhpu.so");
    let symbols = Command::new("nm").args(["-D", "--defined-only"]).arg(library).output().expect("nm");
    let symbols = String::from_utf8(symbols.stdout).expect("names");
    let exported: BTreeSet<_> =
        symbols.lines().filter_map(|line| line.split(" T ").nth(1)).map(str::to_string).collect();
    // Of the others, the functions of FMI, its own standard has the prototypes.
    let (of_fmi, exported): (BTreeSet<_>, BTreeSet<_>) =
        exported.into_iter().partition(|name| name.starts_with("fmi3"));
    assert_eq!(exported, names);
    assert_eq!(of_fmi.len(), 75, "{of_fmi:?}");
}

#[test]
fn the_header_has_the_version_of_the_crate() {
    for (part, number) in [
        ("MAJOR", env!("CARGO_PKG_VERSION_MAJOR")),
        ("MINOR", env!("CARGO_PKG_VERSION_MINOR")),
        ("PATCH", env!("CARGO_PKG_VERSION_PATCH")),
    ] {
        assert!(HEADER.contains(&format!("#define HPU_VERSION_{part} {number}\n")), "{part}");
    }
}

#[test]
fn the_header_has_the_status_codes_of_the_library() {
    use hpu::Status::{Argument, Broken, Busy, Closed, End, Full, Over, Refused};
    for status in [Argument, Closed, Busy, Refused, End, Over, Full, Broken] {
        let name = format!("{status:?}").to_uppercase();
        assert!(HEADER.contains(&format!("#define HPU_{name} {} ", status as i32)), "{name}");
    }
}
