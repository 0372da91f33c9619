//! How far inputs of bounded size can drive a linear system: the integrals of its impulse responses, from above.
//!
//! `x' = A x + b u`, `y = c x`: with `u` anywhere in `[lo, hi]` (0 among them) at any time, `y` stays within
//! `[lo P - hi N, hi P - lo N]`, where `P` and `N` are the integrals of the positive and of the negative part of
//! `h(t) = c e^(At) b`; no narrower range holds for all such `u`. The integrals are sums over steps: the trapezoid of the
//! part, and `step^3 / 12` times a bound of `h''`. After the last step the flow has shrunk everything by `q`, and what is
//! left is a geometric series. All in intervals rounded outwards.

use super::interval::{Interval, Matrix};

/// Steps in a row of the table; as many columns as rows at most.
const ROW: usize = 512;

/// A linear system's flow, tabulated.
pub(crate) struct Flow {
    /// `A` in balanced states.
    a: Matrix,
    /// State in units of the balanced one: powers of two.
    units: Vec<f64>,
    step_s: f64,
    /// `e^(A step k)` for `k` below [`ROW`].
    fine: Vec<Matrix>,
    /// `e^(A step ROW k)`, the last one for the end.
    coarse: Vec<Matrix>,
    /// `e^(A end)`, if time goes on beyond the end, and its norm.
    last: Option<(Matrix, f64)>,
    /// At least `e^(|A| step)`, cell by cell.
    growth: Matrix,
}

/// The integrals of the two parts of an impulse response.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Parts {
    pub positive: f64,
    pub negative: f64,
}

impl Parts {
    /// The integral of the size.
    pub fn both(self) -> f64 {
        (self.positive + self.negative).next_up()
    }

    /// The output for an input that stays within `[lo, hi]`, which is to hold 0.
    pub fn driven(self, input: Interval) -> Interval {
        let Interval { lo, hi } = input;
        let reach = |up: f64, down: f64| up.max(0.0) * self.positive + (-down).max(0.0) * self.negative;
        Interval { lo: -reach(-lo, -hi), hi: reach(hi, lo) }
            .plus(Interval { lo: -f64::MIN_POSITIVE, hi: f64::MIN_POSITIVE })
    }
}

impl Flow {
    /// The flow of `A` for all time; none if it does not settle.
    pub fn forever(a: &[Vec<Interval>]) -> Option<Self> {
        let (a, units) = balanced(a);
        let mut end_s = 0.05 / a.norm();
        for doublings in 0..40 {
            let last = a.map(|cell| cell.times(Interval::exact(end_s))).exponential();
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

    /// The flow of `A` up to a time.
    pub fn until(a: &[Vec<Interval>], end_s: f64) -> Self {
        let (a, units) = balanced(a);
        let wanted = (end_s * a.norm() / 0.05).ceil() as usize;
        let steps = wanted.next_multiple_of(ROW).clamp(ROW, 1 << 18);
        Self::tabulated(a, units, end_s, steps, None)
    }

    fn tabulated(a: Matrix, units: Vec<f64>, end_s: f64, steps: usize, last: Option<(Matrix, f64)>) -> Self {
        let step_s = if last.is_some() { end_s / steps as f64 } else { (end_s / steps as f64).next_up() };
        let one = a.map(|cell| cell.times(Interval::exact(step_s))).exponential();
        let fine = powers(&one, ROW);
        let coarse = powers(&fine[ROW - 1].times(&one), steps / ROW + 1);
        let growth = a.sizes().map(|cell| cell.times(Interval::exact(step_s))).exponential().sizes();
        Self { a, units, step_s, fine, coarse, last, growth }
    }

    /// The integrals of the parts of `c e^(At) b`.
    pub fn parts(&self, c: &[Interval], b: &[Interval]) -> Parts {
        let (c, b) = self.balanced(c, b);
        let (mut parts, _) = self.traced(&c, &b);
        let (rest, integrals) = self.rest(&c, &b, |parts, _| parts.both());
        let tail = (rest * integrals).next_up();
        parts.positive = (parts.positive + tail).next_up();
        parts.negative = (parts.negative + tail).next_up();
        parts
    }

    /// The range of `c e^(At) x` from the start on.
    pub fn swing(&self, c: &[Interval], x: &[Interval]) -> Interval {
        let (c, x) = self.balanced(c, x);
        let (_, swing) = self.traced(&c, &x);
        let (rest, sizes) = self.rest(&c, &x, |_, swing| swing.size());
        let tail = (rest * sizes).next_up();
        Interval { lo: swing.lo.min(-tail), hi: swing.hi.max(tail) }
    }

    /// In balanced states.
    fn balanced(&self, c: &[Interval], b: &[Interval]) -> (Matrix, Matrix) {
        let row: Vec<Interval> = c.iter().zip(&self.units).map(|(c, unit)| c.map_exactly(*unit)).collect();
        let column: Vec<Interval> = b.iter().zip(&self.units).map(|(b, unit)| b.map_exactly(unit.recip())).collect();
        (Matrix::row(&row), Matrix::column(&column))
    }

    /// A bound of the sum of all later states' sizes, and the sum of a figure over all directions that such a state can have.
    fn rest(&self, c: &Matrix, b: &Matrix, figure: impl Fn(Parts, Interval) -> f64) -> (f64, f64) {
        let Some((last, q)) = &self.last else { return (0.0, 0.0) };
        let size = last.times(b).0.iter().map(|cell| cell[0].size()).fold(0.0, f64::max);
        let sum = (0..self.a.rows()).fold(0.0, |sum: f64, direction| {
            let unit: Vec<_> = Matrix::identity(self.a.rows()).0.into_iter().map(|row| row[direction]).collect();
            let (parts, swing) = self.traced(c, &Matrix::column(&unit));
            (sum + figure(parts, swing)).next_up()
        });
        ((size / (1.0 - q).next_down()).next_up(), sum)
    }

    /// The parts' integrals and the range of `c e^(At) b` up to the end of the table.
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
                    let bow = step * step * curve;
                    let part = |last: f64, here: f64| step * ((last.max(0.0) + here.max(0.0)) / 2.0 + bow / 12.0);
                    parts.positive = (parts.positive + part(last.hi, here.hi).next_up().next_up()).next_up();
                    parts.negative = (parts.negative + part(-last.lo, -here.lo).next_up().next_up()).next_up();
                    let bow = (bow / 8.0).next_up();
                    swing.lo = swing.lo.min((last.lo.min(here.lo) - bow).next_down());
                    swing.hi = swing.hi.max((last.hi.max(here.hi) + bow).next_up());
                }
                before = Some((here, bend.times(size).0[0][0].hi));
            }
        }
        (parts, swing)
    }
}

/// The first powers of a matrix, each by few products: of a power of two and the rest.
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

/// The same system in states whose units are powers of two, so that rows and columns are of like size.
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
            let unit = 2f64.powi((row / column).log2().div_euclid(2.0) as i32);
            for other in 0..size {
                if other != state {
                    a[state][other] = a[state][other].map_exactly(unit.recip());
                    a[other][state] = a[other][state].map_exactly(unit);
                }
            }
            units[state] *= unit;
        }
    }
    (Matrix(a), units)
}
