//! Every method has what the compiler cannot ask for: a scene, vectors, a row in the documentation of the laws; and the
//! list of methods names the places where the compiler asks for a line.

use std::fs;
use std::path::{Path, PathBuf};

use hpu_scene::keys::{Takes, rows};
use hpu_scene::shipped;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the text of a file, or of all files in a folder.
fn text(path: &str) -> String {
    let whole = root().join(path);
    if whole.is_dir() {
        let files = fs::read_dir(&whole).expect("a folder").map(|entry| entry.expect("an entry").path());
        return files.filter_map(|file| fs::read_to_string(file).ok()).collect();
    }
    fs::read_to_string(whole).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Returns the names of all methods of an axis.
fn methods() -> Vec<&'static str> {
    let kind = rows().find(|row| (row.section, row.key) == ("method", "kind") && row.kinds.contains(&"hybrid"));
    let Some(Takes::Choice(names)) = kind.map(|row| row.takes) else { panic!("a choice of methods") };
    names
}

/// Returns the names of the laws: the methods that are not a loop of their own.
fn laws() -> Vec<&'static str> {
    methods().into_iter().filter(|name| !matches!(*name, "hybrid" | "conventional")).collect()
}

/// Returns `passive_spring` as `PassiveSpring`.
fn as_a_type(name: &str) -> String {
    name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}

/// Returns the name of the block of a law, or of the loop around it: that of the method, but `table` is a word of
/// Verilog, and `pid` a block that every loop may have.
fn as_a_block(name: &str) -> String {
    name.replace("table", "torque_table").replace("pid", "position_pid")
}

#[test]
fn every_method_has_a_scene() {
    let scenes: Vec<_> = shipped().iter().filter_map(|scene| scene.parse(&[]).ok()?.axis()).collect();
    for name in methods() {
        assert!(scenes.iter().any(|scene| scene.method.kind.name() == name), "no shipped scene has the method {name}");
    }
}

#[test]
fn every_method_has_vectors_of_its_law_and_of_its_loop() {
    let loops = methods().into_iter().map(|name| format!("{name}_loop"));
    for block in laws().into_iter().map(String::from).chain(loops).map(|name| as_a_block(&name)) {
        let files = fs::read_dir(root().join("vectors").join(&block)).map(Iterator::count);
        assert!(matches!(files, Ok(1..)), "no vectors of {block}");
    }
}

#[test]
fn every_law_has_a_row_in_the_documentation() {
    let page = text("crates/scene/src/law.rs");
    for law in laws() {
        assert!(
            page.contains(&format!("| `{}` |", as_a_block(law))),
            "no row of {law} in the table of scene/src/law.rs"
        );
    }
}

#[test]
fn the_places_that_a_new_law_needs_are_those_that_name_the_others() {
    let list = text("crates/scene/src/method/mod.rs");
    let steps = list.lines().filter_map(|line| line.strip_prefix("//! ")).filter(|line| line.contains(". `"));
    let places: Vec<_> = steps.filter_map(|step| step.split('`').nth(1)).collect();
    assert_eq!(places.len(), 4, "{places:?}");
    for (place, law) in places.iter().flat_map(|place| laws().into_iter().map(move |law| (place, law))) {
        let source = text(&format!("crates/{place}"));
        let named = source.contains(law) || source.contains(&as_a_type(law));
        assert!(named, "{place} does not name {law}");
    }
}
