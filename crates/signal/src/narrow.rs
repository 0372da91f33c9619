//! Narrowing: the one place where bits are lost, in one fixed order (round, then overflow), and told.

use crate::Format;

/// What happens to the bits below the least significant one.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Rounding {
    /// Drop them: toward minus infinity. Costs no logic.
    Truncate,
    /// Toward zero.
    TowardZero,
    /// To the nearest; ties toward plus infinity (add one half, then truncate).
    NearestUp,
    /// To the nearest; ties away from zero.
    NearestAway,
    /// To the nearest; ties to the even neighbour.
    NearestEven,
}

impl Rounding {
    /// Every rounding, for tests and lists.
    pub const ALL: [Self; 5] =
        [Self::Truncate, Self::TowardZero, Self::NearestUp, Self::NearestAway, Self::NearestEven];
}

/// What happens when the rounded value does not fit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Overflow {
    /// Drop the upper bits.
    Wrap,
    /// Clamp to the nearest value the word holds.
    Saturate,
}

impl Overflow {
    /// Both behaviours, for tests and lists.
    pub const ALL: [Self; 2] = [Self::Wrap, Self::Saturate];
}

/// A rule that turns an exact integer with `from_frac` fraction bits into a word of format `to`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Narrowing {
    /// Fraction bits of the exact value.
    pub from_frac: i32,
    /// The word's format.
    pub to: Format,
    /// What happens below.
    pub rounding: Rounding,
    /// What happens above.
    pub overflow: Overflow,
}

/// A word, and what was lost to make it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Narrowed {
    /// The word.
    pub word: i64,
    /// Whether non-zero bits below the least significant one were dropped.
    pub rounded: bool,
    /// Whether the rounded value did not fit.
    pub overflowed: bool,
}
