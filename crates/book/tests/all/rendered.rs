//! The rendered book: every link and anchor leads somewhere, nothing comes from a network, every block and scene is in
//! it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use hpu_book::equation::typeset;
use hpu_cosim::scene::shipped;

use crate::equations::equations;

/// Returns all files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Returns the values of an attribute in HTML, as they are written.
fn attributes<'h>(html: &'h str, name: &str) -> Vec<&'h str> {
    let begin = format!(" {name}=\"");
    html.split(&begin).skip(1).map(|rest| rest.split('"').next().expect("a value")).collect()
}

/// Returns a path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut whole = PathBuf::new();
    for part in path.components() {
        match part {
            std::path::Component::ParentDir => _ = whole.pop(),
            std::path::Component::CurDir => {}
            other => whole.push(other),
        }
    }
    whole
}

/// Asserts that each link of each page leads to a file of the book, and each anchor to an element of that file.
fn assert_links(pages: &BTreeMap<PathBuf, String>, all: &BTreeSet<PathBuf>) {
    let mut seen = 0;
    for (page, html) in pages {
        for link in [attributes(html, "href"), attributes(html, "src")].concat() {
            assert!(!link.contains("://"), "{}: {link} leads to a network", page.display());
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target =
                if file.is_empty() { page.clone() } else { plain(&page.parent().expect("a folder").join(file)) };
            assert!(all.contains(&target), "{}: {link} leads nowhere", page.display());
            if !anchor.is_empty() {
                let ids = attributes(&pages[&target], "id");
                assert!(ids.contains(&anchor), "{}: {link} has no such anchor", page.display());
            }
            seen += 1;
        }
    }
    assert!(seen > 1000, "{seen} links");
}

#[test]
fn a_folder_with_other_files_is_left_as_it_is() {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no_book");
    fs::create_dir_all(&out).expect("a folder");
    fs::write(out.join("notes.txt"), "mine").expect("a file");
    let refused = hpu_book::render(&out).expect_err("it holds a file").to_string();
    assert!(refused.ends_with("no_book holds files that are no book; name an empty folder"), "{refused}");
    assert_eq!(fs::read_to_string(out.join("notes.txt")).expect("the file"), "mine");
}

#[test]
fn the_book_is_whole_without_a_network() {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book");
    hpu_book::render(&out).expect("the book");
    let all: BTreeSet<PathBuf> = files(&out).into_iter().collect();
    let of_type = |ending: &str| {
        let own = all.iter().filter(|path| path.extension().is_some_and(|found| found == ending));
        own.map(|path| (path.clone(), fs::read_to_string(path).expect("text"))).collect::<BTreeMap<_, _>>()
    };
    let pages = of_type("html");
    assert_links(&pages, &all);
    // The search finds a word of each page that is written by hand.
    let index = all.iter().find(|path| path.to_string_lossy().contains("searchindex")).expect("an index of the search");
    let index = fs::read_to_string(index).expect("text");
    for page in files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("pages")) {
        let name = page.file_stem().and_then(|name| name.to_str()).expect("a name");
        assert!(name == "SUMMARY" || index.contains(&format!("{name}.html#")), "{name} is not in the search");
    }
    // Scripts and styles ask for no file of a network either.
    for (style, text) in of_type("css") {
        for begin in ["@import", "url(http", "url(\"http", "url('http", "url(//"] {
            assert!(!text.contains(begin), "{}: {begin}", style.display());
        }
    }
    for (script, text) in of_type("js") {
        for begin in ["src=\"http", "src = \"http", "src = 'http", "fetch(\"http", "fetch('http", "import(\"http"] {
            assert!(!text.contains(begin), "{}: {begin}", script.display());
        }
    }
    assert!(!all.iter().any(|path| path.extension().is_some_and(|ending| ending == "woff2")), "fonts are carried");
    // A data sheet a block, a picture a scene at least.
    for block in hpu_datapath::registry() {
        let name = block.name();
        let sheet = &pages[&out.join(format!("blocks/{name}.html"))];
        for part in ["equations", "ports", "timing", "cost", "proof", "source"] {
            assert!(attributes(sheet, "id").contains(&part), "{name} has no {part}");
        }
        assert!(sheet.contains("<svg class=\"timing\""), "{name} has no timing figure");
        let math = |html: &str| html.matches("<div class=\"equations\">").count();
        assert_eq!(math(sheet), math(&typeset(&equations(name))), "equations of {name}");
    }
    // A purpose that takes two lines of the header is whole.
    assert!(pages[&out.join("blocks/trig_cordic.html")].contains("by rotations that only shift and add (clocked)."));
    let gallery = &pages[&out.join("gallery.html")];
    for scene in shipped() {
        assert!(gallery.contains(&format!("src=\"pictures/{}-", scene.name)), "{} has no picture", scene.name);
    }
    // Verdicts are those of the records.
    let hybrid = &pages[&out.join("papers/hybrid-loop.html")];
    assert!(hybrid.contains("10 claims: 3 confirmed, 5 not confirmed, 2 cannot be told."));
    // What is not proved is what the tests of `hpu check --formal` leave open.
    let open = |name: &str| pages[&out.join(format!("blocks/{name}.html"))].contains("Not proved:");
    let names = hpu_datapath::registry().iter().map(|block| block.name()).filter(|name| open(name)).collect::<Vec<_>>();
    assert_eq!(names, ["phantom_engine"]);
}
