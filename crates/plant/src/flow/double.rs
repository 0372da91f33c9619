//! Double-double arithmetic: a number as the unevaluated sum of two `f64`, good for 106 bits.
//!
//! Sums and products of two `f64` are split into result and rounding error without loss (two-sum of Knuth; two-product
//! by fused multiply-add, or else by the splitting of Dekker and Veltkamp). Both two-products are exact for factors
//! whose product is 0 or between 2⁻⁹⁰⁰ and 2⁹⁰⁰, so results do not depend on the processor. Everything else is plain
//! `f64`, never contracted.
//!
//! [`Doubles`] are four such numbers or more, with highs and lows apart, computed as four [`Lanes`] at a time. Lanes
//! below [`LEAST`] count as zero, so that products never leave the range above at its lower end.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};
#[cfg(target_arch = "x86_64")]
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

#[cfg(not(any(target_arch = "x86_64", target_family = "wasm")))]
use crate::flow::lanes::Array;
#[cfg(target_arch = "x86_64")]
use crate::flow::lanes::Register;
use crate::flow::lanes::{Blocks, Count, Lanes, Numbers, Pairs, Size, TwoProduct};
use crate::flow::matrix::{Columns, Matrix, State};

/// Sizes below this count as zero, 2⁻⁴⁰⁰.
const LEAST: f64 = f64::from_bits((1023 - 400) << 52);

/// A `Product` multiplies without loss. [`Fused`] and [`Halves`] implement it: the processor decides which is faster,
/// and both give the same bits.
pub trait Product: TwoProduct {
    /// Returns the rounded product, and the error of its rounding.
    fn two(a: f64, b: f64) -> (f64, f64);

    #[inline(always)]
    fn lanes(state: &State) -> Self::Lanes {
        Self::Lanes::of(state)
    }

    /// Returns the same number in all lanes.
    #[inline(always)]
    fn all(number: f64) -> Self::Lanes {
        Self::Lanes::all(number)
    }

    /// Returns the numbers of a state of any size.
    #[inline(always)]
    fn blocks<const N: usize>(state: &State<N>) -> Blocks<Self::Lanes, N>
    where
        Count<N>: Size<N>,
    {
        Numbers::taken(state)
    }

    /// Returns the same number in all lanes of a state of any size.
    #[inline(always)]
    fn every<const N: usize>(number: f64) -> Blocks<Self::Lanes, N>
    where
        Count<N>: Size<N>,
    {
        Numbers::same(number)
    }

    /// Returns `before + M v` of more than four states, by a function of its own: inlined at each place, a large
    /// system would take minutes to compile.
    fn times_apart<const N: usize>(m: &Wide<N>, v: &Doubles<N>, before: &Doubles<N>) -> Doubles<N>
    where
        Count<N>: Size<N>;
}

/// Two-product by fused multiply-add: fast where the processor has it. WebAssembly never has it. Four lanes of an x86
/// processor need AVX2 too.
#[cfg(not(target_family = "wasm"))]
pub(crate) struct Fused;

#[cfg(not(target_family = "wasm"))]
impl TwoProduct for Fused {
    #[cfg(target_arch = "x86_64")]
    type Lanes = Register;
    #[cfg(not(target_arch = "x86_64"))]
    type Lanes = Array;

    #[inline(always)]
    fn two_of(a: Self::Lanes, b: Self::Lanes) -> (Self::Lanes, Self::Lanes) {
        #[cfg(target_arch = "x86_64")]
        return (a * b, a.times_less(b, a * b));
        #[cfg(not(target_arch = "x86_64"))]
        return (a * b, a.join(b, |a, b| Self::two(a, b).1));
    }
}

#[cfg(not(target_family = "wasm"))]
impl Product for Fused {
    #[inline(always)]
    fn two(a: f64, b: f64) -> (f64, f64) {
        let product = a * b;
        (product, a.mul_add(b, -product))
    }

    #[inline(always)]
    fn times_apart<const N: usize>(m: &Wide<N>, v: &Doubles<N>, before: &Doubles<N>) -> Doubles<N>
    where
        Count<N>: Size<N>,
    {
        #[cfg_attr(target_arch = "x86_64", target_feature(enable = "avx2,fma"))]
        #[inline(never)]
        fn apart<const N: usize>(m: &Wide<N>, v: &Doubles<N>, before: &Doubles<N>) -> Doubles<N>
        where
            Count<N>: Size<N>,
        {
            m.times_here::<Fused>(v, before)
        }
        #[cfg(target_arch = "x86_64")]
        // SAFETY: this type is chosen once the processor has been asked.
        return unsafe { apart(m, v, before) };
        #[cfg(not(target_arch = "x86_64"))]
        return apart(m, v, before);
    }
}

/// Two-product by splitting each factor in halves.
pub(crate) struct Halves;

impl Halves {
    /// One more than 2²⁷, by which a number is split.
    const SPLITTER: f64 = 134_217_729.0;
}

impl TwoProduct for Halves {
    type Lanes = Pairs;

    #[inline(always)]
    fn two_of(a: Pairs, b: Pairs) -> (Pairs, Pairs) {
        two_by_halves(a, b, Self::all(Self::SPLITTER))
    }
}

impl Product for Halves {
    #[inline(always)]
    fn two(a: f64, b: f64) -> (f64, f64) {
        two_by_halves(a, b, Self::SPLITTER)
    }

    #[inline(never)]
    fn times_apart<const N: usize>(m: &Wide<N>, v: &Doubles<N>, before: &Doubles<N>) -> Doubles<N>
    where
        Count<N>: Size<N>,
    {
        m.times_here::<Self>(v, before)
    }
}

#[inline(always)]
fn two_by_halves<T>(a: T, b: T, splitter: T) -> (T, T)
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    let halves = |x: T| {
        let shifted = splitter * x;
        let high = shifted - (shifted - x);
        (high, x - high)
    };
    let product = a * b;
    let ((ah, al), (bh, bl)) = (halves(a), halves(b));
    (product, ((ah * bh - product) + ah * bl + al * bh) + al * bl)
}

/// The two-product of the processor that the program is compiled for.
#[cfg(any(target_arch = "aarch64", target_feature = "fma"))]
pub(crate) type Native = Fused;
/// The two-product of the processor that the program is compiled for.
#[cfg(not(any(target_arch = "aarch64", target_feature = "fma")))]
pub(crate) type Native = Halves;

/// Returns whether the present processor has more instructions than the one that the program is compiled for. It is
/// asked at each call of a function with [`versions!`], so the answer is remembered: 1 no, 2 yes.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn has_fused() -> bool {
    static KNOWN: AtomicU8 = AtomicU8::new(0);
    #[cold]
    fn ask() -> bool {
        let has = std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
        KNOWN.store(1 + u8::from(has), Relaxed);
        has
    }
    let known = KNOWN.load(Relaxed);
    known == 2 || known == 0 && ask()
}

/// Defines a function from `inner::<P: Product>`, which must be always inlined, that uses the fastest two-product of
/// the present processor. Each version is a function of its own, compiled for the registers of that product's lanes.
macro_rules! versions {
    (
        $(#[$meta:meta])*
        $vis:vis fn $name:ident [$fused:ident, $native:ident, $inner:ident] ($($arg:ident: $ty:ty),*) $(-> $out:ty)?
    ) => {
        $(#[$meta])*
        #[inline]
        $vis fn $name($($arg: $ty),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            if crate::flow::double::has_fused() {
                // SAFETY: the processor has just been asked.
                return unsafe { Self::$fused($($arg),*) };
            }
            Self::$native($($arg),*)
        }

        #[inline(never)]
        fn $native($($arg: $ty),*) $(-> $out)? {
            Self::$inner::<crate::flow::double::Native>($($arg),*)
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        #[inline(never)]
        fn $fused($($arg: $ty),*) $(-> $out)? {
            Self::$inner::<crate::flow::double::Fused>($($arg),*)
        }
    };
}
pub(crate) use versions;

/// Returns the rounded sum, and the error of its rounding: of two numbers, or of each lane of two times four.
#[inline(always)]
pub(crate) fn two_sum<T: Copy + Add<Output = T> + Sub<Output = T>>(a: T, b: T) -> (T, T) {
    let sum = a + b;
    let kept = sum - a;
    (sum, (a - (sum - kept)) + (b - kept))
}

/// A number as the sum of two `f64`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Double {
    /// The nearest `f64`.
    pub hi: f64,
    /// The rest.
    pub lo: f64,
}

impl Double {
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    /// Less than every number.
    pub const LEAST: Self = Self { hi: f64::NEG_INFINITY, lo: 0.0 };
    /// Greater than every number.
    pub const MOST: Self = Self { hi: f64::INFINITY, lo: 0.0 };

    /// Returns the exact product of two `f64`.
    pub fn product(a: f64, b: f64) -> Self {
        let (hi, lo) = Halves::two(a, b);
        Self { hi, lo }
    }

    /// Returns the exact sum of two `f64`.
    #[inline(always)]
    pub fn joined(hi: f64, lo: f64) -> Self {
        let (hi, lo) = two_sum(hi, lo);
        Self { hi, lo }
    }

    /// Returns the product with an `f64`.
    #[inline(always)]
    pub fn times<P: Product>(self, factor: f64) -> Self {
        let (product, error) = P::two(self.hi, factor);
        Self::joined(product, error + self.lo * factor)
    }

    /// Returns the product, by the given two-product.
    #[inline(always)]
    pub fn by<P: Product>(self, other: Self) -> Self {
        let (product, error) = P::two(self.hi, other.hi);
        Self::joined(product, error + (self.hi * other.lo + self.lo * other.hi))
    }

    /// Returns the quotient.
    pub fn over(self, divisor: Self) -> Self {
        let first = self.hi / divisor.hi;
        if !first.is_finite() || first == 0.0 {
            return first.into();
        }
        let rest = self - divisor * first.into();
        let second = rest.hi / divisor.hi;
        let rest = rest - divisor * second.into();
        Self::joined(first, second) + (rest.hi / divisor.hi).into()
    }

    /// Returns the sign: -1, 0 or 1.
    #[inline(always)]
    pub fn sign(self) -> f64 {
        if self.hi == 0.0 { 0.0 } else { self.hi.signum() }
    }

    /// Compares with another number.
    #[inline(always)]
    pub fn order(self, other: Self) -> Ordering {
        let apart = if self.hi == other.hi { self.lo - other.lo } else { self.hi - other.hi };
        // NaN is beyond every limit.
        apart.partial_cmp(&0.0).unwrap_or(Ordering::Greater)
    }
}

impl From<f64> for Double {
    #[inline(always)]
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Neg for Double {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for Double {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (sum, error) = two_sum(self.hi, other.hi);
        let (low, rest) = two_sum(self.lo, other.lo);
        let first = Self::joined(sum, error + low);
        Self::joined(first.hi, first.lo + rest)
    }
}

impl Sub for Double {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.by::<Halves>(other)
    }
}

/// Four or more numbers, each the sum of two `f64`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Doubles<const N: usize = 4> {
    /// The nearest `f64` of each.
    pub hi: State<N>,
    /// The rest of each.
    pub lo: State<N>,
}

impl<const N: usize> Doubles<N>
where
    Count<N>: Size<N>,
{
    pub const ZERO: Self = Self { hi: [0.0; N], lo: [0.0; N] };

    #[inline(always)]
    pub fn lane(&self, index: usize) -> Double {
        Double { hi: self.hi[index], lo: self.lo[index] }
    }

    #[inline(always)]
    pub fn set(&mut self, index: usize, value: Double) {
        (self.hi[index], self.lo[index]) = (value.hi, value.lo);
    }

    /// Returns the sums of highs and rests as numbers; sums below [`LEAST`] become zero.
    #[inline(always)]
    pub fn joined<L: Lanes>(hi: Blocks<L, N>, lo: Blocks<L, N>) -> Self {
        let (hi, lo) = two_sum(hi, lo);
        Self { hi: hi.kept(LEAST, hi).numbers(), lo: lo.kept(LEAST, hi).numbers() }
    }

    /// Returns the sum.
    #[inline(always)]
    pub fn plus<P: Product>(&self, other: &Self) -> Self {
        let (sum, error) = two_sum(P::blocks(&self.hi), P::blocks(&other.hi));
        Self::joined::<P::Lanes>(sum, error + (P::blocks(&self.lo) + P::blocks(&other.lo)))
    }

    /// Returns the products with the same factor.
    #[inline(always)]
    pub fn scaled<P: Product>(&self, factor: Double) -> Self {
        let (hi, lo) = (P::blocks(&self.hi), P::blocks(&self.lo));
        let (high, low) = (P::every::<N>(factor.hi), P::every::<N>(factor.lo));
        let (product, error) = hi.two::<P>(high);
        Self::joined::<P::Lanes>(product, error + (hi * low + lo * high))
    }

    /// Returns the sum of the lanes, each times a factor.
    #[inline(always)]
    pub fn dot<P: Product>(&self, row: &State<N>) -> Double {
        let mut sum = Double::ZERO;
        for (k, &factor) in row.iter().enumerate() {
            if factor != 0.0 {
                sum = sum + self.lane(k).times::<P>(factor);
            }
        }
        sum
    }

    /// Returns the lanes with the opposite sign.
    #[inline(always)]
    pub fn negated(&self) -> Self {
        Self { hi: self.hi.map(|x| -x), lo: self.lo.map(|x| -x) }
    }

    /// Returns the differences, rounded.
    #[inline(always)]
    pub fn since<P: Product>(&self, before: &Self) -> State<N> {
        let [hi, lo] = [P::blocks(&self.hi) - P::blocks(&before.hi), P::blocks(&self.lo) - P::blocks(&before.lo)];
        (hi + lo).numbers()
    }

    /// Returns the difference of a lane, rounded.
    #[inline(always)]
    pub fn lane_since(&self, before: &Self, index: usize) -> f64 {
        (self.hi[index] - before.hi[index]) + (self.lo[index] - before.lo[index])
    }
}

impl<const N: usize> From<State<N>> for Doubles<N> {
    fn from(hi: State<N>) -> Self {
        Self { hi, lo: [0.0; N] }
    }
}

/// The highs of a product of matrix and vector, and what is added to them: the lows, and the errors of the sums.
type Sums<L, const N: usize> = (Blocks<L, N>, Blocks<L, N>, Blocks<L, N>, Blocks<L, N>);

/// A matrix of double-double numbers, by columns.
#[derive(Clone, Copy)]
pub struct Wide<const N: usize = 4> {
    pub hi: Columns<N>,
    pub lo: Columns<N>,
}

impl<const N: usize> Wide<N>
where
    Count<N>: Size<N>,
{
    pub fn of(rows: &[[Double; N]; N]) -> Self {
        let part =
            |pick: fn(Double) -> f64| Columns(std::array::from_fn(|c| std::array::from_fn(|r| pick(rows[r][c]))));
        Self { hi: part(|x| x.hi), lo: part(|x| x.lo) }
    }

    #[inline(always)]
    pub fn from_columns(columns: &[Doubles<N>; N]) -> Self {
        Self { hi: Columns(columns.map(|column| column.hi)), lo: Columns(columns.map(|column| column.lo)) }
    }

    #[inline(always)]
    pub fn column(&self, index: usize) -> Doubles<N> {
        Doubles { hi: self.hi.0[index], lo: self.lo.0[index] }
    }

    /// Returns the rows, rounded.
    pub fn rows(&self) -> Matrix<N> {
        self.hi.rows()
    }

    /// Returns `before + M v`, the core of every leap. Products and sums of highs are exact; their errors and the lows
    /// are summed in `f64`, so that the error of the result is about 2⁻¹⁰⁴ of the greatest term.
    #[inline(always)]
    pub fn times<P: Product>(&self, v: &Doubles<N>, before: &Doubles<N>) -> Doubles<N> {
        if N > 4 { P::times_apart(self, v, before) } else { self.times_here::<P>(v, before) }
    }

    #[inline(always)]
    fn times_here<P: Product>(&self, v: &Doubles<N>, before: &Doubles<N>) -> Doubles<N> {
        let (all, lows, halves, whole) = self.sum::<P>(v);
        let (moved, error) = two_sum(P::blocks(&before.hi), all);
        Doubles::joined::<P::Lanes>(moved, (lows + (halves + (whole + P::blocks(&before.lo)))) + error)
    }

    /// Returns `M v`.
    #[inline(always)]
    pub fn image<P: Product>(&self, v: &Doubles<N>) -> Doubles<N> {
        if N > 4 {
            return P::times_apart(self, v, &Doubles::ZERO);
        }
        let (all, lows, halves, whole) = self.sum::<P>(v);
        Doubles::joined::<P::Lanes>(all, lows + (halves + whole))
    }

    /// Returns `M v` where the fourth lane of `v` is zero.
    #[inline(always)]
    pub fn times_three<P: Product>(&self, v: &Doubles<N>) -> Doubles<N> {
        if N > 4 {
            return self.image::<P>(v);
        }
        let (high0, low0) = self.product::<P>(0, v);
        let (high1, low1) = self.product::<P>(1, v);
        let (high2, low2) = self.product::<P>(2, v);
        let (first, a) = two_sum(high0, high1);
        let (all, b) = two_sum(first, high2);
        Doubles::joined::<P::Lanes>(all, ((low0 + low1) + low2) + (a + b))
    }

    /// Returns the sum of the highs of `M v`, and what is to be added to it: the lows, the errors of the sums of two
    /// highs, and that of the sum of both.
    #[inline(always)]
    fn sum<P: Product>(&self, v: &Doubles<N>) -> Sums<P::Lanes, N> {
        let mut total = self.sum_of_four::<P>(0, v);
        if N > 4 {
            total = Self::sums::<P>(total, self.sum_of_four::<P>(4, v));
        }
        if N > 8 {
            total = Self::sums::<P>(total, self.sum_of_four::<P>(8, v));
        }
        total
    }

    #[inline(always)]
    fn sums<P: Product>(first: Sums<P::Lanes, N>, next: Sums<P::Lanes, N>) -> Sums<P::Lanes, N> {
        let (sum, error) = two_sum(first.0, next.0);
        (sum, first.1 + next.1, first.2 + next.2, (first.3 + next.3) + error)
    }

    /// Returns the sums over four columns from this one on.
    #[inline(always)]
    fn sum_of_four<P: Product>(&self, from: usize, v: &Doubles<N>) -> Sums<P::Lanes, N> {
        let (high0, low0) = self.product::<P>(from, v);
        let (high1, low1) = self.product::<P>(from + 1, v);
        let (high2, low2) = self.product::<P>(from + 2, v);
        let (high3, low3) = self.product::<P>(from + 3, v);
        let (first, a) = two_sum(high0, high1);
        let (second, b) = two_sum(high2, high3);
        let (all, c) = two_sum(first, second);
        (all, (low0 + low1) + (low2 + low3), a + b, c)
    }

    /// Returns a column times its lane of `v`: the highs of the products, and the rest of each.
    #[inline(always)]
    fn product<P: Product>(&self, column: usize, v: &Doubles<N>) -> (Blocks<P::Lanes, N>, Blocks<P::Lanes, N>) {
        let (hi, lo) = (P::blocks(&self.hi.0[column]), P::blocks(&self.lo.0[column]));
        let (high, low) = (P::every::<N>(v.hi[column]), P::every::<N>(v.lo[column]));
        let (product, error) = hi.two::<P>(high);
        (product, error + (hi * low + lo * high))
    }

    /// Returns the product of two matrices.
    #[inline(always)]
    pub fn after<P: Product>(&self, first: &Self) -> Self {
        let mut columns = [Doubles::ZERO; N];
        for (c, column) in columns.iter_mut().enumerate() {
            *column = self.times::<P>(&first.column(c), &Doubles::ZERO);
        }
        Self::from_columns(&columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns mantissas that are hard to round: all ones, single bits, halves, the splitter's own boundary.
    fn mantissas() -> Vec<u64> {
        let full = (1u64 << 52) - 1;
        let mut all = vec![0, full, full - 1, full / 3, full / 5, 0x5_5555_5555_5555, 0xA_AAAA_AAAA_AAAA];
        for bit in 0..52 {
            all.extend([1 << bit, full ^ (1 << bit), (1 << bit) - 1, full - ((1 << bit) - 1)]);
        }
        all
    }

    /// Returns the exact product of two `f64` as an integer and a power of two.
    fn exact(a: f64, b: f64) -> (i128, i32) {
        let part = |x: f64| {
            let bits = x.to_bits();
            let size = i128::from(bits & ((1 << 52) - 1) | 1 << 52);
            (if x < 0.0 { -size } else { size }, (bits >> 52 & 0x7FF) as i32 - 1075)
        };
        let ((a, ea), (b, eb)) = (part(a), part(b));
        (a * b, ea + eb)
    }

    /// Returns a finite `f64` as a multiple of a power of two that divides it.
    fn multiple(x: f64, power: i32) -> i128 {
        if x == 0.0 {
            return 0;
        }
        let (size, exponent) = exact(x, 1.0);
        // 1.0 itself contributes 52 zeros.
        let (size, exponent) = (size >> 52, exponent + 52);
        if exponent >= power { size << (exponent - power) } else { size >> (power - exponent) }
    }

    /// Makes sure that the processor has the lanes of [`Fused`].
    fn need_fused() {
        #[cfg(target_arch = "x86_64")]
        assert!(has_fused(), "this test needs a processor with AVX2 and fused multiply-add");
    }

    #[track_caller]
    fn check(a: f64, b: f64) {
        let (product, error) = Halves::two(a, b);
        let fused = Fused::two(a, b);
        assert_eq!((product.to_bits(), error), (fused.0.to_bits(), fused.1), "{a:e} * {b:e}");
        let (whole, power) = exact(a, b);
        assert_eq!(multiple(product, power) + multiple(error, power), whole, "{a:e} * {b:e}");
    }

    #[test]
    fn both_ways_to_multiply_lose_nothing_on_nasty_values() {
        let all = mantissas();
        for &one in &all {
            for &other in &all {
                let number = |mantissa: u64, exponent: u64| f64::from_bits(exponent << 52 | mantissa);
                check(number(one, 1023), number(other, 1023));
                check(-number(one, 1023 - 390), number(other, 1023 - 400));
                check(number(one, 1023 + 450), -number(other, 1023 + 440));
            }
        }
    }

    #[test]
    fn both_ways_to_multiply_lose_nothing_on_random_values() {
        let mut state = 1u64;
        let mut next = || {
            // The generator of Steele, Lea and Flood 2014 (SplitMix64).
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (state ^ state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ z >> 31
        };
        for _ in 0..2_000_000 {
            let mut number = || {
                let bits = next();
                f64::from_bits(bits & (1 << 63 | ((1 << 52) - 1)) | (1023 - 400 + (bits >> 52) % 800) << 52)
            };
            check(number(), number());
        }
    }

    #[test]
    fn quotients_and_sums_are_good_for_a_hundred_bits() {
        for (a, b) in [(1.0, 3.0), (2.0, 7.0), (-5.0, 1.37e-6), (0.0259, 2.26e-4), (24.0, 2.26e-4)] {
            let quotient = Double::from(a).over(b.into());
            let back = quotient * b.into() - a.into();
            assert!(back.hi.abs() <= 2f64.powi(-100) * f64::abs(a), "{a} / {b}: {back:?}");
        }
        let tiny = Double { hi: 1.0, lo: 2f64.powi(-100) };
        assert_eq!((tiny - 1.0.into()).hi, 2f64.powi(-100));
        assert_eq!(tiny.order(1.0.into()), Ordering::Greater);
    }

    #[test]
    fn a_matrix_acts_on_a_vector_to_the_same_bits_with_either_product_and_to_a_hundred_bits() {
        need_fused();
        // Integer entries with lows: the sums are known exactly, in integers of 2^-104.
        let number = |i: i64| Double { hi: i as f64, lo: (i * 3 - 7) as f64 * 2f64.powi(-58) };
        let rows: [[Double; 4]; 4] =
            std::array::from_fn(|r| std::array::from_fn(|c| number(1 + (r as i64 * 31 + c as i64 * 17) % 23)));
        let matrix = Wide::of(&rows);
        let lanes = |from: i64| {
            let mut all = Doubles::ZERO;
            (0..4).for_each(|k| all.set(k, number(from - 5 * k as i64)));
            all
        };
        let (v, before) = (lanes(9), lanes(-4));
        let got = matrix.times::<Halves>(&v, &before);
        assert_eq!(got, matrix.times::<Fused>(&v, &before));
        let whole = |x: Double| x.hi as i128 * (1 << 58) + (x.lo * 2f64.powi(58)) as i128;
        for (r, row) in rows.iter().enumerate() {
            let sum = (0..4).map(|c| whole(row[c]) * whole(v.lane(c))).sum::<i128>() + (whole(before.lane(r)) << 58);
            let found = (got.hi[r] as i128) * (1i128 << 116) + (got.lo[r] * 2f64.powi(116)) as i128;
            let high = got.hi[r] * 2f64.powi(60);
            assert_eq!(high, high.round(), "the high part is a multiple of 2^-60");
            let found = if got.hi[r].fract() == 0.0 {
                found
            } else {
                ((high as i128) << 56) + (got.lo[r] * 2f64.powi(116)) as i128
            };
            assert!((found - sum).abs() >> 18 == 0, "{r}: {}", found - sum);
        }
    }

    #[test]
    fn four_lanes_are_four_numbers_to_the_same_bits_with_either_product() {
        need_fused();
        // Lanes of all sizes, zeros of both signs, and sums that cancel to below the least size and to just above it.
        let numbers = |from: usize| {
            let (tiny, small) = (LEAST / 3.0, LEAST * 1.5);
            let all = [1.5, -0.0, 0.0, tiny, -tiny, small, -small, 1.0 / 3.0, -7e9, 3e-17, -1.5];
            let lane =
                |r: usize| Double { hi: all[(from + 3 * r) % all.len()], lo: all[(from + 5 * r + 3) % 5] * 1e-20 };
            let mut lanes = Doubles::ZERO;
            (0..4).for_each(|r| lanes.set(r, lane(r)));
            lanes
        };
        let bits = |x: Doubles| [x.hi, x.lo].map(|part| part.map(f64::to_bits));
        let joined = |hi: f64, lo: f64| {
            let (hi, lo) = two_sum(hi, lo);
            if hi.abs() < LEAST { [0.0; 2] } else { [hi, lo] }.map(f64::to_bits)
        };
        for (from, to) in (0..11).flat_map(|from| (0..11).map(move |to| (from, to))) {
            let (a, b) = (numbers(from), numbers(to));
            let factor = b.lane(0);
            let (sum, scaled) = (bits(a.plus::<Halves>(&b)), bits(a.scaled::<Halves>(factor)));
            assert_eq!(sum, bits(a.plus::<Fused>(&b)));
            assert_eq!(scaled, bits(a.scaled::<Fused>(factor)));
            for r in 0..4 {
                let (high, error) = two_sum(a.hi[r], b.hi[r]);
                assert_eq!([sum[0][r], sum[1][r]], joined(high, error + (a.lo[r] + b.lo[r])));
                let (high, error) = Halves::two(a.hi[r], factor.hi);
                let low = error + (a.hi[r] * factor.lo + a.lo[r] * factor.hi);
                assert_eq!([scaled[0][r], scaled[1][r]], joined(high, low));
            }
        }
    }
}
