//! Wall times of runs that are compared: taken in turn (A B A B), and told as a median with its spread.
//!
//! A machine that does other work is slow for a while. Runs in turn are then slow together, so that the ratio of two
//! runs of one turn hardly changes.

/// Greatest ratio of the upper to the lower quartile for which a median is told.
const WIDEST: f64 = 1.5;
/// The fewest turns that tell a spread.
pub(crate) const LEAST_TURNS: usize = 3;

/// Median and quartiles of one figure over some turns.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The lower quartile.
    pub low: f64,
    /// The upper quartile.
    pub high: f64,
    /// Number of turns.
    pub turns: usize,
}

impl Spread {
    /// The ratio of a run to itself.
    pub const ONE: Self = Self { median: 1.0, low: 1.0, high: 1.0, turns: 0 };

    /// Returns median and quartiles of figures, by rank; all are NaN without a figure.
    pub fn of(figures: &[f64]) -> Self {
        let mut sorted = figures.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (Some(last), turns) = (sorted.len().checked_sub(1), sorted.len()) else {
            return Self { median: f64::NAN, low: f64::NAN, high: f64::NAN, turns: 0 };
        };
        let median = 0.5 * (sorted[last / 2] + sorted[turns / 2]);
        Self { median, low: sorted[last / 4], high: sorted[last - last / 4], turns }
    }

    /// Returns how many times as fast the second run was as the first, from their wall times turn by turn.
    pub fn ratio(first_s: &[f64], second_s: &[f64]) -> Self {
        let ratios: Vec<f64> = first_s.iter().zip(second_s).map(|(first, second)| first / second).collect();
        Self::of(&ratios)
    }

    /// Returns the median, unless the spread is too wide or the turns are too few for one figure.
    pub fn told(self) -> Option<f64> {
        let is_narrow = self.turns >= LEAST_TURNS && self.high <= WIDEST * self.low;
        (is_narrow || self == Self::ONE).then_some(self.median)
    }

    /// Returns a ratio of speeds as text, with its spread: how many `times`, as in `times faster`; or why it is not
    /// told.
    pub fn said(self, times: &str) -> String {
        let Self { median, low, high, turns } = self;
        match self.told() {
            Some(_) => format!("{median:.1} {times} ({low:.1} to {high:.1} in {turns} turns)"),
            None if turns < LEAST_TURNS => format!("not told: {turns} turns are too few"),
            None => format!("{low:.1} to {high:.1} {times} in {turns} turns, too far apart for one figure"),
        }
    }
}

/// Runs each of `count` runs once a turn, in their order, as long as `goes_on` says so of it at the beginning of the
/// turn, given the wall times of all. `run` returns the wall time of a run. Returns the wall times of each, turn by
/// turn.
///
/// # Errors
///
/// Returns the error of `run`.
pub(crate) fn in_turn<E>(
    count: usize,
    goes_on: impl Fn(usize, &[Vec<f64>]) -> bool,
    mut run: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let mut walls = vec![Vec::new(); count];
    loop {
        let wanted: Vec<usize> = (0..count).filter(|&index| goes_on(index, &walls)).collect();
        if wanted.is_empty() {
            return Ok(walls);
        }
        for index in wanted {
            let wall_s = run(index)?;
            walls[index].push(wall_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};

    use super::{Spread, in_turn};

    /// A machine whose time only the runs move on: a slowness that doubles the time of everything in some turns.
    fn timed(slow: &[usize], run_s: [f64; 2], turns: usize) -> ([Vec<f64>; 2], Vec<usize>) {
        let (now_s, order) = (Cell::new(0.0), RefCell::new(Vec::new()));
        let walls = in_turn::<()>(
            2,
            |index, walls| walls[index].len() < turns,
            |index| {
                let turn = order.borrow().len() / 2;
                let start_s = now_s.get();
                now_s.set(start_s + run_s[index] * if slow.contains(&turn) { 8.0 } else { 1.0 });
                order.borrow_mut().push(index);
                Ok(now_s.get() - start_s)
            },
        );
        let [first, second] = walls.expect("no run fails").try_into().expect("two runs");
        ([first, second], order.into_inner())
    }

    #[test]
    fn two_runs_are_timed_in_turn_and_a_machine_that_is_slow_for_some_turns_changes_no_ratio() {
        let ([first, second], order) = timed(&[1, 2, 4], [0.5, 0.125], 5);
        assert_eq!(order, [0, 1, 0, 1, 0, 1, 0, 1, 0, 1]);
        let ratio = Spread::ratio(&first, &second);
        assert_eq!(ratio, Spread { median: 4.0, low: 4.0, high: 4.0, turns: 5 });
        assert_eq!(
            (ratio.told(), ratio.said("times faster")),
            (Some(4.0), "4.0 times faster (4.0 to 4.0 in 5 turns)".into())
        );
        // Each by itself is told no figure.
        assert_eq!(Spread::of(&first).told(), None);
    }

    #[test]
    fn a_spread_that_is_wide_and_turns_that_are_few_give_no_figure() {
        let wide = Spread::ratio(&[2.2, 4.0, 7.8, 3.0, 6.0], &[1.0; 5]);
        assert_eq!((wide.median, wide.low, wide.high, wide.told()), (4.0, 3.0, 6.0, None));
        let said = "3.0 to 6.0 times as fast in 5 turns, too far apart for one figure";
        assert_eq!(wide.said("times as fast"), said);
        assert_eq!(Spread::of(&[2.0, 2.0]).told(), None);
        assert_eq!(Spread::of(&[]).told(), None);
        // A single turn off the others does not widen the middle half of five.
        assert_eq!(Spread::ratio(&[2.0, 2.0, 40.0, 2.1, 1.9], &[1.0; 5]).told(), Some(2.0));
        let even = Spread::of(&[1.0, 2.0, 2.0, 3.0]);
        assert_eq!((even.median, even.low, even.high), (2.0, 1.0, 3.0));
        assert_eq!(Spread::ONE.told(), Some(1.0));
    }

    #[test]
    fn a_run_that_has_had_enough_turns_is_left_out_of_the_next() {
        let order = RefCell::new(Vec::new());
        let walls = in_turn(
            3,
            |index, walls| walls[index].len() < 3 - index,
            |index| {
                order.borrow_mut().push(index);
                if order.borrow().len() < 9 { Ok(index as f64) } else { Err("too many") }
            },
        );
        assert_eq!(walls, Ok(vec![vec![0.0; 3], vec![1.0; 2], vec![2.0; 1]]));
        assert_eq!(order.into_inner(), [0, 1, 2, 0, 1, 0]);
        assert_eq!(in_turn(1, |_, _| true, |_| Err("stopped")), Err("stopped"));
    }
}
