//! The interface of a VHDL entity, read from its text. Types remain text: the bench declares signals of these types,
//! and GHDL reports their formats.

use std::ops::Range;

use super::text::{Token, closing, joined, plain, split, tokens};

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
    /// The place of its declaration, which it may share with others, in the file.
    pub(super) place: Range<usize>,
}

/// Returns the interface of an entity; `None` when no text declares it.
pub(crate) fn interface(texts: &[&str], entity: &str) -> Option<Interface> {
    texts.iter().find_map(|text| of_text(&plain(text.as_bytes()), entity))
}

/// Returns the names of all entities in some texts.
pub(crate) fn entities(texts: &[&str]) -> Vec<String> {
    let of = |text: &&str| {
        let text = plain(text.as_bytes());
        let tokens = tokens(&text);
        let named = (0..tokens.len()).filter(|&at| is_entity(&tokens, at));
        named.map(|at| tokens[at + 1].text.to_string()).collect::<Vec<_>>()
    };
    texts.iter().flat_map(of).collect()
}

/// Returns whether an entity is declared at an index.
fn is_entity(tokens: &[Token], at: usize) -> bool {
    tokens[at].is("entity") && tokens.get(at + 2).is_some_and(|token| token.is("is"))
}

/// Returns whether any text has the word of VHDL by which a function of a library is called (`attribute foreign of`).
pub(crate) fn names_foreign(texts: &[&str]) -> bool {
    texts.iter().any(|text| tokens(&plain(text.as_bytes())).iter().any(|token| token.is("foreign")))
}

/// Returns the interface of an entity in a text without comments.
pub(super) fn of_text(text: &str, entity: &str) -> Option<Interface> {
    let tokens = tokens(text);
    let at = (0..tokens.len()).find(|&at| is_entity(&tokens, at) && tokens[at + 1].is(entity))?;
    let mut found = Interface { context: context(text, &tokens[..at]), ..Interface::default() };
    let mut next = at + 3;
    for (word, is_port) in [("generic", false), ("port", true)] {
        if !tokens.get(next).is_some_and(|token| token.is(word)) {
            continue;
        }
        let end = closing(&tokens, next + 1)?;
        let items = items(text, &tokens[next + 2..end]);
        if is_port {
            found.ports = items
        } else {
            found.generics = items
        }
        next = end + 2;
    }
    Some(found)
}

/// Returns the library, use and context clauses after the last design unit before an entity.
fn context(text: &str, before: &[Token]) -> String {
    let end = before.iter().rposition(|token| token.is("end")).unwrap_or(0);
    let clauses = split(&before[end..], ";");
    let is_clause = |clause: &&&[Token]| ["library", "use", "context"].iter().any(|word| clause[0].is(word));
    clauses.iter().filter(is_clause).map(|clause| format!("{};\n", joined(text, clause))).collect()
}

/// Reads the items of a list, which semicolons separate. An item with several names becomes several items.
fn items(text: &str, list: &[Token]) -> Vec<Item> {
    let mut all = Vec::new();
    for item in split(list, ";") {
        let Some(colon) = item.iter().position(|token| token.is(":")) else { continue };
        let (names, rest) = (&item[..colon], &item[colon + 1..]);
        let (rest, default) = match rest.iter().position(|token| token.is(":=")) {
            Some(at) => (&rest[..at], Some(joined(text, &rest[at + 1..]))),
            None => (rest, None),
        };
        let is_mode = |token: &Token| ["in", "out", "inout", "buffer", "linkage"].iter().any(|mode| token.is(mode));
        let (mode, kind) = match rest.split_first() {
            Some((first, kind)) if is_mode(first) => (first.text.to_lowercase(), kind),
            _ => ("in".to_string(), rest),
        };
        let place = item[0].at..item[item.len() - 1].end();
        for name in split(names, ",") {
            // `signal` and `constant` may stand before a name.
            let name = name[name.len() - 1].text.to_string();
            let (mode, default, place) = (mode.clone(), default.clone(), place.clone());
            all.push(Item { name, mode, kind: joined(text, kind), default, place });
        }
    }
    all
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
  generic (WIDTH, DEPTH : positive range 1 to 32 := 2 ** (2 + 1); NAME : string := \"a;b\"; SIGN : character := ';');
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
                "SIGN in character Some(\"';'\")",
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
