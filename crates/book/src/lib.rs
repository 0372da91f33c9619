//! The book: pages written by hand in `pages/`, and pages made from the code and the records while it is rendered.
//!
//! A page asks for a made part by a line of its own, such as `<!-- keys -->`; `made` lists all of them. A link
//! that leaves `pages/` by `../` names a file of the repository. The book carries a copy of each such file, so
//! that it can be moved or published as it is.

pub mod equation;
mod gallery;
mod header;
mod links;
mod papers;
mod sheet;
mod timing;

use std::fs;
use std::path::{Path, PathBuf};

use mdbook_driver::MDBook;
use mdbook_driver::book::{BookItem, Chapter};
use mdbook_driver::config::Config;
use mdbook_driver::errors::{Error, Result};

use links::Carried;

/// The settings of mdBook: a search over all pages, and neither fonts nor anything from a network.
const SETTINGS: &str = r#"
[book]
title = "hpu"
description = "Cycle-accurate emulator of haptic FPGA datapaths"
src = "pages"
[build]
create-missing = false
use-default-preprocessors = false
[output.html]
theme = "theme"
additional-css = ["theme/book.css"]
input-404 = ""
smart-punctuation = false
[output.html.fold]
enable = true
[output.html.print]
enable = false
[output.html.search]
enable = true
"#;

/// Returns the folder of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns a file of the repository as text.
fn text(file: &str) -> Result<String> {
    fs::read_to_string(root().join(file)).map_err(|error| Error::msg(format!("{file}: {error}")))
}

/// Renders the book into a folder that does not exist, is empty, or holds a book, which is replaced.
///
/// # Errors
///
/// Returns an error that names the page and the reason: a made part that does not exist, a link to a file that does not
/// exist, or a scene that does not run. Also returns an error when the folder cannot be written, or holds other files.
pub fn render(out: &Path) -> Result<()> {
    fs::create_dir_all(out)?;
    // The renderer empties the folder.
    if fs::read_dir(out)?.next().is_some() && !out.join("toc.html").is_file() {
        return Err(Error::msg(format!("{} holds files that are no book; name an empty folder", out.display())));
    }
    let mut config: Config = SETTINGS.parse()?;
    config.build.build_dir = fs::canonicalize(out)?;
    let mut book = MDBook::load_with_config(Path::new(env!("CARGO_MANIFEST_DIR")), config)?;
    let mut carried = Carried::default();
    for item in &mut book.book.items {
        let BookItem::Chapter(chapter) = item else { continue };
        if chapter.path.as_deref() == Some(Path::new("blocks.md")) {
            chapter.sub_items = sheets(chapter)?.into_iter().map(BookItem::Chapter).collect();
        }
        finish(chapter, &mut carried)?;
    }
    book.build()?;
    carried.write(&root(), out)
}

/// Returns the data sheets as chapters below the list of blocks.
fn sheets(list: &Chapter) -> Result<Vec<Chapter>> {
    let blocks = hpu_datapath::registry();
    let mut chapters = Vec::new();
    for (block, at) in blocks.iter().zip(1..) {
        let parents = vec![list.name.clone()];
        let place = format!("blocks/{}.md", block.name());
        let mut chapter = Chapter::new(block.name(), sheet::sheet(&**block)?, place, parents);
        chapter.number = list.number.clone().map(|mut number| {
            number.push(at);
            number
        });
        chapters.push(chapter);
    }
    Ok(chapters)
}

/// Puts the made parts into a chapter and those below it, and has the files that they link to carried.
fn finish(chapter: &mut Chapter, carried: &mut Carried) -> Result<()> {
    let page = chapter.path.clone().ok_or_else(|| Error::msg(format!("{} has no page", chapter.name)))?;
    let mut whole = String::new();
    let mut is_fenced = false;
    for line in chapter.content.lines() {
        // mdBook would guess the language of a block that names none.
        if line.starts_with("```") {
            is_fenced = !is_fenced;
            whole += if is_fenced && line == "```" { "```text" } else { line };
        } else if let Some(part) = line.strip_prefix("<!-- ").and_then(|rest| rest.strip_suffix(" -->")) {
            whole += &made(part, carried).map_err(|error| Error::msg(format!("{}: {error}", page.display())))?;
        } else {
            whole += line;
        }
        whole.push('\n');
    }
    chapter.content = carried.rewritten(&whole, &page)?;
    chapter.sub_items.iter_mut().try_for_each(|item| match item {
        BookItem::Chapter(below) => finish(below, carried),
        _ => Ok(()),
    })
}

/// Returns the part of a page that is made while the book is rendered.
fn made(part: &str, carried: &mut Carried) -> Result<String> {
    match part.split_once(' ').unwrap_or((part, "")) {
        ("keys", "") => keys(),
        ("scenes", "") => gallery::gallery(carried),
        ("blocks", "") => sheet::list(),
        ("summing-up", record) => papers::summing_up(&text(&format!("testbench/record/{record}.txt"))?)
            .ok_or_else(|| Error::msg(format!("no summing up in testbench/record/{record}.txt"))),
        _ => Err(Error::msg(format!("nothing is made for `{part}`"))),
    }
}

/// Returns the list of all keys, whose section names become headings.
fn keys() -> Result<String> {
    let lines = text("crates/scene/src/keys.md")?;
    let headed = lines.lines().map(|line| match line {
        "" => "\n".to_string(),
        row if row.starts_with('|') => format!("{row}\n"),
        name => format!("## {name}\n"),
    });
    Ok(headed.collect())
}
