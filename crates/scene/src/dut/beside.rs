//! Files that a design reads although nobody lists them: the headers of `` `include `` and the data of its memories, as
//! of `$readmemh("rom.hex", rom)` or of VHDL's `file_open(f, "rom.hex", read_mode)`.

use std::collections::BTreeMap;
use std::io;
use std::mem;
use std::ops::Range;
use std::sync::Arc;

use super::{Generic, SourceFile};
use crate::schema::identifier::{Identifier, Language};

/// The endings of files of data, in lower case. A text with another ending names a file of data only where a memory is
/// read from it.
const DATA: [&str; 14] =
    ["mem", "hex", "bin", "dat", "data", "txt", "mif", "coe", "init", "rom", "ini", "csv", "vec", "tv"];
/// The folder for files that cannot have their own names in the folder of the tools.
const RENAMED: &str = "beside";
/// The longest text that is taken for a file's name, in bytes.
const LONGEST: usize = 255;

/// A file that a design reads and nobody lists.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BesideFile {
    /// Its path from the folder of the tools, by which the design's texts name it: a plain name, or a plain name in one
    /// folder.
    pub place: String,
    /// Its path as the scene would have it.
    pub path: String,
    /// Its content.
    pub content: Arc<[u8]>,
}

/// Finds the files that a design reads and nobody lists: in the folder of the file that names them, then in those of
/// the other files, then where the paths of `files` begin. `load` reads a file by such a path. A file that is not found
/// is left to the tools, which know whether they need it.
///
/// The tools find each file by its place. Where the name in a source or in a generic is another, it is replaced.
pub fn beside(
    files: &mut [SourceFile],
    generics: &mut [(Identifier, Generic)],
    load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Vec<BesideFile> {
    let language = Language::of(files);
    let mut folders: Vec<String> = Vec::new();
    for folder in files.iter().map(|(path, _)| folder(path)).chain([""]) {
        if !folders.iter().any(|known| known == folder) {
            folders.push(folder.to_string());
        }
    }
    let listed = files.iter().map(|(path, _)| path.clone()).collect();
    let prefixes = prefixes(files, generics, language);
    let (found, known) = (Vec::new(), BTreeMap::new());
    let mut search = Search { language, folders, listed, prefixes, load, found, headers: 0, known };
    for (path, content) in files.iter_mut() {
        search.read(path, content);
    }
    for (_, value) in generics {
        if let Generic::Text(text) = value
            && is_data(text)
            && let Some(place) = search.place(text, "", Use::Text)
        {
            *text = place;
        }
    }
    search.found.into_iter().map(|(file, _)| file).collect()
}

/// What a text in a source names.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Use {
    /// A header.
    Header,
    /// The data of a memory.
    Memory,
    /// Maybe a file.
    Text,
}

struct Search<'a> {
    language: Language,
    /// The folders in which files are looked for.
    folders: Vec<String>,
    listed: Vec<String>,
    /// Folders before which, as in `{DATA, "rom.hex"}`, a source may put the name of a file.
    prefixes: Vec<String>,
    load: &'a mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    /// The files that were found; headers have been searched themselves up to a number of them.
    found: Vec<(BesideFile, Use)>,
    headers: usize,
    /// The place of each path that was tried; `None` where there is no file.
    known: BTreeMap<String, Option<String>>,
}

impl Search<'_> {
    /// Finds the files that a source and its headers name, and replaces their names.
    fn read(&mut self, path: &str, content: &mut Arc<[u8]>) {
        self.rename(path, content);
        while self.headers < self.found.len() {
            let (file, of) = &mut self.found[self.headers];
            self.headers += 1;
            if *of == Use::Header {
                let (index, path, mut content) = (self.headers - 1, file.path.clone(), mem::take(&mut file.content));
                self.rename(&path, &mut content);
                self.found[index].0.content = content;
            }
        }
    }

    fn rename(&mut self, path: &str, content: &mut Arc<[u8]>) {
        let mut renamed = Vec::new();
        let mut done = 0;
        for (range, of) in texts(content, self.language) {
            let Ok(text) = std::str::from_utf8(&content[range.clone()]) else { continue };
            let found = self.place(text, folder(path), of);
            let is_joined = of == Use::Text && self.joined(text, folder(path));
            if let Some(place) = found.filter(|place| place != text && !is_joined) {
                renamed.extend_from_slice(&content[done..range.start]);
                renamed.extend_from_slice(place.as_bytes());
                done = range.end;
            }
        }
        if done > 0 {
            renamed.extend_from_slice(&content[done..]);
            *content = renamed.into();
        }
    }

    /// Finds the files that a text may name behind a text with a folder, and returns whether there are any. Their
    /// places are these names, because the design puts them together while it runs.
    fn joined(&mut self, text: &str, from: &str) -> bool {
        if !is_plain(text) || !is_data(text) {
            return false;
        }
        for prefix in self.prefixes.clone() {
            let place = format!("{prefix}{text}");
            let is_free = self.found.iter().all(|(file, _)| file.place != place);
            let places = [from.to_string()].into_iter().chain(self.folders.clone());
            let paths =
                places.map(|folder| if folder.is_empty() { place.clone() } else { format!("{folder}/{place}") });
            let file =
                is_free.then(|| paths.into_iter().find_map(|path| Some(((self.load)(&path).ok()?, path)))).flatten();
            if let Some((content, path)) = file {
                self.found.push((BesideFile { place, path, content: content.into() }, Use::Text));
            }
        }
        let is_one = |file: &BesideFile| {
            file.place.strip_suffix(text).is_some_and(|folder| self.prefixes.contains(&folder.to_string()))
        };
        self.found.iter().any(|(file, _)| is_one(file))
    }

    /// Returns the place of the file that a text in a file of this folder names; `None` if it names none.
    fn place(&mut self, text: &str, from: &str, of: Use) -> Option<String> {
        if text.is_empty() || text.len() > LONGEST || text.chars().any(|c| c.is_control() || "\\\"".contains(c)) {
            return None;
        }
        let folders = self.folders.clone();
        for folder in [from].into_iter().chain(folders.iter().map(String::as_str)) {
            let path =
                if folder.is_empty() || text.starts_with('/') { text.into() } else { format!("{folder}/{text}") };
            let same = normal(&path);
            if let Some(listed) = self.listed.iter().find(|listed| normal(listed) == same) {
                return Some(base(listed).to_string());
            }
            if !self.known.contains_key(&same) {
                let content = (self.load)(&path).ok();
                let place = content.as_ref().map(|_| self.free(text));
                self.known.insert(same.clone(), place.clone());
                if let (Some(content), Some(place)) = (content, place) {
                    self.found.push((BesideFile { place, path, content: content.into() }, of));
                }
            }
            if let Some(place) = &self.known[&same] {
                return Some(place.clone());
            }
        }
        let named = |listed: &&String| base(listed) == base(text);
        self.listed.iter().find(named).filter(|_| of != Use::Text).map(|listed| base(listed).to_string())
    }

    /// Returns a place for a file of this name: the name itself where it is a plain one that no other file has.
    fn free(&self, text: &str) -> String {
        // The tools' own files have other endings, or begin with these letters.
        let ending = text.rsplit_once('.').map_or("", |(_, ending)| ending);
        let is_ours =
            text.starts_with("hpu") || !(is_data(text) || ["v", "vh", "svh", "sv", "inc", "h"].contains(&ending));
        let is_taken = self.listed.iter().any(|listed| base(listed) == text)
            || self.found.iter().any(|(file, _)| file.place == text);
        if is_plain(text) && !is_ours && !is_taken {
            return text.to_string();
        }
        let name: String = base(text).chars().map(|c| if may_be_plain(c) { c } else { '_' }).collect();
        format!("{RENAMED}/{}_{name}", self.found.len())
    }
}

fn may_be_plain(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_-+.".contains(c)
}

/// Returns whether a text is a name that no tool takes for anything else.
fn is_plain(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_') && text.chars().all(may_be_plain)
}

/// Returns the texts of a design that are a plain folder with a `/` behind it, but for folders of our own.
fn prefixes(files: &[SourceFile], generics: &[(Identifier, Generic)], language: Language) -> Vec<String> {
    let is_folder = |text: &str| {
        let name = text.strip_suffix('/').filter(|name| is_plain(name) && text.len() < LONGEST);
        name.is_some_and(|name| !["obj", RENAMED].contains(&name) && !name.starts_with("hpu"))
    };
    let mut all: Vec<String> = Vec::new();
    let given = generics.iter().filter_map(|(_, value)| match value {
        Generic::Text(text) => Some(text.clone()),
        _ => None,
    });
    let written = files.iter().flat_map(|(_, content)| {
        strings(content, language).into_iter().map(|range| String::from_utf8_lossy(&content[range]).into_owned())
    });
    for text in given.chain(written).filter(|text| is_folder(text)) {
        if !all.contains(&text) {
            all.push(text);
        }
    }
    all
}

fn folder(path: &str) -> &str {
    path.rsplit_once('/').map_or("", |(folder, _)| if folder.is_empty() { "/" } else { folder })
}

fn base(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// Returns a path without `.` and without folders that `..` leaves again.
fn normal(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "." => {}
            "" if !parts.is_empty() => {}
            ".." if parts.last().is_some_and(|last| *last != "..") => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Returns whether a text has the form of a name of a file of data.
fn is_data(text: &str) -> bool {
    let ending = text.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| DATA.contains(&ending.as_str())) && !text.contains(['%', '*', '?'])
}

/// Returns the texts of a source that may name a file, without their quotes.
fn texts(source: &[u8], language: Language) -> Vec<(Range<usize>, Use)> {
    let mut all = Vec::new();
    for range in strings(source, language) {
        let (before, text) = (&source[..range.start - 1], &source[range.clone()]);
        let after = |words: &[&str]| {
            let before = before.trim_ascii_end();
            words.iter().any(|word| before.ends_with(word.as_bytes()))
        };
        let called = |words: &[&str]| {
            let before = before.trim_ascii_end().strip_suffix(b"(").unwrap_or_default().trim_ascii_end();
            words.iter().any(|word| before.ends_with(word.as_bytes()))
        };
        let of = match language {
            Language::Verilog if after(&["`include"]) => Use::Header,
            Language::Verilog if called(&["$readmemh", "$readmemb"]) => Use::Memory,
            Language::Verilog if called(&["$dumpfile", "$writememh", "$writememb"]) => continue,
            _ if std::str::from_utf8(text).is_ok_and(is_data) => Use::Text,
            _ => continue,
        };
        all.push((range, of));
    }
    all
}

/// Returns the places of the strings of a source, without their quotes. Comments have none.
fn strings(source: &[u8], language: Language) -> Vec<Range<usize>> {
    let is_verilog = language == Language::Verilog;
    let comment: &[u8] = if is_verilog { b"//" } else { b"--" };
    let mut all = Vec::new();
    let mut at = 0;
    while at < source.len() {
        let rest = &source[at..];
        let to = |end: &[u8]| rest.windows(end.len()).position(|window| window == end);
        at += if rest.starts_with(comment) {
            to(b"\n").unwrap_or(rest.len())
        } else if rest.starts_with(b"/*") {
            to(b"*/").map_or(rest.len(), |end| end + 2)
        } else if !is_verilog && rest[0] == b'\'' && rest.get(2) == Some(&b'\'') {
            3
        } else if rest[0] == b'"' {
            let mut end = 1;
            while end < rest.len() && !b"\"\n".contains(&rest[end]) {
                end += if is_verilog && rest[end] == b'\\' { 2 } else { 1 };
            }
            if rest.get(end) == Some(&b'"') {
                all.push(at + 1..at + end);
            }
            end + 1
        } else {
            1
        };
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the texts of the sources, and place and path of each file that they read, where these files are there.
    fn found(sources: &[(&str, &str)], there: &[(&str, &str)]) -> (Vec<String>, Vec<(String, String)>) {
        let mut files: Vec<SourceFile> =
            sources.iter().map(|(name, text)| (name.to_string(), text.as_bytes().into())).collect();
        let mut load = |path: &str| {
            let file = there.iter().find(|(name, _)| *name == path);
            file.map(|(_, text)| text.as_bytes().to_vec()).ok_or(io::ErrorKind::NotFound.into())
        };
        let all = beside(&mut files, &mut [], &mut load);
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("text");
        (
            files.iter().map(|(_, content)| text(content)).collect(),
            all.into_iter().map(|file| (file.place, file.path)).collect(),
        )
    }

    fn pair(place: &str, path: &str) -> (String, String) {
        (place.to_string(), path.to_string())
    }

    #[test]
    fn headers_and_data_are_found_beside_the_file_that_names_them() {
        let source = "`include \"defs.vh\" // `include \"no.vh\"\n$readmemh( \"rom.hex\", rom); $display(\"%d.txt\");";
        let there = [("rtl/defs.vh", "`include \"more.vh\""), ("rtl/more.vh", ""), ("rom.hex", ""), ("no.vh", "")];
        let (texts, files) = found(&[("rtl/t.v", source)], &there);
        assert_eq!(texts, [source], "the names are plain, so nothing is replaced");
        let all = [("defs.vh", "rtl/defs.vh"), ("rom.hex", "rom.hex"), ("more.vh", "rtl/more.vh")];
        assert_eq!(files, all.map(|(place, path)| pair(place, path)));
    }

    #[test]
    fn names_with_folders_and_names_of_two_files_are_replaced() {
        let (one, two) = ("`include \"../inc/defs.vh\"\n", "`include \"defs.vh\"\n`include \"lib.v\"\n");
        let there = [("a/../inc/defs.vh", ""), ("b/defs.vh", ""), ("c/lib.v", "")];
        let (texts, files) = found(&[("a/t.v", one), ("b/u.v", two), ("c/lib.v", "")], &there);
        assert_eq!(texts[..2], ["`include \"beside/0_defs.vh\"\n", two]);
        assert_eq!(files, [pair("beside/0_defs.vh", "a/../inc/defs.vh"), pair("defs.vh", "b/defs.vh")]);
    }

    #[test]
    fn vhdl_names_its_data_in_any_text() {
        let source = "-- \"no.hex\"\nconstant C : character := '\"'; file f : text open read_mode is \"rom.hex\";";
        let (texts, files) = found(&[("t.vhd", source)], &[("rom.hex", ""), ("no.hex", "")]);
        assert_eq!((texts, files), (vec![source.to_string()], vec![pair("rom.hex", "rom.hex")]));
    }

    #[test]
    fn a_name_that_is_put_together_is_a_folder_and_a_name() {
        let source = "parameter D = \"data/\"; $readmemh({D, \"rom.hex\"}, rom); x = \"obj/\"; y = \"../\";";
        let there = [("data/rom.hex", ""), ("obj/rom.hex", ""), ("../rom.hex", ""), ("rom.hex", "")];
        let (texts, files) = found(&[("t.v", source)], &there);
        let both = vec![pair("rom.hex", "rom.hex"), pair("data/rom.hex", "data/rom.hex")];
        assert_eq!((texts, files), (vec![source.to_string()], both));
        // In the folder of the file that names it.
        let source = "constant D : string := \"init/\"; file f : text open read_mode is D & \"rom.txt\";";
        let (_, files) = found(&[("rtl/t.vhd", source)], &[("rtl/init/rom.txt", "")]);
        assert_eq!(files, [pair("init/rom.txt", "rtl/init/rom.txt")]);
    }

    #[test]
    fn a_name_of_a_tool_s_own_file_is_replaced() {
        let source = "`include \"main.cpp\"\n`include \"hpu_rows.txt\"\n`include \"-x.vh\"\n`include \"a\\b\"";
        let there = [("main.cpp", ""), ("hpu_rows.txt", ""), ("-x.vh", ""), ("a\\b", "")];
        let (_, files) = found(&[("t.v", source)], &there);
        let places: Vec<_> = files.iter().map(|(place, _)| place.as_str()).collect();
        assert_eq!(places, ["beside/0_main.cpp", "beside/1_hpu_rows.txt", "beside/2_-x.vh"]);
    }
}
