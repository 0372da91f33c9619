//! Leaps of a linear system: how the state changes over a stretch of time, and the integrals on the way.

use crate::matrix::{ANGLE, CURRENT, Columns, Matrix, SPEED, State, dot, map2, norm, outer, product, transposed};

/// `∫ i dt`, `∫ i² dt`, `∫ ω² dt` and `∫ θ dt` over a leap, in SI units.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Integrals {
    /// Charge in A·s.
    pub current: f64,
    /// In A²·s.
    pub current_squared: f64,
    /// In rad²/s.
    pub speed_squared: f64,
    /// In rad·s.
    pub angle: f64,
}

impl Integrals {
    /// Adds those of the next leap.
    #[inline(always)]
    pub fn add(&mut self, next: &Self) {
        self.current += next.current;
        self.current_squared += next.current_squared;
        self.speed_squared += next.speed_squared;
        self.angle += next.angle;
    }
}

/// What a leap of a fixed length does: the matrix that carries `w` to the change of state, and its quadratures.
#[derive(Clone, Copy)]
pub(crate) struct Leap {
    /// Length in seconds.
    length_s: f64,
    /// `P(t)`.
    pub(crate) p: Matrix,
    /// `∫ P ds`, whole: rows for current and angle are the charge and angle integrals.
    s: Matrix,
    /// `∫ pᵢᵀ pᵢ ds` for the current's row of `P`.
    current_squared: Matrix,
    /// The same for the speed's row.
    speed_squared: Matrix,
}

impl Leap {
    pub(crate) const NOTHING: Self = Self {
        length_s: 0.0,
        p: [[0.0; 4]; 4],
        s: [[0.0; 4]; 4],
        current_squared: [[0.0; 4]; 4],
        speed_squared: [[0.0; 4]; 4],
    };

    /// A leap short enough for its Taylor series: `‖A‖ t` at most one half.
    fn taylor(a: &Matrix, t: f64) -> Self {
        const TERMS: usize = 18;
        // P = Σ c_k A^k t^{k+1}, c_k = 1/(k+1)!; the rows r_k = e_iᵀ A^k give ∫ pᵀp = Σ c_j c_k r_jᵀ r_k t^{j+k+3}/(j+k+3).
        let mut leap = Self { length_s: t, ..Self::NOTHING };
        let mut power: Matrix = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        let mut terms: Vec<Matrix> = Vec::with_capacity(TERMS);
        let mut coefficient = t;
        for k in 0..TERMS {
            terms.push(map2(&power, &power, |x, _| x * coefficient));
            power = product(&power, a);
            coefficient *= t / (k + 2) as f64;
        }
        for k in (0..TERMS).rev() {
            leap.p = map2(&leap.p, &terms[k], |x, y| x + y);
            leap.s = map2(&leap.s, &terms[k], |x, y| x + y * t / (k + 2) as f64);
        }
        for j in (0..TERMS).rev() {
            for k in (0..TERMS - j).rev() {
                let weight = t / (j + k + 3) as f64;
                for (sum, row) in [(&mut leap.current_squared, CURRENT), (&mut leap.speed_squared, SPEED)] {
                    *sum = map2(sum, &outer(&terms[j][row], &terms[k][row]), |x, y| x + y * weight);
                }
            }
        }
        leap
    }

    /// This leap, then `next`.
    pub(crate) fn then(&self, a: &Matrix, next: &Self) -> Self {
        let b = next.length_s;
        let ap = product(a, &self.p);
        let after = |m: &Matrix| map2(m, &product(m, &ap), |x, y| x + y);
        let p = joined(a, &self.p, &next.p);
        let held = map2(&self.p, &self.p, |x, _| x * b);
        let s_after = after(&next.s);
        let s = map2(&self.s, &map2(&held, &s_after, |x, y| x + y), |x, y| x + y);
        let square = |row: usize, first: &Matrix, second: &Matrix| {
            let cross = outer(&self.p[row], &s_after[row]);
            let cross = map2(&cross, &transposed(&cross), |x, y| x + y);
            let constant = map2(&outer(&self.p[row], &self.p[row]), &cross, |x, y| x * b + y);
            let moved = after(second);
            let moved = transposed(&after(&transposed(&moved)));
            map2(&map2(first, &constant, |x, y| x + y), &moved, |x, y| x + y)
        };
        Self {
            length_s: self.length_s + b,
            p,
            s,
            current_squared: square(CURRENT, &self.current_squared, &next.current_squared),
            speed_squared: square(SPEED, &self.speed_squared, &next.speed_squared),
        }
    }

    /// A leap of any length, by halving until the series converges and doubling back.
    pub(crate) fn of(a: &Matrix, t: f64) -> Self {
        let mut halvings = 0;
        let mut part = t;
        while norm(a) * part > 0.5 && halvings < 200 {
            part *= 0.5;
            halvings += 1;
        }
        let mut leap = Self::taylor(a, part);
        for _ in 0..halvings {
            leap = leap.then(a, &leap);
        }
        leap
    }
}

/// The quadratures of a leap, laid out to be applied: the forms are symmetric, so their rows are their columns.
#[derive(Clone, Copy)]
pub(crate) struct Quadrature {
    length_s: f64,
    s: Columns,
    current_squared: Columns,
    speed_squared: Columns,
}

impl Quadrature {
    pub(crate) fn of(leap: &Leap) -> Self {
        Self {
            length_s: leap.length_s,
            s: Columns::of(&leap.s),
            current_squared: Columns(leap.current_squared),
            speed_squared: Columns(leap.speed_squared),
        }
    }

    /// The integrals over the leap from state `x` with slope `w`.
    #[inline(always)]
    pub(crate) fn integrals(&self, x: &State, w: &State) -> Integrals {
        let t = self.length_s;
        let form = |g: &Columns| dot(&g.times(w), w);
        let path = self.s.times(w);
        let square = |k: usize, g: &Columns| x[k] * x[k] * t + 2.0 * x[k] * path[k] + form(g);
        Integrals {
            current: x[CURRENT] * t + path[CURRENT],
            current_squared: square(CURRENT, &self.current_squared),
            speed_squared: square(SPEED, &self.speed_squared),
            angle: x[ANGLE] * t + path[ANGLE],
        }
    }
}

/// `P(a+b) = P(a) + P(b) Φ(a)` with `Φ(a) = I + A P(a)`.
fn joined(a: &Matrix, first: &Matrix, second: &Matrix) -> Matrix {
    let after = map2(second, &product(second, &product(a, first)), |x, y| x + y);
    map2(first, &after, |x, y| x + y)
}
