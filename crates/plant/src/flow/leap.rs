//! Leaps of a linear system: the change of the state over a stretch of time, and the integrals on the way.

use crate::flow::double::{Product, versions};
use crate::flow::lanes::{Blocks, Count, Lanes, Numbers, Size};
use crate::flow::matrix::{
    CURRENT, Columns, Matrix, SPEED, State, dot, map2, norm, outer, product, row_times, transposed,
};

/// Integrals over a leap, in SI units.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Integrals<S = State, Q = State> {
    /// `∫ x dt`, of each state.
    pub states: S,
    /// The integrals of the system's [`Square`]s, summed by their lanes: of four states `∫ i² dt` and `∫ ω² dt`, and
    /// the other two lanes are unused.
    pub squares: Q,
}

/// The square of a linear function of the state, as audits of energy need its integral.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Square<const N: usize> {
    /// The lane of [`Integrals::squares`] to which it is added.
    pub lane: usize,
    /// The factor before the square.
    pub weight: f64,
    /// The function's coefficients.
    pub row: State<N>,
}

impl<const N: usize> Square<N> {
    /// Returns the squares of an axis: those of current and speed.
    pub fn of_axis() -> Vec<Self> {
        let unit = |lane| std::array::from_fn(|c| f64::from(u8::from(c == lane)));
        [CURRENT, SPEED].map(|lane| Self { lane, weight: 1.0, row: unit(lane) }).into()
    }

    /// Returns the function times a matrix; of four states it is the matrix's row of its lane.
    #[inline(always)]
    fn through(&self, a: &Matrix<N>) -> State<N> {
        if N == 4 { a[self.lane] } else { row_times(&self.row, a) }
    }

    /// Returns the sums by lanes of the squares' bilinear forms; of four states their products one by one.
    #[inline(always)]
    pub fn forms(all: &[Self], x: &State<N>, y: &State<N>) -> State {
        if N == 4 {
            return std::array::from_fn(|k| x[k] * y[k]);
        }
        let mut forms = [0.0; 4];
        for Self { lane, weight, row } in all {
            forms[*lane] += weight * dot(row, x) * dot(row, y);
        }
        forms
    }
}

/// Integrals in lanes.
pub(crate) type Passed<L, const N: usize> = Integrals<Blocks<L, N>, L>;

/// A leap of a fixed length: the matrix from `w` to the change of state, and the quadratures.
#[derive(Clone, Copy)]
pub(crate) struct Leap<const N: usize = 4> {
    /// Length in seconds.
    length_s: f64,
    /// `P(t)`.
    pub(crate) p: Matrix<N>,
    /// `∫ P ds`, the whole matrix; its rows for current and angle give the integrals of charge and angle.
    s: Matrix<N>,
    /// `∫ pᵀ p ds`, summed by lanes over the squares, where `p` is the square's row times `P`.
    squares: [Matrix<N>; 4],
}

impl<const N: usize> Leap<N> {
    pub(crate) const NOTHING: Self =
        Self { length_s: 0.0, p: [[0.0; N]; N], s: [[0.0; N]; N], squares: [[[0.0; N]; N]; 4] };

    /// Returns a leap short enough for its Taylor series: `‖A‖ t` at most one half.
    fn taylor(a: &Matrix<N>, squares: &[Square<N>], t: f64) -> Self {
        const TERMS: usize = 18;
        // P = Σ c_k A^k t^{k+1}, c_k = 1/(k+1)!; the rows r_k = rᵀ A^k give ∫ pᵀp = Σ c_j c_k r_jᵀ r_k
        // t^{j+k+3}/(j+k+3).
        let mut leap = Self { length_s: t, ..Self::NOTHING };
        let mut power: Matrix<N> = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        let mut terms: Vec<Matrix<N>> = Vec::with_capacity(TERMS);
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
        for square in squares {
            let Square { lane, weight, .. } = square;
            let rows: [State<N>; TERMS] = std::array::from_fn(|k| square.through(&terms[k]));
            let mut sum = [[0.0; N]; N];
            for j in (0..TERMS).rev() {
                for k in (0..TERMS - j).rev() {
                    let share = t / (j + k + 3) as f64;
                    sum = map2(&sum, &outer(&rows[j], &rows[k]), |x, y| x + y * share);
                }
            }
            leap.squares[*lane] = map2(&leap.squares[*lane], &sum, |x, y| x + weight * y);
        }
        leap
    }

    versions! {
        /// Returns this leap followed by `next`.
        pub(crate) fn then[then_fused, then_native, then_with](
            self: &Self, a: &Matrix<N>, squares: &[Square<N>], next: &Self
        ) -> Self
    }

    #[inline(always)]
    fn then_with<P: Product>(&self, a: &Matrix<N>, squares: &[Square<N>], next: &Self) -> Self {
        let b = next.length_s;
        let ap = product(a, &self.p);
        let after = |m: &Matrix<N>| map2(m, &product(m, &ap), |x, y| x + y);
        let p = joined(a, &self.p, &next.p);
        let held = map2(&self.p, &self.p, |x, _| x * b);
        let s_after = after(&next.s);
        let s = map2(&self.s, &map2(&held, &s_after, |x, y| x + y), |x, y| x + y);
        let mut sums = self.squares;
        for square in squares {
            let Square { lane, weight, .. } = square;
            let p = square.through(&self.p);
            let cross = outer(&p, &square.through(&s_after));
            let cross = map2(&cross, &transposed(&cross), |x, y| x + y);
            let constant = map2(&outer(&p, &p), &cross, |x, y| x * b + y);
            sums[*lane] = map2(&sums[*lane], &constant, |x, y| x + weight * y);
        }
        for (lane, sum) in sums.iter_mut().enumerate().filter(|(lane, _)| squares.iter().any(|it| it.lane == *lane)) {
            let moved = after(&next.squares[lane]);
            let moved = transposed(&after(&transposed(&moved)));
            *sum = map2(sum, &moved, |x, y| x + y);
        }
        Self { length_s: self.length_s + b, p, s, squares: sums }
    }

    /// Returns a leap of any length, by halving until the series converges and doubling back.
    pub(crate) fn of(a: &Matrix<N>, squares: &[Square<N>], t: f64) -> Self {
        let mut halvings = 0;
        let mut part = t;
        while norm(a) * part > 0.5 && halvings < 200 {
            part *= 0.5;
            halvings += 1;
        }
        let mut leap = Self::taylor(a, squares, part);
        for _ in 0..halvings {
            leap = leap.then(a, squares, &leap);
        }
        leap
    }
}

/// The quadratures of a leap, in the layout in which they are applied.
#[derive(Clone, Copy)]
pub(crate) struct Quadrature<const N: usize = 4> {
    length_s: f64,
    s: Columns<N>,
    /// The quadratic forms of all lanes side by side, by rows from the diagonal on: they are symmetric, so each pair of
    /// states appears once.
    forms: [[State; N]; N],
}

impl<const N: usize> Quadrature<N>
where
    Count<N>: Size<N>,
{
    pub(crate) fn of(leap: &Leap<N>) -> Self {
        let mut forms = [[[0.0; 4]; N]; N];
        for (r, c) in (0..N).flat_map(|r| (r..N).map(move |c| (r, c))) {
            let both = |g: &Matrix<N>| if r == c { g[r][c] } else { g[r][c] + g[c][r] };
            forms[r][c] = std::array::from_fn(|lane| both(&leap.squares[lane]));
        }
        Self { length_s: leap.length_s, s: Columns::of(&leap.s), forms }
    }

    #[inline(always)]
    pub(crate) fn nothing<L: Lanes>() -> Passed<L, N> {
        Integrals { states: Numbers::same(0.0), squares: L::all(0.0) }
    }

    #[inline(always)]
    pub(crate) fn in_memory<L: Lanes>(done: &Passed<L, N>) -> Integrals<State<N>> {
        Integrals { states: done.states.numbers(), squares: done.squares.state() }
    }

    /// Adds `∫ x dt` over the leap from state `x` with slope `w`.
    #[inline(always)]
    pub(crate) fn add_path(&self, x: &State<N>, w: &State<N>, total: &mut State<N>) {
        let path = self.s.times(w);
        for k in 0..N {
            total[k] += x[k] * self.length_s + path[k];
        }
    }

    versions! {
        /// Adds the integrals over the leap from state `x` with slope `w`.
        pub(crate) fn add[add_fused, add_native, add_with](
            self: &Self, squares: &[Square<N>], x: &State<N>, w: &State<N>, total: &mut Integrals<State<N>>
        )
    }

    #[inline(always)]
    pub(crate) fn add_with<P: Product>(
        &self,
        squares: &[Square<N>],
        x: &State<N>,
        w: &State<N>,
        total: &mut Integrals<State<N>>,
    ) {
        let mut lanes = Integrals { states: P::blocks(&total.states), squares: P::lanes(&total.squares) };
        self.add_lanes::<P::Lanes>(squares, x, w, &mut lanes);
        *total = Self::in_memory(&lanes);
    }

    #[inline(always)]
    fn term<L: Lanes>(&self, r: usize, c: usize, w: &State<N>) -> L {
        L::of(&self.forms[r][c]) * L::all(w[c])
    }

    /// Does as [`add`](Self::add) does, on integrals in lanes.
    #[inline(always)]
    pub(crate) fn add_lanes<L: Lanes>(
        &self,
        squares: &[Square<N>],
        x: &State<N>,
        w: &State<N>,
        total: &mut Passed<L, N>,
    ) {
        let first =
            (self.term::<L>(0, 0, w) + self.term::<L>(0, 1, w)) + (self.term::<L>(0, 2, w) + self.term::<L>(0, 3, w));
        let second = (self.term::<L>(1, 1, w) + self.term::<L>(1, 2, w)) + self.term::<L>(1, 3, w);
        let third = self.term::<L>(2, 2, w) + self.term::<L>(2, 3, w);
        let last = self.term::<L>(3, 3, w) * L::all(w[3]);
        let mut form = (first * L::all(w[0]) + second * L::all(w[1])) + (third * L::all(w[2]) + last);
        for c in 4..N {
            let mut column = self.term::<L>(c, c, w);
            for (row, &word) in self.forms.iter().zip(w).take(c) {
                column = column + L::of(&row[c]) * L::all(word);
            }
            form = form + column * L::all(w[c]);
        }
        let blocks: Blocks<L, N> = Numbers::taken(x);
        let (path, length): (Blocks<L, N>, Blocks<L, N>) = (self.s.image::<L>(w), Numbers::same(self.length_s));
        let held = blocks * length;
        total.states = total.states + (held + path);
        let moved = held + (path + path);
        let product =
            if N == 4 { (blocks * moved).first() } else { L::of(&Square::forms(squares, x, &moved.numbers())) };
        total.squares = total.squares + (product + form);
    }
}

/// Returns `P(a+b) = P(a) + P(b) Φ(a)` with `Φ(a) = I + A P(a)`.
#[inline(always)]
fn joined<const N: usize>(a: &Matrix<N>, first: &Matrix<N>, second: &Matrix<N>) -> Matrix<N> {
    let after = map2(second, &product(second, &product(a, first)), |x, y| x + y);
    map2(first, &after, |x, y| x + y)
}
