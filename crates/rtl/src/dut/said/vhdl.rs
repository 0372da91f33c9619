//! Assertions of VHDL that Verilator simulates.
//!
//! GHDL's synthesis writes an assertion as a process that ends the simulation while a net is 0, behind the place of the
//! statement in a comment. Severity and text are lost. Here the process becomes one that prints both, as the source has
//! them, at the clock edge at which the assertion fails. Parts of a text that only a simulation can compute stay in it
//! as they are written, in braces.
//!
//! Synthesis leaves `report` out. So it gets `assert false report`, which means the same.

use std::collections::BTreeMap;

use hpu_cosim::dut::Severity;

use super::severity;

/// The most characters of a text.
const LONGEST: usize = 400;
/// The name, before its number, of a message that is not yet put into the Verilog.
const MARK: &str = "$hpu_said_";

/// A part of a VHDL text.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// A word or a number.
    Word,
    /// A string, with its quotes.
    Text,
    /// Another character, or a character between ticks.
    Other,
}

type Token<'t> = (usize, Kind, &'t str);

/// Returns the parts of a text from a position on, without comments and blanks.
fn tokens(text: &str, from: usize) -> impl Iterator<Item = Token<'_>> {
    let bytes = text.as_bytes();
    let (mut at, mut after_word) = (from, false);
    let end_of = |at: usize, end: &str, skip: usize| {
        let found = text.get(at..).and_then(|rest| rest.find(end));
        found.map_or(text.len(), |length| at + length + skip)
    };
    std::iter::from_fn(move || {
        loop {
            let rest = text.get(at..)?;
            let first = rest.chars().next()?;
            let (begin, is_name) = (at, |c: char| c.is_alphanumeric() || c == '_');
            if first.is_whitespace() {
                at += first.len_utf8();
                continue;
            }
            if rest.starts_with("--") {
                at = end_of(at, "\n", 0);
                continue;
            }
            if rest.starts_with("/*") {
                at = end_of(at + 2, "*/", 2).min(text.len());
                continue;
            }
            let kind = if first == '"' {
                at += 1;
                // Two quotes are one quote of the text.
                loop {
                    at = end_of(at, "\"", 1);
                    if bytes.get(at) != Some(&b'"') {
                        break;
                    }
                    at += 1;
                }
                Kind::Text
            } else if first == '\\' {
                at = end_of(at + 1, "\\", 1);
                Kind::Word
            } else if is_name(first) {
                at += rest.find(|c| !is_name(c)).unwrap_or(rest.len());
                Kind::Word
            } else if first == '\'' && !after_word && rest.chars().nth(2) == Some('\'') {
                at += rest.chars().take(3).map(char::len_utf8).sum::<usize>();
                Kind::Other
            } else {
                at += first.len_utf8();
                Kind::Other
            };
            let part = &text[begin..at];
            after_word = kind == Kind::Word || [")", "]"].contains(&part);
            return Some((begin, kind, part));
        }
    })
}

fn is(token: &Token, word: &str) -> bool {
    token.1 == Kind::Word && token.2.eq_ignore_ascii_case(word)
}

/// Returns a text in which each statement `report` is an assertion that always fails; `None` if it has no such
/// statement. Lines stay lines.
pub(in crate::dut) fn with_reports_asserted(text: &str) -> Option<String> {
    let (mut made, mut done, mut in_assert) = (String::new(), 0, false);
    for token in tokens(text, 0) {
        if is(&token, "assert") {
            in_assert = true;
        } else if token.2 == ";" {
            in_assert = false;
        } else if is(&token, "report") && !in_assert {
            made += &text[done..token.0];
            made += "assert false ";
            done = token.0;
        }
    }
    (done > 0).then(|| made + &text[done..])
}

/// What an assertion says.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Statement {
    severity: Severity,
    text: String,
}

/// Reads the assertion that begins in a line and a column, both counted from 1, with its label if it has one.
fn statement(text: &str, line: usize, column: usize) -> Option<Statement> {
    let begin: usize = text.split_inclusive('\n').take(line - 1).map(str::len).sum();
    // GHDL counts bytes, and a tab up to the next multiple of 8.
    let mut at = 0;
    let before = text.as_bytes()[begin..].iter().take_while(|byte| {
        let is_before = at + 1 < column && **byte != b'\n';
        at = if **byte == b'\t' { (at / 8 + 1) * 8 } else { at + 1 };
        is_before
    });
    let from = begin + before.count();
    let from = if text.is_char_boundary(from) { from } else { begin };
    let mut all = tokens(text, from).skip_while(|token| !is(token, "assert") && token.2 != ";");
    all.next().filter(|token| is(token, "assert"))?;
    let parts: Vec<_> = all.take_while(|token| token.2 != ";").collect();
    let [report, severe] = ["report", "severity"].map(|word| parts.iter().position(|token| is(token, word)));
    let level = severe.and_then(|at| severity(parts.get(at + 1)?.2)).unwrap_or(Severity::Error);
    let told = report.map_or(&[][..], |at| &parts[at + 1..severe.filter(|end| *end > at).unwrap_or(parts.len())]);
    let told = if told.is_empty() { "Assertion violation".to_string() } else { spoken(text, told) };
    Some(Statement { severity: level, text: told })
}

/// Returns a text that strings and other expressions make up: strings as they are, other expressions in braces.
fn spoken(source: &str, parts: &[Token]) -> String {
    let (mut depth, mut said) = (0i32, String::new());
    let is_joint = |token: &Token| {
        depth += i32::from(token.2 == "(") - i32::from(token.2 == ")");
        depth == 0 && token.2 == "&"
    };
    for operand in parts.split(is_joint) {
        match operand {
            [] => {}
            [(_, Kind::Text, text)] => {
                let within = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
                said += &within.replace("\"\"", "\"");
            }
            [(begin, ..), ..] => {
                let (end, _, last) = operand[operand.len() - 1];
                let words = source[*begin..end + last.len()].split_whitespace().collect::<Vec<_>>().join(" ");
                said += &format!("{{{words}}}");
            }
        }
    }
    said
}

/// The Verilog of a synthesis whose assertions are told.
pub(in crate::dut) struct Told {
    /// The Verilog, with a mark for each message: a system task without a text.
    pub(in crate::dut) verilog: String,
    /// The message of each mark.
    messages: Vec<String>,
}

/// Replaces the assertions of GHDL's synthesis by marks for messages. `files` has the files as they were synthesised.
/// `said` is what GHDL has said meanwhile: assertions that fail whatever the inputs are.
///
/// Returns `None` where the synthesis has written an assertion in another form.
pub(in crate::dut) fn told(verilog: &str, said: &str, files: &BTreeMap<String, String>) -> Option<Told> {
    let mut lines: Vec<String> = verilog.lines().map(str::to_string).collect();
    let (mut messages, mut clocked, mut is_left) = (Vec::new(), BTreeMap::new(), false);
    let is_begin = |line: &str| line.starts_with("module ");
    let mut module = 0;
    let net = |line: &str| Some(line.trim().strip_prefix("if (!")?.strip_suffix(')')?.to_string());
    for at in 0..lines.len() {
        module += usize::from(is_begin(&lines[at]));
        if !lines[at].contains("\"assertion failure ") {
            is_left |= lines[at].trim_start().starts_with("assert");
            continue;
        }
        let fatal = lines[at].trim_start().starts_with("$fatal(1, ") && at >= 2;
        let net = fatal.then(|| net(&lines[at - 1])).flatten()?;
        let place = at.checked_sub(3).and_then(|at| comment(&lines[at])).unwrap_or(("", 0, 0));
        let mark = format!("{MARK}{};", messages.len());
        messages.push(message(place, files));
        if net.ends_with("_q") {
            // The net is a register that the clock sets by the condition.
            (at - 2..=at).for_each(|line| lines[line].clear());
            clocked.insert((module, net), mark);
        } else {
            lines[at] = format!("      {mark}");
        }
    }
    if is_left {
        return None;
    }
    module = 0;
    for line in &mut lines {
        module += usize::from(is_begin(line));
        let Some((net, condition)) = line.trim().strip_suffix(';').and_then(|line| line.split_once(" <= ")) else {
            continue;
        };
        if condition != "1'b1"
            && let Some(mark) = clocked.get(&(module, net.to_string()))
        {
            *line = format!("      begin {net} <= {condition}; if (!({condition})) {mark} end");
        }
    }
    let early: Vec<_> = said.lines().filter_map(super::always).collect();
    if let Some(last) = lines.iter().rposition(|line| line.trim() == "endmodule") {
        for (severity, (file, row), text) in early {
            lines.insert(last, format!("  initial {MARK}{};", messages.len()));
            messages.push(printed(severity, &format!("{file}:{row}"), text));
        }
    }
    Some(Told { verilog: lines.join("\n") + "\n", messages })
}

impl Told {
    /// Returns Verilog, made from that with marks, with the messages in their place.
    pub(in crate::dut) fn spoken(&self, verilog: &str) -> String {
        let mut parts = verilog.split(MARK);
        let mut text = parts.next().unwrap_or_default().to_string();
        for part in parts {
            let (number, rest) = part.split_once(';').unwrap_or((part, ""));
            text += number.parse::<usize>().ok().and_then(|number| self.messages.get(number)).map_or("", |said| said);
            text += rest;
        }
        text
    }
}

/// Reads file, line and column of a comment such as `/* t.vhd:6:3  */`.
fn comment(line: &str) -> Option<(&str, usize, usize)> {
    let place = line.trim().strip_prefix("/* ")?.strip_suffix("*/")?.trim();
    let (place, column) = place.rsplit_once(':')?;
    let (file, row) = place.rsplit_once(':')?;
    Some((file, row.parse().ok().filter(|row| *row > 0)?, column.parse().ok()?))
}

/// Returns the statement of Verilog that prints what the assertion at a place says.
fn message((file, line, column): (&str, usize, usize), files: &BTreeMap<String, String>) -> String {
    let found = files.get(file).and_then(|text| statement(text, line, column));
    let unknown = || Statement { severity: Severity::Error, text: "Assertion violation".to_string() };
    let Statement { severity, text } = found.unwrap_or_else(unknown);
    printed(severity, &format!("{file}:{line}"), &text)
}

fn printed(severity: Severity, place: &str, text: &str) -> String {
    let tag = match severity {
        Severity::Note => "-Info",
        Severity::Warning => "%%Warning",
        Severity::Error => "%%Error",
        Severity::Failure => "%%Fatal",
    };
    let end = if severity == Severity::Failure { " $finish;" } else { "" };
    let [place, text] = [place, text].map(quotable);
    format!("begin $display(\"{tag}: {place}: {text}\");{end} end")
}

/// Returns a text as Verilog prints it from a string.
fn quotable(text: &str) -> String {
    let mut made = String::new();
    for c in text.chars().take(LONGEST) {
        match c {
            '%' => made += "%%",
            '"' | '\\' => made.extend(['\\', c]),
            ' '..='~' => made.push(c),
            _ => made.push(if c.is_whitespace() { ' ' } else { '?' }),
        }
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_becomes_an_assertion_and_an_assertion_stays() {
        let text =
            "if n = 5 then\n  report \"report it\" severity error; -- report\nend if;\nassert c\n  report \"x\";\n";
        let made = text.replace("  report \"report it\"", "  assert false report \"report it\"");
        assert_eq!(with_reports_asserted(text), Some(made));
        assert_eq!(with_reports_asserted("assert c report \"report\"; -- it reports"), None);
    }

    #[test]
    fn statements_say_their_severity_and_their_text() {
        let text = "  lab: assert n(3 downto 0) /= ';' -- severity note;\n report \"a \"\"b\"\"\" & \" 100%\" & \
                    integer'image(f( n ))\n & \" end\" severity Warning;\n/* é */ assert false; assert x \
                    severity failure;";
        let of = |line, column| statement(text, line, column).map(|said| (said.severity, said.text));
        let first = "a \"b\" 100%{integer'image(f( n ))} end".to_string();
        assert_eq!(of(1, 3), Some((Severity::Warning, first.clone())));
        assert_eq!(of(1, 8), Some((Severity::Warning, first)));
        assert_eq!(of(4, 10), Some((Severity::Error, "Assertion violation".to_string())));
        assert_eq!(of(4, 24), Some((Severity::Failure, "Assertion violation".to_string())));
        let tabs = statement("\t\tassert a; \tassert b severity note;", 1, 33);
        assert_eq!(tabs.map(|said| said.severity), Some(Severity::Note));
        assert_eq!(of(3, 3), None, "no assertion begins there");
        assert_eq!(quotable("a \"b\" 100%\\\n\u{e9}"), "a \\\"b\\\" 100%%\\\\ ?");
    }

    /// What GHDL 2.0 writes of an assertion in a clocked process and of one beside it.
    const SYNTHESISED: &str = "module t\n  /* t.vhd:2:3  */\n  always @*\n    if (!n54_q)\n      $fatal(1, \"assertion \
                               failure n21\");\n  /* t.vhd:1:1  */\n  always @(posedge clk)\n    n54_q <= n20_o;\n  \
                               initial\n    n54_q <= 1'b1;\n  /* t.vhd:3:1  */\n  always @*\n    if (!n56_o)\n      \
                               $fatal(1, \"assertion failure lab\");\nendmodule\n";

    #[test]
    fn assertions_speak_at_the_edge_that_samples_them() {
        let source = "process\n  assert a report \"large\" severity warning;\nlab: assert b severity failure;\n";
        let files = BTreeMap::from([("t.vhd".to_string(), source.to_string())]);
        let said = "t.vhd:9:2:(assertion note): wide\n";
        let told = told(SYNTHESISED, said, &files).expect("a known form");
        let verilog = told.spoken(&told.verilog);
        let large = "begin $display(\"%%Warning: t.vhd:2: large\"); end";
        assert!(verilog.contains(&format!("begin n54_q <= n20_o; if (!(n20_o)) {large} end")), "{verilog}");
        let violated = "begin $display(\"%%Fatal: t.vhd:3: Assertion violation\"); $finish; end";
        assert!(verilog.contains(&format!("if (!n56_o)\n      {violated}")), "{verilog}");
        let wide = "initial begin $display(\"-Info: t.vhd:9: wide\"); end\nendmodule";
        assert!(verilog.contains(wide) && !verilog.contains("$fatal") && !verilog.contains("$hpu"), "{verilog}");
        assert!(super::told("assert (n1);", "", &files).is_none(), "another form");
    }
}
