// What `hpu --version` says: the version, and the commit where the sources are those of a git work tree.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The sources of the program: a change elsewhere leaves it the same program, and its version clean.
const SOURCES: [&str; 5] =
    [":(glob)crates/*/src/**", ":(glob)crates/*/Cargo.toml", "Cargo.toml", "Cargo.lock", "crates/assets/files"];

/// The version with the commit, as in `0.1.0 (cea5ec6)` or `0.1.0 (cea5ec6-dirty)`; the version alone where `root` is
/// no git work tree, or git is missing.
pub fn version(root: &Path, version: &str) -> String {
    match commit(root) {
        Some(commit) => format!("{version} ({commit})"),
        None => version.to_string(),
    }
}

/// Files whose change can change what [`version`] says.
pub fn watched(root: &Path) -> Vec<PathBuf> {
    if !is_work_tree(root) {
        return Vec::new();
    }
    let place = |name: &str| git(root, &["rev-parse", "--git-path", name]).map(|path| root.join(path));
    // Every commit and every checkout adds a line to the log of HEAD.
    let git_files = ["HEAD", "logs/HEAD"].into_iter().filter_map(place);
    let crates = std::fs::read_dir(root.join("crates")).into_iter().flatten().flatten();
    let of_crates = crates.flat_map(|of| ["src", "Cargo.toml"].map(|name| of.path().join(name)));
    let others = ["Cargo.toml", "Cargo.lock", "crates/assets/files"].map(|name| root.join(name));
    // Cargo would build again and again for the sake of a file that is not there.
    git_files.chain(of_crates).chain(others).filter(|path| path.exists()).collect()
}

/// The commit in seven digits or more, with `-dirty` if sources were changed since.
fn commit(root: &Path) -> Option<String> {
    if !is_work_tree(root) {
        return None;
    }
    let commit = git(root, &["rev-parse", "--short", "HEAD"])?;
    let mut changes = vec!["status", "--porcelain", "--untracked-files=no", "--"];
    changes.extend(SOURCES);
    let dirty = git(root, &changes).is_none_or(|changed| !changed.is_empty());
    Some(if dirty { commit + "-dirty" } else { commit })
}

/// Whether `root` itself is the top of a work tree: sources that lie unpacked in another project's are not of its
/// commit.
fn is_work_tree(root: &Path) -> bool {
    let top = git(root, &["rev-parse", "--show-toplevel"]).map(PathBuf::from);
    match (top.and_then(|top| top.canonicalize().ok()), root.canonicalize()) {
        (Some(top), Ok(root)) => top == root,
        _ => false,
    }
}

/// Runs git and returns its answer without the line feed at its end; `None` when git is missing or fails.
fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    // A build that git started, from a hook, names the index and the work tree of that call.
    let answer = Command::new("git")
        .args(["-C".as_ref(), root.as_os_str()])
        .args(["--no-optional-locks"])
        .args(arguments)
        .env_remove("GIT_DIR")
        .env_remove("GIT_INDEX_FILE")
        .env_remove("GIT_WORK_TREE")
        .output()
        .ok()?;
    answer.status.success().then(|| String::from_utf8_lossy(&answer.stdout).trim_end().to_string())
}
