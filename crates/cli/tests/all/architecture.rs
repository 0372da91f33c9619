//! The dependencies in the manifests agree with the map in ARCHITECTURE.md; the form of the sources.

use std::fs;
use std::path::Path;

use crate::readme::links;

/// Each crate, and our crates that it may depend on.
const MAY_KNOW: [(&str, &[&str]); 21] = [
    ("assets", &[]),
    ("signal", &[]),
    ("datapath", &["signal"]),
    ("plant", &["signal"]),
    ("scene", &["assets", "signal", "datapath", "plant"]),
    ("cosim", &["signal", "datapath", "plant", "scene"]),
    ("wave", &["signal", "datapath", "cosim"]),
    ("vhpi", &[]),
    ("leap", &[]),
    ("rtl", &["assets", "signal", "datapath", "plant", "cosim", "wave", "vhpi", "leap"]),
    ("prove", &["signal", "datapath", "plant", "cosim"]),
    ("page", &["signal", "plant", "cosim"]),
    ("farm", &["cosim", "page"]),
    ("study", &["assets", "signal", "datapath", "plant", "cosim", "prove", "page", "farm"]),
    ("papers", &["assets", "signal", "datapath", "plant", "cosim", "prove", "page", "farm", "study"]),
    ("capi", &["signal", "datapath", "plant", "cosim"]),
    ("chart", &["signal", "datapath", "plant", "cosim", "prove", "page", "study", "papers"]),
    (
        "cli",
        &[
            "assets", "signal", "datapath", "plant", "cosim", "wave", "rtl", "prove", "page", "farm", "study",
            "papers", "chart", "capi",
        ],
    ),
    ("web", &["signal", "cosim", "wave", "page", "study"]),
    ("book", &["signal", "datapath", "cosim", "rtl", "cli"]),
    ("python", &["signal", "datapath", "cosim", "wave", "page", "study", "chart", "capi", "cli"]),
];

#[test]
fn crates_know_only_whom_they_may() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let mut found: Vec<String> = fs::read_dir(crates)
        .expect("crates/ is readable")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .collect();
    found.sort();
    let mut listed: Vec<&str> = MAY_KNOW.iter().map(|(name, _)| *name).collect();
    listed.sort_unstable();
    assert_eq!(found, listed);
    for (name, may) in MAY_KNOW {
        let manifest = fs::read_to_string(crates.join(name).join("Cargo.toml")).expect("a manifest");
        // Tests may depend on more than the crate itself.
        let own = manifest.split("[dev-dependencies]").next().expect("a part before");
        for line in own.lines() {
            let Some(known) = line.strip_prefix("hpu").and_then(|rest| rest.split(['.', ' ', '=']).next()) else {
                continue;
            };
            // The command's package is named hpu alone.
            let known = known.strip_prefix('-').unwrap_or("cli");
            assert!(may.contains(&known), "{name} may not know {known}");
        }
    }
}

/// A stranger finds a place by the names that ARCHITECTURE.md gives beside the link to its file.
#[test]
fn names_in_the_list_of_places_are_in_the_files_that_it_links_to() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the project");
    let text = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let (_, places) = text.split_once("## Where to begin to read\n").expect("the list of places");
    let mut seen = 0;
    for row in places.split("\n## ").next().expect("a section").lines().filter(|line| line.starts_with("| ")) {
        let files = links(row).map(|link| root.join(link)).filter(|path| path.is_file());
        let source: String = files.map(|path| fs::read_to_string(path).expect("a file")).collect();
        let is_name = |span: &&str| span.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        for name in row.split('`').skip(1).step_by(2).filter(is_name) {
            assert!(source.contains(name), "{name} is not in the files of: {row}");
            seen += 1;
        }
    }
    assert!(seen > 5, "{seen} names");
}

/// A test file that no `mod` line names would never run, without any message.
#[test]
fn every_test_file_is_a_module_of_its_binary() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    // The tests of the Python package are in Python; unittest finds them by their names.
    for (name, _) in MAY_KNOW.into_iter().filter(|(name, _)| *name != "python") {
        let folder = crates.join(name).join("tests/all");
        let main = fs::read_to_string(folder.join("main.rs")).expect("tests/all/main.rs");
        for entry in fs::read_dir(&folder).expect("tests/all is readable") {
            let path = entry.expect("an entry").path();
            let module = path.file_stem().and_then(|stem| stem.to_str()).expect("a name").to_owned();
            assert!(
                module == "main" || main.contains(&format!("mod {module};\n")),
                "{name}: {module} is no module of main.rs"
            );
        }
    }
}

/// Returns whether a file below a folder has a unit test.
fn has_tests(folder: &Path) -> bool {
    fs::read_dir(folder).expect("sources are readable").any(|entry| {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            return has_tests(&path);
        }
        path.extension().is_some_and(|end| end == "rs") && fs::read_to_string(&path).expect("text").contains("#[test]")
    })
}

/// With `test = false`, cargo compiles a library once less; a unit test in it would never run.
#[test]
fn a_library_is_compiled_for_tests_where_it_has_any() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    for (name, _) in MAY_KNOW {
        let manifest = fs::read_to_string(crates.join(name).join("Cargo.toml")).expect("a manifest");
        let library = manifest.split("[lib]").nth(1).and_then(|rest| rest.split("\n[").next()).unwrap_or_default();
        let has = has_tests(&crates.join(name).join("src"));
        assert_eq!(
            !library.contains("\ntest = false\n"),
            has,
            "{name}: `test = false` if src has no #[test], else not"
        );
    }
}

/// Adds the files below a folder of a crate, `depth` folders below the crate's own, that include a file from outside of
/// the crate.
fn add_reaching_out(folder: &Path, depth: usize, out: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("sources are readable") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            add_reaching_out(&path, depth + 1, out);
        } else if path.extension().is_some_and(|end| end == "rs") {
            let text = fs::read_to_string(&path).expect("text");
            let included = text.split("include_").skip(1).filter_map(|rest| rest.split(['"', ')']).nth(1));
            let ups = included.map(|file| file.split('/').take_while(|part| *part == "..").count());
            if ups.max().is_some_and(|ups| ups > depth)
                || text.contains("include_str!(concat!(env!(\"CARGO_MANIFEST_DIR")
            {
                out.push(path.display().to_string());
            }
        }
    }
}

/// A published crate has no more than its folder; `testbench/assets.sh` copies what programs carry into hpu-assets.
#[test]
fn no_crate_includes_a_file_from_outside_of_its_folder() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let mut out = Vec::new();
    for (name, _) in MAY_KNOW {
        add_reaching_out(&crates.join(name).join("src"), 1, &mut out);
    }
    assert!(out.is_empty(), "{out:#?}");
}

/// Adds the place of each line of more than 120 characters in the sources below a folder.
fn add_long_lines(folder: &Path, long: &mut Vec<String>) {
    // Figures of long runs, and designs as their authors wrote them.
    let others = ["testbench/record", "testbench/dut"];
    for entry in fs::read_dir(folder).expect("sources are readable") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            if !others.iter().any(|other| path.ends_with(other)) {
                add_long_lines(&path, long);
            }
        } else if path.extension().is_some_and(|end| ["rs", "sh", "py", "vhd"].iter().any(|source| end == *source)) {
            let text = fs::read_to_string(&path).expect("text");
            let lines = text.lines().zip(1..).filter(|(line, _)| line.chars().count() > 120);
            long.extend(lines.map(|(_, number)| format!("{}:{number}", path.display())));
        }
    }
}

#[test]
fn no_line_of_a_source_has_more_than_120_characters() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the project");
    let mut folders = vec![root.join("hdl"), root.join("testbench"), root.join("crates/python/python")];
    for (name, _) in MAY_KNOW {
        folders.extend(["src", "tests", "examples"].map(|part| root.join("crates").join(name).join(part)));
    }
    let mut long = Vec::new();
    for folder in folders.iter().filter(|folder| folder.exists()) {
        add_long_lines(folder, &mut long);
    }
    assert!(long.is_empty(), "more than 120 characters: {long:#?}");
}

/// Calls a function with each file of the crates' sources, without its tests: its path below `crates/`, its text.
fn each_source(folder: &Path, look: &mut dyn FnMut(&str, &str)) {
    for entry in fs::read_dir(folder).expect("sources are readable") {
        let path = entry.expect("an entry").path();
        let name = path.to_str().expect("a name");
        if path.is_dir() {
            each_source(&path, look);
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") {
            let text = fs::read_to_string(&path).expect("text");
            let own = text.split("#[cfg(test)]\nmod tests {").next().expect("a part before");
            look(name.rsplit_once("/crates/").expect("below crates/").1, own);
        }
    }
}

/// Returns the lines of all sources, but for comments, in which one of these texts stands: path and line.
fn lines_with(texts: &[String]) -> Vec<(String, String)> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let mut found = Vec::new();
    for (name, _) in MAY_KNOW {
        each_source(&crates.join(name).join("src"), &mut |path, source| {
            let lines = source.lines().zip(1..).filter(|(line, _)| !line.trim_start().starts_with("//"));
            let meant = lines.filter(|(line, _)| texts.iter().any(|text| line.contains(text)));
            found.extend(meant.map(|(line, at)| (path.to_string(), format!("{at}: {line}"))));
        });
    }
    found
}

/// The functions of more than 80 lines: a series that is compiled once an instruction set, the checker of certificates
/// and the bench around VHDL, which are read from top to bottom, and two tables of one operation an entry.
const LONG: [&str; 5] = [
    "leap/src/line.rs: line_of",
    "leap/src/yosys/cells.rs: cell",
    "plant/src/arm/fused.rs: write_with",
    "prove/src/certify/mod.rs: inspect",
    "rtl/src/dut/ghdl.rs: bench",
];

/// Returns the name of the function that begins at a line, if one does.
fn function(line: &str) -> Option<&str> {
    let (before, rest) = line.trim_start().split_once("fn ")?;
    let is_head = |word: &str| {
        matches!(word, "pub" | "const" | "unsafe" | "extern" | "\"C\"" | "in")
            || word.starts_with("pub(")
            || word.ends_with(')')
    };
    // The heads of `versions!` have no body.
    let is_head = before.split_whitespace().all(is_head) && !rest.split('(').next()?.contains('[');
    is_head.then(|| rest.split(['(', '<']).next().unwrap_or_default())
}

/// Returns the number of lines of the function that begins here, as rustfmt sets it: up to its brace at the indentation
/// of the first line, or up to the semicolon of one without a body.
fn length(lines: &[&str]) -> usize {
    let indentation = lines[0].len() - lines[0].trim_start().len();
    let close = format!("{:indentation$}}}", "");
    let head = lines.iter().position(|line| line.contains('{') || line.ends_with(';')).unwrap_or(0);
    let is_whole = lines[head].ends_with(['}', ';']);
    1 + if is_whole { head } else { lines.iter().position(|line| *line == close).unwrap_or(0) }
}

#[test]
fn functions_have_at_most_80_lines() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let (mut long, mut all) = (Vec::new(), 0);
    for (name, _) in MAY_KNOW {
        each_source(&crates.join(name).join("src"), &mut |path, source| {
            let lines: Vec<&str> = source.lines().collect();
            for (first, line) in lines.iter().enumerate() {
                let Some(name) = function(line) else { continue };
                all += 1;
                let length = length(&lines[first..]);
                if length > 80 {
                    long.push(format!("{path}: {name}"));
                }
            }
        });
    }
    long.sort();
    assert!(all > 5000, "{all} functions");
    assert_eq!(long, LONG, "of more than 80 lines");
}

/// The functions of `f64` that the standard library asks the system for, and whose bits are the system's.
const OF_THE_SYSTEM: [&str; 27] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp", "exp2", "exp_m1",
    "hypot", "ln", "ln_1p", "log10", "log2", "mul_add", "powf", "sin", "sin_cos", "sinh", "tan", "tanh", "gamma",
    "ln_gamma",
];

/// Methods of these names in these files are of intervals and of an arm's numbers, which ask `libm`, or are the
/// processor's own instruction.
const OF_OTHER_TYPES: [&str; 7] = [
    "plant/src/arm/dynamics.rs",
    "plant/src/arm/gimbal.rs",
    "plant/src/arm/model.rs",
    "plant/src/flow/double.rs",
    "prove/src/arms/gimbal.rs",
    "prove/src/interval.rs",
    "prove/src/linear/characteristic.rs",
];

#[test]
fn results_depend_on_no_function_of_the_system() {
    let calls = OF_THE_SYSTEM.iter().flat_map(|name| [format!(".{name}("), format!("f64::{name}")]);
    let found = lines_with(&calls.collect::<Vec<_>>());
    let (meant, others): (Vec<_>, Vec<_>) = found.iter().partition(|(path, _)| OF_OTHER_TYPES.contains(&&**path));
    assert!(others.is_empty(), "write libm::...: {others:#?}");
    // The list of files is not longer than it must be.
    for place in OF_OTHER_TYPES {
        assert!(meant.iter().any(|(path, _)| path == place), "{place} has no such line");
    }
}

#[test]
fn what_a_system_decides_stands_in_one_place() {
    let asks =
        ["std::os::", "cfg(unix", "cfg(windows", "cfg(not(unix", "cfg(not(windows", "target_os", "libc::", "nix::"];
    let found = lines_with(&asks.map(String::from));
    let is_meant = |path: &str| ["rtl/src/system/", "vhpi/src/"].iter().any(|place| path.starts_with(place));
    let others: Vec<_> = found.iter().filter(|(path, _)| !is_meant(path)).collect();
    assert!(others.is_empty(), "it belongs into crates/rtl/src/system: {others:#?}");
}
