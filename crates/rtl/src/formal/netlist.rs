//! A block's VHDL as a transition in SMT-LIB.

use std::collections::BTreeMap;
use std::fs;

use hpu_datapath::AnyBlock;
use hpu_signal::Format;

use super::ProofError;
use crate::cost::{self, verilog::verilog};
use crate::ghdl::GhdlError;
use crate::hdl::Setup;
use crate::sources::library;
use crate::tool::Tool;

/// What Yosys writes of a netlist.
pub(super) struct Netlist {
    /// The definitions.
    pub(super) text: String,
    /// The module.
    pub(super) name: String,
    /// Nets with their widths.
    nets: BTreeMap<String, u32>,
    /// Those that are registers.
    registers: Vec<String>,
}

impl Netlist {
    pub(super) fn new(block: &dyn AnyBlock, setup: &Setup) -> Result<Self, ProofError> {
        let name = block.name().to_string();
        let library = library(&name, setup).map_err(cost::CostError::from)?;
        let io = |error| cost::CostError::from(GhdlError::Io(library.dir().to_path_buf(), error));
        library.write("block.v", verilog(block, &library)?).map_err(cost::CostError::from)?;
        // Tables become choices; what is unknown, any value; a clock enable, a choice.
        let script = format!(
            "read_verilog block.v; prep -top {name}; flatten; memory_map; opt_clean; setundef -undriven -anyseq; \
             dffunmap; write_smt2 -wires -stbv block.smt2"
        );
        cost::run(&library, Tool::Yosys, &name, ["-q", "-p", &script])?;
        let text = fs::read_to_string(library.dir().join("block.smt2")).map_err(io)?;
        Ok(Self::read(name, text))
    }

    /// The nets of a text, which Yosys lists in comments.
    fn read(name: String, text: String) -> Self {
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
        Self { text, name, nets, registers }
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

    /// The same netlist in which these nets may be anything; `None` where one of them is no result of its own.
    pub(super) fn cut(&self, nets: &[(String, Format)]) -> Option<String> {
        let mut text = self.text.clone();
        for (name, _) in nets {
            let (net, _) = self.net(name)?;
            let head = format!("(define-fun |{}_n {net}| ", self.name);
            let line = text.lines().find(|line| line.starts_with(&head))?;
            // What it is called by: `(|block#12| state)`, of which it may be a part.
            let of = format!("|{}#", self.name);
            let (_, rest) = line.split_once(&of)?;
            let (number, rest) = rest.split_once('|')?;
            if rest.contains(&of) {
                return None;
            }
            let head = format!("(define-fun {of}{number}| ((state |{}_s|)) ", self.name);
            let line = text.lines().find(|line| line.starts_with(&head))?.to_string();
            let sort = sort(&line[head.len()..])?;
            let free = format!("(declare-const |free #{number}| {sort})\n{head}{sort} |free #{number}|)");
            text = text.replace(&line, &free);
        }
        Some(text)
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

/// The sort at the beginning of a text: `Bool`, or `(_ BitVec 12)`.
fn sort(text: &str) -> Option<&str> {
    if text.starts_with("Bool") {
        return text.get(..4);
    }
    text.find(')').and_then(|end| text.get(..=end)).filter(|sort| sort.starts_with("(_ BitVec "))
}
