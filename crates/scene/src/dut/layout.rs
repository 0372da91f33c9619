//! How a design's language names the bits of a port.

use std::fmt;
use std::str::FromStr;

use super::part::Part;

/// The names of the bits of a word. Indices are those of its declaration, from the left end to the right end.
///
/// Its text is that of a declaration: `[7:0]`, `[1:0][7:0]`, `{a[0:0],n[2:0]}` for a structure, `<w[7:0],n[7:0]>` for a
/// union.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Layout {
    /// A vector of bits. A single bit is one from 0 to 0.
    Vector(i64, i64),
    /// An array of words without gaps.
    Array(i64, i64, Box<Self>),
    /// A structure of fields, from the left.
    Structure(Vec<(String, Self)>),
    /// A union of fields, each at the right.
    Union(Vec<(String, Self)>),
}

impl Layout {
    /// Returns a vector of so many bits whose indices end with 0 at the right.
    pub fn vector(width: u32) -> Self {
        Self::Vector(i64::from(width) - 1, 0)
    }

    /// Returns the number of bits; at most `u32::MAX`, which is more than any port has.
    pub fn width(&self) -> u32 {
        let long = |left: i64, right: i64| u32::try_from(left.abs_diff(right)).unwrap_or(u32::MAX).saturating_add(1);
        let width = |(_, field): &(String, Self)| field.width();
        match self {
            Self::Vector(left, right) => long(*left, *right),
            Self::Array(left, right, word) => long(*left, *right).saturating_mul(word.width()),
            Self::Structure(fields) => fields.iter().map(width).fold(0, u32::saturating_add),
            Self::Union(fields) => fields.iter().map(width).max().unwrap_or(0),
        }
    }

    /// Returns the bits that a part of `own` has in the port of this name: the number of those to the right, and its
    /// own; `None` where the port has no such bits.
    pub fn bits(&self, port: &str, (own, part): (&str, Part), ignores_case: bool) -> Option<(u32, u32)> {
        let (path, part) = part.path(own, port, ignores_case)?;
        self.at(&path, part, ignores_case)
    }

    /// Returns the bits of a part of the word at a path. A path is `.a` and `(2)`, one behind the other.
    fn at(&self, path: &str, part: Part, ignores_case: bool) -> Option<(u32, u32)> {
        if path.is_empty() {
            return match part {
                Part::Whole => Some((0, self.width())),
                Part::Bits(one, other) => self.between(one, other),
                Part::InList { before, of } => (of == self.width()).then(|| (of - 1 - before, 1)),
            };
        }
        let (shift, inner, rest) = if let Some(rest) = path.strip_prefix('.') {
            let (name, rest) = rest.split_at(rest.find(['.', '(']).unwrap_or(rest.len()));
            let (shift, field) = self.field(name, ignores_case)?;
            (shift, field, rest)
        } else {
            let (index, rest) = path.strip_prefix('(')?.split_once(')')?;
            let index = index.parse().ok()?;
            let Self::Array(.., word) = self else {
                // A bit of a vector has no parts.
                return rest.is_empty().then(|| self.at("", Part::Bits(index, index), ignores_case)).flatten();
            };
            (self.between(index, index)?.0, &**word, rest)
        };
        let (more, width) = inner.at(rest, part, ignores_case)?;
        Some((shift + more, width))
    }

    /// Returns the bits from one index to another.
    fn between(&self, one: i64, other: i64) -> Option<(u32, u32)> {
        let (left, right, width) = match self {
            Self::Vector(left, right) => (*left, *right, 1),
            Self::Array(left, right, word) => (*left, *right, word.width()),
            _ => (i64::from(self.width()) - 1, 0, 1),
        };
        let is_inside = |index: &i64| (left.min(right)..=left.max(right)).contains(index);
        let place = |index: i64| Some(index).filter(is_inside).and_then(|at| u32::try_from(at.abs_diff(right)).ok());
        let (one, other) = (place(one)?, place(other)?);
        Some((one.min(other).checked_mul(width)?, (one.abs_diff(other) + 1).checked_mul(width)?))
    }

    /// Returns a field, and the number of bits to its right.
    fn field(&self, name: &str, ignores_case: bool) -> Option<(u32, &Self)> {
        let is_it = |own: &str| if ignores_case { own.eq_ignore_ascii_case(name) } else { own == name };
        match self {
            Self::Structure(fields) => {
                let at = fields.iter().position(|(own, _)| is_it(own))?;
                Some((fields[at + 1..].iter().map(|(_, field)| field.width()).sum(), &fields[at].1))
            }
            Self::Union(fields) => fields.iter().find(|(own, _)| is_it(own)).map(|(_, field)| (0, field)),
            _ => None,
        }
    }

    /// Returns the name of some bits behind that of the word, as in `[7:4]` or `.a`; that of the whole is empty.
    pub fn name(&self, shift: u32, width: u32) -> String {
        let range = |left: i64, right: i64, first: u32, last: u32| {
            let index = |at: u32| if left >= right { right + i64::from(at) } else { right - i64::from(at) };
            if first == last { format!("[{}]", index(first)) } else { format!("[{}:{}]", index(last), index(first)) }
        };
        let (all, last) = (self.width(), (shift + width).saturating_sub(1));
        match self {
            _ if (shift, width) == (0, all) => String::new(),
            Self::Array(left, right, word) => {
                let size = word.width().max(1);
                match (shift / size, last / size) {
                    (at, end) if at == end => range(*left, *right, at, at) + &word.name(shift % size, width),
                    (at, end) if shift.is_multiple_of(size) && width.is_multiple_of(size) => {
                        range(*left, *right, at, end)
                    }
                    _ => range(i64::from(all) - 1, 0, shift, last),
                }
            }
            Self::Vector(left, right) => range(*left, *right, shift, last),
            Self::Structure(fields) | Self::Union(fields) => {
                let found = fields.iter().find_map(|(name, field)| {
                    let (right, _) = self.field(name, false)?;
                    let is_in = right <= shift && shift + width <= right + field.width();
                    is_in.then(|| format!(".{name}{}", field.name(shift - right, width)))
                });
                found.unwrap_or_else(|| range(i64::from(all) - 1, 0, shift, last))
            }
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = |fields: &[(String, Self)]| {
            fields.iter().map(|(name, field)| format!("{name}{field}")).collect::<Vec<_>>().join(",")
        };
        match self {
            Self::Vector(left, right) => write!(f, "[{left}:{right}]"),
            Self::Array(left, right, word) => write!(f, "[{left}:{right}]{word}"),
            Self::Structure(fields) => write!(f, "{{{}}}", all(fields)),
            Self::Union(fields) => write!(f, "<{}>", all(fields)),
        }
    }
}

impl FromStr for Layout {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        read(text, 0).filter(|(_, rest)| rest.is_empty()).map(|(layout, _)| layout).ok_or(())
    }
}

/// The most levels of a layout.
const DEEPEST: u32 = 32;

/// Reads a layout from the beginning of a text. Returns it and the rest.
fn read(text: &str, depth: u32) -> Option<(Layout, &str)> {
    if depth > DEEPEST {
        return None;
    }
    if let Some(rest) = text.strip_prefix('[') {
        let (range, rest) = rest.split_once(']')?;
        let (left, right) = range.split_once(':')?;
        let (left, right) = (left.parse().ok()?, right.parse().ok()?);
        if !rest.starts_with(['[', '{', '<']) {
            return Some((Layout::Vector(left, right), rest));
        }
        let (word, rest) = read(rest, depth + 1)?;
        return Some((Layout::Array(left, right, Box::new(word)), rest));
    }
    let (mut rest, is_union) = (text.strip_prefix(['{', '<'])?, text.starts_with('<'));
    let mut fields = Vec::new();
    loop {
        let (name, of) = rest.split_at(rest.find(['[', '{', '<'])?);
        let (field, behind) = read(of, depth + 1)?;
        fields.push((name.to_string(), field));
        match behind.strip_prefix(',') {
            Some(more) => rest = more,
            None => {
                rest = behind.strip_prefix(if is_union { '>' } else { '}' })?;
                break;
            }
        }
    }
    Some((if is_union { Layout::Union(fields) } else { Layout::Structure(fields) }, rest))
}
