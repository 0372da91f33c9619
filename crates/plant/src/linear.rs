//! Linear time-invariant systems of four states, flowed exactly over whole clock edges.
//!
//! `x' = A x + f` with `f` constant. With `w = A x₀ + f` the solution is `x(t) = x₀ + P(t) w`, `P(t) = ∫₀ᵗ e^{As} ds`: the
//! change is computed, never the sum of state and change, so that a short leap of a long motion loses nothing. `P` is
//! tabulated for the digits of the edge count in base 128; a leap of any length costs one small product a digit.
//!
//! The same digits give the exact integrals of the trajectory that an energy audit needs ([`Integrals`]).

use std::sync::OnceLock;

/// Current in A, speed in rad/s (m/s), angle in rad (m), the hand's intended angle in rad (m).
pub type State = [f64; 4];
/// Four rows of four.
pub type Matrix = [[f64; 4]; 4];

/// Index of the current in a [`State`].
pub(crate) const CURRENT: usize = 0;
/// Index of the speed.
pub(crate) const SPEED: usize = 1;
/// Index of the angle.
pub(crate) const ANGLE: usize = 2;
/// Index of the hand's intended angle.
pub(crate) const INTENT: usize = 3;

const BITS: u32 = 7;
const RADIX: usize = 1 << BITS;
const MASK: u64 = RADIX as u64 - 1;

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
    pub fn add(&mut self, next: &Self) {
        self.current += next.current;
        self.current_squared += next.current_squared;
        self.speed_squared += next.speed_squared;
        self.angle += next.angle;
    }
}

/// What a leap of a fixed length does: the matrix that carries `w` to the change of state, and its quadratures.
#[derive(Clone, Copy)]
struct Leap {
    /// Length in seconds.
    length_s: f64,
    /// `P(t)`.
    p: Matrix,
    /// `∫ P ds`, whole: rows for current and angle are the charge and angle integrals.
    s: Matrix,
    /// `∫ pᵢᵀ pᵢ ds` for the current's row of `P`.
    current_squared: Matrix,
    /// The same for the speed's row.
    speed_squared: Matrix,
}

/// A linear system, its leaps tabulated for one clock period.
pub struct Linear {
    a: Matrix,
    columns: Columns,
    /// How fast it moves, in 1/s.
    rate: f64,
    edge_s: f64,
    /// `P` for digit `d` of level `k`, at `128 k + d`.
    p: Vec<Columns>,
    /// Quadratures, made when first asked for: many runs never audit.
    leaps: OnceLock<Vec<Leap>>,
    /// `bounds[j]` ≥ |e^{At}| element by element, for 0 ≤ t ≤ 2^j edges.
    bounds: Vec<Matrix>,
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
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

fn map2(a: &Matrix, b: &Matrix, op: impl Fn(f64, f64) -> f64) -> Matrix {
    let mut c = *a;
    for (row, other) in c.iter_mut().zip(b) {
        for (x, &y) in row.iter_mut().zip(other) {
            *x = op(*x, y);
        }
    }
    c
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| a[c][r]))
}

fn outer(u: &State, v: &State) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| u[r] * v[c]))
}

/// `row · matrix`.
pub(crate) fn row_times(row: &State, a: &Matrix) -> State {
    std::array::from_fn(|c| row[0] * a[0][c] + row[1] * a[1][c] + row[2] * a[2][c] + row[3] * a[3][c])
}

#[inline(always)]
pub(crate) fn dot(u: &State, v: &State) -> f64 {
    (u[0] * v[0] + u[1] * v[1]) + (u[2] * v[2] + u[3] * v[3])
}

/// A matrix by columns, so that its product with a vector runs along registers.
#[derive(Clone, Copy)]
struct Columns(Matrix);

impl Columns {
    fn of(rows: &Matrix) -> Self {
        Self(transposed(rows))
    }

    #[inline(always)]
    fn times(&self, v: &State) -> State {
        let [a, b, c, d] = &self.0;
        std::array::from_fn(|r| (a[r] * v[0] + b[r] * v[1]) + (c[r] * v[2] + d[r] * v[3]))
    }
}

#[inline(always)]
fn plus(x: &State, y: &State) -> State {
    std::array::from_fn(|r| x[r] + y[r])
}

/// How fast a system moves, in 1/s: its norm after each pair of states is scaled so that they drive each other alike.
fn rate(a: &Matrix) -> f64 {
    let pair = |r: usize, c: usize| (a[r][c] * a[c][r]).abs().sqrt();
    (0..4).map(|r| (0..4).map(|c| pair(r, c)).sum::<f64>()).fold(0.0, f64::max)
}

fn norm(a: &Matrix) -> f64 {
    a.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max)
}

impl Leap {
    const NOTHING: Self = Self {
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
    fn then(&self, a: &Matrix, next: &Self) -> Self {
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
    fn of(a: &Matrix, t: f64) -> Self {
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

    fn integrals(&self, x: &State, w: &State) -> Integrals {
        let t = self.length_s;
        // The forms are symmetric: their rows are their columns.
        let form = |g: &Matrix| dot(&Columns(*g).times(w), w);
        let charge = dot(&self.s[CURRENT], w);
        let path = dot(&self.s[SPEED], w);
        Integrals {
            current: x[CURRENT] * t + charge,
            current_squared: x[CURRENT] * x[CURRENT] * t + 2.0 * x[CURRENT] * charge + form(&self.current_squared),
            speed_squared: x[SPEED] * x[SPEED] * t + 2.0 * x[SPEED] * path + form(&self.speed_squared),
            angle: x[ANGLE] * t + dot(&self.s[ANGLE], w),
        }
    }
}

impl Linear {
    /// A system `x' = A x + f` on a clock of period `edge_s`, tabulated for leaps of up to `horizon` edges.
    #[must_use]
    pub fn new(a: Matrix, edge_s: f64, horizon: u64) -> Self {
        let levels = horizon.max(1).ilog2() / BITS + 1;
        let mut p = Vec::with_capacity(RADIX * levels as usize);
        let mut unit = Leap::of(&a, edge_s).p;
        let mut bounds = Vec::with_capacity(1 + (levels * BITS) as usize);
        let identity: Matrix = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        // |e^{At}| ≤ I + |A| e^{|A| edge} edge for t within one edge.
        let size = map2(&a, &a, |x, _| x.abs());
        bounds.push(map2(&identity, &product(&size, &Leap::of(&size, edge_s).p), |x, y| x + y));
        for _ in 0..levels {
            let (level, next) = digits([[0.0; 4]; 4], unit, |first, second| joined(&a, first, second));
            for power in (0..BITS).map(|bit| &level[1 << bit]) {
                // e^{A(t + 2^j)} = e^{At} e^{A 2^j}: the bound doubles with the leap.
                let phi = map2(&identity, &product(&a, power), |x, y| (x + y).abs());
                let last = bounds[bounds.len() - 1];
                bounds.push(map2(&last, &product(&last, &phi), f64::max));
            }
            p.extend(level.iter().map(Columns::of));
            unit = next;
        }
        Self { a, columns: Columns::of(&a), rate: rate(&a), edge_s, p, leaps: OnceLock::new(), bounds }
    }

    /// The matrix `A`.
    #[must_use]
    pub fn matrix(&self) -> &Matrix {
        &self.a
    }

    /// The clock period in seconds.
    #[must_use]
    pub fn edge_s(&self) -> f64 {
        self.edge_s
    }

    /// `A x + f`.
    #[inline(always)]
    pub(crate) fn slope(&self, x: &State, f: &State) -> State {
        plus(&self.columns.times(x), f)
    }

    /// A bound of |e^{At}|, element by element, for every `t` from 0 to `edges` edges.
    #[inline]
    pub(crate) fn bound(&self, dyadic: usize) -> &Matrix {
        &self.bounds[dyadic]
    }

    /// How many dyadic bounds there are.
    pub(crate) fn dyadic(&self) -> usize {
        self.bounds.len()
    }

    fn leaps(&self) -> &[Leap] {
        self.leaps.get_or_init(|| {
            let mut all = Vec::with_capacity(self.p.len());
            let mut unit = Leap::of(&self.a, self.edge_s);
            for _ in 0..self.p.len() / RADIX {
                let (level, next) = digits(Leap::NOTHING, unit, |first, second| first.then(&self.a, second));
                all.extend(level);
                unit = next;
            }
            all
        })
    }
}

/// `unit` repeated 0 to 127 times, by doubling, so that rounding grows with the number of bits only; and 128 times.
fn digits<T: Copy>(nothing: T, unit: T, then: impl Fn(&T, &T) -> T) -> (Vec<T>, T) {
    let mut all = vec![nothing, unit];
    for d in 2..=RADIX {
        all.push(if d % 2 == 0 { then(&all[d / 2], &all[d / 2]) } else { then(&all[d - 1], &unit) });
    }
    let next = all.remove(RADIX);
    (all, next)
}

/// `P(a+b) = P(a) + P(b) Φ(a)` with `Φ(a) = I + A P(a)`.
fn joined(a: &Matrix, first: &Matrix, second: &Matrix) -> Matrix {
    let after = map2(second, &product(second, &product(a, first)), |x, y| x + y);
    map2(first, &after, |x, y| x + y)
}

/// A motion: a system, an anchor state at edge 0 and a constant input.
#[derive(Clone, Copy)]
pub struct Trajectory<'a> {
    system: &'a Linear,
    x: State,
    f: State,
    w: State,
}

impl<'a> Trajectory<'a> {
    /// The motion from state `x` under the constant `f`.
    #[must_use]
    pub fn new(system: &'a Linear, x: State, f: State) -> Self {
        Self { system, x, f, w: system.slope(&x, &f) }
    }

    /// The system.
    #[must_use]
    pub fn system(&self) -> &'a Linear {
        self.system
    }

    /// The anchor state.
    #[must_use]
    pub fn anchor(&self) -> &State {
        &self.x
    }

    /// The constant input `f`.
    #[must_use]
    pub fn constant(&self) -> &State {
        &self.f
    }

    /// `x'` at a state of this motion.
    #[inline(always)]
    #[must_use]
    pub fn slope(&self, x: &State) -> State {
        self.system.slope(x, &self.f)
    }

    /// State and slope at the last multiple of 128 edges: the part that 128 successive edges share.
    #[inline]
    #[must_use]
    pub fn prefix(&self, block: u64) -> (State, State) {
        let (mut x, mut w) = (self.x, self.w);
        if block != 0 {
            let mut level = block.ilog2() / BITS + 1;
            loop {
                let digit = (block >> ((level - 1) * BITS) & MASK) as usize;
                if digit != 0 {
                    x = plus(&x, &self.system.p[level as usize * RADIX + digit].times(&w));
                    w = self.slope(&x);
                }
                level -= 1;
                if level == 0 {
                    break;
                }
            }
        }
        (x, w)
    }

    /// The state `digit` edges (0 to 127) after a [`prefix`](Self::prefix).
    #[inline(always)]
    #[must_use]
    pub fn within(&self, prefix: &(State, State), digit: u64) -> State {
        if digit == 0 { prefix.0 } else { plus(&prefix.0, &self.system.p[digit as usize].times(&prefix.1)) }
    }

    /// The state after `edges` edges. The same function serves every driver, so that they agree to the bit.
    #[inline]
    #[must_use]
    pub fn at(&self, edges: u64) -> State {
        self.within(&self.prefix(edges >> BITS), edges & MASK)
    }

    /// The same for edges asked one after the other: keeps in `cache` what neighbours share.
    #[inline(always)]
    pub(crate) fn at_next(&self, edges: u64, cache: &mut (u64, (State, State))) -> State {
        if cache.0 != edges >> BITS {
            *cache = (edges >> BITS, self.prefix(edges >> BITS));
        }
        self.within(&cache.1, edges & MASK)
    }

    /// The exact integrals from the anchor to `edges` edges later, and the state there, equal to [`at`](Self::at).
    #[must_use]
    pub fn integrals(&self, edges: u64) -> (Integrals, State) {
        let leaps = self.system.leaps();
        let mut total = Integrals::default();
        let (mut x, mut w) = (self.x, self.w);
        if edges == 0 {
            return (total, x);
        }
        for level in (0..=edges.ilog2() / BITS).rev() {
            let digit = (edges >> (level * BITS) & MASK) as usize;
            if digit != 0 {
                let index = level as usize * RADIX + digit;
                total.add(&leaps[index].integrals(&x, &w));
                x = plus(&x, &self.system.p[index].times(&w));
                if level > 0 {
                    w = self.slope(&x);
                }
            }
        }
        (total, x)
    }
}

/// Terms of a course's polynomial.
const TERMS: usize = 4;

/// The course of a motion within one edge: its Taylor polynomial, or the exact leap where an edge is long for the system.
pub(crate) struct Course<'a> {
    motion: Trajectory<'a>,
    /// `x⁽ᵏ⁾ / k!` for `k` = 1, 2 …
    terms: [State; TERMS],
    short: bool,
}

impl<'a> Course<'a> {
    /// The course from a motion's anchor.
    pub(crate) fn new(motion: Trajectory<'a>) -> Self {
        let a = &motion.system.a;
        let mut terms = [motion.w; TERMS];
        for k in 1..terms.len() {
            let last = terms[k - 1];
            terms[k] = std::array::from_fn(|r| dot(&a[r], &last) / (k + 1) as f64);
        }
        // Four terms leave (rate τ)^4 / 5! of a change within one edge.
        Self { motion, terms, short: motion.system.rate * motion.system.edge_s < 4e-3 }
    }

    /// The state `tau_s` later, at most one clock period.
    pub(crate) fn at(&self, tau_s: f64) -> State {
        if !self.short {
            let leap = Leap::of(&self.motion.system.a, tau_s);
            return plus(&self.motion.x, &Columns::of(&leap.p).times(&self.motion.w));
        }
        let [first, .., last] = &self.terms;
        let mut change = *last;
        for term in self.terms[1..self.terms.len() - 1].iter().rev().chain([first]) {
            change = std::array::from_fn(|r| change[r] * tau_s + term[r]);
        }
        std::array::from_fn(|r| self.motion.x[r] + change[r] * tau_s)
    }

    /// When `row · x`, which is `before` away from `limit` at the start and beyond it after an edge, passes it: Newton's
    /// steps within a shrinking bracket.
    pub(crate) fn crossing_s(&self, row: &State, limit: f64, before: f64, guess_s: f64) -> f64 {
        let edge_s = self.motion.system.edge_s;
        let polynomial: [f64; TERMS] = std::array::from_fn(|k| dot(row, &self.terms[k]));
        let value_and_slope = |t: f64| {
            if self.short {
                let (mut value, mut slope) = (0.0, 0.0);
                for (power, coefficient) in polynomial.iter().enumerate().rev() {
                    value = value * t + coefficient;
                    slope = slope * t + (power + 1) as f64 * coefficient;
                }
                (before + t * value, slope)
            } else {
                let x = self.at(t);
                (dot(row, &x) - limit, dot(row, &self.motion.slope(&x)))
            }
        };
        let (mut low_s, mut high_s, mut t) = (0.0, edge_s, guess_s);
        for _ in 0..60 {
            let (value, slope) = value_and_slope(t);
            if value.signum() == before.signum() {
                low_s = t;
            } else {
                high_s = t;
            }
            let step = t - value / slope;
            if (step - t).abs() <= 1e-12 * edge_s {
                return step.clamp(0.0, edge_s);
            }
            let next = if step > low_s && step < high_s { step } else { 0.5 * (low_s + high_s) };
            t = next;
        }
        t
    }

    /// The integrals over `tau_s`, at whose end the state is `end`.
    pub(crate) fn integrals(&self, tau_s: f64, end: &State) -> Integrals {
        let Trajectory { x, w, system, .. } = &self.motion;
        if !self.short {
            return Leap::of(&system.a, tau_s).integrals(x, w);
        }
        // The trapezoid with its ends' slopes: error of order (rate τ)^4.
        let after = self.motion.slope(end);
        let (half, twelfth) = (0.5 * tau_s, tau_s * tau_s / 12.0);
        let linear = |k: usize| half * (x[k] + end[k]) + twelfth * (w[k] - after[k]);
        let square =
            |k: usize| half * (x[k] * x[k] + end[k] * end[k]) + 2.0 * twelfth * (x[k] * w[k] - end[k] * after[k]);
        Integrals {
            current: linear(CURRENT),
            current_squared: square(CURRENT),
            speed_squared: square(SPEED),
            angle: linear(ANGLE),
        }
    }
}
