//! Numbers with their slopes over ranges of stiffness and parameters.

use std::array;

use crate::interval::Interval;

/// Greatest number of sides of a parameter box over which the function is enclosed.
pub(super) const MOST_SIDES: usize = 3;
/// Number of variables of a [`Jet`]: the stiffness, then the sides of a box.
pub(super) const ALONG: usize = 1 + MOST_SIDES;

/// A number that depends on the stiffness and on parameters: its enclosure at the middle of their ranges, its enclosure
/// over all of the ranges, and its derivatives over all of the ranges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet {
    pub middle: Interval,
    pub over: Interval,
    pub slopes: [Interval; ALONG],
}

impl Jet {
    pub const ZERO: Self = Self::constant(Interval::ZERO);

    pub const fn constant(value: Interval) -> Self {
        Self { middle: value, over: value, slopes: [Interval::ZERO; ALONG] }
    }

    /// Returns whether the number is 0 whatever the stiffness and the parameters are.
    pub fn is_zero(self) -> bool {
        self.middle == Interval::ZERO && self.over == Interval::ZERO && self.slopes == [Interval::ZERO; ALONG]
    }

    pub fn plus(self, other: Self) -> Self {
        Self {
            middle: self.middle.plus(other.middle),
            over: self.over.plus(other.over),
            slopes: array::from_fn(|of| self.slopes[of].plus(other.slopes[of])),
        }
    }

    pub fn minus(self, other: Self) -> Self {
        Self {
            middle: self.middle.minus(other.middle),
            over: self.over.minus(other.over),
            slopes: array::from_fn(|of| self.slopes[of].minus(other.slopes[of])),
        }
    }

    /// Returns the intersection of two enclosures of the same number.
    pub fn within(self, other: Self) -> Self {
        Self {
            middle: self.middle.within(other.middle),
            over: self.over.within(other.over),
            slopes: array::from_fn(|of| self.slopes[of].within(other.slopes[of])),
        }
    }

    /// Returns the same number with `over` intersected with its mean-value form: `middle` plus each slope times the
    /// distance `away` from the middle to the ends.
    pub fn tight(self, away: &[Interval; ALONG]) -> Self {
        let meant = self.slopes.iter().zip(away).fold(self.middle, |sum, (slope, away)| sum.plus(slope.times(*away)));
        Self { over: self.over.within(meant), ..self }
    }

    pub fn times(self, other: Self) -> Self {
        Self {
            middle: self.middle.times(other.middle),
            over: self.over.times(other.over),
            slopes: array::from_fn(|of| self.slopes[of].times(other.over).plus(self.over.times(other.slopes[of]))),
        }
    }

    /// Returns the product with a power of two.
    pub fn scaled(self, by: f64) -> Self {
        Self {
            middle: self.middle.scaled(by),
            over: self.over.scaled(by),
            slopes: self.slopes.map(|slope| slope.scaled(by)),
        }
    }
}
