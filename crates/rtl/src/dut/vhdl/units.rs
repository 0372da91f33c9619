//! The design units of files: which of them a file declares and uses, hence the files' libraries and their order.

use std::collections::{BTreeMap, BTreeSet};

use hpu_cosim::scene::{Dut, Identifier, Language};

use super::text::{Token, tokens};
use crate::dut::files::base;
use crate::dut::files::order::{Use, ordered};
use crate::engines::error::Error;

/// The units of a file. Names are in lower case.
#[derive(Default)]
struct Units {
    /// Entities, packages, contexts and configurations.
    declares: BTreeSet<String>,
    /// The entities and packages of which it has architectures, bodies or configurations.
    completes: BTreeSet<String>,
    /// Names of the libraries that it makes visible, beside `work`.
    libraries: BTreeSet<String>,
    /// Names with a dot: a library and a unit, among others.
    names: BTreeSet<(String, String)>,
}

/// Puts each file of a design into its library and behind the files that it uses.
///
/// A file without a library of its own is in another one than the design's if a unit of it is used there and no other
/// file can be meant.
pub(super) fn arrange(dut: &mut Dut, texts: &[String]) -> Result<(), Error> {
    let files: Vec<_> = texts.iter().map(|text| units(text)).collect();
    let libraries = libraries(dut, &files)?;
    let uses: Vec<_> = (0..files.len()).map(|file| uses(&files, &libraries, file)).collect();
    let order = ordered(dut, &uses)?;
    let home = dut.library.to_lowercase();
    let elsewhere = dut.files.iter().zip(&libraries).filter(|(_, library)| **library != *home);
    let named = |library: &String| Identifier::unit(Language::Vhdl, library).expect("a name of VHDL");
    dut.libraries = elsewhere.map(|((name, _), library)| (name.clone(), named(library))).collect();
    dut.files = order.into_iter().map(|file| dut.files[file].clone()).collect();
    Ok(())
}

fn lower(token: &Token) -> String {
    token.text.to_lowercase()
}

fn units(text: &str) -> Units {
    let tokens = tokens(text);
    let mut units = Units::default();
    for (at, token) in tokens.iter().enumerate() {
        let next = |more: usize| tokens.get(at + more);
        let is = |more: usize, word: &str| next(more).is_some_and(|token| token.is(word));
        let (Some(one), Some(_)) = (next(1), next(2)) else { continue };
        if ["entity", "package", "context"].iter().any(|word| token.is(word)) && is(2, "is") {
            units.declares.insert(lower(one));
        } else if token.is("package") && one.is("body") {
            units.completes.extend(next(2).map(lower));
        } else if (token.is("architecture") || token.is("configuration")) && is(2, "of") && is(4, "is") {
            units.completes.extend(next(3).map(lower));
            if token.is("configuration") {
                units.declares.insert(lower(one));
            }
        } else if token.is("library") {
            let names = tokens[at + 1..].iter().take_while(|token| !token.is(";"));
            units.libraries.extend(names.filter(|token| token.is_word()).map(lower));
        } else if token.is_word() && one.is(".") {
            units.names.extend(next(2).map(|unit| (lower(token), lower(unit))));
        }
    }
    units
}

impl Units {
    /// Returns the units that a file in a library uses, each with its library.
    fn used<'u>(&'u self, own: &'u str) -> impl Iterator<Item = (&'u str, &'u str)> {
        let named = self.names.iter().filter_map(move |(library, unit)| match &**library {
            "work" => Some((own, &**unit)),
            library if library == own || self.libraries.contains(library) => Some((library, &**unit)),
            _ => None,
        });
        named.chain(self.completes.iter().map(move |unit| (own, &**unit)))
    }
}

/// Returns the library of each file.
fn libraries(dut: &Dut, files: &[Units]) -> Result<Vec<String>, Error> {
    let home = dut.library.to_lowercase().to_string();
    let mut all: Vec<Option<String>> = vec![None; files.len()];
    let mut set = BTreeSet::new();
    for (name, library) in &dut.libraries {
        if let Some(file) = dut.files.iter().position(|(file, _)| file == name) {
            let library = library.to_lowercase();
            all[file] = Some(if &*library == "work" { home.clone() } else { library.to_string() });
            set.insert(file);
        }
    }
    let top = dut.top.to_lowercase();
    let declaring =
        |unit: &str| (0..files.len()).filter(|&file| files[file].declares.contains(unit)).collect::<Vec<_>>();
    for file in declaring(&top) {
        all[file].get_or_insert_with(|| home.clone());
    }
    // Where a unit is used from decides about the file that declares it, and so about what that file uses.
    let mut done = BTreeSet::new();
    let mut why = BTreeMap::new();
    loop {
        let known = (0..files.len()).find(|file| all[*file].is_some() && !done.contains(file));
        // Files that nothing decides about are in the library of the design.
        let Some(file) = known.or_else(|| (0..files.len()).find(|file| !done.contains(file))) else { break };
        let own = all[file].get_or_insert_with(|| home.clone()).clone();
        done.insert(file);
        for (library, unit) in files[file].used(&own) {
            let of = declaring(unit);
            if of.iter().any(|&other| all[other].as_deref() == Some(library)) {
                continue;
            }
            let free: Vec<_> = of.iter().copied().filter(|other| !set.contains(other)).collect();
            if let [other] = free[..] {
                if let Some(elsewhere) = &all[other] {
                    let name = |file: usize| base(&dut.files[file].0);
                    let by = why.get(&other).map_or_else(String::new, |by: &usize| format!(" by {}", name(*by)));
                    let reason = format!(
                        "`{unit}` of {} is used as {library}.{unit} by {} and as {elsewhere}.{unit}{by}; say its \
                         library: {{ file = \"{}\", library = \"{library}\" }}",
                        name(other),
                        name(file),
                        dut.files[other].0,
                    );
                    return Err(Error::key("dut.files", reason));
                }
                all[other] = Some(library.to_string());
                why.insert(other, file);
            }
        }
        // Bodies and architectures go with what they complete.
        for other in 0..files.len() {
            if all[other].is_none() && files[other].completes.iter().any(|unit| files[file].declares.contains(unit)) {
                all[other] = Some(own.clone());
            }
        }
    }
    Ok(all.into_iter().map(|library| library.unwrap_or_else(|| home.clone())).collect())
}

/// Returns the files that a file uses.
fn uses(files: &[Units], libraries: &[String], file: usize) -> BTreeSet<Use> {
    let of = |(library, unit): (&str, &str)| {
        let declares = |other: &usize| libraries[*other] == library && files[*other].declares.contains(unit);
        let others: Vec<_> = (0..files.len()).filter(declares).collect();
        // A file's own unit stands before its use, or GHDL says so.
        if others.contains(&file) { None } else { others.first().map(|other| (*other, unit.to_string())) }
    };
    files[file].used(&libraries[file]).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::text::plain;
    use super::*;

    fn arranged(files: &[(&str, &str)], set: &[(&str, &str)]) -> Result<Vec<String>, Error> {
        let mut dut = Dut {
            files: files.iter().map(|(name, text)| ((*name).to_string(), Arc::from(text.as_bytes()))).collect(),
            top: Identifier::fixed("Top"),
            libraries: set
                .iter()
                .map(|(name, library)| {
                    ((*name).to_string(), Identifier::unit(Language::Vhdl, library).expect("a name"))
                })
                .collect(),
            ..Dut::pins()
        };
        let texts: Vec<_> = dut.files.iter().map(|(_, content)| plain(content)).collect();
        arrange(&mut dut, &texts)?;
        let library = |name: &String| {
            let found = dut.libraries.iter().find(|(file, _)| file == name);
            found.map_or_else(|| "work".to_string(), |(_, library)| library.to_string())
        };
        Ok(dut.files.iter().map(|(name, _)| format!("{} {name}", library(name))).collect())
    }

    const TOP: &str = "library ieee, my; use ieee.math.all; use my.q.all; entity top is end; architecture a of top is
        begin u : entity my.cell; v : entity work.leaf port map (x => p.y); end;";
    const FILES: [(&str, &str); 6] = [
        ("top.vhd", TOP),
        ("cell_a.vhd", "architecture a of cell is begin end; -- entity leaf is"),
        ("cell.vhd", "entity cell is end;"),
        ("q.vhd", "use work.p.all; package q is constant C : integer := work.p.D; end;"),
        ("leaf.vhd", "entity leaf is end; architecture a of leaf is begin end;"),
        ("p.vhd", "package body p is end; package p is constant D : integer := 1; end;"),
    ];

    #[test]
    fn files_go_into_the_libraries_where_they_are_used_and_behind_what_they_use() {
        let wanted = ["my cell.vhd", "my cell_a.vhd", "work leaf.vhd", "my p.vhd", "my q.vhd", "work top.vhd"];
        let mut found = arranged(&FILES, &[]).expect("an order");
        let place = |name: &str| found.iter().position(|file| file.ends_with(name)).expect("a file");
        for (first, then) in [(" p.vhd", " q.vhd"), (" q.vhd", " top.vhd"), (" cell.vhd", " cell_a.vhd")] {
            assert!(place(first) < place(then), "{found:?}");
        }
        assert!(place(" leaf.vhd") < place(" top.vhd"));
        found.sort();
        let mut all = wanted.map(String::from);
        all.sort();
        assert_eq!(found, all);
        // In their order already, they stay there.
        let ordered = [FILES[5], FILES[3], FILES[2], FILES[1], FILES[4], FILES[0]];
        let names: Vec<_> = arranged(&ordered, &[]).expect("an order");
        assert_eq!(names, ["my p.vhd", "my q.vhd", "my cell.vhd", "my cell_a.vhd", "work leaf.vhd", "work top.vhd"]);
    }

    #[test]
    fn a_circle_and_a_unit_of_two_libraries_are_told() {
        let circle = [
            ("top.vhd", "use work.a.all; entity top is end;"),
            ("a.vhd", "use work.b.all; package a is end;"),
            ("b.vhd", "use work.a.all; package b is end;"),
        ];
        let why = arranged(&circle, &[]).expect_err("a circle").to_string();
        assert!(why.contains("a.vhd uses `b` of b.vhd, b.vhd uses `a` of a.vhd"), "{why}");
        let twice = [
            ("top.vhd", "library my; use work.p.all; use my.p.all; entity top is end;"),
            ("p.vhd", "package p is end;"),
        ];
        let why = arranged(&twice, &[]).expect_err("two libraries").to_string();
        assert!(why.contains("work.p") && why.contains("my.p") && why.contains("library ="), "{why}");
        // Said by the scene, each is where it is.
        let both = [twice[0], twice[1], ("p_2.vhd", "package p is end;")];
        let found = arranged(&both, &[("p_2.vhd", "my")]).expect("two packages");
        assert_eq!(found, ["work p.vhd", "my p_2.vhd", "work top.vhd"]);
    }
}
