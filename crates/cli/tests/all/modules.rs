//! Modules of a crate use each other in no circle, but for a parent and its children.
//!
//! A module is a file. The test reads the paths of each file (`use` and paths in code), finds the file in which the
//! named item is defined, also through `pub use`, and looks for files that reach each other. Tests inside a file do not
//! count, and neither do the uses between a module and the modules below it.

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
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates/");
    let mut found = Vec::new();
    for entry in fs::read_dir(crates).expect("crates/ is readable") {
        let folder = entry.expect("an entry").path();
        let name = folder.file_name().and_then(|name| name.to_str()).expect("UTF-8").to_string();
        let sources = Crate::read(&folder.join("src"));
        found.extend(in_circles(&sources.uses()).into_iter().map(|(from, to)| format!("{name}: {from} uses {to}")));
    }
    assert!(found.is_empty(), "uses in circles:\n{}", found.join("\n"));
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
