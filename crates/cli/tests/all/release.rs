//! Releases: the workflows call scripts that are there, and `testbench/release.sh` refuses a commit that is not ready.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::{ROOT, code, scratch, stdout};

/// Runs git in a folder.
fn git(folder: &Path, arguments: &[&str]) -> String {
    let own = ["-c", "user.name=hpu", "-c", "user.email=hpu@hpu.example", "-c", "commit.gpgsign=false"];
    let output = Command::new("git").args(own).args(arguments).current_dir(folder).output().expect("git");
    assert_eq!(code(&output), 0, "{output:?}");
    stdout(&output)
}

/// Returns the workflows, with their names.
fn workflows() -> Vec<(String, String)> {
    let folder = Path::new(ROOT).join(".github/workflows");
    let files = fs::read_dir(folder).expect("workflows").flatten().map(|entry| entry.path());
    let named = |path: PathBuf| (path.display().to_string(), fs::read_to_string(&path).expect("a workflow"));
    files.map(named).collect()
}

#[test]
fn workflows_call_scripts_that_are_there_and_pin_actions() {
    let (mut called, mut used) = (0, 0);
    for (name, text) in workflows() {
        assert!(!text.contains('\t') && text.contains("\npermissions:\n"), "{name}");
        for line in text.lines().map(str::trim_start) {
            assert_eq!(line.matches("${{").count(), line.matches("}}").count(), "{name}: {line}");
            let step = line.strip_prefix("- ").unwrap_or(line);
            if let Some(action) = step.strip_prefix("uses: ") {
                let pinned = action.split_once("@v").is_some_and(|(_, tag)| tag.starts_with(char::is_numeric));
                assert!(pinned, "{name}: {action}");
                used += 1;
            }
            let Some(script) = step.strip_prefix("run: ").and_then(|run| run.split(' ').next()) else { continue };
            if script.contains('/') {
                let file = fs::metadata(Path::new(ROOT).join(script));
                assert!(file.is_ok_and(|file| file.permissions().mode() & 0o111 != 0), "{name}: {script}");
                called += 1;
            }
        }
    }
    assert!(called >= 6 && used >= 8, "{called} scripts, {used} actions");
}

/// Copies what the check of a release reads into a repository of its own, ready for a release.
fn ready(folder: &Path) {
    fs::create_dir_all(folder).expect("a folder");
    let tracked = ["crates/*/Cargo.toml", "Cargo.toml", "Cargo.lock", "CITATION.cff", "CHANGELOG.md", "testbench/*.sh"];
    let files = git(Path::new(ROOT), &[&["ls-files", "crates/capi/include/hpu.h"], &tracked[..]].concat());
    for file in files.lines() {
        fs::create_dir_all(folder.join(file).parent().expect("a folder")).expect("a folder");
        fs::copy(Path::new(ROOT).join(file), folder.join(file)).expect("a file");
    }
    let change = |file: &str, from: &str, to: &str| {
        let text = fs::read_to_string(folder.join(file)).expect("a file");
        fs::write(folder.join(file), text.replacen(from, to, 1)).expect("a file");
    };
    change("Cargo.toml", "https://hpu.example/hpu", "https://example.org/hpu");
    change("CHANGELOG.md", "(not yet released)", "(2030-01-02)");
    git(folder, &["init", "-q", "."]);
    git(folder, &["add", "-A"]);
    git(folder, &["commit", "-q", "-m", "all"]);
}

#[test]
fn a_commit_becomes_a_release_where_nothing_is_in_the_way() {
    let folder = scratch("release");
    ready(&folder);
    let check = |arguments: &[&str]| -> Output {
        let script = folder.join("testbench/release.sh");
        Command::new("bash").arg(script).arg("--check").args(arguments).output().expect("bash")
    };
    let version = env!("CARGO_PKG_VERSION");
    let tag = format!("v{version}");
    let fine = check(&[]);
    let told = stdout(&fine);
    assert_eq!(code(&fine), 0, "{told}");
    assert!(told.contains(&format!("git tag -a {tag} -m \"hpu {version}\"\n")), "{told}");
    assert_eq!(code(&check(&[&tag])), 0);
    // Each of these alone is in the way, and is told.
    let broken = [
        ("CHANGELOG.md", " (2030-01-02)", "", "CHANGELOG.md begins with"),
        ("CITATION.cff", "\nversion: ", "\nversion: 9", "CITATION.cff"),
        ("crates/capi/include/hpu.h", "VERSION_MINOR ", "VERSION_MINOR 9", "hpu.h has"),
        ("crates/plant/Cargo.toml", "version.workspace = true", "version = \"9.0.0\"", "crates/plant/Cargo.toml"),
        ("Cargo.toml", "\"crates/wave\", version = \"", "\"crates/wave\", version = \"9", "hpu-wave = {"),
        ("Cargo.lock", "name = \"hpu-rtl\"\nversion = \"", "name = \"hpu-rtl\"\nversion = \"9", "Cargo.lock has"),
        ("Cargo.toml", "https://example.org", "https://hpu.example", "no public place"),
    ];
    for (file, from, to, told) in broken {
        let text = fs::read_to_string(folder.join(file)).expect("a file");
        assert!(text.contains(from), "{file} has no {from:?}");
        fs::write(folder.join(file), text.replacen(from, to, 1)).expect("a file");
        git(&folder, &["commit", "-q", "-a", "-m", "broken"]);
        let refused = check(&[]);
        assert_eq!(code(&refused), 1, "{file}");
        let lines: Vec<String> = stdout(&refused).lines().map(str::to_string).collect();
        assert!(lines.len() == 1 && lines[0].starts_with("not yet: ") && lines[0].contains(told), "{lines:?}");
        git(&folder, &["reset", "-q", "--hard", "HEAD~1"]);
    }
    fs::write(folder.join("more"), "").expect("a file");
    assert_eq!(stdout(&check(&[])), "not yet: the tree has changes that are in no commit\n");
    fs::remove_file(folder.join("more")).expect("the file");
    assert_eq!(stdout(&check(&["v9.9.9"])), format!("not yet: the tag v9.9.9 is not {tag}\n"));
    git(&folder, &["tag", &tag]);
    assert_eq!(stdout(&check(&[])), format!("not yet: the tag {tag} exists\n"));
}
