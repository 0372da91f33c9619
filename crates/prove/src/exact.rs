//! Reads equations as words beside the exact values of their operands. This tells the losses by rounding and overflow.
//!
//! Exact means `f64` here: products of up to 53 bits.

use hpu_signal::{Format, Narrowing, Overflow, Rounding, Word};

use super::real::float;

/// A word, beside its value without losses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Exact {
    word: i128,
    /// The word, had no limit applied.
    whole: i128,
    /// The word, had no rounding applied either.
    exact: f64,
    losses: Losses,
}

/// The losses of a word, in units of the least significant bit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Losses {
    /// The largest loss by rounding of a value within its limits.
    pub rounded: f64,
    /// The farthest that any value was beyond its limits.
    pub beyond: f64,
    /// Whether a limit could apply at all, and whether upper bits were dropped.
    pub narrows: bool,
    pub(crate) wraps: bool,
}

impl Losses {
    /// Returns the worse of each loss.
    pub fn worse(self, other: Self) -> Self {
        Self {
            rounded: self.rounded.max(other.rounded),
            beyond: self.beyond.max(other.beyond),
            narrows: self.narrows || other.narrows,
            wraps: self.wraps || other.wraps,
        }
    }
}

/// The losses of a word that has lost nothing.
const NONE: Losses = Losses { rounded: 0.0, beyond: 0.0, narrows: false, wraps: false };

impl Exact {
    /// Makes a word whose losses start from zero: losses of the words it was computed from do not count.
    pub fn of(word: i128) -> Self {
        Self { word, whole: word, exact: float(word), losses: NONE }
    }

    /// Returns the word itself.
    pub fn word(self) -> i128 {
        self.word
    }

    /// Returns the loss by rounding, and how far the word was beyond its limits, in units of the least significant bit.
    pub fn lost(self) -> [f64; 2] {
        [(self.exact - float(self.whole)).abs(), self.losses.beyond]
    }

    /// Returns all losses. A value beyond its limits counts as limited, not as rounded.
    pub fn losses(self) -> Losses {
        let [rounded, beyond] = self.lost();
        Losses { rounded: if beyond == 0.0 { rounded } else { 0.0 }, ..self.losses }
    }

    fn both(self, other: Self, whole: impl Fn(i128, i128) -> i128, exact: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            word: whole(self.word, other.word),
            whole: whole(self.whole, other.whole),
            exact: exact(self.exact, other.exact),
            losses: self.losses.worse(other.losses),
        }
    }

    fn each(self, whole: impl Fn(i128) -> i128, exact: impl Fn(f64) -> f64) -> Self {
        Self { word: whole(self.word), whole: whole(self.whole), exact: exact(self.exact), ..self }
    }

    /// Fits the word into these bounds and notes how far it was beyond them. `fit` computes the word in that case.
    fn within(self, least: i128, most: i128, fit: impl Fn(i128) -> i128) -> Self {
        let beyond = float((self.word - most).max(least - self.word).max(0));
        let word = fit(self.word);
        let wraps = beyond > 0.0 && word != self.word.clamp(least, most);
        let losses = self.losses.worse(Losses { beyond, narrows: true, wraps, ..NONE });
        Self { word, losses, ..self }
    }
}

hpu_signal::operators!(
    Exact,
    |a, b| [
        a.both(b, |a, b| a + b, |a, b| a + b),
        a.both(b, |a, b| a - b, |a, b| a - b),
        a.both(b, |a, b| a * b, |a, b| a * b),
    ],
    a.each(|word| -word, |exact| -exact),
);

impl Word for Exact {
    type Bit = bool;

    fn int(value: i128) -> Self {
        Self::of(value)
    }
    fn of_bit(bit: bool) -> Self {
        Self::of(bit.into())
    }
    fn shl(self, bits: u32) -> Self {
        self.each(|word| word << bits, |exact| libm::scalbn(exact, bits.cast_signed()))
    }
    fn shr(self, bits: u32) -> Self {
        self.each(|word| word >> bits, |exact| libm::scalbn(exact, -bits.cast_signed()))
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        let rounded = |word| if drop > 0 { rounding.shift(word, drop.cast_unsigned()) } else { word << -drop };
        self.each(rounded, |exact| libm::scalbn(exact, -drop))
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let (least, most) = (rule.to.min(), rule.to.max());
        self.round(rule.rounding, rule.from_frac - rule.to.frac()).within(least, most, |word| match rule.overflow {
            Overflow::Wrap => rule.to.value(rule.to.wrap(word)),
            Overflow::Saturate => word.clamp(least, most),
        })
    }
    /// A count modulo its width loses nothing: its exact value wraps with it.
    fn wrap(self, to: Format) -> Self {
        let turns = to.value(to.wrap(self.word)) - self.word;
        self.each(|word| word + turns, |exact| exact + float(turns))
    }
    fn at_least(self, other: Self) -> bool {
        self.word >= other.word
    }
    fn equals(self, other: Self) -> bool {
        self.word == other.word
    }
    fn branch<const N: usize>(bit: bool, yes: impl FnOnce() -> [Self; N], no: impl FnOnce() -> [Self; N]) -> [Self; N] {
        if bit { yes() } else { no() }
    }
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        Self::of(table[usize::try_from(self.word).expect("an address of the table")].into().into())
    }
    fn shed(self) -> Self {
        Self::of(self.word)
    }
    fn limit(self, least: i128, most: i128) -> Self {
        self.within(least, most, |word| word.clamp(least, most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_of_small_words_tells_what_its_quotient_and_its_bounds_say() {
        // A signed word of 5 bits times an unsigned one of 4, without the lowest four bits, kept in 4 bits. The
        // expected losses are the remainder in sixteenths, and the distance of the whole part from -8..=7.
        for overflow in Overflow::ALL {
            let rule = Narrowing { from_frac: 4, to: Format::signed(4), rounding: Rounding::Truncate, overflow };
            for (a, b) in (-16i64..16).flat_map(|a| (0..16).map(move |b| (a, b))) {
                let product = (Exact::of(a.into()) * Exact::of(b.into())).narrow(&rule);
                let whole = (a * b).div_euclid(16);
                let beyond = if whole > 7 {
                    whole - 7
                } else if whole < -8 {
                    -8 - whole
                } else {
                    0
                };
                let rest = (a * b).rem_euclid(16) as f64 / 16.0;
                assert_eq!(product.lost(), [rest, beyond as f64], "{a} times {b}");
                let kept = if overflow == Overflow::Wrap { (whole + 8).rem_euclid(16) - 8 } else { whole.clamp(-8, 7) };
                assert_eq!(product.word(), i128::from(kept), "{a} times {b}");
                // Losses that were shed are reported elsewhere.
                assert_eq!((product.shed() + Exact::of(1)).lost(), [0.0; 2]);
            }
        }
    }

    #[test]
    fn a_difference_that_goes_round_loses_nothing() {
        for (a, b) in (0i64..16).flat_map(|a| (0..16).map(move |b| (a, b))) {
            let moved = (Exact::of(a.into()) - Exact::of(b.into())).wrap(Format::signed(4));
            assert_eq!((moved.word(), moved.lost()), (((a - b + 8).rem_euclid(16) - 8).into(), [0.0; 2]));
        }
    }
}
