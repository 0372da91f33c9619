//! The header of a block's VHDL and the documentation of its Rust give the same differences from the hardware. No
//! header leaves a limit undefined.

use std::fs;

use hpu_rtl::differs_from_the_hardware;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn header(block: &str) -> String {
    let hand = fs::read_to_string(format!("{ROOT}/hdl/{block}.vhd"));
    let text = hand.or_else(|_| fs::read_to_string(format!("{ROOT}/hdl/generated/{block}.vhd")));
    let text = text.expect("the VHDL of a block");
    text.lines().take_while(|line| line.starts_with("--")).map(|line| format!("{line}\n")).collect()
}

/// Returns the differences in the documentation of the block's Rust, without the quotes of code.
fn documented(block: &str) -> String {
    let source = |name: &str| {
        let rooms = fs::read_dir(format!("{ROOT}/crates/datapath/src")).expect("a folder").flatten();
        rooms.map(|room| room.path().join(format!("{name}.rs"))).find(|place| place.is_file())
    };
    // The five loops around a law are in one module.
    let place = source(block).or_else(|| source("method_loop")).expect("a module");
    let text = fs::read_to_string(place).expect("Rust");
    let docs: Vec<_> = text.lines().map_while(|line| line.strip_prefix("//!")).collect();
    let (_, rest) = docs.split_at(docs.iter().position(|line| line.contains("**Differs from")).expect(block));
    let says = rest[0].split_once("**: ").expect("a text").1;
    let more = rest[1..].iter().take_while(|line| line.starts_with("   "));
    let words = std::iter::once(&says).chain(more).flat_map(|line| line.split_whitespace());
    words.collect::<Vec<_>>().join(" ").replace('`', "")
}

#[test]
fn vhdl_and_rust_say_the_same_of_what_differs_from_the_hardware() {
    let blocks = hpu_datapath::registry();
    assert!(blocks.len() > 40);
    let told = blocks.iter().map(|block| (block.name(), differs_from_the_hardware(&header(block.name()))));
    let differ: Vec<_> = told
        .map(|(name, vhdl)| (name, vhdl.unwrap_or_else(|| panic!("{name}: nothing said")), documented(name)))
        .filter(|(_, vhdl, rust)| vhdl != rust)
        .map(|(name, vhdl, rust)| format!("{name}\n  VHDL: {vhdl}\n  Rust: {rust}\n"))
        .collect();
    assert!(differ.is_empty(), "{} blocks:\n{}", differ.len(), differ.concat());
}

#[test]
fn a_header_that_clamps_says_to_what() {
    for block in hpu_datapath::registry() {
        let header = header(block.name());
        let formulas = header.lines().filter(|line| line.starts_with("--   "));
        for line in formulas.filter(|line| line.contains("clamp(")) {
            // The limits stand beside the value, or a line defines `clamp` for the whole header.
            let limits = line.contains(", -") || line.contains(", 0, ") || header.contains("clamp(v) = ");
            assert!(limits, "{}: {line}", block.name());
        }
    }
}
