//! Ranges of whole numbers.

use crate::Format;

/// The whole numbers from `min` to `max`. Sums and products saturate at the ends of `i128`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Span {
    /// The least.
    pub min: i128,
    /// The greatest.
    pub max: i128,
}

impl Span {
    /// Makes the range between two words.
    pub const fn new(min: i128, max: i128) -> Self {
        Self { min, max }
    }

    /// Makes the range of one word.
    pub const fn exact(value: i128) -> Self {
        Self { min: value, max: value }
    }

    /// Returns all words of a format.
    pub const fn of(format: Format) -> Self {
        Self { min: format.min(), max: format.max() }
    }

    /// Returns the least range that has both.
    pub fn hull(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the range of the sums.
    pub fn plus(self, other: Self) -> Self {
        Self { min: self.min.saturating_add(other.min), max: self.max.saturating_add(other.max) }
    }

    /// Returns the range of the products.
    pub fn times(self, other: Self) -> Self {
        let product = |a: i128, b: i128| Self::exact(a.saturating_mul(b));
        let [least, most] = [self.min, self.max].map(|a| product(a, other.min).hull(product(a, other.max)));
        least.hull(most)
    }

    /// Returns the range of its numbers over `2^drop`, rounded down.
    pub fn shifted(self, drop: i32) -> Self {
        self.map(|value| if drop >= 0 { value >> drop } else { value << -drop })
    }

    /// Returns the range of the results of a function that rises.
    pub fn map(self, rises: impl Fn(i128) -> i128) -> Self {
        Self { min: rises(self.min), max: rises(self.max) }
    }

    /// Returns the range of its numbers clamped.
    pub fn clamp(self, to: Self) -> Self {
        self.map(|value| value.clamp(to.min, to.max))
    }

    /// Returns the intersection of both, which must not be empty.
    pub fn meet(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether all of its numbers are in the other range.
    pub fn is_within(self, other: Self) -> bool {
        other.min <= self.min && self.max <= other.max
    }
}
