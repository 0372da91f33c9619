//! Vectors of four states or a multiple of it, square matrices, and the operations on them.

use crate::flow::lanes::{Blocks, Count, Lanes, Numbers, Pairs, Size};

/// Current in A (on a rail, force in N), speed in rad/s (m/s), angle in rad (m), the hand's intended angle in rad (m);
/// then the other states of a network.
pub type State<const N: usize = 4> = [f64; N];
/// The rows of a square matrix.
pub type Matrix<const N: usize = 4> = [[f64; N]; N];

/// Index of the current in a [`State`].
pub(crate) const CURRENT: usize = 0;
/// Index of the speed in a [`State`].
pub(crate) const SPEED: usize = 1;
/// Index of the angle in a [`State`].
pub(crate) const ANGLE: usize = 2;
/// Index of the hand's intended angle in a [`State`].
pub(crate) const INTENT: usize = 3;

#[inline(always)]
pub(crate) fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut c = [[0.0; N]; N];
    for (row, out) in a.iter().zip(&mut c) {
        for (k, &factor) in row.iter().enumerate() {
            for (sum, &term) in out.iter_mut().zip(&b[k]) {
                *sum += factor * term;
            }
        }
    }
    c
}

#[inline(always)]
pub(crate) fn map2<const N: usize>(a: &Matrix<N>, b: &Matrix<N>, op: impl Fn(f64, f64) -> f64) -> Matrix<N> {
    let mut c = *a;
    for (row, other) in c.iter_mut().zip(b) {
        for (x, &y) in row.iter_mut().zip(other) {
            *x = op(*x, y);
        }
    }
    c
}

#[inline(always)]
pub(crate) fn transposed<const N: usize, const R: usize>(a: &[[f64; N]; R]) -> [[f64; R]; N] {
    std::array::from_fn(|r| std::array::from_fn(|c| a[c][r]))
}

#[inline(always)]
pub(crate) fn outer<const N: usize>(u: &State<N>, v: &State<N>) -> Matrix<N> {
    std::array::from_fn(|r| std::array::from_fn(|c| u[r] * v[c]))
}

/// Returns `row · matrix`.
pub(crate) fn row_times<const N: usize>(row: &State<N>, a: &Matrix<N>) -> State<N> {
    std::array::from_fn(|c| {
        let first = row[0] * a[0][c] + row[1] * a[1][c] + row[2] * a[2][c] + row[3] * a[3][c];
        (4..N).fold(first, |sum, r| sum + row[r] * a[r][c])
    })
}

#[inline(always)]
pub(crate) fn dot<const N: usize>(u: &State<N>, v: &State<N>) -> f64 {
    let first = (u[0] * v[0] + u[1] * v[1]) + (u[2] * v[2] + u[3] * v[3]);
    (4..N).fold(first, |sum, k| sum + u[k] * v[k])
}

/// A matrix of `R` rows by its `N` columns, so that its product with a vector can be vectorised.
#[derive(Clone, Copy)]
pub struct Columns<const N: usize = 4, const R: usize = N>(pub(crate) [[f64; R]; N]);

impl<const N: usize, const R: usize> Columns<N, R> {
    pub(crate) fn of(rows: &[[f64; N]; R]) -> Self {
        Self(transposed(rows))
    }

    /// Returns the matrix by rows.
    pub(crate) fn rows(&self) -> [[f64; N]; R] {
        transposed(&self.0)
    }

    /// Returns a row.
    pub(crate) fn row(&self, index: usize) -> State<N> {
        self.0.map(|column| column[index])
    }

    /// Returns the product with a vector.
    #[inline(always)]
    pub(crate) fn times(&self, v: &State<N>) -> State<R>
    where
        Count<R>: Size<R>,
    {
        self.image::<Pairs>(v).numbers()
    }

    /// Returns the product with a vector, in lanes.
    #[inline(always)]
    pub(crate) fn image<L: Lanes>(&self, v: &State<N>) -> Blocks<L, R>
    where
        Count<R>: Size<R>,
    {
        let mut sum = self.four::<L>(0, v);
        if N > 4 {
            sum = sum + self.four::<L>(4, v);
        }
        if N > 8 {
            sum = sum + self.four::<L>(8, v);
        }
        sum
    }

    /// Returns the part of the product of four columns from this one on.
    #[inline(always)]
    fn four<L: Lanes>(&self, c: usize, v: &State<N>) -> Blocks<L, R>
    where
        Count<R>: Size<R>,
    {
        (self.times_one::<L>(c, v) + self.times_one::<L>(c + 1, v))
            + (self.times_one::<L>(c + 2, v) + self.times_one::<L>(c + 3, v))
    }

    #[inline(always)]
    fn times_one<L: Lanes>(&self, c: usize, v: &State<N>) -> Blocks<L, R>
    where
        Count<R>: Size<R>,
    {
        let (column, factor): (Blocks<L, R>, Blocks<L, R>) = (Numbers::taken(&self.0[c]), Numbers::same(v[c]));
        column * factor
    }
}

#[inline(always)]
pub(crate) fn plus<const N: usize>(x: &State<N>, y: &State<N>) -> State<N> {
    std::array::from_fn(|r| x[r] + y[r])
}

#[inline(always)]
pub(crate) fn sizes<const N: usize>(x: &State<N>) -> State<N> {
    x.map(f64::abs)
}

/// Returns the rate of a system in 1/s: its norm after each pair of states is scaled to have equal coefficients of
/// coupling.
pub(crate) fn rate<const N: usize>(a: &Matrix<N>) -> f64 {
    let pair = |r: usize, c: usize| (a[r][c] * a[c][r]).abs().sqrt();
    (0..N).map(|r| (0..N).map(|c| pair(r, c)).sum::<f64>()).fold(0.0, f64::max)
}

pub(crate) fn norm<const N: usize>(a: &Matrix<N>) -> f64 {
    a.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max)
}
