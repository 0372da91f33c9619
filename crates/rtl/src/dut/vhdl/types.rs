//! The types that a design declares, read from its text.

use std::collections::BTreeMap;

use super::text::{Token, closing, joined, split, tokens};

/// A type, or a subtype, that a design declares. Subtypes in it are text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Type {
    /// The names of the elements, with their subtypes.
    Record(Vec<(String, String)>),
    /// The number of dimensions, and the subtype of the elements.
    Array(usize, String),
    /// The literals.
    Enumeration(Vec<String>),
    /// Another subtype.
    Subtype(String),
}

/// The types of a design, by their names in lower case, each with the name of the package that declares it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Types(BTreeMap<String, (Type, String)>);

impl Types {
    /// Returns the types in texts without comments. Of types of one name it knows the first.
    pub(super) fn of<'t>(texts: impl IntoIterator<Item = &'t str>) -> Self {
        let mut all = BTreeMap::new();
        for text in texts {
            let tokens = tokens(text);
            let mut package = String::new();
            for at in 0..tokens.len() {
                if tokens[at].is("package") && tokens.get(at + 2).is_some_and(|token| token.is("is")) {
                    package = tokens[at + 1].text.to_lowercase();
                } else if let Some((name, kind)) = declared(text, &tokens[at..]) {
                    all.entry(name).or_insert_with(|| (kind, package.clone()));
                }
            }
        }
        Self(all)
    }

    /// Returns the type behind a subtype, as in `work.p.word(7 downto 0)`: the name of a type that the design does not
    /// declare, or the type with its name.
    pub(super) fn find(&self, subtype: &str) -> (String, Option<&Type>) {
        let mut name = base(subtype);
        for _ in 0..16 {
            match self.0.get(&name) {
                Some((Type::Subtype(other), _)) => name = base(other),
                found => return (name, found.map(|(kind, _)| kind)),
            }
        }
        (name, None)
    }

    /// Returns the range of a vector's subtype as written, without brackets; `None` where no text gives one.
    pub(super) fn range(&self, subtype: &str) -> Option<String> {
        let mut subtype = subtype.to_string();
        for _ in 0..16 {
            if let Some(range) = subtype.trim_end().strip_suffix(')').and_then(|text| text.split_once('(')) {
                return Some(range.1.trim().to_lowercase());
            }
            match self.0.get(&base(&subtype)) {
                Some((Type::Subtype(other), _)) => subtype.clone_from(other),
                _ => return None,
            }
        }
        None
    }

    /// Returns the name of a type with the package in the library `work` that declares it.
    pub(super) fn full_name(&self, name: &str) -> String {
        match self.0.get(name) {
            Some((_, package)) if !package.is_empty() => format!("work.{package}.{name}"),
            _ => name.to_string(),
        }
    }
}

/// Returns the name of a subtype's type in lower case, without library, package and constraint.
fn base(subtype: &str) -> String {
    let tokens = tokens(subtype);
    // A resolution function may stand before the type's name, also in brackets.
    let tokens = match closing(&tokens, 0) {
        Some(end) => &tokens[end + 1..],
        None => &tokens[..],
    };
    let end = tokens.iter().position(|token| token.is("(") || token.is("range")).unwrap_or(tokens.len());
    let name = tokens[..end].iter().rfind(|token| token.is_word());
    name.map(|token| token.text.to_lowercase()).unwrap_or_default()
}

/// Reads a declaration that begins with the first of some tokens.
fn declared(text: &str, tokens: &[Token]) -> Option<(String, Type)> {
    let (is_type, is_subtype) = (tokens[0].is("type"), tokens[0].is("subtype"));
    let [name, is, first] = [tokens.get(1)?, tokens.get(2)?, tokens.get(3)?];
    if !(is_type || is_subtype) || !is.is("is") {
        return None;
    }
    let end = |from: usize| tokens.iter().skip(from).position(|token| token.is(";")).map(|at| from + at);
    let kind = if is_subtype {
        Type::Subtype(joined(text, &tokens[3..end(3)?]))
    } else if first.is("(") {
        let literals = split(&tokens[4..closing(tokens, 3)?], ",");
        Type::Enumeration(literals.iter().map(|literal| joined(text, literal)).collect())
    } else if first.is("array") {
        let close = closing(tokens, 4)?;
        Type::Array(split(&tokens[5..close], ",").len(), joined(text, &tokens[close + 2..end(close)?]))
    } else if first.is("record") {
        let close = tokens.iter().position(|token| token.is("end"))?;
        let mut elements = Vec::new();
        for element in split(&tokens[4..close], ";") {
            let colon = element.iter().position(|token| token.is(":"))?;
            for name in split(&element[..colon], ",") {
                elements.push((joined(text, name), joined(text, &element[colon + 1..])));
            }
        }
        Type::Record(elements)
    } else {
        return None;
    };
    Some((name.text.to_lowercase(), kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_read_with_their_elements() {
        let text = "package p is type State is (idle, run, '1'); subtype word is work.q.vec(7 downto 0);
            type pair is record a, b : std_logic; n : unsigned(W - 1 downto 0); end record;
            type list is array (0 to 3, natural range <>) of word; end;";
        let types = Types::of([text]);
        let word = |text: &str| text.to_string();
        assert_eq!(types.find("WORD(3 downto 0)"), ("vec".into(), None));
        assert_eq!(types.find("work.p.list"), ("list".into(), Some(&Type::Array(2, word("word")))));
        let literals = ["idle", "run", "'1'"].map(word).to_vec();
        assert_eq!(types.find("state range idle to run"), ("state".into(), Some(&Type::Enumeration(literals))));
        let elements = [("a", "std_logic"), ("b", "std_logic"), ("n", "unsigned(W - 1 downto 0)")];
        let elements = elements.map(|(name, kind)| (word(name), word(kind))).to_vec();
        assert_eq!(types.find("pair").1, Some(&Type::Record(elements)));
    }
}
