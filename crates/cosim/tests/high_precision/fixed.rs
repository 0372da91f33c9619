//! Fixed-point numbers of several 64-bit words.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// A number in two's complement, lowest word first. The highest of `N` words is the whole part, so the number lies
/// between `-2^63` and `2^63`, and its last place is `2^-64(N-1)`. Sums and comparisons are exact; products are cut
/// towards zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fixed<const N: usize>([u64; N]);

impl<const N: usize> Fixed<N> {
    pub const ZERO: Self = Self([0; N]);

    /// Returns an `f64`, exactly.
    pub fn of(value: f64) -> Self {
        assert!(value.abs() < 2f64.powi(62), "{value:e} is too great");
        if value == 0.0 {
            return Self::ZERO;
        }
        let bits = value.abs().to_bits();
        let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
        let unused = mantissa.trailing_zeros();
        // The place of the mantissa's last nonzero bit.
        let place = (bits >> 52) as i32 - 1075 + unused as i32 + 64 * (N as i32 - 1);
        assert!(place >= 0, "{value:e} has bits below the last place");
        let (mantissa, place) = (mantissa >> unused, place as usize);
        let wide = u128::from(mantissa) << (place % 64);
        let mut words = [0; N];
        words[place / 64] = wide as u64;
        if wide >> 64 != 0 {
            words[place / 64 + 1] = (wide >> 64) as u64;
        }
        if value < 0.0 { -Self(words) } else { Self(words) }
    }

    /// Returns a whole number.
    pub fn whole(value: u64) -> Self {
        assert!(value < 1 << 63);
        let mut words = [0; N];
        words[N - 1] = value;
        Self(words)
    }

    pub fn is_negative(self) -> bool {
        self.0[N - 1] >> 63 != 0
    }

    pub fn abs(self) -> Self {
        if self.is_negative() { -self } else { self }
    }

    /// Returns the nearest `f64`, or the one after that.
    pub fn float(self) -> f64 {
        let size = self.abs().0.iter().fold(0.0, |sum, &word| sum * 2f64.powi(-64) + word as f64);
        if self.is_negative() { -size } else { size }
    }

    /// Returns the nearest `f64`.
    pub fn nearest(self) -> f64 {
        let near = self.float();
        let off = |value: &f64| (self - Self::of(*value)).abs();
        [near, near.next_up(), near.next_down()].into_iter().min_by(|a, b| off(a).cmp(&off(b))).expect("three")
    }

    /// Returns the same number with more places.
    pub fn widened<const M: usize>(self) -> Fixed<M> {
        Fixed(std::array::from_fn(|i| if i + N < M { 0 } else { self.0[i + N - M] }))
    }

    /// Returns `1 / self`, by Newton's iteration from the `f64`: each step doubles the digits.
    pub fn reciprocal(self) -> Self {
        let two = Self::whole(2);
        (0..N).fold(Self::of(1.0 / self.float()), |guess, _| guess * (two - self * guess))
    }
}

impl<const N: usize> Add for Fixed<N> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let mut carry = false;
        Self(std::array::from_fn(|i| {
            let (sum, one) = self.0[i].overflowing_add(other.0[i]);
            let (sum, two) = sum.overflowing_add(u64::from(carry));
            carry = one | two;
            sum
        }))
    }
}

impl<const N: usize> Neg for Fixed<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        let mut carry = true;
        Self(self.0.map(|word| {
            let (word, over) = (!word).overflowing_add(u64::from(carry));
            carry = over;
            word
        }))
    }
}

impl<const N: usize> Sub for Fixed<N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        let mut borrow = false;
        Self(std::array::from_fn(|i| {
            let (difference, one) = self.0[i].overflowing_sub(other.0[i]);
            let (difference, two) = difference.overflowing_sub(u64::from(borrow));
            borrow = one | two;
            difference
        }))
    }
}

impl<const N: usize> Mul for Fixed<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.abs().0, other.abs().0);
        // Row by row, as on paper: the product has 2 N words. A product of two words, plus a word and a carry, fits in
        // two words.
        let (mut low, mut high) = ([0; N], [0; N]);
        for i in 0..N {
            let mut carry = 0;
            for j in 0..N {
                let word = if i + j < N { &mut low[i + j] } else { &mut high[i + j - N] };
                let sum = u128::from(a[i]) * u128::from(b[j]) + u128::from(*word) + u128::from(carry);
                (*word, carry) = (sum as u64, (sum >> 64) as u64);
            }
            high[i] = carry;
        }
        // Places: 2 (N - 1) words of the product; the lowest N - 1 of them are cut off.
        let words: [u64; N] = std::array::from_fn(|i| if i == 0 { low[N - 1] } else { high[i - 1] });
        assert!(high[N - 1] == 0 && words[N - 1] >> 63 == 0, "a product is too great");
        let size = Self(words);
        if self.is_negative() == other.is_negative() { size } else { -size }
    }
}

impl<const N: usize> Ord for Fixed<N> {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |x: &Self| (x.0[N - 1] as i64, x.0);
        let ((a, low_a), (b, low_b)) = (key(self), key(other));
        a.cmp(&b).then_with(|| low_a.iter().rev().cmp(low_b.iter().rev()))
    }
}

impl<const N: usize> PartialOrd for Fixed<N> {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::Fixed;

    /// Returns the number with these digits after the point.
    fn decimal<const N: usize>(digits: &str) -> Fixed<N> {
        let tenth = Fixed::whole(10).reciprocal();
        digits.bytes().rev().fold(Fixed::ZERO, |sum, digit| (sum + Fixed::whole(u64::from(digit - b'0'))) * tenth)
    }

    #[test]
    fn floats_go_in_and_out_unchanged() {
        let values = [0.0, 1.0, -1.0, 0.1, -2345.678, 1.37e-6, 2e-8, -1e15, f64::EPSILON, 4.0e18];
        for value in values {
            assert_eq!(Fixed::<4>::of(value).float(), value);
            assert_eq!(Fixed::<7>::of(value).float(), value);
        }
    }

    #[test]
    fn whole_numbers_multiply_and_compare_as_integers_do() {
        let values = [0i64, 1, -1, 3, -7, 1 << 20, -(1 << 30), (1 << 31) - 1];
        for a in values {
            for b in values {
                let (x, y) = (Fixed::<4>::of(a as f64), Fixed::<4>::of(b as f64));
                let product = Fixed::whole((a * b).unsigned_abs());
                assert_eq!(x * y, if a * b < 0 { -product } else { product });
                assert_eq!(x + y, Fixed::of((a + b) as f64));
                assert_eq!(x - y, Fixed::of((a - b) as f64));
                assert_eq!(x.cmp(&y), a.cmp(&b));
            }
        }
    }

    #[test]
    fn fractions_multiply_exactly_where_the_product_has_room() {
        // (2^-90 + 2^-3) (2^-100 - 2^-4) in powers of two.
        let power = |n: i32| Fixed::<4>::of(2f64.powi(n));
        let product = (power(-90) + power(-3)) * (power(-100) - power(-4));
        assert_eq!(product, power(-190) + power(-103) - power(-94) - power(-7));
    }

    #[test]
    fn a_number_times_its_reciprocal_is_one_to_the_last_places() {
        for value in [3.0, 0.1, 1.37e-6, 2.26e-4, 0.0633, -7.5e3] {
            let x = Fixed::<4>::of(value);
            let off = (x * x.reciprocal() - Fixed::whole(1)).abs();
            assert!(off.float() <= 2f64.powi(-190) * value.abs().max(1.0), "{value}: {:e}", off.float());
        }
        // One seventh is 0.142857 and so on.
        let off = (Fixed::<4>::whole(7).reciprocal() - decimal(&"142857".repeat(10))).abs();
        assert!(off.float() < 1e-57);
    }
}
