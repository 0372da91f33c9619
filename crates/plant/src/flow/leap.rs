//! Leaps of a linear system: the change of the state over a stretch of time, and the integrals on the way.

use crate::flow::double::{Product, versions};
use crate::flow::lanes::{Lanes, each};
use crate::flow::matrix::{CURRENT, Columns, Matrix, SPEED, State, map2, norm, outer, product, transposed};

/// Integrals over a leap, in SI units.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Integrals<T = State> {
    /// `∫ x dt`, of each state.
    pub states: T,
    /// `∫ i² dt` and `∫ ω² dt`; the other two lanes are unused.
    pub squares: T,
}

impl<L: Lanes> Integrals<L> {
    #[inline(always)]
    pub(crate) fn nothing() -> Self {
        Self { states: L::all(0.0), squares: L::all(0.0) }
    }

    #[inline(always)]
    pub(crate) fn in_memory(&self) -> Integrals {
        Integrals { states: self.states.state(), squares: self.squares.state() }
    }
}

/// A leap of a fixed length: the matrix from `w` to the change of state, and the quadratures.
#[derive(Clone, Copy)]
pub(crate) struct Leap {
    /// Length in seconds.
    length_s: f64,
    /// `P(t)`.
    pub(crate) p: Matrix,
    /// `∫ P ds`, the whole matrix; its rows for current and angle give the integrals of charge and angle.
    s: Matrix,
    /// `∫ pᵢᵀ pᵢ ds` for the current's row of `P`.
    current_squared: Matrix,
    /// `∫ pᵢᵀ pᵢ ds` for the speed's row of `P`.
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

    /// Returns a leap short enough for its Taylor series: `‖A‖ t` at most one half.
    fn taylor(a: &Matrix, t: f64) -> Self {
        const TERMS: usize = 18;
        // P = Σ c_k A^k t^{k+1}, c_k = 1/(k+1)!; the rows r_k = e_iᵀ A^k give ∫ pᵀp = Σ c_j c_k r_jᵀ r_k
        // t^{j+k+3}/(j+k+3).
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

    versions! {
        /// Returns this leap followed by `next`.
        pub(crate) fn then[then_fused, then_native, then_with](self: &Self, a: &Matrix, next: &Self) -> Self
    }

    #[inline(always)]
    fn then_with<P: Product>(&self, a: &Matrix, next: &Self) -> Self {
        let b = next.length_s;
        let ap = product(a, &self.p);
        let after = |m: &Matrix| map2(m, &product(m, &ap), |x, y| x + y);
        let p = joined(a, &self.p, &next.p);
        let held = map2(&self.p, &self.p, |x, _| x * b);
        let s_after = after(&next.s);
        let s = map2(&self.s, &map2(&held, &s_after, |x, y| x + y), |x, y| x + y);
        let mut squares = [(CURRENT, self.current_squared), (SPEED, self.speed_squared)];
        for ((row, sum), second) in squares.iter_mut().zip([&next.current_squared, &next.speed_squared]) {
            let p = &self.p[*row];
            let cross = outer(p, &s_after[*row]);
            let cross = map2(&cross, &transposed(&cross), |x, y| x + y);
            let constant = map2(&outer(p, p), &cross, |x, y| x * b + y);
            let moved = after(second);
            let moved = transposed(&after(&transposed(&moved)));
            *sum = map2(&map2(sum, &constant, |x, y| x + y), &moved, |x, y| x + y);
        }
        let [(_, current_squared), (_, speed_squared)] = squares;
        Self { length_s: self.length_s + b, p, s, current_squared, speed_squared }
    }

    /// Returns a leap of any length, by halving until the series converges and doubling back.
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

/// The quadratures of a leap, in the layout in which they are applied.
#[derive(Clone, Copy)]
pub(crate) struct Quadrature {
    length_s: f64,
    s: Columns,
    /// The quadratic forms for current and speed side by side, by rows from the diagonal on: they are symmetric, so
    /// each pair of states appears once. Two more lanes fill a register.
    forms: [State; 10],
}

impl Quadrature {
    pub(crate) fn of(leap: &Leap) -> Self {
        let mut forms = [[0.0; 4]; 10];
        let pairs = (0..4).flat_map(|r| (r..4).map(move |c| (r, c)));
        for (form, (r, c)) in forms.iter_mut().zip(pairs) {
            let both = |g: &Matrix| if r == c { g[r][c] } else { g[r][c] + g[c][r] };
            (form[CURRENT], form[SPEED]) = (both(&leap.current_squared), both(&leap.speed_squared));
        }
        Self { length_s: leap.length_s, s: Columns::of(&leap.s), forms }
    }

    /// Adds `∫ x dt` over the leap from state `x` with slope `w`.
    #[inline(always)]
    pub(crate) fn add_path(&self, x: &State, w: &State, total: &mut State) {
        let path = self.s.times(w);
        for k in 0..4 {
            total[k] += x[k] * self.length_s + path[k];
        }
    }

    versions! {
        /// Adds the integrals over the leap from state `x` with slope `w`.
        pub(crate) fn add[add_fused, add_native, add_with](self: &Self, x: &State, w: &State, total: &mut Integrals)
    }

    #[inline(always)]
    pub(crate) fn add_with<P: Product>(&self, x: &State, w: &State, total: &mut Integrals) {
        let (states, squares) = (P::lanes(&total.states), P::lanes(&total.squares));
        let mut lanes = Integrals { states, squares };
        self.add_lanes(x, w, &mut lanes);
        *total = lanes.in_memory();
    }

    /// Does as [`add`](Self::add) does, on integrals in lanes.
    #[inline(always)]
    pub(crate) fn add_lanes<L: Lanes>(&self, x: &State, w: &State, total: &mut Integrals<L>) {
        let w: [L; 4] = each(w);
        let [a, b, c, d, e, f, g, h, i, j] = &self.forms;
        let first = (L::of(a) * w[0] + L::of(b) * w[1]) + (L::of(c) * w[2] + L::of(d) * w[3]);
        let second = (L::of(e) * w[1] + L::of(f) * w[2]) + L::of(g) * w[3];
        let third = L::of(h) * w[2] + L::of(i) * w[3];
        let form = (first * w[0] + second * w[1]) + (third * w[2] + L::of(j) * w[3] * w[3]);
        let (x, path) = (L::of(x), self.s.image(&w));
        let held = x * L::all(self.length_s);
        total.states = total.states + (held + path);
        total.squares = total.squares + (x * (held + (path + path)) + form);
    }
}

/// Returns `P(a+b) = P(a) + P(b) Φ(a)` with `Φ(a) = I + A P(a)`.
#[inline(always)]
fn joined(a: &Matrix, first: &Matrix, second: &Matrix) -> Matrix {
    let after = map2(second, &product(second, &product(a, first)), |x, y| x + y);
    map2(first, &after, |x, y| x + y)
}
