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

    /// `value / 2^drop`, rounded. The value must be above `i128::MIN`.
    #[must_use]
    pub const fn shift(self, value: i128, drop: u32) -> i128 {
        if drop == 0 {
            return value;
        }
        if drop > 127 {
            // The quotient is below one half in size.
            return match self {
                Self::Truncate => value >> 127,
                _ => 0,
            };
        }
        let floor = value >> drop;
        let rest = value - (floor << drop); // 0 <= rest < 2^drop
        let half = 1i128 << (drop - 1);
        let up = match self {
            Self::Truncate => false,
            Self::TowardZero => value < 0 && rest != 0,
            Self::NearestUp => rest >= half,
            Self::NearestAway => rest > half || (rest == half && value >= 0),
            Self::NearestEven => rest > half || (rest == half && floor & 1 == 1),
        };
        floor + up as i128
    }
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

impl Narrowing {
    /// Narrows an exact value: round first, then overflow.
    ///
    /// A value to be widened (more fraction bits than it has) must leave room for the shift:
    /// `|value| < 2^(127 - added)`.
    ///
    /// # Example
    ///
    /// ```
    /// use hpu_signal::{Format, Narrowing, Overflow, Rounding};
    /// // The paper's truncation: a 24-bit product into 12 bits, the upper ones dropped.
    /// let drop_upper =
    ///     Narrowing { from_frac: 0, to: Format::unsigned(12), rounding: Rounding::Truncate, overflow: Overflow::Wrap };
    /// let torque = drop_upper.apply(70 * 60);
    /// assert_eq!((torque.word, torque.overflowed), (104, true));
    /// ```
    #[must_use]
    pub const fn apply(&self, value: i128) -> Narrowed {
        let drop = self.from_frac - self.to.frac();
        let (scaled, rounded) = if drop > 0 {
            let drop = drop as u32;
            let kept = if drop > 127 { 0 } else { (value >> drop) << drop };
            (self.rounding.shift(value, drop), kept != value)
        } else {
            (value << (-drop) as u32, false)
        };
        if self.to.holds(scaled) {
            return Narrowed { word: self.to.wrap(scaled), rounded, overflowed: false };
        }
        let kept = match self.overflow {
            Overflow::Wrap => scaled,
            Overflow::Saturate if scaled < self.to.min() => self.to.min(),
            Overflow::Saturate => self.to.max(),
        };
        Narrowed { word: self.to.wrap(kept), rounded, overflowed: true }
    }
}
