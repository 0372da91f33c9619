//! The course of a motion within one edge, where modes end.

use crate::double::{Double, Doubles, Product};
use crate::guard::Guard;
use crate::leap::{Integrals, Leap, Quadrature};
use crate::linear::Trajectory;
use crate::matrix::{State, dot};

/// Terms of a course's polynomial: with (rate τ) at most 1e-3 the next one is 1e-33 of the first.
const TERMS: usize = 9;
/// Terms in double-double: the others are below 1e-14 of the first.
const WIDE: usize = 4;
/// Over this share of an edge a course is straight: with (rate τ) at most 1e-3 it bends by less than 1e-31 of what an edge
/// changes, and rounding its slope moves it by some 1e-30, as much as the terms in `f64` do.
const STRAIGHT: f64 = 1e-14;

/// The course of a motion within one edge: its Taylor polynomial, or the exact leap where an edge is long for the system.
pub(crate) struct Course<'a> {
    motion: Trajectory<'a>,
    /// `x⁽ᵏ⁾ / k!` for `k` = 1, 2 …
    wide: [Doubles; WIDE],
    rest: [State; TERMS - WIDE],
    short: bool,
}

impl<'a> Course<'a> {
    /// The course from a motion's anchor.
    #[inline(always)]
    pub(crate) fn new<P: Product>(motion: Trajectory<'a>) -> Self {
        let system = motion.system;
        let mut wide = [motion.w; WIDE];
        for k in 1..WIDE {
            wide[k] = system.derived::<P>(&wide[k - 1]).scaled::<P>(SHARES[k]);
        }
        let mut last = wide[WIDE - 1].hi;
        let rest = std::array::from_fn(|k| {
            last = system.a.map(|row| dot(&row, &last) / (WIDE + k + 1) as f64);
            last
        });
        Self { motion, wide, rest, short: system.rate * system.edge_s < 1e-3 }
    }

    /// The state `tau_s` later, at most one clock period.
    #[inline(always)]
    pub(crate) fn at<P: Product>(&self, tau_s: Double) -> Doubles {
        if !self.short {
            return self.motion.system.spread::<P>(tau_s).times::<P>(&self.motion.w, &self.motion.x);
        }
        let mut small = [0.0; 4];
        for term in self.rest.iter().rev() {
            small = std::array::from_fn(|r| (small[r] + term[r]) * tau_s.hi);
        }
        let mut change = Doubles::from(small);
        for term in self.wide.iter().rev() {
            change = change.plus(term).scaled::<P>(tau_s);
        }
        self.motion.x.plus(&change)
    }

    /// When `row · x`, which is `before` away from `limit` at the start and beyond it after an edge, passes it, and the state
    /// there: Newton's steps within a shrinking bracket, then on the double-double course.
    #[inline(always)]
    pub(crate) fn crossing<P: Product>(
        &self,
        guard: &Guard,
        limit: Double,
        before: Double,
        guess_s: f64,
    ) -> (Double, Doubles) {
        let edge_s = self.motion.system.edge_s;
        let row = guard.row();
        let polynomial: [f64; WIDE] = std::array::from_fn(|k| dot(row, &self.wide[k].hi));
        let value_and_slope = |t: f64| {
            if self.short {
                let (mut value, mut slope) = (0.0, 0.0);
                for (power, coefficient) in polynomial.iter().enumerate().rev() {
                    value = value * t + coefficient;
                    slope = slope * t + (power + 1) as f64 * coefficient;
                }
                (before.hi + t * value, slope)
            } else {
                let x = self.at::<P>(t.into());
                ((guard.exact_value::<P>(&x) - limit).hi, dot(row, &self.motion.slope(&x.hi)))
            }
        };
        let (mut low_s, mut high_s, mut t) = (0.0, edge_s, guess_s);
        for _ in 0..60 {
            let (value, slope) = value_and_slope(t);
            if value.signum() == before.sign() {
                low_s = t;
            } else {
                high_s = t;
            }
            let step = t - value / slope;
            if (step - t).abs() <= 1e-12 * edge_s {
                t = step.clamp(0.0, edge_s);
                break;
            }
            t = if step > low_s && step < high_s { step } else { 0.5 * (low_s + high_s) };
        }
        // Each step doubles the digits that are right; a limit only grazed has none to gain.
        let mut exact = Double::from(t);
        let mut x = self.at::<P>(exact);
        for _ in 0..3 {
            let slope = self.motion.slope(&x.hi);
            let step = (guard.exact_value::<P>(&x) - limit).hi / dot(row, &slope);
            let next = exact - step.into();
            if step.is_nan() || next.sign() < 0.0 || next.hi >= edge_s {
                break;
            }
            exact = next;
            if self.short && step.abs() <= STRAIGHT * edge_s {
                x = x.plus(&slope.map(|slope| -step * slope).into());
                break;
            }
            x = self.at::<P>(exact);
            if step.abs() <= 1e-10 * edge_s {
                break;
            }
        }
        (exact, x)
    }

    /// The integrals over `tau_s`, at whose end the state is `end`.
    #[inline(always)]
    pub(crate) fn integrals(&self, tau_s: f64, end: &State) -> Integrals {
        let (x, w) = (&self.motion.x.hi, &self.motion.w.hi);
        if !self.short {
            let mut done = Integrals::default();
            Quadrature::of(&Leap::of(&self.motion.system.a, tau_s)).add(x, w, &mut done);
            return done;
        }
        // The trapezoid with its ends' slopes: error of order (rate τ)^4.
        let after = self.motion.slope(end);
        let (half, twelfth) = (0.5 * tau_s, tau_s * tau_s / 12.0);
        Integrals {
            states: std::array::from_fn(|k| half * (x[k] + end[k]) + twelfth * (w[k] - after[k])),
            squares: std::array::from_fn(|k| {
                half * (x[k] * x[k] + end[k] * end[k]) + 2.0 * twelfth * (x[k] * w[k] - end[k] * after[k])
            }),
        }
    }
}

/// 1/k in double-double, by `k - 1`; the lows of a third is 2⁻⁵⁴ · ⅓ rounded, as 1/3 = hi + 2⁻⁵⁴/3.
const SHARES: [Double; WIDE] = [
    Double { hi: 1.0, lo: 0.0 },
    Double { hi: 0.5, lo: 0.0 },
    Double { hi: 1.0 / 3.0, lo: f64::EPSILON / 4.0 / 3.0 },
    Double { hi: 0.25, lo: 0.0 },
];
