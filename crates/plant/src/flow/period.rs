//! Quantities common to all whole periods of one length, in one mode.

use std::array::from_fn;

use crate::flow::double::{Double, Doubles, Product, Wide, versions};
use crate::flow::linear::{Linear, Trajectory};
use crate::flow::matrix::{CURRENT, Matrix};

/// A period of `edges` clock edges.
pub(crate) struct Period {
    pub(crate) edges: u64,
    /// `P(T)⁻¹`.
    pub(crate) inverse: Wide,
}

impl Period {
    versions! {
        /// Creates a period. Returns `None` if `P(T)` has no usable inverse: the period is then a whole number of the
        /// periods of the system itself.
        pub(crate) fn new[new_fused, new_native, new_with](system: &Linear, edges: u64) -> Option<Self>
    }

    #[inline(always)]
    fn new_with<P: Product>(system: &Linear, edges: u64) -> Option<Self> {
        let p = Wide::from_columns(&from_fn(|c| response::<P>(system, c, edges)));
        let rows = p.rows();
        let near = inverse(&rows)?;
        let mut x = Wide::of(&near.map(|row| row.map(Double::from)));
        // Newton's steps, each of which doubles the number of right digits.
        let rest = |x: &Wide| {
            let product = p.after::<P>(x);
            from_fn(|c| {
                let mut unit = Doubles::ZERO;
                unit.set(c, 1.0.into());
                unit.plus::<P>(&product.column(c).negated())
            })
        };
        for _ in 0..3 {
            let rest: [Doubles; 4] = rest(&x);
            x = Wide::from_columns(&from_fn(|c| x.times::<P>(&rest[c], &x.column(c))));
        }
        let (rest, near) = (rest(&x), x.rows());
        let is_good = |r: usize, c: usize| {
            let size: f64 = (0..4).map(|k| (rows[r][k] * near[k][c]).abs()).sum();
            rest[c].hi[r].abs() <= 2f64.powi(-90) * size
        };
        (0..4).all(|r| (0..4).all(|c| is_good(r, c))).then_some(Self { edges, inverse: x })
    }

    /// Returns `P(T)⁻¹ P(T - d) e`.
    #[inline(always)]
    pub(crate) fn share<P: Product>(&self, system: &Linear, duty: u64) -> Doubles {
        self.inverse.times::<P>(&response::<P>(system, CURRENT, self.edges - duty), &Doubles::ZERO)
    }
}

/// Returns a column of `P` after this number of edges.
#[inline(always)]
fn response<P: Product>(system: &Linear, column: usize, edges: u64) -> Doubles {
    let mut unit = Doubles::ZERO;
    unit.set(column, 1.0.into());
    Trajectory { system, x: Doubles::ZERO, f: Doubles::ZERO, w: unit }.flow::<P>(edges)
}

/// Returns the inverse by elimination, in `f64`; `None` if there is none.
fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let mut left = *matrix;
    let mut right: Matrix = from_fn(|r| from_fn(|c| f64::from(u8::from(r == c))));
    for k in 0..4 {
        let pivot = (k..4).max_by(|&r, &s| left[r][k].abs().total_cmp(&left[s][k].abs()))?;
        left.swap(k, pivot);
        right.swap(k, pivot);
        let scale = 1.0 / left[k][k];
        if !scale.is_finite() {
            return None;
        }
        (left[k], right[k]) = (left[k].map(|x| x * scale), right[k].map(|x| x * scale));
        for r in (0..4).filter(|&r| r != k) {
            let factor = left[r][k];
            for c in 0..4 {
                left[r][c] -= factor * left[k][c];
                right[r][c] -= factor * right[k][c];
            }
        }
    }
    Some(right)
}
