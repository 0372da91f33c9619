//! Small square matrices whose size is known at compile time, of numbers that may depend on `K` parameters.

use std::array::from_fn;

use crate::form::Form;
use crate::interval::Interval;

/// A column of numbers.
pub type Column<const N: usize, const K: usize> = [Form<K>; N];
/// A square matrix, as a list of rows.
pub type Square<const N: usize, const K: usize> = [Column<N, K>; N];

/// Returns a matrix times a column.
pub fn times<const N: usize, const K: usize>(a: &Square<N, K>, x: &Column<N, K>) -> Column<N, K> {
    from_fn(|row| (0..N).fold(Form::ZERO, |sum, of| sum.plus(a[row][of].times(x[of]))))
}

/// Returns a product of matrices.
pub fn product<const N: usize, const K: usize>(a: &Square<N, K>, b: &Square<N, K>) -> Square<N, K> {
    from_fn(|row| from_fn(|of| (0..N).fold(Form::ZERO, |sum, by| sum.plus(a[row][by].times(b[by][of])))))
}

/// Returns a matrix with rows and columns exchanged.
pub fn transposed<const N: usize, const K: usize>(a: &Square<N, K>) -> Square<N, K> {
    from_fn(|row| from_fn(|of| a[of][row]))
}

/// Returns the symmetric matrix with this upper triangle, row by row.
pub fn symmetric<const N: usize, const K: usize>(upper: &[Form<K>]) -> Square<N, K> {
    // Rows before this one have one cell less each than the one above.
    let place = |row: usize, of: usize| row * (2 * N - row - 1) / 2 + of;
    from_fn(|row| from_fn(|of| upper[place(row.min(of), row.max(of))]))
}

/// Returns the exponential of a matrix: Taylor's polynomial of a small part of it, squared.
pub fn exponential<const N: usize, const K: usize>(a: &Square<N, K>) -> Square<N, K> {
    const HALVINGS: i32 = 12;
    let part = a.map(|row| row.map(|cell| cell.scaled(2f64.powi(-HALVINGS))));
    let size = |row: &Column<N, K>| row.iter().fold(0.0, |sum: f64, cell| (sum + cell.size()).next_up());
    let norm = part.iter().map(size).fold(0.0, f64::max);
    let one: Square<N, K> = from_fn(|row| from_fn(|of| Form::exact(f64::from(u8::from(row == of)))));
    let (mut term, mut sum) = (one, one);
    for order in 1..=6 {
        term = product(&part, &term).map(|row| row.map(|cell| cell.over(f64::from(order))));
        sum = from_fn(|row| from_fn(|of| sum[row][of].plus(term[row][of])));
    }
    // The terms that follow have less than twice the first one of them, if the norm is below a half.
    let rest = if norm < 0.5 { norm.powi(7) / 2000.0 } else { f64::INFINITY };
    let rest = Form::of(Interval { lo: -rest, hi: rest });
    (0..HALVINGS).fold(sum.map(|row| row.map(|cell| cell.plus(rest))), |flow, _| product(&flow, &flow))
}

/// Whether the symmetric matrix with this upper triangle is proved to be positive definite, whatever the parameters
/// are. It is a mean of its matrices at the control points, with the same rests, and means of positive matrices are
/// positive.
pub fn is_positive<const N: usize, const K: usize>(cells: &Square<N, K>) -> bool {
    (0..Form::<K>::CONTROLS).all(|control| is_positive_within(cells.map(|row| row.map(|cell| cell.at(control)))))
}

/// Whether every symmetric matrix within these cells on and above the diagonal is proved to be positive definite. It is
/// if it is so in other coordinates, those in which the middle of the cells is nearly the identity: all pivots of its
/// elimination are above 0 there.
fn is_positive_within<const N: usize>(cells: [[Interval; N]; N]) -> bool {
    // A number that is none, or no longer finite, proves nothing.
    let is_number = |cell: &Interval| cell.lo.is_finite() && cell.hi.is_finite();
    let Some(turn) = cells.iter().flatten().all(is_number).then(|| unmixing(&cells)).flatten() else { return false };
    let turned: [[Interval; N]; N] = from_fn(|row| {
        from_fn(|of| {
            (0..=of).fold(Interval::ZERO, |sum, by| sum.plus(cells[row.min(by)][row.max(by)].times(turn[by][of])))
        })
    });
    let mut left: [[Interval; N]; N] = from_fn(|row| {
        from_fn(|of| (0..=row).fold(Interval::ZERO, |sum, by| sum.plus(turn[by][row].times(turned[by][of]))))
    });
    for at in 0..N {
        let own = left[at];
        if own[at].lo <= 0.0 || !own.iter().all(is_number) {
            return false;
        }
        for row in at + 1..N {
            let share = own[row].divided(own[at]);
            for of in row..N {
                left[row][of] = left[row][of].minus(share.times(own[of]));
            }
        }
    }
    true
}

/// Returns an upper triangular matrix `T` without a 0 on its diagonal. `T' A T` is nearly the identity for the middle
/// `A` of these cells; `None` if no pivot of its elimination is above 0.
fn unmixing<const N: usize>(cells: &[[Interval; N]; N]) -> Option<[[Interval; N]; N]> {
    let mut left: [[f64; N]; N] = from_fn(|row| from_fn(|of| cells[row.min(of)][row.max(of)].middle()));
    let mut turn: [[f64; N]; N] = from_fn(|row| from_fn(|of| f64::from(u8::from(row == of))));
    for at in 0..N {
        let own = left[at];
        for row in at + 1..N {
            let share = own[row] / own[at];
            for of in row..N {
                left[row][of] -= share * own[of];
            }
            turn[..=at].iter_mut().for_each(|cells| cells[row] -= share * cells[at]);
        }
    }
    let scales: [f64; N] = from_fn(|at| 1.0 / left[at][at].sqrt());
    let is_fine = scales.iter().all(|scale| *scale > 0.0 && scale.is_finite());
    is_fine.then(|| from_fn(|row| from_fn(|of| Interval::exact(turn[row][of] * scales[of]))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_encloses_its_closed_forms() {
        // A rotation, a decay, and a shear with both: closed forms of the library's functions, within some units.
        for angle in [1e-3f64, 0.7, 3.0, 20.0, 1500.0] {
            let (sine, cosine) = angle.sin_cos();
            let fall = (-angle).exp();
            let number = Form::<0>::exact;
            let found = exponential(&[
                [number(0.0), number(angle), number(0.0)],
                [number(-angle), number(0.0), number(0.0)],
                [number(0.0), number(0.0), number(-angle)],
            ]);
            let exact = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, fall]];
            for (found, exact) in found.map(|row| row.map(Form::all)).iter().flatten().zip(exact.iter().flatten()) {
                let spare = 4.0 * f64::EPSILON * exact.abs();
                assert!(found.lo <= exact + spare && exact - spare <= found.hi, "{angle}: {found:?}, not {exact}");
                // A polynomial alone misses the last of these: the first term left out is 4096/5040 of (1500/4096)^7.
                let width = if angle > 1000.0 { 0.1 } else { 1e-11 * (1.0 + angle) };
                assert!(found.hi - found.lo < width, "{angle}: {found:?} is wide");
            }
        }
        // Nothing is known where the norm is a half.
        let wide = exponential(&[[Form::<0>::of(Interval { lo: -2048.0, hi: 2048.0 })]])[0][0].all();
        assert!(wide.hi.is_infinite() || wide.hi.is_nan(), "{wide:?}");
    }

    #[test]
    fn a_matrix_is_positive_if_and_only_if_its_determinants_are() {
        // All symmetric matrices of three rows with small whole numbers: leading determinants, exactly.
        let mut positive = 0;
        for code in 0..5i64.pow(6) {
            let digit = |at: u32| code / 5i64.pow(at) % 5 - 1;
            let upper: [i64; 6] = std::array::from_fn(|at| digit(at as u32));
            let [a, b, c, d, e, f] = upper;
            let determinant = a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c);
            let is_so = a > 0 && a * d - b * b > 0 && determinant > 0;
            let found = is_positive(&symmetric::<3, 0>(&upper.map(|cell| Form::exact(cell as f64))));
            assert_eq!(found, is_so, "{upper:?}");
            positive += u32::from(found);
        }
        assert!(positive > 100, "{positive}");
    }

    #[test]
    fn a_matrix_within_wide_cells_may_be_indefinite() {
        // The cell beside the diagonal may be 1, where the determinant is 0.
        let cells = |off: f64| {
            let (one, off) = (Form::<0>::exact(1.0), Form::of(Interval { lo: 0.0, hi: off }));
            [[one, off], [off, one]]
        };
        assert!(is_positive(&cells(1.0 - 1e-12)) && !is_positive(&cells(1.0)) && !is_positive(&cells(f64::NAN)));
    }
}
