//! The reach of words: ranges that show how many bits an equation takes.

use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use crate::{Format, Narrowing, Overflow, Rounding, Word};

/// The range of a number, and the greatest magnitude among all numbers from which it is computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reach {
    /// The least value.
    pub least: i128,
    /// The greatest value.
    pub most: i128,
    /// The greatest magnitude of all intermediate results, bounds of formats included.
    widest: u128,
}

impl Reach {
    /// Returns the reach from one number to another.
    pub fn new(least: i128, most: i128) -> Self {
        Self { least, most, widest: least.unsigned_abs().max(most.unsigned_abs()) }
    }

    /// Returns the reach of a word of a format.
    pub fn of(format: Format) -> Self {
        Self::new(format.min(), format.max())
    }

    /// Returns whether 64 bits suffice for everything from which these numbers are computed.
    pub fn fit_64(all: &[Self]) -> bool {
        all.iter().all(|reach| reach.widest < 1 << 62)
    }

    fn after(self, way: u128) -> Self {
        Self { widest: self.widest.max(way), ..self }
    }

    /// Returns the reach of these bounds, computed from both operands.
    fn both(self, other: Self, bounds: &[i128]) -> Self {
        let least = bounds.iter().copied().min().expect("bounds");
        let most = bounds.iter().copied().max().expect("bounds");
        Self::new(least, most).after(self.widest).after(other.widest)
    }
}

impl Add for Reach {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.both(other, &[self.least.saturating_add(other.least), self.most.saturating_add(other.most)])
    }
}

impl Sub for Reach {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.both(other, &[self.least.saturating_sub(other.most), self.most.saturating_sub(other.least)])
    }
}

impl Mul for Reach {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = |a: i128, b: i128| a.saturating_mul(b);
        let corners = [
            product(self.least, other.least),
            product(self.least, other.most),
            product(self.most, other.least),
            product(self.most, other.most),
        ];
        self.both(other, &corners)
    }
}

impl Neg for Reach {
    type Output = Self;
    fn neg(self) -> Self {
        self.both(self, &[self.least.saturating_neg(), self.most.saturating_neg()])
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
        Self::new(value, value)
    }
    fn of_bit(bit: Either) -> Self {
        Self::new(0, 1).after(bit.0)
    }
    fn shl(self, bits: u32) -> Self {
        self * Self::int(1i128.checked_shl(bits).unwrap_or(i128::MAX))
    }
    fn shr(self, bits: u32) -> Self {
        let floor = |value| Rounding::Truncate.shift(value, bits);
        self.both(self, &[floor(self.least), floor(self.most)])
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        if drop <= 0 {
            return self.shl(drop.unsigned_abs());
        }
        let round = |value| rounding.shift(value, drop.cast_unsigned());
        self.both(self, &[round(self.least), round(self.most)])
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let scaled = self.round(rule.rounding, rule.from_frac - rule.to.frac());
        let all = Self::of(rule.to);
        let fits = rule.to.holds(scaled.least) && rule.to.holds(scaled.most);
        let kept = match rule.overflow {
            _ if fits => scaled,
            Overflow::Wrap => all,
            Overflow::Saturate => scaled.limit(all.least, all.most),
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
            let bounds = [word.least, word.most, other.least, other.most];
            *word = word.both(other, &bounds).after(bit.0);
        }
        words
    }
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        let bounds: Vec<_> = table.iter().map(|&word| i128::from(word.into())).collect();
        self.both(self, &bounds)
    }
    fn lesser(self, other: Self) -> Self {
        self.both(other, &[self.least.min(other.least), self.most.min(other.most)])
    }
    fn greater(self, other: Self) -> Self {
        self.both(other, &[self.least.max(other.least), self.most.max(other.most)])
    }
    fn limit(self, least: i128, most: i128) -> Self {
        self.greater(Self::int(least)).lesser(Self::int(most))
    }
}
