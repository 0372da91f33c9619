//! Helpers of several tests: the shared library, C programs, scenes.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use hpu_cosim::SceneFile;

/// The folder of the crate.
pub fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The folder of the library of this build: cargo leaves it beside the tests.
pub fn library() -> PathBuf {
    env::current_exe().expect("a path").parent().expect("a folder").to_path_buf()
}

/// A folder of this name for files of a test.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Compiles a C file against the header and the library of this build, with these options. Returns what it makes, in a
/// folder that no other test has: tests are processes side by side, and one would load what another is writing.
pub fn compiled(source: &str, options: &[&str], own: &str, made: &str) -> PathBuf {
    let made = folder(own).join(made);
    let mut cc = Command::new("cc");
    cc.args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]).args(options).arg("-I");
    cc.arg(here().join("include")).arg(here().join(source)).arg("-L").arg(library()).args(["-lhpu", "-o"]).arg(&made);
    // Before the folders that cargo puts on the library path: one of them may hold the library of an older build.
    cc.arg(format!("-Wl,--disable-new-dtags,-rpath,{}", library().display()));
    assert!(cc.status().expect("cc").success(), "{cc:?}");
    made
}

/// Returns the output of a program, which must succeed.
pub fn said(command: &mut Command) -> String {
    let ran = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let said = String::from_utf8(ran.stdout).expect("text");
    assert!(ran.status.success(), "{command:?}: {said}{}", String::from_utf8_lossy(&ran.stderr));
    said
}

/// Overrides from `KEY=VALUE`.
pub fn set(pairs: &[&str]) -> Vec<(String, String)> {
    let split = |pair: &&str| pair.split_once('=').map(|(key, value)| (key.to_string(), value.to_string()));
    pairs.iter().map(|pair| split(pair).expect("KEY=VALUE")).collect()
}

/// A shipped scene.
pub fn shipped(name: &str) -> SceneFile {
    SceneFile::find(name).expect("a shipped scene")
}

/// A motor without a method: its plant alone. It turns and the hand lets go.
pub const PLANT: &str = r#"
about = "A motor in the loop of a logic that no scene names."
[device]
kind = "motor"
motor = "vasudevan_2007"
initial_speed = "100 rad/s"
[encoder]
lines = 1024
[hand]
kind = "none"
[clock]
frequency = "50 MHz"
[run]
duration = "20 ms"
"#;

/// The hybrid loop and its wall, to put behind [`PLANT`].
pub const LOGIC: &str = r#"
[method]
kind = "hybrid"
sample_rate = "1 kHz"
[wall]
position = "0.2 rad"
stiffness = "1.5 N.m/rad"
damping = 0
"#;

/// A scene that is made of these parts.
pub fn written(parts: &[&str]) -> SceneFile {
    SceneFile { name: "written.toml".into(), text: parts.concat(), data: PathBuf::from("."), is_shipped: false }
}
