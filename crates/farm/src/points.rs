//! The numbers of a wave's points.

/// Numbers in rising order, kept as runs: the first number of a run, and how many numbers it has. A sweep of all points
/// is one run, however many points it has.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Points(Vec<(u64, u64)>);

impl Points {
    /// Returns the numbers from 0 to `count - 1`.
    pub fn all(count: u64) -> Self {
        Self((count > 0).then_some((0, count)).into_iter().collect())
    }

    /// Returns these numbers, which must be in rising order.
    pub fn of(numbers: impl IntoIterator<Item = u64>) -> Self {
        let mut runs: Vec<(u64, u64)> = Vec::new();
        for number in numbers {
            match runs.last_mut() {
                Some((first, count)) if *first + *count == number => *count += 1,
                _ => runs.push((number, 1)),
            }
        }
        Self(runs)
    }

    /// Returns the points of these runs; `None` if the runs overlap, are empty or are not in rising order.
    pub fn of_runs(runs: Vec<(u64, u64)>) -> Option<Self> {
        let ends = runs.iter().map(|(first, count)| first.checked_add(*count)).collect::<Option<Vec<u64>>>()?;
        let apart = runs.iter().skip(1).zip(&ends).all(|((first, _), end)| first >= end);
        (apart && runs.iter().all(|(_, count)| *count > 0)).then_some(Self(runs))
    }

    /// Returns the runs: first number, and count.
    pub fn runs(&self) -> &[(u64, u64)] {
        &self.0
    }

    /// Returns how many points there are.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|(_, count)| count).sum()
    }

    /// Returns the number after the last point; 0 if there is none.
    pub fn end(&self) -> u64 {
        self.0.last().map_or(0, |(first, count)| first + count)
    }

    /// Returns the numbers of `count` points from place `from` on; fewer at the end.
    pub fn slice(&self, from: u64, count: u64) -> Vec<u64> {
        let (mut skip, mut left) = (from, count);
        let mut numbers = Vec::new();
        for &(first, length) in &self.0 {
            if left == 0 {
                break;
            }
            if skip >= length {
                skip -= length;
                continue;
            }
            let taken = left.min(length - skip);
            numbers.extend(first + skip..first + skip + taken);
            (skip, left) = (0, left - taken);
        }
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::Points;

    #[test]
    fn slices_of_any_length_are_the_numbers_one_after_the_other() {
        let numbers = [3, 4, 5, 9, 11, 12, 20];
        let points = Points::of(numbers);
        assert_eq!(points.runs(), [(3, 3), (9, 1), (11, 2), (20, 1)]);
        assert_eq!(Points::of_runs(points.runs().to_vec()), Some(points.clone()));
        for length in 1..=8 {
            let shards = (0..7).step_by(length).flat_map(|from| points.slice(from as u64, length as u64));
            assert_eq!(shards.collect::<Vec<u64>>(), numbers);
        }
        assert_eq!([points.end(), Points::default().end(), Points::of([u64::MAX - 1]).end()], [21, 0, u64::MAX]);
        assert_eq!(Points::all(1_000_000_000).slice(999_999_998, 7), [999_999_998, 999_999_999]);
    }

    #[test]
    fn runs_that_are_no_numbers_in_rising_order_are_refused() {
        for wrong in [vec![(0, 0)], vec![(4, 2), (5, 1)], vec![(4, 2), (0, 1)], vec![(u64::MAX, 2)]] {
            assert_eq!(Points::of_runs(wrong), None);
        }
    }
}
