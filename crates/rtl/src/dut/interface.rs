//! The interface of a VHDL entity, read from its text. Types remain text: the bench declares signals of these types,
//! and GHDL reports their formats.

/// An entity's generics and ports.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Interface {
    /// The library and use clauses before the entity.
    pub(crate) context: String,
    pub(crate) generics: Vec<Item>,
    pub(crate) ports: Vec<Item>,
}

/// A generic or a port.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Item {
    pub(crate) name: String,
    /// Its mode; `in` if none is written.
    pub(crate) mode: String,
    /// Its subtype, as written.
    pub(crate) kind: String,
    /// Its default, if it has one.
    pub(crate) default: Option<String>,
}

/// Returns the interface of an entity; `None` when no text declares it.
pub(crate) fn interface(texts: &[&str], entity: &str) -> Option<Interface> {
    texts.iter().find_map(|text| of_text(&without_comments(text), entity))
}

/// Returns the names of all entities in some texts.
pub(crate) fn entities(texts: &[&str]) -> Vec<String> {
    let mut names = Vec::new();
    for text in texts {
        let text = without_comments(text);
        let words: Vec<_> = words(&text).collect();
        for three in words.windows(3) {
            if let [(_, entity), (_, name), (_, is)] = three
                && entity.eq_ignore_ascii_case("entity")
                && is.eq_ignore_ascii_case("is")
            {
                names.push((*name).to_string());
            }
        }
    }
    names
}

/// Returns whether any text has the word of VHDL by which a function of a library is called (`attribute foreign of`).
pub(crate) fn names_foreign(texts: &[&str]) -> bool {
    texts.iter().any(|text| words(&without_comments(text)).any(|(_, word)| word.eq_ignore_ascii_case("foreign")))
}

fn of_text(text: &str, entity: &str) -> Option<Interface> {
    let words: Vec<_> = words(text).collect();
    let at = words.windows(3).position(|three| {
        let [(_, first), (_, name), (_, is)] = three else { return false };
        first.eq_ignore_ascii_case("entity") && name.eq_ignore_ascii_case(entity) && is.eq_ignore_ascii_case("is")
    })?;
    let begin = words[at].0;
    let mut rest = text[words[at + 2].0 + 2..].trim_start();
    let mut found = Interface { context: context(&text[..begin]), ..Interface::default() };
    for (word, is_port) in [("generic", false), ("port", true)] {
        let Some(after) =
            rest.get(..word.len()).filter(|start| start.eq_ignore_ascii_case(word)).map(|_| &rest[word.len()..])
        else {
            continue;
        };
        let after = after.trim_start();
        let end = closing(after)?;
        let items = items(&after[1..end]);
        if is_port {
            found.ports = items
        } else {
            found.generics = items
        }
        rest = after[end + 1..].trim_start().strip_prefix(';')?.trim_start();
    }
    Some(found)
}

/// Returns the library and use clauses after the last design unit of a text.
fn context(before: &str) -> String {
    let words: Vec<_> = words(before).collect();
    let end = words.iter().rev().find(|(_, word)| word.eq_ignore_ascii_case("end")).map_or(0, |(at, _)| *at);
    let from = if end == 0 { 0 } else { before[end..].find(';').map_or(before.len(), |at| end + at + 1) };
    let clauses = before[from..].split_inclusive(';').map(str::trim);
    let is_clause = |clause: &&str| {
        let first = clause.split_whitespace().next().unwrap_or_default();
        first.eq_ignore_ascii_case("library") || first.eq_ignore_ascii_case("use")
    };
    clauses.filter(is_clause).map(|clause| format!("{clause}\n")).collect()
}

/// Reads the items of a list, which semicolons separate. An item with several names becomes several items.
fn items(list: &str) -> Vec<Item> {
    let mut all = Vec::new();
    for item in split(list, ';') {
        let Some((names, rest)) = item.split_once(':') else { continue };
        let (rest, default) = match rest.split_once(":=") {
            Some((rest, default)) => (rest, Some(default.trim().to_string())),
            None => (rest, None),
        };
        let rest = rest.trim();
        let first = rest.split_whitespace().next().unwrap_or_default();
        let is_mode = ["in", "out", "inout", "buffer", "linkage"].iter().any(|mode| first.eq_ignore_ascii_case(mode));
        let (mode, kind) =
            if is_mode { (first.to_lowercase(), rest[first.len()..].trim()) } else { ("in".to_string(), rest) };
        for name in names.split(',') {
            // `signal` and `constant` may stand before a name.
            let name = name.split_whitespace().last().unwrap_or_default().to_string();
            all.push(Item { name, mode: mode.clone(), kind: kind.to_string(), default: default.clone() });
        }
    }
    all
}

/// Splits a text at a character wherever the character is outside brackets.
fn split(text: &str, at: char) -> Vec<&str> {
    let (mut depth, mut begin, mut parts) = (0i32, 0, Vec::new());
    for (index, c) in outside_strings(text) {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            c if c == at && depth == 0 => {
                parts.push(text[begin..index].trim());
                begin = index + 1;
            }
            _ => {}
        }
    }
    parts.push(text[begin..].trim());
    parts.retain(|part| !part.is_empty());
    parts
}

/// Iterates over the characters outside strings, with their positions.
fn outside_strings(text: &str) -> impl Iterator<Item = (usize, char)> {
    let mut is_inside = false;
    text.char_indices().filter(move |(_, c)| {
        is_inside ^= *c == '"';
        !is_inside
    })
}

/// Returns the position of the bracket that closes the one at the start of this text.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (index, c) in outside_strings(text) {
        match c {
            '(' => depth += 1,
            ')' => {
                depth -= 1;
                if depth == 0 {
                    return Some(index);
                }
            }
            _ if depth == 0 => return None,
            _ => {}
        }
    }
    None
}

/// Iterates over the words of letters, digits and underscores, with their positions.
fn words(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let mut at = 0;
    std::iter::from_fn(move || {
        let begin = at + text[at..].find(is_part)?;
        let end = text[begin..].find(|c| !is_part(c)).map_or(text.len(), |length| begin + length);
        at = end;
        Some((begin, &text[begin..end]))
    })
}

/// Returns the text with spaces in place of comments, of one line or of several. Strings stay as they are.
fn without_comments(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let length = if rest.starts_with("--") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if c == '"' {
            let end = rest[1..].find(['"', '\n']).map_or(rest.len(), |end| end + 2);
            plain.push_str(&rest[..end]);
            rest = &rest[end..];
            continue;
        } else {
            plain.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        };
        plain.push(' ');
        rest = &rest[length..];
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "library ieee; use ieee.std_logic_1164.all;
package sizes is constant N : integer := 4; end package;
-- entity fake is port (x : in bit); end;
library ieee; use ieee.std_logic_1164.all;
use work.sizes.all; /* entity other is */
ENTITY Servo IS
  generic (WIDTH, DEPTH : positive range 1 to 32 := 2 ** (2 + 1); NAME : string := \"a;b\");
  port (clk : in std_logic; signal a, b : std_logic := '0';
        q : out std_logic_vector(WIDTH - 1 downto (0)));  -- the answer
END entity Servo;";

    #[test]
    fn an_interface_is_read_with_its_context_and_without_comments() {
        let found = interface(&["package p is end;", TEXT], "servo").expect("it is there");
        assert_eq!(found.context, "library ieee;\nuse ieee.std_logic_1164.all;\nuse work.sizes.all;\n");
        let shown = |item: &Item| format!("{} {} {} {:?}", item.name, item.mode, item.kind, item.default);
        assert_eq!(
            found.generics.iter().map(shown).collect::<Vec<_>>(),
            [
                "WIDTH in positive range 1 to 32 Some(\"2 ** (2 + 1)\")",
                "DEPTH in positive range 1 to 32 Some(\"2 ** (2 + 1)\")",
                "NAME in string Some(\"\\\"a;b\\\"\")",
            ]
        );
        assert_eq!(
            found.ports.iter().map(shown).collect::<Vec<_>>(),
            [
                "clk in std_logic None",
                "a in std_logic Some(\"'0'\")",
                "b in std_logic Some(\"'0'\")",
                "q out std_logic_vector(WIDTH - 1 downto (0)) None",
            ]
        );
        assert_eq!(interface(&[TEXT], "fake"), None);
        assert_eq!(entities(&[TEXT]), ["Servo"]);
    }
}
