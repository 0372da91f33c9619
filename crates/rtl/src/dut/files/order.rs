//! The order of a design's files: each file behind those that it uses.

use std::collections::{BTreeMap, BTreeSet};

use hpu_cosim::scene::Dut;

use super::base;
use crate::engines::error::Error;

/// A use of a file: the index of the used file, and the name of what is used there.
pub(in crate::dut) type Use = (usize, String);

/// Returns the order of files that use each other: that in which they stand, as far as the uses allow.
///
/// # Errors
///
/// When files use each other in a circle.
pub(in crate::dut) fn ordered(dut: &Dut, uses: &[BTreeSet<Use>]) -> Result<Vec<usize>, Error> {
    let mut order = Vec::new();
    while order.len() < uses.len() {
        let waits = |file: usize| uses[file].iter().find(|(other, _)| *other != file && !order.contains(other));
        let left = (0..uses.len()).filter(|file| !order.contains(file)).collect::<Vec<_>>();
        match left.iter().find(|file| waits(**file).is_none()) {
            Some(&file) => order.push(file),
            None => return Err(Error::key("dut.files", circle(dut, left[0], waits))),
        }
    }
    Ok(order)
}

/// Returns the message about the circle to which the files lead that wait for each other from a first one.
fn circle<'u>(dut: &Dut, first: usize, waits: impl Fn(usize) -> Option<&'u Use>) -> String {
    let (mut path, mut file) = (Vec::new(), first);
    while let Some((next, what)) = waits(file).filter(|_| !path.iter().any(|(seen, _)| *seen == file)) {
        path.push((file, (next, what)));
        file = *next;
    }
    let begin = path.iter().position(|(seen, _)| *seen == file).unwrap_or(0);
    let name = |file: usize| base(&dut.files[file].0);
    let uses =
        path[begin..].iter().map(|(file, (next, what))| format!("{} uses `{what}` of {}", name(*file), name(**next)));
    format!(
        "files use each other in a circle: {}; move what one of them needs to a file of its own",
        uses.collect::<Vec<_>>().join(", ")
    )
}

/// Returns the files of a Verilog design in an order in which every package stands before its uses.
///
/// # Errors
///
/// When files use each other's packages in a circle.
pub(in crate::dut) fn of_verilog(dut: &Dut) -> Result<Dut, Error> {
    let texts: Vec<_> = dut.files.iter().map(|(_, content)| String::from_utf8_lossy(content)).collect();
    let words: Vec<Vec<&str>> = texts.iter().map(|text| words(text)).collect();
    let mut packages = BTreeMap::new();
    for (file, words) in words.iter().enumerate() {
        for (at, word) in words.iter().enumerate() {
            let name = words.get(at + 1).filter(|word| !["automatic", "static"].contains(word)).or(words.get(at + 2));
            if let ("package", Some(name)) = (*word, name) {
                packages.entry(*name).or_insert(file);
            }
        }
    }
    if packages.is_empty() {
        return Ok(dut.clone());
    }
    let used = |words: &Vec<&str>| -> BTreeSet<Use> {
        let before = words.windows(2).filter(|two| two[1] == "::").map(|two| two[0]);
        before.filter_map(|name| Some((*packages.get(name)?, name.to_string()))).collect()
    };
    let own: Vec<_> = words.iter().map(used).collect();
    // What a header uses, the files use that include it.
    let includes = |words: &Vec<&str>| {
        let names =
            words.windows(3).filter(|three| three[..2] == ["`", "include"]).map(|three| three[2].trim_matches('"'));
        let file = |name: &str| dut.files.iter().position(|(file, _)| base(file) == base(name));
        names.filter_map(file).flat_map(|file| own[file].clone()).collect::<BTreeSet<_>>()
    };
    let uses: Vec<_> = words.iter().zip(&own).map(|(words, own)| own | &includes(words)).collect();
    let order = ordered(dut, &uses)?;
    Ok(Dut { files: order.into_iter().map(|file| dut.files[file].clone()).collect(), ..dut.clone() })
}

/// Returns the words of Verilog, its texts in their quotes, `::` and backquotes; other signs are left out.
fn words(text: &str) -> Vec<&str> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '$';
    let (mut all, mut at) = (Vec::new(), 0);
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let length = match c {
            _ if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            _ if rest.starts_with("/*") => rest.find("*/").map_or(rest.len(), |end| end + 2),
            '"' => rest[1..].find(['"', '\n']).map_or(rest.len(), |end| end + 2),
            _ if is_part(c) => rest.find(|c| !is_part(c)).unwrap_or(rest.len()),
            _ if rest.starts_with("::") => 2,
            c => c.len_utf8(),
        };
        let word = &rest[..length];
        if is_part(c) || ["::", "`"].contains(&word) || word.starts_with('"') {
            all.push(word);
        }
        at += length;
    }
    all
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn names(files: &[(&str, &str)]) -> Result<Vec<String>, Error> {
        let files = files.iter().map(|(name, text)| ((*name).to_string(), Arc::from(text.as_bytes()))).collect();
        let dut = of_verilog(&Dut { files, ..Dut::pins() })?;
        Ok(dut.files.into_iter().map(|(name, _)| name).collect())
    }

    #[test]
    fn packages_stand_before_the_files_that_use_them_and_a_circle_is_told() {
        let files = [
            ("top.sv", "module top import q::*; (input a); endmodule // r::x"),
            ("other.v", "module other; endmodule"),
            ("q.sv", "`include \"h.svh\"\npackage automatic q; endpackage"),
            ("p.sv", "package p; localparam W = 3; endpackage"),
            ("h.svh", "localparam V = p::W;"),
        ];
        assert_eq!(names(&files).expect("an order"), ["other.v", "p.sv", "q.sv", "top.sv", "h.svh"]);
        let circle =
            [("a.sv", "package a; localparam X = b::Y; endpackage"), ("b.sv", "package b; import a::*; endpackage")];
        let why = names(&circle).expect_err("a circle").to_string();
        assert!(why.contains("a.sv uses `b` of b.sv, b.sv uses `a` of a.sv"), "{why}");
    }
}
