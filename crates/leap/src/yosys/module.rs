//! A module as Yosys writes it: bits, cells, names.

use std::collections::HashMap;

use serde_json::Value;

use super::{MOST_CELLS, Unfit};

/// A bit of a word.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Bit {
    Zero,
    One,
    /// A value that is not known, or high impedance.
    Unknown,
    Net(u64),
}

/// A cell with the bits at its ports.
#[derive(Debug)]
pub(super) struct RawCell {
    pub(super) kind: String,
    parameters: HashMap<String, String>,
    connections: HashMap<String, Vec<Bit>>,
}

impl RawCell {
    /// Returns the bits at a port; none where the cell has no such port.
    pub(super) fn port(&self, port: &str) -> &[Bit] {
        self.connections.get(port).map_or(&[], |bits| bits)
    }

    /// Returns the bits that it takes.
    pub(super) fn taken(&self) -> impl Iterator<Item = Bit> + '_ {
        let is_result = |port: &str| ["Y", "Q", "RD_DATA"].contains(&port);
        self.connections.iter().filter(move |(port, _)| !is_result(port)).flat_map(|(_, bits)| bits.iter().copied())
    }

    /// Returns whether a parameter is given and is not 0.
    pub(super) fn is_set(&self, parameter: &str) -> bool {
        self.parameters.get(parameter).is_some_and(|value| value.contains('1'))
    }

    /// Returns a parameter that is a word, as bits from the lowest one on.
    pub(super) fn bits(&self, parameter: &str) -> Vec<Bit> {
        let text = self.parameters.get(parameter).map_or("", |value| value);
        text.chars().rev().map(constant).collect()
    }

    /// Returns whether it is a register.
    pub(super) fn is_register(&self) -> bool {
        self.kind == "$dff" || self.kind == "$adff"
    }

    /// Returns the name of the port with its result.
    pub(super) fn result(&self) -> &'static str {
        if self.is_register() { "Q" } else { "Y" }
    }
}

/// A module.
pub(super) struct Module {
    /// The bits of the clocks, and the edges of the netlist's clock for one of theirs.
    pub(super) clocks: Vec<(Bit, u32)>,
    /// Whether it was VHDL.
    pub(super) is_vhdl: bool,
    /// Names and bits of the inputs but for the clock, and of the outputs.
    pub(super) inputs: Vec<(String, Vec<Bit>)>,
    pub(super) outputs: Vec<(String, Vec<Bit>)>,
    /// Those of words inside with names of their own.
    pub(super) inside: Vec<(String, Vec<Bit>)>,
    pub(super) cells: Vec<RawCell>,
    /// The name of the word that a net is a bit of, and the index of the bit there.
    names: HashMap<u64, (String, usize)>,
    /// The initial values of nets.
    pub(super) initial: HashMap<u64, bool>,
}

fn constant(bit: char) -> Bit {
    match bit {
        '0' => Bit::Zero,
        '1' => Bit::One,
        _ => Bit::Unknown,
    }
}

fn bits(value: &Value) -> Result<Vec<Bit>, Unfit> {
    let bit = |bit: &Value| match (bit.as_u64(), bit.as_str().and_then(|text| text.chars().next())) {
        (Some(net), _) => Ok(Bit::Net(net)),
        (None, Some(text)) => Ok(constant(text)),
        (None, None) => Err(malformed("a bit")),
    };
    value.as_array().ok_or_else(|| malformed("bits"))?.iter().map(bit).collect()
}

fn malformed(what: &str) -> Unfit {
    Unfit(format!("Yosys wrote {what} in a form that is not known here"))
}

pub(super) fn turned_shift(json: &str, top: &str) -> Result<Option<String>, Unfit> {
    let value: Value = serde_json::from_str(json).map_err(|error| Unfit(format!("no JSON of Yosys: {error}")))?;
    let cells = value["modules"][top]["cells"].as_object().ok_or_else(|| malformed("cells"))?;
    for cell in cells.values() {
        if !cell["type"].as_str().is_some_and(|kind| ["$shl", "$shr", "$sshl", "$sshr"].contains(&kind)) {
            continue;
        }
        let amount = bits(&cell["connections"]["B"])?;
        let is_small = amount.iter().all(|bit| matches!(bit, Bit::Zero | Bit::One))
            && amount.iter().skip(16).all(|bit| *bit == Bit::Zero);
        if amount.len() >= 32 && !is_small {
            return Ok(Some(cell["attributes"]["src"].as_str().unwrap_or_default().to_string()));
        }
    }
    Ok(None)
}

/// Returns whether GHDL's synthesis has made up a name, as in `n12_q`.
fn is_made_up(name: &str) -> bool {
    let leaf = name.rsplit('.').next().unwrap_or_default();
    let number = leaf.strip_prefix('n').and_then(|rest| rest.strip_suffix("_o").or(rest.strip_suffix("_q")));
    number.is_some_and(|number| !number.is_empty() && number.chars().all(|c| c.is_ascii_digit()))
}

impl Module {
    pub(super) fn read(json: &str, top: &str, (named, ignores_case): (&[(&str, u32)], bool)) -> Result<Self, Unfit> {
        let value: Value = serde_json::from_str(json).map_err(|error| Unfit(format!("no JSON of Yosys: {error}")))?;
        let module = &value["modules"][top];
        let entries = |of: &str| module[of].as_object().ok_or_else(|| malformed(of)).map(|all| all.iter());
        let same = |one: &str, other: &str| if ignores_case { one.eq_ignore_ascii_case(other) } else { one == other };
        let (mut inputs, mut outputs, mut clocks) = (Vec::new(), Vec::new(), Vec::new());
        for (name, port) in entries("ports")? {
            let of = bits(&port["bits"])?;
            let clock = named.iter().find(|(clock, _)| same(clock, name));
            match port["direction"].as_str() {
                Some("input") if let (Some((_, edges)), [bit]) = (clock, &of[..]) => clocks.push((*bit, *edges)),
                Some("input") => inputs.push((name.clone(), of)),
                Some("output") => outputs.push((name.clone(), of)),
                _ => return Err(Unfit(format!("port `{name}` is inout"))),
            }
        }
        if clocks.len() < named.len() {
            let names: Vec<_> = named.iter().map(|(name, _)| format!("`{name}`")).collect();
            return Err(Unfit(format!("a clock ({}) is no input of one bit", names.join(", "))));
        }
        let mut cells = Vec::new();
        for (_, cell) in entries("cells")?.filter(|(_, cell)| cell["type"] != "$scopeinfo") {
            let kind = cell["type"].as_str().ok_or_else(|| malformed("a type"))?.to_string();
            let parameters = cell["parameters"].as_object().into_iter().flatten();
            let text =
                |value: &Value| value.as_str().map_or_else(|| format!("{:b}", value.as_u64().unwrap_or(0)), Into::into);
            let parameters = parameters.map(|(name, value)| (name.clone(), text(value))).collect();
            let connections = cell["connections"].as_object().into_iter().flatten();
            let connections =
                connections.map(|(port, of)| Ok((port.clone(), bits(of)?))).collect::<Result<_, Unfit>>()?;
            cells.push(RawCell { kind, parameters, connections });
        }
        if cells.len() > MOST_CELLS {
            return Err(Unfit(format!("it has {} cells; at most {MOST_CELLS} are taken", cells.len())));
        }
        let (mut names, mut initial, mut inside) = (HashMap::new(), HashMap::new(), Vec::new());
        let rank = |name: &str, is_hidden: bool| (is_hidden, is_made_up(name), name.len());
        let mut best = HashMap::new();
        for (name, net) in entries("netnames")? {
            let of = bits(&net["bits"])?;
            let values = net["attributes"]["init"].as_str().unwrap_or_default().chars().rev();
            for (bit, value) in of.iter().zip(values) {
                if let (Bit::Net(net), '0' | '1') = (bit, value) {
                    initial.insert(*net, value == '1');
                }
            }
            let is_hidden = net["hide_name"].as_u64() == Some(1);
            let is_port = || inputs.iter().chain(&outputs).any(|(port, _)| port == name);
            if !is_hidden && !is_port() {
                inside.push((name.clone(), of.clone()));
            }
            let own = rank(name, is_hidden);
            for (at, bit) in of.into_iter().enumerate() {
                let Bit::Net(net) = bit else { continue };
                if best.get(&net).is_none_or(|known| own < *known) {
                    best.insert(net, own);
                    names.insert(net, (name.clone(), at));
                }
            }
        }
        Ok(Self { clocks, is_vhdl: ignores_case, inputs, outputs, inside, cells, names, initial })
    }

    /// Returns the edges of the netlist's clock for one of the clock at these bits; `None` if they are no clock.
    pub(super) fn clock(&self, bits: &[Bit]) -> Option<u32> {
        self.clocks.iter().find(|(bit, _)| bits == [*bit]).map(|(_, edges)| *edges)
    }

    /// Returns a name for a word, by its first bit that has one.
    pub(super) fn name(&self, bits: &[Bit]) -> String {
        let named = bits.iter().find_map(|bit| match bit {
            Bit::Net(net) => self.names.get(net),
            _ => None,
        });
        named.map_or_else(|| "a constant".to_string(), |(name, _)| name.clone())
    }
}
