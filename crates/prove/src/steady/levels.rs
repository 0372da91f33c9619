//! The level that multipliers need at each frequency, and matrices of floats.

pub(super) use crate::sampled::Matrix;
use crate::sampled::solution;

/// Frequencies at which a level is computed.
const FREQUENCIES: usize = 800;

/// States of the storage, and what enters, in the checker's order.
pub(super) type Row = [f64; 11];

/// The dissipation that a witness proves: how states follow, and the weighted squares of these rows.
pub(super) struct Dissipation {
    pub(super) next: [Row; 4],
    pub(super) read: Row,
    pub(super) bent: Row,
    /// `γ²`.
    pub(super) gain: f64,
    /// A bound of what enters by the rounding and by the drag, in counts.
    pub(super) entering: f64,
}

/// The angle, with its rounding, and its step.
pub(super) const ANGLE: Row = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
pub(super) const KEPT: Row = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
pub(super) const CLIMBS: Row = [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

impl Dissipation {
    /// Returns what the rows answer at frequencies up to half of the modulator's.
    pub(super) fn responses(&self) -> Vec<Response> {
        let at = |index: usize| {
            let share = index as f64 / (FREQUENCIES - 1) as f64;
            let w = std::f64::consts::PI * libm::exp(-9.0 * (1.0 - share));
            let z = Complex(libm::cos(w), libm::sin(w));
            // (z - A) X = B, by elimination.
            let mut rows = self.next.map(|row| row.map(|cell| Complex(cell, 0.0)));
            for (at, row) in rows.iter_mut().enumerate() {
                row[..4].iter_mut().for_each(|cell| cell.0 = -cell.0);
                row[at] = row[at].plus(z);
            }
            for at in 0..4 {
                let own = rows[at];
                let by = Complex(1.0, 0.0).over(own[at]);
                let own = own.map(|cell| cell.times(by));
                for row in &mut rows {
                    let factor = row[at];
                    let taken = |(cell, own): (&mut Complex, &Complex)| *cell = cell.minus(factor.times(*own));
                    row.iter_mut().zip(&own).for_each(taken);
                }
                rows[at] = own;
            }
            let answer = |of: &Row| -> [Complex; 7] {
                std::array::from_fn(|input| {
                    (0..4).fold(Complex(of[4 + input], 0.0), |sum, at| sum.plus(rows[at][4 + input].scaled(of[at])))
                })
            };
            Response {
                angle: answer(&ANGLE),
                kept: answer(&KEPT),
                climbs: answer(&CLIMBS),
                read: answer(&self.read),
                bent: answer(&self.bent).map(|part| part.scaled(self.gain.sqrt())),
            }
        };
        (0..FREQUENCIES).map(at).collect()
    }
}

/// The answers of the rows at a frequency, to the rounding and to each other input.
pub(super) struct Response {
    pub(super) angle: [Complex; 7],
    pub(super) kept: [Complex; 7],
    pub(super) climbs: [Complex; 7],
    pub(super) read: [Complex; 7],
    pub(super) bent: [Complex; 7],
}

impl Response {
    /// Returns the level that these multipliers need at the frequency.
    pub(super) fn level(&self, [climb, first, other, stale, noise]: [f64; 5]) -> f64 {
        let both = first + 3.0 * other;
        let mut cells: [[Complex; 7]; 7] = std::array::from_fn(|row| {
            std::array::from_fn(|of| {
                let product = |a: &[Complex; 7], b: &[Complex; 7]| a[row].conjugate().times(b[of]);
                let crossed = product(&self.kept, &self.climbs).plus(product(&self.climbs, &self.kept));
                product(&self.angle, &self.angle)
                    .plus(crossed.scaled(0.5 * climb))
                    .plus(product(&self.read, &self.read).scaled(both))
                    .plus(product(&self.bent, &self.bent).scaled(stale))
            })
        });
        for (at, own) in [first, other, other, other, noise, stale].into_iter().enumerate() {
            cells[1 + at][1 + at].0 -= own;
        }
        // The last input first: each is taken at its worst.
        for at in (1..7).rev() {
            let pivot = cells[at][at].0;
            if pivot >= 0.0 {
                return f64::INFINITY;
            }
            for row in 0..at {
                let share = cells[row][at].scaled(1.0 / pivot);
                let pivots = cells[at];
                let taken = |(cell, of): (&mut Complex, &Complex)| *cell = cell.minus(share.times(*of));
                cells[row][..at].iter_mut().zip(&pivots).for_each(taken);
            }
        }
        cells[0][0].0
    }
}

/// A complex number.
#[derive(Clone, Copy)]
pub(super) struct Complex(f64, f64);

impl Complex {
    pub(super) fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
    pub(super) fn minus(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
    pub(super) fn times(self, other: Self) -> Self {
        Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
    pub(super) fn scaled(self, by: f64) -> Self {
        Self(self.0 * by, self.1 * by)
    }
    pub(super) fn conjugate(self) -> Self {
        Self(self.0, -self.1)
    }
    pub(super) fn square(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }
    pub(super) fn over(self, other: Self) -> Self {
        self.times(other.conjugate()).scaled(1.0 / other.square())
    }
}

pub(super) fn times(a: &Matrix, x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|row| (0..3).map(|of| a[row][of] * x[of]).sum())
}

pub(super) fn transposed(a: &Matrix) -> Matrix {
    (0..a[0].len()).map(|row| a.iter().map(|other| other[row]).collect()).collect()
}

/// Returns a product of matrices that need not be square.
pub(super) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let cell = |row: &Vec<f64>, of: usize| row.iter().zip(b).map(|(left, right)| left * right[of]).sum();
    a.iter().map(|row| (0..b[0].len()).map(|of| cell(row, of)).collect()).collect()
}

pub(super) fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect()
}

pub(super) fn inverse(a: &Matrix) -> Option<Matrix> {
    let column = |of: usize| {
        let rows = a.iter().enumerate().map(|(row, cells)| {
            let right = f64::from(u8::from(row == of));
            cells.iter().copied().chain([right]).collect()
        });
        solution(rows.collect())
    };
    let columns: Option<Matrix> = (0..a.len()).map(column).collect();
    columns.map(|columns| transposed(&columns))
}
