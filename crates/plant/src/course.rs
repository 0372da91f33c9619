//! The course of a motion within one edge, where modes end.

use crate::leap::{Integrals, Leap};
use crate::linear::Trajectory;
use crate::matrix::{ANGLE, CURRENT, Columns, SPEED, State, dot, plus};

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
