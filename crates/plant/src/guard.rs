//! The first edge at which a linear function of the state passes a threshold, found without stepping and without missing
//! one.
//!
//! For `g = c·x` the second derivative is `c A e^{At} w₀`, bounded over an interval by `|cA| · max|e^{At}| · |w₀|`. A chord
//! can therefore be trusted up to `T²/8` times that bound: an interval whose ends are on the near side, and whose chord
//! stays further from the threshold than the bound, holds no crossing. The slope is judged in the same way; where it keeps
//! its sign the crossing is unique and is found by secant steps. What neither settles is halved, down to single edges.

use crate::linear::{State, Trajectory, dot, row_times};
use crate::{Linear, Matrix};

/// On which side of the threshold a guard is passed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sense {
    /// `g >= threshold`.
    AtLeast,
    /// `g > threshold`.
    Above,
    /// `g < threshold`.
    Below,
}

/// A linear function of the state, with the bounds of its derivatives for one system.
pub struct Guard {
    row: State,
    /// Index when the row picks one state: then the value is exact.
    pick: Option<usize>,
    curvature: Vec<State>,
    slope_curvature: Vec<State>,
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
        let bound = |r: &State| {
            (0..system.dyadic())
                .map(|j| row_times(&sizes(r), system.bound(j)))
                .collect()
        };
        let ones: Vec<usize> = (0..4).filter(|&k| row[k] != 0.0).collect();
        Self {
            row,
            pick: (ones.len() == 1 && row[ones[0]] == 1.0).then(|| ones[0]),
            curvature: bound(&first),
            slope_curvature: bound(&second),
        }
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

    /// Whether the guard is passed at a state.
    #[inline(always)]
    #[must_use]
    pub fn passed(&self, x: &State, threshold: f64, sense: Sense) -> bool {
        let value = self.value(x);
        match sense {
            Sense::AtLeast => value >= threshold,
            Sense::Above => value > threshold,
            Sense::Below => value < threshold,
        }
    }

    /// The first edge after `from`, up to and including `to`, at which the guard is passed, given that it is not at `from`.
    /// `start` and `end` are the states there.
    #[must_use]
    pub fn first(
        &self,
        motion: &Trajectory,
        threshold: f64,
        sense: Sense,
        (from, start): (u64, &State),
        (to, end): (u64, &State),
    ) -> Option<u64> {
        let passed = self.passed(end, threshold, sense);
        if to - from <= 1 {
            return (passed && to > from).then_some(to);
        }
        match self.judge(motion, threshold, sense, (from, start), (to, end), passed) {
            Verdict::Clear => None,
            Verdict::At(edge) => Some(edge),
            Verdict::Split(middle) => {
                let between = motion.at(middle);
                self.first(motion, threshold, sense, (from, start), (middle, &between))
                    .or_else(|| self.first(motion, threshold, sense, (middle, &between), (to, end)))
            }
        }
    }

    #[inline]
    fn judge(
        &self,
        motion: &Trajectory,
        threshold: f64,
        sense: Sense,
        (a, xa): (u64, &State),
        (b, xb): (u64, &State),
        passed: bool,
    ) -> Verdict {
        let edges = b - a;
        let dyadic = (u64::BITS - (edges - 1).leading_zeros()) as usize;
        let middle = Verdict::Split(a + edges / 2);
        if dyadic >= self.curvature.len() {
            return middle;
        }
        // Toward the threshold is positive from here on.
        let toward = if sense == Sense::Below { -1.0 } else { 1.0 };
        let wa = motion.slope(xa);
        let wb = motion.slope(xb);
        let (va, vb) = (self.value(xa), self.value(xb));
        let (ga, gb) = (toward * (va - threshold), toward * (vb - threshold));
        let length = edges as f64 * motion.system().edge_s();
        let sag = length * length * 0.125;
        let speeds = sizes(&wa);
        // Rounding of values near the threshold, and of the states on the way.
        let noise = 16.0 * f64::EPSILON * (va.abs() + vb.abs() + threshold.abs());
        if !passed && ga.max(gb) + sag * dot(&self.curvature[dyadic], &speeds) < -noise {
            return Verdict::Clear;
        }
        let (sa, sb) = (toward * dot(&self.row, &wa), toward * dot(&self.row, &wb));
        let bend = sag * dot(&self.slope_curvature[dyadic], &speeds);
        let least = sa.min(sb) - bend;
        let most = sa.max(sb) + bend;
        let one_edge = motion.system().edge_s();
        if !passed && most < 0.0 && ga <= 0.0 && (ga < -noise || most * one_edge < -noise) {
            // It moves away all the while, and one edge takes it out of the noise.
            return Verdict::Clear;
        }
        if least * one_edge <= 4.0 * noise {
            return middle;
        }
        // It approaches all the while, each edge by more than the noise: at most one crossing.
        if !passed {
            return Verdict::Clear;
        }
        Verdict::At(self.unique(motion, threshold, sense, (a, ga), (b, gb), toward))
    }

    /// The only crossing between `a` (not passed) and `b` (passed) of a function that rises all the while.
    #[inline]
    fn unique(
        &self,
        motion: &Trajectory,
        threshold: f64,
        sense: Sense,
        (mut a, mut ga): (u64, f64),
        (mut b, mut gb): (u64, f64),
        toward: f64,
    ) -> u64 {
        let mut tries = 0;
        while b - a > 1 {
            let share = if tries < 6 { ga / (ga - gb) } else { 0.5 };
            // Aim just beyond the estimate first, then just before it: two good guesses close the bracket.
            let guess = a + ((b - a) as f64 * share) as u64 + u64::from(tries & 1 == 0);
            let guess = guess.clamp(a + 1, b - 1);
            let x = motion.at(guess);
            let g = toward * (self.value(&x) - threshold);
            if self.passed(&x, threshold, sense) {
                (b, gb) = (guess, g);
            } else {
                (a, ga) = (guess, g);
            }
            tries += 1;
        }
        b
    }
}

enum Verdict {
    Clear,
    Split(u64),
    At(u64),
}
