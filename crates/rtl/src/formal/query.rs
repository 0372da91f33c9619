//! The questions to a solver: is there a state, and are there inputs, of which VHDL and emulator make something else?

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;

use hpu_datapath::{AnyStep, Register};
use hpu_signal::{Format, Signal, Term};

use super::ProofError;
use super::netlist::Netlist;

/// What is asked of one kind of edge.
pub(super) struct Query {
    pub(super) about: &'static str,
    /// In SMT-LIB.
    pub(super) text: String,
    /// The words that a counterexample shows.
    pub(super) values: Vec<Asked>,
}

/// A word of a counterexample: its names in the query.
pub(super) struct Asked {
    role: &'static str,
    name: String,
    format: Format,
    vhdl: String,
    ours: Option<String>,
}

/// A word of a counterexample.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Value {
    /// What it is of: an input, a register before the edge, an output, a register after it.
    pub role: &'static str,
    /// The name of the port or register.
    pub name: String,
    /// Its format.
    pub format: Format,
    /// In the VHDL.
    pub vhdl: i64,
    /// In the emulator, where that is another word than the given one.
    pub ours: Option<i64>,
}

/// The parts of one register of the VHDL, the lowest first, by their places among the block's.
type Parts<'r> = Vec<(usize, &'r Register)>;

/// The questions about a block: an edge without reset, and the reset; of a combinational one, its outputs.
pub(super) fn queries(block: &dyn AnyStep, netlist: &Netlist) -> Result<Vec<Query>, ProofError> {
    let registers = AnyStep::registers(block);
    let mut whole: BTreeMap<&str, Parts> = BTreeMap::new();
    for (place, register) in registers.iter().enumerate() {
        whole.entry(register.name).or_default().push((place, register));
    }
    whole.values_mut().for_each(|parts| parts.sort_by_key(|(_, register)| register.low));
    let mut all = vec![edge(block, netlist, &registers, &whole)?];
    if netlist.is_clocked() {
        all.push(reset(netlist, &whole)?);
    }
    Ok(all)
}

/// The text up to the inputs, in a state `s` that goes over into `n`.
fn beginning(netlist: &Netlist) -> String {
    let (text, name) = (&netlist.text, &netlist.name);
    let mut text = format!("(set-option :produce-models true)\n(set-logic QF_BV)\n{text}\n(declare-const s |{name}_s|)\n");
    if netlist.is_clocked() {
        let _ = writeln!(text, "(declare-const n |{name}_s|)\n(assert (|{name}_t| s n))");
    }
    let _ = writeln!(text, "(assert (|{name}_u| s))");
    text
}

/// Whether the reset is there.
fn with_reset(netlist: &Netlist, is_there: bool) -> String {
    let bit = if is_there { "#b1" } else { "#b0" };
    format!("(assert (= {} {bit}))\n", netlist.bits("rst", "s"))
}

fn edge(
    block: &dyn AnyStep,
    netlist: &Netlist,
    registers: &[Register],
    whole: &BTreeMap<&str, Parts>,
) -> Result<Query, ProofError> {
    let mut text = beginning(netlist);
    if netlist.is_clocked() {
        text += &with_reset(netlist, false);
    }
    let mut values = Vec::new();
    let mut given = |text: &mut String, role, name: &str, format: Format, bits: String| {
        let named = format!("|{role} {name}|");
        let _ = writeln!(text, "(define-fun {named} () (_ BitVec {}) {bits})", format.width());
        values.push(Asked { role, name: name.to_string(), format, vhdl: named.clone(), ours: None });
        named
    };
    let mut inputs = Vec::new();
    for Signal { name, format, .. } in block.inputs() {
        // A port that nothing reads is no net.
        let bits = if netlist.net(name).is_some() {
            netlist.bits(name, "s")
        } else {
            let _ = writeln!(text, "(declare-const |free {name}| (_ BitVec {}))", format.width());
            format!("|free {name}|")
        };
        inputs.push((format, given(&mut text, "input", name, format, bits)));
    }
    let mut before = Vec::new();
    for register in registers {
        let (width, low) = (register.format.width(), register.low);
        let name = register.title(whole);
        let bits = match netlist.net(register.name) {
            Some((net, all)) if low + width <= all => {
                format!("((_ extract {} {low}) {})", low + width - 1, netlist.bits(net, "s"))
            }
            Some((net, all)) => {
                let own = low + width;
                return Err(ProofError::Netlist(format!("the VHDL's `{net}` has {all} bits, ours {own}")));
            }
            // Synthesis has left it out: its word must not matter.
            None => {
                let _ = writeln!(text, "(declare-const |free {name}| (_ BitVec {width}))");
                format!("|free {name}|")
            }
        };
        before.push((register.format, given(&mut text, "register", &name, register.format, bits)));
    }
    let terms = |all: &[(Format, String)]| -> Vec<_> {
        all.iter().map(|(format, name)| Term::of_bits(*format, name)).collect()
    };
    let ((next, shown), definitions) =
        Term::defined(|| block.terms(&terms(&before), &terms(&inputs)));
    definitions.iter().for_each(|line| text += &format!("{line}\n"));

    let mut differences = Vec::new();
    for (Signal { name, format, .. }, ours) in block.outputs().into_iter().zip(shown) {
        let vhdl = netlist.bits(name, "s");
        let ours = ours.bits(format.width());
        differences.push(differs(&mut text, &mut values, ("output", name, format), &vhdl, &ours));
    }
    for (name, parts) in whole {
        let Some((net, width)) = netlist.net(name) else { continue };
        let place = |of: &dyn Fn(usize, &Register) -> String| -> Vec<_> {
            parts.iter().map(|&(place, register)| (register, of(place, register))).collect()
        };
        // What its bits are in every state that there is.
        let held = composed(&place(&|place, _| before[place].1.clone()), width);
        let _ = writeln!(text, "(assert (= {} {held}))", netlist.bits(net, "s"));
        let after = place(&|place, register| next[place].bits(register.format.width()));
        let format = register_format(parts, width);
        let (vhdl, ours) = (netlist.bits(net, "n"), composed(&after, width));
        differences.push(differs(&mut text, &mut values, ("next", name, format), &vhdl, &ours));
    }
    let _ = writeln!(text, "(assert (or false {}))", differences.join(" "));
    Ok(Query { about: if netlist.is_clocked() { "an edge" } else { "the inputs" }, text, values })
}

fn reset(netlist: &Netlist, whole: &BTreeMap<&str, Parts>) -> Result<Query, ProofError> {
    let mut text = beginning(netlist) + &with_reset(netlist, true);
    let (mut values, mut differences) = (Vec::new(), Vec::new());
    for (name, parts) in whole {
        let Some((net, width)) = netlist.net(name) else { continue };
        let word = |register: &Register| {
            let bits = register.format.bits(register.reset);
            format!("#b{bits:0width$b}", width = register.format.width() as usize)
        };
        let ours: Vec<_> = parts.iter().map(|&(_, register)| (register, word(register))).collect();
        let format = register_format(parts, width);
        let (vhdl, ours) = (netlist.bits(net, "n"), composed(&ours, width));
        differences.push(differs(&mut text, &mut values, ("after reset", name, format), &vhdl, &ours));
    }
    let _ = writeln!(text, "(assert (or false {}))", differences.join(" "));
    Ok(Query { about: "the reset", text, values })
}

/// Names both sides of a comparison; that they differ.
fn differs(
    text: &mut String,
    values: &mut Vec<Asked>,
    (role, name, format): (&'static str, &str, Format),
    vhdl: &str,
    ours: &str,
) -> String {
    let names = ["vhdl", "ours"].map(|side| format!("|{side} {role} {name}|"));
    for (named, bits) in names.iter().zip([vhdl, ours]) {
        let _ = writeln!(text, "(define-fun {named} () (_ BitVec {}) {bits})", format.width());
    }
    let [vhdl, ours] = names;
    let differ = format!("(distinct {vhdl} {ours})");
    values.push(Asked { role, name: name.to_string(), format, vhdl, ours: Some(ours) });
    differ
}

/// A register of the VHDL as one word.
fn register_format(parts: &Parts, width: u32) -> Format {
    match parts[..] {
        [(_, register)] if register.format.is_signed() && width > 1 => Format::signed(width.min(64)),
        _ => Format::unsigned(width.min(64)),
    }
}

/// The bits of a register made of its parts: zeros below and between, above the last one's sign.
fn composed(parts: &[(&Register, String)], width: u32) -> String {
    let mut bits = String::new();
    let mut filled = 0;
    let mut put = |piece: String| bits = if bits.is_empty() { piece } else { format!("(concat {piece} {bits})") };
    for (register, word) in parts {
        if register.low > filled {
            put(format!("#b{}", "0".repeat((register.low - filled) as usize)));
        }
        put(word.clone());
        filled = register.low + register.format.width();
    }
    let extend = if parts.last().is_some_and(|(register, _)| register.format.is_signed()) { "sign" } else { "zero" };
    if filled < width { format!("((_ {extend}_extend {}) {bits})", width - filled) } else { bits }
}

trait Titled {
    /// Its name, with its place where it is one of several parts.
    fn title(&self, whole: &BTreeMap<&str, Parts>) -> String;
}

impl Titled for Register {
    fn title(&self, whole: &BTreeMap<&str, Parts>) -> String {
        if whole[self.name].len() == 1 { self.name.to_string() } else { format!("{}.{}", self.name, self.low) }
    }
}

/// The names to be told by a solver that has found a counterexample.
pub(super) fn names(values: &[Asked]) -> impl Iterator<Item = &str> {
    values.iter().flat_map(|asked| [Some(&*asked.vhdl), asked.ours.as_deref()]).flatten()
}

/// The words of a counterexample, from what a solver tells of each name.
pub(super) fn read(values: Vec<Asked>, model: &HashMap<String, u128>) -> Vec<Value> {
    let word = |name: &str, format: Format| format.from_bits(model.get(name).copied().unwrap_or(0) as u64);
    let value = |asked: Asked| {
        let Asked { role, name, format, vhdl, ours } = asked;
        let (vhdl, ours) = (word(&vhdl, format), ours.map(|ours| word(&ours, format)));
        Value { role, name, format, vhdl, ours }
    };
    values.into_iter().map(value).collect()
}
