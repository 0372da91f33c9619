//! Verilog that Yosys reads otherwise than Verilator, or that says something while it is simulated.
//!
//! Yosys synthesises: it believes attributes and comments for synthesis, takes a process for the logic that it is meant
//! to be, and gives the variable of a loop the width and the sign of the number that is assigned to it. Verilator
//! simulates the text. A design in which the two may differ does not leap.

use std::collections::BTreeSet;

use super::super::text::{bare, words};
use super::tree::{Node, Tree, constant, is_statement};

/// System functions that only compute, and tasks that only give memories their first words.
const SILENT: &str = "$signed $unsigned $clog2 $bits $size $high $low $left $right $readmemh $readmemb $countones";
/// Keywords of assertions.
const CLAIMS: &str = "assert assume cover property sequence final";
/// Words of which a synthesiser makes something else than a simulator, or that Debian's Yosys reads only in part, and
/// macros that only one of both defines.
const OTHERWISE: &str = "\
    unique unique0 priority wand wor triand trior tri0 tri1 trireg supply0 supply1 pullup pulldown force release \
    deassign while do foreach forever repeat real realtime shortreal time struct union interface class bind \
    specify primitive task defparam SYNTHESIS YOSYS FORMAL VERILATOR verilator verilator3";
/// Attributes that change nothing in the logic.
const PLAIN: &str = "\
    keep keep_hierarchy dont_touch async_reg ram_style rom_style mark_debug use_dsp preserve syn_keep \
    syn_preserve syn_ramstyle shreg_extract fsm_encoding max_fanout";
/// Comments by which a synthesiser leaves code out or believes a choice to be complete.
const BELIEVED: &str = "full_case parallel_case translate_off";
/// Keywords of declarations whose words are no integers of 32 bits.
const NARROW: &str = "\
    reg logic bit byte shortint longint wire var input output inout parameter localparam enum typedef tri";
/// Keywords of declarations of integers of 32 bits.
const INTEGERS: &str = "integer int genvar";

/// Returns whether a word is in a list.
fn lists(list: &str, word: &str) -> bool {
    list.split(' ').any(|one| one == word)
}

/// Returns what files of Verilog may say, or how they may end a run; `None` if no word of them does.
pub(super) fn heard(files: &[String]) -> Option<String> {
    let is_heard = |word: &&str| {
        let is_task = word.starts_with('$') && word.len() > 1;
        is_task && !lists(SILENT, word) || lists(CLAIMS, word)
    };
    let word = |code: &String| words(code).map(|(_, word)| word).find(is_heard).map(str::to_string);
    let word = files.iter().map(|file| bare(file)).find_map(|code| word(&code));
    word.map(|word| format!("it may say something or end the run while it is simulated: `{word}`"))
}

/// Returns why files of Verilog may mean something else to Yosys than to Verilator; `None` if no word of them does.
pub(super) fn in_text(files: &[String]) -> Option<String> {
    let codes: Vec<_> = files.iter().map(|file| bare(file)).collect();
    let otherwise = |what: &str| Some(format!("Yosys may read it otherwise than Verilator: {what}"));
    for (file, code) in files.iter().zip(&codes) {
        if let Some((_, word)) = words(code).find(|(_, word)| lists(OTHERWISE, word)) {
            return otherwise(&format!("`{word}`"));
        }
        let lower = file.to_ascii_lowercase();
        if let Some(word) = BELIEVED.split(' ').find(|word| lower.contains(word)) {
            return otherwise(&format!("`{word}`"));
        }
        if code.contains("``") {
            return otherwise("a macro that joins words");
        }
        if let Some(attribute) = code.split("(*").skip(1).find_map(attribute_in) {
            return otherwise(&format!("the attribute `{attribute}`"));
        }
    }
    if let Some(amount) = codes.iter().flat_map(|code| shifts(code)).find(|amount| is_great(amount)) {
        return otherwise(&format!("a shift by `{amount}`"));
    }
    let looped = codes.iter().find_map(|code| loop_in(code, &codes));
    looped.and_then(|header| otherwise(&format!("the variable of the loop `for ({header})`")))
}

/// Returns an attribute that may change the logic, from the text behind its opening; `@(*)` has none.
fn attribute_in(text: &str) -> Option<&str> {
    if text.trim_start().starts_with(')') {
        return None;
    }
    let (inside, _) = text.split_once("*)").unwrap_or((text, ""));
    let names = inside.split(',').map(|one| one.split('=').next().unwrap_or_default().trim());
    names.into_iter().find(|name| !lists(PLAIN, &name.to_ascii_lowercase()))
}

/// Returns the first words of all amounts of shifts, with a sign before them.
fn shifts(code: &str) -> Vec<&str> {
    let amount = |(at, _): (usize, &str)| {
        let rest = code[at..].trim_start_matches(['<', '>']).trim_start_matches([' ', '\t', '\n', '\r', '(', '{', '+']);
        let is_part = |c: char| c.is_ascii_alphanumeric() || "_$'-".contains(c);
        &rest[..rest.find(|c| !is_part(c)).unwrap_or(rest.len())]
    };
    code.match_indices("<<").chain(code.match_indices(">>")).map(amount).collect()
}

/// Returns whether an amount is negative, or a number of more than 16 bits.
fn is_great(amount: &str) -> bool {
    let digits = amount.split_once('\'').map_or(amount, |(_, digits)| digits).to_ascii_lowercase().replace('_', "");
    let is_number = amount.starts_with(|c: char| c.is_ascii_digit() || c == '\'');
    let (radix, digits) = match digits.strip_prefix('s').unwrap_or(&digits).split_at_checked(1) {
        Some(("h", digits)) => (16, digits),
        Some(("b", digits)) => (2, digits),
        Some(("o", digits)) => (8, digits),
        Some(("d", digits)) => (10, digits),
        _ => (10, &*digits),
    };
    let is_signed = amount.contains("'s") || amount.contains("'S");
    amount.starts_with('-')
        || is_number && (is_signed || !u64::from_str_radix(digits, radix).is_ok_and(|word| word < 1 << 16))
}

/// Returns the header of a loop whose variable may have another width or sign in Yosys than it is declared with.
fn loop_in<'c>(code: &'c str, all: &[String]) -> Option<&'c str> {
    let headers = words(code).filter(|(_, word)| *word == "for").map(|(at, _)| {
        let rest = code[at + 3..].trim_start();
        let Some(rest) = rest.strip_prefix('(') else { return "" };
        let mut depth = 1;
        let end = rest.find(|c: char| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth == 0
        });
        &rest[..end.unwrap_or(rest.len())]
    });
    headers.into_iter().find(|header| !counts(header, all))
}

/// Returns whether the header of a loop lets a 32-bit integer count from an unsized number by unsized numbers.
fn counts(header: &str, all: &[String]) -> bool {
    let parts: Vec<_> = header.split(';').collect();
    let [first, _, step] = parts[..] else { return false };
    let is_number = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_digit());
    let Some((declared, value)) = first.split_once('=') else { return false };
    let declared: Vec<_> = declared.split_whitespace().collect();
    let (name, is_integer) = match declared[..] {
        [kind, name] if lists(INTEGERS, kind) => (name, true),
        [name] => (name, is_integer(name, all)),
        _ => return false,
    };
    let step: String = step.chars().filter(|c| !c.is_whitespace()).collect();
    let Some(step) = step.strip_prefix(name).or(step.strip_suffix(name)) else { return false };
    let by = ["=", ""].iter().find_map(|assigned| {
        let rest = step.strip_prefix(assigned)?.trim_start_matches(if assigned.is_empty() { "" } else { name });
        rest.strip_prefix("+=").or(rest.strip_prefix("-=")).or(rest.strip_prefix('+')).or(rest.strip_prefix('-'))
    });
    is_integer && is_number(value.trim()) && by.is_some_and(|by| is_number(by) || by == "+" || by == "-")
}

/// Returns whether all declarations of a name in the files are those of integers of 32 bits. Calls of a function of
/// this name are no declarations.
fn is_integer(name: &str, all: &[String]) -> bool {
    let (mut is_one, mut is_other) = (false, false);
    for statement in all.iter().flat_map(|code| code.split(';')) {
        let is_called = |(at, word): &(usize, &str)| statement[at + word.len()..].trim_start().starts_with('(');
        let of: Vec<_> =
            words(statement).filter(|one| one.1 != name || !is_called(one)).map(|(_, word)| word).collect();
        if of.contains(&name) {
            is_one |= of.iter().any(|word| lists(INTEGERS, word));
            is_other |= of.iter().any(|word| lists(NARROW, word));
        }
    }
    is_one && !is_other
}

/// The words that a process reads and assigns, in their order.
#[derive(Default)]
struct Process<'x> {
    is_clocked: bool,
    /// Whether it waits for changes of words.
    waits: bool,
    sensitive: BTreeSet<&'x str>,
    /// Its words, one for each place.
    words: Vec<&'x str>,
    /// The words that it assigns at once, and those of them that it assigns before it reads them.
    assigned: BTreeSet<&'x str>,
    fresh: BTreeSet<&'x str>,
}

impl<'x> Process<'x> {
    fn read(tree: &Tree<'x>, at: usize) -> Self {
        let mut process = Self::default();
        let parts = tree.parts(at);
        for item in parts.iter().filter(|part| tree.nodes[**part].tag == "sentree").flat_map(|part| tree.parts(*part)) {
            let is_edge = tree.nodes[item].get("edgeType").is_some_and(|kind| ["POS", "NEG"].contains(&kind));
            process.is_clocked |= is_edge;
            process.waits |= !is_edge;
            process.sensitive.extend(tree.words(item));
        }
        for &part in parts.iter().filter(|part| tree.nodes[**part].tag != "sentree") {
            process.words.extend(tree.words(part));
            let all = std::iter::once(part).chain(tree.within(part));
            for assignment in all.filter(|at| tree.nodes[*at].tag == "assign") {
                let before: Vec<_> = (part..assignment).filter(|at| tree.nodes[*at].tag == "varref").collect();
                for name in tree.target(assignment) {
                    process.assigned.insert(name);
                    let is_read = |at: &usize| tree.nodes[*at].get("name") == Some(name);
                    let own = tree.words(assignment).filter(|word| *word == name).count();
                    if own == 1 && !before.iter().any(is_read) {
                        process.fresh.insert(name);
                    }
                }
            }
        }
        process
    }
}

/// Returns why the processes of a design may depend on the order in which a simulator runs them, or wait for other
/// words than they read, from Verilator's XML of it.
pub(super) fn in_order(xml: &str) -> Option<String> {
    let tree = Tree::read(xml);
    let modules = (0..tree.nodes.len()).filter(|at| tree.nodes[*at].tag == "module");
    modules.into_iter().find_map(|module| raced(&tree, module))
}

/// Returns what Debian's Yosys is known to get wrong of a design, from Verilator's XML of it and its files.
pub(super) fn in_design(xml: &str, files: &[String]) -> Option<String> {
    let tree = Tree::read(xml);
    // Verilator has computed what constants make, so a shift by one of them may be none any more.
    let constants = (0..tree.nodes.len()).filter(|at| tree.nodes[*at].tag == "var");
    let is_great = |var: &usize| {
        let value = tree.parts(*var).into_iter().map(|part| &tree.nodes[part]).find(|node| node.tag == "const");
        value.is_some_and(|node| constant(node).is_none_or(|word| word >= 1 << 16))
    };
    let great: BTreeSet<_> = constants.filter(is_great).filter_map(|var| tree.nodes[var].get("name")).collect();
    let codes: Vec<_> = files.iter().map(|file| bare(file)).collect();
    if let Some(amount) = codes.iter().flat_map(|code| shifts(code)).find(|amount| great.contains(amount)) {
        return Some(format!("Yosys may read it otherwise than Verilator: a shift by `{amount}`"));
    }
    let modules = (0..tree.nodes.len()).filter(|at| tree.nodes[*at].tag == "module");
    modules.into_iter().find_map(|module| wrong(&tree, module))
}

/// Returns why the processes of a module may depend on their order, or wait for other words than they read.
fn raced(tree: &Tree, module: usize) -> Option<String> {
    let is_top = tree.nodes[module].get("topModule").is_some();
    let named = |at: &usize| tree.nodes[*at].get("name");
    let vars = || tree.within(module).filter(|at| tree.nodes[*at].tag == "var");
    let outputs: BTreeSet<_> =
        vars().filter(|at| tree.nodes[*at].get("dir") == Some("output")).filter_map(|at| named(&at)).collect();
    let integers = integers(tree, module);
    let (mut processes, mut elsewhere) = (Vec::new(), BTreeSet::new());
    for part in tree.parts(module) {
        match tree.nodes[part].tag {
            "always" => processes.push(Process::read(tree, part)),
            "initial" => {}
            _ => elsewhere.extend(tree.words(part)),
        }
    }
    for (at, process) in processes.iter().enumerate() {
        let is_seen = |name: &&&str| {
            let reads = |other: &Process| {
                let is_counter = integers.contains(**name) && other.fresh.contains(**name);
                other.sensitive.contains(**name) || other.words.contains(name) && !is_counter
            };
            let mut others = processes.iter().enumerate().filter(|(other, _)| *other != at);
            let is_passed_on = outputs.contains(**name) && !is_top;
            is_passed_on || elsewhere.contains(**name) || others.any(|(_, other)| reads(other))
        };
        if process.is_clocked
            && let Some(name) = process.assigned.iter().find(is_seen)
        {
            return Some(format!("a clock edge assigns `{name}` at once (`=`), and other processes read it"));
        }
        if process.is_clocked && process.waits {
            return Some("a process waits for a clock edge and for a word".to_string());
        }
        let is_known = |name: &&&str| process.sensitive.contains(**name) || process.assigned.contains(**name);
        if process.waits
            && let Some(name) = process.words.iter().find(|name| !is_known(name))
        {
            return Some(format!("a process reads `{name}`, but does not wait for it"));
        }
    }
    None
}

fn integers<'x>(tree: &Tree<'x>, module: usize) -> BTreeSet<&'x str> {
    let is_integer = |node: &&Node| node.tag == "var" && node.get("vartype").is_some_and(|kind| lists(INTEGERS, kind));
    tree.within(module).map(|at| &tree.nodes[at]).filter(is_integer).filter_map(|node| node.get("name")).collect()
}

/// Returns what a module has that Yosys 0.23 is known to get wrong.
fn wrong(tree: &Tree, module: usize) -> Option<String> {
    let otherwise = |what: &str| Some(format!("Yosys may read it otherwise than Verilator: {what}"));
    let integers = integers(tree, module);
    for at in tree.within(module) {
        match tree.nodes[at].tag {
            "shiftl" | "shiftr" | "shiftrs" => {
                let amount = *tree.parts(at).get(1)?;
                let node = &tree.nodes[amount];
                // The variable of a loop counts by numbers, of which each is seen as it is.
                let is_counter = node.tag == "varref" && node.get("name").is_some_and(|name| integers.contains(name));
                let is_small = match node.tag {
                    "const" => constant(node).is_some_and(|amount| amount < 1 << 16),
                    _ => !tree.is_signed(amount) || is_counter,
                };
                if !is_small {
                    return otherwise("a shift by a signed or great word, which it takes for one to the other side");
                }
            }
            "case" => {
                let parts = tree.parts(at);
                let Some((&selector, items)) = parts.split_first() else { continue };
                let compared = items.iter().filter(|part| tree.nodes[**part].tag == "caseitem");
                let compared = compared.flat_map(|part| tree.parts(*part)).filter(|at| !is_statement(tree, *at));
                let compared: Vec<_> = std::iter::once(selector).chain(compared).collect();
                let is_open = |at: &usize| {
                    let node = &tree.nodes[*at];
                    node.tag == "const" && node.get("name").is_some_and(|name| name.contains(['x', 'z', '?']))
                };
                let is_wider = |at: &usize| tree.nodes[*at].tag.starts_with("extend");
                let is_plain = tree.nodes[selector].tag != "const" && !compared.iter().any(is_wider);
                let is_counted = |at: &usize| std::iter::once(*at).chain(tree.within(*at)).any(|at| tree.is_signed(at));
                if compared.iter().any(is_counted) {
                    return otherwise("a choice by a signed word");
                }
                if !is_plain
                    && compared.iter().any(|at| std::iter::once(*at).chain(tree.within(*at)).any(|at| is_open(&at)))
                {
                    return otherwise("a choice among words of different widths with open bits");
                }
            }
            "assign" | "assigndly" | "contassign" => {
                let parts = tree.parts(at);
                let (Some(&value), Some(&target)) = (parts.first(), parts.last()) else { continue };
                let selects = std::iter::once(target).chain(tree.within(target));
                // A part whose place only the variable of a loop chooses has a place of its own in each round.
                let is_still = |select: usize| {
                    let low = tree.parts(select).get(1).copied();
                    low.is_some_and(|low| tree.words(low).all(|name| integers.contains(name)))
                };
                let mut moving = selects.filter(|at| tree.nodes[*at].tag == "sel" && !is_still(*at));
                let mut of_value = std::iter::once(value).chain(tree.within(value));
                if moving.next().is_some() && of_value.any(|at| tree.is_signed(at)) {
                    return otherwise("a signed word that is assigned to a part of a word");
                }
            }
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{heard, in_order, in_text};

    #[test]
    fn words_that_two_tools_take_otherwise_are_found_in_code_alone() {
        for (verilog, found) in [
            ("assign y = $signed(a) / b; // $display\n", None),
            ("/* assert */ initial $readmemh(\"a // $finish.hex\", m);", None),
            ("wire [$clog2(N)-1:0] asserted = a / 2;", None),
            ("initial s = \"\\\" $stop\"; always @(posedge clk) $display(\"%d\", a);", Some("`$display`")),
            ("// a\nassert property (a);", Some("`assert`")),
            ("if (a / b) $finish;", Some("`$finish`")),
            ("`ifdef SYNTHESIS\n`endif", Some("`SYNTHESIS`")),
            ("unique case (a)", Some("`unique`")),
            ("case (a) // synopsys full_case", Some("`full_case`")),
            ("(* full_case *) case (a)", Some("`full_case`")),
            ("always @(*) y = a; always @( * ) z = a; (* keep, KEEP = \"a\" *) reg q;", None),
            ("(* keep, init = 1 *) reg q;", Some("the attribute `init`")),
            ("`define A(x) $``x", Some("joins words")),
            ("assign y = (a << 3) | (b >>> N) | c <= {8'd12} | d << (e + 1) | f >> 7'h1f;", None),
            ("assign y = a >> -1;", Some("a shift by `-1`")),
            ("assign y = a <<< ({32'hffff_ffff});", Some("a shift by `32'hffff_ffff`")),
            ("assign y = a >> 4'sd3;", Some("a shift by `4'sd3`")),
        ] {
            let files = [verilog.to_string()];
            let said = heard(&files).or_else(|| in_text(&files));
            assert_eq!(said.is_some(), found.is_some(), "{verilog}: {said:?}");
            assert!(found.is_none_or(|found| said.expect("a reason").contains(found)), "{verilog}");
        }
        assert_eq!(heard(&["unique case (a)".to_string()]), None);
    }

    #[test]
    fn loops_count_by_integers_from_unsized_numbers() {
        for (verilog, is_taken) in [
            ("integer i; always @* for (i = 0; i < 8; i = i + 1) m[i] = a;", true),
            ("initial for (int i = 7; i >= 0; i--) m[i] = a;", true),
            ("genvar g; generate for (g=0; g<N; g=g+2) begin end endgenerate", true),
            ("for (genvar g = 0; g < N; ++g) c u();", true),
            ("integer i; for (i = 0; i < (N + 1); i += 3) m[i] = a;", true),
            ("reg [2:0] i; for (i = 0; i < 7; i = i + 1) m[i] = {5'd3, i};", false),
            ("integer i; for (i = 4'd0; i < 8; i = i + 1) m[i] = a;", false),
            ("integer i; for (i = 0; i < 8; i = i + 1'b1) m[i] = a;", false),
            ("integer i; for (i = 0; i < 8; i = i + N) m[i] = a;", false),
            ("integer i; for (i = N - 1; i > 0; i = i - 1) m[i] = a;", false),
            ("integer i; for (i = 1; i < 8; i = i << 1) m[i] = a;", false),
            ("integer i; for (i = 1; i < 8; i = i * 2) m[i] = a;", false),
            ("integer i; function [1:0] f(input [1:0] i); endfunction for (i = 0; i < 8; i = i + 1) m[i] = a;", false),
            (
                "function integer f; input integer v; for (f = 0; v > 0; f = f + 1) v = v >> 1; endfunction
              localparam N = f(8); reg [f(N)-1:0] a;",
                true,
            ),
            ("function integer f; endfunction wire [f (8):0] f; for (f = 0; f < 8; f = f + 1) m[f] = a;", false),
            ("function [3:0] f; input [3:0] v; for (f = 0; v > 0; f = f + 1) v = v >> 1; endfunction", false),
            ("for (i = 0; i < 8; i = i + 1) m[i] = a;", false),
            ("for", false),
        ] {
            let said = in_text(&[verilog.to_string()]);
            assert_eq!(said.is_none(), is_taken, "{verilog}: {said:?}");
        }
    }

    /// The parts of Verilator's XML that tell of processes.
    #[test]
    fn processes_that_depend_on_their_order_are_named() {
        let var = |name: &str| format!("<varref name=\"{name}\"/>");
        let always = |edge: &str, name: &str, inside: &str| {
            let item = format!("<senitem edgeType=\"{edge}\">\n          {}\n        </senitem>", var(name));
            format!("    <always>\n      <sentree>\n        {item}\n      </sentree>\n{inside}    </always>\n")
        };
        let assign = |from: &str, to: &str| {
            format!("      <assign>\n        {}\n        {}\n      </assign>\n", var(from), var(to))
        };
        let module = |body: &str| {
            let head = "<var name=\"o\" dir=\"output\"/>\n    <var name=\"i\" vartype=\"integer\"/>";
            format!("  <module name=\"t\" topModule=\"1\">\n    {head}\n{body}  </module>\n")
        };
        let (c, clk) = (assign("a", "c"), "clk");
        let said = |body: &str| in_order(&module(body));
        assert_eq!(said(&always("POS", clk, &(c.clone() + &assign("c", "o")))), None);
        let two = always("POS", clk, &c) + &always("POS", clk, &assign("c", "o"));
        assert!(said(&two).is_some_and(|said| said.contains("`c`")), "{two}");
        let read = always("NEG", clk, &c) + "    <contassign>\n      <varref name=\"c\"/>\n    </contassign>\n";
        assert!(said(&read).is_some_and(|said| said.contains("`c`")));
        let counted = assign("a", "i") + &assign("i", "d");
        assert_eq!(said(&(always("POS", clk, &counted) + &always("POS", clk, &assign("b", "i")))), None);
        assert!(said(&(always("POS", clk, &counted) + &always("POS", clk, &assign("i", "b")))).is_some());
        assert_eq!(said(&always("CHANGED", "a", &c)), None);
        assert!(said(&always("CHANGED", "b", &c)).is_some_and(|said| said.contains("`a`")));
        assert_eq!(said(&(always("POS", clk, &c) + "    <initial>\n" + &assign("a", "c") + "    </initial>\n")), None);
        let inner = module(&always("POS", clk, &assign("a", "o"))).replace(" topModule=\"1\"", "");
        assert!(in_order(&inner).is_some_and(|said| said.contains("`o`")));
    }
}
