//! Compares the netlist of a block made of blocks with the connections that the emulator states for it.
//!
//! Each instance of the emulator must be one cell of the netlist, with each port at the same net with all bits, and
//! nothing may stand beside the instances. A block inside that is itself made of blocks is compared in the same way, in
//! the same netlist. The module of every other block must be the netlist that GHDL makes of that block alone with the
//! generics of the emulator's instance. So a wiring of proved blocks is proved.
//!
//! A generic in another's place is a difference only where the netlist differs, so each loop and each block has a
//! configuration in which no two whole numbers are equal; `datapath/distinct.rs` lists those that only proofs use.

use std::collections::{BTreeMap, HashMap};

use hpu_datapath::{AnyBlock, Generic, Instance, Parts};

use super::cells::{Bit, Cell, Module, Port};

/// An instance that is not made of blocks: the emulator's block, and its module in the netlist.
pub(crate) struct Leaf {
    /// Its label behind those of the instances around it.
    pub(crate) place: String,
    pub(crate) model: Box<dyn AnyBlock>,
    pub(crate) module: String,
}

/// Returns the leaves of a wiring whose netlist equals a block with these parts, or the first difference.
pub(crate) fn leaves(
    modules: &BTreeMap<String, Module>,
    block: &dyn AnyBlock,
    parts: Parts,
) -> Result<Vec<Leaf>, String> {
    let mut found = Vec::new();
    inside(modules, block.name(), block, parts, "", &mut found)?;
    Ok(found)
}

/// Compares a module with a block. The block's place ends with a dot.
fn inside(
    modules: &BTreeMap<String, Module>,
    name: &str,
    block: &dyn AnyBlock,
    parts: Parts,
    place: &str,
    found: &mut Vec<Leaf>,
) -> Result<(), String> {
    let module = modules.get(name).ok_or_else(|| format!("there is no module {name}"))?;
    same_ports(module, block).map_err(|why| format!("{place}{why}"))?;
    for instance in &parts.instances {
        let at = format!("instance {place}{}", instance.label);
        let cell = module.cells.get(instance.label).filter(|cell| !cell.module.starts_with('$'));
        let cell = cell.ok_or_else(|| format!("{at}: the VHDL has none"))?;
        let ports = modules.get(&cell.module).ok_or_else(|| format!("{at}: it is no module"))?;
        same_ports(ports, &*instance.model).map_err(|why| format!("{at}, {why}"))?;
        whole(cell, ports).map_err(|why| format!("{at}, {why}"))?;
    }
    let drivers = Drivers::new(module)?;
    same_nets(module, block, &parts, &drivers, place)?;
    for (label, cell) in &module.cells {
        if cell.module.starts_with('$') {
            return Err(format!("{place}logic: the VHDL has {} beside the instances", cell.module));
        }
        if !parts.instances.iter().any(|instance| instance.label == label) {
            return Err(format!("instance {place}{label}: the VHDL has it, of {}", cell.module));
        }
    }
    for Instance { label, model, .. } in parts.instances {
        let module = module.cells[label].module.clone();
        match model.parts() {
            Some(parts) => inside(modules, &module, &*model, parts, &format!("{place}{label}."), found)?,
            None => found.push(Leaf { place: format!("{place}{label}"), model, module }),
        }
    }
    Ok(())
}

/// Returns the ports of a block in its VHDL: name, whether it is an input, and width.
fn ports(block: &dyn AnyBlock) -> Vec<(&'static str, bool, usize)> {
    let clocked = ["clk", "rst"].map(|name| (name, true, 1)).into_iter().filter(|_| block.clocked());
    let signals = |is_input| {
        let signals = if is_input { block.inputs() } else { block.outputs() };
        signals.into_iter().map(move |signal| (signal.name, is_input, signal.format.width() as usize))
    };
    clocked.chain(signals(true)).chain(signals(false)).collect()
}

fn same_ports(module: &Module, block: &dyn AnyBlock) -> Result<(), String> {
    let ports = ports(block);
    for &(name, is_input, width) in &ports {
        let port = module.ports.get(name).ok_or_else(|| format!("port {name}: the VHDL has none"))?;
        if (port.is_input, port.bits.len()) != (is_input, width) {
            let told = |is_input: bool, width| format!("{} of {width} bits", if is_input { "in" } else { "out" });
            let (here, there) = (told(is_input, width), told(port.is_input, port.bits.len()));
            return Err(format!("port {name}: {here} here, {there} in the VHDL"));
        }
    }
    match module.ports.keys().find(|name| !ports.iter().any(|(known, ..)| known == name)) {
        Some(name) => Err(format!("port {name}: the VHDL alone has it")),
        None => Ok(()),
    }
}

/// Checks that a cell's ports are the module's, each connected in its whole width or not at all.
fn whole(cell: &Cell, module: &Module) -> Result<(), String> {
    for (name, bits) in &cell.connections {
        let Some(Port { bits: port, .. }) = module.ports.get(name) else {
            return Err(format!("port {name}: the module has none"));
        };
        if !bits.is_empty() && bits.len() != port.len() {
            return Err(format!("port {name}: {} bits, connected to {}", port.len(), bits.len()));
        }
    }
    Ok(())
}

/// Compares each reader of a net with the net's driver.
fn same_nets(
    module: &Module,
    block: &dyn AnyBlock,
    parts: &Parts,
    drivers: &Drivers,
    place: &str,
) -> Result<(), String> {
    let (inputs, outputs) = (block.inputs(), block.outputs());
    let port = |name: &str| module.ports[name].bits.as_slice();
    let connected = |instance: &Instance, port: &str| {
        module.cells[instance.label].connections.get(port).map_or(&[][..], Vec::as_slice)
    };
    // The driver of each net in the emulator, and the bits of that port in the netlist.
    let mut driven: HashMap<usize, (String, &[Bit])> = HashMap::new();
    for (net, input) in inputs.iter().enumerate() {
        driven.insert(net, (input.name.to_string(), port(input.name)));
    }
    for instance in &parts.instances {
        for output in instance.model.outputs() {
            let net = instance.connections.iter().find(|connection| connection.port.name == output.name);
            let net = net.ok_or_else(|| format!("{place}{}.{} is at no net here", instance.label, output.name))?.net;
            let by = format!("{}.{}", instance.label, output.name);
            if let Some((other, _)) = driven.insert(net, (by, connected(instance, output.name))) {
                return Err(format!("net {place}{}: driven twice here, also by {other}", parts.nets[net].name));
            }
        }
    }
    let same = |reader: String, net: usize, there: &[Bit]| match driven.get(&net) {
        Some((_, bits)) if *bits == there && !there.is_empty() => Ok(()),
        by => {
            let (net, here) = (parts.nets[net].name, by.map_or("nothing", |(by, _)| by));
            let here = if here == net { here.to_string() } else { format!("{net}, driven by {here}") };
            Err(format!("{reader}: at {here} here, at {} in the VHDL", drivers.told(there)))
        }
    };
    for instance in &parts.instances {
        let at = |port: &str| format!("instance {place}{}, port {port}", instance.label);
        for name in ["clk", "rst"].into_iter().filter(|_| instance.model.clocked()) {
            let (here, there) = (port(name), connected(instance, name));
            if here != there {
                return Err(format!("{}: at {name} here, at {} in the VHDL", at(name), drivers.told(there)));
            }
        }
        for input in instance.model.inputs() {
            let there = connected(instance, input.name);
            if let Some(&(_, word)) = instance.tied.iter().find(|(tied, _)| *tied == input.name) {
                let bits = input.format.bits(word);
                let bit = |bit| Bit::Constant(if bits >> bit & 1 == 1 { '1' } else { '0' });
                let here: Vec<_> = (0..input.format.width()).map(bit).collect();
                if here != there {
                    let [here, there] = [&here, there].map(|bits| drivers.told(bits));
                    return Err(format!("{}: at {here} here, at {there} in the VHDL", at(input.name)));
                }
                continue;
            }
            let net = instance.connections.iter().find(|connection| connection.port.name == input.name);
            let net = net.ok_or_else(|| format!("{} is at no net here", at(input.name)))?.net;
            same(at(input.name), net, there)?;
        }
    }
    for (net, output) in (inputs.len()..).zip(&outputs) {
        same(format!("output {place}{}", output.name), net, port(output.name))?;
    }
    Ok(())
}

/// The driver of each bit of a module's nets: a port, the index of the bit and the port's width.
pub(crate) struct Drivers(HashMap<u64, (String, usize, usize)>);

impl Drivers {
    /// Reads the drivers of a module; refuses a bit that is driven twice, and a driven constant.
    pub(crate) fn new(module: &Module) -> Result<Self, String> {
        let mut drivers = HashMap::new();
        let mut drive = |by: &str, bits: &[Bit]| {
            for (index, bit) in bits.iter().enumerate() {
                let Bit::Net(net) = *bit else { return Err(format!("{by} drives a constant")) };
                if let Some((other, ..)) = drivers.insert(net, (by.to_string(), index, bits.len())) {
                    return Err(format!("{by} and {other} drive the same net"));
                }
            }
            Ok(())
        };
        for (name, port) in module.ports.iter().filter(|(_, port)| port.is_input) {
            drive(name, &port.bits)?;
        }
        for (label, cell) in &module.cells {
            for (port, bits) in cell.connections.iter().filter(|(port, _)| cell.outputs.contains(port)) {
                let is_logic = cell.module.starts_with('$');
                drive(&if is_logic { cell.module.clone() } else { format!("{label}.{port}") }, bits)?;
            }
        }
        Ok(Self(drivers))
    }

    /// Returns the drivers of bits as text, the most significant bit first.
    fn told(&self, bits: &[Bit]) -> String {
        // Runs of bits of one port: its name, the highest and the lowest index, and its width.
        let mut runs: Vec<(String, usize, usize, usize)> = Vec::new();
        for bit in bits.iter().rev() {
            let (by, index, width) = match bit {
                Bit::Constant(digit) => (format!("'{digit}'"), 0, 1),
                Bit::Net(net) => self.0.get(net).cloned().unwrap_or_else(|| ("nothing".to_string(), 0, 1)),
            };
            match runs.last_mut() {
                Some((known, _, low, _)) if *known == by && index + 1 == *low => *low = index,
                _ => runs.push((by, index, index, width)),
            }
        }
        let run = |(by, high, low, width)| {
            let is_whole = (low, high + 1) == (0, width);
            if is_whole { by } else { format!("{by}[{high}:{low}]") }
        };
        let told = runs.into_iter().map(run).collect::<Vec<_>>().join(" & ").replace("' & '", "");
        if told.is_empty() { "nothing".to_string() } else { told }
    }
}

/// Returns how the module of a leaf differs from the block: the generics in the module's name, if its netlist differs.
pub(crate) fn other_generics(leaf: &Leaf) -> String {
    let Leaf { place, model, module } = leaf;
    let is_of = |rest: &str| rest.is_empty() || rest.starts_with('_');
    let Some(values) = module.strip_prefix(model.name()).filter(|rest| is_of(rest)) else {
        return format!("instance {place}: of {} here, of {module} in the VHDL", model.name());
    };
    // GHDL writes the integers in their order, and a hash of all other generics.
    let values: Vec<_> = values.split('_').filter(|value| !value.is_empty() && value.len() < 40).collect();
    let generics = model.generics();
    let whole = |&(name, value): &(&'static str, Generic)| match value {
        Generic::Integer(value) => Some((name, value.to_string())),
        Generic::Boolean(_) => None,
    };
    let whole: Vec<_> = generics.iter().filter_map(whole).collect();
    let pairs = whole.iter().zip(&values).filter(|((_, here), there)| here != *there);
    let pairs: Vec<_> = pairs.map(|((name, here), there)| format!("{name} {here} here, {there} in the VHDL")).collect();
    let told = if pairs.is_empty() || whole.len() != values.len() {
        let literal = |(name, value): (_, Generic)| format!("{name} {}", crate::vectors::vector::literal(value));
        let all: Vec<_> = generics.into_iter().map(literal).collect();
        format!("not {} with {}", model.name(), all.join(", "))
    } else {
        pairs.join("; ")
    };
    format!("instance {place}: {told} (module {module})")
}
