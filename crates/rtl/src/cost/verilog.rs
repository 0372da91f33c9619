//! Writes a block as Verilog, and repairs the errors of GHDL 2.0 in it.

use std::collections::BTreeSet;

use hpu_datapath::AnyBlock;

use super::keywords::with_escaped_names;
use super::{failed_on, run};
use crate::engines::error::Error;
use crate::engines::ghdl::Library;
use crate::engines::tool::Tool;
use crate::vectors::vector::literal;

/// Returns the Verilog of the block and of the blocks that it instantiates.
pub fn verilog(block: &dyn AnyBlock, library: &Library) -> Result<String, Error> {
    let text = synth(block, library, "verilog")?;
    repaired(&text, || synth(block, library, "vhdl"))?.ok_or_else(|| failed_on(Tool::Ghdl, block.name(), UNTOLD))
}

/// The message that Verilog could not be repaired.
pub(crate) const UNTOLD: &str = "its Verilog lacks the choice `others`, and its VHDL does not tell it";

/// Repairs GHDL's Verilog, with the help of the same netlist in VHDL where that is needed. Returns `None` where the
/// VHDL does not tell the missing part.
pub(crate) fn repaired<E>(text: &str, vhdl: impl FnOnce() -> Result<String, E>) -> Result<Option<String>, E> {
    let text = with_slices(&with_literals(text))
        // A concatenation with a word of no bits is not valid Verilog.
        .replace("{0'b, ", "{")
        .replace(", 0'b}", "}");
    let text: String = declared_once(&text).map(|line| with_absolute(&with_signs(&with_sign(line))) + "\n").collect();
    if !text.lines().any(|line| line.trim().starts_with("case (")) {
        return Ok(Some(with_escaped_names(&text)));
    }
    Ok(with_defaults(&text, &vhdl()?).map(|text| with_escaped_names(&text)))
}

fn synth(block: &dyn AnyBlock, library: &Library, language: &str) -> Result<String, Error> {
    let mut arguments: Vec<String> = ["--synth", "--std=08", "-Wno-hide"].map(str::to_string).into();
    arguments.push(format!("--out={language}"));
    arguments.extend(block.generics().into_iter().map(|(name, value)| format!("-g{name}={}", literal(value))));
    arguments.push(block.name().to_string());
    run(library, Tool::Ghdl, block.name(), arguments)
}

/// Returns its lines without repeated declarations of a wire and without assignments of a wire to itself. GHDL 2.0
/// writes both where a signal has the name of the net that an instance drives. Icarus Verilog refuses the first and
/// reads the second as unknown.
fn declared_once(verilog: &str) -> impl Iterator<Item = &str> {
    let is_itself = |assigned: &str| assigned.split_once(" = ").is_some_and(|(to, from)| to == from);
    let mut wires = BTreeSet::new();
    verilog.lines().filter(move |line| {
        if line.starts_with("module ") {
            wires.clear();
        }
        match line.strip_prefix("  assign ").and_then(|rest| rest.split_once(';')) {
            Some((assigned, _)) => !is_itself(assigned),
            None => !line.starts_with("  wire ") || wires.insert(*line),
        }
    })
}

/// Rewrites words of more than 64 bits, which GHDL writes as VHDL's `"0101"`; Verilog reads that as text.
fn with_literals(verilog: &str) -> String {
    let parts = verilog.split('"').enumerate();
    parts.map(|(i, part)| if i % 2 == 0 { part.to_string() } else { format!("{}'b{part}", part.len()) }).collect()
}

/// Replaces bits taken out of a literal, `4'b0101[2]` or `4'b0101[2:1]`, by the literal of those bits; they are not
/// valid Verilog.
fn with_slices(verilog: &str) -> String {
    let mut parts = verilog.split("'b");
    let mut text = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let end = part.find(|c| !matches!(c, '0' | '1' | 'X' | 'Z')).unwrap_or(part.len());
        let (bits, rest) = part.split_at(end);
        if let Some((low, high, rest)) = slice(rest)
            && let Some(bits) = bits.len().checked_sub(high + 1).and_then(|first| bits.get(first..bits.len() - low))
        {
            text.truncate(text.trim_end_matches(|c: char| c.is_ascii_digit()).len());
            text += &format!("{}'b{bits}{rest}", bits.len());
        } else {
            text += &format!("'b{part}");
        }
    }
    text
}

/// Returns the lower and the upper bit of `[2]` or `[2:1]` at the beginning, and the text after it.
fn slice(text: &str) -> Option<(usize, usize, &str)> {
    let (range, rest) = text.strip_prefix('[')?.split_once(']')?;
    let (high, low) = range.split_once(':').unwrap_or((range, range));
    Some((low.parse().ok()?, high.parse().ok()?, rest))
}

/// Rewrites an arithmetic shift to the right, which GHDL writes as a logical one of a signed word, `$signed(n1_o) >>
/// 2'b10`.
fn with_sign(line: &str) -> String {
    match line.split_once(" = $signed(") {
        Some((_, shift)) if shift.contains(") >> ") => line.replacen(") >> ", ") >>> ", 1),
        _ => line.to_string(),
    }
}

/// Rewrites a signed division, which GHDL writes as one without signs and a remark, `n1_o = a / b; // sdiv`. The
/// remainder of `rem` has the sign of the dividend, as in Verilog; that of `mod` has the sign of the divisor.
fn with_signs(line: &str) -> String {
    let parts = line.split_once(" = ").and_then(|(net, value)| Some((net, value.split_once("; // ")?)));
    let Some((net, (value, remark))) = parts.filter(|(_, (value, _))| !value.contains('$')) else {
        return line.to_string();
    };
    let of =
        |sign: &str| value.split_once(sign).map(|(one, other)| [one, other].map(|word| format!("$signed({word})")));
    match (remark.trim(), of(" / "), of(" % ")) {
        ("sdiv", Some([a, b]), _) => format!("{net} = {a} / {b}; // sdiv"),
        ("srem", _, Some([a, b])) => format!("{net} = {a} % {b}; // srem"),
        ("smod", _, Some([a, b])) => {
            format!("{net} = {a} % {b} != 0 && ({a} < 0) != ({b} < 0) ? {a} % {b} + {b} : {a} % {b}; // smod")
        }
        _ => line.to_string(),
    }
}

/// Rewrites the absolute value of a signed word, which GHDL writes as in VHDL, `n2_o <= std_logic_vector(abs
/// $signed(n1_o));`.
fn with_absolute(line: &str) -> String {
    let parts = line.split_once(" <= std_logic_vector(abs $signed(");
    match parts.and_then(|(net, rest)| Some((net, rest.strip_suffix("));")?))) {
        Some((net, word)) => format!("  assign {} = $signed({word}) < 0 ? -{word} : {word};", net.trim()),
        None => line.to_string(),
    }
}

/// Gives every `case` its default (ghdl/ghdl#2041: GHDL 2.0 leaves it out, which turns logic into latches).
///
/// The defaults come from the same netlist in VHDL: its selected assignments are those cases, in the same order and for
/// the same nets.
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

/// Returns the net `n55_o` of `with n51_o select n55_o <=`.
fn selected(line: &str) -> Option<&str> {
    line.trim().strip_prefix("with ")?.strip_suffix(" <=")?.split_once(" select ").map(|(_, net)| net)
}

/// Returns a literal or a net in Verilog; the ports of the topmost entity are wrapped in VHDL.
fn value(vhdl: &str) -> Option<String> {
    // A word of equal bits.
    if let Some((high, bit)) = vhdl.strip_prefix('(').and_then(|word| word.split_once(" downto 0 => '")) {
        let (high, bit) = (high.parse::<u32>().ok()?, bit.strip_suffix("')")?);
        return Some(format!("{{{}{{1'b{bit}}}}}", high + 1));
    }
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
    use super::{with_absolute, with_defaults, with_literals, with_sign, with_signs, with_slices};

    #[test]
    fn long_words_are_bits_and_not_text() {
        assert_eq!(with_literals("a = n1 + \"0110\"; b = \"1\";"), "a = n1 + 4'b0110; b = 1'b1;");
    }

    #[test]
    fn a_bit_of_a_literal_is_that_bit() {
        assert_eq!(with_slices("{{3{4'b0100[2]}}, 4'b0100}"), "{{3{1'b1}}, 4'b0100}");
        assert_eq!(with_slices("a = 4'b0100[2:1] + n1[2:1];"), "a = 2'b10 + n1[2:1];");
    }

    #[test]
    fn a_shift_of_a_signed_word_keeps_the_sign_and_another_does_not() {
        assert_eq!(with_sign("  assign b = $signed(a) >> 2'b10;"), "  assign b = $signed(a) >>> 2'b10;");
        assert_eq!(with_sign("  assign b = a >> 2'b10;"), "  assign b = a >> 2'b10;");
    }

    #[test]
    fn a_signed_division_is_signed_and_another_is_not() {
        assert_eq!(with_signs("  assign n = a / b; // sdiv"), "  assign n = $signed(a) / $signed(b); // sdiv");
        assert_eq!(with_signs("  assign n = a % 8'b01; // srem"), "  assign n = $signed(a) % $signed(8'b01); // srem");
        assert_eq!(with_signs("  assign n = a / b; // udiv"), "  assign n = a / b; // udiv");
        assert_eq!(with_signs("  assign n = a % b; // umod"), "  assign n = a % b; // umod");
    }

    #[test]
    fn an_absolute_value_is_a_choice_by_the_sign() {
        assert_eq!(
            with_absolute("  n2_o <= std_logic_vector(abs $signed(n1_o));"),
            "  assign n2_o = $signed(n1_o) < 0 ? -n1_o : n1_o;"
        );
        assert_eq!(with_absolute("      2'b01: n1 <= a;"), "      2'b01: n1 <= a;");
    }

    const CASES: &str = "  always @*\n    case (s)\n      2'b10: n1 <= n5;\n      2'b01: n1 <= a;\n    endcase\n  \
                         always @*\n    case (s)\n      1'b1: n2 <= 2'b00;\n    endcase\n";
    const SELECTED: &str = "  with s select n1 <=\n    n5 when \"10\",\n    \
                            wrap_a when \"01\",\n    wrap_b when others;\n  \
                            with s select n2 <=\n    \"00\" when \"1\",\n    \"01\" when others;\n";

    #[test]
    fn a_case_without_a_default_gets_that_of_the_vhdl() {
        let fixed = with_defaults(CASES, SELECTED).expect("the same netlist");
        assert!(fixed.contains("2'b01: n1 <= a;\n      default: n1 <= b;\n    endcase"), "{fixed}");
        assert!(fixed.contains("1'b1: n2 <= 2'b00;\n      default: n2 <= 2'b01;\n    endcase"), "{fixed}");
    }

    #[test]
    fn a_default_of_equal_bits_is_repeated() {
        let selected = SELECTED.replace("wrap_b when others", "(17 downto 0 => 'X') when others");
        let fixed = with_defaults(CASES, &selected).expect("the same netlist");
        assert!(fixed.contains("default: n1 <= {18{1'bX}};"), "{fixed}");
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
