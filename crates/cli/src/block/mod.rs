//! `hpu block`: lists the blocks, shows their ports, and ticks a block.

mod csv;

use std::fmt::Write as _;
use std::path::Path;

use hpu_cosim::did_you_mean;
use hpu_datapath::{AnyBlock, registry, variants};
use hpu_rtl::{Hdl, differs_from_the_hardware, literal};
use hpu_signal::{Notation, Signal};
use serde_json::{Value, json};

use crate::exit::{Exit, Failure};
use crate::input::{read_stdin, read_text};
use crate::notation::{Written, triple};
use crate::terminal::{print, print_json};

use csv::Table;

/// List the blocks, show the ports of one, or tick it
#[derive(clap::Args)]
pub struct Args {
    /// The block
    name: Option<String>,
    /// Configuration of the block, of those that `hpu block NAME` lists
    #[arg(long, value_name = "LABEL", default_value = "default", requires = "name")]
    variant: String,
    /// Tick the block after one edge of reset: a CSV whose header names the inputs, one row an edge; - is stdin
    #[arg(long, value_name = "FILE", requires = "name")]
    inputs: Option<String>,
    #[command(flatten)]
    notation: Written,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Runs `hpu block`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let Some(name) = &args.name else {
        if args.notation.asked().is_some() {
            return Err(Failure::usage("the list of blocks shows no formats; name a block beside --notation"));
        }
        return list(args.json);
    };
    let mut block = find(name, &args.variant)?;
    match &args.inputs {
        Some(file) => tick(&mut *block, file, args.json)?,
        None if args.json => print_json(&description(&*block))?,
        None => print(&table(&*block, args.notation.get()))?,
    }
    Ok(Exit::Fine)
}

/// Returns the block of that name in the configuration with that label.
pub fn find(name: &str, variant: &str) -> Result<Box<dyn AnyBlock>, Failure> {
    known(name)?;
    let found = variants().into_iter().find(|(label, block)| block.name() == name && label == variant);
    found.map(|(_, block)| block).ok_or_else(|| {
        Failure::usage(format!("{name} has no variant `{variant}`; there are {}", labels(name).join(", ")))
    })
}

/// Returns an error when no block has this name.
pub fn known(name: &str) -> Result<(), Failure> {
    let names: Vec<_> = registry().iter().map(|block| block.name()).collect();
    if names.contains(&name) {
        return Ok(());
    }
    let near = did_you_mean(name, &names);
    Err(Failure::usage(format!("no block `{name}`; there are {}{near}", names.join(", "))))
}

/// Returns the labels of a block's variants.
pub fn labels(name: &str) -> Vec<String> {
    variants().into_iter().filter(|(_, block)| block.name() == name).map(|(label, _)| label).collect()
}

fn list(as_json: bool) -> Result<Exit, Failure> {
    let blocks = registry();
    if as_json {
        let all: Vec<_> = blocks.iter().map(|block| description(&**block)).collect();
        print_json(&json!({ "blocks": all }))?;
    } else {
        let names = |ports: Vec<Signal>| ports.iter().map(|port| port.name).collect::<Vec<_>>().join(", ");
        let line = |block: &dyn AnyBlock| {
            format!("{:<22} {} -> {}\n", block.name(), names(block.inputs()), names(block.outputs()))
        };
        print(&blocks.iter().map(|block| line(&**block)).collect::<String>())?;
    }
    Ok(Exit::Fine)
}

fn table(block: &dyn AnyBlock, notation: Notation) -> String {
    let kind = if block.clocked() { "clocked" } else { "combinational" };
    let mut text = format!("{}, {kind}\n", block.name());
    let ports = directed(block);
    let width = ports.iter().map(|(_, port)| port.unit.len()).max().unwrap_or(0);
    let formats: Vec<_> = ports.iter().map(|(_, port)| notation.of(port.format)).collect();
    let wide = formats.iter().map(String::len).max().unwrap_or(0).max(10);
    for ((direction, Signal { name, unit, doc, .. }), format) in ports.into_iter().zip(formats) {
        writeln!(text, "{direction:<4} {name:<12} {format:<wide$} {unit:<width$}  {doc}").expect("a string grows");
    }
    for (name, value) in block.generics() {
        writeln!(text, "{:<4} {name:<15} {}", "gen", literal(value)).expect("a string grows");
    }
    text + &format!("differs from the hardware: {}\nvariants: {}\n", differs(block), labels(block.name()).join(", "))
}

/// Returns how the block differs from the hardware, from the header of its VHDL, which this program carries.
fn differs(block: &dyn AnyBlock) -> String {
    let vhdl = Hdl::Carried.text(block.name()).expect("the program carries the VHDL of every block");
    differs_from_the_hardware(&vhdl).expect("every header says it")
}

fn directed(block: &dyn AnyBlock) -> Vec<(&'static str, Signal)> {
    let inputs = block.inputs().into_iter().map(|port| ("in", port));
    inputs.chain(block.outputs().into_iter().map(|port| ("out", port))).collect()
}

fn description(block: &dyn AnyBlock) -> Value {
    let ports = directed(block).into_iter().map(|(direction, Signal { name, format, unit, doc })| {
        let notations = json!({
            "vhdl": Notation::Vhdl.of(format),
            "cpp": Notation::Cpp.of(format),
            "q": Notation::Q.of(format),
        });
        json!({
            "name": name,
            "direction": direction,
            "format": triple(format),
            "notations": notations,
            "unit": unit,
            "doc": doc,
        })
    });
    let generics: serde_json::Map<_, _> = block
        .generics()
        .into_iter()
        .map(|(name, value)| {
            let value = match value {
                hpu_datapath::Generic::Integer(value) => json!(value),
                hpu_datapath::Generic::Boolean(value) => json!(value),
            };
            (name.to_string(), value)
        })
        .collect();
    json!({
        "name": block.name(),
        "clocked": block.clocked(),
        "ports": ports.collect::<Vec<_>>(),
        "generics": generics,
        "differs_from_the_hardware": differs(block),
        "variants": labels(block.name()),
    })
}

fn tick(block: &mut dyn AnyBlock, file: &str, as_json: bool) -> Result<(), Failure> {
    let text = if file == "-" { read_stdin()? } else { read_text(Path::new(file))? };
    let table = Table::read(file, &text, &block.inputs())?.tick(block);
    if as_json {
        print_json(&json!({ "block": block.name(), "columns": table.columns, "rows": table.rows }))
    } else {
        print(&table.to_csv())
    }
}
