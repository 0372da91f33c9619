//! The first edge at which a linear function of the state leaves a band, found without stepping and without missing one.
//!
//! For `g = c·x` the second derivative is `c A e^{At} w₀`, bounded over an interval by `|cA| · max|e^{At}| · |w₀|`. A chord
//! can therefore be trusted up to `T²/8` times that bound: an interval whose ends lie in the band, and whose chord stays
//! further from its limits than the bound, holds no exit. The slope is judged in the same way; where it keeps its sign the
//! exit is unique and is found by secant steps. What neither settles is halved, down to single edges.

use crate::linear::{State, Trajectory, dot, row_times};
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
    curvature: Vec<State>,
    slope_curvature: Vec<State>,
}

enum Verdict {
    Clear,
    Split,
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
        let first = row_times(&row, a);
        let second = row_times(&first, a);
        let bound =
            |r: &State| (0..system.dyadic()).map(|j| row_times(&sizes(r), system.bound(j))).collect();
        let used: Vec<usize> = (0..4).filter(|&k| row[k] != 0.0).collect();
        Self {
            row,
            pick: (used.len() == 1 && row[used[0]] == 1.0).then(|| used[0]),
            curvature: bound(&first),
            slope_curvature: bound(&second),
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
            Verdict::Split => self.halve(motion, band, from, to),
        }
    }

    #[cold]
    fn halve(&self, motion: &Trajectory, band: &Band, from: &Point, to: &Point) -> Option<u64> {
        let middle = Point::of(motion, from.edge + (to.edge - from.edge) / 2);
        self.first(motion, band, from, &middle).or_else(|| self.first(motion, band, &middle, to))
    }

    #[inline]
    fn judge(&self, motion: &Trajectory, band: &Band, from: &Point, to: &Point, left: bool) -> Verdict {
        let edges = to.edge - from.edge;
        let dyadic = (u64::BITS - (edges - 1).leading_zeros()) as usize;
        if dyadic >= self.curvature.len() {
            return Verdict::Split;
        }
        let (va, vb) = (self.value(&from.x), self.value(&to.x));
        let length = edges as f64 * motion.system().edge_s();
        let sag = length * length * 0.125;
        let speeds = sizes(&from.w);
        // Rounding of values near a limit, and of the states on the way.
        let noise = 16.0 * f64::EPSILON * (va.abs() + vb.abs() + band.size());
        if !left {
            let bulge = sag * dot(&self.curvature[dyadic], &speeds) + noise;
            if va.max(vb) + bulge < band.high && va.min(vb) - bulge > band.low {
                return Verdict::Clear;
            }
        }
        let (sa, sb) = (dot(&self.row, &from.w), dot(&self.row, &to.w));
        let bend = sag * dot(&self.slope_curvature[dyadic], &speeds);
        // The direction that it keeps all the while, by more than the noise each edge.
        let edge_s = motion.system().edge_s();
        let rising = if (sa.min(sb) - bend) * edge_s > 4.0 * noise {
            1.0
        } else if (sa.max(sb) + bend) * edge_s < -4.0 * noise {
            -1.0
        } else {
            return Verdict::Split;
        };
        // The limit behind is left for good, the one ahead is passed once at most, and then `left` at the end.
        if left { Verdict::At(self.unique(motion, band, from, to, rising)) } else { Verdict::Clear }
    }

    /// The only exit between `from` (inside) and `to` (outside) of a function that keeps its direction.
    fn unique(&self, motion: &Trajectory, band: &Band, from: &Point, to: &Point, rising: f64) -> u64 {
        let limit = if rising > 0.0 { band.high } else { band.low };
        let (mut a, mut b) = (from.edge, to.edge);
        let (mut ga, mut gb) = (self.value(&from.x) - limit, self.value(&to.x) - limit);
        // The Hermite cubic through both ends says where to look first.
        let span = (b - a) as f64;
        let length_s = span * motion.system().edge_s();
        let (sa, sb) = (dot(&self.row, &from.w) * length_s, dot(&self.row, &to.w) * length_s);
        let (c2, c3) = (3.0 * (gb - ga) - 2.0 * sa - sb, 2.0 * (ga - gb) + sa + sb);
        let mut share = ga / (ga - gb);
        for _ in 0..3 {
            let value = ga + share * (sa + share * (c2 + share * c3));
            let slope = sa + share * (2.0 * c2 + 3.0 * c3 * share);
            share -= value / slope;
        }
        let mut aim = a as f64 + span * share;
        let mut tries = 0;
        while b - a > 1 {
            // Just beyond the estimate, then just before it: two good guesses close the bracket.
            let guess = if tries == 1 && b == aim as u64 + 1 { b - 1 } else { aim as u64 + 1 };
            let guess = guess.clamp(a + 1, b - 1);
            let value = self.value(&motion.at(guess));
            if band.left_by(value) {
                (b, gb) = (guess, value - limit);
            } else {
                (a, ga) = (guess, value - limit);
            }
            tries += 1;
            if tries > 1 {
                let share = if tries < 8 { ga / (ga - gb) } else { 0.5 };
                aim = a as f64 + (b - a) as f64 * share - 0.5 * f64::from(tries & 1);
            }
        }
        b
    }
}
