//! Operations of VHDL that GHDL 2.0's synthesis writes wrongly as Verilog, put right by the types in the design's text:
//! a whole number less a signed word has its operands exchanged, and a signed word that `resize` makes shorter loses
//! its sign.

use std::collections::BTreeMap;

use super::text::{Token, plain, tokens};
use super::types::{Type, Types};

/// What the text tells of a value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Integer,
    Signed,
    Unsigned,
}

/// A file of a design: its text without comments, and its tokens' places.
struct File<'t> {
    text: &'t str,
    tokens: Vec<Token<'t>>,
}

/// Returns the Verilog that GHDL 2.0 has made of some files, by their names, with these operations as VHDL has them.
///
/// # Errors
///
/// The place of an operation with a value whose type the text does not tell.
pub(in crate::dut) fn with_operands(verilog: &str, files: &BTreeMap<String, String>) -> Result<String, String> {
    let texts: BTreeMap<_, _> = files.iter().map(|(name, text)| (&**name, plain(text.as_bytes()))).collect();
    let kinds = kinds(&texts);
    let files: BTreeMap<_, _> = texts.iter().map(|(name, text)| (*name, File { text, tokens: tokens(text) })).collect();
    let (mut made, mut place) = (String::new(), None);
    let mut widths: BTreeMap<&str, usize> = BTreeMap::new();
    for line in verilog.lines() {
        if line.starts_with("module ") {
            widths.clear();
        }
        widths.extend(declared(line));
        let assigned = line.strip_prefix("  assign ").and_then(|rest| rest.split_once(" = "));
        match (assigned, place) {
            (Some((net, value)), Some((name, row, column))) => {
                let source = files.get(name).and_then(|file| Some((file, file.at(row, column)?)));
                let told = |what: &str| format!("{name}:{row}:{column}: the text does not tell the type of {what}");
                made += &match source {
                    Some((file, at)) if file.text[at..].starts_with('-') => difference(value, file, at, &kinds)
                        .map_err(told)?
                        .map(|value| format!("  assign {net} = {value}")),
                    Some((file, at)) if value.ends_with("// trunc") && file.is_resize(at) => {
                        let resized = resized(value, file, at, (&kinds, &widths));
                        resized.map_err(told)?.map(|value| format!("  assign {net} = {value}"))
                    }
                    _ => None,
                }
                .unwrap_or_else(|| line.to_string());
            }
            _ => made += line,
        }
        made.push('\n');
        if assigned.is_some() || line.trim_start().starts_with("/*") {
            place = located(line);
        }
    }
    Ok(made)
}

/// Returns file, line and column of `/* a.vhd:5:63  */`.
fn located(line: &str) -> Option<(&str, usize, usize)> {
    let mut parts = line.trim().strip_prefix("/*")?.strip_suffix("*/")?.trim().rsplitn(3, ':');
    let (column, row) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    Some((parts.next()?, row, column))
}

/// Returns the name and the width of a declared net or port.
fn declared(line: &str) -> Option<(&str, usize)> {
    let line = line.trim();
    let rest = ["wire ", "reg ", "input ", "output "].iter().find_map(|word| line.strip_prefix(word))?.trim_start();
    let (range, name) = rest.strip_prefix('[')?.split_once(']')?;
    let (high, _) = range.split_once(':')?;
    Some((name.trim().trim_end_matches([',', ';', ')']), high.parse::<usize>().ok()? + 1))
}

impl File<'_> {
    /// Returns the place of a line and a column.
    fn at(&self, row: usize, column: usize) -> Option<usize> {
        let begin = self.text.split_inclusive('\n').take(row.checked_sub(1)?).map(str::len).sum::<usize>();
        let at = begin + column.checked_sub(1)?;
        (at < self.text.len()).then_some(at)
    }

    fn is_resize(&self, at: usize) -> bool {
        self.text[at..].get(..6).is_some_and(|word| word.eq_ignore_ascii_case("resize"))
    }

    /// Returns the index of the token at a place, or of the first one behind it.
    fn index(&self, at: usize) -> usize {
        self.tokens.partition_point(|token| token.at < at)
    }
}

/// Returns the kind of a subtype; of an array, that of its elements. `is_signed` is said of plain vectors.
fn of_type(types: &Types, text: &str, is_signed: bool, depth: u32) -> Option<Kind> {
    let (name, declared) = types.find(text);
    match (&*name, declared) {
        (_, Some(Type::Array(_, element))) if depth < 8 => of_type(types, element, is_signed, depth + 1),
        ("integer" | "natural" | "positive", None) => Some(Kind::Integer),
        ("std_logic_vector" | "std_ulogic_vector", None) if is_signed => Some(Kind::Signed),
        ("std_logic_vector" | "std_ulogic_vector", None) => Some(Kind::Unsigned),
        (name, None) if name.ends_with("unsigned") => Some(Kind::Unsigned),
        (name, None) if name.ends_with("signed") => Some(Kind::Signed),
        _ => None,
    }
}

/// Returns the kinds of all names that the texts declare, in lower case; a name of two kinds has none.
fn kinds(texts: &BTreeMap<&str, String>) -> BTreeMap<String, Option<Kind>> {
    let types = Types::of(texts.values().map(String::as_str));
    let is_signed = texts.values().any(|text| text.to_lowercase().contains("std_logic_signed"));
    let mut kinds: BTreeMap<String, Option<Kind>> = BTreeMap::new();
    let mut put = |name: &str, kind: Option<Kind>| {
        let known = kinds.entry(name.to_lowercase()).or_insert(kind);
        if *known != kind {
            *known = None;
        }
    };
    for text in texts.values() {
        let tokens = tokens(text);
        for at in 0..tokens.len() {
            if tokens[at].is("for") && tokens.get(at + 2).is_some_and(|token| token.is("in")) {
                put(tokens[at + 1].text, Some(Kind::Integer));
            }
            if !tokens[at].is(":") || at == 0 {
                continue;
            }
            let modes = ["in", "out", "inout", "buffer"];
            let first =
                at + 1 + usize::from(tokens.get(at + 1).is_some_and(|token| modes.iter().any(|mode| token.is(mode))));
            let end = tokens[first..].iter().position(|token| [";", ":=", ")", "("].iter().any(|sign| token.is(sign)));
            let Some(end) = end.map(|end| first + end).filter(|end| *end > first) else { continue };
            let kind = of_type(&types, &text[tokens[first].at..tokens[end - 1].end()], is_signed, 0);
            let mut name = at - 1;
            loop {
                put(tokens[name].text, kind);
                if name < 2 || !tokens[name - 1].is(",") {
                    break;
                }
                name -= 2;
            }
        }
    }
    kinds
}

/// Returns the kind of an expression from its first token on: signed if any part of it is. `None` where the text does
/// not tell.
fn kind_of(tokens: &[Token], kinds: &BTreeMap<String, Option<Kind>>) -> Option<Kind> {
    const ENDS: [&str; 18] = [
        ";", ",", "<", ">", "=", "/=", "<=", ">=", "=>", "then", "when", "else", "loop", "generate", "and", "or",
        "xor", "is",
    ];
    let (mut depth, mut found, mut unknown) = (0i32, None, false);
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        depth += i32::from(token.is("(")) - i32::from(token.is(")"));
        if depth < 0 || depth == 0 && ENDS.iter().any(|end| token.is(end)) {
            break;
        }
        let name = token.text.to_lowercase();
        let is_called = tokens.get(at + 1).is_some_and(|next| next.is("("));
        let kind = match &*name {
            "signed" | "to_signed" => Some(Kind::Signed),
            "unsigned" | "to_unsigned" => Some(Kind::Unsigned),
            "to_integer" => Some(Kind::Integer),
            _ if name.starts_with(|c: char| c.is_ascii_digit()) => Some(Kind::Integer),
            _ => kinds.get(&name).copied().flatten(),
        };
        unknown |= kind.is_none() && token.is_word() && kinds.contains_key(&name);
        found = match (found, kind) {
            (Some(Kind::Signed), _) | (_, Some(Kind::Signed)) => Some(Kind::Signed),
            (Some(Kind::Unsigned), _) | (_, Some(Kind::Unsigned)) => Some(Kind::Unsigned),
            (found, kind) => found.or(kind),
        };
        // What is in a conversion, or an index, tells nothing of the value.
        if is_called && kind.is_some() {
            let mut inner = 0i32;
            while let Some(token) = tokens.get(at + 1) {
                inner += i32::from(token.is("(")) - i32::from(token.is(")"));
                at += 1;
                if inner == 0 {
                    break;
                }
            }
        }
        at += 1;
    }
    if found == Some(Kind::Integer) && unknown { None } else { found }
}

/// Returns a difference whose operands are exchanged, in the right order; `None` for another one.
fn difference<'w>(
    value: &str,
    file: &File,
    at: usize,
    kinds: &BTreeMap<String, Option<Kind>>,
) -> Result<Option<String>, &'w str> {
    let Some((one, other)) = value.strip_suffix(';').and_then(|value| value.split_once(" - ")) else { return Ok(None) };
    let sign = file.index(at);
    // A constant at the left is where it has to be.
    let Some(left) = sign.checked_sub(1).map(|left| file.tokens[left]).filter(|_| !one.contains("'b")) else {
        return Ok(None);
    };
    let name = left.text.to_lowercase();
    let is_integer = match left.text {
        ")" => {
            let mut depth = 0i32;
            let open = file.tokens[..sign].iter().rposition(|token| {
                depth += i32::from(token.is(")")) - i32::from(token.is("("));
                depth == 0
            });
            let Some(open) = open else { return Ok(None) };
            let is_converted = open > 0 && file.tokens[open - 1].is("to_integer");
            let is_called = open > 0 && file.tokens[open - 1].is_word();
            is_converted || !is_called && kind_of(&file.tokens[open + 1..sign - 1], kinds) == Some(Kind::Integer)
        }
        text if text.starts_with(|c: char| c.is_ascii_digit()) => true,
        _ => kinds.get(&name).copied().flatten() == Some(Kind::Integer),
    };
    match (is_integer, is_integer.then(|| kind_of(&file.tokens[sign + 1..], kinds))) {
        (true, Some(Some(Kind::Signed))) => Ok(Some(format!("{other} - {one};"))),
        (true, Some(None)) => Err("what is subtracted here"),
        _ => Ok(None),
    }
}

/// Returns a signed word that `resize` makes shorter: its sign and the bits at the right. `None` for one without a
/// sign.
fn resized<'w>(
    value: &str,
    file: &File,
    at: usize,
    (kinds, widths): (&BTreeMap<String, Option<Kind>>, &BTreeMap<&str, usize>),
) -> Result<Option<String>, &'w str> {
    match kind_of(&file.tokens[(file.index(at) + 2).min(file.tokens.len())..], kinds) {
        Some(Kind::Signed) => {}
        Some(Kind::Unsigned) => return Ok(None),
        _ => return Err("what is resized here"),
    }
    let parts = value.split_once(']').and_then(|(value, _)| value.split_once('['));
    let Some((word, range)) = parts else { return Ok(None) };
    let high = range.split(':').next().and_then(|high| high.parse::<usize>().ok());
    let (Some(high), Some(width)) = (high, widths.get(word)) else { return Err("what is resized here") };
    let sign = width - 1;
    Ok(Some(match high {
        0 => format!("{word}[{sign}];"),
        1 => format!("{{{word}[{sign}], {word}[0]}};"),
        _ => format!("{{{word}[{sign}], {word}[{}:0]}};", high - 1),
    }))
}
