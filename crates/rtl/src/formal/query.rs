//! The questions to a solver: is there a state, and are there inputs, for which VHDL and emulator differ?

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;

use hpu_datapath::{ClockEdge, Lemma, Register};
use hpu_signal::{Clock, Defined, Format, Signal, Term};
use hpu_wave::{Around, Column, ComparedRow};

use super::netlist::{Net, Netlist};
use crate::engines::error::Error;
use crate::vectors::vector::hex;

/// A question.
pub(crate) struct Query {
    /// The subject of the question: the edge, the reset or a net.
    pub(super) about: String,
    /// The premises, in SMT-LIB.
    pub(super) given: String,
    /// The condition that something differs.
    pub(super) differs: String,
    /// The words that a counterexample shows.
    pub(super) values: Vec<Asked>,
    /// The row of the next word.
    row: usize,
    /// Whether a twin of each state is declared, with the same registers at first and the same inputs: where a twin's
    /// output has another word, the output depends on unknown bits.
    has_twins: bool,
    /// The outputs and registers of which a twin may have another word: their names in the query and in the design.
    unknown: Vec<(String, String)>,
}

/// What is asked about a block and its netlist.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Question {
    /// Outputs, and registers after a clock edge, from any state.
    Edge,
    /// The registers after the reset, or after power-up if there is no reset.
    Reset,
    /// So many rows, each of which the user's block answers `latency` edges later: from the reset, or from power-up if
    /// there is no reset (`begins`), or else from any state. Our block then has no registers.
    Trace { rows: usize, latency: usize, begins: bool },
}

/// A word of a counterexample: its names in the query.
pub(super) struct Asked {
    /// Its row, from 0.
    row: usize,
    role: &'static str,
    name: String,
    format: Format,
    vhdl: String,
    ours: Option<String>,
}

/// The registers of a block, grouped by the register of the VHDL whose parts they are, the lowest first. Each has its
/// index among the block's registers.
type Whole<'r> = BTreeMap<String, Vec<(usize, &'r Register)>>;

/// A block with its netlist; the questions are about these two.
pub(crate) struct Edge<'e, 'b> {
    equations: &'e ClockEdge<'b>,
    netlist: &'e Netlist,
    whole: Whole<'e>,
    has_twins: bool,
}

/// A question in the making, with the block's next words and outputs for a state and inputs.
struct Posed {
    query: Query,
    next: Vec<Term>,
    shown: Vec<Term>,
    cuts: Vec<(String, u32, Term)>,
}

impl<'e, 'b> Edge<'e, 'b> {
    pub(crate) fn new(equations: &'e ClockEdge<'b>, netlist: &'e Netlist) -> Self {
        let mut whole = Whole::new();
        for (place, register) in equations.registers.iter().enumerate() {
            whole.entry(register.path()).or_default().push((place, register));
        }
        whole.values_mut().for_each(|parts| parts.sort_by_key(|(_, register)| register.low));
        Self { equations, netlist, whole, has_twins: false }
    }

    /// Returns the name of the block.
    pub(super) fn name(&self) -> &'static str {
        self.equations.block.name()
    }

    /// Poses a question.
    pub(super) fn pose(&self, question: Question) -> Result<Query, Error> {
        match question {
            Question::Edge => self.edge(&[]),
            Question::Reset => Ok(self.reset()),
            Question::Trace { rows, latency, begins } => Ok(self.trace(rows, latency, begins)),
        }
    }

    /// Poses a question with the condition that unknown bits of the netlist (X, Z, or a net that nothing drives) reach
    /// an answer. Returns `None` if the netlist has none.
    pub(super) fn about_unknown(&self, question: Question) -> Result<Option<Query>, Error> {
        if !self.netlist.has_unknown_bits() {
            return Ok(None);
        }
        let mut query = Self { has_twins: true, whole: self.whole.clone(), ..*self }.pose(question)?;
        let reached: String = query.unknown.iter().map(|(asked, _)| format!(" (= {asked} #b1)")).collect();
        let _ = writeln!(query.given, "(assert (or false{reached}))");
        Ok(Some(query))
    }

    /// Begins a question about a state `s` and its next state `n`, with the reset active or not.
    fn begun(&self, netlist: &Netlist, resets: bool) -> Query {
        let mut query = Query::new(netlist, self.has_twins);
        query.state(netlist, "s", resets);
        if netlist.is_clocked {
            // An asynchronous reset would change the next state.
            query.state(netlist, "n", false);
            query.follows(netlist, "s", "n");
        }
        query
    }

    /// Makes a question about the block's results from the state and the inputs. The nets in `cuts` may have any words.
    fn posed(&self, cuts: &[Net]) -> Result<Posed, Error> {
        let Self { equations, ref whole, .. } = *self;
        let ClockEdge { block, registers, .. } = equations;
        let cut;
        let netlist = if cuts.is_empty() {
            self.netlist
        } else {
            cut = self.netlist.cut(cuts)?;
            &cut
        };
        let mut query = self.begun(netlist, false);
        let mut inputs = Vec::new();
        for input in block.inputs() {
            inputs.push(query.takes(netlist, &input, "s"));
        }
        query.given += &netlist.invariant("s").map_or_else(String::new, |holds| format!("(assert {holds})\n"));
        let mut before = Vec::new();
        for register in registers {
            let Register { low, format, .. } = *register;
            let high = low + format.width() - 1;
            let bits = match netlist.register(&register.path()) {
                Some((net, width)) if high >= width => {
                    return Err(Error::file(format!("the VHDL's `{net}` has {width} bits, ours {}", high + 1)));
                }
                Some((net, _)) => Some(format!("((_ extract {high} {low}) {})", netlist.bits(net, "s"))),
                None => None,
            };
            before.push(query.gives("register", &title(register, whole), format, bits));
        }
        for (name, parts) in whole {
            // A register that is alone has these bits in every reachable state. Where there are several parts, bits
            // that belong to none may be anything.
            if let (Some((net, width)), &[(place, register)]) = (netlist.register(name), &parts[..])
                && register.is_alone
            {
                let held = filled(register, &before[place].1, width);
                let _ = writeln!(query.given, "(assert (= {} {held}))", netlist.bits(net, "s"));
            }
        }
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
            Term::defined(itself.clone(), || equations.in_terms(&terms(&before), &terms(&inputs)));
        lines.iter().for_each(|line| query.given += &format!("{line}\n"));
        // A cut net lies in the range of the equations' number.
        for (name, own, term) in &cuts {
            if let Some(bits) = itself.get(name) {
                let _ = writeln!(query.given, "(assert {})", term.bounds(bits, *own));
            }
        }
        Ok(Posed { query, next, shown, cuts })
    }

    /// Returns the nets at which the equations can be cut: those that the VHDL has, each once.
    pub(super) fn nets(&self) -> Result<Vec<Net>, Error> {
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

    /// Makes the question about a net at which the equations can be cut; the nets in `cuts` may be anything.
    pub(super) fn net(&self, (name, own): &Net, cuts: &[Net]) -> Result<Query, Error> {
        let Posed { mut query, cuts, .. } = self.posed(cuts)?;
        let term = cuts.into_iter().find_map(|(met, _, term)| (met == *name).then_some(term));
        if let (Some(term), Some((net, width))) = (term, self.netlist.net(name)) {
            let (vhdl, ours) = (self.netlist.bits(net, "s"), term.bits(width));
            // A word of a row has at most 64 bits.
            let format = Format::signed((*own).min(64));
            let low = format!("((_ extract {} 0) {vhdl})", format.width() - 1);
            let _ = write!(query.differs, " (distinct {vhdl} {ours})");
            query.compares("net", name, format, &low, &term.bits(format.width()));
        }
        query.about = format!("its net {name}");
        Ok(query)
    }

    /// Makes the question about outputs, and about registers after an edge.
    pub(super) fn edge(&self, cuts: &[Net]) -> Result<Query, Error> {
        let Posed { mut query, next, shown, .. } = self.posed(cuts)?;
        for (output, ours) in self.equations.block.outputs().iter().zip(shown) {
            if self.netlist.port(output.name).is_empty() && !self.netlist.is_foreign() {
                return Err(Error::file(format!("the VHDL has no output `{}`", output.name)));
            }
            query.shows(self.netlist, output, "s", ours);
        }
        let next = |place: usize| Some(next[place].bits(self.equations.registers[place].format.width()));
        if self.netlist.is_clocked {
            self.compares_registers(&mut query, "next", "n", next);
        }
        query.about = if self.netlist.is_clocked { "an edge" } else { "its inputs" }.to_string();
        Ok(query)
    }

    /// Makes the question about the registers of a clocked block after a reset, or after power-up if there is no reset.
    fn reset(&self) -> Query {
        let netlist = self.netlist;
        let (mut query, role, after) = match netlist.reset() {
            Some(_) => (self.begun(netlist, true), "after reset", "n"),
            None => (Query::new(netlist, self.has_twins), "after power-up", "s"),
        };
        if after == "s" {
            query.state(netlist, "s", false);
            let _ = writeln!(query.given, "(assert (|{}_i| s))", netlist.name);
        }
        self.compares_registers(&mut query, role, after, |place| {
            let Register { low, format, reset, .. } = self.equations.registers[place];
            // Registers that a reset leaves as they are stay so on both sides, or a lemma shows that they do not
            // matter.
            let kept = || {
                let (net, _) = netlist
                    .register(&self.equations.registers[place].path())
                    .filter(|_| self.equations.lemmas().is_empty())?;
                Some(format!("((_ extract {} {low}) {})", low + format.width() - 1, netlist.bits(net, "s")))
            };
            reset.map(|word| literal(format, word)).or_else(kept)
        });
        query.about = if after == "n" { "the reset" } else { "power-up" }.to_string();
        query
    }

    /// Makes the question about `rows` rows; see [`Question::Trace`].
    fn trace(&self, rows: usize, latency: usize, begins: bool) -> Query {
        let Self { equations, netlist, .. } = *self;
        let ClockEdge { block, registers, .. } = equations;
        let mut query = Query::new(netlist, self.has_twins);
        let resets = begins && netlist.reset().is_some();
        let first = usize::from(resets);
        let named = |state: usize| format!("s{state}");
        for state in 0..first + rows + latency {
            query.state(netlist, &named(state), resets && state == 0);
            if state > 0 && netlist.is_clocked {
                query.follows(netlist, &named(state - 1), &named(state));
            }
        }
        if begins && !resets {
            let _ = writeln!(query.given, "(assert (|{}_i| s0))", netlist.name);
        }
        let mut before = Vec::new();
        for (place, Register { format, reset, .. }) in registers.iter().enumerate() {
            let bits = reset.map(|word| literal(*format, word));
            before.push(query.defines(&format!("|register {place}|"), *format, bits));
        }
        let mut inputs = Vec::new();
        for row in 0..rows {
            query.row = row;
            let mut taken = Vec::new();
            for input in block.inputs() {
                taken.push(query.takes(netlist, &input, &named(first + row)));
            }
            inputs.push(taken);
        }
        let Defined { built, lines, .. } = Term::defined(HashMap::new(), || {
            let mut words = terms(&before);
            let mut shown = Vec::new();
            for inputs in &inputs {
                let (next, answers) = equations.in_terms(&words, &terms(inputs));
                words = next;
                shown.push(answers);
            }
            shown
        });
        lines.iter().for_each(|line| query.given += &format!("{line}\n"));
        for (row, shown) in built.into_iter().enumerate() {
            query.row = row;
            for (output, ours) in block.outputs().iter().zip(shown) {
                query.shows(netlist, output, &named(first + row + latency), ours);
            }
        }
        query.about = match (netlist.is_clocked, begins) {
            (false, _) => "its inputs".to_string(),
            (true, false) => format!("{} from any state", edges(latency)),
            (true, true) => format!("{} from {}", edges(rows), if resets { "the reset" } else { "power-up" }),
        };
        query
    }

    /// Compares the registers in a state with these words, where the netlist has these registers.
    fn compares_registers(
        &self,
        query: &mut Query,
        role: &'static str,
        state: &str,
        ours: impl Fn(usize) -> Option<String>,
    ) {
        if let Some(holds) = self.netlist.invariant(state) {
            query.compares(role, "invariant", Format::BIT, &format!("(ite {holds} #b1 #b0)"), "#b1");
        }
        for (name, parts) in &self.whole {
            let Some((net, width)) = self.netlist.register(name) else { continue };
            query.looks_at(self.netlist, "register", name, net, state);
            let after = self.netlist.bits(net, state);
            for &(place, register) in parts {
                let Register { low, format, .. } = *register;
                let vhdl = format!("((_ extract {} {low}) {after})", low + format.width() - 1);
                if let Some(ours) = ours(place) {
                    query.compares(role, &title(register, &self.whole), format, &vhdl, &ours);
                }
            }
            if let &[(place, register)] = &parts[..]
                && register.is_alone
                && let Some(ours) = ours(place)
            {
                let _ = write!(query.differs, " (distinct {after} {})", filled(register, &ours, width));
            }
        }
    }
}

impl Query {
    fn new(Netlist { text, .. }: &Netlist, has_twins: bool) -> Self {
        Self { has_twins, ..Self::of(format!("{text}\n")) }
    }

    /// Returns a question with this text.
    fn of(text: String) -> Self {
        let given = format!("(set-option :produce-models true)\n(set-logic QF_BV)\n{text}");
        let (about, differs) = (String::new(), String::new());
        Self { about, given, differs, values: Vec::new(), row: 0, has_twins: false, unknown: Vec::new() }
    }

    /// Declares a state in which the reset is active or not.
    fn state(&mut self, netlist: &Netlist, state: &str, resets: bool) {
        let name = &netlist.name;
        let is_first = !self.given.contains("(declare-const ");
        let twin = self.has_twins.then(|| twin(state));
        for state in [Some(state), twin.as_deref()].into_iter().flatten() {
            let _ = writeln!(self.given, "(declare-const {state} |{name}_s|)\n(assert (|{name}_u| {state}))");
            self.given += &netlist.inputs(state, resets);
        }
        for (net, twin) in netlist.given(is_first).into_iter().zip(twin.iter().cycle()) {
            let _ = writeln!(self.given, "(assert (= {} {}))", netlist.bits(net, state), netlist.bits(net, twin));
        }
    }

    /// Asserts that one state follows another.
    fn follows(&mut self, netlist: &Netlist, state: &str, next: &str) {
        let name = &netlist.name;
        let _ = writeln!(self.given, "(assert (|{name}_t| {state} {next}))");
        if self.has_twins {
            let _ = writeln!(self.given, "(assert (|{name}_t| {} {}))", twin(state), twin(next));
        }
    }

    /// Asks whether unknown bits reach an output or a register.
    fn looks_at(&mut self, netlist: &Netlist, role: &str, name: &str, net: &str, state: &str) {
        if self.has_twins {
            let [one, other] = [state, &twin(state)].map(|state| netlist.bits(net, state));
            let named = self.named(&format!("unknown {role}"), net);
            let _ = writeln!(self.given, "(define-fun {named} () (_ BitVec 1) (ite (distinct {one} {other}) #b1 #b0))");
            self.unknown.push((named, format!("{role} {name}")));
        }
    }

    /// Reads one of our inputs from the netlist's nets for it.
    fn takes(&mut self, netlist: &Netlist, &Signal { name, format, .. }: &Signal, state: &str) -> (Format, String) {
        let nets: Vec<_> = netlist.port(name);
        let low =
            |&(net, _): &(&str, u32)| format!("((_ extract {} 0) {})", format.width() - 1, netlist.bits(net, state));
        let taken = self.gives("input", name, format, nets.first().map(low));
        for (net, width) in nets {
            let _ =
                writeln!(self.given, "(assert (= {} {}))", netlist.bits(net, state), extended(&taken.1, format, width));
        }
        taken
    }

    /// Compares an output in a state with the block's output.
    fn shows(&mut self, netlist: &Netlist, &Signal { name, format, .. }: &Signal, state: &str, ours: Term) {
        for (net, width) in netlist.port(name) {
            self.looks_at(netlist, "output", name, net, state);
            let (bits, ours) = (netlist.bits(net, state), ours.bits(format.width()));
            let low = format!("((_ extract {} 0) {bits})", format.width() - 1);
            self.compares("output", name, format, &low, &ours);
            let _ = write!(self.differs, " (distinct {bits} {})", extended(&ours, format, width));
        }
    }

    /// Gives a word a name; without bits, it may be any word.
    fn defines(&mut self, named: &str, format: Format, bits: Option<String>) -> (Format, String) {
        let width = format.width();
        let line = match bits {
            Some(bits) => format!("(define-fun {named} () (_ BitVec {width}) {bits})"),
            None => format!("(declare-const {named} (_ BitVec {width}))"),
        };
        let _ = writeln!(self.given, "{line}");
        (format, named.to_string())
    }

    /// Names a word of the state. Without bits it may be any word: then it belongs to a port that nothing reads, or to
    /// a register that synthesis leaves out, and it must not matter.
    fn gives(&mut self, role: &'static str, name: &str, format: Format, bits: Option<String>) -> (Format, String) {
        let given = self.defines(&self.named(role, name), format, bits);
        let (row, vhdl) = (self.row, given.1.clone());
        self.values.push(Asked { row, role, name: name.to_string(), format, vhdl, ours: None });
        given
    }

    /// Returns the name of a word of the row.
    fn named(&self, role: &str, name: &str) -> String {
        match self.row {
            0 => format!("|{role} {name}|"),
            row => format!("|{role} {name} {row}|"),
        }
    }

    /// Asks whether a word of the VHDL differs from ours.
    fn compares(&mut self, role: &'static str, name: &str, format: Format, vhdl: &str, ours: &str) {
        let mut named = |side: &str, bits: &str| {
            let named = self.named(&format!("{side} {role}"), name);
            self.defines(&named, format, Some(bits.to_string())).1
        };
        let (vhdl, ours) = (named("vhdl", vhdl), named("ours", ours));
        let _ = write!(self.differs, " (distinct {vhdl} {ours})");
        self.values.push(Asked { row: self.row, role, name: name.to_string(), format, vhdl, ours: Some(ours) });
    }

    /// Returns the names whose values a solver shows with a counterexample.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        let values = self.values.iter().flat_map(|asked| [Some(&*asked.vhdl), asked.ours.as_deref()]).flatten();
        values.chain(self.unknown.iter().map(|(asked, _)| &**asked))
    }

    /// Returns the outputs and registers that unknown bits reach in a model, as `output torque`.
    pub(super) fn reached(&self, model: &HashMap<String, u128>) -> Vec<&str> {
        let is_reached = |(asked, _): &&(String, String)| model.get(asked) == Some(&1);
        self.unknown.iter().filter(is_reached).map(|(_, name)| &**name).collect()
    }

    /// Returns the counterexample as rows, from the solver's value of each name: inputs and registers before the edge,
    /// then the results of both sides.
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
        let of_row = |row: usize| {
            let (given, told): (Vec<_>, Vec<_>) =
                self.values.iter().filter(|asked| asked.row == row).partition(|asked| asked.ours.is_none());
            (given, told)
        };
        let (given, told) = of_row(0);
        let columns: Vec<_> = given.iter().chain(&told).map(|asked| column(asked)).collect();
        let row = |number: usize| {
            let (given, told) = of_row(number - 1);
            let ours = |asked: &&Asked| word(asked.ours.as_ref().unwrap_or(&asked.vhdl), asked.format);
            let expected = given.iter().chain(&told).map(ours).collect();
            let got = told.iter().map(|asked| word(&asked.vhdl, asked.format)).collect();
            ComparedRow { number: number as u64, expected, got }
        };
        let mut rows: Vec<_> =
            (1..=self.values.iter().map(|asked| asked.row + 1).max().unwrap_or(0)).map(row).collect();
        // After the first difference, others are meaningless.
        let is_difference = |row: &ComparedRow| row.expected[given.len()..] != row.got[..];
        rows.truncate(rows.iter().position(is_difference).map_or(rows.len(), |row| row + 1));
        let clock = Clock::new(100_000_000).expect("a clock");
        Around { name: block, beside: "vhdl", counted: "edge", columns, inputs: given.len(), clock, rows }
    }
}

/// Returns the questions about the lemmas of a block's equations.
pub(super) fn claims(equations: &ClockEdge) -> Vec<Query> {
    let claim = |Lemma { any, follows }: Lemma| {
        let mut query = Query::of(String::new());
        let named = any.iter().enumerate();
        let words: Vec<_> = named.map(|(place, format)| query.defines(&format!("|{place}|"), *format, None)).collect();
        let Defined { built: (given, follows), lines, .. } = Term::defined(HashMap::new(), || follows(&terms(&words)));
        lines.iter().for_each(|line| query.given += &format!("{line}\n"));
        let _ = writeln!(query.given, "(assert {})", given.name());
        query.differs = format!(" (not {})", follows.name());
        query.about = "what its equations compute".to_string();
        query
    };
    equations.lemmas().into_iter().map(claim).collect()
}

/// Returns the name of a state's twin.
fn twin(state: &str) -> String {
    format!("{state}_twin")
}

/// A number of edges.
fn edges(count: usize) -> String {
    format!("{count} edge{}", if count == 1 { "" } else { "s" })
}

/// Returns words as terms.
fn terms(all: &[(Format, String)]) -> Vec<Term> {
    all.iter().map(|(format, name)| Term::of_bits(*format, name)).collect()
}

/// Returns a word in the notation of SMT-LIB.
fn literal(format: Format, word: i64) -> String {
    format!("#b{:0width$b}", format.bits(word), width = format.width() as usize)
}

/// Returns all bits of a VHDL register that contains one of ours: zeros below it, its sign above it.
fn filled(register: &Register, word: &str, width: u32) -> String {
    let Register { low, format, .. } = *register;
    match low {
        0 => extended(word, format, width),
        _ => format!("(concat {} #b{})", extended(word, format, width - low), "0".repeat(low as usize)),
    }
}

/// Returns the bits of a word, extended to more bits.
fn extended(bits: &str, format: Format, width: u32) -> String {
    let extend = if format.is_signed() { "sign" } else { "zero" };
    match width - format.width() {
        0 => bits.to_string(),
        more => format!("((_ {extend}_extend {more}) {bits})"),
    }
}

/// Returns a register's name, with its place if it is one of several parts.
fn title(register: &Register, whole: &Whole) -> String {
    let path = register.path();
    if whole[&path].len() == 1 { path } else { format!("{path}.{}", register.low) }
}
