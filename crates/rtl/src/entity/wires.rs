//! Connects the ports of somebody else's block to those of ours.

use hpu_cosim::dut::Port;
use hpu_cosim::scene::Part;
use hpu_datapath::AnyBlock;
use hpu_signal::{Format, Signal};

use super::ours::Ours;
use super::{Entity, Link, refused};
use crate::engines::error::Error;

/// A port of theirs, or a part of its bits, and its counterpart.
pub(super) struct Wire {
    /// The port; of a part of its bits, a port of their own.
    pub(super) port: Port,
    /// The place of the whole port among theirs.
    pub(super) place: usize,
    /// The number of the port's bits to the right.
    pub(super) shift: u32,
    pub(super) what: What,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum What {
    /// An input or an output of ours, by its index.
    Input(usize),
    Output(usize),
    Constant(i64),
    Reset {
        active_low: bool,
    },
    Open,
}

impl Wire {
    /// Returns its own bits among those of the whole port.
    pub(super) fn bits(&self, word: u64) -> u64 {
        word >> self.shift & (u64::MAX >> (64 - self.port.format.width()))
    }

    /// Returns the bits at the port in a row, if it is an input.
    pub(super) fn given(&self, ours: &Ours, row: usize) -> u64 {
        match self.what {
            What::Input(index) => self.port.format.bits(ours.input(row, index)),
            What::Constant(word) => self.port.format.bits(word),
            What::Reset { active_low } => u64::from(ours.resets[row] != active_low),
            What::Output(_) | What::Open => 0,
        }
    }
}

impl Entity {
    /// Returns each port of theirs with its counterpart. Each output of ours must have a counterpart, or be declared to
    /// have none.
    pub(super) fn wires(&self, block: &dyn AnyBlock, ports: &[Port]) -> Result<Vec<Wire>, Error> {
        let none = |name: &str| refused(format!("`{}` has no port `{name}`; {}", self.top, there_are(ports)));
        let has = |name: &str, part: Part| ports.iter().any(|port| part.is_of(name, &port.name, true));
        if let Some((name, ..)) = self.ports.iter().find(|(name, part, _)| !has(name, *part)) {
            return none(name);
        }
        if let Some((name, _)) = self.reset.as_ref().filter(|(name, _)| !has(name, Part::Whole)) {
            return none(name);
        }
        let mut wires = Vec::new();
        for (place, port) in ports.iter().enumerate() {
            let links = self.ports.iter().filter(|(name, part, _)| part.is_of(name, &port.name, true));
            let bits = |name: &str, part: Part| port.layout.bits(&port.name, (name, part), true);
            let links: Vec<_> = links.map(|(name, part, link)| (bits(name, *part), link)).collect();
            if links.iter().all(|(bits, _)| *bits == Some((0, port.format.width()))) {
                let what = self.what(block, port, links.first().map(|(_, link)| *link))?;
                wires.push(Wire { port: port.clone(), place, shift: 0, what });
            } else {
                self.parts(block, (place, port), &links, &mut wires)?;
            }
        }
        let outputs = block.outputs();
        if let Some(name) = self.without.iter().find(|name| !outputs.iter().any(|output| same(output.name, name))) {
            return refused(format!("{} has no output `{name}`; it has {}", self.block, names(&outputs)));
        }
        for (index, Signal { name, .. }) in outputs.iter().enumerate() {
            let same_output = wires.iter().filter(|wire| wire.what == What::Output(index));
            let theirs: Vec<_> = same_output.map(|wire| format!("`{}`", wire.port.name)).collect();
            let is_open = self.without.iter().any(|open| same(open, name));
            match theirs.len() {
                0 if !is_open => {
                    // An output that nobody compares has to be declared: otherwise it would be taken for equal.
                    let theirs = ports.iter().filter(|port| !port.is_input).cloned().collect::<Vec<_>>();
                    return refused(format!(
                        "no output of `{}` is {name} of {}; write --port ...={name}, or --port open={name}; {}",
                        self.top,
                        self.block,
                        there_are(&theirs)
                    ));
                }
                0 | 1 => {}
                _ => return refused(format!("{name} of {} is {}: one of them", self.block, theirs.join(" and "))),
            }
        }
        if !wires.iter().any(|wire| matches!(wire.what, What::Output(_))) {
            return refused(format!("no output of `{}` is compared", self.top));
        }
        Ok(wires)
    }

    /// Adds the connected parts of a port.
    fn parts(
        &self,
        block: &dyn AnyBlock,
        (place, port): (usize, &Port),
        links: &[(Option<(u32, u32)>, &Link)],
        wires: &mut Vec<Wire>,
    ) -> Result<(), Error> {
        let (name, all) = (&port.name, port.format.width());
        if self.reset.as_ref().is_some_and(|(reset, _)| same(reset, name)) {
            return refused(format!("port `{name}` is the reset and something else"));
        }
        let mut taken = 0;
        for (found, link) in links {
            let Some((shift, width)) = *found else {
                return refused(format!("`{name}` of `{}` is {}", self.top, port.layout));
            };
            let bits = u64::MAX >> (64 - width) << shift;
            if taken & bits != 0 {
                return refused(format!("some bits of `{name}` are connected twice"));
            }
            taken |= bits;
            let own = name.clone() + &port.layout.name(shift, width);
            let port = Port { name: own, format: Format::unsigned(width), is_number: false, ..port.clone() };
            let what = self.what(block, &port, Some(link))?;
            wires.push(Wire { port, place, shift, what });
        }
        if port.is_input && taken != u64::MAX >> (64 - all) {
            return refused(format!("not all bits of input `{name}` are connected; a number holds the others"));
        }
        Ok(())
    }

    fn what(&self, block: &dyn AnyBlock, port: &Port, link: Option<&Link>) -> Result<What, Error> {
        let Port { name, is_input, format, is_number, .. } = port;
        let (top, own_name) = (&self.top, &self.block);
        let way = if *is_input { "input" } else { "output" };
        let is_reset = match &self.reset {
            Some((reset, _)) => same(reset, name),
            None => block.clocked() && *is_input && link.is_none() && same(name, "rst"),
        };
        let wanted = match link {
            Some(_) if is_reset => return refused(format!("port `{name}` is the reset and something else")),
            None if is_reset => {
                return Ok(What::Reset { active_low: self.reset.as_ref().is_some_and(|(_, active_low)| *active_low) });
            }
            Some(Link::Constant(word)) if *is_input => {
                if format.wrap((*word).into()) != *word {
                    return refused(format!("{word} does not fit input `{name}` of {} bits", format.width()));
                }
                return Ok(What::Constant(*word));
            }
            Some(Link::Open) if !is_input => return Ok(What::Open),
            Some(Link::Constant(_)) => return refused(format!("output `{name}` takes a port of {own_name}, or open")),
            Some(Link::Open) => return refused(format!("input `{name}` takes a port of {own_name}, or a number")),
            Some(Link::Port(wanted)) => wanted,
            None => name,
        };
        let own = if *is_input { block.inputs() } else { block.outputs() };
        let Some(index) = own.iter().position(|signal| same(signal.name, wanted)) else {
            let names = names(&own);
            return refused(match link {
                Some(_) => format!("{own_name} has no {way} `{wanted}`; it has {names}"),
                None if *is_input => {
                    format!(
                        "{way} `{name}` of `{top}` is connected to nothing; write --port {name}=..., \
                         a number or one of {names}"
                    )
                }
                None => format!(
                    "{way} `{name}` of `{top}` is none of {own_name}; write --port {name}=..., open or one of {names}"
                ),
            });
        };
        let (own, width) = (&own[index], own[index].format.width());
        if !is_number && width != format.width() {
            let theirs = format.width();
            return refused(format!(
                "{way} `{name}` of `{top}` has {theirs} bits, {} of {own_name} has {width}; map a generic (--generic), \
                 or set one of {own_name} (--set NAME=VALUE)",
                own.name
            ));
        }
        if *is_number && width > 31 + u32::from(own.format.is_signed()) {
            return refused(format!(
                "{way} `{name}` of `{top}` is a number, which does not hold the {width} bits of {}",
                own.name
            ));
        }
        Ok(if *is_input { What::Input(index) } else { What::Output(index) })
    }
}

/// Returns the inputs of ours that theirs does not take.
pub(super) fn not_taken(block: &dyn AnyBlock, wires: &[Wire]) -> Vec<&'static str> {
    let taken = |index: usize| wires.iter().any(|wire| wire.what == What::Input(index));
    let inputs = block.inputs().into_iter().enumerate();
    inputs.filter(|&(index, _)| !taken(index)).map(|(_, signal)| signal.name).collect()
}

/// Returns the names of ports with their numbers of bits, for a message.
pub(super) fn there_are(ports: &[Port]) -> String {
    let shown = |port: &Port| {
        let way = if port.is_input { "in" } else { "out" };
        let bits = if port.is_number { "a number".to_string() } else { format!("bits: {}", port.format.width()) };
        format!("{} ({way}, {bits})", port.name)
    };
    format!("there are {}", ports.iter().map(shown).collect::<Vec<_>>().join(", "))
}

fn names(signals: &[Signal]) -> String {
    signals.iter().map(|signal| signal.name).collect::<Vec<_>>().join(", ")
}

/// Returns whether two port names are the same; case does not matter.
pub(super) fn same(one: &str, two: &str) -> bool {
    one.eq_ignore_ascii_case(two)
}
