//! The reach of words: ranges that show how many bits an equation takes.

use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use crate::{Format, Narrowing, Overflow, Rounding, Span, Word};

/// The range of a number, and the greatest magnitude among all numbers from which it is computed.
///
/// ```
/// use hpu_signal::{Format, Reach};
/// let factor = Reach::of(Format::signed(18));
/// let product = factor * factor;
/// assert_eq!((product.range.min, product.range.max), (-(1 << 17) * ((1 << 17) - 1), 1 << 34));
/// assert!(Reach::fit_64(&[product]));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reach {
    /// The range.
    pub range: Span,
    /// The greatest magnitude of all intermediate results, bounds of formats included.
    widest: u128,
}

impl Reach {
    /// Returns the reach of a number in a range.
    pub fn new(range: Span) -> Self {
        Self { range, widest: range.min.unsigned_abs().max(range.max.unsigned_abs()) }
    }

    /// Returns the reach of a word of a format.
    pub fn of(format: Format) -> Self {
        Self::new(Span::of(format))
    }

    /// Returns whether 64 bits suffice for everything from which these numbers are computed.
    pub fn fit_64(all: &[Self]) -> bool {
        all.iter().all(|reach| reach.widest < 1 << 62)
    }

    fn after(self, way: u128) -> Self {
        Self { widest: self.widest.max(way), ..self }
    }

    /// Returns the reach of a number in a range, computed from this one.
    fn to(self, range: Span) -> Self {
        Self::new(range).after(self.widest)
    }

    /// Returns the reach of a number in a range, computed from both operands.
    fn both(self, other: Self, range: Span) -> Self {
        self.to(range).after(other.widest)
    }
}

impl Add for Reach {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.both(other, self.range.plus(other.range))
    }
}

impl Sub for Reach {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Reach {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.both(other, self.range.times(other.range))
    }
}

impl Neg for Reach {
    type Output = Self;
    fn neg(self) -> Self {
        self.to(self.range.times(Span::exact(-1)))
    }
}

/// A condition that may be true or false, with the greatest magnitude among the numbers from which it is computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Either(u128);

impl Not for Either {
    type Output = Self;
    fn not(self) -> Self {
        self
    }
}

impl BitAnd for Either {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }
}

impl BitOr for Either {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }
}

impl Word for Reach {
    type Bit = Either;

    fn int(value: i128) -> Self {
        Self::new(Span::exact(value))
    }
    fn of_bit(bit: Either) -> Self {
        Self::new(Span::new(0, 1)).after(bit.0)
    }
    fn shl(self, bits: u32) -> Self {
        self * Self::int(1i128.checked_shl(bits).unwrap_or(i128::MAX))
    }
    fn shr(self, bits: u32) -> Self {
        self.to(self.range.map(|value| Rounding::Truncate.shift(value, bits)))
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        if drop <= 0 {
            return self.shl(drop.unsigned_abs());
        }
        self.to(self.range.map(|value| rounding.shift(value, drop.cast_unsigned())))
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let scaled = self.round(rule.rounding, rule.from_frac - rule.to.frac());
        let all = Self::of(rule.to);
        let kept = match rule.overflow {
            _ if scaled.range.is_within(all.range) => scaled,
            Overflow::Wrap => all,
            Overflow::Saturate => scaled.limit(all.range.min, all.range.max),
        };
        kept.after(scaled.widest).after(all.widest)
    }
    fn wrap(self, to: Format) -> Self {
        self.narrow(&Narrowing::wrapping(to))
    }
    fn at_least(self, other: Self) -> Either {
        Either(self.widest.max(other.widest))
    }
    fn equals(self, other: Self) -> Either {
        self.at_least(other)
    }
    fn branch<const N: usize>(
        bit: Either,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N] {
        let (mut words, no) = (yes(), no());
        for (word, other) in words.iter_mut().zip(no) {
            *word = word.both(other, word.range.hull(other.range)).after(bit.0);
        }
        words
    }
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        let words = table.iter().map(|&word| Span::exact(i128::from(word.into())));
        self.to(words.reduce(Span::hull).expect("a word"))
    }
    fn lesser(self, other: Self) -> Self {
        let (one, other_range) = (self.range, other.range);
        self.both(other, Span::new(one.min.min(other_range.min), one.max.min(other_range.max)))
    }
    fn greater(self, other: Self) -> Self {
        let (one, other_range) = (self.range, other.range);
        self.both(other, Span::new(one.min.max(other_range.min), one.max.max(other_range.max)))
    }
    fn limit(self, least: i128, most: i128) -> Self {
        self.greater(Self::int(least)).lesser(Self::int(most))
    }
}
