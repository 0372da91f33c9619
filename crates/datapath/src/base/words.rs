//! Rules that the words of many blocks share: how they are narrowed, what is accepted, and their generics.

use hpu_signal::{Format, Narrowing, Overflow, Rounding, Word};

use crate::base::config::within;
use crate::{ConfigError, Generic};

/// Returns the rule that rounds to the nearest, ties up, and drops the upper bits.
pub(crate) const fn nearest(from_frac: i32, to: Format) -> Narrowing {
    Narrowing { from_frac, to, rounding: Rounding::NearestUp, overflow: Overflow::Wrap }
}

/// Divides by `2^drop` to the nearest, ties up, then clamps to the range of the actuator. The clamp is a limit of the
/// law and counts as an overflow.
#[inline]
pub(crate) fn limited<W: Word>(value: W, drop: i32, [least, most]: [i128; 2]) -> W {
    let whole = value.round(Rounding::NearestUp, drop);
    let limited = whole.limit(least, most);
    limited.overflowing(!limited.equals(whole))
}

/// Returns the sum of two terms with their own fraction bits, and the fraction bits of the sum. Both are aligned, so
/// that nothing is lost.
#[inline]
pub(crate) fn aligned_sum<W: Word>(a: (W, i32), b: (W, i32)) -> (W, i32) {
    let frac = a.1.max(b.1);
    let aligned = |(word, own): (W, i32)| word.shl((frac - own).cast_unsigned());
    (aligned(a) + aligned(b), frac)
}

/// Refuses a word of more than 40 bits or 30 fraction bits. Aligned sums of products of such words have room in 128
/// bits.
pub(crate) fn accept(block: &'static str, word: &str, format: Format, signed: bool) -> Result<(), ConfigError> {
    let fits = format.int() >= 0 && (0..=30).contains(&format.frac()) && (2..=40).contains(&format.width());
    if fits && format.is_signed() == signed {
        return Ok(());
    }
    let sign = if signed { "signed" } else { "unsigned" };
    let accepted = format!("{sign}, 2 to 40 bits, 0 to 30 of them fraction bits");
    Err(ConfigError::new(block, format!("{word} is {format}"), accepted))
}

/// Refuses a sine that cannot hold 1, or that has too few bits to tell angles apart.
pub(crate) fn accept_trig(block: &'static str, trig: Format) -> Result<(), ConfigError> {
    accept(block, "TRIG", trig, true)?;
    within(block, "TRIG_INT", trig.int().unsigned_abs(), 1..=35)?;
    within(block, "TRIG_FRAC", trig.frac().unsigned_abs(), 4..=30)
}

/// Returns the VHDL generics of a format.
pub(crate) fn parts(int: &'static str, frac: &'static str, format: Format) -> [(&'static str, Generic); 2] {
    [(int, Generic::Integer(format.int().into())), (frac, Generic::Integer(format.frac().into()))]
}

/// Returns a generic of type `natural`.
pub(crate) fn natural(name: &'static str, value: u32) -> (&'static str, Generic) {
    (name, Generic::Integer(value.into()))
}
