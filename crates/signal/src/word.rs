//! `Word`: what a number is to the arithmetic of a block, so that the arithmetic is written once and read in many ways.
//!
//! A block writes its equations over any `Word`. Read as [`Machine`] they compute, with 64 bits where [`Reach`] shows
//! that these suffice and with 128 else; read as [`Term`](crate::Term) they are what a solver proves of the VHDL.
//! Between two narrowings everything is exact.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use num_traits::{AsPrimitive, PrimInt, Signed};

use crate::{Format, Narrowed, Narrowing, Overflow, Rounding};

/// Whether something holds, in a reading of words.
pub trait Truth: Copy + Not<Output = Self> + BitAnd<Output = Self> + BitOr<Output = Self> {}

impl<B: Copy + Not<Output = B> + BitAnd<Output = B> + BitOr<Output = B>> Truth for B {}

/// An exact integer in one of its readings, in units of the least significant bit.
///
/// Words carry along what was lost to make them, where a reading tells that: sums and products add up the losses of
/// their parts, [`narrow`](Word::narrow) adds its own.
pub trait Word:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + Debug
{
    /// What comparisons give.
    type Bit: Truth;

    /// A constant of the hardware.
    fn int(value: i128) -> Self;
    /// A bit as the number 0 or 1.
    fn of_bit(bit: Self::Bit) -> Self;
    /// Times `2^bits`: what lines fractions up, and costs no logic.
    fn shl(self, bits: u32) -> Self;
    /// Divided by `2^bits`, rounded down; nothing is told of what that loses.
    fn shr(self, bits: u32) -> Self;
    /// Divided by `2^drop` and rounded; times as much, where that is negative. Tells what is lost.
    fn round(self, rounding: Rounding, drop: i32) -> Self;
    /// Into a word: rounded, then made to fit. Tells what is lost.
    fn narrow(self, rule: &Narrowing) -> Self;
    /// The low bits, as a word of that format: what counts modulo its width loses nothing.
    fn wrap(self, to: Format) -> Self;
    /// Whether it is not less than another.
    fn at_least(self, other: Self) -> Self::Bit;
    /// Whether it is the same number as another.
    fn equals(self, other: Self) -> Self::Bit;
    /// What one of two branches gives; a reading that computes takes the one alone.
    fn branch<const N: usize>(
        bit: Self::Bit,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N];
    /// The word of a table at this address, which is one of the table's.
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self;
    /// The word of a table of nearest words to a sine, at this address; negative ones stand at the table's end. A
    /// reading in real numbers takes the sine.
    fn sine<T: Copy + Into<i64>>(self, sine: Sine, table: &[T]) -> Self {
        let _ = sine;
        self.look_up(table)
    }
    /// Whether a bit is set, counted from the lowest, 0.
    fn bit(self, place: u32) -> Self::Bit {
        self.shr(place).wrap(Format::BIT).is_set()
    }
    /// The same number, of so many bits with its sign, where the VHDL has a net of this name: a proof may begin anew
    /// from it.
    fn cut(self, name: &str, width: u32) -> Self {
        let _ = (name, width);
        self
    }
    /// Without what was lost to make it.
    fn shed(self) -> Self {
        self
    }
    /// With this overflow told, too.
    fn overflowing(self, bit: Self::Bit) -> Self {
        let _ = bit;
        self
    }

    /// Whether it is more than another.
    fn above(self, other: Self) -> Self::Bit {
        !other.at_least(self)
    }
    /// Whether it is a bit that is set, or any number but 0.
    fn is_set(self) -> Self::Bit {
        !self.equals(Self::int(0))
    }
    /// One of two words.
    fn select(bit: Self::Bit, yes: Self, no: Self) -> Self {
        let [word] = Self::branch(bit, || [yes], || [no]);
        word
    }
    /// The lesser of two, the first of two equal ones, with what that one lost.
    fn lesser(self, other: Self) -> Self {
        Self::select(self.above(other), other, self)
    }
    /// The greater of two, the first of two equal ones, with what that one lost.
    fn greater(self, other: Self) -> Self {
        Self::select(other.above(self), other, self)
    }
    /// Clamped, with what it lost before; the clamp tells nothing of its own.
    fn limit(self, least: i128, most: i128) -> Self;
}

/// `2^frac sin(2 pi address num / den)`, or the cosine.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sine {
    /// The part of a turn from an address to the next: numerator.
    pub num: u32,
    /// Its denominator.
    pub den: u32,
    /// Whether it is the cosine.
    pub is_cosine: bool,
    /// Fraction bits.
    pub frac: i32,
}

/// An integer of the machine.
pub trait Int: PrimInt + Signed + AsPrimitive<i64> + Debug + 'static {
    /// Its bits.
    const BITS: u32;
    /// The integer of these low bits.
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
    /// `value / 2^drop`, rounded. The value must be above the least one of its type.
    #[inline]
    #[must_use]
    pub fn shift<T: Int>(self, value: T, drop: u32) -> T {
        if drop == 0 {
            return value;
        }
        if drop >= T::BITS {
            // The quotient is below one half in size.
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
            Self::NearestAway => is_above || is_half && value >= T::zero(),
            Self::NearestEven => is_above || is_half && (floor & T::one()) == T::one(),
        };
        if up { floor + T::one() } else { floor }
    }
}

impl Narrowing {
    /// The rule that takes a word of a format as one of another: nothing is rounded away, upper bits are dropped.
    #[must_use]
    pub const fn wrapping(to: Format) -> Self {
        Self { from_frac: to.frac(), to, rounding: Rounding::Truncate, overflow: Overflow::Wrap }
    }

    /// The word of a rounded value, and whether it did not fit. A machine integer must hold the format's bounds.
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
    /// let drop_upper =
    ///     Narrowing { from_frac: 0, to: Format::unsigned(12), rounding: Rounding::Truncate, overflow: Overflow::Wrap };
    /// let torque = drop_upper.apply(70 * 60);
    /// assert_eq!((torque.word, torque.overflowed), (104, true));
    /// ```
    #[inline]
    #[must_use]
    pub fn apply(&self, value: i128) -> Narrowed {
        Machine::exact(value).narrow(self).narrowed()
    }
}

/// A number as a machine integer computes it, with what was lost to make it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Machine<T> {
    value: T,
    rounded: bool,
    overflowed: bool,
}

impl<T: Int> Machine<T> {
    /// A number that has lost nothing.
    #[inline]
    #[must_use]
    pub fn exact(value: T) -> Self {
        Self { value, rounded: false, overflowed: false }
    }

    /// The word of a port or register.
    #[inline]
    #[must_use]
    pub fn of(word: i64) -> Self {
        Self::exact(T::low(word.into()))
    }

    /// A word that has lost something.
    #[inline]
    #[must_use]
    pub fn of_narrowed(Narrowed { word, rounded, overflowed }: Narrowed) -> Self {
        Self { value: T::low(word.into()), rounded, overflowed }
    }

    /// As a word, with what was lost to make it.
    #[inline]
    #[must_use]
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

/// How far a number may reach, and how far all that it is made of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reach {
    /// The least that it may be.
    pub least: i128,
    /// The most that it may be.
    pub most: i128,
    /// The greatest magnitude on the way to it, bounds of formats included.
    widest: u128,
}

impl Reach {
    /// From one number to another.
    #[must_use]
    pub fn new(least: i128, most: i128) -> Self {
        Self { least, most, widest: least.unsigned_abs().max(most.unsigned_abs()) }
    }

    /// What a word of a format may be.
    #[must_use]
    pub fn of(format: Format) -> Self {
        Self::new(format.min(), format.max())
    }

    /// Whether 64 bits suffice for all that these are made of.
    #[must_use]
    pub fn fit_64(all: &[Self]) -> bool {
        all.iter().all(|reach| reach.widest < 1 << 62)
    }

    fn after(self, way: u128) -> Self {
        Self { widest: self.widest.max(way), ..self }
    }

    /// The reach of these bounds, after both operands.
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

/// Either truth, with the greatest magnitude on the way to it.
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
