//! The shape of a port's type: how records and arrays are made of words.

use super::types::{Type, Types};

/// The shape of a type. `B` stands for the bounds of an array, from the left to the right, once they are known.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Shape<B> {
    /// A bit, a flag or a number, of this type.
    Plain(&'static str),
    /// A word.
    Vector {
        bounds: B,
        /// Whether its elements are of the type `bit`.
        of_bit: bool,
        is_signed: bool,
        /// Whether its indices are powers of two.
        is_fixed: bool,
    },
    /// A value of an enumeration: the full name of the type, and the number of its literals.
    Enumeration(String, usize),
    Record(Vec<(String, Shape<B>)>),
    Array(B, Box<Shape<B>>),
}

/// The bounds of an array: its left index and its right one.
pub(super) type Bounds = (i64, i64);

/// How deep types may contain each other.
const DEPTH: u32 = 8;

/// Returns the shape of a subtype, or the name of the type in it that no word can be.
pub(super) fn shape(types: &Types, subtype: &str) -> Result<Shape<()>, String> {
    within(types, subtype, DEPTH)
}

fn within(types: &Types, subtype: &str, depth: u32) -> Result<Shape<()>, String> {
    let (name, kind) = types.find(subtype);
    let vector = |of_bit| Shape::Vector {
        bounds: (),
        of_bit,
        is_signed: name.ends_with("sfixed") || name.ends_with("signed") && !name.ends_with("unsigned"),
        is_fixed: name.ends_with("fixed"),
    };
    let Some(less) = depth.checked_sub(1) else { return Err(name) };
    match kind {
        None => Ok(match &*name {
            "std_logic" | "std_ulogic" => Shape::Plain("std_logic"),
            "bit" => Shape::Plain("bit"),
            "boolean" => Shape::Plain("boolean"),
            "integer" | "natural" | "positive" => Shape::Plain("integer"),
            "bit_vector" => vector(true),
            "std_logic_vector"
            | "std_ulogic_vector"
            | "unsigned"
            | "signed"
            | "u_unsigned"
            | "u_signed"
            | "unresolved_unsigned"
            | "unresolved_signed"
            | "sfixed"
            | "ufixed"
            | "u_sfixed"
            | "u_ufixed"
            | "unresolved_sfixed"
            | "unresolved_ufixed" => vector(false),
            _ => return Err(name),
        }),
        Some(Type::Enumeration(literals)) => Ok(Shape::Enumeration(types.full_name(&name), literals.len())),
        Some(Type::Array(1, element)) => Ok(match within(types, element, less)? {
            Shape::Plain(kind @ ("std_logic" | "bit")) => vector(kind == "bit"),
            element => Shape::Array((), Box::new(element)),
        }),
        Some(Type::Array(..)) => Err(name),
        Some(Type::Record(elements)) => {
            let element = |(name, kind): &(String, String)| Ok((name.clone(), within(types, kind, less)?));
            Ok(Shape::Record(elements.iter().map(element).collect::<Result<_, String>>()?))
        }
        Some(Type::Subtype(_)) => Err(name),
    }
}

impl Shape<()> {
    /// Appends an expression for each array in it, each within the first element of the array around it.
    pub(super) fn arrays(&self, path: &str, all: &mut Vec<String>) {
        match self {
            Self::Plain(_) | Self::Enumeration(..) => {}
            Self::Vector { .. } => all.push(path.to_string()),
            Self::Array((), element) => {
                all.push(path.to_string());
                element.arrays(&format!("{path}({path}'left)"), all);
            }
            Self::Record(elements) => {
                elements.iter().for_each(|(name, shape)| shape.arrays(&format!("{path}.{name}"), all));
            }
        }
    }

    /// Returns the shape with the bounds of its [`arrays`](Self::arrays); `None` where they are too few.
    pub(super) fn bounded(&self, bounds: &mut impl Iterator<Item = Bounds>) -> Option<Shape<Bounds>> {
        Some(match self {
            Self::Plain(kind) => Shape::Plain(kind),
            Self::Enumeration(name, count) => Shape::Enumeration(name.clone(), *count),
            Self::Vector { of_bit, is_signed, is_fixed, .. } => {
                Shape::Vector { bounds: bounds.next()?, of_bit: *of_bit, is_signed: *is_signed, is_fixed: *is_fixed }
            }
            Self::Array((), element) => {
                let own = bounds.next()?;
                Shape::Array(own, Box::new(element.bounded(bounds)?))
            }
            Self::Record(elements) => {
                let element = |(name, shape): &(String, Shape<()>)| Some((name.clone(), shape.bounded(bounds)?));
                Shape::Record(elements.iter().map(element).collect::<Option<_>>()?)
            }
        })
    }
}
