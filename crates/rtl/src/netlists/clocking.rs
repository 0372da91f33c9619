//! Reads what clocks each register of a netlist, before anything transforms it.
//!
//! The transition in SMT-LIB has one step, and Yosys takes any edge of any net for that step: `async2sync` turns
//! latches and asynchronous resets into logic, and `write_smt2` reads flip-flops without their clocks. So the step is a
//! rising edge of the clock only if every cell that keeps state is clocked by that edge. This module looks at every
//! cell of the netlist as it was read, with its hierarchy flattened and nothing else done. It knows each type of cell
//! by name; a type that it does not know is an error.

use std::collections::{HashMap, HashSet};

use hpu_cosim::script;
use hpu_cosim::script::{Fits, Fixed, Script, Yosys};

use super::cells::{Bit, Cell, Module, plain, read};
use super::loops;
use super::unknown;
use super::wiring::Drivers;

/// The netlist that is read, and the same netlist as Yosys reads it again.
pub(crate) const EARLY: [&str; 2] = ["early.json", "early.il"];

/// Returns the Yosys commands that write the netlist of an entity that was read from Verilog. Modules become one, and
/// processes become registers; nothing is optimised, because Yosys then turns an inverted clock into the other edge.
/// Words at high impedance become tri-state buffers, and those of one net become one buffer.
pub(crate) fn early(top: impl Fits<Yosys>) -> Script<Yosys> {
    let [json, text] = EARLY.map(Fixed);
    script!(
        Yosys: "hierarchy -check -top {}; proc -noopt; setattr -mod -unset keep_hierarchy; \
                setattr -unset keep_hierarchy; flatten; tribuf -merge; write_json {}; write_rtlil {}",
        top,
        json,
        text
    )
}

/// The ports that act on registers.
pub(crate) struct Timing<'t> {
    /// The clock.
    pub(crate) clock: &'t str,
    /// The reset, if there is one.
    pub(crate) reset: Option<&'t str>,
    /// Whether the reset may act between clock edges too.
    pub(crate) at_once: bool,
    /// Whether names that differ in case are the same.
    pub(crate) ignores_case: bool,
}

/// A netlist whose registers are all clocked by the rising edge of the clock.
#[derive(PartialEq, Eq, Debug)]
pub(crate) struct Clocked {
    /// Whether the reset acts between clock edges too.
    pub(crate) resets_at_once: bool,
}

/// Why a netlist is not taken.
#[derive(PartialEq, Eq, Debug)]
pub(crate) enum Unfit {
    /// Its step is not one rising edge of the clock.
    Clocked(String),
    /// It is not understood: above all, it has a cell of an unknown type.
    Unknown(String),
}

/// Reads the netlist of a module from Yosys's JSON.
pub(crate) fn clocked(json: &str, top: &str, timing: &Timing) -> Result<Clocked, Unfit> {
    let unknown = || Unfit::Unknown(format!("the netlist of {top} by Yosys is not understood"));
    let module = read(json).and_then(|mut modules| modules.remove(top)).ok_or_else(unknown)?;
    let mut keep = Vec::new();
    for (label, cell) in &module.cells {
        let kind = Kind::of(&cell.module).ok_or_else(|| {
            Unfit::Unknown(format!("cell {label} of {top} has the type {}, which no proof knows", cell.module))
        })?;
        keep.extend((kind != Kind::Logic).then_some((label, cell, kind)));
    }
    Drivers::new(&module).map_err(|why| Unfit::Clocked(format!("{why}: where they differ, it is unknown (X)")))?;
    if let Some(why) = loops::of_logic(&module, passes).or_else(|| unknown::compared(&module, is_register)) {
        return Err(Unfit::Clocked(why));
    }
    let nets = Nets::new(&module, timing);
    let shown = nets.shown_reset();
    let mut resets_at_once = shown.is_some();
    if let Some(output) = shown.filter(|_| !timing.at_once) {
        return Err(Unfit::Clocked(format!("output {output} follows the reset at once, not at clock edges")));
    }
    for (label, cell, kind) in keep {
        let why = |why| Unfit::Clocked(format!("{} {why}", nets.keeper(label, cell)));
        resets_at_once |= nets.acts_at_once(cell, kind).map_err(why)?;
    }
    Ok(Clocked { resets_at_once })
}

/// Cells of one bit that change nothing: Yosys writes `+clk` as one.
const BUFFERS: [&str; 2] = ["$pos", "$_BUF_"];
/// Buffers and inverters.
const INVERTERS: [&str; 5] = ["$not", "$logic_not", "$_NOT_", "$pos", "$_BUF_"];

/// The state that a cell keeps, by what makes it change.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// It keeps nothing.
    Logic,
    /// A flip-flop: the port of its clock, whether that falls (`None`: a parameter tells), and the ports that set or
    /// reset it at once.
    Register {
        clock: &'static str,
        falls: Option<bool>,
        sets: &'static [&'static str],
    },
    /// A memory, or a port of one: the beginnings of the names of its read ports and write ports, as far as it has
    /// them.
    Memory {
        reads: Option<&'static str>,
        writes: Option<&'static str>,
    },
    Latch,
    /// A flip-flop of Yosys's own step, which no net clocks.
    Unclocked,
    /// A tri-state buffer of one bit.
    Floating,
}

/// The cells of Yosys that keep nothing, of words and of single bits. `$assert` and `$cover` drive nothing, and
/// `$meminit` tells what a memory holds at power-up.
const LOGIC: &str = "$not $pos $neg $and $or $xor $xnor $reduce_and $reduce_or $reduce_xor $reduce_xnor $reduce_bool \
                     $shl $shr $sshl $sshr $shift $shiftx $lt $le $eq $ne $eqx $nex $ge $gt $add $sub $mul $div $mod \
                     $divfloor $modfloor $pow $logic_not $logic_and $logic_or $mux $pmux $bmux $demux $bwmux $bweqx \
                     $slice $concat $lut $sop $alu $macc $fa $lcu $assert $cover $meminit $meminit_v2 $_BUF_ $_NOT_ \
                     $_AND_ $_NAND_ $_OR_ $_NOR_ $_XOR_ $_XNOR_ $_ANDNOT_ $_ORNOT_ $_MUX_ $_NMUX_ $_MUX4_ $_MUX8_ \
                     $_MUX16_ $_AOI3_ $_OAI3_ $_AOI4_ $_OAI4_ $tribuf";

impl Kind {
    /// Returns the kind of a type of cells, if it is known.
    fn of(name: &str) -> Option<Self> {
        let register = |sets| Some(Self::Register { clock: "CLK", falls: None, sets });
        match name {
            "$dff" | "$dffe" | "$sdff" | "$sdffe" | "$sdffce" => register(&[]),
            "$adff" | "$adffe" => register(&["ARST"]),
            "$aldff" | "$aldffe" => register(&["ALOAD"]),
            "$dffsr" | "$dffsre" => register(&["SET", "CLR"]),
            "$dlatch" | "$adlatch" | "$dlatchsr" | "$sr" => Some(Self::Latch),
            "$ff" | "$_FF_" => Some(Self::Unclocked),
            "$mem" | "$mem_v2" => Some(Self::Memory { reads: Some("RD_"), writes: Some("WR_") }),
            "$memrd" | "$memrd_v2" => Some(Self::Memory { reads: Some(""), writes: None }),
            "$memwr" | "$memwr_v2" => Some(Self::Memory { reads: None, writes: Some("") }),
            "$_TBUF_" => Some(Self::Floating),
            _ if LOGIC.split(' ').any(|known| known == name) => Some(Self::Logic),
            _ => Self::of_bit(name),
        }
    }

    /// Returns the kind of a register of one bit, whose name has a letter for each of its edges and levels:
    /// `$_DFFE_NP0P_` is clocked by the falling edge, as its first letter says.
    fn of_bit(name: &str) -> Option<Self> {
        let (kind, levels) = name.strip_prefix("$_")?.strip_suffix('_')?.rsplit_once('_')?;
        let falls = match levels.as_bytes().first()? {
            b'N' => true,
            b'P' => false,
            _ => return None,
        };
        let register = |sets| Some(Self::Register { clock: "C", falls: Some(falls), sets });
        match (kind, levels.len()) {
            ("DFF", 1) | ("DFFE", 2) | ("SDFF", 3) | ("SDFFE" | "SDFFCE", 4) => register(&[]),
            ("DFF", 3) | ("DFFE", 4) => register(&["R"]),
            ("ALDFF", 2) | ("ALDFFE", 3) => register(&["L"]),
            ("DFFSR", 3) | ("DFFSRE", 4) => register(&["S", "R"]),
            ("DLATCH" | "DLATCHSR" | "SR", _) => Some(Self::Latch),
            _ => None,
        }
    }
}

/// Returns whether a cell passes its inputs on at once.
fn passes(cell: &Cell) -> bool {
    match Kind::of(&cell.module) {
        Some(Kind::Logic) => true,
        Some(Kind::Memory { reads: Some(prefix), writes: None }) => !cell.is_set(&format!("{prefix}CLK_ENABLE"), 0),
        _ => false,
    }
}

/// Returns whether a cell is a register.
fn is_register(cell: &Cell) -> bool {
    matches!(Kind::of(&cell.module), Some(Kind::Register { .. }))
}

/// The nets of a module.
struct Nets<'m> {
    module: &'m Module,
    /// The cell that drives a bit.
    cells: HashMap<u64, &'m Cell>,
    timing: &'m Timing<'m>,
}

impl<'m> Nets<'m> {
    fn new(module: &'m Module, timing: &'m Timing) -> Self {
        let mut cells = HashMap::new();
        for cell in module.cells.values() {
            for bit in cell.outputs.iter().flat_map(|port| cell.bits(port)) {
                if let Bit::Net(net) = *bit {
                    cells.insert(net, cell);
                }
            }
        }
        Self { module, cells, timing }
    }

    /// Returns whether a cell that keeps state changes at once with the reset. Returns the reason why it does not
    /// change at rising edges of the clock alone, as the rest of a sentence about it.
    fn acts_at_once(&self, cell: &Cell, kind: Kind) -> Result<bool, String> {
        match kind {
            Kind::Logic => Ok(false),
            Kind::Latch => Err("changes between clock edges".to_string()),
            Kind::Unclocked => Err("has no clock".to_string()),
            Kind::Floating => Err("leaves its net at high impedance (Z) at times".to_string()),
            Kind::Register { clock, falls, sets } => {
                let falls = falls.unwrap_or_else(|| !cell.is_set("CLK_POLARITY", 0));
                self.rises(cell.bits(clock).first(), falls)?;
                let mut sets = sets.iter().flat_map(|port| cell.bits(port)).peekable();
                let acts = sets.peek().is_some();
                let reset = self.timing.reset.filter(|_| self.timing.at_once);
                match sets.find(|bit| !reset.is_some_and(|reset| self.is_of(**bit, reset, &INVERTERS))) {
                    Some(bit) => Err(format!("is set or reset at once by {}, not at clock edges", self.told(*bit))),
                    None => Ok(acts),
                }
            }
            Kind::Memory { reads, writes } => {
                for (prefix, writes) in reads.map(|reads| (reads, false)).into_iter().chain(writes.map(|to| (to, true)))
                {
                    self.is_memory(cell, prefix, writes)?;
                }
                Ok(false)
            }
        }
    }

    /// Checks the read or write ports of a memory. A read port without a clock is logic.
    fn is_memory(&self, cell: &Cell, prefix: &str, writes: bool) -> Result<(), String> {
        for (index, clock) in cell.bits(&format!("{prefix}CLK")).iter().enumerate() {
            if cell.is_set(&format!("{prefix}CLK_ENABLE"), index) {
                self.rises(Some(clock), !cell.is_set(&format!("{prefix}CLK_POLARITY"), index))?;
            } else if writes {
                return Err("is written between clock edges, as a latch is".to_string());
            }
            let reset = cell.bits(&format!("{prefix}ARST")).get(index);
            if reset.is_some_and(|bit| *bit != Bit::Constant('0')) {
                return Err("has a read port that is reset at once, not at clock edges".to_string());
            }
        }
        Ok(())
    }

    /// Returns by what a cell is clocked, unless that is the rising edge of the clock.
    fn rises(&self, by: Option<&Bit>, falls: bool) -> Result<(), String> {
        let clock = self.timing.clock;
        match by {
            Some(by) if self.is_of(*by, clock, &BUFFERS) && !falls => Ok(()),
            Some(by) if self.is_of(*by, clock, &BUFFERS) => {
                Err(format!("is clocked by the falling edge of {clock}, not by its rising edge"))
            }
            Some(by) => Err(format!("is clocked by {}, not by {clock} itself", self.told(*by))),
            None => Err("is clocked by nothing".to_string()),
        }
    }

    /// Returns whether a bit is the input of this name.
    fn is_port(&self, bit: Bit, name: &str) -> bool {
        let is = |port: &str| if self.timing.ignores_case { port.eq_ignore_ascii_case(name) } else { port == name };
        self.module.ports.iter().any(|(port, of)| of.is_input && is(port) && of.bits == [bit])
    }

    /// Returns whether a bit is the input of this name, or is made of it by these types of cells alone.
    fn is_of(&self, mut bit: Bit, name: &str, kinds: &[&str]) -> bool {
        for _ in 0..=self.module.cells.len() {
            if self.is_port(bit, name) {
                return true;
            }
            let Bit::Net(net) = bit else { return false };
            let passes_on = |cell: &&&Cell| {
                kinds.contains(&&*cell.module) && cell.bits("A").len() == 1 && cell.bits("Y").first() == Some(&bit)
            };
            let Some(cell) = self.cells.get(&net).filter(passes_on) else { return false };
            bit = cell.bits("A")[0];
        }
        false
    }

    /// Returns an output to which a path leads from the reset through no register.
    fn shown_reset(&self) -> Option<&str> {
        let reset = self.timing.reset?;
        let outputs = self.module.ports.iter().filter(|(_, port)| !port.is_input);
        let mut seen = HashSet::new();
        for (name, port) in outputs {
            let mut bits = port.bits.clone();
            while let Some(bit) = bits.pop() {
                if self.is_port(bit, reset) {
                    return Some(name);
                }
                let Bit::Net(net) = bit else { continue };
                let cell = self.cells.get(&net).filter(|_| seen.insert(net));
                let keeps = |cell: &Cell| matches!(Kind::of(&cell.module), Some(Kind::Register { .. }) | None);
                let Some(cell) = cell.filter(|cell| !keeps(cell)) else { continue };
                bits.extend(cell.ins());
            }
        }
        None
    }

    /// Returns the driver of a bit as text.
    fn told(&self, bit: Bit) -> String {
        let net = match bit {
            Bit::Constant(digit) => return format!("the constant '{digit}'"),
            Bit::Net(net) => net,
        };
        for (name, port) in self.module.ports.iter().filter(|(_, port)| port.is_input) {
            match port.bits.iter().position(|other| *other == bit) {
                Some(_) if port.bits.len() == 1 => return name.clone(),
                Some(index) => return format!("{name}[{index}]"),
                None => {}
            }
        }
        match self.cells.get(&net) {
            Some(cell) if Kind::of(&cell.module) == Some(Kind::Logic) => format!("logic ({})", cell.module),
            Some(cell) => self.keeper("", cell),
            None => "a net that nothing drives".to_string(),
        }
    }

    /// Returns the name of a cell that keeps state: that of the net that it drives, or of the memory.
    fn keeper(&self, label: &str, cell: &Cell) -> String {
        if let Some(memory) = cell.parameters.get("MEMID") {
            return format!("memory {}", plain(memory.trim_start_matches('\\')));
        }
        let driven: Vec<_> = cell.outputs.iter().flat_map(|port| cell.bits(port)).collect();
        let named = self.module.nets.iter().filter(|(_, bits)| bits.iter().any(|bit| driven.contains(&bit)));
        // Names of GHDL's own, as `n12_q`, come last.
        let is_made_up = |name: &str| plain(name) != name && ["o", "q"].contains(&plain(name));
        let rank = |name: &&String| (is_made_up(name), plain(name).len(), name.len());
        let name = named.map(|(name, _)| name).min_by_key(rank).map(|name| plain(name));
        let kind = if Kind::of(&cell.module) == Some(Kind::Latch) { "latch" } else { "register" };
        format!("{kind} {}", name.unwrap_or(label))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{Clocked, Kind, Timing, Unfit, clocked};

    const TIMING: Timing = Timing { clock: "clk", reset: Some("rst"), at_once: true, ignores_case: false };

    /// Reads a module with the inputs clk, rst and d (bits 2, 3 and 4), an inverter from rst to bit 5, the output q
    /// (bit 6), and a cell.
    fn of(kind: &str, parameters: &Value, ins: &Value, timing: &Timing) -> Result<Clocked, Unfit> {
        let mut connections = ins.as_object().expect("connections").clone();
        let mut directions: serde_json::Map<_, _> =
            connections.keys().map(|port| (port.clone(), json!("input"))).collect();
        directions.insert("Q".into(), json!("output"));
        connections.insert("Q".into(), json!([6]));
        let inverter = json!({ "hide_name": 1, "type": "$not", "parameters": {}, "connections": { "A": [3], "Y": [5] },
                               "port_directions": { "A": "input", "Y": "output" } });
        let cell = json!({ "hide_name": 1, "type": kind, "parameters": parameters, "connections": connections,
                           "port_directions": directions });
        let port = |way: &str, bit: u64| json!({ "direction": way, "bits": [bit] });
        let ports = json!({ "clk": port("input", 2), "rst": port("input", 3), "d": port("input", 4),
                            "q": port("output", 6) });
        let nets = json!({ "q": { "hide_name": 0, "bits": [6] } });
        let module = json!({ "ports": ports, "cells": { "inverter": inverter, "cell": cell }, "netnames": nets });
        clocked(&json!({ "modules": { "top": module } }).to_string(), "top", timing)
    }

    fn why(found: Result<Clocked, Unfit>) -> String {
        match found {
            Err(Unfit::Clocked(why)) => why,
            other => panic!("{other:?}"),
        }
    }

    /// Flip-flops of words and of bits: the port of the clock, the ports that act at once, and how the type is written
    /// for the rising and for the falling edge.
    const REGISTERS: [(&str, &[&str], &str, &str); 21] = [
        ("CLK", &[], "$dff", "$dff"),
        ("CLK", &[], "$dffe", "$dffe"),
        ("CLK", &["ARST"], "$adff", "$adff"),
        ("CLK", &["ARST"], "$adffe", "$adffe"),
        ("CLK", &["ALOAD"], "$aldff", "$aldff"),
        ("CLK", &["ALOAD"], "$aldffe", "$aldffe"),
        ("CLK", &[], "$sdff", "$sdff"),
        ("CLK", &[], "$sdffe", "$sdffe"),
        ("CLK", &[], "$sdffce", "$sdffce"),
        ("CLK", &["SET", "CLR"], "$dffsr", "$dffsr"),
        ("CLK", &["SET", "CLR"], "$dffsre", "$dffsre"),
        ("C", &[], "$_DFF_P_", "$_DFF_N_"),
        ("C", &[], "$_DFFE_PN_", "$_DFFE_NP_"),
        ("C", &["R"], "$_DFF_PP0_", "$_DFF_NN1_"),
        ("C", &["R"], "$_DFFE_PP0N_", "$_DFFE_NN1P_"),
        ("C", &["L"], "$_ALDFF_PN_", "$_ALDFF_NP_"),
        ("C", &["L"], "$_ALDFFE_PNN_", "$_ALDFFE_NPP_"),
        ("C", &["S", "R"], "$_DFFSR_PNN_", "$_DFFSR_NPP_"),
        ("C", &["S", "R"], "$_DFFSRE_PNNP_", "$_DFFSRE_NPPN_"),
        ("C", &[], "$_SDFF_PP0_", "$_SDFF_NN1_"),
        ("C", &[], "$_SDFFCE_PP0N_", "$_SDFFCE_NN1P_"),
    ];

    #[test]
    fn every_kind_of_register_needs_the_rising_edge_of_the_clock_itself() {
        for (clock, sets, rises, falls) in REGISTERS {
            let at = |bit: u64, set: u64| {
                let mut ins = json!({ clock: [bit], "D": [4] });
                sets.iter().for_each(|port| ins[*port] = json!([set]));
                ins
            };
            let polarity = |digit: &str| json!({ "CLK_POLARITY": digit });
            let sets = !sets.is_empty();
            // The reset's inverter is as good as the reset; the clock's is not.
            for reset in [3, 5] {
                let found = of(rises, &polarity("1"), &at(2, reset), &TIMING);
                assert_eq!(found, Ok(Clocked { resets_at_once: sets }), "{rises}");
            }
            let falling = why(of(falls, &polarity("0"), &at(2, 3), &TIMING));
            assert_eq!(falling, "register q is clocked by the falling edge of clk, not by its rising edge", "{falls}");
            let by_data = why(of(rises, &polarity("1"), &at(4, 3), &TIMING));
            assert_eq!(by_data, "register q is clocked by d, not by clk itself", "{rises}");
            let by_logic = why(of(rises, &polarity("1"), &at(5, 3), &TIMING));
            assert_eq!(by_logic, "register q is clocked by logic ($not), not by clk itself", "{rises}");
            if sets {
                let by_data = why(of(rises, &polarity("1"), &at(2, 4), &TIMING));
                assert_eq!(by_data, "register q is set or reset at once by d, not at clock edges", "{rises}");
                let own = Timing { at_once: false, ..TIMING };
                let by_reset = why(of(rises, &polarity("1"), &at(2, 3), &own));
                assert_eq!(by_reset, "register q is set or reset at once by rst, not at clock edges", "{rises}");
            }
        }
    }

    #[test]
    fn latches_and_registers_without_a_clock_are_refused_and_unknown_cells_are_errors() {
        for latch in ["$dlatch", "$adlatch", "$dlatchsr", "$sr", "$_DLATCH_P_", "$_DLATCHSR_PPP_", "$_SR_NN_"] {
            assert_eq!(
                why(of(latch, &json!({}), &json!({ "D": [4] }), &TIMING)),
                "latch q changes between clock edges"
            );
        }
        for unclocked in ["$ff", "$_FF_"] {
            assert_eq!(why(of(unclocked, &json!({}), &json!({ "D": [4] }), &TIMING)), "register q has no clock");
        }
        assert!(why(of("$_TBUF_", &json!({}), &json!({ "A": [4] }), &TIMING)).contains("high impedance"));
        for unknown in ["$anyseq", "$anyconst", "$assume", "$initstate", "$fsm", "SB_DFF", "$_DFF_X_", "$_DFF_PP_"] {
            assert_eq!(Kind::of(unknown), None, "{unknown}");
            let found = of(unknown, &json!({}), &json!({ "D": [4] }), &TIMING);
            assert!(matches!(found, Err(Unfit::Unknown(ref why)) if why.contains(unknown)), "{found:?}");
        }
    }

    #[test]
    fn a_memory_is_written_at_the_rising_edge_of_the_clock_itself() {
        let ins = |bit: u64| json!({ "CLK": [bit], "ADDR": [4] });
        let port = |enabled: &str, polarity: &str| json!({ "CLK_ENABLE": enabled, "CLK_POLARITY": polarity });
        let rises = Ok(Clocked { resets_at_once: false });
        assert_eq!(of("$memwr_v2", &port("1", "1"), &ins(2), &TIMING), rises);
        // A read port without a clock is logic, a write port without one is a latch.
        assert_eq!(of("$memrd_v2", &port("0", "1"), &ins(4), &TIMING), rises);
        assert!(why(of("$memwr_v2", &port("0", "1"), &ins(4), &TIMING)).contains("written between clock edges"));
        for kind in ["$memrd", "$memrd_v2", "$memwr", "$memwr_v2"] {
            assert!(why(of(kind, &port("1", "0"), &ins(2), &TIMING)).contains("the falling edge of clk"), "{kind}");
            assert!(why(of(kind, &port("1", "1"), &ins(4), &TIMING)).contains("is clocked by d"), "{kind}");
        }
        let whole = |enabled: &str, polarity: &str| {
            json!({ "MEMID": "\\store", "RD_CLK_ENABLE": "00", "RD_CLK_POLARITY": "11", "WR_CLK_ENABLE": enabled,
                    "WR_CLK_POLARITY": polarity })
        };
        let ins = json!({ "RD_CLK": [4, 4], "WR_CLK": [2, 2] });
        assert_eq!(of("$mem_v2", &whole("11", "11"), &ins, &TIMING), rises);
        let second = why(of("$mem_v2", &whole("11", "01"), &ins, &TIMING));
        assert_eq!(second, "memory store is clocked by the falling edge of clk, not by its rising edge");
        assert!(why(of("$mem_v2", &whole("01", "11"), &ins, &TIMING)).contains("written between clock edges"));
    }
}
