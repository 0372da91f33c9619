//! Intervals of `f64`, rounded outwards, with pairs of them as complex numbers, and small matrices.

use std::f64::consts::{FRAC_PI_2, PI};

/// All numbers from `lo` to `hi`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    /// The lower end.
    pub lo: f64,
    /// The upper end.
    pub hi: f64,
}

impl Interval {
    pub(crate) const ZERO: Self = Self::exact(0.0);

    /// Makes the interval of one number.
    pub const fn exact(value: f64) -> Self {
        Self { lo: value, hi: value }
    }

    /// Returns the interval widened by one ulp at each end.
    fn outward(lo: f64, hi: f64) -> Self {
        Self { lo: -above(-lo), hi: above(hi) }
    }

    /// Returns the sums of both.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        if self == Self::ZERO {
            return other;
        }
        if other == Self::ZERO {
            return self;
        }
        Self::outward(self.lo + other.lo, self.hi + other.hi)
    }

    /// Returns the differences of both.
    pub fn minus(self, other: Self) -> Self {
        self.plus(Self { lo: -other.hi, hi: -other.lo })
    }

    /// Returns the products of both.
    #[inline]
    pub fn times(self, other: Self) -> Self {
        if self == Self::ZERO || other == Self::ZERO {
            return Self::ZERO;
        }
        let ends = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        // An instruction each: signs differ from product to product, so a branch would often be mispredicted.
        let least = |least, end| if end < least { end } else { least };
        let most = |most, end| if end > most { end } else { most };
        Self::outward(ends.into_iter().fold(f64::INFINITY, least), ends.into_iter().fold(f64::NEG_INFINITY, most))
    }

    /// Returns the quotient by a number above zero.
    pub fn over(self, other: f64) -> Self {
        self.divided(Self::exact(other))
    }

    /// Returns the quotient by an interval that lies wholly above zero.
    pub fn divided(self, other: Self) -> Self {
        if self == Self::ZERO {
            return Self::ZERO;
        }
        let ends = [self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi];
        Self::outward(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Returns the product with a power of two, which is exact.
    pub fn scaled(self, by: f64) -> Self {
        Self { lo: self.lo * by, hi: self.hi * by }
    }

    /// Returns the greatest absolute value.
    pub fn size(self) -> f64 {
        self.hi.max(-self.lo)
    }

    pub(crate) fn has_zero(self) -> bool {
        self.lo <= 0.0 && self.hi >= 0.0
    }

    pub(crate) fn width(self) -> f64 {
        self.hi - self.lo
    }

    /// Returns a number inside the interval, near its middle.
    pub fn middle(self) -> f64 {
        let middle = 0.5 * self.lo + 0.5 * self.hi;
        if middle < self.lo {
            self.lo
        } else if middle > self.hi {
            self.hi
        } else {
            middle
        }
    }

    /// Returns the numbers that both intervals hold, if there are any.
    pub fn common(self, other: Self) -> Option<Self> {
        let both = Self { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) };
        (both.lo <= both.hi).then_some(both)
    }

    /// Returns the numbers that two enclosures of the same number have in common.
    pub fn within(self, other: Self) -> Self {
        self.common(other).expect("two enclosures of the same number")
    }

    /// Whether the interval lies inside the other and touches neither of its ends.
    pub fn is_inside(self, other: Self) -> bool {
        other.lo < self.lo && self.hi < other.hi
    }

    /// Returns the sine. The library's sine errs by less than an ulp; two are allowed for here.
    pub fn sin(self) -> Self {
        if self.lo >= -FRAC_PI_2 && self.hi <= FRAC_PI_2 {
            let [low, high] = [libm::sin(self.lo), libm::sin(self.hi)];
            return Self { lo: low.next_down().next_down(), hi: high.next_up().next_up() };
        }
        self.minus(Self { lo: FRAC_PI_2.next_down(), hi: FRAC_PI_2.next_up() }).cos()
    }

    /// Returns the cosine. The library's cosine errs by less than an ulp; two are allowed for here.
    pub fn cos(self) -> Self {
        let ends = [libm::cos(self.lo), libm::cos(self.hi)];
        let wide = |x: f64| (x.next_down().next_down().max(-1.0), x.next_up().next_up().min(1.0));
        let [(a, b), (c, d)] = ends.map(wide);
        let mut all = Self { lo: a.min(c), hi: b.max(d) };
        // Multiples of pi inside, and those that only rounding keeps out.
        let spare = 1e-15 * (1.0 + self.size());
        let (first, last) = (((self.lo - spare) / PI).ceil(), ((self.hi + spare) / PI).floor());
        if first <= last {
            let even = last > first || first.rem_euclid(2.0) == 0.0;
            let odd = last > first || !even;
            all = Self { lo: if odd { -1.0 } else { all.lo }, hi: if even { 1.0 } else { all.hi } };
        }
        all
    }
}

/// Returns the least number above `x`, as [`f64::next_up`] does, but without branches.
fn above(x: f64) -> f64 {
    // The sum makes the zero below zero the one above.
    let bits = (x + 0.0).to_bits();
    let step = 1 | (bits.cast_signed() >> 63);
    if x < f64::INFINITY { f64::from_bits(bits.wrapping_add_signed(step)) } else { x }
}

/// All complex numbers with these real and imaginary parts.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Complex {
    pub(crate) re: Interval,
    pub(crate) im: Interval,
}

impl Complex {
    pub(crate) const ZERO: Self = Self { re: Interval::ZERO, im: Interval::ZERO };

    pub(crate) fn plus(self, other: Self) -> Self {
        Self { re: self.re.plus(other.re), im: self.im.plus(other.im) }
    }

    pub(crate) fn times(self, other: Self) -> Self {
        Self {
            re: self.re.times(other.re).minus(self.im.times(other.im)),
            im: self.re.times(other.im).plus(self.im.times(other.re)),
        }
    }

    pub(crate) fn scaled(self, by: Interval) -> Self {
        Self { re: self.re.times(by), im: self.im.times(by) }
    }

    /// Returns the product with the imaginary unit.
    pub fn turned(self) -> Self {
        Self { re: Interval::ZERO.minus(self.im), im: self.re }
    }

    pub(crate) fn has_zero(self) -> bool {
        self.re.has_zero() && self.im.has_zero()
    }
}

/// Rows and columns of intervals: a small square matrix, a row or a column.
#[derive(Clone, PartialEq, Debug)]
pub struct Matrix(pub Vec<Vec<Interval>>);

impl Matrix {
    pub(crate) fn identity(size: usize) -> Self {
        let one = |here: bool| if here { Interval::exact(1.0) } else { Interval::ZERO };
        Self((0..size).map(|row| (0..size).map(|column| one(row == column)).collect()).collect())
    }

    pub(crate) fn column(values: &[Interval]) -> Self {
        Self(values.iter().map(|&value| vec![value]).collect())
    }

    pub(crate) fn row(values: &[Interval]) -> Self {
        Self(vec![values.to_vec()])
    }

    pub(crate) fn rows(&self) -> usize {
        self.0.len()
    }

    fn columns(&self) -> usize {
        self.0[0].len()
    }

    pub(crate) fn map(&self, change: impl Fn(Interval) -> Interval) -> Self {
        Self(self.0.iter().map(|row| row.iter().map(|&cell| change(cell)).collect()).collect())
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let sum =
            |(left, right): (&Vec<Interval>, &Vec<Interval>)| left.iter().zip(right).map(|(l, r)| l.plus(*r)).collect();
        Self(self.0.iter().zip(&other.0).map(sum).collect())
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        // Zeros add nothing, not even rounding.
        let product = |row: &Vec<Interval>| {
            let mut sums = vec![Interval::ZERO; other.columns()];
            for (left, right) in row.iter().zip(&other.0).filter(|(left, _)| **left != Interval::ZERO) {
                for (sum, cell) in sums.iter_mut().zip(right) {
                    *sum = sum.plus(left.times(*cell));
                }
            }
            sums
        };
        Self(self.0.iter().map(product).collect())
    }

    /// Returns the numbers that two enclosures of the same matrix have in common.
    pub fn within(&self, other: &Self) -> Self {
        let both = |(a, b): (&Vec<Interval>, &Vec<Interval>)| a.iter().zip(b).map(|(a, b)| a.within(*b)).collect();
        Self(self.0.iter().zip(&other.0).map(both).collect())
    }

    /// Returns the greatest absolute value of each cell, as a matrix.
    pub fn sizes(&self) -> Self {
        self.map(|cell| Interval::exact(cell.size()))
    }

    /// Returns the greatest sum of absolute values along a row.
    pub fn norm(&self) -> f64 {
        let sum = |row: &Vec<Interval>| row.iter().fold(0.0, |sum: f64, cell| (sum + cell.size()).next_up());
        self.0.iter().map(sum).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::above;

    #[test]
    fn the_number_above_is_that_of_the_standard_library() {
        // The first, second, middle and last number of each binade, with zeros, infinities and NaN among them.
        for top in 0..=0xfff_u64 {
            for low in [0, 1, 1 << 51, (1 << 52) - 1] {
                let x = f64::from_bits(top << 52 | low);
                assert_eq!(above(x).to_bits(), x.next_up().to_bits(), "{x:e}");
            }
        }
    }
}
