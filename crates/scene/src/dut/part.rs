//! Ports and their parts by the names that a design's language gives them.

use crate::schema::identifier::{Identifier, Language};

/// The bits of a port that a connection is about.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// All of them.
    Whole,
    /// Those from one index to another, in the port's own indices; in an array, of a word.
    Bits(i64, i64),
    /// Those behind this many from the left, in a list for all of the port's bits.
    InList {
        /// Bits before this part.
        before: u32,
        /// Bits of the whole list.
        of: u32,
    },
}

impl Part {
    /// Reads the name of a port, or of a part of one. The port may be a word in a record or an array: `enc.a`,
    /// `gains(2).x`. `ab(1)` and `ab[1]` are one bit or one word, `ab(7 downto 4)`, `ab(4 to 7)` and `ab[7:4]` are four
    /// bits. Returns the port and the part; `None` for what is no name.
    pub fn of_name(language: Language, text: &str) -> Option<(String, Self)> {
        let of = |open: char, close: char| {
            let (name, inside) = text.trim_end().strip_suffix(close)?.rsplit_once(open)?;
            let range =
                [" downto ", " to ", ":"].iter().find_map(|word| inside.split_once(word)).unwrap_or((inside, inside));
            Some((name.trim_end(), Self::Bits(range.0.trim().parse().ok()?, range.1.trim().parse().ok()?)))
        };
        let (name, part) = of('(', ')').or_else(|| of('[', ']')).unwrap_or((text, Self::Whole));
        is_word(language, name).then(|| (name.to_string(), part))
    }

    /// Returns whether this part of a port `own` belongs to a port of this name. The port may be a word of an array,
    /// and `own` may name a word in the port.
    pub fn is_of(self, own: &str, port: &str, ignores_case: bool) -> bool {
        self.path(own, port, ignores_case).is_some()
    }

    /// Returns the path in a port of what is behind its name, and the part of the word there.
    pub(super) fn path(self, own: &str, port: &str, ignores_case: bool) -> Option<(String, Self)> {
        let (own, port) = (round(own), round(port));
        let same = |one: &str| if ignores_case { one.eq_ignore_ascii_case(&port) } else { one == port };
        match self {
            Self::Bits(one, other) if one == other && same(&format!("{own}({one})")) => {
                Some((String::new(), Self::Whole))
            }
            part => {
                let (name, path) = own.split_at_checked(port.len())?;
                let is_path = path.is_empty() || path.starts_with(['.', '(']);
                (same(name) && is_path).then(|| (path.to_string(), part))
            }
        }
    }
}

/// Returns whether a text names a port or a word in a port: identifiers with dots and indices.
fn is_word(language: Language, name: &str) -> bool {
    // An extended identifier may have dots and brackets of its own.
    let is_identifier = |name: &str| Identifier::new(language, name).is_some();
    let is_part = |part: &str| {
        let of = |open: char, close: char| part.strip_suffix(close)?.split_once(open);
        let (own, indices) = of('(', ')').or_else(|| of('[', ']')).unwrap_or((part, "0"));
        let is_index = |index: &str| index.parse::<i64>().is_ok();
        is_identifier(own) && indices.split([')', '(', ']', '[']).filter(|index| !index.is_empty()).all(is_index)
    };
    is_identifier(name) || name.split('.').all(is_part)
}

/// Returns a name with its indices in round brackets.
fn round(name: &str) -> String {
    name.replace('[', "(").replace(']', ")")
}
