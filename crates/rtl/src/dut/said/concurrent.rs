//! Concurrent assertions of SystemVerilog that Verilator does not read: those are taken out of the design, so that the
//! design runs without them.

use std::ops::Range;

/// The statements that begin a concurrent assertion, before `property` or `sequence`.
const CHECKS: [&str; 4] = ["assert", "assume", "cover", "restrict"];

/// Returns the parts of a text, with their places: words with their digits, `_` and `$`, and single characters. Strings
/// and comments are left out.
fn tokens(text: &str) -> Vec<(usize, &str)> {
    let (mut all, mut at) = (Vec::new(), 0);
    let is_name = |c: char| c.is_alphanumeric() || "_$`".contains(c);
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let first = rest.chars().next().unwrap_or_default();
        let length = if first == '"' {
            let mut escaped = true;
            let end = rest.find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            end.map_or(rest.len(), |end| end + 1)
        } else if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else {
            let length = rest.find(|c| !is_name(c)).unwrap_or(rest.len()).max(first.len_utf8());
            if !first.is_whitespace() {
                all.push((at, &rest[..length]));
            }
            length
        };
        at += length;
    }
    all
}

/// Returns the places of all concurrent assertions in a text, and of the properties and sequences that it declares.
fn statements(text: &str) -> Vec<Range<usize>> {
    let all = tokens(text);
    let word = |index: usize| all.get(index).map_or("", |(_, word)| *word);
    let end = |index: usize| all.get(index).map_or(text.len(), |(at, word)| at + word.len());
    let (mut found, mut at) = (Vec::new(), 0);
    while at < all.len() {
        let begin = at;
        let last = if CHECKS.contains(&word(at)) && ["property", "sequence"].contains(&word(at + 1)) {
            Some(action(&all, at + 2))
        } else if ["property", "sequence"].contains(&word(at)) {
            let closing = format!("end{}", word(at));
            (at..all.len()).find(|at| word(*at) == closing)
        } else {
            None
        };
        at += 1;
        if let Some(last) = last {
            // A label stands before it.
            let first = if begin >= 2 && word(begin - 1) == ":" { begin - 2 } else { begin };
            found.push(all[first].0..end(last));
            at = last + 1;
        }
    }
    found
}

/// Returns the last part of a concurrent assertion whose condition begins at a part: that of its action, or of the
/// action behind `else`.
fn action(all: &[(usize, &str)], condition: usize) -> usize {
    let word = |index: usize| all.get(index).map_or("", |(_, word)| *word);
    let mut depth = 0;
    let mut at = condition;
    while at < all.len() {
        depth += i32::from(word(at) == "(") - i32::from(word(at) == ")");
        at += 1;
        if depth == 0 {
            break;
        }
    }
    loop {
        if word(at) == "else" {
            at += 1;
        }
        let mut blocks = 0;
        while at < all.len() {
            blocks += i32::from(word(at) == "begin") - i32::from(word(at) == "end");
            if blocks == 0 && [";", "end"].contains(&word(at)) {
                break;
            }
            at += 1;
        }
        if word(at + 1) != "else" {
            return at.min(all.len().saturating_sub(1));
        }
        at += 1;
    }
}

/// Takes the concurrent assertions at these lines out of a text, whose other lines stay where they are. Returns the
/// text, and the line of each with the beginning of the statement; `None` if no line has one.
pub(in crate::dut) fn without(text: &str, lines: &[usize]) -> Option<(String, Vec<(usize, String)>)> {
    let line_of = |at: usize| 1 + text[..at].matches('\n').count();
    let (mut made, mut done, mut taken) = (String::new(), 0, Vec::new());
    for range in statements(text) {
        let (first, last) = (line_of(range.start), line_of(range.end));
        if !lines.iter().any(|line| (first..=last).contains(line)) {
            continue;
        }
        let statement = &text[range.clone()];
        taken.push((first, statement.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(60).collect()));
        made += &text[done..range.start];
        made.push(';');
        made.extend(statement.chars().filter(|c| *c == '\n'));
        done = range.end;
    }
    (!taken.is_empty()).then(|| (made + &text[done..], taken))
}

/// Returns the files and lines of the errors that Verilator has told, as in `%Error-UNSUPPORTED: t.sv:16:43: …`.
pub(in crate::dut) fn errors(said: &str) -> impl Iterator<Item = (&str, usize)> {
    let place = |line: &'_ str| -> Option<(usize, usize, usize)> {
        let at = line.strip_prefix("%Error").and(line.find(": "))? + 2;
        let end = line[at..].find(':')? + at;
        let row = line[end + 1..].split(':').next()?.parse().ok()?;
        Some((at, end, row))
    };
    said.lines().filter_map(move |line| place(line).map(|(at, end, row)| (&line[at..end], row)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DESIGN: &str = "module t;\n// assert property (a);\nalways @(posedge clk) assert (a) else $error(\"no; \
                          end\");\np1: assert property (@(posedge clk) a |-> ##1 b)\n  begin $info(\"; end\"); \
                          end else $error(\"late\");\nproperty late; @(posedge clk) a ##1 b; endproperty\n\
                          cover property (late);\nassign x = y;\nendmodule\n";

    #[test]
    fn concurrent_assertions_are_taken_out_whole_and_lines_stay() {
        let (text, taken) = without(DESIGN, &[5]).expect("an assertion");
        assert_eq!(text.matches('\n').count(), DESIGN.matches('\n').count());
        assert!(!text.contains("p1") && !text.contains("late\");") && text.contains("\nproperty late;"), "{text}");
        assert_eq!(taken.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [4]);
        assert!(taken[0].1.starts_with("p1: assert property (@(posedge clk) a |-> ##1 b)"), "{}", taken[0].1);
        let (text, taken) = without(DESIGN, &[4, 6, 7]).expect("assertions");
        assert_eq!(taken.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [4, 6, 7]);
        assert!(text.contains("assert (a) else $error(\"no; end\");") && text.contains("assign x = y;"), "{text}");
        assert!(without(DESIGN, &[1, 2, 3, 8]).is_none());
    }

    #[test]
    fn places_of_errors_are_read() {
        let said = "%Error-UNSUPPORTED: t.sv:16:43: Unsupported: ##\n   16 | p1\n%Warning-X: t.sv:1:1: x\n\
                    %Error: Exiting\n%Error: t.sv:20:5: syntax error\n";
        assert_eq!(errors(said).collect::<Vec<_>>(), [("t.sv", 16), ("t.sv", 20)]);
    }
}
