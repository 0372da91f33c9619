//! The questions to a solver: is there a state, and are there inputs, of which VHDL and emulator make something else?

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;

use hpu_datapath::{AnyStep, Register};
use hpu_signal::{Clock, Defined, Format, Signal, Term};

use super::ProofError;
use super::netlist::Netlist;
use crate::around::{Around, Row};
use crate::vector::{Column, hex};

/// A question.
pub(super) struct Query {
    /// The edge, the reset or the net that it asks about.
    pub(super) about: String,
    /// The premises, in SMT-LIB.
    pub(super) given: String,
    /// That something differs.
    pub(super) differs: String,
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

/// The registers of a block by the register of the VHDL whose parts they are, the lowest first, each with its place
/// among the block's.
type Whole<'r> = BTreeMap<&'static str, Vec<(usize, &'r Register)>>;

/// A net of the VHDL, and the bits of the number that it is, with its sign.
pub(super) type Net = (String, u32);

/// A block with its netlist, about which questions are made.
pub(super) struct Edge<'e> {
    block: &'e dyn AnyStep,
    netlist: &'e Netlist,
    registers: &'e [Register],
    whole: Whole<'e>,
}

/// A question in the making, and what the block makes of a state and inputs.
struct Posed {
    query: Query,
    next: Vec<Term>,
    shown: Vec<Term>,
    cuts: Vec<(String, u32, Term)>,
}

impl<'e> Edge<'e> {
    pub(super) fn new(block: &'e dyn AnyStep, netlist: &'e Netlist, registers: &'e [Register]) -> Self {
        let mut whole = Whole::new();
        for (place, register) in registers.iter().enumerate() {
            whole.entry(register.name).or_default().push((place, register));
        }
        whole.values_mut().for_each(|parts| parts.sort_by_key(|(_, register)| register.low));
        Self { block, netlist, registers, whole }
    }

    /// A question in a state `s` that goes over into `n`, with the reset there or not.
    fn begun(&self, netlist: &Netlist, reset: bool) -> Query {
        let Netlist { text, name, .. } = netlist;
        let mut given = "(set-option :produce-models true)\n(set-logic QF_BV)\n".to_string();
        let _ = writeln!(given, "{text}\n(declare-const s |{name}_s|)\n(assert (|{name}_u| s))");
        if netlist.is_clocked() {
            let bit = if reset { "#b1" } else { "#b0" };
            let _ = writeln!(given, "(declare-const n |{name}_s|)\n(assert (|{name}_t| s n))");
            let _ = writeln!(given, "(assert (= {} {bit}))", netlist.bits("rst", "s"));
        }
        Query { about: String::new(), given, differs: String::new(), values: Vec::new() }
    }

    /// A question about what the block makes of the state and the inputs; these nets stand for themselves.
    fn posed(&self, cuts: &[Net]) -> Result<Posed, ProofError> {
        let Self { block, registers, ref whole, .. } = *self;
        let cut;
        let netlist = if cuts.is_empty() {
            self.netlist
        } else {
            cut = self.netlist.cut(cuts)?;
            &cut
        };
        let mut query = self.begun(netlist, false);
        let mut inputs = Vec::new();
        for Signal { name, format, .. } in block.inputs() {
            let bits = netlist.net(name).map(|_| netlist.bits(name, "s"));
            inputs.push(query.gives("input", name, format, bits));
        }
        let mut before = Vec::new();
        for register in registers {
            let Register { name, low, format, .. } = *register;
            let high = low + format.width() - 1;
            let bits = match netlist.net(name) {
                Some((net, width)) if high >= width => {
                    return Err(ProofError::Netlist(format!("the VHDL's `{net}` has {width} bits, ours {}", high + 1)));
                }
                Some((net, _)) => Some(format!("((_ extract {high} {low}) {})", netlist.bits(net, "s"))),
                None => None,
            };
            before.push(query.gives("register", &title(register, whole), format, bits));
        }
        for (name, parts) in whole {
            // What its bits are in every state that there is; of several parts, bits that are none of ours are any.
            if let (Some((net, width)), &[(place, register)]) = (netlist.net(name), &parts[..]) {
                let held = filled(register, &before[place].1, width);
                let _ = writeln!(query.given, "(assert (= {} {held}))", netlist.bits(net, "s"));
            }
        }
        let terms = |all: &[(Format, String)]| -> Vec<_> {
            all.iter().map(|(format, name)| Term::of_bits(*format, name)).collect()
        };
        let mut itself = HashMap::new();
        for (name, own) in cuts {
            let Some((net, width)) = netlist.net(name) else { continue };
            let bits = netlist.bits(net, "s");
            let more = width - own;
            let own = format!("((_ extract {} 0) {bits})", own - 1);
            let _ = writeln!(query.given, "(assert (= {bits} ((_ sign_extend {more}) {own})))");
            itself.insert(name.clone(), own);
        }
        let Defined { built: (next, shown), lines, cuts } =
            Term::defined(itself, || block.terms(&terms(&before), &terms(&inputs)));
        lines.iter().for_each(|line| query.given += &format!("{line}\n"));
        Ok(Posed { query, next, shown, cuts })
    }

    /// The nets at which the equations can be cut: those of which the VHDL has one, each once.
    pub(super) fn nets(&self) -> Result<Vec<Net>, ProofError> {
        let Posed { cuts, .. } = self.posed(&[])?;
        let mut nets: Vec<Net> = Vec::new();
        for (name, own, _) in cuts {
            let has_room = self.netlist.net(&name).is_some_and(|(_, width)| width >= own);
            if has_room && nets.iter().all(|(known, _)| *known != name) {
                nets.push((name, own));
            }
        }
        Ok(nets)
    }

    /// The question about a net at which the equations can be cut, in which others may be anything.
    pub(super) fn net(&self, (name, own): &Net, cuts: &[Net]) -> Result<Query, ProofError> {
        let Posed { mut query, cuts, .. } = self.posed(cuts)?;
        let term = cuts.into_iter().find_map(|(met, _, term)| (met == *name).then_some(term));
        if let (Some(term), Some((net, width))) = (term, self.netlist.net(name)) {
            let (vhdl, ours) = (self.netlist.bits(net, "s"), term.bits(width));
            // A word of a row has 64 bits.
            let format = Format::signed((*own).min(64));
            let low = format!("((_ extract {} 0) {vhdl})", format.width() - 1);
            let _ = write!(query.differs, " (distinct {vhdl} {ours})");
            query.compares("net", name, format, &low, &term.bits(format.width()));
        }
        query.about = format!("its net {name}");
        Ok(query)
    }

    /// The question about outputs, and about registers after an edge.
    pub(super) fn edge(&self, cuts: &[Net]) -> Result<Query, ProofError> {
        let Posed { mut query, next, shown, .. } = self.posed(cuts)?;
        for (Signal { name, format, .. }, ours) in self.block.outputs().into_iter().zip(shown) {
            query.compares("output", name, format, &self.netlist.bits(name, "s"), &ours.bits(format.width()));
        }
        let next = |place: usize| Some(next[place].bits(self.registers[place].format.width()));
        self.compares_registers(&mut query, "next", next);
        query.about = if self.netlist.is_clocked() { "an edge" } else { "its inputs" }.to_string();
        Ok(query)
    }

    /// The question about the registers after a reset, where anything is clocked.
    pub(super) fn reset(&self) -> Option<Query> {
        if !self.netlist.is_clocked() {
            return None;
        }
        let mut query = self.begun(self.netlist, true);
        self.compares_registers(&mut query, "after reset", |place| {
            let Register { format, reset, .. } = self.registers[place];
            reset.map(|word| format!("#b{:0width$b}", format.bits(word), width = format.width() as usize))
        });
        query.about = "the reset".to_string();
        Some(query)
    }

    /// Compares the registers after an edge with these words, where there are any.
    fn compares_registers(&self, query: &mut Query, role: &'static str, ours: impl Fn(usize) -> Option<String>) {
        for (name, parts) in &self.whole {
            let Some((net, width)) = self.netlist.net(name) else { continue };
            let after = self.netlist.bits(net, "n");
            for &(place, register) in parts {
                let Register { low, format, .. } = *register;
                let vhdl = format!("((_ extract {} {low}) {after})", low + format.width() - 1);
                if let Some(ours) = ours(place) {
                    query.compares(role, &title(register, &self.whole), format, &vhdl, &ours);
                }
            }
            if let &[(place, register)] = &parts[..]
                && let Some(ours) = ours(place)
            {
                let _ = write!(query.differs, " (distinct {after} {})", filled(register, &ours, width));
            }
        }
    }
}

impl Query {
    /// Names a word of the state, or any word where there are no bits of it: of a port that nothing reads, or a
    /// register that synthesis leaves out, whose word must not matter.
    fn gives(&mut self, role: &'static str, name: &str, format: Format, bits: Option<String>) -> (Format, String) {
        let (named, width) = (format!("|{role} {name}|"), format.width());
        let line = match bits {
            Some(bits) => format!("(define-fun {named} () (_ BitVec {width}) {bits})"),
            None => format!("(declare-const {named} (_ BitVec {width}))"),
        };
        let _ = writeln!(self.given, "{line}");
        self.values.push(Asked { role, name: name.to_string(), format, vhdl: named.clone(), ours: None });
        (format, named)
    }

    /// Asks whether a word of the VHDL differs from ours.
    fn compares(&mut self, role: &'static str, name: &str, format: Format, vhdl: &str, ours: &str) {
        let names = ["vhdl", "ours"].map(|side| format!("|{side} {role} {name}|"));
        for (named, bits) in names.iter().zip([vhdl, ours]) {
            let _ = writeln!(self.given, "(define-fun {named} () (_ BitVec {}) {bits})", format.width());
        }
        let [vhdl, ours] = names;
        let _ = write!(self.differs, " (distinct {vhdl} {ours})");
        self.values.push(Asked { role, name: name.to_string(), format, vhdl, ours: Some(ours) });
    }

    /// The names to be told by a solver that has found a counterexample.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.values.iter().flat_map(|asked| [Some(&*asked.vhdl), asked.ours.as_deref()]).flatten()
    }

    /// The counterexample as a row, from what a solver tells of each name: inputs and registers before the edge, then
    /// what both sides make of them.
    pub(super) fn read(&self, block: &'static str, model: &HashMap<String, u128>) -> Around {
        let column = |asked: &Asked| {
            let name = match asked.role {
                "next" | "after reset" => format!("{}'", asked.name),
                _ => asked.name.clone(),
            };
            Column { name: name.leak(), format: asked.format, unit: "" }
        };
        let word =
            |name: &str, format: Format| hex(format, format.from_bits(model.get(name).copied().unwrap_or(0) as u64));
        let columns: Vec<_> = self.values.iter().map(column).collect();
        let ours = |asked: &Asked| word(asked.ours.as_ref().unwrap_or(&asked.vhdl), asked.format);
        let expected = self.values.iter().map(ours).collect();
        let answers = self.values.iter().filter(|asked| asked.ours.is_some());
        let got: Vec<_> = answers.map(|asked| word(&asked.vhdl, asked.format)).collect();
        let inputs = columns.len() - got.len();
        let clock = Clock::new(100_000_000).expect("a clock");
        let rows = vec![Row { number: 1, expected, got }];
        Around { name: block, beside: "vhdl", counted: "edge", columns, inputs, clock, rows }
    }
}

/// All bits of a VHDL register that one of ours stands in: zeros below, above its sign.
fn filled(register: &Register, word: &str, width: u32) -> String {
    let Register { low, format, .. } = *register;
    match low {
        0 => extended(word, format, width),
        _ => format!("(concat {} #b{})", extended(word, format, width - low), "0".repeat(low as usize)),
    }
}

/// The bits of a word with more above them.
fn extended(bits: &str, format: Format, width: u32) -> String {
    let extend = if format.is_signed() { "sign" } else { "zero" };
    match width - format.width() {
        0 => bits.to_string(),
        more => format!("((_ {extend}_extend {more}) {bits})"),
    }
}

/// A register's name, with its place where it is one of several parts.
fn title(register: &Register, whole: &Whole) -> String {
    if whole[register.name].len() == 1 {
        register.name.to_string()
    } else {
        format!("{}.{}", register.name, register.low)
    }
}
