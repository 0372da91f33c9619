//! Narrowing: the only place where bits are lost. It rounds first, then treats overflow, and reports both losses.

use crate::Format;

/// The treatment of the bits below the least significant bit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Rounding {
    /// Drops them, which rounds toward minus infinity and costs no logic.
    Truncate,
    /// Rounds toward zero.
    TowardZero,
    /// Rounds to the nearest value; ties go toward plus infinity (add one half, then truncate).
    NearestUp,
    /// Rounds to the nearest value; ties go toward minus infinity.
    NearestDown,
    /// Rounds to the nearest value; ties go away from zero.
    NearestAway,
    /// Rounds to the nearest value; ties go toward zero.
    NearestInward,
    /// Rounds to the nearest value; ties go to the even neighbour.
    NearestEven,
    /// Rounds to the nearest value; ties go to the odd neighbour.
    NearestOdd,
}

impl Rounding {
    /// Every rounding, for tests and lists.
    pub const ALL: [Self; 8] = [
        Self::Truncate,
        Self::TowardZero,
        Self::NearestUp,
        Self::NearestDown,
        Self::NearestAway,
        Self::NearestInward,
        Self::NearestEven,
        Self::NearestOdd,
    ];

    /// Returns its number in VHDL (`hdl/rounding_pkg.vhd`), which is its place in [`ALL`](Self::ALL).
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Returns its name in VHDL, in small letters.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truncate => "truncate",
            Self::TowardZero => "toward_zero",
            Self::NearestUp => "nearest_up",
            Self::NearestDown => "nearest_down",
            Self::NearestAway => "nearest_away",
            Self::NearestInward => "nearest_inward",
            Self::NearestEven => "nearest_even",
            Self::NearestOdd => "nearest_odd",
        }
    }
}

/// The treatment of a rounded value that does not fit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Overflow {
    /// Drops the upper bits.
    Wrap,
    /// Clamps to the nearest value that the word holds.
    Saturate,
}

impl Overflow {
    /// Both behaviours, for tests and lists.
    pub const ALL: [Self; 2] = [Self::Wrap, Self::Saturate];
}

/// A rule that turns an exact integer with `from_frac` fraction bits into a word of format `to`.
///
/// ```
/// use hpu_signal::{Format, Narrowing, Overflow, Rounding};
/// // From 8 fraction bits to 4, rounded to the nearest.
/// let to = Format::new(true, 3, 4)?;
/// let rule = Narrowing { from_frac: 8, to, rounding: Rounding::NearestEven, overflow: Overflow::Saturate };
/// let narrowed = rule.apply(0b1_0001_1000);
/// assert_eq!((narrowed.word, narrowed.rounded, narrowed.overflowed), (0b1_0010, true, false));
/// # Ok::<(), hpu_signal::FormatError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Narrowing {
    /// Number of fraction bits of the exact value.
    pub from_frac: i32,
    /// Format of the word.
    pub to: Format,
    /// The treatment of the bits below the least significant bit.
    pub rounding: Rounding,
    /// The treatment of a rounded value that does not fit.
    pub overflow: Overflow,
}

/// A word, and whether bits were lost to make it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Narrowed {
    /// The word.
    pub word: i64,
    /// Whether non-zero bits below the least significant one were dropped.
    pub rounded: bool,
    /// Whether the rounded value did not fit.
    pub overflowed: bool,
}
