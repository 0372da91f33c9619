//! Reads equations in real numbers: this is the law that words are compared with.
//!
//! Nothing is rounded, wraps or saturates for want of bits. A limit that belongs to the law stays ([`Word::limit`]),
//! and a table of sines is replaced by the sine.

use std::f64::consts::PI;

use hpu_signal::{Format, Narrowing, Rounding, Sine, Word};

/// A real number, in units of the word's least significant bit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Real(pub f64);

impl Real {
    /// Returns the number times `2^bits`, exactly.
    fn scaled(self, bits: i32) -> Self {
        Self(libm::scalbn(self.0, bits))
    }
}

/// Returns a word as a number.
pub fn float(word: i128) -> f64 {
    /// The conversion from 128 bits is slow; few words need it.
    #[cold]
    #[inline(never)]
    fn wide(word: i128) -> f64 {
        word as f64
    }
    i64::try_from(word).map_or_else(|_| wide(word), |word| word as f64)
}

hpu_signal::operators!(Real, |a, b| [Self(a.0 + b.0), Self(a.0 - b.0), Self(a.0 * b.0)], Self(-a.0));

impl Word for Real {
    type Bit = bool;

    fn int(value: i128) -> Self {
        Self(float(value))
    }
    fn of_bit(bit: bool) -> Self {
        Self(f64::from(u8::from(bit)))
    }
    fn shl(self, bits: u32) -> Self {
        self.scaled(bits.cast_signed())
    }
    fn shr(self, bits: u32) -> Self {
        self.scaled(-bits.cast_signed())
    }
    fn round(self, _: Rounding, drop: i32) -> Self {
        self.scaled(-drop)
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        self.scaled(rule.to.frac() - rule.from_frac)
    }
    fn wrap(self, _: Format) -> Self {
        self
    }
    fn at_least(self, other: Self) -> bool {
        self.0 >= other.0
    }
    fn equals(self, other: Self) -> bool {
        self.0 == other.0
    }
    fn branch<const N: usize>(bit: bool, yes: impl FnOnce() -> [Self; N], no: impl FnOnce() -> [Self; N]) -> [Self; N] {
        if bit { yes() } else { no() }
    }
    /// Reads a table of which only the words are known, at the nearest address.
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        let address = (self.0.round().max(0.0) as usize).min(table.len() - 1);
        Self(table[address].into() as f64)
    }
    fn sine<T: Copy + Into<i64>>(self, Sine { num, den, is_cosine, frac }: Sine, _: &[T]) -> Self {
        let angle_rad = self.0 * (2.0 * PI * f64::from(num) / f64::from(den));
        Self(if is_cosine { libm::cos(angle_rad) } else { libm::sin(angle_rad) }).scaled(frac)
    }
    fn bit(self, place: u32) -> bool {
        (self.0 as i64) >> place & 1 == 1
    }
    fn limit(self, least: i128, most: i128) -> Self {
        Self(self.0.clamp(float(least), float(most)))
    }
}

/// Returns the outputs of a block in real numbers, in units. Tests hold laws to it.
pub fn law(block: &dyn hpu_datapath::AnyBlock, registers: usize, inputs: &[f64]) -> Vec<f64> {
    let lsbs = block.inputs().into_iter().map(|port| port.format.lsb());
    let given: Vec<_> =
        (0..registers).map(|_| Real(0.0)).chain(lsbs.zip(inputs).map(|(lsb, x)| Real(x / lsb))).collect();
    let made = block.equations().expect("equations").recorded().read(&given);
    let lsbs = block.outputs().into_iter().map(|port| port.format.lsb());
    // A register that is loaded from a table shows that entry at the next edge.
    made.into_iter().take(block.outputs().len()).zip(lsbs).map(|(word, lsb)| word.0 * lsb).collect()
}

#[cfg(test)]
mod tests {
    use hpu_datapath::{CommandLimiter, TruncatingMultiplier};

    use super::*;

    #[test]
    fn a_word_that_is_full_is_no_limit_of_the_law_and_the_bridge_is() {
        let word = Format::unsigned(12);
        let product = TruncatingMultiplier::saturate(word, word, word).expect("12 bits");
        assert_eq!(law(&product, 0, &[4000.0, 2.5]), [10_000.0]);
        let limiter = CommandLimiter::new(14, 13, 4095, 0).expect("12 bits");
        assert_eq!(law(&limiter, 0, &[4095.5]), [4095.0]);
    }
}
