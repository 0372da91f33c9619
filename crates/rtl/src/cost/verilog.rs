//! A block as Verilog, with what GHDL 2.0 gets wrong put right.

use hpu_datapath::AnyBlock;

use super::tool::{CostError, Tool, run};
use crate::ghdl::Library;
use crate::vector::literal;

/// The block and what it instantiates.
pub fn verilog(block: &dyn AnyBlock, library: &Library) -> Result<String, CostError> {
    let text = synth(block, library, "verilog")?;
    // A concatenation with a word of no bits is written as `{0'b, x}`, which is no Verilog.
    let text = text.replace("{0'b, ", "{").replace(", 0'b}", "}");
    with_defaults(&text, &synth(block, library, "vhdl")?).ok_or_else(|| CostError::Failed {
        tool: Tool::Ghdl.name(),
        block: block.name().to_string(),
        said: "its Verilog lacks the choice `others`, and its VHDL does not tell it".to_string(),
    })
}

fn synth(block: &dyn AnyBlock, library: &Library, language: &str) -> Result<String, CostError> {
    let mut arguments: Vec<String> = ["--synth", "--std=08", "-Wno-hide"].map(str::to_string).into();
    arguments.push(format!("--out={language}"));
    arguments.extend(block.generics().into_iter().map(|(name, value)| format!("-g{name}={}", literal(value))));
    arguments.push(block.name().to_string());
    run(library.dir(), Tool::Ghdl, block.name(), arguments)
}

/// Gives every `case` its default (ghdl/ghdl#2041: GHDL 2.0 leaves it out, which makes latches of logic).
///
/// The same netlist as VHDL has them: its selected assignments are those cases, in the same order and of the same nets.
fn with_defaults(verilog: &str, vhdl: &str) -> Option<String> {
    let mut others = vhdl.lines().filter_map(|line| line.trim().strip_suffix(" when others;"));
    let mut targets = vhdl.lines().filter_map(selected);
    let mut text = String::new();
    let mut net = None;
    let mut has_default = false;
    for line in verilog.lines() {
        let word = line.trim();
        if word.starts_with("case (") {
            (net, has_default) = (None, false);
        } else if word == "endcase" {
            let (net, other) = (net?, others.next()?);
            if targets.next()? != net {
                return None;
            }
            if !has_default {
                text += &format!("      default: {net} <= {};\n", value(other)?);
            }
        } else if let Some((choice, assigned)) = word.split_once(": ")
            && let Some((target, _)) = assigned.split_once(" <= ")
        {
            net = Some(target);
            has_default |= choice == "default";
        }
        text += line;
        text += "\n";
    }
    (others.next().is_none() && targets.next().is_none()).then_some(text)
}

/// The net of `with n51_o select n55_o <=`.
fn selected(line: &str) -> Option<&str> {
    line.trim().strip_prefix("with ")?.strip_suffix(" <=")?.split_once(" select ").map(|(_, net)| net)
}

/// A literal or a net; ports of the topmost entity are wrapped in VHDL.
fn value(vhdl: &str) -> Option<String> {
    match vhdl.as_bytes() {
        [b'\'', bit, b'\''] => Some(format!("1'b{}", char::from(*bit))),
        [b'"', bits @ .., b'"'] => Some(format!("{}'b{}", bits.len(), std::str::from_utf8(bits).ok()?)),
        [b'X', b'"', digits @ .., b'"'] => Some(format!("{}'h{}", 4 * digits.len(), std::str::from_utf8(digits).ok()?)),
        [b'a'..=b'z', ..] => Some(vhdl.strip_prefix("wrap_").unwrap_or(vhdl).to_string()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::with_defaults;

    const CASES: &str = "  always @*\n    case (s)\n      2'b10: n1 <= n5;\n      2'b01: n1 <= a;\n    endcase\n  \
                         always @*\n    case (s)\n      1'b1: n2 <= 2'b00;\n    endcase\n";
    const SELECTED: &str = "  with s select n1 <=\n    n5 when \"10\",\n    wrap_a when \"01\",\n    wrap_b when others;\n  \
                            with s select n2 <=\n    \"00\" when \"1\",\n    \"01\" when others;\n";

    #[test]
    fn a_case_without_a_default_gets_that_of_the_vhdl() {
        let fixed = with_defaults(CASES, SELECTED).expect("the same netlist");
        assert!(fixed.contains("2'b01: n1 <= a;\n      default: n1 <= b;\n    endcase"), "{fixed}");
        assert!(fixed.contains("1'b1: n2 <= 2'b00;\n      default: n2 <= 2'b01;\n    endcase"), "{fixed}");
    }

    #[test]
    fn a_case_with_a_default_keeps_it() {
        let whole = CASES.replace("    endcase", "      default: n1 <= n9;\n    endcase");
        let whole = whole.replace("n2 <= 2'b00;\n      default: n1", "n2 <= 2'b00;\n      default: n2");
        assert_eq!(with_defaults(&whole, SELECTED), Some(whole.clone()));
    }

    #[test]
    fn netlists_that_are_not_the_same_are_refused() {
        assert_eq!(with_defaults(CASES, &SELECTED.replace("n2", "n3")), None);
        assert_eq!(with_defaults(CASES, ""), None);
        assert_eq!(with_defaults("", SELECTED), None);
    }
}
