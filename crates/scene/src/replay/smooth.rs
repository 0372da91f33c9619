//! The smooth motion behind recorded encoder counts.
//!
//! A count says that the position lies between two edges of the encoder, a count apart. Of all motions that lie between
//! the recorded edges at every recorded time, [`smooth`] returns the one with the least mean square of its third
//! derivative. This is a quadratic programme whose only constraints are a lower and an upper bound of each position. A
//! primal-dual interior-point method solves it (Mehrotra's predictor and corrector): each step solves one banded
//! system, so the work is proportional to the number of points. Every iterate lies strictly between the edges.
//! Mehrotra's steps can return to where they were; the second order of a step therefore counts by the square of the
//! part that the predictor can go (Salahi, Peng and Terlaky 2007).

/// Distance in counts that a position keeps from the edges of its count, so that rounding cannot count another one.
const MARGIN: f64 = 1e-3;

/// The share of the objective by which the result may exceed the least.
const GAP: f64 = 1e-9;

/// The most iterations; recordings of thousands of points take about twenty.
const MOST_ITERATIONS: u32 = 200;

/// Points that one third difference joins.
const JOINED: usize = 4;

/// Returns the position, in counts, at each time of a recording: between its count and the next one. Returns `None` if
/// the method does not converge, as for times whose distances differ by many orders of magnitude.
///
/// `recording` holds times, strictly increasing, and counts.
pub(crate) fn smooth(recording: &[(f64, i64)]) -> Option<Vec<f64>> {
    // Fewer points than a third difference joins have none: their middles are as smooth as any.
    let &[(start_s, origin), _, _, .., (end_s, _)] = recording else {
        return Some(recording.iter().map(|(_, count)| *count as f64 + 0.5).collect());
    };
    // Times are in mean intervals, and positions in counts from the first one.
    let mean_s = (end_s - start_s) / (recording.len() - 1) as f64;
    let times: Vec<f64> = recording.iter().map(|(time_s, _)| (time_s - start_s) / mean_s).collect();
    let low: Vec<f64> = recording.iter().map(|(_, count)| (count - origin) as f64 + MARGIN).collect();
    let positions = Programme::new(&times, &low, 1.0 - 2.0 * MARGIN).solved()?;
    Some(positions.into_iter().map(|x| x + origin as f64).collect())
}

/// The quadratic programme: the least `sum (R x)^2 / 2` with `low <= x <= low + width`.
struct Programme<'a> {
    /// The rows of `R`: each third derivative, weighted by the root of the time that it stands for.
    rows: Vec<[f64; JOINED]>,
    low: &'a [f64],
    width: f64,
}

/// An iterate: positions, and the multipliers of the lower and the upper bounds.
struct Iterate {
    x: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Programme<'a> {
    fn new(times: &[f64], low: &'a [f64], width: f64) -> Self {
        let rows = times.windows(JOINED).map(|t| {
            let weight = ((t[3] - t[0]) / 3.0).sqrt();
            std::array::from_fn(|at| {
                let others = (0..JOINED).filter(|other| *other != at);
                6.0 * weight / others.map(|other| t[at] - t[other]).product::<f64>()
            })
        });
        Self { rows: rows.collect(), low, width }
    }

    /// Returns twice the objective, and its gradient.
    fn objective(&self, x: &[f64]) -> (f64, Vec<f64>) {
        let (mut sum, mut gradient) = (0.0, vec![0.0; x.len()]);
        for (at, row) in self.rows.iter().enumerate() {
            let value: f64 = row.iter().zip(&x[at..]).map(|(factor, x)| factor * x).sum();
            sum += value * value;
            gradient[at..].iter_mut().zip(row).for_each(|(slope, factor)| *slope += factor * value);
        }
        (sum, gradient)
    }

    /// Returns the distances of a position from its bounds.
    fn room(&self, at: usize, x: f64) -> [f64; 2] {
        [x - self.low[at], self.low[at] + self.width - x]
    }

    fn solved(&self) -> Option<Vec<f64>> {
        let points = self.low.len();
        let x: Vec<f64> = self.low.iter().map(|low| low + 0.5 * self.width).collect();
        // Multipliers whose difference is the gradient, all above 0.
        let (_, gradient) = self.objective(&x);
        let lower = gradient.iter().map(|slope| 1.0 + slope.max(0.0)).collect();
        let upper = gradient.iter().map(|slope| 1.0 + (-slope).max(0.0)).collect();
        let mut now = Iterate { x, lower, upper };
        // The objective of a motion that is a count off at each point, by one part in 2^52: as good as none.
        let no_gap = f64::EPSILON * self.rows.iter().flatten().map(|factor| factor * factor).sum::<f64>();
        for _ in 0..MOST_ITERATIONS {
            let (sum, gradient) = self.objective(&now.x);
            let gap: f64 = (0..points).map(|at| now.complement(self, at).iter().sum::<f64>()).sum();
            if gap <= (GAP * sum).max(no_gap) {
                return Some(now.x);
            }
            let residual: Vec<f64> = (0..points).map(|at| gradient[at] - now.lower[at] + now.upper[at]).collect();
            let system = Banded::new(
                &self.rows,
                |at| {
                    let [below, above] = self.room(at, now.x[at]);
                    now.lower[at] / below + now.upper[at] / above
                },
                points,
            )?;
            // The predictor aims at the bounds themselves; how far it comes says where the corrector aims.
            let predicted = now.toward(self, &system, &residual, |at| now.complement(self, at).map(|product| -product));
            let reach = now.reach(self, &predicted);
            let left: f64 = (0..points).map(|at| now.moved(self, &predicted, reach, at).iter().sum::<f64>()).sum();
            let aim = (left / gap).powi(3) * gap / (2 * points) as f64;
            let second = reach * reach;
            let corrected = now.toward(self, &system, &residual, |at| {
                let [below, above] = now.complement(self, at);
                let [x, lower, upper] = [predicted.x[at], predicted.lower[at], predicted.upper[at]];
                [aim - below - second * x * lower, aim - above + second * x * upper]
            });
            now.go(&corrected, (0.995 * now.reach(self, &corrected)).min(1.0));
        }
        None
    }
}

impl Iterate {
    /// Returns the products of distance and multiplier at both bounds; they are 0 at the optimum.
    fn complement(&self, programme: &Programme, at: usize) -> [f64; 2] {
        let [below, above] = programme.room(at, self.x[at]);
        [below * self.lower[at], above * self.upper[at]]
    }

    /// Returns these products after a part of a step.
    fn moved(&self, programme: &Programme, step: &Self, part: f64, at: usize) -> [f64; 2] {
        let [below, above] = programme.room(at, self.x[at] + part * step.x[at]);
        [below * (self.lower[at] + part * step.lower[at]), above * (self.upper[at] + part * step.upper[at])]
    }

    /// Returns Newton's step that changes the products by `change`.
    fn toward(
        &self,
        programme: &Programme,
        system: &Banded,
        residual: &[f64],
        change: impl Fn(usize) -> [f64; 2],
    ) -> Self {
        let mut x: Vec<f64> = (0..self.x.len())
            .map(|at| {
                let [below, above] = programme.room(at, self.x[at]);
                let [lower, upper] = change(at);
                lower / below - upper / above - residual[at]
            })
            .collect();
        system.solve(&mut x);
        let multipliers = |at: usize| {
            let [below, above] = programme.room(at, self.x[at]);
            let [lower, upper] = change(at);
            ((lower - self.lower[at] * x[at]) / below, (upper + self.upper[at] * x[at]) / above)
        };
        let (lower, upper) = (0..x.len()).map(multipliers).unzip();
        Self { x, lower, upper }
    }

    /// Returns the part of a step, of at most 1, at which the first distance or multiplier is 0.
    fn reach(&self, programme: &Programme, step: &Self) -> f64 {
        let until = |value: f64, change: f64| if change < 0.0 { -value / change } else { f64::INFINITY };
        (0..self.x.len()).fold(1.0, |least: f64, at| {
            let [below, above] = programme.room(at, self.x[at]);
            let bounds = until(below, step.x[at]).min(until(above, -step.x[at]));
            let multipliers = until(self.lower[at], step.lower[at]).min(until(self.upper[at], step.upper[at]));
            least.min(bounds).min(multipliers)
        })
    }

    fn go(&mut self, step: &Self, part: f64) {
        let pairs = [(&mut self.x, &step.x), (&mut self.lower, &step.lower), (&mut self.upper, &step.upper)];
        for (values, changes) in pairs {
            values.iter_mut().zip(changes).for_each(|(value, change)| *value += part * change);
        }
    }
}

/// A symmetric positive definite matrix with three bands on either side of its diagonal, as `L D L^T`.
struct Banded {
    /// Of each row the elements of `L` one, two and three places before the diagonal.
    before: Vec<[f64; JOINED - 1]>,
    diagonal: Vec<f64>,
}

impl Banded {
    /// Decomposes `R^T R` plus a diagonal. Returns `None` if rounding has left no positive definite matrix.
    fn new(rows: &[[f64; JOINED]], diagonal: impl Fn(usize) -> f64, points: usize) -> Option<Self> {
        // bands[at][k] is the element at row `at` and column `at - k`.
        let mut bands = vec![[0.0; JOINED]; points];
        for (first, row) in rows.iter().enumerate() {
            for at in 0..JOINED {
                (0..=at).for_each(|k| bands[first + at][k] += row[at] * row[at - k]);
            }
        }
        let mut made = Self { before: Vec::with_capacity(points), diagonal: Vec::with_capacity(points) };
        for (at, band) in bands.iter().enumerate() {
            let mut own = [0.0; JOINED - 1];
            let width = at.min(JOINED - 1);
            for k in (1..=width).rev() {
                let farther =
                    (k + 1..=width).map(|m| own[m - 1] * made.diagonal[at - m] * made.before[at - k][m - k - 1]);
                own[k - 1] = (band[k] - farther.sum::<f64>()) / made.diagonal[at - k];
            }
            let taken = (1..=width).map(|k| own[k - 1] * own[k - 1] * made.diagonal[at - k]);
            let left = band[0] + diagonal(at) - taken.sum::<f64>();
            if !(left > 0.0 && left.is_finite()) {
                return None;
            }
            made.before.push(own);
            made.diagonal.push(left);
        }
        Some(made)
    }

    /// Replaces the right side of the system by its solution.
    fn solve(&self, x: &mut [f64]) {
        for at in 0..x.len() {
            let known = (1..=at.min(JOINED - 1)).map(|k| self.before[at][k - 1] * x[at - k]);
            x[at] -= known.sum::<f64>();
        }
        x.iter_mut().zip(&self.diagonal).for_each(|(x, diagonal)| *x /= diagonal);
        for at in (0..x.len()).rev() {
            let later = (1..JOINED.min(x.len() - at)).map(|k| self.before[at + k][k - 1] * x[at + k]);
            x[at] -= later.sum::<f64>();
        }
    }
}
