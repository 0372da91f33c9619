//! The first edge at which a linear function of the state leaves a band, found without stepping and without missing one.
//!
//! For `g = c·x` every derivative is linear in the slope `w = x'` as well, and bounded over an interval through
//! `|c Aᵏ| · max|e^{At}| · |w|`. So the second derivative is known between its values at the ends and a bound of its own
//! curvature, and with it how far `g` can sag below or bulge above its chord: an interval whose ends lie in the band and
//! whose chord stays clear of the limits holds no exit. A function that leaves by a limit toward which it bends, or to which
//! it falls all the while, leaves once, and that edge is found by a few secant steps. What neither settles is halved, down
//! to single edges.

use crate::linear::Trajectory;
use crate::matrix::{State, dot, row_times};
use crate::{Linear, Matrix};

/// Values from `low`, inclusive, to `high`; either may be infinite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Band {
    /// Left when the value is below.
    pub low: f64,
    /// Left when the value is above, or at it if `open`.
    pub high: f64,
    /// Whether `high` itself is outside.
    pub open: bool,
}

impl Band {
    /// Whether a value is outside.
    #[inline(always)]
    #[must_use]
    pub fn left_by(&self, value: f64) -> bool {
        value < self.low || if self.open { value >= self.high } else { value > self.high }
    }

    /// Sizes of the finite limits: what rounding scales with.
    #[inline(always)]
    fn size(&self) -> f64 {
        let finite = |limit: f64| if limit.is_finite() { limit.abs() } else { 0.0 };
        finite(self.low) + finite(self.high)
    }
}

/// A state of a motion and its slope, at an edge.
#[derive(Clone, Copy)]
pub struct Point {
    /// Edges since the anchor.
    pub edge: u64,
    /// The state.
    pub x: State,
    /// Its slope.
    pub w: State,
}

impl Point {
    /// The point of a motion at an edge.
    #[inline]
    #[must_use]
    pub fn of(motion: &Trajectory, edge: u64) -> Self {
        let x = motion.at(edge);
        Self { edge, x, w: motion.slope(&x) }
    }
}

/// A linear function of the state, with the bounds of its derivatives for one system.
pub struct Guard {
    row: State,
    /// Index when the row picks one state: then the value is exact.
    pick: Option<usize>,
    /// Coefficients of the second derivative in the slope.
    bend: State,
    /// Bounds of the third and fourth derivatives' coefficients, for each dyadic length.
    third: Vec<State>,
    fourth: Vec<State>,
}

/// Distance to a limit at the start, its slope there, distance at the end, bounds of the second derivative.
type Side = (f64, f64, f64, f64, f64);

enum Verdict {
    Clear,
    Split(u64),
    At(u64),
}

fn sizes(row: &State) -> State {
    row.map(f64::abs)
}

impl Guard {
    /// The function `row · x` on a system.
    #[must_use]
    pub fn new(row: State, system: &Linear) -> Self {
        let a: &Matrix = system.matrix();
        let bend = row_times(&row, a);
        let third = row_times(&bend, a);
        let fourth = row_times(&third, a);
        let bound = |r: &State| (0..system.dyadic()).map(|j| row_times(&sizes(r), system.bound(j))).collect();
        let used: Vec<usize> = (0..4).filter(|&k| row[k] != 0.0).collect();
        Self {
            row,
            pick: (used.len() == 1 && row[used[0]] == 1.0).then(|| used[0]),
            bend,
            third: bound(&third),
            fourth: bound(&fourth),
        }
    }

    /// The function's coefficients.
    #[must_use]
    pub fn row(&self) -> &State {
        &self.row
    }

    /// The value at a state.
    #[inline(always)]
    #[must_use]
    pub fn value(&self, x: &State) -> f64 {
        match self.pick {
            Some(index) => x[index],
            None => dot(&self.row, x),
        }
    }

    /// The first edge after `from`, up to and including that of `to`, at which the value is outside the band, given that it
    /// is not at `from`.
    #[inline]
    #[must_use]
    pub fn first(&self, motion: &Trajectory, band: &Band, from: &Point, to: &Point) -> Option<u64> {
        let left = band.left_by(self.value(&to.x));
        if to.edge - from.edge <= 1 {
            return (left && to.edge > from.edge).then_some(to.edge);
        }
        match self.judge(motion, band, from, to, left) {
            Verdict::Clear => None,
            Verdict::At(edge) => Some(edge),
            Verdict::Split(middle) => self.divide(motion, band, from, middle, to),
        }
    }

    #[cold]
    fn divide(&self, motion: &Trajectory, band: &Band, from: &Point, middle: u64, to: &Point) -> Option<u64> {
        let middle = Point::of(motion, middle);
        self.first(motion, band, from, &middle).or_else(|| self.first(motion, band, &middle, to))
    }

    #[inline]
    fn judge(&self, motion: &Trajectory, band: &Band, from: &Point, to: &Point, left: bool) -> Verdict {
        let edges = to.edge - from.edge;
        let dyadic = (u64::BITS - (edges - 1).leading_zeros()) as usize;
        if dyadic >= self.third.len() {
            return Verdict::Split(from.edge + edges / 2);
        }
        let (va, vb) = (self.value(&from.x), self.value(&to.x));
        let edge_s = motion.system().edge_s();
        let length_s = edges as f64 * edge_s;
        let sag = length_s * length_s * 0.125;
        let speeds = sizes(&from.w);
        // The second derivative lies between these.
        let (ca, cb) = (dot(&self.bend, &from.w), dot(&self.bend, &to.w));
        let spread = sag * dot(&self.fourth[dyadic], &speeds);
        let (least, most) = (ca.min(cb) - spread, ca.max(cb) + spread);
        let (sa, sb) = (dot(&self.row, &from.w), dot(&self.row, &to.w));
        // Rounding of values near a limit, and of the states on the way.
        let noise = 16.0 * f64::EPSILON * (va.abs() + vb.abs() + band.size());
        // Distances to a limit: `start`, growing by `inward` a second there, to `end`; `pull` bends them toward it.
        let clear = |start: f64, inward: f64, end: f64, pull: f64| {
            end > noise
                && (start > noise || inward * edge_s > 4.0 * noise)
                && (pull <= 0.0 || start.max(0.0).sqrt() + end.sqrt() > (4.0 * sag * pull + noise).sqrt())
        };
        // For each limit: distance and its slope at the start, distance at the end, bounds of its second derivative.
        let low = (va - band.low, sa, vb - band.low, least, most);
        let high = (band.high - va, -sa, band.high - vb, -most, -least);
        let is_clear = |side: Side| side.0 == f64::INFINITY || clear(side.0, side.1, side.2, side.4);
        // Halve where it turns, if it does.
        let share = if sa * sb < 0.0 { (sa / (sa - sb)).clamp(0.1, 0.9) } else { 0.5 };
        let split = Verdict::Split(from.edge + ((edges as f64 * share) as u64).clamp(1, edges - 1));
        if !left {
            return if is_clear(low) && is_clear(high) { Verdict::Clear } else { split };
        }
        let (ahead, behind, rising) = if vb < band.low { (low, high, -1.0) } else { (high, low, 1.0) };
        let (start, _, end, least, most) = ahead;
        if !is_clear(behind) {
            return split;
        }
        // A function that bends one way only, on either side of the limit at the ends, passes it once; so does one that
        // approaches it all the while. Each must do so by more than the noise an edge.
        let step = 4.0 * noise * edges as f64;
        let concave = most <= 0.0 && start - end > step;
        let convex = least >= 0.0 && start > noise && end < -step;
        let turn = sag * dot(&self.third[dyadic], &speeds);
        let approaches = || ((rising * sa).min(rising * sb) - turn) * edge_s > 4.0 * noise;
        if concave || convex || approaches() { Verdict::At(self.unique(motion, band, from, to, rising)) } else { split }
    }

    /// The only exit between `from` (inside) and `to` (outside) of a function that keeps its direction.
    fn unique(&self, motion: &Trajectory, band: &Band, from: &Point, to: &Point, rising: f64) -> u64 {
        let limit = if rising > 0.0 { band.high } else { band.low };
        let edge_s = motion.system().edge_s();
        let (mut a, mut b) = (from.edge, to.edge);
        let (ga, gb) = (self.value(&from.x) - limit, self.value(&to.x) - limit);
        // The Hermite cubic through both ends says where to look first; from the steeper end, where Newton's steps do not
        // overshoot a function that bends one way.
        let span = (b - a) as f64;
        let length_s = span * edge_s;
        let (sa, sb) = (dot(&self.row, &from.w) * length_s, dot(&self.row, &to.w) * length_s);
        let (c2, c3) = (3.0 * (gb - ga) - 2.0 * sa - sb, 2.0 * (ga - gb) + sa + sb);
        let mut share = f64::from(u8::from(sb.abs() > sa.abs()));
        for _ in 0..4 {
            let value = ga + share * (sa + share * (c2 + share * c3));
            let slope = sa + share * (2.0 * c2 + 3.0 * c3 * share);
            share -= value / slope;
        }
        let mut aim = a as f64 + span * share;
        let mut tries = 0;
        while b - a > 1 {
            // The first edge at or after the estimate, then the one before it: two good guesses close the bracket.
            if !(aim > a as f64 && aim <= b as f64) {
                aim = 0.5 * (a + b) as f64;
            }
            let at = aim.ceil() as u64;
            let guess = if at == b { b - 1 } else { at };
            let x = motion.at(guess);
            let value = self.value(&x);
            if band.left_by(value) {
                b = guess;
            } else {
                a = guess;
            }
            tries += 1;
            aim = if tries < 12 {
                guess as f64 - (value - limit) / (dot(&self.row, &motion.slope(&x)) * edge_s)
            } else {
                0.5 * (a + b) as f64
            };
        }
        b
    }
}
