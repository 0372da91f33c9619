//! The equations of a VHDL header as MathML, which browsers show without a script; `pulldown_latex` writes it.
//!
//! A header holds prose, which begins in the first column, and runs of indented lines. A run is typeset when it begins
//! with an equation and each further line can be read: as an equation, as a case or a condition of the equation above
//! it, or as words between equations. Any other run (a drawing, a table, a list) stays text.

use pulldown_latex::{Parser, RenderConfig, Storage, push_mathml};

use crate::header::{cell, unindented};

/// Returns the equations of a header as Markdown: prose as paragraphs, runs of equations as tables of MathML, other
/// runs as text blocks. A table keeps its lines as they are written in `aria-label`, for screen readers.
pub fn typeset(equations: &str) -> String {
    // A line of prose may end in an equation: `At a sample edge:  q := d`.
    let spread = equations.lines().map(|line| match line.split_once(":  ") {
        Some((prose, equation)) if !line.starts_with(' ') => format!("{prose}:\n  {equation}"),
        _ => line.to_string(),
    });
    let spread = spread.collect::<Vec<_>>().join("\n");
    let lines: Vec<&str> = spread.lines().collect();
    // A table may begin in the first column.
    let is_run = |line: &str| line.starts_with(' ') || line.contains("  ");
    let is_one = |line: &&str, next: &&str| !line.is_empty() && !next.is_empty() && is_run(line) == is_run(next);
    let parts = lines.chunk_by(is_one).filter(|part| !part[0].is_empty());
    let parts = parts.map(|part| match (is_run(part[0]), table(part)) {
        (false, _) => format!("{}\n", cell(&part.join(" "))),
        (true, Some(table)) => table,
        (true, None) => format!("```text\n{}\n```\n", unindented(&part.join("\n"))),
    });
    parts.collect::<Vec<_>>().join("\n")
}

/// Returns a run as a table: names, relation, right side, conditions. Returns `None` when a line is no equation. The
/// table is on one line, because Markdown ends HTML at an empty one.
fn table(run: &[&str]) -> Option<String> {
    let mut rows = String::new();
    // Where the right side of the equation above begins.
    let mut right = None;
    for line in run {
        let text = line.trim_start();
        let begin = line.len() - text.len();
        let named = defined(text);
        rows += &match (named, right) {
            (_, Some(right)) if begin >= right => {
                let gap = if begin > right { "<td></td>" } else { "" };
                format!("<tr><td></td><td></td>{gap}{}</tr>", columns(text)?)
            }
            (Some((left, relation, value)), _) => {
                right = Some(line.len() - value.len());
                format!("<tr><td>{}</td><td>{}</td>{}</tr>", math(left)?, math(relation)?, columns(value)?)
            }
            // A run that begins with words is no run of equations.
            (None, Some(_)) if !text.contains("  ") => format!("<tr><td colspan=\"4\">{}</td></tr>", math(text)?),
            _ => return None,
        };
    }
    let escapes = [('&', "&amp;"), ('<', "&lt;"), ('>', "&gt;"), ('"', "&quot;"), ('\n', "&#10;")];
    let text = escapes.iter().fold(unindented(&run.join("\n")), |text, (sign, shown)| text.replace(*sign, shown));
    Some(format!("<div class=\"equations\"><table role=\"math\" aria-label=\"{text}\">{rows}</table></div>\n"))
}

/// Returns the names that a line defines, the relation, and what they are; `None` when it defines none.
fn defined(line: &str) -> Option<(&str, &str, &str)> {
    let relations = [" := ", " = ", " <= "].into_iter().filter_map(|sign| Some((line.find(sign)?, sign)));
    let (at, sign) = relations.min()?;
    let (left, value) = (line[..at].trim_end(), line[at + sign.len()..].trim_start());
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || "_'^()-, ".contains(letter);
    // Only what is assigned may have a name of two words.
    let is_name = |name: &str| sign == " := " || !name.trim_start().contains(' ');
    let is_defined = left.starts_with(|first: char| first.is_ascii_alphabetic())
        && !left.contains("  ")
        && left.chars().all(is_part)
        && left.split(',').all(is_name);
    // `q = 0:  T(i)` is a row of a table.
    (is_defined && !value.contains(":  ")).then_some((left, sign.trim(), value))
}

/// Returns the right side of a line and its conditions as cells. Gaps of two blanks part them, but beside a sign,
/// where a gap only aligns.
fn columns(text: &str) -> Option<String> {
    let signs = [',', '+', '-', '*', '/', '='];
    let mut found: Vec<String> = vec![];
    for part in text.split("  ").map(str::trim).filter(|part| !part.is_empty()) {
        let is_open = |above: &String| above.ends_with(signs) || part.starts_with("/ ") || part.starts_with("* ");
        match found.last_mut().filter(|above| is_open(above)) {
            Some(above) => *above += &format!(" {part}"),
            None => found.push(part.to_string()),
        }
    }
    let cells = found.iter().map(|part| math(part)).collect::<Option<Vec<_>>>()?;
    let (value, notes) = cells.split_first()?;
    let wide = if notes.is_empty() { " colspan=\"2\"" } else { "" };
    let notes = if notes.is_empty() { String::new() } else { format!("<td>{}</td>", notes.join("\u{2003}")) };
    Some(format!("<td{wide}>{value}</td>{notes}"))
}

/// Returns a part of a line as MathML; `None` when it holds a sign of no equation, such as an arrow.
fn math(text: &str) -> Option<String> {
    let (tex, storage) = (tex(text)?, Storage::new());
    let mut math = String::new();
    push_mathml(&mut math, Parser::new(&tex, &storage), RenderConfig::default()).ok()?;
    // The crate leaves these two as they are.
    let math = math.replace("<mo><</mo>", "<mo>&lt;</mo>").replace("<mo>></mo>", "<mo>&gt;</mo>");
    (!math.contains("<merror")).then_some(math)
}

/// Signs and functions, their LaTeX, and the end of what they open. Longer ones come before those that they begin with.
const SIGNS: [(&str, &str, &str); 13] = [
    (":=", r"\coloneqq ", ""),
    ("<=", r"\le ", ""),
    (">=", r"\ge ", ""),
    ("/=", r"\ne ", ""),
    ("..", r"\ldots ", ""),
    ("*", r"\cdot ", ""),
    ("prod ", r"\prod ", ""),
    ("floor(", r"\lfloor ", r"\rfloor "),
    ("ceil(", r"\lceil ", r"\rceil "),
    ("sqrt(", r"\sqrt{", "}"),
    ("^(", "^{", "}"),
    ("^-", "^{-", ""),
    ("(", "(", ")"),
];

/// Returns a part of a line as LaTeX.
fn tex(text: &str) -> Option<String> {
    let mut tex = String::new();
    // How each open parenthesis ends.
    let mut ends: Vec<&str> = vec![];
    let mut rest = text;
    let mut before = ' ';
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let mut length = 1;
        if let Some((sign, shown, end)) = SIGNS.iter().find(|(sign, ..)| rest.starts_with(sign)) {
            length = sign.len();
            tex += shown;
            ends.extend(Some(*end).filter(|end| !end.is_empty()));
            if *sign == "^-" {
                let word = rest[2..].find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len() - 2);
                tex += &format!("{}}}", self::tex(&rest[2..2 + word])?);
                length += word;
            }
        } else if word > 0 {
            // `2i` is a product, `B0` a name.
            let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
            length = if digits > 0 && before != '^' { digits } else { word };
            length += if length > 1 && rest[length..].starts_with("'s ") { 2 } else { 0 };
            tex += &if before == '^' { format!("{{{}}}", self::tex(&rest[..word])?) } else { name(&rest[..length]) };
        } else {
            match first {
                // Between names and words of prose; a sign brings its own space.
                ' ' if "),;:'".contains(before) || before.is_ascii_alphanumeric() => {
                    let is_sign = rest[1..].starts_with(['+', '-']) && !rest[2..].starts_with(' ');
                    let is_apart = is_sign || rest[1..].starts_with(|c: char| c.is_ascii_alphanumeric() || c == '(');
                    tex += if is_apart { r"\;" } else { "" };
                }
                ')' => tex += ends.pop()?,
                '-' if rest.starts_with("->") => return None,
                '.' if rest.len() > 1 => return None,
                ' ' | '|' | '<' | '>' | '/' | '+' | '-' | '=' | ',' | ';' | ':' | '\'' | '.' | '^' => tex.push(first),
                _ => return None,
            }
        }
        before = rest[..length].chars().next_back()?;
        rest = &rest[length..];
    }
    (ends.is_empty() && text.matches('|').count().is_multiple_of(2)).then_some(tex)
}

/// Returns a name, a number or a word of prose as LaTeX: a number behind a letter, or a letter behind an underscore, as
/// a subscript.
fn name(word: &str) -> String {
    if let Some((base, index)) = word.rsplit_once('_').filter(|(_, index)| index.len() == 1) {
        return format!("{}_{{{index}}}", name(base));
    }
    let is_number = |text: &str| text.bytes().all(|letter| letter.is_ascii_digit());
    match word.split_at(1) {
        _ if word == "pi" => r"\pi ".to_string(),
        _ if ["sin", "cos"].contains(&word) => format!(r"\{word} "),
        (_, "") => word.to_string(),
        _ if is_number(word) => word.to_string(),
        (base, index) if is_number(index) => format!("{base}_{{{index}}}"),
        _ => format!(r"\text{{{word}}}"),
    }
}
