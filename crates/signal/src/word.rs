//! `Word`: a number in the arithmetic of a block, so that the arithmetic is written once and read in many ways.
//!
//! A block writes its equations over any `Word`. Read as [`Machine`], the equations compute: with 64 bits where
//! [`Reach`] shows that these suffice, else with 128. Read as [`Term`](crate::Term), they are the statement that a
//! solver proves of the VHDL. Between two narrowings everything is exact.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use num_traits::{AsPrimitive, PrimInt, Signed};

use crate::{Format, Narrowed, Narrowing, Overflow, Rounding};

/// The truth of a condition, in a reading of words. Each reading has its own type for it.
pub trait Truth: Copy + Not<Output = Self> + BitAnd<Output = Self> + BitOr<Output = Self> {}

impl<B: Copy + Not<Output = B> + BitAnd<Output = B> + BitOr<Output = B>> Truth for B {}

/// An exact integer in one of its readings, in units of the least significant bit. Each reading of equations implements
/// it: machine integers, terms of a solver, ranges, real numbers and others.
///
/// If a reading reports losses, its words carry the losses by which they were made: sums and products add up the losses
/// of their operands, and [`narrow`](Word::narrow) adds its own.
pub trait Word:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + Debug
{
    /// The result of a comparison.
    type Bit: Truth;

    /// Returns a constant of the hardware.
    fn int(value: i128) -> Self;
    /// Returns a bit as the number 0 or 1.
    fn of_bit(bit: Self::Bit) -> Self;
    /// Returns the number times `2^bits`. It aligns fractions and costs no logic.
    fn shl(self, bits: u32) -> Self;
    /// Returns the number divided by `2^bits`, rounded down. It reports no loss.
    fn shr(self, bits: u32) -> Self;
    /// Divides by `2^drop` and rounds; multiplies where `drop` is negative. Reports the loss.
    fn round(self, rounding: Rounding, drop: i32) -> Self;
    /// Narrows to a word: rounds, then makes it fit. Reports the loss.
    fn narrow(self, rule: &Narrowing) -> Self;
    /// Returns the low bits as a word of that format. It reports no loss, because a count modulo its width loses
    /// nothing.
    fn wrap(self, to: Format) -> Self;
    /// Returns whether the number is at least another.
    fn at_least(self, other: Self) -> Self::Bit;
    /// Returns whether the number equals another.
    fn equals(self, other: Self) -> Self::Bit;
    /// Returns the result of one of two branches; a reading that computes evaluates only that branch.
    fn branch<const N: usize>(
        bit: Self::Bit,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N];
    /// Returns the word of a table at this address, which must lie in the table.
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self;
    /// Returns the word of a table of sines, each rounded to the nearest word, at this address; negative addresses are
    /// at the table's end. A reading in real numbers computes the sine instead.
    fn sine<T: Copy + Into<i64>>(self, sine: Sine, table: &[T]) -> Self {
        let _ = sine;
        self.look_up(table)
    }
    /// Returns whether a bit is set; bit 0 is the lowest.
    fn bit(self, place: u32) -> Self::Bit {
        self.shr(place).wrap(Format::BIT).is_set()
    }
    /// Returns the same number, and notes that the VHDL has a net of this name for it, with `width` bits including the
    /// sign. A proof may start again from that net.
    fn cut(self, name: &str, width: u32) -> Self {
        let _ = (name, width);
        self
    }
    /// Returns the number without the losses by which it was made.
    fn shed(self) -> Self {
        self
    }
    /// Returns the number with this overflow reported too.
    fn overflowing(self, bit: Self::Bit) -> Self {
        let _ = bit;
        self
    }

    /// Returns whether the number is above another.
    fn above(self, other: Self) -> Self::Bit {
        !other.at_least(self)
    }
    /// Returns whether the number is a set bit, or any number but 0.
    fn is_set(self) -> Self::Bit {
        !self.equals(Self::int(0))
    }
    /// Returns one of two words.
    fn select(bit: Self::Bit, yes: Self, no: Self) -> Self {
        let [word] = Self::branch(bit, || [yes], || [no]);
        word
    }
    /// Returns the lesser of two, with its losses; of equal ones, the first.
    fn lesser(self, other: Self) -> Self {
        Self::select(self.above(other), other, self)
    }
    /// Returns the greater of two, with its losses; of equal ones, the first.
    fn greater(self, other: Self) -> Self {
        Self::select(other.above(self), other, self)
    }
    /// Returns the number clamped, with its earlier losses; the clamp reports none.
    fn limit(self, least: i128, most: i128) -> Self;
}

/// `2^frac sin(2 pi address num / den)`, or the cosine.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sine {
    /// The share of a turn from one address to the next: its numerator.
    pub num: u32,
    /// The denominator of that share.
    pub den: u32,
    /// Whether the table holds the cosine.
    pub is_cosine: bool,
    /// Fraction bits of the table's words.
    pub frac: i32,
}

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
    #[must_use]
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
            Self::NearestAway => is_above || is_half && value >= T::zero(),
            Self::NearestEven => is_above || is_half && (floor & T::one()) == T::one(),
        };
        if up { floor + T::one() } else { floor }
    }
}

impl Narrowing {
    /// Returns the rule that makes a word of one format a word of another: it rounds nothing away and drops upper bits.
    #[must_use]
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
    #[must_use]
    pub fn exact(value: T) -> Self {
        Self { value, rounded: false, overflowed: false }
    }

    /// Returns the word of a port or register.
    #[inline]
    #[must_use]
    pub fn of(word: i64) -> Self {
        Self::exact(T::low(word.into()))
    }

    /// Returns a word that has lost something.
    #[inline]
    #[must_use]
    pub fn of_narrowed(Narrowed { word, rounded, overflowed }: Narrowed) -> Self {
        Self { value: T::low(word.into()), rounded, overflowed }
    }

    /// Returns the number as a word, with the losses by which it was made.
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
    #[must_use]
    pub fn new(least: i128, most: i128) -> Self {
        Self { least, most, widest: least.unsigned_abs().max(most.unsigned_abs()) }
    }

    /// Returns the reach of a word of a format.
    #[must_use]
    pub fn of(format: Format) -> Self {
        Self::new(format.min(), format.max())
    }

    /// Returns whether 64 bits suffice for everything from which these numbers are computed.
    #[must_use]
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
