//! A block's VHDL as a transition in SMT-LIB.

use std::collections::BTreeMap;
use std::fs;
use std::rc::Rc;

use hpu_datapath::AnyBlock;

use super::ProofError;
use super::query::Net;
use crate::cost::{self, verilog::verilog};
use crate::ghdl::{GhdlError, Library};
use crate::hdl::Setup;
use crate::sources::library;
use crate::tool::Tool;

/// A netlist as Yosys writes it.
pub(super) struct Netlist {
    /// The definitions.
    pub(super) text: String,
    /// The module.
    pub(super) name: String,
    /// Nets with their widths.
    nets: BTreeMap<String, u32>,
    /// Those that are registers.
    registers: Vec<String>,
    library: Rc<Library>,
}

impl Netlist {
    pub(super) fn new(block: &dyn AnyBlock, setup: &Setup) -> Result<Self, ProofError> {
        let library = library(block.name(), setup).map_err(cost::CostError::from)?;
        library.write("block.v", verilog(block, &library)?).map_err(cost::CostError::from)?;
        Self::written(Rc::new(library), block.name(), &[])
    }

    /// The netlist in which the words of tables may be anything, and the registers that are made of registers.
    pub(super) fn without_tables(block: &dyn AnyBlock, setup: &Setup) -> Result<(Self, Vec<String>), ProofError> {
        let (name, library) = (block.name(), library(block.name(), setup).map_err(cost::CostError::from)?);
        library.write("block.v", without_tables(&verilog(block, &library)?)).map_err(cost::CostError::from)?;
        let script = format!(
            "read_verilog block.v; hierarchy -top {name}; proc; flatten; opt_clean; \
             select -set all t:$*ff* t:$*latch* t:$sr t:$mem*; select -set made @all %co @all %d %co* @all %i; \
             select -write made.txt @made"
        );
        cost::run(&library, Tool::Yosys, name, ["-q", "-p", &script])?;
        let made = fs::read_to_string(library.dir().join("made.txt"));
        let made = made.map_err(|error| cost::CostError::from(GhdlError::Io(library.dir().to_path_buf(), error)))?;
        let made = made.lines().map(str::to_string).collect();
        Ok((Self::written(Rc::new(library), name, &[])?, made))
    }

    /// The same netlist in which these nets may be anything.
    pub(super) fn cut(&self, nets: &[Net]) -> Result<Self, ProofError> {
        let nets: Vec<_> = nets.iter().filter_map(|(name, _)| self.net(name)).map(|(net, _)| net).collect();
        Self::written(Rc::clone(&self.library), &self.name, &nets)
    }

    fn written(library: Rc<Library>, name: &str, cuts: &[&str]) -> Result<Self, ProofError> {
        let io = |error| cost::CostError::from(GhdlError::Io(library.dir().to_path_buf(), error));
        let cuts: String = cuts.iter().map(|net| format!("cutpoint w:{net}; ")).collect();
        // Tables become choices; what is unknown, any value; a clock enable, a choice.
        let script = format!(
            "read_verilog block.v; prep -top {name}; flatten; memory_map; opt_clean; {cuts}setundef -undriven -anyseq; \
             dffunmap; write_smt2 -wires -stbv block.smt2"
        );
        cost::run(&library, Tool::Yosys, name, ["-q", "-p", &script])?;
        let text = fs::read_to_string(library.dir().join("block.smt2")).map_err(io)?;
        let (nets, registers) = listed(&text);
        Ok(Self { text, name: name.to_string(), nets, registers, library })
    }

    /// The net of a variable or an output of this name, with its width: GHDL calls a variable's register `n` with a
    /// number, and the name.
    pub(super) fn net(&self, name: &str) -> Option<(&str, u32)> {
        let is = |net: &str| {
            let rest = net.strip_suffix(name).and_then(|rest| rest.strip_suffix('_'));
            let number = rest.and_then(|rest| rest.strip_prefix('n'));
            net == name || number.is_some_and(|number| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
        };
        let found: Vec<_> = self.nets.iter().filter(|(net, _)| is(net)).collect();
        let register = found.iter().find(|(net, _)| self.registers.contains(net));
        let &(net, width) = register.or(found.first())?;
        Some((net, *width))
    }

    /// Whether anything is clocked.
    pub(super) fn is_clocked(&self) -> bool {
        self.nets.contains_key("clk")
    }

    /// The bits of a net in a state.
    pub(super) fn bits(&self, net: &str, state: &str) -> String {
        let value = format!("(|{}_n {net}| {state})", self.name);
        // Yosys takes a single bit for a truth.
        if self.nets.get(net) == Some(&1) { format!("(ite {value} #b1 #b0)") } else { value }
    }
}

/// Verilog by GHDL in which what is read of its tables is driven by nothing.
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

/// The nets of a text with their widths, and those that are registers, as Yosys lists them in comments.
fn listed(text: &str) -> (BTreeMap<String, u32>, Vec<String>) {
    let (mut nets, mut registers) = (BTreeMap::new(), Vec::new());
    for line in text.lines().filter_map(|line| line.strip_prefix("; yosys-smt2-")) {
        let words: Vec<_> = line.split(' ').collect();
        let [kind, net, width] = words[..] else { continue };
        let Ok(width) = width.parse() else { continue };
        match kind {
            "register" => registers.push(net.to_string()),
            "wire" | "input" | "output" => {}
            _ => continue,
        }
        nets.insert(net.to_string(), width);
    }
    (nets, registers)
}
