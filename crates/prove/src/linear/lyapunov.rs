//! Proofs that the motion of a periodic linear loop dies out, or that it does not, over a stretch of stiffnesses.
//!
//! A common period of the loop is a sequence of steps `y⁺ = (A - g r') y`. The row `r` is the command's answer to the
//! state, and the only part that depends on the stiffness, which enters it linearly. The proof is a matrix `P` for
//! every boundary of two steps, with `P - H' P⁺ H` positive definite for every step `H = A - g r'`, and the same `P` at
//! both ends of the common period: `y' P y` then falls with every step. If the first `P` is positive definite, all
//! motions die out. If `y' P y` is below zero for some state, its motion never does.
//!
//! `y' H' P⁺ H y` is a convex function of the stiffness where `P⁺` is positive definite. So a stretch of stiffnesses is
//! proved by its two ends. Each step is checked by itself, from numbers that are exact: no error grows from step to
//! step, and none of the search for `P` counts. What a check computes in `f64` is bounded as follows. With `|P⁺| <= b
//! b'`, the bound `h` of the columns `b' |H|` and the bound `e` of the columns `b' |ΔH|`, the entries of `H' P⁺ H` err
//! by no more than `h e' + e h' + e e'` and their rounding by some units of `h h'`. The diagonal is lowered by more
//! than that, and by more than the rounding of the Cholesky factorisation that follows (Rump 2006, "Verification of
//! positive definiteness").

use std::array::from_fn;

use crate::SampledLoop;

/// A square matrix, as a list of rows.
pub(super) type Square<const N: usize> = [[f64; N]; N];

/// Half of an ulp of 1.
const UNIT: f64 = f64::EPSILON / 2.0;
/// The share of the loop's decay that the proof leaves to the search's own weights.
const KEPT: f64 = 0.5;

/// A step of the loop, with bounds of what its numbers err by.
#[derive(Clone)]
pub(super) struct Step<const N: usize> {
    pub a: Square<N>,
    pub g: [f64; N],
    pub a_error: Square<N>,
    pub g_error: [f64; N],
}

/// The steps of a common period.
pub(super) struct Steps<const N: usize> {
    /// The steps that differ.
    pub kinds: Vec<Step<N>>,
    /// The order of the steps: a kind, and how often it follows itself.
    pub order: Vec<(usize, u32)>,
    /// The state that the stiffness multiplies, and by what.
    pub spring: (usize, f64),
    /// The rest of the command's answer.
    pub damper: [f64; N],
    /// The weights of the states in the search for `P`.
    pub weights: [f64; N],
}

fn product<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    let mut sums = [[0.0; N]; N];
    for (row, sum) in a.iter().zip(&mut sums) {
        for (&factor, other) in row.iter().zip(b) {
            for (sum, &term) in sum.iter_mut().zip(other) {
                *sum += factor * term;
            }
        }
    }
    sums
}

fn transposed<const N: usize>(a: &Square<N>) -> Square<N> {
    from_fn(|row| from_fn(|column| a[column][row]))
}

/// Returns `a' p a`, symmetric to the bit.
fn congruent<const N: usize>(a: &Square<N>, p: &Square<N>) -> Square<N> {
    let all = product(&transposed(a), &product(p, a));
    from_fn(|row| from_fn(|column| 0.5 * (all[row][column] + all[column][row])))
}

fn plus<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    from_fn(|row| from_fn(|column| a[row][column] + b[row][column]))
}

fn scaled<const N: usize>(a: &Square<N>, by: f64) -> Square<N> {
    a.map(|row| row.map(|cell| cell * by))
}

fn diagonal<const N: usize>(of: &[f64; N]) -> Square<N> {
    from_fn(|row| from_fn(|column| if row == column { of[row] } else { 0.0 }))
}

fn size<const N: usize>(a: &Square<N>) -> f64 {
    a.iter().flatten().fold(0.0, |most: f64, cell| most.max(cell.abs()))
}

/// A matrix times a power of e.
#[derive(Clone, Copy)]
struct Scaled<const N: usize> {
    matrix: Square<N>,
    log: f64,
}

impl<const N: usize> Scaled<N> {
    fn matrix(&self) -> Square<N> {
        if self.log == 0.0 { self.matrix } else { scaled(&self.matrix, libm::exp(self.log)) }
    }

    fn of(matrix: Square<N>, log: f64) -> Self {
        let most = size(&matrix);
        if most == 0.0 || (1e-50..1e50).contains(&most) {
            return Self { matrix, log };
        }
        Self { matrix: scaled(&matrix, 1.0 / most), log: log + libm::log(most) }
    }

    /// Returns the product with the map that comes first.
    fn after(&self, first: &Self) -> Self {
        Self::of(product(&self.matrix, &first.matrix), self.log + first.log)
    }

    /// Returns the logarithm of the greatest absolute value of an eigenvalue.
    fn log_radius(&self) -> f64 {
        let rows = self.matrix.iter().map(|row| row.to_vec()).collect();
        self.log + libm::log(SampledLoop::of(rows).spectral_radius())
    }
}

/// The effect of a run of equal steps on a state, and on the sum of weights: `X` becomes `map' X map + sum`.
#[derive(Clone, Copy)]
struct Run<const N: usize> {
    map: Scaled<N>,
    sum: Square<N>,
}

impl<const N: usize> Run<N> {
    /// Returns the runs of `first` and then of `second`.
    fn joined(first: &Self, second: &Self) -> Self {
        Self { map: second.map.after(&first.map), sum: plus(&congruent(&first.map.matrix(), &second.sum), &first.sum) }
    }
}

/// Returns what comes of `count` equal steps.
fn repeated<T: Copy>(step: T, count: u32, joined: impl Fn(&T, &T) -> T) -> T {
    let mut run = step;
    for bit in (0..count.ilog2()).rev() {
        run = joined(&run, &run);
        if count >> bit & 1 == 1 {
            run = joined(&run, &step);
        }
    }
    run
}

impl<const N: usize> Steps<N> {
    /// Returns the number of steps.
    pub fn count(&self) -> f64 {
        self.order.iter().map(|(_, count)| f64::from(*count)).sum()
    }

    /// Returns the row `r` of a stiffness.
    fn answer(&self, stiffness: f64) -> [f64; N] {
        let (at, by) = self.spring;
        from_fn(|state| self.damper[state] + if state == at { stiffness * by } else { 0.0 })
    }

    /// Returns the maps of the kinds of steps at a stiffness, each multiplied by `stretch`.
    fn closed(&self, stiffness: f64, stretch: f64) -> Vec<Scaled<N>> {
        let r = self.answer(stiffness);
        let closed = |Step { a, g, .. }: &Step<N>| {
            from_fn(|row| from_fn(|column| stretch * (a[row][column] - g[row] * r[column])))
        };
        self.kinds.iter().map(|step| Scaled::of(closed(step), 0.0)).collect()
    }

    /// Returns what comes of all steps of a common period, in their order, from what comes of each kind.
    fn whole<T: Copy>(&self, kinds: &[T], joined: impl Fn(&T, &T) -> T) -> T {
        let mut known: Vec<((usize, u32), T)> = Vec::new();
        let mut whole: Option<T> = None;
        for &(kind, count) in &self.order {
            let run = match known.iter().find(|(of, _)| *of == (kind, count)) {
                _ if count == 1 => kinds[kind],
                Some((_, run)) => *run,
                None => {
                    let run = repeated(kinds[kind], count, &joined);
                    known.push(((kind, count), run));
                    run
                }
            };
            whole = Some(whole.map_or(run, |first| joined(&first, &run)));
        }
        whole.expect("a period has a step")
    }

    /// Returns the map of a common period and the sum of the weights in it, with each step multiplied by `stretch`.
    fn weighed(&self, stiffness: f64, stretch: f64) -> Run<N> {
        let sum = diagonal(&self.weights);
        let kinds: Vec<Run<N>> = self.closed(stiffness, stretch).into_iter().map(|map| Run { map, sum }).collect();
        self.whole(&kinds, Run::joined)
    }

    /// Returns the logarithm of the loop's growth over a common period.
    pub fn log_growth(&self, stiffness: f64) -> f64 {
        self.whole(&self.closed(stiffness, 1.0), |first, second| second.after(first)).log_radius()
    }

    /// Whether every motion is proved to die out at every stiffness from `low` to `high`, even if the stiffness changes
    /// within this stretch from step to step. `false` proves nothing.
    pub fn settles(&self, [low, high]: [f64; 2]) -> bool {
        let middle = 0.5 * (low + high);
        let growth = self.log_growth(middle);
        if growth.is_nan() || growth >= 0.0 {
            return false;
        }
        // A share of the decay becomes a decay of every step. Where a common period leaves nothing of a motion, a
        // step's share has a limit.
        let stretch = libm::exp((-(1.0 - KEPT) * growth / self.count()).min(0.5));
        let Run { map, sum } = self.weighed(middle, stretch);
        let Some(p) = fixed_point(&map.matrix(), sum) else { return false };
        positive(&p, &[0.0; N]) && self.falls(&p, middle, stretch, &[low, high], true)
    }

    /// Whether some motion is proved not to die out at this stiffness. `false` proves nothing.
    pub fn persists(&self, stiffness: f64) -> bool {
        let Run { map, sum } = self.weighed(stiffness, 1.0);
        if map.log.abs() > 100.0 {
            return false;
        }
        let map = map.matrix();
        let Some(p) = solution(&map, &sum) else { return false };
        let mut power = map;
        for _ in 0..60 {
            power = scaled(&power, 1.0 / size(&power));
            power = product(&power, &power);
        }
        let column = |column: usize| -> [f64; N] { from_fn(|row| power[row][column]) };
        let grows = |state: &[f64; N]| {
            let terms = || (0..N * N).map(|at| state[at / N] * p[at / N][at % N] * state[at % N]);
            let rounding = 4.0 * (N * N) as f64 * UNIT * terms().map(f64::abs).sum::<f64>();
            terms().sum::<f64>() < -rounding
        };
        (0..N).map(column).any(|state| grows(&state)) && self.falls(&p, stiffness, 1.0, &[stiffness], false)
    }

    /// Whether `y' P y` falls with each step, with the chain of matrices that begins at the end of the period with `p`,
    /// computed at the stiffness `middle`.
    fn falls(&self, p: &Square<N>, middle: f64, stretch: f64, at: &[f64], definite: bool) -> bool {
        let centre = self.answer(middle);
        let ends: Vec<[f64; N]> = at.iter().map(|stiffness| self.answer(*stiffness)).collect();
        let most: [f64; N] = from_fn(|state| ends.iter().fold(0.0, |most: f64, r| most.max(r[state].abs())));
        let mut left: u64 = self.order.iter().map(|(_, count)| u64::from(*count)).sum();
        let mut after = *p;
        for &(kind, count) in self.order.iter().rev() {
            let step = &self.kinds[kind];
            for _ in 0..count {
                left -= 1;
                let open = Opened::new(step, &after, &most, definite);
                let before = if left == 0 {
                    *p
                } else {
                    plus(&scaled(&open.closed(&centre), stretch * stretch), &diagonal(&self.weights))
                };
                if !ends.iter().all(|r| open.falls(&before, r)) {
                    return false;
                }
                after = before;
            }
        }
        true
    }
}

/// A step seen from the matrix behind it: `H' P⁺ H` for any row `r`, with the bound of its error.
struct Opened<const N: usize> {
    /// `A' P⁺ A`: the diagonal and what is right of it.
    own: Square<N>,
    /// `A' P⁺ g`.
    cross: [f64; N],
    /// `g' P⁺ g`.
    drive: f64,
    /// Bounds of the columns of `|H|` and of its errors.
    columns: [f64; N],
    errors: [f64; N],
    definite: bool,
}

impl<const N: usize> Opened<N> {
    fn new(step: &Step<N>, after: &Square<N>, most: &[f64; N], definite: bool) -> Self {
        let Step { a, g, a_error, g_error } = step;
        let seen = product(after, a);
        let mut own = [[0.0; N]; N];
        for (row, seen) in a.iter().zip(&seen) {
            for left in 0..N {
                for right in left..N {
                    own[left][right] += row[left] * seen[right];
                }
            }
        }
        let pushed: [f64; N] = from_fn(|row| (0..N).map(|k| after[row][k] * g[k]).sum());
        let cross = from_fn(|column| (0..N).map(|k| a[k][column] * pushed[k]).sum());
        let drive = (0..N).map(|k| g[k] * pushed[k]).sum();
        let bound = bounds(after, definite);
        // Rounding of `r` and of the products with it counts as an error of `g`.
        let sum = |at: &dyn Fn(usize) -> f64| (0..N).map(|k| bound[k] * at(k)).sum::<f64>();
        let (by_g, by_g_error) = (sum(&|k| g[k].abs()), sum(&|k| g_error[k] + 8.0 * UNIT * g[k].abs()));
        let (mut columns, mut errors) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            for column in 0..N {
                columns[column] += bound[k] * a[k][column].abs();
                errors[column] += bound[k] * a_error[k][column];
            }
        }
        for column in 0..N {
            columns[column] += by_g * most[column];
            errors[column] += by_g_error * most[column];
        }
        Self { own, cross, drive, columns, errors, definite }
    }

    /// Returns `H' P⁺ H`, symmetric to the bit.
    fn closed(&self, r: &[f64; N]) -> Square<N> {
        let Self { own, cross, drive, .. } = self;
        let pushed: [f64; N] = from_fn(|k| 0.5 * drive * r[k] - cross[k]);
        from_fn(|row| {
            from_fn(|column| {
                own[row.min(column)][row.max(column)] + (r[row] * pushed[column] + r[column] * pushed[row])
            })
        })
    }

    /// Whether `before - H' P⁺ H` is positive definite.
    fn falls(&self, before: &Square<N>, r: &[f64; N]) -> bool {
        let after = self.closed(r);
        let difference: Square<N> = from_fn(|row| from_fn(|column| before[row][column] - after[row][column]));
        let weight: [f64; N] = from_fn(|k| difference[k][k].sqrt());
        if !weight.iter().all(|weight| *weight > 0.0) {
            return false;
        }
        let Self { columns: h, errors: e, .. } = self;
        let known = bounds(before, self.definite);
        let over = |of: &[f64; N]| (0..N).map(|k| of[k] / weight[k]).sum::<f64>();
        let (all_h, all_e, all_known) = (over(h), over(e), over(&known));
        let rounding = (2 * N + 16) as f64 * UNIT;
        let lowered = from_fn(|k| {
            let error = h[k] * all_e + e[k] * (all_h + all_e) + rounding * (h[k] * all_h + known[k] * all_known);
            1.001 * weight[k] * error
        });
        positive(&difference, &lowered)
    }
}

/// Returns `b` with `|p| <= b b'`.
fn bounds<const N: usize>(p: &Square<N>, definite: bool) -> [f64; N] {
    let spare = 1.0 + 8.0 * UNIT;
    if definite {
        return from_fn(|k| p[k][k].abs().sqrt() * spare);
    }
    let least = 1e-30 * size(p);
    let mut b: [f64; N] = from_fn(|k| p[k][k].abs().max(least).sqrt());
    for _ in 0..6 {
        b = from_fn(|k| (b[k] * (0..N).fold(0.0, |most: f64, of| most.max(p[k][of].abs() / b[of]))).sqrt());
    }
    let most = (0..N * N).fold(0.0, |most: f64, at| most.max(p[at / N][at % N].abs() / (b[at / N] * b[at % N])));
    b.map(|b| b * most.sqrt() * spare)
}

/// Whether a symmetric matrix whose diagonal is lowered by these numbers is proved to be positive definite: its
/// Cholesky factorisation succeeds with the diagonal lowered further, by more than the factorisation's rounding.
fn positive<const N: usize>(a: &Square<N>, lowered: &[f64; N]) -> bool {
    let slack = (4 * N * (N + 2)) as f64 * UNIT;
    let mut root = [[0.0; N]; N];
    for row in 0..N {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| root[row][k] * root[column][k]).sum();
            let rest = a[row][column] - sum;
            if row == column {
                let rest = rest - lowered[row] - slack * a[row][row];
                if rest.is_nan() || rest <= 0.0 {
                    return false;
                }
                root[row][row] = rest.sqrt();
            } else {
                root[row][column] = rest / root[column][column];
            }
        }
    }
    true
}

/// Returns the solution of `P = M' P M + sum` as the limit of its series; `None` if there is none within the numbers'
/// range.
fn fixed_point<const N: usize>(map: &Square<N>, sum: Square<N>) -> Option<Square<N>> {
    let (mut map, mut p) = (*map, sum);
    for _ in 0..64 {
        p = plus(&p, &congruent(&map, &p));
        map = product(&map, &map);
        if size(&map) < 1e-20 {
            return Some(p);
        }
    }
    None
}

/// Returns the solution of `P = M' P M + sum`, which is symmetric, by elimination; `None` if there is none.
fn solution<const N: usize>(map: &Square<N>, sum: &Square<N>) -> Option<Square<N>> {
    let size = N * N;
    let mut rows: Vec<Vec<f64>> = (0..size)
        .map(|at| {
            let (row, column) = (at / N, at % N);
            let term = |k: usize| {
                let here = f64::from(u8::from(k == at));
                here - map[k / N][row] * map[k % N][column]
            };
            (0..size).map(term).chain([sum[row][column]]).collect()
        })
        .collect();
    for k in 0..size {
        let pivot = (k..size).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))?;
        rows.swap(k, pivot);
        let by = 1.0 / rows[k][k];
        if !by.is_finite() {
            return None;
        }
        let own: Vec<f64> = rows[k].iter().map(|cell| cell * by).collect();
        for (_, row) in rows.iter_mut().enumerate().filter(|(at, _)| *at != k) {
            let factor = row[k];
            if factor != 0.0 {
                row.iter_mut().zip(&own).for_each(|(cell, own)| *cell -= factor * own);
            }
        }
        rows[k] = own;
    }
    let p: Square<N> = from_fn(|row| from_fn(|column| rows[row * N + column][size]));
    Some(from_fn(|row| from_fn(|column| 0.5 * (p[row][column] + p[column][row]))))
}
