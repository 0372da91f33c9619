//! Ports and their parts by the names that a design's language gives them.

use crate::schema::identifier::{Identifier, Language};

/// The bits of a port that a connection is about.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// All of them.
    Whole,
    /// Those from one index to another. An index is the number of bits to the right; in an array, that of a word.
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

    /// Returns the part of a port that this part of a port `own` is, if it is one. The port may be a word of an array.
    pub fn within(self, own: &str, port: &str, ignores_case: bool) -> Option<Self> {
        let same = |one: &str| {
            let (one, two) = (round(one), round(port));
            if ignores_case { one.eq_ignore_ascii_case(&two) } else { one == two }
        };
        match self {
            Self::Bits(one, other) if one == other && same(&format!("{own}({one})")) => Some(Self::Whole),
            part => same(own).then_some(part),
        }
    }

    /// Returns the bits of a part of a port of this width: the number of those to the right, and the part's own; `None`
    /// for bits that the port does not have.
    pub fn bits(self, width: u32) -> Option<(u32, u32)> {
        match self {
            Self::Whole => Some((0, width)),
            Self::Bits(one, other) => {
                let (low, high) = (u32::try_from(one.min(other)).ok()?, u32::try_from(one.max(other)).ok()?);
                (high < width).then_some((low, high - low + 1))
            }
            Self::InList { before, of } => (of == width).then(|| (width - 1 - before, 1)),
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
