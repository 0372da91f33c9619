//! Reads GHDL's netlist of an entity with its hierarchy: the text of each module, and its ports and cells.

use std::collections::{BTreeMap, HashMap};
use std::fs;

use hpu_cosim::script;
use hpu_cosim::script::Yosys;
use hpu_datapath::AnyBlock;
use serde_json::Value;

use crate::cost::{self, NO_DPI, verilog::verilog};
use crate::engines::error::Error;
use crate::engines::ghdl::Library;

/// The modules of an entity by name: the entity's own module, and those that it instantiates.
pub(crate) struct Modules {
    texts: BTreeMap<String, Vec<String>>,
}

/// A bit that is connected to a port.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Bit {
    /// The bit with this number among the module's nets.
    Net(u64),
    /// `0`, `1`, `x` (unknown) or `z` (high impedance).
    Constant(char),
}

/// A port of a module.
pub(crate) struct Port {
    pub(crate) is_input: bool,
    pub(crate) bits: Vec<Bit>,
}

/// An instance of a module, or logic.
pub(crate) struct Cell {
    /// Name of the module; for logic, Yosys's name for it, which begins with `$`.
    pub(crate) module: String,
    /// The connected bits by port, the least bit first.
    pub(crate) connections: BTreeMap<String, Vec<Bit>>,
    /// The ports that are outputs.
    pub(crate) outputs: Vec<String>,
    /// The parameters: numbers as their bits, the highest first.
    pub(crate) parameters: BTreeMap<String, String>,
}

/// The ports, cells and nets of a module.
pub(crate) struct Module {
    pub(crate) ports: BTreeMap<String, Port>,
    pub(crate) cells: BTreeMap<String, Cell>,
    /// The nets that have names in the source, the least bit first.
    pub(crate) nets: BTreeMap<String, Vec<Bit>>,
}

impl Cell {
    /// Returns the bits at its inputs.
    pub(super) fn ins(&self) -> impl Iterator<Item = Bit> {
        self.connections.iter().filter(|(port, _)| !self.outputs.contains(port)).flat_map(|(_, bits)| bits).copied()
    }

    /// Returns the bits at a port, the least first.
    pub(crate) fn bits(&self, port: &str) -> &[Bit] {
        self.connections.get(port).map_or(&[], Vec::as_slice)
    }

    /// Returns whether a bit of a parameter is 1.
    pub(crate) fn is_set(&self, parameter: &str, index: usize) -> bool {
        self.parameters.get(parameter).is_some_and(|bits| bits.bytes().rev().nth(index) == Some(b'1'))
    }
}

impl Modules {
    /// Reads the modules of an entity in the configuration of a block.
    pub(crate) fn new(block: &dyn AnyBlock, library: &Library) -> Result<Self, Error> {
        Ok(Self::split(&verilog(block, library)?))
    }

    fn split(verilog: &str) -> Self {
        let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut name = None;
        for line in verilog.lines() {
            let code = without_comments(line);
            if let Some(begun) = code.strip_prefix("module ") {
                name = Some(begun.trim_end().to_string());
            }
            if let Some(name) = &name
                && !code.trim().is_empty()
            {
                texts.entry(name.clone()).or_default().push(code.trim_end().to_string());
            }
            if code.trim() == "endmodule" {
                name = None;
            }
        }
        Self { texts }
    }

    /// Returns the text of the module and of the modules that it instantiates. Two modules that differ only in names of
    /// modules and numbers of nets have the same text: GHDL numbers the nets of a design through, and makes the names
    /// of modules from generics.
    pub(crate) fn netlist(&self, module: &str) -> String {
        let mut order = vec![module];
        let mut text = String::new();
        let mut at = 0;
        while let Some(&name) = order.get(at) {
            let mut numbers = HashMap::new();
            for line in self.texts.get(name).into_iter().flatten() {
                if line.strip_prefix("module ") == Some(name) {
                    text += &format!("module #{at}\n");
                    continue;
                }
                let rest = match self.instance(line) {
                    Some((instantiated, rest)) => {
                        let known = order.iter().position(|known| *known == instantiated);
                        text += &format!("#{}", known.unwrap_or(order.len()));
                        if known.is_none() {
                            order.push(instantiated);
                        }
                        rest
                    }
                    None => line,
                };
                renumber(rest, &mut numbers, &mut text);
                text.push('\n');
            }
            at += 1;
        }
        text
    }

    /// Returns the module of which a line begins an instance, `  name label (`, and the text after the name.
    fn instance<'m>(&'m self, line: &'m str) -> Option<(&'m str, &'m str)> {
        let (name, rest) = line.trim_start().split_once(' ')?;
        let (name, _) = self.texts.get_key_value(name)?;
        rest.ends_with(" (").then_some((name.as_str(), rest))
    }

    /// Returns the ports of all modules, and the cells of modules that instantiate others. Of modules that instantiate
    /// none, Yosys reads only the ports. Nothing is optimised: each assignment becomes one net, each operation a cell.
    /// `None` if what Yosys writes is not understood.
    pub(crate) fn wired(&self, top: &str, library: &Library) -> Result<Option<BTreeMap<String, Module>>, Error> {
        let mut text = String::new();
        for (name, lines) in &self.texts {
            let is_whole = name == top || lines.iter().any(|line| self.instance(line).is_some());
            let ports = lines.iter().position(|line| line.ends_with(");")).map_or(lines.len(), |last| last + 1);
            let kept = if is_whole { &lines[..] } else { &lines[..ports] };
            kept.iter().for_each(|line| text += &format!("{line}\n"));
            text += if is_whole { "" } else { "endmodule\n" };
        }
        let io = |error| Error::io(library.dir(), error);
        library.write("wiring.v", text)?;
        let script = script!(Yosys: "read_verilog{} wiring.v; proc -noopt; write_json wiring.json", NO_DPI);
        cost::run_yosys(library, top, &script)?;
        let json = fs::read_to_string(library.dir().join("wiring.json")).map_err(io)?;
        Ok(read(&json))
    }
}

/// Returns a line without its comments; GHDL ends each comment on the same line.
fn without_comments(line: &str) -> String {
    let mut code = String::new();
    let mut rest = line;
    loop {
        match (rest.find("/*"), rest.find("//")) {
            (Some(begin), last) if last.is_none_or(|last| begin < last) => {
                code += &rest[..begin];
                rest = rest[begin..].split_once("*/").map_or("", |(_, after)| after);
            }
            (_, Some(last)) => return code + &rest[..last],
            _ => return code + rest,
        }
    }
}

/// Appends a line in which the numbers of nets (`n12_o`, `n12_countdown`) are replaced by the order of their
/// appearance.
fn renumber<'t>(line: &'t str, numbers: &mut HashMap<&'t str, usize>, text: &mut String) {
    let is_letter = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '$' | '\'');
    let mut rest = line;
    while let Some(begin) = rest.find(is_letter) {
        let (before, word) = rest.split_at(begin);
        let (word, after) = word.split_at(word.find(|letter| !is_letter(letter)).unwrap_or(word.len()));
        *text += before;
        let digits =
            word.strip_prefix('n').map_or(0, |rest| rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len()));
        let (number, end) = word.split_at(if digits > 0 { 1 + digits } else { 0 });
        if number.is_empty() || !(end.is_empty() || end.starts_with('_')) {
            *text += word;
        } else {
            let next = numbers.len();
            *text += &format!("n{}{end}", numbers.entry(number).or_insert(next));
        }
        rest = after;
    }
    *text += rest;
}

/// Returns the name of a net without GHDL's prefix for a variable: `n`, a number and `_`.
pub(crate) fn plain(net: &str) -> &str {
    let numbered = net.strip_prefix('n').map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()));
    match numbered.and_then(|rest| rest.strip_prefix('_')) {
        Some(name) if net.as_bytes()[1].is_ascii_digit() => name,
        _ => net,
    }
}

/// Reads the modules of a netlist that Yosys has written as JSON.
pub(crate) fn read(json: &str) -> Option<BTreeMap<String, Module>> {
    let whole: Value = serde_json::from_str(json).ok()?;
    let modules = whole["modules"].as_object()?.iter();
    modules.map(|(name, module)| Some((name.clone(), self::module(module)?))).collect()
}

fn module(json: &Value) -> Option<Module> {
    let port = |(name, port): (&String, &Value)| {
        let is_input = match port["direction"].as_str()? {
            "input" => true,
            "output" => false,
            _ => return None,
        };
        Some((name.clone(), Port { is_input, bits: bits(&port["bits"])? }))
    };
    let parameter = |(name, value): (&String, &Value)| Some((name.clone(), value.as_str()?.to_string()));
    let cell = |(label, cell): (&String, &Value)| {
        let connections = cell["connections"].as_object()?.iter();
        let directions = cell["port_directions"].as_object()?.iter();
        Some((
            label.clone(),
            Cell {
                module: cell["type"].as_str()?.to_string(),
                connections: connections.map(|(port, to)| Some((port.clone(), bits(to)?))).collect::<Option<_>>()?,
                outputs: directions.filter(|(_, way)| *way != "input").map(|(port, _)| port.clone()).collect(),
                parameters: cell["parameters"].as_object()?.iter().map(parameter).collect::<Option<_>>()?,
            },
        ))
    };
    let nets = json["netnames"].as_object()?.iter().filter(|(_, net)| net["hide_name"] == 0);
    Some(Module {
        ports: json["ports"].as_object()?.iter().map(port).collect::<Option<_>>()?,
        cells: json["cells"].as_object()?.iter().map(cell).collect::<Option<_>>()?,
        nets: nets.map(|(name, net)| Some((name.clone(), bits(&net["bits"])?))).collect::<Option<_>>()?,
    })
}

fn bits(json: &Value) -> Option<Vec<Bit>> {
    let bit = |bit: &Value| match bit {
        Value::Number(number) => Some(Bit::Net(number.as_u64()?)),
        Value::String(constant) => Some(Bit::Constant(constant.chars().next()?)),
        _ => None,
    };
    json.as_array()?.iter().map(bit).collect()
}

#[cfg(test)]
mod tests {
    use super::{Modules, without_comments};

    const LEAF: &str = "module half_4_0af3\n  (input  [3:0] a,\n   output [2:0] q);\n  wire [2:0] n7_o;\n  \
                        assign q = n7_o;\n  /* half.vhd:3:4  */\n  assign n7_o = a[3:1]; //  extract\nendmodule\n";
    const PAIR: &str = "module pair\n  (input  [3:0] a,\n   output [2:0] q);\n  wire [2:0] n9_o;\n  \
                        half_4_0af3 half (\n    .a(a),\n    .q(n9_o));\n  assign q = n9_o;\nendmodule\n";

    #[test]
    fn names_of_modules_and_numbers_of_nets_and_comments_are_no_difference() {
        let one = Modules::split(&format!("{LEAF}{PAIR}"));
        let other = format!("{PAIR}{LEAF}").replace("half_4_0af3", "half").replace("n7_o", "n112_o");
        let other = Modules::split(&other.replace("half.vhd:3:4", "/other/half.vhd:5:6"));
        assert_eq!(one.netlist("half_4_0af3"), other.netlist("half"));
        assert_eq!(one.netlist("pair"), other.netlist("pair"));
        assert_ne!(one.netlist("pair"), other.netlist("half"));
    }

    #[test]
    fn any_other_difference_is_one_also_in_a_module_inside() {
        let one = Modules::split(&format!("{LEAF}{PAIR}"));
        let others =
            [("a[3:1]", "a[2:0]"), ("[3:0]", "[4:0]"), ("n7_o = ", "n7_q = "), ("half (", "other ("), ("a(a)", "a(q)")];
        for (from, to) in others {
            let other = format!("{LEAF}{PAIR}").replace(from, to);
            assert_ne!(one.netlist("pair"), Modules::split(&other).netlist("pair"), "{from}");
        }
        // Two nets must not become one.
        let merged = LEAF.replace("wire [2:0] n7_o;", "wire [2:0] n8_o;");
        assert_ne!(one.netlist("half_4_0af3"), Modules::split(&merged).netlist("half_4_0af3"));
    }

    #[test]
    fn comments_are_left_out_and_what_follows_them_stays() {
        assert_eq!(without_comments("a /* b */ c // d /* e"), "a  c ");
    }
}
