//! `Word`: a number in the arithmetic of a block, so that the arithmetic is written once and read in many ways.
//!
//! A block writes its equations over any `Word`. Read as [`Machine`](crate::Machine), the equations compute: with 64
//! bits where [`Reach`](crate::Reach) shows that these suffice, else with 128. Read as [`Term`](crate::Term), they are
//! the statement that a solver proves of the VHDL. Between two narrowings everything is exact.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use crate::{Format, Narrowing, Rounding};

/// The truth of a condition, in a reading of words. Each reading has its own type for it.
pub trait Truth: Copy + Not<Output = Self> + BitAnd<Output = Self> + BitOr<Output = Self> {}

impl<B: Copy + Not<Output = B> + BitAnd<Output = B> + BitOr<Output = B>> Truth for B {}

/// An exact integer in one of its readings, in units of the least significant bit. Each reading of equations implements
/// it: machine integers, terms of a solver, ranges, real numbers and others.
///
/// If a reading reports losses, its words carry the losses by which they were made: sums and products add up the losses
/// of their operands, and [`narrow`](Word::narrow) adds its own.
///
/// ```
/// use hpu_signal::{Format, Machine, Narrowing, Overflow, Reach, Rounding, Word};
/// /// A spring that saturates, written once.
/// fn spring<W: Word>(stiffness: W, depth: W) -> W {
///     let (to, overflow) = (Format::unsigned(8), Overflow::Saturate);
///     (stiffness * depth).narrow(&Narrowing { from_frac: 4, to, rounding: Rounding::NearestUp, overflow })
/// }
/// // Computed, and its range.
/// assert_eq!(spring(Machine::<i64>::int(40), Machine::int(3)).narrowed().word, 8);
/// let most = spring(Reach::of(Format::unsigned(12)), Reach::of(Format::unsigned(12)));
/// assert_eq!((most.range.min, most.range.max), (0, 255));
/// ```
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
