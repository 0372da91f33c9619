//! Makes the unknown bits of a netlist (X, Z, or driven by nothing) bits that may be anything.
//!
//! Yosys's SMT-LIB has no such bits, and Yosys's passes give them values that suit these passes: a choice by X takes
//! the first word. So this module acts before any of them, on the netlist as it was read.

use std::collections::{HashMap, HashSet};

use hpu_cosim::script::Fixed;

use super::cells::{Bit, Cell, Module};

/// The file of rules for Yosys, by its name and its text. Its cells are unknown for some inputs.
pub(crate) const RULES: (&str, &str) = ("unknown.v", include_str!("unknown.v"));

/// Yosys passes that apply the [`RULES`] and let all unknown bits be anything.
pub(crate) const UNKNOWN: Fixed = Fixed("techmap -max_iter 1 -map unknown.v; opt_clean; setundef -undriven -anyseq");

/// Returns Yosys's netlist as [`UNKNOWN`] takes it. High impedance (`z`) is unknown (`x`) there, and a case compares
/// bits, of which X is one, as in Verilog.
pub(crate) fn told(netlist: &str) -> String {
    let is_constant = |word: &str| {
        let digits = word.split_once('\'').map(|(width, digits)| (width.bytes().all(|c| c.is_ascii_digit()), digits));
        digits.is_some_and(|(is_width, digits)| is_width && digits.bytes().all(|c| b"01xzm-".contains(&c)))
    };
    let mut text = String::with_capacity(netlist.len());
    for line in netlist.lines() {
        let code = line.trim_start();
        if code.starts_with("connect ") {
            let words =
                line.split(' ').map(|word| if is_constant(word) { word.replace('z', "x") } else { word.into() });
            text += &words.collect::<Vec<_>>().join(" ");
        } else if code.strip_prefix("cell $eq ").is_some_and(is_choice) {
            text += &line.replacen("$eq", "$eqx", 1);
        } else {
            text += line;
        }
        text.push('\n');
    }
    text
}

/// Returns whether Yosys has made a comparison of this name for a choice of a case.
fn is_choice(label: &str) -> bool {
    label.split_once("$procmux$").is_some_and(|(_, number)| number.contains("_CMP"))
}

/// Returns why a comparison with X or Z cannot be told: the net beside it may be X or Z itself. A net of known bits is
/// never X or Z, which the [`RULES`] take for granted. Registers count as known: what loads them is compared anyway.
pub(crate) fn compared(module: &Module, is_register: impl Fn(&Cell) -> bool) -> Option<String> {
    let is_unknown = |bit: &Bit| matches!(bit, Bit::Constant('x' | 'z'));
    let compares =
        |label: &str, cell: &Cell| matches!(&*cell.module, "$eqx" | "$nex") || cell.module == "$eq" && is_choice(label);
    let mut drivers: HashMap<Bit, (&str, &Cell)> = HashMap::new();
    for (label, cell) in &module.cells {
        drivers.extend(cell.outputs.iter().flat_map(|port| cell.bits(port)).map(|bit| (*bit, (label.as_str(), cell))));
    }
    let inputs: HashSet<_> = module.ports.values().filter(|port| port.is_input).flat_map(|port| &port.bits).collect();
    for (_, cell) in module.cells.iter().filter(|(label, cell)| compares(label, cell)) {
        let [a, b] = ["A", "B"].map(|port| cell.bits(port));
        let mut bits = match [a, b].map(|bits| bits.iter().any(is_unknown)) {
            [true, false] => b.to_vec(),
            [false, true] => a.to_vec(),
            _ => continue,
        };
        let mut seen = HashSet::new();
        while let Some(bit) = bits.pop() {
            if matches!(bit, Bit::Constant('0' | '1')) || inputs.contains(&bit) || !seen.insert(bit) {
                continue;
            }
            match drivers.get(&bit) {
                Some((label, cell)) if compares(label, cell) || is_register(cell) => {}
                Some((_, cell)) if !UNTOLD.contains(&&*cell.module) => bits.extend(cell.ins()),
                _ => return Some("logic asks whether a net is X or Z that may be X or Z".to_string()),
            }
        }
    }
    None
}

/// Cells that are unknown for some of their inputs.
const UNTOLD: [&str; 8] = ["$div", "$mod", "$divfloor", "$modfloor", "$shiftx", "$tribuf", "$memrd", "$memrd_v2"];

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn high_impedance_is_unknown_in_constants_and_nowhere_else() {
        let text = "  wire width 4 \\4'z\n  connect \\A { \\z [1] 4'zz01 1'1 }\n  connect \\4'z 12'zzzzzzzzzzzz\n";
        let expected = "  wire width 4 \\4'z\n  connect \\A { \\z [1] 4'xx01 1'1 }\n  connect \\4'z 12'xxxxxxxxxxxx\n";
        assert_eq!(told(text), expected);
    }

    #[test]
    fn a_case_compares_bits_and_an_equality_does_not() {
        let text = "  cell $eq $flatten\\u.$procmux$18_CMP0\n  cell $eq $eq$a.v:2$1\n  cell $mux $procmux$18\n";
        assert_eq!(told(text), text.replacen("$eq", "$eqx", 1));
    }
}
