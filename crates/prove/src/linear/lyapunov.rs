//! Proofs that the motion of a periodic linear loop dies out, or that it does not, over a stretch of stiffnesses.
//!
//! A common period of the loop is a sequence of steps `y⁺ = (A - g r') y`. The row `r` is the command's answer to the
//! state, and depends linearly on the stiffness. `A` and `g` depend on it through the duty at rest. The proof is a
//! matrix `P` for every boundary of two steps, with `P - H' P⁺ H` positive definite for every step `H = A - g r'`, and
//! the same `P` at both ends of the common period: `y' P y` then falls with every step. If the first `P` is positive
//! definite, all motions die out. If `y' P y` is below zero for some state, its motion never does.
//!
//! Over a stretch, `P` is the straight line between a matrix for the softest stiffness and one for the stiffest, and so
//! is `H`, but for an error that grows with the square of the stretch. `P - H' P⁺ H` is then a polynomial of degree 3
//! along the stretch, and positive definite if its four coefficients in Bernstein's form are. At either end the matrix
//! is the solution for this stiffness, so a stretch may end close to where a pole crosses.
//!
//! Each step is checked by itself, from numbers that are exact: no error grows from step to step, and none of the
//! search for `P` counts. What a check computes in `f64` is bounded as follows. With `|P⁺| <= b b'`, the bound `h` of
//! the columns `b' |H|` and the bound `e` of the columns `b' |ΔH|`, the entries of `H' P⁺ H` err by no more than
//! `h e' + e h' + e e'` and their rounding by some units of `h h'`. The diagonal is lowered by more than that, and by
//! more than the rounding of the elimination that follows (Rump 2006, "Verification of positive definiteness").

use std::array::from_fn;

/// A square matrix, as a list of rows.
pub(super) type Square<const N: usize> = [[f64; N]; N];

/// Half of an ulp of 1.
const UNIT: f64 = f64::EPSILON / 2.0;
/// The share of the loop's decay that the proof leaves to the search's own weights.
const KEPT: f64 = 0.5;

/// A step of the loop at the softest and at the stiffest stiffness of a stretch, with bounds of what its numbers err
/// by: at both ends, and in between from the straight line.
#[derive(Clone)]
pub(super) struct Step<const N: usize> {
    pub a: [Square<N>; 2],
    pub g: [[f64; N]; 2],
    pub a_error: Square<N>,
    pub g_error: [f64; N],
}

/// The steps of a common period, over a stretch of stiffnesses.
pub(super) struct Steps<const N: usize> {
    /// The steps that differ.
    pub kinds: Vec<Step<N>>,
    /// The order of the steps: a kind, and how often it follows itself.
    pub order: Vec<(usize, u32)>,
    /// The command's answer `r` at both ends of the stretch.
    pub answers: [[f64; N]; 2],
    /// The weights of the states in the search for `P`.
    pub weights: [f64; N],
}

/// What is asked of a loop over a stretch of stiffnesses.
pub(super) trait Motion {
    /// Returns the logarithm of the loop's growth over a common period, at the softest stiffness.
    fn log_growth(&self) -> f64;
    /// Whether every motion is proved to die out at every stiffness. `false` proves nothing.
    fn settles(&self) -> bool;
    /// Whether some motion is proved not to die out at the softest stiffness. `false` proves nothing.
    fn persists(&self) -> bool;
}

/// Returns the matrix of these cells. Counted: closures that make arrays were called a cell where the compiler did not
/// inline them.
#[inline(always)]
fn square<const N: usize>(cell: impl Fn(usize, usize) -> f64) -> Square<N> {
    let mut cells = [[0.0; N]; N];
    for (row, columns) in cells.iter_mut().enumerate() {
        for (column, of) in columns.iter_mut().enumerate() {
            *of = cell(row, column);
        }
    }
    cells
}

fn product<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    let mut sums = [[0.0; N]; N];
    // Counted, not zipped: a zip's length was called three times a cell where the compiler did not inline it.
    for (at, row) in a.iter().enumerate() {
        for (k, factor) in row.iter().enumerate() {
            for (column, sum) in sums[at].iter_mut().enumerate() {
                *sum += factor * b[k][column];
            }
        }
    }
    sums
}

/// Returns `a' b`.
fn across<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    product(&square(|row, column| a[column][row]), b)
}

/// Returns the matrix with each pair of mirrored cells at its mean.
fn symmetric<const N: usize>(a: &Square<N>) -> Square<N> {
    square(|row, column| 0.5 * (a[row][column] + a[column][row]))
}

/// Returns `a' p a`, symmetric to the bit.
fn congruent<const N: usize>(a: &Square<N>, p: &Square<N>) -> Square<N> {
    symmetric(&across(a, &product(p, a)))
}

fn plus<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    square(|row, column| a[row][column] + b[row][column])
}

fn scaled<const N: usize>(a: &Square<N>, by: f64) -> Square<N> {
    let mut cells = *a;
    cells.iter_mut().flatten().for_each(|cell| *cell *= by);
    cells
}

fn diagonal<const N: usize>(of: &[f64; N]) -> Square<N> {
    square(|row, column| if row == column { of[row] } else { 0.0 })
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

    /// Returns the logarithm of the greatest absolute value of an eigenvalue, and a matrix whose columns are the states
    /// that grow by it: Gelfand's `lim |M^n|^(1/n)` along powers of two.
    fn greatest(&self) -> (f64, Square<N>) {
        let (mut power, mut log, mut weight) = (self.matrix, self.log, 1.0);
        for _ in 0..60 {
            let most = size(&power);
            if most == 0.0 {
                return (f64::NEG_INFINITY, power);
            }
            log += weight * libm::log(most);
            power = scaled(&power, 1.0 / most);
            power = product(&power, &power);
            weight *= 0.5;
        }
        (log, power)
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

impl<const N: usize> Step<N> {
    /// Returns the map `A - g r'` at an end of the stretch.
    fn closed(&self, end: usize, r: &[f64; N]) -> Square<N> {
        let (a, g) = (&self.a[end], &self.g[end]);
        square(|row, column| a[row][column] - g[row] * r[column])
    }
}

/// The matrices that prove an end of a stretch: the last one, and what makes each from the one behind it.
struct Chain<const N: usize> {
    end: usize,
    p: Square<N>,
    stretch: f64,
    weights: [f64; N],
}

impl<const N: usize> Steps<N> {
    /// Returns the number of steps.
    fn count(&self) -> u64 {
        self.order.iter().map(|(_, count)| u64::from(*count)).sum()
    }

    /// Returns the maps of the kinds of steps at an end, each multiplied by `stretch`.
    fn closed(&self, end: usize, stretch: f64) -> Vec<Scaled<N>> {
        let map = |step: &Step<N>| Scaled::of(scaled(&step.closed(end, &self.answers[end]), stretch), 0.0);
        self.kinds.iter().map(map).collect()
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

    /// Returns the map of a common period at an end and the sum of the weights in it, with each step multiplied by
    /// `stretch`.
    fn weighed(&self, end: usize, stretch: f64, weights: &[f64; N]) -> Run<N> {
        let sum = diagonal(weights);
        let kinds: Vec<Run<N>> = self.closed(end, stretch).into_iter().map(|map| Run { map, sum }).collect();
        self.whole(&kinds, Run::joined)
    }

    /// Returns the logarithm of the loop's growth over a common period at an end.
    fn growth(&self, end: usize) -> f64 {
        self.whole(&self.closed(end, 1.0), |first, second| second.after(first)).greatest().0
    }

    /// Returns the chain of positive definite matrices at an end; `None` if the loop does not decay there.
    fn decaying(&self, end: usize) -> Option<Chain<N>> {
        let by_step = self.growth(end) / self.count() as f64;
        if by_step.is_nan() || by_step >= 0.0 {
            return None;
        }
        // A share of the decay becomes a decay of every step. Where a common period leaves nothing of a motion, a
        // step's share has a limit.
        let stretch = libm::exp((-(1.0 - KEPT) * by_step).min(0.5));
        // Weights in proportion to the decay make matrices that are alike at both ends.
        let share = -libm::expm1(2.0 * KEPT * by_step);
        let weights = self.weights.map(|weight| share * weight);
        let Run { map, sum } = self.weighed(end, stretch, &weights);
        let p = fixed_point(&map.matrix(), sum).filter(|p| positive(p, &[0.0; N]))?;
        Some(Chain { end, p, stretch, weights })
    }

    /// Returns bounds of `|H|` over the stretch, and of the distance of `H` from the straight line between the maps of
    /// its ends.
    fn bounds(&self, kind: usize) -> [Square<N>; 2] {
        let Step { a, g, a_error, g_error } = &self.kinds[kind];
        let r = &self.answers;
        let most = |ends: [f64; 2]| ends[0].abs().max(ends[1].abs());
        let apart = |ends: [f64; 2]| (ends[0] - ends[1]).abs();
        let size: Square<N> = square(|row, column| {
            let own = most([a[0][row][column], a[1][row][column]]);
            own + most([g[0][row], g[1][row]]) * most([r[0][column], r[1][column]])
        });
        // A product of two straight lines departs from one by at most a quarter of both changes. What `r` and the
        // products with it are rounded by counts as well.
        let error = square(|row, column| {
            let [by_g, by_r] = [[g[0][row], g[1][row]], [r[0][column], r[1][column]]];
            let bent = 0.25 * apart(by_g) * apart(by_r);
            let known = a_error[row][column] + g_error[row] * most(by_r) + bent;
            known * (1.0 + 8.0 * UNIT) + 8.0 * UNIT * size[row][column]
        });
        [size, error]
    }

    /// Whether `y' P y` falls with each step at every stiffness between the ends of the chains.
    fn falls<const ENDS: usize>(&self, chains: &[Chain<N>; ENDS], definite: bool) -> bool {
        let mut left = self.count();
        let mut after = chains.each_ref().map(|chain| chain.p);
        let mut b = bounds(&after, definite);
        for &(kind, count) in self.order.iter().rev() {
            let step = &self.kinds[kind];
            let maps = chains.each_ref().map(|chain| step.closed(chain.end, &self.answers[chain.end]));
            let [size, error] = self.bounds(kind);
            for _ in 0..count {
                left -= 1;
                let (seen, inner) = congruent_along(&maps, &after);
                let before = from_fn(|end| {
                    let Chain { p, stretch, weights, .. } = &chains[end];
                    if left == 0 { *p } else { plus(&scaled(&seen[end], stretch * stretch), &diagonal(weights)) }
                });
                let known = bounds(&before, definite);
                let columns = |of: &Square<N>| from_fn(|column| (0..N).map(|k| b[k] * of[k][column]).sum());
                let doubt = Doubt { h: columns(&size), e: columns(&error), known };
                let inside = inner.iter().flatten().zip([0, 1]).all(|(after, end)| {
                    let other = ENDS - 1 - end;
                    let between = |row: usize, column: usize| {
                        (2.0 * before[end][row][column] + before[other][row][column]) * (1.0 / 3.0)
                    };
                    doubt.falls(&square(between), after)
                });
                if !inside || !(0..ENDS).all(|end| doubt.falls(&before[end], &seen[end])) {
                    return false;
                }
                (after, b) = (before, known);
            }
        }
        true
    }
}

/// Returns `H' P H` at the ends of the straight lines between maps and between matrices, and between two ends the inner
/// two of its four coefficients in Bernstein's form.
fn congruent_along<const N: usize, const ENDS: usize>(
    maps: &[Square<N>; ENDS],
    p: &[Square<N>; ENDS],
) -> ([Square<N>; ENDS], Option<[Square<N>; 2]>) {
    let seen: [Square<N>; ENDS] = from_fn(|end| product(&p[end], &maps[end]));
    let ends = from_fn(|end| symmetric(&across(&maps[end], &seen[end])));
    let inner = |end: usize| {
        let other = ENDS - 1 - end;
        let crossed = scaled(&across(&maps[other], &seen[end]), 2.0);
        let sum = plus(&across(&maps[end], &product(&p[other], &maps[end])), &crossed);
        scaled(&symmetric(&sum), 1.0 / 3.0)
    };
    (ends, (ENDS == 2).then(|| [0, 1].map(inner)))
}

/// Bounds of what the numbers of a step err by: `h` and `e` of the columns of `|H|` and `|ΔH|`, and that of the matrix
/// before it.
struct Doubt<const N: usize> {
    h: [f64; N],
    e: [f64; N],
    known: [f64; N],
}

impl<const N: usize> Doubt<N> {
    /// Whether `before - after` is positive definite, whatever the numbers err by.
    fn falls(&self, before: &Square<N>, after: &Square<N>) -> bool {
        let difference: Square<N> = square(|row, column| before[row][column] - after[row][column]);
        let weight: [f64; N] = from_fn(|k| difference[k][k].sqrt());
        if !weight.iter().all(|weight| *weight > 0.0) {
            return false;
        }
        let Self { h, e, known } = self;
        let over = |of: &[f64; N]| (0..N).map(|k| of[k] / weight[k]).sum::<f64>();
        let (all_h, all_e, all_known) = (over(h), over(e), over(known));
        let rounding = (2 * N + 16) as f64 * UNIT;
        let lowered = from_fn(|k| {
            let error = h[k] * all_e + e[k] * (all_h + all_e) + rounding * (h[k] * all_h + known[k] * all_known);
            1.001 * weight[k] * error
        });
        positive(&difference, &lowered)
    }
}

impl<const N: usize> Motion for Steps<N> {
    fn log_growth(&self) -> f64 {
        self.growth(0)
    }

    fn settles(&self) -> bool {
        let Some(soft) = self.decaying(0) else { return false };
        if self.answers[0] == self.answers[1] {
            return self.falls(&[soft], true);
        }
        self.decaying(1).is_some_and(|stiff| self.falls(&[soft, stiff], true))
    }

    fn persists(&self) -> bool {
        let Run { map, sum } = self.weighed(0, 1.0, &self.weights);
        if map.log.abs() > 100.0 {
            return false;
        }
        let Some(p) = solution(&map.matrix(), &sum) else { return false };
        let (_, power) = map.greatest();
        let column = |column: usize| -> [f64; N] { from_fn(|row| power[row][column]) };
        let grows = |state: &[f64; N]| {
            let terms = || (0..N * N).map(|at| state[at / N] * p[at / N][at % N] * state[at % N]);
            let rounding = 4.0 * (N * N) as f64 * UNIT * terms().map(f64::abs).sum::<f64>();
            terms().sum::<f64>() < -rounding
        };
        let chain = Chain { end: 0, p, stretch: 1.0, weights: self.weights };
        (0..N).map(column).any(|state| grows(&state)) && self.falls(&[chain], false)
    }
}

/// Returns `b` with `|p| <= b b'` for each of these matrices.
fn bounds<const N: usize>(p: &[Square<N>], definite: bool) -> [f64; N] {
    let spare = 1.0 + 8.0 * UNIT;
    let most = |row: usize, column: usize| p.iter().fold(0.0, |most: f64, p| most.max(p[row][column].abs()));
    if definite {
        return from_fn(|k| most(k, k).sqrt() * spare);
    }
    let sizes: Square<N> = square(most);
    let least = 1e-30 * size(&sizes);
    let mut b: [f64; N] = from_fn(|k| sizes[k][k].max(least).sqrt());
    for _ in 0..6 {
        b = from_fn(|k| (b[k] * (0..N).fold(0.0, |most: f64, of| most.max(sizes[k][of] / b[of]))).sqrt());
    }
    let most = (0..N * N).fold(0.0, |most: f64, at| most.max(sizes[at / N][at % N] / (b[at / N] * b[at % N])));
    b.map(|b| b * most.sqrt() * spare)
}

/// Whether a symmetric matrix whose diagonal is lowered by these numbers is proved to be positive definite: elimination
/// keeps each pivot above zero with the diagonal lowered further, by more than its rounding.
fn positive<const N: usize>(a: &Square<N>, lowered: &[f64; N]) -> bool {
    let slack = (4 * N * (N + 2)) as f64 * UNIT;
    let mut rest = *a;
    for (k, row) in rest.iter_mut().enumerate() {
        row[k] -= lowered[k] + slack * row[k];
    }
    for k in 0..N {
        let pivot = rest[k];
        if pivot[k].is_nan() || pivot[k] <= 0.0 {
            return false;
        }
        for row in &mut rest[k + 1..] {
            let factor = row[k] / pivot[k];
            for (cell, above) in row.iter_mut().zip(&pivot) {
                *cell -= factor * above;
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
    let rows = (0..size)
        .map(|at| {
            let (row, column) = (at / N, at % N);
            let term = |k: usize| {
                let here = f64::from(u8::from(k == at));
                here - map[k / N][row] * map[k % N][column]
            };
            (0..size).map(term).chain([sum[row][column]]).collect()
        })
        .collect();
    let cells = crate::sampled::solution(rows)?;
    Some(symmetric(&square(|row, column| cells[row * N + column])))
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use super::{Motion, Square, Step, Steps, congruent, congruent_along, plus, scaled, symmetric};

    #[test]
    fn maps_within_a_stretch_are_within_their_bounds_of_the_straight_line() {
        let a = [[[0.5, -1.0], [2.0, 0.25]], [[0.75, -1.5], [1.0, 0.5]]];
        let (g, answers) = ([[1.0, -2.0], [3.0, 1.0]], [[0.5, 4.0], [-1.5, 2.0]]);
        let step = Step { a, g, a_error: [[0.0; 2]; 2], g_error: [0.0; 2] };
        let [soft, stiff] = [0, 1].map(|end| step.closed(end, &answers[end]));
        let steps = Steps { kinds: vec![step], order: vec![(0, 1)], answers, weights: [1.0; 2] };
        let [size, error] = steps.bounds(0);
        let line = |ends: [f64; 2], share: f64| ends[0] + share * (ends[1] - ends[0]);
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            for row in 0..2 {
                for column in 0..2 {
                    let by =
                        line([g[0][row], g[1][row]], share) * line([answers[0][column], answers[1][column]], share);
                    let exact = line([a[0][row][column], a[1][row][column]], share) - by;
                    let away = (exact - line([soft[row][column], stiff[row][column]], share)).abs();
                    assert!(away <= error[row][column] && exact.abs() <= size[row][column], "{share}: {row} {column}");
                    // A half of the way the bound is reached.
                    assert!(share != 0.5 || away > 0.999 * error[row][column], "{away} of {}", error[row][column]);
                }
            }
        }
    }

    #[test]
    fn a_stretch_is_not_proved_whose_ends_settle_and_whose_middle_does_not() {
        let settles = |by: f64| {
            let a = [[[0.5, by], [0.0, 0.5]], [[0.5, 0.0], [by, 0.5]]];
            let step = Step { a, g: [[0.0; 2]; 2], a_error: [[0.0; 2]; 2], g_error: [0.0; 2] };
            let whole =
                Steps { kinds: vec![step], order: vec![(0, 1)], answers: [[0.0; 2], [1.0; 2]], weights: [1.0; 2] };
            let ends = [0, 1].map(|end| whole.growth(end) < 0.0);
            assert_eq!(ends, [true; 2]);
            whole.settles()
        };
        // In the middle the eigenvalues are 0.5 and a half of the corner more or less.
        assert!(settles(0.3) && !settles(1.01) && !settles(4.0));
    }

    #[test]
    fn four_coefficients_are_those_of_the_cubic_between_both_ends() {
        let mut number = 0.0f64;
        let mut some = || -> Square<3> {
            from_fn(|_| {
                from_fn(|_| {
                    number += 1.0;
                    number.sin()
                })
            })
        };
        let (maps, p) = ([some(), some()], [some(), some()].map(|p| symmetric(&p)));
        let (ends, inner) = congruent_along(&maps, &p);
        let [soft, stiff] = inner.expect("two ends");
        for share in [0.0f64, 0.2, 0.5, 0.9, 1.0] {
            let line = |ends: &[Square<3>; 2]| plus(&scaled(&ends[0], 1.0 - share), &scaled(&ends[1], share));
            let exact = congruent(&line(&maps), &line(&p));
            let rest = 1.0 - share;
            let weights = [rest.powi(3), 3.0 * share * rest.powi(2), 3.0 * share.powi(2) * rest, share.powi(3)];
            for row in 0..3 {
                for column in 0..3 {
                    let parts = [&ends[0], &soft, &stiff, &ends[1]].map(|part| part[row][column]);
                    let sum: f64 = parts.iter().zip(weights).map(|(part, weight)| part * weight).sum();
                    assert!((sum - exact[row][column]).abs() < 1e-14, "{share}: {sum}, not {}", exact[row][column]);
                }
            }
        }
    }
}
