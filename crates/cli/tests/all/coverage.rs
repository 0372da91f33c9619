//! The coverage of `hpu check`: what is said of bits that moved follows from the blocks' own definitions.

use std::fs;

use serde_json::Value;

use crate::common::{code, run, scratch, stderr, text};
use crate::report::elements;

/// Reads `coverage.csv`: for `BLOCK VARIANT SIGNAL`, bits, toggled bits, `rose`, `fell`, least and greatest word.
fn rows(csv: &str) -> Vec<(String, Vec<String>)> {
    let mut lines = csv.lines();
    assert!(lines.next().is_some_and(|line| line.starts_with("# hpu check ")), "{csv}");
    assert_eq!(lines.next(), Some("block,variant,signal,role,bits,toggled_bits,rose,fell,least,greatest"));
    let row = |line: &str| {
        let cells: Vec<String> = line.split(',').map(str::to_string).collect();
        (cells[..3].join(" "), cells[3..].to_vec())
    };
    lines.map(row).collect()
}

fn of<'r>(rows: &'r [(String, Vec<String>)], name: &str) -> Vec<&'r str> {
    let (_, cells) = rows.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("{name} in {rows:?}"));
    cells.iter().map(String::as_str).collect()
}

#[test]
fn the_bits_that_moved_are_those_that_can() {
    let dir = scratch("coverage");
    let scene = ["--scene", "hybrid-wall", "--edges", "20000"];
    let blocks = ["check", "unilateral", "truncating_multiplier", "synchronizer", "--rows", "50"];
    let output = run(&[&blocks[..], &scene, &["-q", "-o", text(&dir)]].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let read = |name: &str| fs::read_to_string(dir.join(name)).expect(name);
    let rows = rows(&read("coverage.csv"));
    // A penetration is never negative, so the sign bit of the displacement never appears in it.
    assert_eq!(of(&rows, "unilateral default delta"), ["input", "12", "12", "0xfff", "0xfff", "-2048", "2047"]);
    assert_eq!(of(&rows, "unilateral default penetration"), ["output", "12", "11", "0x7ff", "0x7ff", "0", "2047"]);
    assert_eq!(of(&rows, "unilateral default contact"), ["output", "1", "1", "0x1", "0x1", "0", "1"]);
    // The words of the host are constant during a run.
    let json: Value = serde_json::from_str(&read("check.json")).expect("JSON");
    let stiffness = of(&rows, "hybrid_loop hybrid-wall stiffness");
    assert_eq!(&stiffness[..5], ["input", "12", "0", "0x0", "0x0"]);
    assert_eq!(stiffness[5], stiffness[6], "it is constant");
    assert_ne!(stiffness[5], "0");
    assert_eq!(of(&rows, "hybrid_loop hybrid-wall a_high")[..3], ["output", "1", "1"]);
    assert!(rows.iter().any(|(name, cells)| name.starts_with("hybrid_loop ") && cells[0] == "inside"));
    // Each row has a kind, and every stratum of the multiplier's words is a product.
    let mut vectors = 0;
    for block in json["blocks"].as_array().expect("blocks") {
        for variant in block["variants"].as_array().expect("variants") {
            let coverage = &variant["coverage"];
            let count = |key: &str| coverage[key].as_u64().expect(key);
            let sum = count("directed") + count("random") + count("products");
            assert_eq!(Some(sum), variant["vectors"].as_u64(), "{variant}");
            let products = block["name"] == "truncating_multiplier" && variant["name"] == "default";
            assert_eq!(count("products"), if products { 1 << 16 } else { 0 });
            assert_eq!(count("random"), 50, "{variant}");
            assert_eq!(count("resets") > 0, block["name"] == "synchronizer", "combinational logic has no reset");
            assert!(count("toggled_bits") <= count("bits"));
            vectors += sum;
        }
    }
    assert!(vectors > 1 << 16);
    // The page is well-formed, asks no network, and says the same.
    let html = read("coverage.html");
    let all = elements(&html);
    let links = all.iter().flat_map(|element| ["src", "href"].into_iter().filter_map(|name| element.get(name)));
    assert!(links.into_iter().all(|link| link.starts_with('#')), "the page asks no network");
    let summary = all.iter().filter(|element| element.name == "summary").map(|element| element.text.as_str());
    let summary: Vec<&str> = summary.collect();
    assert!(summary.contains(&"unilateral default: 24 of 25 bits"), "{summary:?}");
    assert!(html.contains("hpu check unilateral truncating_multiplier synchronizer --scene hybrid-wall --edges 20000"));
    let constants = all.iter().filter(|element| element.text == format!("constant {}", stiffness[5]));
    assert!(constants.count() >= 1);
}
