//! Sums of two `f64`, with some 31 decimal digits (Dekker 1971, Knuth). Written only for the judge.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `hi + lo`, where `lo` is below half a unit in the last place of `hi`.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct Twice {
    pub hi: f64,
    pub lo: f64,
}

pub const ZERO: Twice = Twice { hi: 0.0, lo: 0.0 };

fn two_sum(a: f64, b: f64) -> Twice {
    let hi = a + b;
    let b_kept = hi - a;
    Twice { hi, lo: (a - (hi - b_kept)) + (b - b_kept) }
}

fn quick_sum(a: f64, b: f64) -> Twice {
    let hi = a + b;
    Twice { hi, lo: b - (hi - a) }
}

fn halves(a: f64) -> (f64, f64) {
    let c = 134_217_729.0 * a;
    let high = c - (c - a);
    (high, a - high)
}

fn two_product(a: f64, b: f64) -> Twice {
    let hi = a * b;
    let ((ah, al), (bh, bl)) = (halves(a), halves(b));
    Twice { hi, lo: ((ah * bh - hi) + ah * bl + al * bh) + al * bl }
}

impl From<f64> for Twice {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Add for Twice {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.hi, other.hi), two_sum(self.lo, other.lo));
        let sum = quick_sum(high.hi, high.lo + low.hi);
        quick_sum(sum.hi, sum.lo + low.lo)
    }
}

impl Neg for Twice {
    type Output = Self;
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Twice {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Twice {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.hi, other.hi);
        quick_sum(product.hi, product.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Mul<f64> for Twice {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self * Self::from(other)
    }
}

impl Div for Twice {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        let rest = self - other * first;
        let second = rest.hi / other.hi;
        let rest = rest - other * second;
        quick_sum(first, second) + Self::from(rest.hi / other.hi)
    }
}

impl Twice {
    /// Returns sine and cosine, by their plain series; good for angles of a few radians.
    pub fn sin_cos(self) -> (Self, Self) {
        let square = self * self;
        let one = Self::from(1.0);
        let (mut sine, mut cosine) = (one, one);
        for k in (1..24).rev() {
            let k = f64::from(2 * k);
            sine = one - square * sine / Self::from(k * (k + 1.0));
            cosine = one - square * cosine / Self::from(k * (k - 1.0));
        }
        (self * sine, cosine)
    }
}
