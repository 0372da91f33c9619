//! Bounds how far inputs of bounded size can drive a linear system: integrals of its impulse responses, from above.
//!
//! The system is `x' = A x + b u`, `y = c x`. With `u` anywhere in `[lo, hi]` (0 among them) at any time, `y` stays
//! within `[lo P - hi N, hi P - lo N]`. `P` and `N` are the integrals of the positive and of the negative part of `h(t)
//! = c e^(At) b`. No narrower range holds for all such `u`. The integrals are sums over steps: the trapezoid of the
//! part, and `step^3 / 12` times a bound of `h''`. After the last step the flow has shrunk every state by `q`, so the
//! rest is a geometric series. All sums are intervals rounded outwards.

use crate::interval::{Interval, Matrix};
use crate::series::exponential;

/// The longest step, in units of the system's shortest time.
const FINE: f64 = 0.1;

/// More than the roundings of a few products and sums of floats.
const SLACK: f64 = 1.0 + 1.0 / (1u64 << 48) as f64;

/// Steps in a row of the table; there are at most as many columns as rows.
const ROW: usize = 512;

/// A linear system's flow, tabulated.
pub struct Flow {
    /// `A` in balanced states.
    a: Matrix,
    /// The unit of each state in terms of the balanced one; powers of two.
    units: Vec<f64>,
    step_s: f64,
    /// `e^(A step k)` for `k` below [`ROW`].
    fine: Vec<Matrix>,
    /// `e^(A step ROW k)`; the last one is for the end.
    coarse: Vec<Matrix>,
    /// `e^(A end)` and its norm; `None` if time ends at the end of the table.
    last: Option<(Matrix, f64)>,
    /// An upper bound of `e^(|A| step)`, cell by cell.
    growth: Matrix,
}

/// The integrals of the positive and the negative part of an impulse response.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Parts {
    pub positive: f64,
    pub negative: f64,
}

impl Parts {
    /// Returns the integral of the response's size.
    pub fn both(self) -> f64 {
        (self.positive + self.negative).next_up()
    }

    /// Returns the range of the output for an input that stays within `[lo, hi]`, which must hold 0.
    pub fn driven(self, input: Interval) -> Interval {
        let Interval { lo, hi } = input;
        let reach = |up: f64, down: f64| (up.max(0.0) * self.positive + (-down).max(0.0) * self.negative) * SLACK;
        Interval { lo: -reach(-lo, -hi), hi: reach(hi, lo) }
    }
}

impl Flow {
    /// Tabulates the flow of `A` for all time; `None` if it does not settle.
    pub fn forever(a: &[Vec<Interval>]) -> Option<Self> {
        let (a, units) = balanced(a);
        // A system that is slower than any run lasts counts as one that does not settle.
        if a.norm() < 1e-9 {
            return None;
        }
        let mut end_s = FINE / a.norm();
        for doublings in 0..40 {
            let last = exponential(&a.map(|cell| cell.times(Interval::exact(end_s))));
            let q = last.norm();
            if q < 1.0 / f64::from(1 << 20) {
                return Some(Self::tabulated(a, units, end_s, 1 << doublings.clamp(9, 18), Some((last, q))));
            }
            if !q.is_finite() {
                return None;
            }
            end_s *= 2.0;
        }
        None
    }

    /// Tabulates the flow of `A` up to a time.
    pub fn until(a: &[Vec<Interval>], end_s: f64) -> Self {
        let (a, units) = balanced(a);
        let wanted = (end_s * a.norm() / FINE).ceil() as usize;
        let steps = wanted.next_multiple_of(ROW).clamp(ROW, 1 << 18);
        Self::tabulated(a, units, end_s, steps, None)
    }

    fn tabulated(a: Matrix, units: Vec<f64>, end_s: f64, steps: usize, last: Option<(Matrix, f64)>) -> Self {
        let step_s = if last.is_some() { end_s / steps as f64 } else { (end_s / steps as f64).next_up() };
        let one = exponential(&a.map(|cell| cell.times(Interval::exact(step_s))));
        let fine = powers(&one, ROW);
        let coarse = powers(&fine[ROW - 1].times(&one), steps / ROW + 1);
        let growth = exponential(&a.sizes().map(|cell| cell.times(Interval::exact(step_s)))).sizes();
        Self { a, units, step_s, fine, coarse, last, growth }
    }

    /// Returns the output `y = c x`.
    pub fn output(&self, c: &[Interval]) -> Output<'_> {
        let scaled: Vec<Interval> = c.iter().zip(&self.units).map(|(c, unit)| c.scaled(*unit)).collect();
        let row = Matrix::row(&scaled);
        let later = self.last.as_ref().map(|(last, q)| {
            let states = Matrix::identity(self.a.rows()).0.into_iter();
            let (mut integrals, mut sizes) = (0.0, 0.0);
            for (parts, swing) in states.map(|state| self.traced(&row, &Matrix::column(&state))) {
                integrals = (integrals + parts.both()).next_up();
                sizes = (sizes + swing.size()).next_up();
            }
            Later { last, q: *q, integrals, sizes }
        });
        Output { flow: self, row, later }
    }

    /// Returns the integrals of the parts and the range of `c e^(At) b`, up to the end of the table.
    fn traced(&self, c: &Matrix, b: &Matrix) -> (Parts, Interval) {
        let columns: Vec<Matrix> = self.fine.iter().map(|power| power.times(b)).collect();
        let sizes: Vec<Matrix> = columns.iter().map(|column| self.growth.times(&column.sizes())).collect();
        let square = self.a.times(&self.a);
        let step = self.step_s.next_up();
        let (mut parts, mut swing) = (Parts { positive: 0.0, negative: 0.0 }, Interval::ZERO);
        let mut before: Option<(Interval, f64)> = None;
        for (index, power) in self.coarse.iter().enumerate() {
            let row = c.times(power);
            let bend = row.times(&square).sizes();
            let count = if index + 1 < self.coarse.len() { ROW } else { 1 };
            for (column, size) in columns.iter().zip(&sizes).take(count) {
                let here = row.times(column).0[0][0];
                if let Some((last, curve)) = before {
                    let bow = step * step * curve * SLACK;
                    let part =
                        |last: f64, here: f64| step * ((last.max(0.0) + here.max(0.0)) / 2.0 + bow / 12.0) * SLACK;
                    parts.positive = (parts.positive + part(last.hi, here.hi)).next_up();
                    parts.negative = (parts.negative + part(-last.lo, -here.lo)).next_up();
                    let bow = bow / 8.0;
                    swing.lo = swing.lo.min((last.lo.min(here.lo) - bow).next_down());
                    swing.hi = swing.hi.max((last.hi.max(here.hi) + bow).next_up());
                }
                before = Some((here, bend.times(size).0[0][0].hi));
            }
        }
        (parts, swing)
    }
}

/// An output of a linear system.
pub struct Output<'f> {
    flow: &'f Flow,
    /// `c`, in balanced states.
    row: Matrix,
    /// The bounds after the end of the table, if time goes on.
    later: Option<Later<'f>>,
}

/// Sums over all states of size 1 at the end of the table.
struct Later<'f> {
    last: &'f Matrix,
    q: f64,
    integrals: f64,
    sizes: f64,
}

impl Later<'_> {
    /// Returns a bound of the sum of the sizes of the states at the ends of this and all later tables.
    fn states(&self, start: &Matrix) -> f64 {
        let size = self.last.times(start).0.iter().map(|cell| cell[0].size()).fold(0.0, f64::max);
        (size / (1.0 - self.q).next_down()).next_up()
    }
}

impl Output<'_> {
    fn start(&self, b: &[Interval]) -> Matrix {
        let scaled: Vec<Interval> = b.iter().zip(&self.flow.units).map(|(b, unit)| b.scaled(unit.recip())).collect();
        Matrix::column(&scaled)
    }

    /// Returns the integrals of the parts of `c e^(At) b`.
    pub fn parts(&self, b: &[Interval]) -> Parts {
        let start = self.start(b);
        let (Parts { positive, negative }, _) = self.flow.traced(&self.row, &start);
        let tail = self.later.as_ref().map_or(0.0, |later| (later.states(&start) * later.integrals).next_up());
        Parts { positive: (positive + tail).next_up(), negative: (negative + tail).next_up() }
    }

    /// Returns the range of `c e^(At) x` from the start on.
    pub fn swing(&self, x: &[Interval]) -> Interval {
        let start = self.start(x);
        let (_, swing) = self.flow.traced(&self.row, &start);
        let tail = self.later.as_ref().map_or(0.0, |later| (later.states(&start) * later.sizes).next_up());
        Interval { lo: swing.lo.min(-tail), hi: swing.hi.max(tail) }
    }
}

/// Returns the first powers of a matrix. Each needs few products: a power of two times the rest.
fn powers(one: &Matrix, count: usize) -> Vec<Matrix> {
    let mut all = vec![Matrix::identity(one.rows())];
    let mut square = one.clone();
    while all.len() < count {
        let more: Vec<_> = all.iter().take(count - all.len()).map(|power| power.times(&square)).collect();
        all.extend(more);
        square = square.times(&square);
    }
    all
}

/// Returns the same system in states whose units are powers of two, so that rows and columns have similar sizes.
fn balanced(a: &[Vec<Interval>]) -> (Matrix, Vec<f64>) {
    let size = a.len();
    let mut a = a.to_vec();
    let mut units = vec![1.0; size];
    for _ in 0..8 {
        for state in 0..size {
            let others = || (0..size).filter(|&other| other != state);
            let row: f64 = others().map(|other| a[state][other].size()).sum();
            let column: f64 = others().map(|other| a[other][state].size()).sum();
            if row == 0.0 || column == 0.0 {
                continue;
            }
            let unit = 2f64.powi(libm::log2(row / column).div_euclid(2.0) as i32);
            for (other, cells) in a.iter_mut().enumerate() {
                if other == state {
                    for (column, cell) in cells.iter_mut().enumerate() {
                        *cell = if column == state { *cell } else { cell.scaled(unit.recip()) };
                    }
                } else {
                    cells[state] = cells[state].scaled(unit);
                }
            }
            units[state] *= unit;
        }
    }
    (Matrix(a), units)
}
