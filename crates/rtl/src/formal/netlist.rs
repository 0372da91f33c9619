//! Writes a block's VHDL as a transition in SMT-LIB.

use std::collections::BTreeMap;
use std::fs;
use std::rc::Rc;

use hpu_cosim::scene::{Identifier, Language};
use hpu_cosim::script;
use hpu_cosim::script::{Fixed, Script, Yosys};
use hpu_datapath::AnyBlock;

use crate::cost::{self, NO_DPI, verilog::verilog};
use crate::engines::error::Error;
use crate::engines::ghdl::Library;
use crate::engines::hdl::Setup;
use crate::engines::sources::library;
use crate::netlists::cells::plain;
use crate::netlists::clocking::{self, Timing, Unfit};
use crate::netlists::unknown::{RULES, UNKNOWN, told};
use crate::netlists::{FLAT, TRANSITION};

/// A net of the VHDL, and the number of bits, including the sign, of the number on it.
pub(crate) type Net = (String, u32);

/// A netlist as Yosys writes it.
pub(crate) struct Netlist {
    /// The definitions.
    pub(super) text: String,
    /// The module.
    pub(super) name: String,
    /// Whether any register is clocked.
    pub(super) is_clocked: bool,
    /// Nets with their widths.
    nets: BTreeMap<String, u32>,
    /// The nets that are registers.
    registers: Vec<String>,
    /// The nets that are inputs.
    inputs: Vec<String>,
    /// The library from which the netlist can be written again with cuts.
    library: Option<Rc<Library>>,
    links: Links,
}

/// The block's ports and registers that the nets of a netlist stand for.
#[derive(Default)]
pub(crate) struct Links {
    /// Pairs of names of our ports and the nets of the netlist's ports, where the names differ.
    pub(crate) ports: Vec<(String, String)>,
    /// Pairs of names of our registers and the nets of the netlist's registers, where the names differ.
    pub(crate) registers: Vec<(String, String)>,
    /// Inputs that stay constant, with their words.
    pub(crate) constants: Vec<(String, u64)>,
    /// The reset, and whether it is active high.
    pub(crate) reset: Option<(String, bool)>,
    /// The net of the invariant, which the user claims to hold in every state.
    pub(crate) invariant: Option<String>,
}

impl Netlist {
    /// Returns the netlist of a block, or the reason why its step is not one rising edge of the clock.
    pub(super) fn new(block: &dyn AnyBlock, setup: &Setup) -> Result<Result<Self, String>, Error> {
        let library = library(block.name(), setup).map_err(Error::of_input)?;
        let verilog = verilog(block, &library)?;
        Self::read(Rc::new(library), block.name(), &verilog)
    }

    /// Returns the netlist in which the words of tables may be anything, and the registers that depend on registers;
    /// or the reason why its step is not one rising edge of the clock.
    pub(super) fn without_tables(
        block: &dyn AnyBlock,
        setup: &Setup,
    ) -> Result<Result<(Self, Vec<String>), String>, Error> {
        let (name, library) = (block.name(), library(block.name(), setup).map_err(Error::of_input)?);
        let verilog = without_tables(&verilog(block, &library)?);
        let library = Rc::new(library);
        let netlist = match Self::read(Rc::clone(&library), name, &verilog)? {
            Ok(netlist) => netlist,
            Err(why) => return Ok(Err(why)),
        };
        let script = script!(
            Yosys: "read_verilog{} block.v; hierarchy -top {}; proc; flatten; opt_clean; \
                    select -set all t:$*ff* t:$*latch* t:$sr t:$mem*; \
                    select -set made @all %co @all %d %co* @all %i; select -write made.txt @made",
            NO_DPI,
            Fixed(name)
        );
        cost::run_yosys(&library, name, &script)?;
        let made = fs::read_to_string(library.dir().join("made.txt"));
        let made = made.map_err(|error| Error::io(library.dir(), error))?;
        let made = made.lines().map(str::to_string).collect();
        Ok(Ok((netlist, made)))
    }

    /// Reads a netlist of a block from Verilog. First, before anything is transformed, it reads the clocks.
    fn read(library: Rc<Library>, name: &'static str, verilog: &str) -> Result<Result<Self, String>, Error> {
        let io = |error| Error::io(library.dir(), error);
        let file = |name: &str| fs::read_to_string(library.dir().join(name)).map_err(io);
        library.write("block.v", verilog)?;
        let script = script!(Yosys: "read_verilog{} block.v; {}", NO_DPI, clocking::early(Fixed(name)));
        cost::run_yosys(&library, name, &script)?;
        let [json, text] = clocking::EARLY;
        let timing = Timing { clock: "clk", reset: Some("rst"), at_once: false, ignores_case: false };
        match clocking::clocked(&file(json)?, name, &timing) {
            Ok(_) => {}
            Err(Unfit::Clocked(why)) => return Ok(Err(why)),
            Err(Unfit::Unknown(why)) => return Err(Error::file(why)),
        }
        library.write(text, told(&file(text)?))?;
        library.write(RULES.0, RULES.1)?;
        Self::written(library, name, &[]).map(Ok)
    }

    /// Returns the same netlist in which these nets may be anything.
    pub(super) fn cut(&self, nets: &[Net]) -> Result<Self, Error> {
        let nets: Vec<_> = nets.iter().filter_map(|(name, _)| self.net(name)).map(|(net, _)| net).collect();
        let library = self.library.as_ref().map(Rc::clone).expect("nets of a block's own netlist");
        Self::written(library, &self.name, &nets)
    }

    /// Makes the netlist of a block of the user's own from Yosys's text.
    pub(crate) fn foreign(text: String, name: &str, is_clocked: bool, links: Links) -> Self {
        let Listed { nets, registers, inputs } = Listed::of(&text);
        Self { text, name: name.to_string(), is_clocked, nets, registers, inputs, library: None, links }
    }

    fn written(library: Rc<Library>, name: &str, cuts: &[&str]) -> Result<Self, Error> {
        let io = |error| Error::io(library.dir(), error);
        // A net that is not cut only makes the question longer.
        let cuts = cuts.iter().filter_map(|net| Script::<Yosys>::net(net));
        let cuts: Script<Yosys> = cuts.map(|net| script!(Yosys: "cutpoint w:{}; ", net)).collect();
        let [_, netlist] = clocking::EARLY.map(Fixed);
        let top = Identifier::unit(Language::Verilog, name).expect("the name of a block");
        let script = script!(
            Yosys: "read_rtlil {}; {}; prep -top {}; {}; {}{} -wires -stbv block.smt2",
            netlist,
            UNKNOWN,
            top,
            Fixed(FLAT),
            cuts,
            Fixed(TRANSITION)
        );
        cost::run_yosys(&library, name, &script)?;
        let text = fs::read_to_string(library.dir().join("block.smt2")).map_err(io)?;
        let Listed { nets, registers, inputs } = Listed::of(&text);
        let is_clocked = nets.contains_key("clk");
        let links = Links { reset: is_clocked.then(|| ("rst".to_string(), true)), ..Links::default() };
        Ok(Self { text, name: name.to_string(), is_clocked, nets, registers, inputs, library: Some(library), links })
    }

    /// Returns the nets of a port; a block of the user's own may have several.
    pub(super) fn port(&self, name: &str) -> Vec<(&str, u32)> {
        let linked: Vec<_> = self.linked(&self.links.ports, name).collect();
        if linked.is_empty() && !self.is_foreign() { self.net(name).into_iter().collect() } else { linked }
    }

    /// Returns the net of a register.
    pub(crate) fn register(&self, name: &str) -> Option<(&str, u32)> {
        let linked = self.linked(&self.links.registers, name).next();
        linked.or_else(|| self.linked(&self.links.ports, name).next()).or_else(|| self.net(name))
    }

    fn linked<'n>(&'n self, links: &'n [(String, String)], name: &str) -> impl Iterator<Item = (&'n str, u32)> {
        let nets = links.iter().filter(move |(ours, _)| ours == name);
        nets.filter_map(|(_, net)| self.net(net))
    }

    /// Returns the names of its registers, as its designer knows them.
    pub(crate) fn registers(&self) -> Vec<&str> {
        self.registers.iter().map(|net| plain(net)).filter(|name| !name.starts_with('$')).collect()
    }

    /// Returns the reset, if there is one, and the value of its bit when it is active.
    pub(super) fn reset(&self) -> Option<(String, bool)> {
        self.links.reset.clone()
    }

    /// Returns whether it belongs to a block of the user's own.
    pub(super) fn is_foreign(&self) -> bool {
        self.library.is_none()
    }

    /// Returns the assumptions about the inputs in a state: the constant ones, and whether the reset is active.
    pub(super) fn inputs(&self, state: &str, resets: bool) -> String {
        let Links { constants, reset, .. } = &self.links;
        let reset = reset.iter().map(|(net, is_high)| (net, u64::from(resets == *is_high)));
        let constants = constants.iter().map(|(net, bits)| (net, *bits));
        let held = constants.chain(reset).filter_map(|(net, bits)| {
            let (net, width) = self.net(net)?;
            Some(format!("(assert (= {} #b{bits:0width$b}))\n", self.bits(net, state), width = width as usize))
        });
        held.collect()
    }

    /// Returns the inputs, and the registers too if these are asked for.
    pub(super) fn given(&self, has_registers: bool) -> Vec<&str> {
        self.inputs.iter().chain(self.registers.iter().filter(|_| has_registers)).map(String::as_str).collect()
    }

    /// Returns whether some bits are unknown: X, Z, or driven by nothing.
    pub(super) fn has_unknown_bits(&self) -> bool {
        self.text.contains("\n; yosys-smt2-anyseq ")
    }

    /// Returns the claim that the invariant holds in a state, if there is an invariant.
    pub(super) fn invariant(&self, state: &str) -> Option<String> {
        self.links.invariant.as_ref().map(|net| format!("(|{}_n {net}| {state})", self.name))
    }

    /// Returns the net of a variable or an output of this name, with its width. GHDL calls a variable's register `n`, a
    /// number, and the name. In an instance the name has the instance's name before it, or is the only one of that
    /// name.
    pub(crate) fn net(&self, name: &str) -> Option<(&str, u32)> {
        let (instance, own) = split(name);
        let is_own = |net: &str| plain(net).eq_ignore_ascii_case(own) || net == own;
        let is = |net: &str| split(net).0.eq_ignore_ascii_case(instance) && is_own(split(net).1);
        let mut found: Vec<_> = self.nets.iter().filter(|(net, _)| is(net)).collect();
        if found.is_empty() && instance.is_empty() {
            found = self.nets.iter().filter(|(net, _)| is_own(split(net).1)).collect();
            found.retain(|(net, _)| !self.registers.contains(net));
            found.truncate(if found.len() == 1 { 1 } else { 0 });
        }
        let register = found.iter().find(|(net, _)| self.registers.contains(net));
        let &(net, width) = register.or(found.first())?;
        Some((net, *width))
    }

    /// Returns the bits of a net in a state.
    pub(super) fn bits(&self, net: &str, state: &str) -> String {
        let value = format!("(|{}_n {net}| {state})", self.name);
        // Yosys writes a single bit as a truth value.
        if self.nets.get(net) == Some(&1) { format!("(ite {value} #b1 #b0)") } else { value }
    }
}

/// Returns the instance that contains a net of a flat netlist (empty for the block itself), and the net's name there.
fn split(net: &str) -> (&str, &str) {
    net.rsplit_once('.').unwrap_or(("", net))
}

/// Returns GHDL's Verilog in which nothing drives the words that are read from its tables.
fn without_tables(verilog: &str) -> String {
    let mut tables = Vec::new();
    let mut is_inside = false;
    let mut text = String::new();
    for line in verilog.lines() {
        let words: Vec<_> = line.trim().splitn(3, ' ').collect();
        if let ["reg", _, rest] = words[..]
            && rest.ends_with("// memory")
        {
            tables.extend(rest.split('[').next().map(str::to_string));
            is_inside = true;
        }
        let is_of = |rest: &str| tables.iter().any(|table| rest.contains(&format!("= {table}[")));
        if !(is_inside || matches!(words[..], ["assign", _, rest] if is_of(rest))) {
            text += line;
            text.push('\n');
        }
        is_inside &= line.trim() != "end";
    }
    text
}

/// The nets of a text with their widths, and those that are registers and inputs, as Yosys lists them in comments.
#[derive(Default)]
struct Listed {
    nets: BTreeMap<String, u32>,
    registers: Vec<String>,
    inputs: Vec<String>,
}

impl Listed {
    fn of(text: &str) -> Self {
        let mut listed = Self::default();
        for line in text.lines().filter_map(|line| line.strip_prefix("; yosys-smt2-")) {
            let words: Vec<_> = line.split(' ').collect();
            let [kind, net, width] = words[..] else { continue };
            let Ok(width) = width.parse() else { continue };
            match kind {
                "register" => listed.registers.push(net.to_string()),
                "input" => listed.inputs.push(net.to_string()),
                "wire" | "output" => {}
                _ => continue,
            }
            listed.nets.insert(net.to_string(), width);
        }
        listed
    }
}
