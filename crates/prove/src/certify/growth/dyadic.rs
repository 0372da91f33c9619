//! Numbers of any length, a whole number times a power of two. Sums and products are exact.

use std::cmp::Ordering;

use crate::interval::Interval;

/// A number.
#[derive(Clone, Debug)]
pub struct Dyadic {
    is_negative: bool,
    /// The whole number, its lowest digits first, without zeros at the top.
    digits: Vec<u32>,
    /// The power of two.
    exponent: i64,
}

impl Dyadic {
    /// Returns the number 0.
    pub fn zero() -> Self {
        Self { is_negative: false, digits: Vec::new(), exponent: 0 }
    }

    /// Returns a number that is finite.
    pub fn of(value: f64) -> Self {
        let bits = value.to_bits();
        let (power, low) = ((bits >> 52 & 0x7ff) as i64, bits & ((1 << 52) - 1));
        let whole = if power > 0 { low | 1 << 52 } else { low };
        let digits = vec![whole as u32, (whole >> 32) as u32];
        Self { is_negative: value < 0.0, digits, exponent: power.max(1) - 1075 }.trimmed()
    }

    /// Returns a whole number.
    pub fn whole(value: i64) -> Self {
        let size = value.unsigned_abs();
        Self { is_negative: value < 0, digits: vec![size as u32, (size >> 32) as u32], exponent: 0 }.trimmed()
    }

    /// Returns the number of its digits.
    pub fn length(&self) -> usize {
        self.digits.len()
    }

    /// Drops zeros at the top, and whole digits of zeros at the bottom.
    fn trimmed(mut self) -> Self {
        let top = self.digits.iter().rposition(|digit| *digit != 0).map_or(0, |at| at + 1);
        self.digits.truncate(top);
        let low = self.digits.iter().position(|digit| *digit != 0).unwrap_or(0);
        self.digits.drain(..low);
        self.exponent += 32 * low as i64;
        self
    }

    /// Returns the digits of the same number with a lower power of two.
    fn digits_at(&self, exponent: i64) -> Vec<u32> {
        let bits = (self.exponent - exponent) as usize;
        let mut all = vec![0; bits / 32];
        let mut carry = 0;
        for digit in &self.digits {
            let wide = u64::from(*digit) << (bits % 32) | carry;
            all.push(wide as u32);
            carry = wide >> 32;
        }
        all.push(carry as u32);
        all
    }

    /// Returns the number with the other sign.
    pub fn negative(&self) -> Self {
        Self { is_negative: !self.is_negative && !self.digits.is_empty(), ..self.clone() }
    }

    /// Returns the sum.
    pub fn plus(&self, other: &Self) -> Self {
        if self.digits.is_empty() || other.digits.is_empty() {
            return if self.digits.is_empty() { other.clone() } else { self.clone() };
        }
        let exponent = self.exponent.min(other.exponent);
        let [mut one, mut two] = [self, other].map(|number| number.digits_at(exponent));
        let length = one.len().max(two.len()) + 1;
        [&mut one, &mut two].into_iter().for_each(|all| all.resize(length, 0));
        let mut is_negative = self.is_negative;
        let subtracts = self.is_negative != other.is_negative;
        if subtracts && one.iter().rev().lt(two.iter().rev()) {
            std::mem::swap(&mut one, &mut two);
            is_negative = other.is_negative;
        }
        let mut carry = 0i64;
        for (digit, by) in one.iter_mut().zip(&two) {
            let by = i64::from(*by);
            let sum = i64::from(*digit) + if subtracts { -by } else { by } + carry;
            *digit = sum as u32;
            carry = sum >> 32;
        }
        Self { is_negative, digits: one, exponent }.trimmed()
    }

    /// Returns the product.
    pub fn times(&self, other: &Self) -> Self {
        let mut digits = vec![0u32; self.digits.len() + other.digits.len() + 1];
        for (at, digit) in self.digits.iter().enumerate() {
            let mut carry = 0u64;
            for (by, cell) in digits[at..].iter_mut().enumerate() {
                let product = u64::from(*digit) * u64::from(other.digits.get(by).copied().unwrap_or(0));
                let sum = u64::from(*cell) + (product & 0xffff_ffff) + (carry & 0xffff_ffff);
                *cell = sum as u32;
                carry = (carry >> 32) + (product >> 32) + (sum >> 32);
                if by >= other.digits.len() && carry == 0 {
                    break;
                }
            }
        }
        let is_negative = self.is_negative != other.is_negative;
        Self { is_negative, digits, exponent: self.exponent + other.exponent }.trimmed()
    }

    /// Returns its sign against 0.
    pub fn sign(&self) -> Ordering {
        match (self.digits.is_empty(), self.is_negative) {
            (true, _) => Ordering::Equal,
            (_, true) => Ordering::Less,
            (_, false) => Ordering::Greater,
        }
    }

    /// Returns an interval that holds the number: its ends are infinite beyond the greatest `f64`.
    pub fn interval(&self) -> Interval {
        // The highest digits, and one more unit of the last of them.
        let low = self.digits.len().saturating_sub(3);
        let exponent = self.exponent + 32 * low as i64;
        let top = self.digits[low..].iter().rev().fold(0u128, |sum, digit| sum << 32 | u128::from(*digit));
        if !(-900..900).contains(&(exponent + 96)) {
            let all = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
            return if self.digits.is_empty() { Interval::exact(0.0) } else { all };
        }
        let scaled = |whole: u128| libm::scalbn(whole as f64, exponent as i32);
        let more = u128::from(low > 0);
        let [lo, hi] = [scaled(top).next_down(), scaled(top + more).next_up()];
        if self.is_negative { Interval { lo: -hi, hi: -lo } } else { Interval { lo, hi } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_products_are_those_of_whole_numbers() {
        let mut random = hpu_cosim::SplitMix64::new(73);
        for case in 0..20_000 {
            let mut number = || {
                let bits = random.next_u64() % 62;
                (random.next_u64() & ((1 << bits) - 1)).cast_signed()
                    * if random.next_u64().is_multiple_of(2) { 1 } else { -1 }
            };
            let [a, b, c] = [number(), number(), number()];
            let [x, y, z] = [a, b, c].map(Dyadic::whole);
            // (a + b) c - c b - a c is 0, and a b against a number that is known.
            let left = x.plus(&y).times(&z).plus(&z.times(&y).negative()).plus(&x.times(&z).negative());
            assert_eq!(left.sign(), Ordering::Equal, "{a} {b} {c}: {left:?}");
            let known = i128::from(a) * i128::from(b) + i128::from(c);
            let found = x.times(&y).plus(&z);
            assert_eq!(found.sign(), known.cmp(&0), "{case}: {a} {b} {c}");
            let Interval { lo, hi } = found.interval();
            assert!(
                lo <= known as f64 && known as f64 <= hi && hi - lo <= 1e-15 * hi.abs().max(-lo) + 1e-300,
                "{known}: {lo} {hi}"
            );
            // With the known number off, nothing is left.
            let [high, low] = [(known >> 60) as i64, (known & ((1 << 60) - 1)) as i64];
            let other = Dyadic::whole(high).times(&Dyadic::whole(1 << 60)).plus(&Dyadic::whole(low));
            assert_eq!(found.plus(&other.negative()).sign(), Ordering::Equal, "{case}");
        }
    }

    #[test]
    fn floats_are_taken_as_they_are() {
        for value in [0.0, 1.0, -0.3, 1e-300, -2.5e250, 5e-324, f64::MIN_POSITIVE, 123_456_789.0] {
            let there = Dyadic::of(value);
            let Interval { lo, hi } = there.interval();
            assert!(lo <= value && value <= hi, "{value}: {lo} {hi}");
            let thrice = there.times(&Dyadic::whole(3));
            let left = thrice.plus(&there.negative()).plus(&there.negative()).plus(&there.negative());
            assert_eq!((left.sign(), there.sign()), (Ordering::Equal, value.partial_cmp(&0.0).expect("a number")));
        }
        // A third of a long number: 3^200 over 2^317, by products and by its logarithm.
        let long = (0..200).fold(Dyadic::of(2f64.powi(-317)), |product, _| product.times(&Dyadic::whole(3)));
        let expected = (200.0 * 3f64.ln() - 317.0 * 2f64.ln()).exp();
        assert!((long.interval().middle() / expected - 1.0).abs() < 1e-12 && long.length() > 8, "{long:?}");
    }
}
