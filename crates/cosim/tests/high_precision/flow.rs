//! A linear system `x' = A x + g` on a clock: its state after any number of edges, and bounds on its rates.

use crate::fixed::Fixed;

/// Edge counts are written in base 64.
const DIGIT_BITS: u32 = 6;
const LEVELS: u32 = 4;

/// The state: current, speed, angle relative to the hand's intended angle.
pub type Vector<const N: usize> = [Fixed<N>; 3];
/// A matrix, by rows.
pub type Matrix<const N: usize> = [Vector<N>; 3];

pub const CURRENT: usize = 0;
pub const SPEED: usize = 1;
pub const ANGLE: usize = 2;

/// `exp(A t)` and its integral, which take a state `x` to `exp(A t) x + (integral) g`.
#[derive(Clone, Copy)]
struct Step<const N: usize> {
    state: Matrix<N>,
    input: Matrix<N>,
}

/// The system, with its steps tabulated.
pub struct Flow<const N: usize> {
    matrix: Matrix<N>,
    a: [[f64; 3]; 3],
    edge_s: f64,
    /// Steps of `digit * 64^level` edges at `63 level + digit - 1`.
    steps: Vec<Step<N>>,
    /// `1 / k` at `k`, for the terms of a series.
    shares: [Fixed<N>; 128],
    /// Rows of current and speed in `exp(|A| t)` for `2^index` edges: bounds on the entries of `exp(A s)` for `0 <= s
    /// <= t`.
    bounds: Vec<[[f64; 3]; 2]>,
}

/// Allowance for rounding where floats prove a bound: their error is a few parts in 10^16.
const SLACK: f64 = 1.0 + 1e-9;

impl<const N: usize> Flow<N> {
    pub fn new(a: Matrix<N>, edge_s: f64) -> Self {
        let unit = Step::short(&a, Fixed::of(edge_s));
        let mut steps = Vec::new();
        let mut base = unit;
        for _ in 0..LEVELS {
            let mut step = base;
            for _ in 1..1 << DIGIT_BITS {
                steps.push(step);
                step = base.after(&step);
            }
            base = step;
        }
        let matrix = a;
        let a = a.map(|row| row.map(Fixed::float));
        let bounds = bounds(&a, edge_s);
        let shares = std::array::from_fn(|k| Fixed::whole(k.max(1) as u64).reciprocal());
        Self { matrix, a, edge_s, steps, shares, bounds }
    }

    /// Returns the rate of change of the state.
    pub fn rate(&self, x: &Vector<N>, g: &Vector<N>) -> Vector<N> {
        sum(&apply(&self.matrix, x), g)
    }

    /// Returns the state after a short time, at most an edge, by Taylor's series.
    pub fn part(&self, time_s: Fixed<N>, x: &Vector<N>, g: &Vector<N>) -> Vector<N> {
        let mut term = self.rate(x, g).map(|rate| rate * time_s);
        let mut state = sum(x, &term);
        for k in 2.. {
            let share = time_s * self.shares[k];
            term = apply(&self.matrix, &term).map(|rate| rate * share);
            if term == [Fixed::ZERO; 3] {
                break;
            }
            state = sum(&state, &term);
        }
        state
    }

    /// Returns the state so many edges later under a constant `g`.
    pub fn after(&self, mut edges: u64, mut x: Vector<N>, g: &Vector<N>) -> Vector<N> {
        assert!(edges < 1 << (DIGIT_BITS * LEVELS), "a leap of {edges} edges");
        let mut level = 0;
        while edges > 0 {
            let digit = (edges & 63) as usize;
            if digit > 0 {
                let step = &self.steps[63 * level + digit - 1];
                x = sum(&apply(&step.state, &x), &apply(&step.input, g));
            }
            edges >>= DIGIT_BITS;
            level += 1;
        }
        x
    }

    /// Returns the most edges for which [`fastest`](Self::fastest) has bounds.
    pub fn window(&self) -> u64 {
        1 << (self.bounds.len() - 1)
    }

    /// Returns bounds on the rates of current and speed during so many edges from a state: `x''` obeys `x'' = A x'`, so
    /// each is its row of `exp(A t)` times the present `x'`.
    pub fn fastest(&self, edges: u64, x: &[f64; 3], g: &[f64; 3]) -> [f64; 2] {
        self.bounds[edges.next_power_of_two().trailing_zeros() as usize].map(|row| {
            let mut most = 0.0;
            for (bound, (coefficients, g)) in row.iter().zip(self.a.iter().zip(g)) {
                let terms = coefficients.iter().zip(x).map(|(a, x)| a * x);
                let (rate, size) = terms.fold((*g, g.abs()), |(rate, size), term| (rate + term, size + term.abs()));
                // Terms that cancel leave their rounding behind.
                most += bound * (rate.abs() + 1e-12 * size);
            }
            most * SLACK
        })
    }

    /// Returns the time, within at most an edge, at which the rest of a margin is used up, by Newton's iteration. The
    /// time is halved where that leaves the bracket. A margin is affine in the state at its end.
    pub fn end(
        &self,
        x: &Vector<N>,
        g: &Vector<N>,
        within: Fixed<N>,
        margin: impl Fn(&Vector<N>) -> Fixed<N>,
    ) -> Fixed<N> {
        let (start, end) = (margin(x), margin(&self.part(within, x, g)));
        let share = start.float() / (start - end).float();
        // A time that is too short to bend the course.
        let little = Fixed::of(2f64.powi(-60));
        let mut time = Fixed::ZERO;
        if start == Fixed::ZERO && !margin(&sum(x, &self.rate(x, g).map(|rate| rate * little))).is_negative() {
            // A margin that grows from zero is used up later: sought from the end.
            time = within;
        } else if share > 1e-9 {
            time = within * Fixed::of((share * 2f64.powi(40)).floor() / 2f64.powi(40));
        }
        // Far more than rounding, far less than any time that matters.
        let slack = Fixed::of(1e-40);
        let (mut low, mut high) = (Fixed::ZERO, within);
        for _ in 0..60 {
            let there = self.part(time, x, g);
            *(if margin(&there).is_negative() { &mut high } else { &mut low }) = time;
            let step = self.rate(&there, g).map(|rate| rate * little);
            let slope = (margin(&sum(&there, &step)) - margin(&there)).float() * 2f64.powi(60);
            let next = time + margin(&there) * Fixed::of(f64::from((-1.0 / slope) as f32));
            let half = low + (high - low) * Fixed::of(0.5);
            let next = if next < low - slack || next > high + slack { half } else { next.max(Fixed::ZERO).min(within) };
            if (next - time).abs().float() < 1e-48 {
                return next;
            }
            time = next;
        }
        panic!("the end of a mode is not found");
    }

    /// Returns the seconds that so many edges take, with slack.
    pub fn at_most_s(&self, edges: u64) -> f64 {
        edges as f64 * self.edge_s * SLACK
    }
}

impl<const N: usize> Step<N> {
    /// Returns the step over a short time, by Taylor's series.
    fn short(a: &Matrix<N>, time_s: Fixed<N>) -> Self {
        let at = a.map(|row| row.map(|x| x * time_s));
        let zero = [[Fixed::ZERO; 3]; 3];
        let identity: Matrix<N> = std::array::from_fn(|i| std::array::from_fn(|j| Fixed::whole(u64::from(i == j))));
        let (mut state, mut input, mut term) = (identity, zero, identity);
        for k in 1.. {
            // (A t)^(k-1) / (k-1)! becomes the input's t (A t)^(k-1) / k! and the state's (A t)^k / k!.
            let share = Fixed::whole(k).reciprocal();
            input = add(&input, &term.map(|row| row.map(|x| x * time_s * share)));
            term = product(&at, &term).map(|row| row.map(|x| x * share));
            state = add(&state, &term);
            if term == zero {
                return Self { state, input };
            }
        }
        unreachable!("the series ends where its terms vanish")
    }

    /// Returns the step of `first` followed by this one.
    fn after(&self, first: &Self) -> Self {
        Self { state: product(&self.state, &first.state), input: add(&product(&self.state, &first.input), &self.input) }
    }
}

fn sum<const N: usize>(x: &Vector<N>, y: &Vector<N>) -> Vector<N> {
    std::array::from_fn(|i| x[i] + y[i])
}

fn add<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| sum(&a[i], &b[i]))
}

fn apply<const N: usize>(a: &Matrix<N>, x: &Vector<N>) -> Vector<N> {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    a.map(|row| std::array::from_fn(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

/// Returns upper bounds on the rows of current and speed of `exp(|A| t)`, for 1, 2, 4 edges and so on, as long as they
/// are useful.
fn bounds(a: &[[f64; 3]; 3], edge_s: f64) -> Vec<[[f64; 3]; 2]> {
    let size = a.map(|row| row.map(|x| x.abs() * edge_s));
    assert!(size.iter().flatten().sum::<f64>() < 1.0, "an edge is too long for the bounds");
    let mut all = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut term = all;
    // The terms left out are far below the slack.
    for k in 1..30 {
        term = multiply(&term, &size).map(|row| row.map(|x| x / f64::from(k)));
        all = std::array::from_fn(|i| std::array::from_fn(|j| all[i][j] + term[i][j]));
    }
    let mut rows = Vec::new();
    while rows.len() < (DIGIT_BITS * LEVELS) as usize && (0..3).all(|i| all[i][i] < 8.0) {
        all = all.map(|row| row.map(|x| x * SLACK));
        rows.push([all[CURRENT], all[SPEED]]);
        all = multiply(&all, &all);
    }
    rows
}

fn multiply(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    a.map(|row| std::array::from_fn(|j| (0..3).map(|i| row[i] * b[i][j]).sum()))
}

#[cfg(test)]
mod tests {
    use super::{ANGLE, CURRENT, Flow, Matrix, SPEED};
    use crate::fixed::Fixed;

    const EDGE_S: f64 = 1.0 / (1 << 22) as f64;

    fn matrix(entries: [[f64; 3]; 3]) -> Matrix<4> {
        entries.map(|row| row.map(Fixed::of))
    }

    /// Returns the number with these digits after the point, the first 50 of them, as tables of constants list them.
    fn decimal(digits: &str) -> Fixed<4> {
        let tenth = Fixed::whole(10).reciprocal();
        digits.bytes().rev().fold(Fixed::ZERO, |sum, digit| (sum + Fixed::whole(u64::from(digit - b'0'))) * tenth)
    }

    #[track_caller]
    fn assert_near(x: Fixed<4>, digits: &str) {
        let off = (x - decimal(digits)).abs().float();
        assert!(off < 1e-48, "{off:e}");
    }

    const E_INVERSE: &str = "36787944117144232159552377016146086744581113103176";
    const SINE_1: &str = "84147098480789650665250232163029899962256306079837";
    const COSINE_1: &str = "54030230586813971740093660744297660373231042061792";

    #[test]
    fn after_a_time_constant_the_tables_digits_of_1_over_e_are_left() {
        let flow = Flow::new(matrix([[-1.0, 0.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0]]), EDGE_S);
        let (one, zero) = (Fixed::whole(1), Fixed::ZERO);
        assert_near(flow.after(1 << 22, [one, zero, zero], &[zero; 3])[CURRENT], E_INVERSE);
        // Driven from rest, the complement to one.
        assert_near(one - flow.after(1 << 22, [zero; 3], &[one, zero, zero])[CURRENT], E_INVERSE);
        // In two leaps whose edge counts share no digit.
        let part = flow.after(1_234_567, [one, zero, zero], &[zero; 3]);
        assert_near(flow.after((1 << 22) - 1_234_567, part, &[zero; 3])[CURRENT], E_INVERSE);
    }

    #[test]
    fn after_a_radian_a_swing_has_the_tables_digits_of_sine_and_cosine() {
        let flow = Flow::new(matrix([[0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), EDGE_S);
        let (one, zero) = (Fixed::whole(1), Fixed::ZERO);
        let x = flow.after(1 << 22, [zero, zero, one], &[zero; 3]);
        assert_near(x[ANGLE], COSINE_1);
        assert_near(-x[SPEED], SINE_1);
        // Under a constant acceleration it oscillates about one: 1 - cos and sin.
        let x = flow.after(1 << 22, [zero; 3], &[zero, one, zero]);
        assert_near(one - x[ANGLE], COSINE_1);
        assert_near(x[SPEED], SINE_1);
    }

    #[test]
    fn the_parts_of_an_edge_are_the_edge() {
        let flow = Flow::new(matrix([[-1e4, -115.0, 0.0], [1.9e4, -80.0, -2.2e5], [0.0, 1.0, 0.0]]), EDGE_S);
        let (x, g) = ([9.0, -40.0, 0.1].map(Fixed::of), [1e5, -300.0, 7.0].map(Fixed::of));
        let whole = flow.after(1, x, &g);
        for share in [0.0, 0.25, 0.3, 1.0] {
            let part = Fixed::of(share * EDGE_S);
            let parts = flow.part(Fixed::of(EDGE_S) - part, &flow.part(part, &x, &g), &g);
            for (one, other) in whole.iter().zip(&parts) {
                let off = (*one - *other).abs().float();
                assert!(off < 1e-50, "{share}: {off:e}");
            }
        }
    }

    #[test]
    fn a_falling_body_falls_by_half_g_t_squared_exactly() {
        let flow = Flow::<4>::new(matrix([[0.0; 3], [0.0; 3], [0.0, 1.0, 0.0]]), EDGE_S);
        let x = flow.after(3 << 20, [Fixed::ZERO; 3], &[Fixed::ZERO, Fixed::whole(8), Fixed::ZERO]);
        assert_eq!((x[SPEED], x[ANGLE]), (Fixed::whole(6), Fixed::of(2.25)));
    }

    #[test]
    fn no_acceleration_in_a_window_exceeds_its_bound() {
        let a = matrix([[-1e4, -115.0, 0.0], [1.9e4, -80.0, -2.2e5], [0.0, 1.0, 0.0]]);
        let flow = Flow::new(a, 2e-8);
        let g = [1e5, -300.0, 7.0];
        for x in [[0.0, 0.0, 0.0], [10.0, -40.0, 0.1], [-3.0, 200.0, -1.5], [9.98, 0.0, 0.86]] {
            let state: [Fixed<4>; 3] = x.map(Fixed::of);
            let [_, bound] = flow.fastest(flow.window(), &x, &g);
            let most = (0..=flow.window()).step_by(16).map(|edges| {
                let [i, w, d] = flow.after(edges, state, &g.map(Fixed::of)).map(Fixed::float);
                (1.9e4 * i - 80.0 * w - 2.2e5 * d + g[1]).abs()
            });
            let most = most.fold(0.0, f64::max);
            assert!(most <= bound && bound <= 50.0 * most, "{most} of {bound}");
        }
    }
}
