//! Functions that the tests of the command share: they run it, and make a folder for each test.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;

/// The project's folder.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Returns the command, which runs in the project's folder.
pub fn hpu() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hpu"));
    command.current_dir(ROOT);
    command
}

/// Runs the command with these arguments.
pub fn run(arguments: &[&str]) -> Output {
    hpu().args(arguments).output().expect("the command starts")
}

/// Returns the exit code.
pub fn code(output: &Output) -> i32 {
    output.status.code().expect("it was not killed")
}

/// Returns stdout.
pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("text")
}

/// Returns stderr.
pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("text")
}

/// Returns stdout as one JSON object.
pub fn json(output: &Output) -> serde_json::Value {
    let value: serde_json::Value = serde_json::from_str(&stdout(output)).expect("exactly one JSON value");
    assert!(value.is_object(), "{value}");
    value
}

/// Makes an empty folder for one test.
pub fn scratch(test: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    if dir.exists() {
        fs::remove_dir_all(&dir).expect("an old folder of this test goes");
    }
    fs::create_dir_all(&dir).expect("a folder for this test");
    dir
}

/// Returns a path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// Returns the sorted names of everything in a folder.
pub fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Asserts that the command refused: the exit code is `expected`, stdout is empty, and stderr has one error, in which
/// all these words occur.
pub fn assert_refused(output: &Output, expected: i32, words: &[&str]) {
    let said = stderr(output);
    assert_eq!(code(output), expected, "{said}");
    assert_eq!(stdout(output), "", "results are for who is not refused");
    // A run first prints how much it will write, and on a busy machine the time that it has taken.
    let told = |line: &&str| line.starts_with("trace.csv: ") || line.ends_with(" s so far");
    let first = said.lines().find(|line| !told(line));
    assert!(first.is_some_and(|line| line.starts_with("error: ")), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` is not in: {said}");
    }
}

/// Makes a folder with these scripts as the only tools. The scripts themselves find the real tools.
pub fn tools(dir: &Path, scripts: &[(&str, &str)]) -> PathBuf {
    let place = dir.join("tools");
    fs::create_dir_all(&place).expect("a folder");
    let path = std::env::var("PATH").expect("a PATH");
    for (name, script) in scripts {
        let tool = place.join(name);
        fs::write(&tool, format!("#!/bin/sh\nPATH='{path}'\n{script}\n")).expect("a script");
        fs::set_permissions(&tool, fs::Permissions::from_mode(0o755)).expect("it may run");
    }
    place
}

/// Returns a text in quotes, as TOML has it.
pub fn quoted(text: &str) -> String {
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    format!("\"{}\"", text.chars().map(escaped).collect::<String>())
}

/// The entries of a folder, each with its size and the time of its last change.
pub type Seen = BTreeMap<PathBuf, (u64, Option<SystemTime>)>;

/// Returns everything in a folder but what is in `out`.
pub fn seen(dir: &Path) -> Seen {
    let (mut all, mut left, out) = (Seen::new(), vec![dir.to_path_buf()], dir.join("out"));
    while let Some(folder) = left.pop() {
        for path in fs::read_dir(&folder).expect("a folder").flatten().map(|entry| entry.path()) {
            let found = fs::symlink_metadata(&path).expect("a file");
            if path == out {
                continue;
            }
            if found.is_dir() {
                left.push(path.clone());
            }
            // The time of a folder changes with the temporary files in it.
            let told = if found.is_dir() { (0, None) } else { (found.len(), found.modified().ok()) };
            all.insert(path, told);
        }
    }
    all
}

/// Returns whether a text steers a terminal.
pub fn steers(text: &str) -> bool {
    text.chars().any(|c| {
        (c.is_control() && !matches!(c, '\n' | '\t'))
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{61c}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    })
}
