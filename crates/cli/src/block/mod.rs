//! `hpu block`: lists the blocks, shows their ports, and ticks a block.

mod csv;

use std::collections::BTreeMap;
use std::path::Path;

use csv::Ticked;
use hpu_cosim::{SceneFile, did_you_mean, named_block};
use hpu_datapath::{AnyBlock, Generic, block_names, proved_variants_of, registry, variants_of};
use hpu_page::{Cell, Column, Page, Table};
use hpu_rtl::{Hdl, differs_from_the_hardware, literal};
use hpu_signal::{Notation, Signal};
use serde_json::{Value, json};

use crate::keys::has_word;
use crate::notation::{Written, triple};
use crate::page::show;
use crate::scene::quoted;
use crate::shell::{Exit, Failure, print_file, print_json, read_stdin, read_text, values};

/// List the blocks, find some by a word, show the ports of one, or tick it
#[derive(clap::Args)]
pub struct Args {
    /// The block, or a word of blocks, their ports and meanings, as in `velocity`
    name: Option<String>,
    /// Configuration of the block, of those that `hpu block NAME` lists
    #[arg(long, value_name = "LABEL", default_value = "default", requires = "name")]
    variant: String,
    #[command(flatten)]
    generics: Generics,
    /// Tick the block after one edge of reset: a CSV whose header names the inputs, one row an edge; - is stdin
    #[arg(long, value_name = "FILE", requires = "name")]
    inputs: Option<String>,
    #[command(flatten)]
    notation: Written,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// The generics of a block in a configuration of one's own.
#[derive(clap::Args)]
pub(crate) struct Generics {
    /// Configuration of one's own: a generic of the block, as in WIDTH=14; may be repeated, the others keep their
    /// defaults
    #[arg(long = "generic", value_name = "NAME=VALUE", value_parser = values::generic, conflicts_with = "variant")]
    pub(crate) generic: Vec<(String, String)>,
}

/// Runs `hpu block`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    match Plan::new(args)? {
        Plan::List(blocks) => list(blocks, args.json)?,
        Plan::Describe(block) => show(&described(&*block, args.notation.get()), args.json)?,
        Plan::Tick(mut block, file) => tick(&mut *block, file, args.json)?,
    }
    Ok(Exit::Fine)
}

/// A validated command.
enum Plan<'a> {
    /// Some blocks listed.
    List(Vec<Box<dyn AnyBlock>>),
    /// The ports of a block shown.
    Describe(Box<dyn AnyBlock>),
    /// A block ticked, by the rows of this file.
    Tick(Box<dyn AnyBlock>, &'a str),
}

impl<'a> Plan<'a> {
    fn new(args: &'a Args) -> Result<Self, Failure> {
        let is_plain = args.variant == "default"
            && args.generics.generic.is_empty()
            && args.inputs.is_none()
            && args.notation.asked().is_none();
        let word = args.name.as_ref().filter(|name| !block_names().contains(&name.as_str()));
        let found = |word: &String| registry().into_iter().filter(|block| has_word(&meaning(&**block), word)).collect();
        let found: Vec<_> = word.filter(|_| is_plain).map_or(Vec::new(), found);
        match (&args.name, &args.inputs) {
            (None, _) if is_plain => Ok(Self::List(registry())),
            (None, _) => {
                Err(Failure::usage("the list of blocks shows no formats; name a block beside --notation or --generic"))
            }
            _ if !found.is_empty() => Ok(Self::List(found)),
            (Some(name), Some(file)) => Ok(Self::Tick(args.find(name)?, file)),
            (Some(name), None) => Ok(Self::Describe(args.find(name)?)),
        }
    }
}

impl Args {
    /// Returns the block of that name in the configuration that is asked for.
    fn find(&self, name: &str) -> Result<Box<dyn AnyBlock>, Failure> {
        match &self.generics.generic[..] {
            [] => find(name, &self.variant),
            generics => configured(name, generics),
        }
    }
}

/// Returns the block of that name with these generics.
pub(crate) fn configured(name: &str, generics: &[(String, String)]) -> Result<Box<dyn AnyBlock>, Failure> {
    known(name)?;
    named_block(name, generics).map_err(|error| Failure::usage(error.to_string()))
}

/// Returns the block of that name in the configuration with that label.
pub fn find(name: &str, variant: &str) -> Result<Box<dyn AnyBlock>, Failure> {
    known(name)?;
    among(name, variant, variants_of(|block| block == name))
}

/// Refuses a label that no configuration has that is proved.
pub(crate) fn known_to_proofs(name: &str, variant: &str) -> Result<(), Failure> {
    among(name, variant, proved_variants_of(|block| block == name)).map(drop)
}

fn among(name: &str, variant: &str, all: Vec<(String, Box<dyn AnyBlock>)>) -> Result<Box<dyn AnyBlock>, Failure> {
    let labels: Vec<_> = all.iter().map(|(label, _)| label.clone()).collect();
    all.into_iter()
        .find(|(label, _)| label == variant)
        .map(|(_, block)| block)
        .ok_or_else(|| Failure::usage(format!("{name} has no variant `{variant}`; there are {}", labels.join(", "))))
}

/// Returns the name of a block, the first line of its VHDL, and the names and meanings of its ports.
fn meaning(block: &dyn AnyBlock) -> String {
    let ports = block.inputs().into_iter().chain(block.outputs());
    let ports: String = ports.map(|port| format!("{} {}\n", port.name, port.doc)).collect();
    let title = carried(block).lines().next().unwrap_or_default().to_string();
    format!("{title}\n{ports}")
}

/// Returns an error when no block has this name, with the option for scenes where a scene has it.
pub fn known(name: &str) -> Result<(), Failure> {
    let names = block_names();
    if names.contains(&name) {
        return Ok(());
    }
    if SceneFile::find(name).is_ok() {
        let place = format!("check and cost take it as --scene {}", quoted(name));
        return Err(Failure::usage(format!("no block `{name}`; it is a scene: {place}")));
    }
    let near = did_you_mean(name, names);
    Err(Failure::usage(format!("no block `{name}`; there are {}{near}", names.join(", "))))
}

/// Returns the labels of a block's variants.
pub fn labels(name: &str) -> Vec<String> {
    variants_of(|block| block == name).into_iter().map(|(label, _)| label).collect()
}

fn list(blocks: Vec<Box<dyn AnyBlock>>, as_json: bool) -> Result<(), Failure> {
    let names = |ports: Vec<Signal>| ports.iter().map(|port| port.name).collect::<Vec<_>>().join(", ");
    let mut table = Table::new("", [Column::text("", "").least(22), Column::text("", "")]).gap(1);
    for block in &blocks {
        let ports = format!("{} -> {}", names(block.inputs()), names(block.outputs()));
        table.add([block.name().into(), ports.into()]);
    }
    let all = blocks.iter().map(|block| described(&**block, Notation::Triple).json());
    let mut page = Page::default();
    page.data("blocks", Value::Array(all.collect())).table(table);
    show(&page, as_json)
}

/// Returns the page of a block: its ports, with formats in a notation, its generics and its variants.
fn described(block: &dyn AnyBlock, notation: Notation) -> Page {
    let (name, kind) = (block.name(), if block.clocked() { "clocked" } else { "combinational" });
    let ports = block.inputs().into_iter().map(|port| ("in", port));
    let ports: Vec<_> = ports.chain(block.outputs().into_iter().map(|port| ("out", port))).collect();
    type Port = (&'static str, Signal);
    let notations = |(_, port): &Port| {
        let of = |notation: Notation| notation.of(port.format);
        json!({ "vhdl": of(Notation::Vhdl), "cpp": of(Notation::Cpp), "q": of(Notation::Q) })
    };
    let fields = [
        Column::text("direction", "").of(|(direction, _): &Port| *direction),
        Column::text("name", "port").least(11).of(|(_, port): &Port| port.name),
        Column::text("format", "format")
            .of(move |(_, port): &Port| Cell::new(triple(port.format)).shown(notation.of(port.format))),
        Column::text("notations", "").data().of(notations),
        Column::text("unit", "unit").of(|(_, port): &Port| port.unit),
        Column::text("doc", "meaning").of(|(_, port): &Port| port.doc),
    ];
    let mut page = Page::default();
    page.data("name", name).data("clocked", block.clocked()).note(format!("{name}, {kind}"));
    page.table(Table::of("ports", &ports, fields));
    let generics = block.generics();
    page.data("generics", BTreeMap::<String, ()>::new());
    if !generics.is_empty() {
        let columns = ["", "generic", "value"].map(|head| Column::text("", head));
        let mut table = Table::new("", columns);
        for (name, value) in generics {
            let set = match value {
                Generic::Integer(value) => Value::from(value),
                Generic::Boolean(value) => Value::from(value),
            };
            page.data(&format!("generics.{name}"), set);
            table.add(["gen".into(), name.into(), literal(value).into()]);
        }
        page.table(table);
    }
    let (differs, variants) = (differs(block), labels(name));
    page.note(format!("differs from the hardware: {differs}\nvariants: {}", variants.join(", ")));
    page.data("differs_from_the_hardware", differs).data("variants", &variants);
    page
}

/// Returns how the block differs from the hardware, from the header of its VHDL, which this program carries.
fn differs(block: &dyn AnyBlock) -> String {
    differs_from_the_hardware(&carried(block)).expect("every header says it")
}

fn carried(block: &dyn AnyBlock) -> String {
    Hdl::Carried.text(block.name()).expect("the program carries the VHDL of every block").to_string()
}

fn tick(block: &mut dyn AnyBlock, file: &str, as_json: bool) -> Result<(), Failure> {
    let text = if file == "-" { read_stdin()? } else { read_text(Path::new(file))? };
    let table = Ticked::read(file, &text, &block.inputs())?.tick(block);
    if as_json {
        print_json(&json!({ "block": block.name(), "columns": table.columns, "rows": table.rows }))
    } else {
        print_file(&table.to_csv())
    }
}
