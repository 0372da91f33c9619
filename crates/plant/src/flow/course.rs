//! The course of a motion within the one edge in which a mode ends.

use crate::flow::double::{Double, Doubles, Product, versions};
use crate::flow::guard::Guard;
use crate::flow::lanes::{Count, Size};
use crate::flow::leap::{Integrals, Leap, Quadrature, Square};
use crate::flow::linear::Trajectory;
use crate::flow::matrix::{INTENT, State, dot, plus};

/// A course shorter than this share of an edge counts as straight. With (rate τ) at most 1e-3 it bends by less than
/// 1e-31 of the change over an edge, and the rounding of its slope moves it by about 1e-30, as much as the terms in
/// `f64` do.
const STRAIGHT: f64 = 1e-14;

/// A motion's Taylor polynomial: `x⁽ᵏ⁾ / k!` for `k` = 1, 2 …, the first terms in double-double.
struct Series<const N: usize, const WIDE: usize, const REST: usize> {
    wide: [Doubles<N>; WIDE],
    rest: [State<N>; REST],
}

impl<const N: usize, const WIDE: usize, const REST: usize> Series<N, WIDE, REST>
where
    Count<N>: Size<N>,
{
    #[inline(always)]
    fn new<P: Product>(motion: &Trajectory<N>) -> Self {
        let system = motion.system;
        let mut wide = [motion.w; WIDE];
        wide[1] = system.derived::<P>(&wide[0]).scaled::<P>(SHARES[1]);
        debug_assert!(N > 4 || wide[1].hi[INTENT] == 0.0);
        for k in 2..WIDE {
            // The hand's intention moves at a constant speed: its second derivative is 0.
            wide[k] = system.wide.times_three::<P>(&wide[k - 1]).scaled::<P>(SHARES[k]);
        }
        let (mut last, mut rest) = (wide[WIDE - 1].hi, [[0.0; N]; REST]);
        for (k, term) in rest.iter_mut().enumerate() {
            last = system.wide.hi.times(&last).map(|change| change / (WIDE + k + 1) as f64);
            *term = last;
        }
        Self { wide, rest }
    }

    /// Returns the change of the state over a time.
    #[inline(always)]
    fn change<P: Product>(&self, tau_s: Double) -> Doubles<N> {
        let mut small = [0.0; N];
        for term in self.rest.iter().rev() {
            small = std::array::from_fn(|r| (small[r] + term[r]) * tau_s.hi);
        }
        let mut change = Doubles::from(small);
        for term in self.wide.iter().rev() {
            change = change.plus::<P>(term).scaled::<P>(tau_s);
        }
        change
    }

    /// Returns the change of the state over a time, in `f64`.
    #[inline(always)]
    fn rounded(&self, tau_s: f64) -> State<N> {
        let terms = self.wide.iter().map(|term| &term.hi).chain(&self.rest);
        terms.rev().fold([0.0; N], |sum, term| std::array::from_fn(|r| (sum[r] + term[r]) * tau_s))
    }

    /// Returns a function of time for value and slope of `row · x` from a given value, by the rounded double-double
    /// terms alone.
    #[inline(always)]
    fn along(&self, row: &State<N>, before: f64) -> impl Fn(f64) -> (f64, f64) {
        let polynomial = self.wide.map(|term| dot(row, &term.hi));
        move |t| {
            let (mut value, mut slope) = (0.0, 0.0);
            for (power, coefficient) in polynomial.iter().enumerate().rev() {
                value = value * t + coefficient;
                slope = slope * t + (power + 1) as f64 * coefficient;
            }
            (before + t * value, slope)
        }
    }
}

/// The polynomial, chosen by (rate τ) of one edge.
enum Terms<const N: usize> {
    /// (rate τ) at most 1e-3: the first omitted term is 1e-33 of the first term, and the first term in `f64` is 1e-14
    /// of it.
    Short(Series<N, 4, 5>),
    /// (rate τ) at most a quarter: these shares are 2e-38 and 2e-19.
    Long(Box<Series<N, 13, 10>>),
    /// (rate τ) beyond a quarter: no polynomial, but the exact leap.
    None,
}

/// The course of a motion within one edge: its Taylor polynomial, or the exact leap if an edge is long for the system.
pub(crate) struct Course<'a, const N: usize = 4> {
    motion: Trajectory<'a, N>,
    terms: Terms<N>,
}

impl<'a, const N: usize> Course<'a, N>
where
    Count<N>: Size<N>,
{
    /// Creates the course from a motion's anchor. Of more than four states it is made apart, as
    /// [`at`](Self::at) is found apart: inlined at each place, both are most of a large system's code.
    #[inline(always)]
    pub(crate) fn new<P: Product>(motion: Trajectory<'a, N>) -> Self {
        if N > 4 { Self::made(motion) } else { Self::new_here::<P>(motion) }
    }

    versions! {
        fn made[made_fused, made_native, new_here](motion: Trajectory<'a, N>) -> Self
    }

    #[inline(always)]
    fn new_here<P: Product>(motion: Trajectory<'a, N>) -> Self {
        let system = motion.system;
        let size = system.rate * system.edge_s;
        let terms = if size < 1e-3 {
            Terms::Short(Series::new::<P>(&motion))
        } else if size < 0.25 {
            Terms::Long(Box::new(Series::new::<P>(&motion)))
        } else {
            Terms::None
        };
        Self { motion, terms }
    }

    /// Returns the state `tau_s` later, at most one clock period.
    #[inline(always)]
    pub(crate) fn at<P: Product>(&self, tau_s: Double) -> Doubles<N> {
        if N > 4 { self.found(tau_s) } else { self.at_here::<P>(tau_s) }
    }

    versions! {
        fn found[found_fused, found_native, at_here](self: &Self, tau_s: Double) -> Doubles<N>
    }

    #[inline(always)]
    fn at_here<P: Product>(&self, tau_s: Double) -> Doubles<N> {
        match &self.terms {
            Terms::Short(series) => self.motion.x.plus::<P>(&series.change::<P>(tau_s)),
            Terms::Long(series) => self.motion.x.plus::<P>(&series.change::<P>(tau_s)),
            Terms::None => self.motion.system.spread(tau_s).times::<P>(&self.motion.w, &self.motion.x),
        }
    }

    /// Returns whether a function that is at its limit at the start moves outward there: up if `outward` is 1, down if
    /// it is -1.
    #[inline(always)]
    pub(crate) fn leaves(&self, guard: &Guard<N>, outward: f64) -> bool {
        outward * guard.value(&self.motion.w.hi) >= 0.0
    }

    /// Returns the time within `left_s` at which a value passes zero to the side of `outward`, by Newton's steps in a
    /// shrinking bracket.
    #[inline(always)]
    fn newton(&self, outward: f64, (guess_s, left_s): (f64, f64), value_and_slope: impl Fn(f64) -> (f64, f64)) -> f64 {
        let edge_s = self.motion.system.edge_s;
        let (mut low_s, mut high_s, mut t) = (0.0, left_s, guess_s);
        for _ in 0..60 {
            let (value, slope) = value_and_slope(t);
            if value.signum() == -outward {
                low_s = t;
            } else {
                high_s = t;
            }
            let step = t - value / slope;
            if (step - t).abs() <= 1e-12 * edge_s {
                return step.clamp(0.0, left_s);
            }
            t = if step > low_s && step < high_s { step } else { 0.5 * (low_s + high_s) };
        }
        t
    }

    /// Returns the time at which a function passes `limit` to the side of `outward`, and the state there. At the start
    /// it is `before` away from the limit, inside or at it, and after `left_s` it is beyond it by `after`. Found by
    /// Newton's steps in a shrinking bracket, then on the double-double course.
    #[inline(always)]
    pub(crate) fn crossing<P: Product>(
        &self,
        guard: &Guard<N>,
        limit: Double,
        (before, after, outward): (f64, f64, f64),
        left_s: f64,
    ) -> (Double, Doubles<N>) {
        let row = guard.row();
        // From its limit a function moves inward first: the step to begin with is from the end.
        let guess_s = if before == 0.0 { left_s } else { left_s * before / (before - after) };
        let times = (guess_s, left_s);
        let t = match &self.terms {
            Terms::Short(series) => self.newton(outward, times, series.along(row, before)),
            Terms::Long(series) => self.newton(outward, times, series.along(row, before)),
            Terms::None => self.newton(outward, times, |t| {
                let x = self.at::<P>(t.into());
                ((guard.exact_value::<P>(&x) - limit).hi, dot(row, &self.motion.slope(&x.hi)))
            }),
        };
        let edge_s = self.motion.system.edge_s;
        // Each step doubles the number of right digits, unless the motion only grazes the limit.
        let mut exact = Double::from(t);
        let mut x = self.at::<P>(exact);
        for _ in 0..3 {
            let slope = self.motion.slope(&x.hi);
            let step = (guard.exact_value::<P>(&x) - limit).hi / dot(row, &slope);
            let next = exact - step.into();
            if step.is_nan() || next.sign() < 0.0 || next.hi >= left_s {
                break;
            }
            exact = next;
            if matches!(self.terms, Terms::Short(_)) && step.abs() <= STRAIGHT * edge_s {
                x = x.plus::<P>(&slope.map(|slope| -step * slope).into());
                break;
            }
            x = self.at::<P>(exact);
            if step.abs() <= 1e-10 * edge_s {
                break;
            }
        }
        (exact, x)
    }

    /// Returns the integrals over `tau_s`, at whose end the state is `end`.
    #[inline(always)]
    pub(crate) fn integrals(&self, tau_s: f64, end: &State<N>) -> Integrals<State<N>> {
        let squares = &self.motion.system.squares;
        let (x, w) = (&self.motion.x.hi, &self.motion.w.hi);
        match &self.terms {
            Terms::Short(_) => {}
            Terms::Long(series) => return gauss(squares, x, tau_s, |t| series.rounded(t)),
            Terms::None => {
                let mut done = Integrals { states: [0.0; N], squares: [0.0; 4] };
                Quadrature::of(&Leap::of(&self.motion.system.a, squares, tau_s)).add(squares, x, w, &mut done);
                return done;
            }
        }
        // The trapezoid rule with the slopes at its ends: error of order (rate τ)^4.
        let after = self.motion.slope(end);
        let (half, twelfth) = (0.5 * tau_s, tau_s * tau_s / 12.0);
        Integrals {
            states: std::array::from_fn(|k| half * (x[k] + end[k]) + twelfth * (w[k] - after[k])),
            squares: {
                let form = |x: &State<N>, y: &State<N>| Square::forms(squares, x, y);
                let (values, slopes) = ([form(x, x), form(end, end)], [form(x, w), form(end, &after)]);
                std::array::from_fn(|k| {
                    half * (values[0][k] + values[1][k]) + 2.0 * twelfth * (slopes[0][k] - slopes[1][k])
                })
            },
        }
    }
}

/// Returns integrals over a time by Gauss's five points, for a motion from `x` with the given change. With (rate τ) at
/// most a quarter they equal the exact leap's to 2e-13.
fn gauss<const N: usize>(
    squares: &[Square<N>],
    x: &State<N>,
    tau_s: f64,
    change: impl Fn(f64) -> State<N>,
) -> Integrals<State<N>> {
    // Nodes and weights on [-1, 1], Abramowitz and Stegun, table 25.4.
    const POINTS: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let mut done = Integrals { states: [0.0; N], squares: [0.0; 4] };
    for (node, weight) in POINTS {
        let change = change(0.5 * tau_s * (1.0 + node));
        let share_s = 0.5 * tau_s * weight;
        let there = plus(x, &change);
        for (sum, there) in done.states.iter_mut().zip(&there) {
            *sum += share_s * there;
        }
        let forms = Square::forms(squares, &there.map(|x| share_s * x), &there);
        done.squares = plus(&done.squares, &forms);
    }
    done
}

/// 1/k in double-double, at index `k - 1`.
const SHARES: [Double; 13] = {
    let mut shares = [Double { hi: 1.0, lo: 0.0 }; 13];
    let mut k = 1;
    while k < 13 {
        let divisor = (k + 1) as f64;
        let hi = 1.0 / divisor;
        // Exact: the upper and the lower half of the digits, each times a small integer.
        let top = f64::from_bits(hi.to_bits() & !0x7ff_ffff);
        shares[k] = Double { hi, lo: ((1.0 - divisor * top) - divisor * (hi - top)) / divisor };
        k += 1;
    }
    shares
};

#[cfg(test)]
mod tests {
    use super::{Course, Terms};
    use crate::flow::double::{Double, Doubles, Halves};
    use crate::flow::guard::Guard;
    use crate::flow::leap::{Integrals, Leap, Quadrature};
    use crate::flow::linear::{Linear, Trajectory};
    use crate::flow::matrix::{CURRENT, Matrix, SPEED, State, rate};

    /// A motor held by a hand, whose current decays in 0.1 ms.
    const A: Matrix = [[-1e4, -60.0, 0.0, 0.0], [2e3, -5.0, -3e5, 3e5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]];
    const X: State = [0.7, -3.1, 0.02, 0.05];
    const F: State = [9e3, 4.0, 0.0, 1.5];

    /// Systems with these lengths of an edge: from the shortest to the longest for which a polynomial is used, and one
    /// beyond.
    fn systems() -> [(f64, Linear); 5] {
        [5e-4, 2e-3, 0.02, 0.249, 0.7].map(|size| (size, Linear::new(A, size / rate(&A), 1 << 20)))
    }

    fn course(system: &Linear) -> Course<'_> {
        Course::new::<Halves>(Trajectory::exact_with::<Halves>(system, X.into(), F.into()))
    }

    #[test]
    fn a_course_is_the_exact_leap_to_thirty_digits() {
        for (size, system) in &systems() {
            let course = course(system);
            assert_eq!(matches!(course.terms, Terms::None), *size > 0.25);
            for share in [0.013, 0.37, 1.0] {
                let tau_s = Double::from(share * system.edge_s);
                let exact = system.spread(tau_s).times::<Halves>(&course.motion.w, &course.motion.x);
                let off = course.at::<Halves>(tau_s);
                for lane in 0..4 {
                    let apart = (off.lane(lane) - exact.lane(lane)).hi.abs();
                    let scale = exact.lane(lane).hi.abs().max(course.motion.w.hi[lane].abs() * tau_s.hi);
                    assert!(apart <= 4e-30 * scale, "{size} {share} lane {lane}: {apart:e} of {scale:e}");
                }
            }
        }
    }

    #[test]
    fn a_course_has_the_integrals_of_the_exact_leap() {
        for (size, system) in &systems() {
            let course = course(system);
            for share in [0.2, 1.0] {
                let tau_s = share * system.edge_s;
                let mut exact = Integrals::default();
                let squares = &system.squares;
                Quadrature::of(&Leap::of(system.matrix(), squares, tau_s)).add(
                    squares,
                    &X,
                    &course.motion.w.hi,
                    &mut exact,
                );
                let found = course.integrals(tau_s, &course.at::<Halves>(tau_s.into()).hi);
                let same = |found: f64, exact: f64, what: &str| {
                    assert!(
                        (found - exact).abs() <= 2e-13 * exact.abs(),
                        "{size} {share} {what}: {found:e}, not {exact:e}"
                    );
                };
                (0..4).for_each(|lane| same(found.states[lane], exact.states[lane], "state"));
                for lane in [CURRENT, SPEED] {
                    same(found.squares[lane], exact.squares[lane], "square");
                }
            }
        }
    }

    #[test]
    fn a_crossing_lies_on_the_limit() {
        let row: State = [0.3, 1.0, 0.0, 0.0];
        for (size, system) in &systems() {
            let (course, guard) = (course(system), Guard::new(row, system));
            let value = |x: &Doubles| guard.exact_value::<Halves>(x);
            let (begun, ended) = (value(&X.into()), value(&course.at::<Halves>(system.edge_s.into())));
            // The value after a third of the way.
            let limit = Double::from(begun.hi + (ended.hi - begun.hi) / 3.0);
            let [before, after] = [begun, ended].map(|value| (value - limit).hi);
            let sides = (before, after, after.signum());
            let (tau_s, there) = course.crossing::<Halves>(&guard, limit, sides, system.edge_s);
            assert!(tau_s.hi > 0.0 && tau_s.hi < system.edge_s);
            let off = (value(&there) - limit).hi.abs();
            assert!(off <= 1e-29 * (ended.hi - begun.hi).abs().max(begun.hi.abs()), "{size}: {off:e}");
        }
    }
}
