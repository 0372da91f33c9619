//! The data sheet of a block, from the catalogue, the header of its VHDL and the record of its cost.

use std::fs;

use hpu_datapath::{AnyBlock, registry, variants_of};
use hpu_rtl::{Hdl, literal};
use hpu_signal::Signal;
use mdbook_driver::errors::{Error, Result};

use crate::equation::typeset;
use crate::header::{Header, cell, unindented};
use crate::{root, text, timing};

/// Returns the header of a block's VHDL, which the program carries.
fn header(block: &dyn AnyBlock) -> Result<Header> {
    let vhdl = Hdl::Carried.text(block.name()).map_err(|error| Error::msg(error.to_string()))?;
    Header::read(&vhdl).ok_or_else(|| Error::msg(format!("{}: a part of the VHDL's header is missing", block.name())))
}

/// Returns the list of all blocks, each with its purpose and a link to its sheet.
pub fn list() -> Result<String> {
    let mut table = "| block | | purpose |\n|---|---|---|\n".to_string();
    for block in registry() {
        let (name, kind) = (block.name(), kind(&*block));
        table += &format!("| [`{name}`](blocks/{name}.md) | {kind} | {} |\n", cell(&header(&*block)?.purpose));
    }
    Ok(table)
}

fn kind(block: &dyn AnyBlock) -> &'static str {
    match (block.clocked(), block.parts().is_some()) {
        (_, true) => "made of blocks",
        (true, false) => "clocked",
        (false, false) => "combinational",
    }
}

/// Returns the data sheet of a block.
pub fn sheet(block: &dyn AnyBlock) -> Result<String> {
    let (name, header) = (block.name(), header(block)?);
    let mut page = format!("# {name}\n\n*For people who instantiate this block, or review it.*\n");
    page += &format!("\n{} ({}).\n", sentence(&header.purpose), kind(block));
    page += &format!("\n## Equations\n\n{}", typeset(&header.equations));
    page += "\n## Ports\n\n| | port | format | unit | meaning |\n|---|---|---|---|---|\n";
    let port = |direction: &str, port: &Signal| {
        let Signal { name, format, unit, doc } = port;
        format!("| {direction} | `{name}` | {format} | {} | {} |\n", cell(unit), cell(doc))
    };
    page.extend(block.inputs().iter().map(|signal| port("in", signal)));
    page.extend(block.outputs().iter().map(|signal| port("out", signal)));
    page += "\nFormats are those of the default configuration.\n";
    page += &generics(block, &header);
    page += "\n## Timing\n\n";
    for (label, said) in [("Latency", &header.latency), ("Reset", &header.reset), ("Overflow", &header.overflow)] {
        page += &format!("- **{label}**: {}\n", cell(said));
    }
    page += &figure(name)?;
    page += &format!("\n## Cost\n\n{}", cost(name)?);
    page += &format!("\n## Proof\n\n{}", proof(block));
    page += &format!("\n## Source\n\n{}.\n", sentence(&cell(&header.source)));
    page += &format!("\nDiffers from the hardware: {}\n", cell(&header.differs));
    page += &format!("\n[Rust](../../../../{})", rust(name)?);
    let hand = format!("hdl/{name}.vhd");
    let vhdl = if root().join(&hand).is_file() { hand } else { format!("hdl/generated/{name}.vhd") };
    page += &format!(", [VHDL](../../../../{vhdl}).\n");
    Ok(page)
}

/// Returns text with a capital letter in front.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Returns the generics with their defaults, their meaning as the VHDL says it, and the variants.
fn generics(block: &dyn AnyBlock, header: &Header) -> String {
    let generics = block.generics();
    if generics.is_empty() {
        return String::new();
    }
    let set = |(name, value): &(&str, _)| format!("`{name}` {}", literal(*value));
    let defaults: Vec<_> = generics.iter().map(set).collect();
    let mut page = format!("\n## Generics\n\nDefaults: {}.\n", defaults.join(", "));
    page += &format!("\n```text\n{}\n```\n", unindented(&header.generics));
    let labels: Vec<_> = variants_of(|name| name == block.name()).into_iter().map(|(label, _)| label).collect();
    page + &format!(
        "\nTested as: {}.\n",
        labels.iter().map(|label| format!("`{label}`")).collect::<Vec<_>>().join(", ")
    )
}

/// Returns the timing figure of a block.
fn figure(name: &str) -> Result<String> {
    let mut block = hpu_datapath::block_by_name(name).ok_or_else(|| Error::msg(format!("no block {name}")))?;
    let timing::Figure { svg, first, rows, hidden } = timing::figure(&mut *block);
    let last = first + rows - 1;
    let rest = match hidden {
        0 => String::new(),
        1 => "; one port is not shown".to_string(),
        more => format!("; {more} ports are not shown"),
    };
    Ok(format!(
        "\n<figure>{svg}</figure>\n\nRows {first} to {last} of the directed vectors (`hpu vectors {name}`), as \
         words{rest}.\n"
    ))
}

/// The records of costs: of every block by default, and of other configurations.
const COSTS: [&str; 2] = ["testbench/record/costs.csv", "testbench/record/phantom-cost.csv"];

/// Returns the cells and the speed of a block, as far as they are on record. A configuration that is in both records is
/// that of the first.
fn cost(name: &str) -> Result<String> {
    let mut known: Vec<String> = Vec::new();
    let (mut rows, mut by) = (String::new(), Vec::new());
    for place in COSTS {
        let record = text(place)?;
        let mut lines = record.lines();
        let tools = lines.next().unwrap_or_default().trim_start_matches("# ");
        let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        for line in lines {
            let fields: Vec<&str> = line.split(',').collect();
            let of =
                |column: &str| head.iter().position(|known| *known == column).and_then(|at| fields.get(at)).copied();
            let get = |column: &str| of(column).filter(|text| !text.is_empty()).unwrap_or("-");
            if of("block") != Some(name) || known.iter().any(|variant| variant == get("variant")) {
                continue;
            }
            let speed = match (get("fmax_mhz"), get("path_ns")) {
                ("-", "-") => "-".to_string(),
                ("-", path) => format!("{path} ns"),
                (fastest, _) => format!("{fastest} MHz"),
            };
            let columns = ["variant", "target", "lut4", "ff", "carry", "bram", "dsp"].map(get);
            rows += &format!("| {} | {speed} |\n", columns.join(" | ").replace('_', "\\_"));
            known.push(get("variant").to_string());
            let said = format!("{tools}, from [the record](../../../../{place})");
            if !by.contains(&said) {
                by.push(said);
            }
        }
    }
    if rows.is_empty() {
        return Ok(format!("`hpu cost {name}` counts its cells and places it, by GHDL, Yosys and nextpnr.\n"));
    }
    let heads = ["variant", "target", "LUT4", "flip-flops", "carry", "block RAMs", "DSPs", "speed"];
    let head = format!("| {} |\n|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    Ok(format!("{head}{rows}\n{}.\n", by.join("; ")))
}

/// Returns what `hpu check --formal` proves of a block.
fn proof(block: &dyn AnyBlock) -> String {
    let name = block.name();
    let is_open = |block: &dyn AnyBlock| block.parts().is_none() && block.equations().is_none();
    let command = format!("`hpu check --formal {name}`");
    match block.parts() {
        Some(parts) => {
            let open: Vec<_> = parts.instances.iter().filter(|part| is_open(&*part.model)).collect();
            let rest = if open.is_empty() {
                "all of which are proved".to_string()
            } else {
                let names: Vec<_> = open.iter().map(|part| format!("`{}`", part.model.name())).collect();
                format!("which are proved but for {}", names.join(", "))
            };
            format!("{command} compares its wiring with that of the VHDL; it rests on its blocks, {rest}.\n")
        }
        None if is_open(block) => format!(
            "Not proved: its clock edge is not told as equations. `hpu check {name}` compares it with the VHDL on \
             vectors.\n"
        ),
        None => format!("{command} proves the VHDL equal to the emulator for all inputs and states.\n"),
    }
}

/// Returns the file of a block's Rust. The loops around a law are in one file.
fn rust(name: &str) -> Result<String> {
    let source = "crates/datapath/src";
    let folders = fs::read_dir(root().join(source))?.flatten().filter(|entry| entry.path().is_dir());
    let folders = folders.map(|entry| format!("{source}/{}", entry.file_name().display()));
    let mut places = [source.to_string()].into_iter().chain(folders).map(|folder| format!("{folder}/{name}.rs"));
    let law = || name.strip_suffix("_loop").map(|_| "crates/datapath/src/methods/method_loop.rs".to_string());
    let found = places.find(|place| root().join(place).is_file()).or_else(law);
    found.ok_or_else(|| Error::msg(format!("no Rust of {name}")))
}
