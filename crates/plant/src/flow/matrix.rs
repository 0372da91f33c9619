//! Vectors of four states, matrices of four by four, and the operations on them.

use crate::flow::lanes::{Lanes, Pairs, each};

/// Current in A (on a rail, force in N), speed in rad/s (m/s), angle in rad (m), the hand's intended angle in rad (m).
pub type State = [f64; 4];
/// Four rows of four entries.
pub type Matrix = [[f64; 4]; 4];

/// Index of the current in a [`State`].
pub(crate) const CURRENT: usize = 0;
/// Index of the speed in a [`State`].
pub(crate) const SPEED: usize = 1;
/// Index of the angle in a [`State`].
pub(crate) const ANGLE: usize = 2;
/// Index of the hand's intended angle in a [`State`].
pub(crate) const INTENT: usize = 3;

#[inline(always)]
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut c = [[0.0; 4]; 4];
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
pub(crate) fn map2(a: &Matrix, b: &Matrix, op: impl Fn(f64, f64) -> f64) -> Matrix {
    let mut c = *a;
    for (row, other) in c.iter_mut().zip(b) {
        for (x, &y) in row.iter_mut().zip(other) {
            *x = op(*x, y);
        }
    }
    c
}

#[inline(always)]
pub(crate) fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| a[c][r]))
}

#[inline(always)]
pub(crate) fn outer(u: &State, v: &State) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| u[r] * v[c]))
}

/// Returns `row · matrix`.
pub(crate) fn row_times(row: &State, a: &Matrix) -> State {
    std::array::from_fn(|c| row[0] * a[0][c] + row[1] * a[1][c] + row[2] * a[2][c] + row[3] * a[3][c])
}

#[inline(always)]
pub(crate) fn dot(u: &State, v: &State) -> f64 {
    (u[0] * v[0] + u[1] * v[1]) + (u[2] * v[2] + u[3] * v[3])
}

/// A matrix by columns, so that its product with a vector can be vectorised.
#[derive(Clone, Copy)]
pub(crate) struct Columns(pub(crate) Matrix);

impl Columns {
    pub(crate) fn of(rows: &Matrix) -> Self {
        Self(transposed(rows))
    }

    /// Returns the matrix by rows.
    pub(crate) fn rows(&self) -> Matrix {
        transposed(&self.0)
    }

    /// Returns a row.
    pub(crate) fn row(&self, index: usize) -> State {
        self.0.map(|column| column[index])
    }

    /// Returns the product with a vector.
    #[inline(always)]
    pub(crate) fn times(&self, v: &State) -> State {
        self.image(&each::<Pairs>(v)).state()
    }

    /// Returns the product with a vector, [`each`] of whose numbers is in all lanes.
    #[inline(always)]
    pub(crate) fn image<L: Lanes>(&self, v: &[L; 4]) -> L {
        let [a, b, c, d] = &self.0;
        (L::of(a) * v[0] + L::of(b) * v[1]) + (L::of(c) * v[2] + L::of(d) * v[3])
    }
}

#[inline(always)]
pub(crate) fn plus(x: &State, y: &State) -> State {
    std::array::from_fn(|r| x[r] + y[r])
}

#[inline(always)]
pub(crate) fn sizes(x: &State) -> State {
    x.map(f64::abs)
}

/// Returns the rate of a system in 1/s: its norm after each pair of states is scaled to have equal coefficients of
/// coupling.
pub(crate) fn rate(a: &Matrix) -> f64 {
    let pair = |r: usize, c: usize| (a[r][c] * a[c][r]).abs().sqrt();
    (0..4).map(|r| (0..4).map(|c| pair(r, c)).sum::<f64>()).fold(0.0, f64::max)
}

pub(crate) fn norm(a: &Matrix) -> f64 {
    a.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max)
}
