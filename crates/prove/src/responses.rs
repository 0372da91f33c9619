//! Bounds of the sums of all responses of a loop of three states from period to period, `x+ = A x`.
//!
//! A matrix `P` with `A' P A <= decay² P` proves that motions die out. Then each response is computed period by period.
//! Its numbers lose something on the way, by rounding and by what is no polynomial of second degree. That is a state
//! that lives on as any other: its responses are sums of those of the three states. So these are bounded together.

use std::array::from_fn;

use crate::Error;
use crate::form::Form;
use crate::interval::Interval;
use crate::square::{Column, Square, is_positive, product, times, transposed};

/// Greatest number of periods over which responses are summed one by one.
const MOST_PERIODS: usize = 200_000;

/// Sums over all periods: of the sizes of each state, and of the third state's steps.
type Sums = [f64; 4];

/// The loop, and what bounds its motions.
pub struct Responses<const K: usize> {
    closed: Square<3, K>,
    decay: f64,
    /// The root of `x' P x` is at most the sum of the states' sizes times these.
    weights: [f64; 3],
    /// Each state is at most this times the root of `x' P x`.
    scales: [f64; 3],
    /// The sums of the responses to each state.
    pub by_axis: [Sums; 3],
}

impl<const K: usize> Responses<K> {
    /// Returns the responses of a loop. In a period the root of `x' P x` falls by `decay`, and it bounds each state by
    /// its scale.
    ///
    /// # Errors
    ///
    /// Returns what of it is not proved.
    pub fn new(closed: Square<3, K>, shape: &Square<3, K>, scales: [f64; 3], decay: f64) -> Result<Self, Error> {
        let exact = Form::exact;
        let unit: Square<3, K> = from_fn(|row| {
            let own = |of: usize| if of == row { exact(1.0).over(scales[row]).over(scales[row]) } else { Form::ZERO };
            from_fn(|of| shape[row][of].minus(own(of)))
        });
        let moved = product(&transposed(&closed), &product(shape, &closed));
        let square = exact(decay).times(exact(decay));
        let falls: Square<3, K> = from_fn(|row| from_fn(|of| square.times(shape[row][of]).minus(moved[row][of])));
        if !(0.0..1.0).contains(&decay) || !is_positive(&unit) || !is_positive(&falls) {
            return Err("its motions are not proved to die out".into());
        }
        let weights = from_fn(|at| shape[at][at].all().hi.sqrt().next_up());
        let mut all = Self { closed, decay, weights, scales, by_axis: [[0.0; 4]; 3] };
        let axis = |at: usize| all.alone(from_fn(|state| exact(f64::from(u8::from(state == at)))));
        let axes = [axis(0)?, axis(1)?, axis(2)?];
        let mut by_axis = axes.map(|(sums, _)| sums);
        (0..100).for_each(|_| by_axis = from_fn(|axis| with_lost(axes[axis], &by_axis)));
        all.by_axis = by_axis.map(|sums| sums.map(|sum| sum * (1.0 + 1e-9)));
        // Numbers that exceed what follows from them exceed the sums, which satisfy the same with less or equal.
        let exceeds = |axis: usize| {
            let follows = with_lost(axes[axis], &all.by_axis);
            follows.iter().zip(&all.by_axis[axis]).all(|(follows, sum)| follows < sum)
        };
        if (0..3).all(exceeds) { Ok(all) } else { Err("its ranges are too wide".into()) }
    }

    /// Returns bounds of the sums from a start on.
    ///
    /// # Errors
    ///
    /// Returns that it dies out too slowly.
    pub fn from(&self, start: Column<3, K>) -> Result<Sums, Error> {
        Ok(with_lost(self.alone(start)?, &self.by_axis))
    }

    /// Returns bounds of the greatest size of each state from a start on, and of the third state's steps from there on.
    ///
    /// # Errors
    ///
    /// Returns that it dies out too slowly.
    pub fn greatest(&self, start: Column<3, K>) -> Result<[f64; 4], Error> {
        Ok(with_lost(self.gathered(start, start[2], f64::max)?, &self.by_axis))
    }

    /// Returns bounds of the sums from a start on without what is lost on the way, and the sums of that.
    fn alone(&self, start: Column<3, K>) -> Result<(Sums, [f64; 3]), Error> {
        self.gathered(start, Form::ZERO, |sum, size| (sum + size).next_up())
    }

    /// Returns sizes from a start on, each `with` those before it, of which the result is no more than their sum; and
    /// the sums of what is lost on the way. The first step is that from `before`.
    fn gathered(
        &self,
        start: Column<3, K>,
        mut before: Form<K>,
        with: impl Fn(f64, f64) -> f64,
    ) -> Result<(Sums, [f64; 3]), Error> {
        let norm = |state: &Column<3, K>| -> f64 {
            let parts = state.iter().zip(self.weights);
            parts.fold(0.0, |sum, (part, weight)| (sum + (part.size() * weight).next_up()).next_up())
        };
        let (mut wide, mut lost) = (start, [0.0f64; 3]);
        // Sums of sizes are convex, so none is greater than the greatest at a control point.
        let mut sums = vec![[0.0f64; 4]; Form::<K>::CONTROLS];
        // A start at 0 has a norm, too, by rounding.
        let least = (1e-9 * (1.0 - self.decay) * norm(&start)).max(f64::MIN_POSITIVE);
        for _ in 0..MOST_PERIODS {
            let parts = wide.map(Form::known);
            let at = parts.map(|(at, _)| at);
            lost = from_fn(|state| (lost[state] + parts[state].1).next_up());
            if norm(&at) <= least {
                let left = Interval::exact(1.0).minus(Interval::exact(self.decay));
                let rest = Interval::exact(norm(&at)).divided(left).hi;
                let own = |state: usize| (2.0 * self.scales[state.min(2)] * rest).next_up() + before.size();
                let most = |state: usize| sums.iter().fold(0.0, |most: f64, sums| most.max(sums[state]));
                return Ok((from_fn(|state| (most(state) + own(state).next_up()).next_up()), lost));
            }
            let step = at[2].minus(before);
            for (control, sums) in sums.iter_mut().enumerate() {
                *sums = from_fn(|state| with(sums[state], at.get(state).unwrap_or(&step).at(control).size()));
            }
            (before, wide) = (at[2], times(&self.closed, &at));
        }
        Err("its motions die out too slowly".into())
    }
}

/// Returns sums together with those of what is lost, by the sums from each state.
fn with_lost((sums, lost): (Sums, [f64; 3]), by_axis: &[Sums; 3]) -> Sums {
    let more = |sum: f64, state: usize, axis: usize| (sum + (lost[axis] * by_axis[axis][state]).next_up()).next_up();
    from_fn(|state| (0..3).fold(sums[state], |sum, axis| more(sum, state, axis)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop of three states that do not mix, each with its own factor, around the middle of a range.
    fn alone(factors: [f64; 3], half: f64) -> Result<Responses<1>, Error> {
        let cell = |row: usize, of: usize| match row == of {
            true => Form::line(factors[row], [half]),
            false => Form::ZERO,
        };
        let shape = from_fn(|row| from_fn(|of| Form::exact(f64::from(u8::from(row == of)))));
        Responses::new(from_fn(|row| from_fn(|of| cell(row, of))), &shape, [1.001; 3], 0.99)
    }

    #[test]
    fn sums_are_those_of_geometric_series_at_the_worst_end_of_a_range() {
        for half in [0.0, 1e-4, 1e-3, 1e-2] {
            let found = alone([0.5, -0.8, 0.9], half).expect("it dies out");
            for (axis, factor) in [0.5, 0.8, 0.9].into_iter().enumerate() {
                let exact = 1.0 / (1.0 - factor - half);
                let sum = found.by_axis[axis][axis];
                let start = from_fn(|state| Form::exact(f64::from(u8::from(state == axis))));
                assert!(found.from(start).expect("it dies out")[axis] >= exact, "{axis}, {half}: {exact}");
                // What is lost is of third order in the range, times the cube of the periods that a motion lasts.
                let spare = 1e-8 + 20.0 * (half * exact).powi(3);
                assert!(sum >= exact && sum <= exact * (1.0 + spare), "{axis}, {half}: {sum}, not {exact}");
                assert!(found.by_axis[axis].iter().enumerate().all(|(at, sum)| at == axis || at == 3 || *sum < 1e-6));
            }
            // The steps of the third state: the first one, then each fall.
            assert!((found.by_axis[2][3] - 2.0).abs() < 1e-6 + half * half * 1e3, "{}", found.by_axis[2][3]);
        }
    }

    #[test]
    fn the_greatest_of_a_motion_is_that_of_all_its_periods() {
        // The second state feeds the first: from (0.1, 1) on that is 0.1, 1.05, 1.025 and then less.
        let closed = [[0.5, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, -0.5]].map(|row| row.map(Form::<0>::exact));
        let shape = from_fn(|row| {
            from_fn(|of| {
                Form::exact(if row != of {
                    0.0
                } else if row == 1 {
                    16.0
                } else {
                    1.0
                })
            })
        });
        let loops = Responses::new(closed, &shape, [1.001, 0.251, 1.001], 0.9).expect("it dies out");
        let found = loops.greatest([0.1, 1.0, 2.0].map(Form::exact)).expect("it dies out");
        // The third state's steps begin with that from 2 to -1.
        for (found, exact) in found.iter().zip([1.05, 1.0, 2.0, 3.0]) {
            assert!(*found >= exact && *found < exact + 1e-6, "{found}, not {exact}");
        }
        assert!(loops.greatest([0.0; 3].map(Form::exact)).expect("it dies out").iter().all(|most| *most < 1e-300));
    }

    #[test]
    fn loops_that_may_not_die_out_have_no_sums() {
        assert!(alone([0.5, 0.8, 1.0], 0.0).is_err() && alone([0.5, 0.8, 0.985], 6e-3).is_err());
        assert!(alone([0.5, 0.8, 0.985], 4e-3).is_ok() || alone([0.5, 0.8, 0.985], 1e-3).is_ok());
        // All of this range dies out, but more is lost on the way than a state has.
        let wide = alone([0.5, 0.4, 0.7], 0.2895).err().map(|error| error.to_string());
        assert_eq!(wide.as_deref(), Some("its ranges are too wide"));
    }
}
