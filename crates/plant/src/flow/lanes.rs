//! Four `f64` side by side, as the lanes of a state: each operation does the same in all four, in `f64`, never
//! contracted.
//!
//! The compiler makes halves and single numbers of much arithmetic on arrays. By construction, [`Register`] is one
//! register of an x86-64 processor with AVX2, and [`Pairs`] are two registers of any; elsewhere an array does the same
//! to the same bits.
//!
//! The four lanes hold four states of one motion; a motion of more states has several [`Blocks`] of them. Cells of a
//! map are not flowed side by side in them: in a chattering cell the double-double flows are 9 % of all instructions
//! and the evaluations in `f64` 7 %, so that even flows that cost nothing would make such a cell 1.2 times as fast.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m128d, __m256d, _CMP_LT_OQ, _mm_add_pd, _mm_andnot_pd, _mm_cmplt_pd, _mm_cvtsd_f64, _mm_mul_pd, _mm_set_pd,
    _mm_set1_pd, _mm_sub_pd, _mm_unpackhi_pd, _mm256_add_pd, _mm256_andnot_pd, _mm256_cmp_pd, _mm256_fmsub_pd,
    _mm256_loadu_pd, _mm256_mul_pd, _mm256_set1_pd, _mm256_storeu_pd, _mm256_sub_pd,
};
use std::ops::{Add, Mul, Sub};

/// Four `f64` in memory.
type Memory = [f64; 4];

/// Four `f64` in any form, and that in which to compute with them.
pub(crate) trait Four: Copy {
    type Lanes: Lanes;

    fn lanes(self) -> Self::Lanes;
}

impl Four for Memory {
    type Lanes = Array;

    #[inline(always)]
    fn lanes(self) -> Array {
        Array(self)
    }
}

impl<L: Lanes> Four for L {
    type Lanes = L;

    #[inline(always)]
    fn lanes(self) -> L {
        self
    }
}

/// Four `f64` in the form in which a processor computes with them.
pub trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Returns the numbers in lanes.
    fn of(state: &Memory) -> Self;

    /// Returns the same number in all lanes.
    fn all(number: f64) -> Self;

    /// Returns the numbers in memory.
    fn state(self) -> Memory;

    /// Returns the lanes in which the size of `deciding` is at least `least`, and 0 in the others.
    fn unless_below(self, least: f64, deciding: Self) -> Self;
}

/// A `TwoProduct` multiplies four numbers without loss.
pub trait TwoProduct {
    /// The form in which four numbers are computed.
    type Lanes: Lanes;

    /// Returns the rounded products, and the errors of their rounding.
    fn two_of(a: Self::Lanes, b: Self::Lanes) -> (Self::Lanes, Self::Lanes);
}

/// The `N` numbers of a state, four lanes at a time: of four numbers the lanes themselves.
pub(crate) type Blocks<L, const N: usize> = <Count<N> as Size<N>>::Of<L>;

/// A number of states, as a type.
pub struct Count<const N: usize>;

/// A `Size` is a number of states that registers of four lanes hold: 4, 8 or 12.
pub trait Size<const N: usize> {
    /// The numbers of a state in lanes.
    type Of<L: Lanes>: Numbers<L, N>;
}

impl Size<4> for Count<4> {
    type Of<L: Lanes> = L;
}

/// The `N` numbers of a state in lanes. Lanes and [`Several`] of them implement it.
pub trait Numbers<L, const N: usize>: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Returns the numbers in lanes.
    fn taken(state: &[f64; N]) -> Self;

    /// Returns the same number in all lanes.
    fn same(number: f64) -> Self;

    /// Returns the numbers in memory.
    fn numbers(self) -> [f64; N];

    /// Returns the rounded products, and the errors of their rounding.
    fn two<P: TwoProduct<Lanes = L>>(self, other: Self) -> (Self, Self);

    /// Returns the lanes in which the size of `deciding` is at least `least`, and 0 in the others.
    fn kept(self, least: f64, deciding: Self) -> Self;

    /// Returns the first four lanes.
    fn first(self) -> L;
}

impl<L: Lanes> Numbers<L, 4> for L {
    #[inline(always)]
    fn taken(state: &Memory) -> Self {
        L::of(state)
    }

    #[inline(always)]
    fn same(number: f64) -> Self {
        L::all(number)
    }

    #[inline(always)]
    fn numbers(self) -> Memory {
        L::state(self)
    }

    #[inline(always)]
    fn two<P: TwoProduct<Lanes = L>>(self, other: Self) -> (Self, Self) {
        P::two_of(self, other)
    }

    #[inline(always)]
    fn kept(self, least: f64, deciding: Self) -> Self {
        L::unless_below(self, least, deciding)
    }

    #[inline(always)]
    fn first(self) -> L {
        self
    }
}

/// Several blocks of four lanes.
#[derive(Clone, Copy)]
pub struct Several<L, const B: usize>([L; B]);

impl<L: Copy, const B: usize> Several<L, B> {
    #[inline(always)]
    fn join(mut self, other: Self, op: impl Fn(L, L) -> L) -> Self {
        for (block, other) in self.0.iter_mut().zip(other.0) {
            *block = op(*block, other);
        }
        self
    }
}

impl<L: Lanes, const B: usize> Add for Several<L, B> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.join(other, Add::add)
    }
}

impl<L: Lanes, const B: usize> Sub for Several<L, B> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.join(other, Sub::sub)
    }
}

impl<L: Lanes, const B: usize> Mul for Several<L, B> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.join(other, Mul::mul)
    }
}

macro_rules! several {
    ($($states:literal in $blocks:literal;)*) => {$(
        impl Size<$states> for Count<$states> {
                    type Of<L: Lanes> = Several<L, $blocks>;
        }

        impl<L: Lanes> Numbers<L, $states> for Several<L, $blocks> {
            #[inline(always)]
            fn taken(state: &[f64; $states]) -> Self {
                Self(std::array::from_fn(|block| L::of(&state.as_chunks::<4>().0[block])))
            }

            #[inline(always)]
            fn same(number: f64) -> Self {
                Self([L::all(number); $blocks])
            }

            #[inline(always)]
            fn numbers(self) -> [f64; $states] {
                let mut state = [0.0; $states];
                for (numbers, block) in state.as_chunks_mut::<4>().0.iter_mut().zip(self.0) {
                    *numbers = block.state();
                }
                state
            }

            #[inline(always)]
            fn two<P: TwoProduct<Lanes = L>>(self, other: Self) -> (Self, Self) {
                let (mut products, mut errors) = (self, self);
                for block in 0..$blocks {
                    (products.0[block], errors.0[block]) = P::two_of(self.0[block], other.0[block]);
                }
                (products, errors)
            }

            #[inline(always)]
            fn kept(self, least: f64, deciding: Self) -> Self {
                self.join(deciding, |block, deciding| block.unless_below(least, deciding))
            }

            #[inline(always)]
            fn first(self) -> L {
                self.0[0]
            }
        }
    )*};
}
several! {
    8 in 2;
    12 in 3;
}

/// Four `f64` in the registers that any processor has.
#[derive(Clone, Copy)]
pub(crate) struct Array(Memory);

impl Array {
    /// Returns the results of an operation on each lane. Without a loop: there are hundreds in a function, and the
    /// compiler would take minutes to unroll them.
    #[inline(always)]
    pub(crate) fn join(self, other: Self, op: impl Fn(f64, f64) -> f64) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Self([op(a, e), op(b, f), op(c, g), op(d, h)])
    }
}

impl Lanes for Array {
    #[inline(always)]
    fn of(state: &Memory) -> Self {
        Self(*state)
    }

    #[inline(always)]
    fn all(number: f64) -> Self {
        Self([number; 4])
    }

    #[inline(always)]
    fn state(self) -> Memory {
        self.0
    }

    #[inline(always)]
    fn unless_below(self, least: f64, deciding: Self) -> Self {
        self.join(deciding, |lane, deciding| if deciding.abs() < least { 0.0 } else { lane })
    }
}

impl Add for Array {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.join(other, Add::add)
    }
}

impl Sub for Array {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.join(other, Sub::sub)
    }
}

impl Mul for Array {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.join(other, Mul::mul)
    }
}

/// Four `f64` in two registers, which any x86-64 processor has.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Pairs(__m128d, __m128d);
#[cfg(not(target_arch = "x86_64"))]
pub(crate) type Pairs = Array;

#[cfg(target_arch = "x86_64")]
impl Lanes for Pairs {
    #[inline(always)]
    fn of(&[a, b, c, d]: &Memory) -> Self {
        // SAFETY: any x86-64 processor has SSE2.
        unsafe { Self(_mm_set_pd(b, a), _mm_set_pd(d, c)) }
    }

    #[inline(always)]
    fn all(number: f64) -> Self {
        // SAFETY: as in `of`.
        unsafe { Self(_mm_set1_pd(number), _mm_set1_pd(number)) }
    }

    #[inline(always)]
    fn state(self) -> Memory {
        // SAFETY: as in `of`.
        unsafe {
            let (b, d) = (_mm_unpackhi_pd(self.0, self.0), _mm_unpackhi_pd(self.1, self.1));
            [_mm_cvtsd_f64(self.0), _mm_cvtsd_f64(b), _mm_cvtsd_f64(self.1), _mm_cvtsd_f64(d)]
        }
    }

    #[inline(always)]
    fn unless_below(self, least: f64, deciding: Self) -> Self {
        // SAFETY: as in `of`.
        unsafe {
            let (sign, least) = (_mm_set1_pd(-0.0), _mm_set1_pd(least));
            let (a, b) = (_mm_andnot_pd(sign, deciding.0), _mm_andnot_pd(sign, deciding.1));
            Self(_mm_andnot_pd(_mm_cmplt_pd(a, least), self.0), _mm_andnot_pd(_mm_cmplt_pd(b, least), self.1))
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl Add for Pairs {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: as in `of`.
        unsafe { Self(_mm_add_pd(self.0, other.0), _mm_add_pd(self.1, other.1)) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Sub for Pairs {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: as in `of`.
        unsafe { Self(_mm_sub_pd(self.0, other.0), _mm_sub_pd(self.1, other.1)) }
    }
}

#[cfg(target_arch = "x86_64")]
impl Mul for Pairs {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: as in `of`.
        unsafe { Self(_mm_mul_pd(self.0, other.0), _mm_mul_pd(self.1, other.1)) }
    }
}

/// Four `f64` in one register of a processor with AVX2 and fused multiply-add.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(crate) struct Register(__m256d);

#[cfg(target_arch = "x86_64")]
impl Register {
    /// Returns `self * factor - less`, rounded once.
    #[inline(always)]
    pub(crate) fn times_less(self, factor: Self, less: Self) -> Self {
        // SAFETY: `double.rs` alone chooses this type, once it has asked the processor.
        Self(unsafe { _mm256_fmsub_pd(self.0, factor.0, less.0) })
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for Register {
    #[inline(always)]
    fn of(state: &Memory) -> Self {
        // SAFETY: as in `times_less`; the address is that of four numbers.
        Self(unsafe { _mm256_loadu_pd(state.as_ptr()) })
    }

    #[inline(always)]
    fn all(number: f64) -> Self {
        // SAFETY: as in `times_less`.
        Self(unsafe { _mm256_set1_pd(number) })
    }

    #[inline(always)]
    fn state(self) -> Memory {
        let mut state = [0.0; 4];
        // SAFETY: as in `times_less`; the address is that of four numbers.
        unsafe { _mm256_storeu_pd(state.as_mut_ptr(), self.0) };
        state
    }

    #[inline(always)]
    fn unless_below(self, least: f64, deciding: Self) -> Self {
        let (sign, least) = (Self::all(-0.0), Self::all(least));
        // SAFETY: as in `times_less`.
        Self(unsafe {
            let size = _mm256_andnot_pd(sign.0, deciding.0);
            _mm256_andnot_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(size, least.0), self.0)
        })
    }
}

#[cfg(target_arch = "x86_64")]
impl Add for Register {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: as in `times_less`.
        Self(unsafe { _mm256_add_pd(self.0, other.0) })
    }
}

#[cfg(target_arch = "x86_64")]
impl Sub for Register {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: as in `times_less`.
        Self(unsafe { _mm256_sub_pd(self.0, other.0) })
    }
}

#[cfg(target_arch = "x86_64")]
impl Mul for Register {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: as in `times_less`.
        Self(unsafe { _mm256_mul_pd(self.0, other.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::{Array, Lanes, Memory, Pairs};

    const LEAST: f64 = 1e-3;
    const NUMBERS: [f64; 9] = [0.0, -0.0, 1.0 / 3.0, -7e9, 3e-17, -1e-3, 0.9e-3, f64::INFINITY, -1.1e-3];

    #[track_caller]
    fn check<L: Lanes>() {
        let state = |from: usize, step: usize| -> Memory { std::array::from_fn(|r| NUMBERS[(from + step * r) % 9]) };
        for (from, to) in (0..9).flat_map(|from| (0..9).map(move |to| (from, to))) {
            let (a, b) = (state(from, 2), state(to, 5));
            let (x, y) = (L::of(&a), L::of(&b));
            let all = L::all(a[0]).state();
            for r in 0..4 {
                let same = |lanes: L, number: f64, what: &str| {
                    let lane = lanes.state()[r];
                    let is_same = lane.to_bits() == number.to_bits() || lane.is_nan() && number.is_nan();
                    assert!(is_same, "{what} of {} and {}: {lane}, not {number}", a[r], b[r]);
                };
                same(x, a[r], "itself");
                same(x + y, a[r] + b[r], "sum");
                same(x - y, a[r] - b[r], "difference");
                same(x * y, a[r] * b[r], "product");
                same(x.unless_below(LEAST, y), if b[r].abs() < LEAST { 0.0 } else { a[r] }, "choice");
                assert_eq!(all[r].to_bits(), a[0].to_bits());
            }
        }
    }

    #[test]
    fn lanes_are_numbers_side_by_side_in_any_form() {
        check::<Array>();
        check::<Pairs>();
        #[cfg(target_arch = "x86_64")]
        {
            assert!(crate::flow::double::has_fused(), "this test needs a processor with AVX2 and fused multiply-add");
            check::<super::Register>();
        }
    }
}
