//! Folders of a crate use each other in no circle, and neither do files, but for a parent and its children.
//!
//! The tests read the paths of each file (`use` and paths in code), find the file in which the named item is defined,
//! also through `pub use`, and look for folders, or files, that reach each other. Tests inside a file do not count, and
//! neither does the root of a crate, which names all of its modules. A folder is what a reader sees: all files in it,
//! its `mod.rs` too, but not the folders in it. A file beside the root is a folder of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A path in a source, as in `crate::wall::Wall`.
type Words = Vec<String>;

/// A file of a crate.
#[derive(Default)]
struct Module {
    /// Names that `use` brings in, with their paths.
    imports: BTreeMap<String, Words>,
    /// Paths whose names `use` brings in all together.
    globs: Vec<Words>,
    /// Names of items that the file defines.
    defined: BTreeSet<String>,
    /// Every path in the file.
    paths: Vec<Words>,
}

/// The modules of a crate by their paths; the root's path is empty.
struct Crate(BTreeMap<String, Module>);

/// Returns the words and signs of a source without comments, texts, and tests in the file.
fn tokens(source: &str) -> Vec<String> {
    let (mut found, chars) = (Vec::<String>::new(), source.chars().collect::<Vec<_>>());
    let mut at = 0;
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    while at < chars.len() {
        let rest = |text: &str| text.chars().enumerate().all(|(k, c)| chars.get(at + k) == Some(&c));
        let from = at;
        match chars[at] {
            '/' if rest("//") => at += chars[at..].iter().take_while(|c| **c != '\n').count(),
            'r' if rest("r\"") => at += 2 + chars[at + 2..].iter().take_while(|c| **c != '"').count() + 1,
            'r' if rest("r#\"") => {
                let text: String = chars[at..].iter().collect();
                at += text[..text.find("\"#").expect("a raw text ends")].chars().count() + 2;
            }
            '"' => {
                at += 1;
                while chars[at] != '"' {
                    at += if chars[at] == '\\' { 2 } else { 1 };
                }
                at += 1;
            }
            '\'' if chars.get(at + 1) == Some(&'\\') => at += 3 + usize::from(chars[at + 3] != '\''),
            '\'' if chars.get(at + 2) == Some(&'\'') => at += 3,
            ':' if rest("::") => at += 2,
            c if is_word(c) => at += chars[at..].iter().take_while(|c| is_word(**c)).count(),
            _ => at += 1,
        }
        let token: String = chars[from..at].iter().collect();
        if !(token.trim().is_empty()
            || token.starts_with("//")
            || token.starts_with(['"', '\''])
            || token.ends_with('"'))
        {
            found.push(token);
        }
    }
    without_tests(&found)
}

fn without_tests(tokens: &[String]) -> Vec<String> {
    let test = ["#", "[", "cfg", "(", "test", ")", "]", "mod"];
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        if tokens[at..].iter().zip(test).filter(|(token, test)| token == test).count() == test.len()
            && tokens.get(at + test.len() + 1).is_some_and(|token| token == "{")
        {
            at += closed(&tokens[at..]);
        } else {
            kept.push(tokens[at].clone());
            at += 1;
        }
    }
    kept
}

/// Returns the number of tokens up to the brace that closes the first one, with that brace.
fn closed(tokens: &[String]) -> usize {
    let mut depth = 0;
    let ends = |token: &String| {
        depth += i32::from(token == "{") - i32::from(token == "}");
        token == "}" && depth == 0
    };
    tokens.iter().position(ends).expect("a brace is closed") + 1
}

impl Module {
    fn read(source: &str) -> Self {
        let (tokens, mut module) = (tokens(source), Self::default());
        let mut at = 0;
        while at < tokens.len() {
            let (token, next) = (tokens[at].as_str(), tokens.get(at + 1).map_or("", String::as_str));
            match token {
                "use" => {
                    let end = at + tokens[at..].iter().position(|token| token == ";").expect("`use` ends");
                    module.import(&tokens[at + 1..end], &[]);
                    at = end;
                }
                // The place in `pub(in crate::a)` is who may use it, not what it uses.
                "in" if at > 1 && tokens[at - 2..at] == ["pub", "("] => {
                    at += tokens[at..].iter().position(|token| token == ")").expect("a visibility ends");
                }
                "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union" => {
                    module.defined.insert(next.to_string());
                }
                "macro_rules" => {
                    module.defined.insert(tokens[at + 2].clone());
                }
                _ if next == "::" && (at == 0 || tokens[at - 1] != "::") => {
                    let words = tokens[at..].chunks(2).take_while(|pair| pair.len() == 2 && pair[1] == "::");
                    let count = words.count();
                    let words = (0..=count).filter_map(|k| tokens.get(at + 2 * k).cloned());
                    module.paths.push(words.collect());
                    at += 2 * count;
                }
                _ => {}
            }
            at += 1;
        }
        module
    }

    /// Reads the tree of a `use` behind a prefix.
    fn import(&mut self, tree: &[String], before: &[String]) {
        let mut depth = 0;
        for part in tree.split(|token| {
            depth += i32::from(token == "{") - i32::from(token == "}");
            token == "," && depth == 0
        }) {
            let open = part.iter().position(|token| token == "{");
            let plain = &part[..open.unwrap_or(part.len())];
            let mut words: Words = before.to_vec();
            words.extend(plain.iter().take_while(|token| *token != "as").filter(|token| *token != "::").cloned());
            if let Some(open) = open {
                self.import(&part[open + 1..part.len() - 1], &words);
                continue;
            }
            let Some(mut last) = words.last().cloned() else { continue };
            if last == "*" {
                words.pop();
                self.globs.push(words.clone());
            } else {
                if last == "self" {
                    words.pop();
                    last = words.last().cloned().unwrap_or_default();
                }
                let alias = plain.iter().position(|token| token == "as").and_then(|at| plain.get(at + 1));
                self.imports.insert(alias.unwrap_or(&last).clone(), words.clone());
            }
            self.paths.push(words);
        }
    }
}

fn parent(module: &str) -> &str {
    module.rsplit_once("::").map_or("", |(above, _)| above)
}

fn below(module: &str, name: &str) -> String {
    if module.is_empty() { name.to_string() } else { format!("{module}::{name}") }
}

/// Returns whether one module is the other or contains it.
fn is_family(one: &str, other: &str) -> bool {
    let holds = |above: &str, low: &str| above.is_empty() || low == above || low.starts_with(&format!("{above}::"));
    holds(one, other) || holds(other, one)
}

impl Crate {
    fn read(folder: &Path) -> Self {
        let mut files = Vec::new();
        collect(folder, &mut files);
        let module = |file: &PathBuf| {
            let path = file.strip_prefix(folder).expect("inside").with_extension("");
            let mut names: Vec<_> = path.iter().map(|name| name.to_str().expect("UTF-8")).collect();
            names.pop_if(|last| ["mod", "lib", "main"].contains(last));
            (names.join("::"), Module::read(&fs::read_to_string(file).expect("a source")))
        };
        Self(files.iter().map(module).collect())
    }

    /// Returns the file in which the item of a path is defined; `None` if it is not of this crate.
    fn home(&self, from: &str, words: &[String], depth: usize) -> Option<String> {
        let (first, rest) = words.split_first()?;
        if depth > 8 {
            return None;
        }
        match first.as_str() {
            "crate" => self.inside("", rest, depth),
            "self" => self.inside(from, rest, depth),
            "super" => self.inside(parent(from), rest, depth),
            name => {
                let module = &self.0[from];
                let known = self.0.contains_key(&below(from, name)) || module.imports.contains_key(name);
                if known { self.inside(from, words, depth) } else { None }
            }
        }
    }

    fn inside(&self, module: &str, words: &[String], depth: usize) -> Option<String> {
        let Some((name, rest)) = words.split_first() else { return Some(module.to_string()) };
        if name == "super" {
            return self.inside(parent(module), rest, depth);
        }
        if self.0.contains_key(&below(module, name)) {
            return self.inside(&below(module, name), rest, depth);
        }
        let Module { imports, globs, defined, .. } = &self.0[module];
        if let (false, Some(import)) = (defined.contains(name), imports.get(name)) {
            return self.home(module, &[import, rest].concat(), depth + 1);
        }
        let homes = globs.iter().filter_map(|glob| self.home(module, glob, depth + 1));
        let home = homes.into_iter().find(|home| self.0[home].defined.contains(name));
        Some(home.unwrap_or_else(|| module.to_string()))
    }

    /// Returns the modules that each module uses, but for those above and below it.
    fn uses(&self) -> BTreeMap<&str, BTreeSet<String>> {
        let of = |(name, module): (&'_ String, &Module)| {
            let homes = module.paths.iter().filter_map(|path| self.home(name, path, 0));
            homes.filter(|home| !is_family(name, home)).collect::<BTreeSet<_>>()
        };
        self.0.iter().map(|entry| (entry.0.as_str(), of(entry))).collect()
    }
}

/// The most files of Rust in one folder of `src`.
const MOST_FILES: usize = 16;

/// The folders of a crate: of each module the folder that its file is in, and the number of files in each folder.
struct Folders {
    of: BTreeMap<String, String>,
    files: BTreeMap<String, usize>,
}

impl Folders {
    fn read(source: &Path) -> Self {
        let mut paths = Vec::new();
        collect(source, &mut paths);
        let (mut of, mut files) = (BTreeMap::new(), BTreeMap::new());
        for path in &paths {
            let inside = path.strip_prefix(source).expect("inside");
            let folder = inside.parent().and_then(Path::to_str).expect("UTF-8").to_string();
            *files.entry(folder.clone()).or_default() += 1;
            let stem = inside.with_extension("");
            let mut names: Vec<_> = stem.iter().map(|name| name.to_str().expect("UTF-8")).collect();
            names.pop_if(|last| ["mod", "lib", "main"].contains(last));
            of.insert(names.join("::"), if folder.is_empty() { names.join("::") } else { folder });
        }
        Self { of, files }
    }

    /// Returns the folders that each folder uses. The root of a crate, whose name is empty, neither uses nor is used.
    fn uses(&self, sources: &Crate) -> BTreeMap<&str, BTreeSet<String>> {
        let mut uses: BTreeMap<&str, BTreeSet<String>> =
            self.of.values().map(|folder| (&**folder, BTreeSet::new())).collect();
        for (name, module) in &sources.0 {
            let from = &self.of[name];
            let homes =
                module.paths.iter().filter_map(|path| sources.home(name, path, 0)).map(|home| self.of[&home].clone());
            let others = homes.filter(|home| home != from && !home.is_empty() && !from.is_empty());
            uses.get_mut(&**from).expect("every folder").extend(others);
        }
        uses
    }
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            files.push(path);
        }
    }
}

/// Returns the uses that are part of a circle: those whose target reaches their origin.
fn in_circles(uses: &BTreeMap<&str, BTreeSet<String>>) -> Vec<(String, String)> {
    let reaches = |from: &str, to: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from.to_string()]);
        while let Some(module) = open.pop() {
            if module == to {
                return true;
            }
            if seen.insert(module.clone()) {
                open.extend(uses[module.as_str()].iter().cloned());
            }
        }
        false
    };
    let all = uses.iter().flat_map(|(from, to)| to.iter().map(|to| (from.to_string(), to.clone())));
    all.filter(|(from, to)| reaches(to, from)).collect()
}

#[test]
fn modules_use_each_other_in_no_circle() {
    let mut found = Vec::new();
    for (name, source) in crates() {
        let sources = Crate::read(&source);
        found.extend(in_circles(&sources.uses()).into_iter().map(|(from, to)| format!("{name}: {from} uses {to}")));
    }
    assert!(found.is_empty(), "uses in circles:\n{}", found.join("\n"));
}

/// Returns every crate's name and the folder of its sources.
fn crates() -> Vec<(String, PathBuf)> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let folders = fs::read_dir(crates).expect("crates/ is readable").map(|entry| entry.expect("an entry").path());
    let name = |folder: &PathBuf| folder.file_name().and_then(|name| name.to_str()).expect("UTF-8").to_string();
    folders.map(|folder| (name(&folder), folder.join("src"))).collect()
}

#[test]
fn folders_use_each_other_in_no_circle() {
    let mut found = Vec::new();
    for (name, source) in crates() {
        let (folders, sources) = (Folders::read(&source), Crate::read(&source));
        let circles = in_circles(&folders.uses(&sources));
        found.extend(circles.into_iter().map(|(from, to)| format!("{name}: {from} uses {to}")));
    }
    assert!(found.is_empty(), "folders in circles:\n{}", found.join("\n"));
}

#[test]
fn no_folder_has_more_than_sixteen_files() {
    let mut crowded = Vec::new();
    for (name, source) in crates() {
        let counts = Folders::read(&source).files.into_iter().filter(|(_, count)| *count > MOST_FILES);
        crowded.extend(counts.map(|(folder, _)| format!("{name}: {folder}")));
    }
    assert!(crowded.is_empty(), "more than {MOST_FILES} files: {crowded:?}");
}

#[test]
fn a_circle_of_folders_is_found_through_their_mod_rs() {
    let of = |files: &[(&str, &str, &str)]| {
        let sources = Crate(files.iter().map(|(name, _, text)| (name.to_string(), Module::read(text))).collect());
        let of = files.iter().map(|(name, folder, _)| (name.to_string(), folder.to_string())).collect();
        let folders = Folders { of, files: BTreeMap::new() };
        in_circles(&folders.uses(&sources)).into_iter().map(|(from, to)| format!("{from}->{to}")).collect::<Vec<_>>()
    };
    let root = ("", "", "mod a; mod c; pub use a::A;");
    let other = ("c", "c", "use crate::a::A; use crate::A;");
    let a = |text| ("a", "a", text);
    let file = |text| ("a::file", "a", text);
    let below = |text| ("a::below", "a/below", text);
    // Files of one folder are one room, and a root names its rooms.
    let one = [root, other, a("mod file; mod below; pub struct A;"), file("use super::A;"), below("pub struct B;")];
    assert_eq!(of(&one), [""; 0]);
    let down = a("mod file; mod below; pub struct A; fn f() -> below::B {}");
    assert_eq!(of(&[root, other, down, file("use super::A;"), below("pub struct B;")]), [""; 0]);
    let up = below("pub struct B; fn f() -> super::A {}");
    assert_eq!(of(&[root, other, down, file("use super::A;"), up]), ["a->a/below", "a/below->a"]);
    let around = [root, ("c", "c", "use crate::a::A; pub struct C;"), a("pub struct A;"), file("use crate::c::C;")];
    assert_eq!(of(&around), ["a->c", "c->a"]);
}

#[test]
fn a_circle_is_found_through_groups_re_exports_and_paths_in_code_and_not_in_tests_and_texts() {
    let of = |files: &[(&str, &str)]| {
        let sources = Crate(files.iter().map(|(name, text)| (name.to_string(), Module::read(text))).collect());
        in_circles(&sources.uses()).into_iter().map(|(from, to)| format!("{from}->{to}")).collect::<Vec<_>>()
    };
    let root = ("", "mod a; mod b; pub use a::{A, deep::{Deep as D}}; pub use b::*;");
    let deep = ("a::deep", "pub struct Deep;");
    let a = |text| ("a", text);
    let b = |text| ("b", text);
    let uses_b = a("mod deep; use crate::{B}; pub struct A;");
    assert_eq!(of(&[root, deep, uses_b, b("pub struct B;")]), [""; 0]);
    assert_eq!(of(&[root, deep, uses_b, b("pub struct B; fn f() -> crate::A {}")]), ["a->b", "b->a"]);
    assert_eq!(of(&[root, deep, uses_b, b("pub struct B; use super::{A as Other};")]), ["a->b", "b->a"]);
    assert_eq!(of(&[root, deep, uses_b, b("pub struct B; use super::a; fn f() { a::A }")]), ["a->b", "b->a"]);
    // What `a::deep` defines is not in `a`, and `a` does not depend on its child here.
    assert_eq!(of(&[root, deep, uses_b, b("pub struct B; use crate::D;")]), [""; 0]);
    let text = "pub struct B; const T: &str = \"crate::A\"; // crate::A\n#[cfg(test)] mod tests { use crate::A; }";
    assert_eq!(of(&[root, deep, uses_b, b(text)]), [""; 0]);
}
