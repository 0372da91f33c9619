//! Operations of VHDL that GHDL 2.0's synthesis writes wrongly as Verilog, put right by the types in the design's text:
//! a whole number less a signed word has its operands exchanged, and a signed word that `resize` makes shorter loses
//! its sign.

use std::collections::BTreeMap;
use std::ops::Range;

use super::text::{Token, plain, tokens};
use super::types::{Type, Types};

/// The kind of a value, as far as the text tells it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Integer,
    Signed,
    Unsigned,
}

/// A file of a design: its name, its text without comments, and its tokens' places.
struct File<'t> {
    name: &'t str,
    text: &'t str,
    tokens: Vec<Token<'t>>,
}

/// A declaration: its file, the part of the text in which it is seen, and its kind if that is known.
struct Declaration<'t> {
    file: &'t str,
    scope: Range<usize>,
    kind: Option<Kind>,
}

/// The declarations of a design, by their names in lower case.
struct Kinds<'t>(BTreeMap<String, Vec<Declaration<'t>>>);

impl Kinds<'_> {
    /// Returns the kind of a name at a place: that of the innermost declarations that are seen there, or of those in
    /// other files. `Some(None)` where they differ, or are of no kind.
    fn of(&self, name: &str, file: &str, at: usize) -> Option<Option<Kind>> {
        let all = self.0.get(&name.to_lowercase())?;
        let here = || all.iter().filter(|one| one.file == file && one.scope.contains(&at));
        let innermost = here().map(|one| one.scope.len()).min();
        let seen: Vec<_> = match innermost {
            Some(length) => here().filter(|one| one.scope.len() == length).map(|one| one.kind).collect(),
            None => all.iter().filter(|one| one.file != file && one.scope.start == 0).map(|one| one.kind).collect(),
        };
        let first = *seen.first()?;
        Some(first.filter(|_| seen.iter().all(|kind| *kind == first)))
    }
}

/// Returns the Verilog that GHDL 2.0 has made of some files, by their names, with these operations as VHDL has them.
///
/// # Errors
///
/// The place of an operation with a value whose type the text does not tell.
pub(in crate::dut) fn with_operands(verilog: &str, files: &BTreeMap<String, String>) -> Result<String, String> {
    let texts: BTreeMap<_, _> = files.iter().map(|(name, text)| (&**name, plain(text.as_bytes()))).collect();
    let texts: Vec<_> = texts.iter().map(|(name, text)| File { name, text, tokens: tokens(text) }).collect();
    let files: BTreeMap<_, _> = texts.into_iter().map(|file| (file.name, file)).collect();
    let kinds = kinds(&files);
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
    // The first port stands behind the bracket that opens the list.
    let line = line.trim().trim_start_matches('(');
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

/// Returns the parts of a text in which a subprogram's or a process's own names are seen.
fn scopes(tokens: &[Token]) -> Vec<Range<usize>> {
    let is = |at: usize, words: &[&str]| tokens.get(at).is_some_and(|token| words.iter().any(|word| token.is(word)));
    let mut scopes = Vec::new();
    for at in 0..tokens.len() {
        if at > 0 && is(at - 1, &["end"]) || !is(at, &["function", "procedure", "process"]) {
            continue;
        }
        let is_process = is(at, &["process"]);
        // A subprogram without a body ends with its declaration.
        let (mut next, mut depth) = (at + 1, 0i32);
        while !is_process && next < tokens.len() && (depth > 0 || !is(next, &["is", ";"])) {
            depth += i32::from(is(next, &["("])) - i32::from(is(next, &[")"]));
            next += 1;
        }
        let has_body = is_process || is(next, &["is"]) && !is(next + 1, &["new"]);
        let mut open = 1;
        while has_body && next < tokens.len() && open > 0 {
            next += 1;
            let after_end = is(next - 1, &["end"]);
            if is(next, &["end"]) {
                open -= 1;
            } else if !after_end && is(next, &["if", "case", "loop", "record", "function", "procedure"]) {
                // One inside without a body does not end; it is rare, and then the scope is too long.
                open += 1;
            }
        }
        let end = tokens.get(next).or(tokens.last()).map_or(0, Token::end);
        scopes.push(tokens[at].at..end);
    }
    scopes
}

/// Returns the kinds of all names that the files declare, also of functions, by their results.
fn kinds<'t>(files: &BTreeMap<&'t str, File<'t>>) -> Kinds<'t> {
    let types = Types::of(files.values().map(|file| file.text));
    let is_signed = files.values().any(|file| file.text.to_lowercase().contains("std_logic_signed"));
    let mut kinds = Kinds(BTreeMap::new());
    for File { name: file, text, tokens } in files.values() {
        let scopes = scopes(tokens);
        let mut put = |token: &Token, kind: Option<Kind>, is_outside: bool| {
            // The name of a function is seen around it, its parameters within.
            let around = scopes.iter().filter(|scope| scope.contains(&token.at));
            let mut around: Vec<_> = around.collect();
            around.sort_by_key(|scope| scope.len());
            let scope = around.get(usize::from(is_outside)).map_or(0..text.len(), |scope| (*scope).clone());
            kinds.0.entry(token.text.to_lowercase()).or_default().push(Declaration { file, scope, kind });
        };
        let is = |at: usize, word: &str| tokens.get(at).is_some_and(|token| token.is(word));
        // The subtype from a token on.
        let subtype = |first: usize| {
            let end = tokens
                .get(first..)?
                .iter()
                .position(|token| [";", ":=", ")", "(", "is"].iter().any(|sign| token.is(sign)))?;
            (end > 0).then(|| of_type(&types, &text[tokens[first].at..tokens[first + end - 1].end()], is_signed, 0))
        };
        for at in 0..tokens.len() {
            if is(at, "for") && is(at + 2, "in") {
                put(&tokens[at + 1], Some(Kind::Integer), false);
            } else if is(at, "function") && !(at > 0 && is(at - 1, "end")) && tokens.len() > at + 1 {
                let result = (at..tokens.len()).take_while(|next| !is(*next, "is")).find(|next| is(*next, "return"));
                put(&tokens[at + 1], result.and_then(|result| subtype(result + 1)).flatten(), true);
            }
            if at == 0 || !is(at, ":") {
                continue;
            }
            let has_mode = ["in", "out", "inout", "buffer"].iter().any(|mode| is(at + 1, mode));
            let Some(kind) = subtype(at + 1 + usize::from(has_mode)) else { continue };
            let mut name = at - 1;
            loop {
                put(&tokens[name], kind, false);
                if name < 2 || !is(name - 1, ",") {
                    break;
                }
                name -= 2;
            }
        }
    }
    kinds
}

/// Words and signs that end an expression, or begin one.
const ENDS: [&str; 26] = [
    ";", ",", "<", ">", "=", ":=", "when", "else", "then", "loop", "generate", "and", "or", "xor", "nand", "nor",
    "not", "is", "return", "if", "elsif", "while", "until", "select", "report", "in",
];

/// Returns the kind of an expression from its first token on: signed if any part of it is. `None` where the text does
/// not tell.
fn kind_of(file: &File, tokens: &[Token], kinds: &Kinds) -> Option<Kind> {
    let (mut depth, mut found, mut unknown) = (0i32, None, false);
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        depth += i32::from(token.is("(")) - i32::from(token.is(")"));
        if depth < 0 || depth == 0 && ENDS.iter().any(|end| token.is(end)) {
            break;
        }
        let attribute = tokens.get(at + 2).filter(|_| tokens.get(at + 1).is_some_and(|next| next.is("'")));
        if attribute.is_some_and(|word| ["length", "left", "right", "high", "low"].iter().any(|of| word.is(of))) {
            found = found.or(Some(Kind::Integer));
            at += 3;
            continue;
        }
        let name = token.text.to_lowercase();
        let is_called = tokens.get(at + 1).is_some_and(|next| next.is("("));
        let kind = match &*name {
            "signed" | "to_signed" => Some(Kind::Signed),
            "unsigned" | "to_unsigned" => Some(Kind::Unsigned),
            "to_integer" => Some(Kind::Integer),
            _ if name.starts_with(|c: char| c.is_ascii_digit()) => Some(Kind::Integer),
            _ => kinds.of(&name, file.name, token.at).flatten(),
        };
        unknown |= kind.is_none() && token.is_word() && kinds.0.contains_key(&name);
        found = match (found, kind) {
            (Some(Kind::Signed), _) | (_, Some(Kind::Signed)) => Some(Kind::Signed),
            (Some(Kind::Unsigned), _) | (_, Some(Kind::Unsigned)) => Some(Kind::Unsigned),
            (found, kind) => found.or(kind),
        };
        // What is in a conversion, a call or an index tells nothing of the value.
        if is_called && (kind.is_some() || kinds.0.contains_key(&name)) {
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
fn difference<'w>(value: &str, file: &File, at: usize, kinds: &Kinds) -> Result<Option<String>, &'w str> {
    let Some((one, other)) = value.strip_suffix(';').and_then(|value| value.split_once(" - ")) else { return Ok(None) };
    let sign = file.index(at);
    // A constant at the left is where it has to be.
    if one.contains("'b") {
        return Ok(None);
    }
    // The left operand is all that stands before, as in `x + 1 - y`.
    let mut depth = 0i32;
    let begin = file.tokens[..sign].iter().rposition(|token| {
        depth += i32::from(token.is(")")) - i32::from(token.is("("));
        depth < 0 || depth == 0 && ENDS.iter().any(|end| token.is(end))
    });
    let left = &file.tokens[begin.map_or(0, |begin| begin + 1)..sign];
    let is_integer = kind_of(file, left, kinds) == Some(Kind::Integer);
    if !is_integer {
        return Ok(None);
    }
    // The right operand ends before the next sum, as in `3 - k + x`.
    let mut depth = 0i32;
    let right = &file.tokens[sign + 1..];
    let end = right.iter().position(|token| {
        depth += i32::from(token.is("(")) - i32::from(token.is(")"));
        depth == 0 && ["+", "-", "&"].iter().any(|sum| token.is(sum))
    });
    match kind_of(file, &right[..end.unwrap_or(right.len())], kinds) {
        Some(Kind::Signed) => Ok(Some(format!("{other} - {one};"))),
        None => Err("what is subtracted here"),
        _ => Ok(None),
    }
}

/// Returns a signed word that `resize` makes shorter: its sign and the bits at the right. `None` for one without a
/// sign.
fn resized<'w>(
    value: &str,
    file: &File,
    at: usize,
    (kinds, widths): (&Kinds, &BTreeMap<&str, usize>),
) -> Result<Option<String>, &'w str> {
    match kind_of(file, &file.tokens[(file.index(at) + 2).min(file.tokens.len())..], kinds) {
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
