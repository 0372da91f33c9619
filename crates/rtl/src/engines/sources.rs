//! Finds the VHDL files of a block.

use crate::engines::error::Error;
use crate::engines::ghdl::Library;
use crate::engines::hdl::{Hdl, Setup};

/// Returns the VHDL of a block and of the entities that it instantiates, in the order of analysis, as one text.
///
/// # Errors
///
/// An error when a file cannot be read.
pub fn vhdl(name: &str, hdl: &Hdl) -> Result<String, Error> {
    sources([name], hdl)?.iter().map(|unit| hdl.text(unit)).collect()
}

/// Analyses the VHDL of a block.
pub(crate) fn library(name: &str, setup: &Setup) -> Result<Library, Error> {
    let sources = sources([name], &setup.hdl)?;
    Library::analyse(&[], setup, sources.iter().map(String::as_str), &[])
}

/// Returns the names of these entities and of the units that they instantiate or use, each once, in the order of
/// analysis. No other file of a folder has to exist. Packages of the folder itself are included; the packages that are
/// generated for each block are not.
pub(crate) fn sources<'n>(names: impl IntoIterator<Item = &'n str>, hdl: &Hdl) -> Result<Vec<String>, Error> {
    let mut found = Found { hdl, begun: Vec::new(), done: Vec::new() };
    names.into_iter().try_for_each(|name| found.visit(name))?;
    Ok(found.done)
}

struct Found<'h> {
    hdl: &'h Hdl,
    begun: Vec<String>,
    done: Vec<String>,
}

impl Found<'_> {
    fn visit(&mut self, unit: &str) -> Result<(), Error> {
        if self.begun.iter().any(|known| known == unit) {
            return Ok(());
        }
        self.begun.push(unit.to_string());
        for (name, is_entity) in references(&self.hdl.text(unit)?) {
            let there = self.hdl.text(&name);
            match there {
                Ok(_) if !is_generated(&name) => self.visit(&name)?,
                Err(error) if is_entity => {
                    let needs = format!("; {} instantiates it", self.hdl.file(unit).display());
                    return Err(error.with(&needs));
                }
                // A unit without a file of its own is in another file, or GHDL will report it missing.
                _ => {}
            }
        }
        self.done.push(unit.to_string());
        Ok(())
    }
}

/// Returns whether this is the package of constants that is generated from a block's ports.
fn is_generated(name: &str) -> bool {
    name.strip_suffix("_pkg").is_some_and(|block| hpu_datapath::block_names().contains(&block))
}

/// Returns the names of units from the library `work`, and those of components, each with whether it is instantiated as
/// an entity.
fn references(text: &str) -> Vec<(String, bool)> {
    let code = text.lines().map(|line| line.split_once("--").map_or(line, |(code, _)| code));
    let code = code.collect::<Vec<_>>().join(" ").to_ascii_lowercase();
    let is_letter = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let words: Vec<&str> = code.split(|letter| !is_letter(letter)).filter(|word| !word.is_empty()).collect();
    let mut names = Vec::new();
    for (index, pair) in words.windows(2).enumerate() {
        let before = index.checked_sub(1).map(|before| words[before]);
        match pair {
            ["work", name] => names.push((name.to_string(), before == Some("entity"))),
            ["component", name] if before != Some("end") => names.push((name.to_string(), false)),
            _ => {}
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::references;

    #[test]
    fn entities_packages_and_components_are_found_and_comments_are_not() {
        let text = "-- like entity work.ghost\nuse work.helper.all;\n\
                    component Half is port (a : in bit); end component;\n\
                    u : entity WORK.Adder generic map (N => 1) -- work.other\n";
        let found = references(text);
        let expected = [("helper", false), ("half", false), ("adder", true)];
        assert_eq!(found, expected.map(|(name, is_entity)| (name.to_string(), is_entity)));
    }
}
