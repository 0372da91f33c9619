//! Words that compute: `i64` or `i128`, and the flags of what was lost.

use std::fmt::Debug;
use std::ops::{Add, Mul, Neg, Sub};

use num_traits::{AsPrimitive, PrimInt, Signed};

use crate::{Format, Narrowed, Narrowing, Overflow, Rounding, Word};

/// A machine integer: `i64` or `i128`.
pub trait Int: PrimInt + Signed + AsPrimitive<i64> + Debug + 'static {
    /// Its number of bits.
    const BITS: u32;
    /// Returns the integer with these low bits.
    fn low(value: i128) -> Self;
}

impl Int for i64 {
    const BITS: u32 = 64;
    #[inline]
    fn low(value: i128) -> Self {
        value as Self
    }
}

impl Int for i128 {
    const BITS: u32 = 128;
    #[inline]
    fn low(value: i128) -> Self {
        value
    }
}

impl Rounding {
    /// Returns `value / 2^drop`, rounded. The value must be above the least one of its type.
    #[inline]
    pub fn shift<T: Int>(self, value: T, drop: u32) -> T {
        if drop == 0 {
            return value;
        }
        if drop >= T::BITS {
            // The quotient is below one half in magnitude.
            return if self == Self::Truncate { value >> (T::BITS as usize - 1) } else { T::zero() };
        }
        let floor = value >> drop as usize;
        if self == Self::Truncate {
            return floor;
        }
        let rest = value - (floor << drop as usize); // 0 <= rest < 2^drop, unless the sign bit is a half
        let half = T::one() << (drop as usize - 1);
        let is_above = (rest ^ half) != T::zero() && (rest & half) != T::zero();
        let is_half = rest == half;
        let up = match self {
            Self::Truncate => false,
            Self::TowardZero => value < T::zero() && rest != T::zero(),
            Self::NearestUp => is_above || is_half,
            Self::NearestDown => is_above,
            Self::NearestAway => is_above || is_half && value >= T::zero(),
            Self::NearestInward => is_above || is_half && value < T::zero(),
            Self::NearestEven => is_above || is_half && (floor & T::one()) == T::one(),
            Self::NearestOdd => is_above || is_half && (floor & T::one()) == T::zero(),
        };
        if up { floor + T::one() } else { floor }
    }
}

impl Narrowing {
    /// Returns the rule that makes a word of one format a word of another: it rounds nothing away and drops upper bits.
    pub const fn wrapping(to: Format) -> Self {
        Self { from_frac: to.frac(), to, rounding: Rounding::Truncate, overflow: Overflow::Wrap }
    }

    /// Returns the word of a rounded value, and whether the value did not fit. A machine integer must hold the format's
    /// bounds.
    #[inline]
    fn fit<T: Int>(&self, value: T) -> (T, bool) {
        let (least, most) = (T::low(self.to.min()), T::low(self.to.max()));
        if least <= value && value <= most {
            return (value, false);
        }
        let word = match self.overflow {
            Overflow::Wrap => T::low(self.to.wrap_low(value.as_()).into()),
            Overflow::Saturate if value < least => least,
            Overflow::Saturate => most,
        };
        (word, true)
    }

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
    /// let to = Format::unsigned(12);
    /// let drop_upper = Narrowing { from_frac: 0, to, rounding: Rounding::Truncate, overflow: Overflow::Wrap };
    /// let torque = drop_upper.apply(70 * 60);
    /// assert_eq!((torque.word, torque.overflowed), (104, true));
    /// ```
    #[inline]
    pub fn apply(&self, value: i128) -> Narrowed {
        Machine::exact(value).narrow(self).narrowed()
    }
}

/// A number that a machine integer computes, with the losses by which it was made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Machine<T> {
    value: T,
    rounded: bool,
    overflowed: bool,
}

impl<T: Int> Machine<T> {
    /// Returns a number that has lost nothing.
    #[inline]
    pub fn exact(value: T) -> Self {
        Self { value, rounded: false, overflowed: false }
    }

    /// Returns the word of a port or register.
    #[inline]
    pub fn of(word: i64) -> Self {
        Self::exact(T::low(word.into()))
    }

    /// Returns a word that has lost something.
    #[inline]
    pub fn of_narrowed(Narrowed { word, rounded, overflowed }: Narrowed) -> Self {
        Self { value: T::low(word.into()), rounded, overflowed }
    }

    /// Returns the number as a word, with the losses by which it was made.
    #[inline]
    pub fn narrowed(self) -> Narrowed {
        Narrowed { word: self.value.as_(), rounded: self.rounded, overflowed: self.overflowed }
    }

    #[inline]
    fn with(self, value: T) -> Self {
        Self { value, ..self }
    }

    #[inline]
    fn both(self, other: Self, value: T) -> Self {
        Self { value, rounded: self.rounded | other.rounded, overflowed: self.overflowed | other.overflowed }
    }
}

impl<T: Int> Add for Machine<T> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.both(other, self.value + other.value)
    }
}

impl<T: Int> Sub for Machine<T> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.both(other, self.value - other.value)
    }
}

impl<T: Int> Mul for Machine<T> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.both(other, self.value * other.value)
    }
}

impl<T: Int> Neg for Machine<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.with(-self.value)
    }
}

impl<T: Int> Word for Machine<T> {
    type Bit = bool;

    #[inline]
    fn int(value: i128) -> Self {
        Self::exact(T::low(value))
    }
    #[inline]
    fn of_bit(bit: bool) -> Self {
        Self::exact(if bit { T::one() } else { T::zero() })
    }
    #[inline]
    fn shl(self, bits: u32) -> Self {
        self.with(self.value << bits as usize)
    }
    #[inline]
    fn shr(self, bits: u32) -> Self {
        self.with(Rounding::Truncate.shift(self.value, bits))
    }
    #[inline]
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        if drop <= 0 {
            return self.with(self.value << drop.unsigned_abs() as usize);
        }
        let (value, bits) = (self.value, drop.cast_unsigned());
        let is_rest =
            if bits < T::BITS { (value >> bits as usize) << bits as usize != value } else { value != T::zero() };
        Self { rounded: self.rounded | is_rest, ..self.with(rounding.shift(value, bits)) }
    }
    #[inline]
    fn narrow(self, rule: &Narrowing) -> Self {
        let rounded = self.round(rule.rounding, rule.from_frac - rule.to.frac());
        let (value, overflows) = rule.fit(rounded.value);
        rounded.with(value).overflowing(overflows)
    }
    #[inline]
    fn wrap(self, to: Format) -> Self {
        self.with(T::low(to.wrap_low(self.value.as_()).into()))
    }
    #[inline]
    fn at_least(self, other: Self) -> bool {
        self.value >= other.value
    }
    #[inline]
    fn equals(self, other: Self) -> bool {
        self.value == other.value
    }
    #[inline]
    fn branch<const N: usize>(bit: bool, yes: impl FnOnce() -> [Self; N], no: impl FnOnce() -> [Self; N]) -> [Self; N] {
        if bit { yes() } else { no() }
    }
    #[inline]
    fn look_up<U: Copy + Into<i64>>(self, table: &[U]) -> Self {
        let address = usize::try_from(self.value.as_()).expect("an address of the table");
        self.with(T::low(i128::from(table[address].into())))
    }
    #[inline]
    fn shed(self) -> Self {
        Self::exact(self.value)
    }
    #[inline]
    fn overflowing(self, bit: bool) -> Self {
        Self { overflowed: self.overflowed | bit, ..self }
    }
    #[inline]
    fn limit(self, least: i128, most: i128) -> Self {
        self.with(self.value.max(T::low(least)).min(T::low(most)))
    }
}
