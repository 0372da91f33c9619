//! Square matrices of intervals that depend on a number, as power series, and their exponentials.

use crate::interval::{Interval, Matrix};

/// Returns `e^a` of a square matrix.
pub fn exponential(a: &Matrix) -> Matrix {
    Matrix::identity(a.rows()).plus(&Series::new(&[&a.0]).exponential_change().into_parts()[0])
}

/// A square matrix as a power series in a number `h`: its value at `h = 0`, its derivative there, half of its second
/// derivative and so on. Every power of `h` beyond the last is left out.
///
/// The parts are the first row of blocks of the matrix whose diagonals of blocks are constant, the value on the main
/// one and each part on one farther above; products of such matrices are products of the series.
#[derive(Clone)]
pub struct Series {
    /// Rows of each part.
    size: usize,
    parts: usize,
    /// Part by part, row by row.
    cells: Vec<Interval>,
}

impl Series {
    /// Creates a series of one part or more, all of one size.
    pub fn new(parts: &[&[Vec<Interval>]]) -> Self {
        let cells = parts.iter().flat_map(|part| part.iter().flatten().copied()).collect();
        Self { size: parts[0].len(), parts: parts.len(), cells }
    }

    /// Returns the coefficients of the powers of `h`.
    pub fn into_parts(self) -> Vec<Matrix> {
        let part = |cells: &[Interval]| Matrix(cells.chunks(self.size).map(<[_]>::to_vec).collect());
        self.cells.chunks(self.size * self.size).map(part).collect()
    }

    pub fn map(&self, change: impl Fn(Interval) -> Interval) -> Self {
        Self { cells: self.cells.iter().map(|&cell| change(cell)).collect(), ..*self }
    }

    fn joined(&self, other: &Self, join: impl Fn(Interval, Interval) -> Interval) -> Self {
        Self { cells: self.cells.iter().zip(&other.cells).map(|(&a, &b)| join(a, b)).collect(), ..*self }
    }

    /// Returns the series plus a multiple of the identity.
    fn plus_identity(&self, by: f64) -> Self {
        let mut sum = self.clone();
        for cell in sum.cells[..self.size * self.size].iter_mut().step_by(self.size + 1) {
            *cell = cell.plus(Interval::exact(by));
        }
        sum
    }

    fn times(&self, other: &Self) -> Self {
        let (size, area) = (self.size, self.size * self.size);
        let mut product = Self { cells: vec![Interval::ZERO; self.cells.len()], ..*self };
        for power in 0..self.parts {
            for by in 0..self.parts - power {
                let (left, right) = (&self.cells[power * area..][..area], &other.cells[by * area..][..area]);
                let sums = &mut product.cells[(power + by) * area..][..area];
                for row in (0..area).step_by(size) {
                    let sums = &mut sums[row..][..size];
                    for of in 0..size {
                        let factor = left[row + of];
                        // Zeros add nothing, not even rounding.
                        if factor != Interval::ZERO {
                            for (sum, cell) in sums.iter_mut().zip(&right[of * size..][..size]) {
                                *sum = sum.plus(factor.times(*cell));
                            }
                        }
                    }
                }
            }
        }
        product
    }

    /// Returns the greatest sum of absolute values along a row of blocks.
    fn norm(&self) -> f64 {
        let row = |row: usize| self.cells.chunks_exact(self.size).skip(row).step_by(self.size).flatten();
        let sum = |of: usize| row(of).fold(0.0, |sum: f64, cell| (sum + cell.size()).next_up());
        (0..self.size).map(sum).fold(0.0, f64::max)
    }

    /// Returns `e^(self) - 1`, precise where that is small. The series is scaled down, Taylor's polynomial with its
    /// remainder gives the change `c`, and `c` is then doubled repeatedly by two formulas, whose results are
    /// intersected: `c (2 + c)`, which is precise where the change is small, and `(1 + c)² - 1`, which widens the
    /// enclosure of a decaying part least.
    pub fn exponential_change(&self) -> Self {
        const ORDER: i32 = 13;
        // Below an eighth, the alternating terms of the polynomial do not widen the enclosure by much.
        let halvings = (libm::log2(self.norm()).ceil() as i32 + 3).max(0);
        let small = self.map(|cell| cell.scaled(2f64.powi(-halvings)));
        let (mut term, mut sum) = (small.clone(), small.clone());
        for index in 2..=ORDER {
            // Powers of one matrix commute, and it has more zeros than they.
            term = small.times(&term).map(|cell| cell.over(f64::from(index)));
            sum = sum.joined(&term, Interval::plus);
        }
        // The norm is at most an eighth, so each remaining term is less than a twentieth of the one before it.
        let rest = term.norm() / 19.0;
        let mut change = sum.map(|cell| cell.plus(Interval { lo: -rest, hi: rest }));
        for _ in 0..halvings {
            let flow = change.plus_identity(1.0);
            let squared = flow.times(&flow).plus_identity(-1.0);
            let precise = change.times(&change.plus_identity(2.0));
            change = precise.joined(&squared, Interval::within);
        }
        change
    }
}

#[cfg(test)]
mod tests {
    use super::Series;
    use crate::interval::Interval;

    /// Returns the exponential of a series of numbers: `e^(...)` itself, not its change.
    fn raised<const N: usize>(parts: &[[[f64; N]; N]]) -> Vec<[[Interval; N]; N]> {
        let parts: Vec<Vec<Vec<Interval>>> =
            parts.iter().map(|part| part.iter().map(|row| row.map(Interval::exact).to_vec()).collect()).collect();
        let parts: Vec<&[Vec<Interval>]> = parts.iter().map(Vec::as_slice).collect();
        let change = Series::new(&parts).exponential_change().plus_identity(1.0);
        let rows = |part: crate::interval::Matrix| std::array::from_fn(|r| std::array::from_fn(|c| part.0[r][c]));
        change.into_parts().into_iter().map(rows).collect()
    }

    fn encloses(found: Interval, exact: f64) {
        // The closed forms err by some units in the last place themselves.
        let spare = 1e-14 * (1.0 + exact.abs());
        assert!(found.lo <= exact + spare && found.hi >= exact - spare, "{found:?} is beside {exact}");
        assert!(found.width() <= 2e-11 * (1.0 + exact.abs()), "{found:?} is wide");
    }

    #[test]
    fn an_exponential_has_the_derivatives_of_its_closed_form() {
        // Two rates: the derivatives by the second do not commute with the matrix.
        for (a, b) in [(-3.0f64, -0.25f64), (1.5, -40.0), (-1e-3, 2e-3)] {
            let slope = [[0.0, 0.0], [0.0, 1.0]];
            let found = raised(&[[[a, 1.0], [0.0, b]], slope, [[0.0; 2]; 2]]);
            let (apart, falls) = (a - b, b.exp());
            let rest = a.exp() - falls - falls * apart;
            let corner = [
                (a.exp() - falls) / apart,
                rest / apart.powi(2),
                0.5 * (2.0 * rest - falls * apart.powi(2)) / apart.powi(3),
            ];
            let own = [falls, falls, 0.5 * falls];
            // Where the rates are close, the closed form of the corner is a small difference.
            let kept = if apart.abs() < 0.1 { 1 } else { 3 };
            for (power, (found, own)) in found.iter().zip(own).enumerate() {
                encloses(found[0][0], if power == 0 { a.exp() } else { 0.0 });
                encloses(found[1][1], own);
                assert!(found[1][0].has_zero() && found[1][0].width() < 1e-11);
                if power < kept {
                    encloses(found[0][1], corner[power]);
                }
            }
        }
    }

    #[test]
    fn so_has_a_rotation_by_its_angle() {
        for angle in [0.01f64, 2.0, 11.0] {
            let turn = |by: f64| [[0.0, by], [-by, 0.0]];
            let found = raised(&[turn(angle), turn(1.0), turn(0.0)]);
            let (sine, cosine) = angle.sin_cos();
            for (found, [along, across]) in
                found.iter().zip([[cosine, sine], [-sine, cosine], [-0.5 * cosine, -0.5 * sine]])
            {
                for (row, exact) in found.iter().zip([[along, across], [-across, along]]) {
                    row.iter().zip(exact).for_each(|(found, exact)| encloses(*found, exact));
                }
            }
        }
    }

    #[test]
    fn higher_parts_of_a_number_join_its_exponential() {
        let found = raised(&[[[0.7]], [[-2.0]], [[5.0]]]);
        let whole = 0.7f64.exp();
        for (found, exact) in found.iter().zip([whole, -2.0 * whole, (0.5 * 4.0 + 5.0) * whole]) {
            encloses(found[0][0], exact);
        }
    }
}
