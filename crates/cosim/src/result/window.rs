//! The judged window of a motion that is too long to be held: the verdict's figures, gathered row by row.

use std::ops::Range;

use hpu_scene::judged::window;

/// Number of parts of a window.
pub(crate) const PARTS: usize = 8;

/// Returns the row at which part `of` of `rows` rows begins, counted from 0; for [`PARTS`], the end of the rows.
pub(crate) fn part(rows: usize, of: usize) -> usize {
    (rows as u128 * of as u128 / PARTS as u128) as usize
}

/// Returns the least and the greatest of numbers; infinity and minus infinity of none. NaN is ignored. Eight of each
/// are sought side by side, because a single one would wait for each comparison.
pub(crate) fn range(values: &[f64]) -> [f64; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
    let (eights, rest) = values.as_chunks::<8>();
    let mut widen = |lane: usize, x: f64| {
        low[lane] = if x < low[lane] { x } else { low[lane] };
        high[lane] = if x > high[lane] { x } else { high[lane] };
    };
    for eight in eights {
        (0..8).for_each(|lane| widen(lane, eight[lane]));
    }
    rest.iter().for_each(|&x| widen(0, x));
    [low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

/// Mean, spread and range of numbers, by Welford's recurrence, which needs no small difference of large sums.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Spread {
    rows: u64,
    mean: f64,
    /// Sum of the squared deviations from the mean.
    squares: f64,
    low: f64,
    high: f64,
}

impl Spread {
    const NONE: Self = Self { rows: 0, mean: 0.0, squares: 0.0, low: f64::INFINITY, high: f64::NEG_INFINITY };

    #[inline]
    fn add(&mut self, x: f64) {
        self.rows += 1;
        let from_mean = x - self.mean;
        self.mean += from_mean / self.rows as f64;
        self.squares += from_mean * (x - self.mean);
        self.low = if x < self.low { x } else { self.low };
        self.high = if x > self.high { x } else { self.high };
    }

    /// Returns the spread of both sets of numbers together.
    fn with(&self, other: &Self) -> Self {
        if self.rows == 0 {
            return *other;
        }
        let (n, m) = (self.rows as f64, other.rows as f64);
        let apart = other.mean - self.mean;
        Self {
            rows: self.rows + other.rows,
            mean: self.mean + apart * (m / (n + m)),
            squares: self.squares + other.squares + apart * apart * (n * m / (n + m)),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }
}

/// One output of the plant over the window.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Streamed {
    /// Index of the output.
    pub(crate) index: usize,
    window: Range<u64>,
    /// The rows at which the parts after the first begin.
    begins: [u64; PARTS - 1],
    parts: [Spread; PARTS],
    turns: Turns,
}

impl Streamed {
    /// Creates the window of an output for a run that will have `rows` rows, whose hand stands still from row `still`
    /// on.
    pub(crate) fn new(index: usize, rows: u64, still: u64) -> Self {
        let window = window(rows, still);
        let long = (window.end - window.start) as usize;
        let begins = std::array::from_fn(|of| window.start + part(long, of + 1) as u64);
        Self { index, window, begins, parts: [Spread::NONE; PARTS], turns: Turns::new(MOST_TURNS) }
    }

    /// Takes the next row.
    #[inline]
    pub(crate) fn add(&mut self, row: u64, x: f64) {
        if row >= self.window.start {
            self.parts[self.begins.iter().filter(|begin| row >= **begin).count()].add(x);
            self.turns.add(row, x);
        }
    }

    /// Returns the window's first row.
    pub(crate) fn start(&self) -> u64 {
        self.window.start
    }

    /// Returns whether all numbers were finite.
    pub(crate) fn is_finite(&self) -> bool {
        // A mean stays non-finite after the first number that is not finite.
        self.parts.iter().all(|part| part.mean.is_finite())
    }

    /// Returns the rms about the mean, and the mean.
    pub(crate) fn rms_about_mean(&self) -> (f64, f64) {
        let all = self.parts.iter().fold(Spread::NONE, |all, part| all.with(part));
        ((all.squares / all.rows as f64).sqrt(), all.mean)
    }

    /// Returns the least and the greatest value of each part.
    pub(crate) fn parts(&self) -> [[f64; 2]; PARTS] {
        self.parts.map(|part| [part.low, part.high])
    }

    /// Returns the mean of each quarter.
    pub(crate) fn quarter_means(&self) -> [f64; 4] {
        [0, 2, 4, 6].map(|of| self.parts[of].with(&self.parts[of + 1]).mean)
    }

    /// Returns rows and values at which the motion turned back by more than a sixteenth of its range, without its first
    /// row and its last.
    pub(crate) fn turns(&self) -> Vec<(u64, f64)> {
        let mut turns = Turns { low: self.turns.low, high: self.turns.high, ..Turns::new(usize::MAX) };
        self.turns.turns.iter().chain(&self.turns.last).for_each(|(row, x)| turns.turn(*row, *x));
        turns.inner()
    }

    /// Returns the number of upward passages of the mean, each after a passage below it by a quarter of the amplitude,
    /// and the two turns around the first passage and around the last.
    pub(crate) fn passages(&self, mean: f64, amplitude: f64) -> (u64, [Swing; 2]) {
        self.turns.passages(mean, amplitude)
    }
}

/// Rows and values of a turn and of the turn after it.
pub(crate) type Swing = [(u64, f64); 2];

/// Returns the row at which a swing passes the mean, on the straight line from turn to turn.
pub(crate) fn passage(&[from, to]: &Swing, mean: f64) -> f64 {
    from.0 as f64 + (to.0 - from.0) as f64 * ((mean - from.1) / (to.1 - from.1))
}

/// Returns rows and values at which a motion within a range turned back by more than a sixteenth of it. The first row
/// is no turn, nor is the last.
pub(crate) fn turns(rows: &[f64], [low, high]: [f64; 2]) -> Vec<(u64, f64)> {
    let mut turns = Turns { low, high, ..Turns::new(usize::MAX) };
    for (block, first) in rows.chunks(BLOCK).zip((0..).step_by(BLOCK)) {
        turns.turn_all(first, block);
    }
    turns.inner()
}

/// Rows that are looked at together for a turn.
const BLOCK: usize = 64;

/// The most turns of a motion that are kept: half a million swings.
const MOST_TURNS: usize = 1 << 20;

/// The turns of a motion: rows and values at which it had risen or fallen and then went back by more than a sixteenth
/// of its range so far. This is half of the distance between the two levels of a passage, so all passages lie between
/// turns, whatever mean and amplitude the motion has in the end.
///
/// If there are too many turns, those that are too small for the present range are dropped. If that is not enough, the
/// older half is dropped too; then passages are counted only among the rest.
#[derive(Clone, PartialEq, Debug)]
struct Turns {
    most: usize,
    low: f64,
    high: f64,
    turns: Vec<(u64, f64)>,
    /// The highest row since the last low turn, or the lowest since the last high turn.
    last: Option<(u64, f64)>,
    rising: bool,
}

impl Turns {
    fn new(most: usize) -> Self {
        Self { most, low: f64::INFINITY, high: f64::NEG_INFINITY, turns: Vec::new(), last: None, rising: true }
    }

    #[inline]
    fn add(&mut self, row: u64, x: f64) {
        self.low = if x < self.low { x } else { self.low };
        self.high = if x > self.high { x } else { self.high };
        self.turn(row, x);
        if self.turns.len() >= self.most {
            self.thin();
        }
    }

    #[inline]
    fn turn(&mut self, row: u64, x: f64) {
        let Some((_, last)) = self.last else {
            // The first row counts as a turn.
            self.turns.push((row, x));
            self.last = Some((row, x));
            return;
        };
        let back = if self.rising { last - x } else { x - last };
        if back < 0.0 {
            self.last = Some((row, x));
        } else if back > (self.high - self.low) / 16.0 {
            self.turns.extend(self.last);
            self.last = Some((row, x));
            self.rising = !self.rising;
        }
    }

    /// Takes successive rows of a motion whose range is known, the first of them this one. Most blocks lie so close
    /// together that nothing turns in them, which their range alone shows.
    fn turn_all(&mut self, first: u64, block: &[f64]) {
        let [low, high] = range(block);
        if let Some((_, last)) = self.last {
            let (back, is_farther, farthest) = match self.rising {
                true => (last.max(high) - low, high > last, high),
                false => (high - last.min(low), low < last, low),
            };
            if back <= (self.high - self.low) / 16.0 {
                if let Some(at) = block.iter().position(|x| *x == farthest).filter(|_| is_farther) {
                    self.last = Some((first + at as u64, block[at]));
                }
                return;
            }
        }
        (first..).zip(block).for_each(|(row, x)| self.turn(row, *x));
    }

    /// Returns the turns but for that of the first row.
    fn inner(mut self) -> Vec<(u64, f64)> {
        let first = self.turns.first().map(|first| first.0);
        self.turns.retain(|(row, _)| Some(*row) != first);
        self.turns
    }

    #[cold]
    fn thin(&mut self) {
        let Self { most, low, high, .. } = *self;
        let turns = std::mem::replace(self, Self { low, high, ..Self::new(most) });
        for (row, x) in turns.turns.into_iter().chain(turns.last) {
            self.turn(row, x);
        }
        if self.turns.len() > most / 2 {
            self.turns.drain(..most / 2);
        }
    }

    fn passages(&self, mean: f64, amplitude: f64) -> (u64, [Swing; 2]) {
        let (mut armed, mut ends, mut passages) = (false, [[(0, 0.0); 2]; 2], 0);
        let mut before = (0, 0.0);
        for &(row, x) in self.turns.iter().chain(&self.last) {
            if x < mean - 0.25 * amplitude {
                armed = true;
            } else if armed && x >= mean {
                armed = false;
                ends[1] = [before, (row, x)];
                if passages == 0 {
                    ends[0] = ends[1];
                }
                passages += 1;
            }
            before = (row, x);
        }
        (passages, ends)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::{Streamed, Turns, passage, range, window};

    /// Counts passages as a verdict does in held rows.
    fn counted(rows: &[f64], mean: f64, amplitude: f64) -> (u64, f64) {
        let (mut armed, mut found) = (false, Vec::new());
        for (row, x) in rows.iter().enumerate() {
            if *x < mean - 0.25 * amplitude {
                armed = true;
            } else if armed && *x >= mean {
                armed = false;
                found.push(row);
            }
        }
        (found.len() as u64, found.last().map_or(0.0, |last| (last - found[0]) as f64))
    }

    /// Returns pseudo-random numbers between -1 and 1.
    fn noise(row: u64) -> f64 {
        (row.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    #[test]
    fn least_and_greatest_of_any_number_of_values_stand_at_any_place() {
        assert_eq!(range(&[]), [f64::INFINITY, f64::NEG_INFINITY]);
        assert_eq!(range(&[f64::NAN; 11]), [f64::INFINITY, f64::NEG_INFINITY]);
        for length in 1..40usize {
            for (low, high) in (0..length).flat_map(|low| (0..length).map(move |high| (low, high))) {
                let mut values: Vec<f64> = (0..length as u64).map(noise).collect();
                values[length / 2] = f64::NAN;
                values[low] = -3.0;
                values[high] = 2.0;
                let least = if low == high { values.iter().copied().fold(2.0, f64::min) } else { -3.0 };
                assert_eq!(range(&values), [least, 2.0], "{length}: {low}, {high}");
            }
        }
    }

    fn turns(rows: &[f64], most: usize) -> Turns {
        let mut turns = Turns::new(most);
        rows.iter().enumerate().for_each(|(row, x)| turns.add(row as u64, *x));
        turns
    }

    #[test]
    fn passages_between_turns_are_those_between_rows() {
        let motions: [&dyn Fn(u64) -> f64; 5] = [
            &|row| (TAU * row as f64 / 97.3).sin() + 0.1 * noise(row),
            &|row| (TAU * row as f64 / 5000.0).sin() + 0.4 * noise(row),
            // A drift with a decaying oscillation.
            &|row| 1e-4 * row as f64 + (-(row as f64) / 8000.0).exp() * (TAU * row as f64 / 61.0).sin(),
            &|row| (row % 300) as f64,
            &noise,
        ];
        for (which, motion) in motions.into_iter().enumerate() {
            let rows: Vec<f64> = (0..20_000).map(motion).collect();
            let (low, high) = rows.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
            let mean = rows.iter().sum::<f64>() / rows.len() as f64;
            let (expected, apart) = counted(&rows, mean, 0.5 * (high - low));
            let (passages, [first, last]) = turns(&rows, 1 << 20).passages(mean, 0.5 * (high - low));
            assert_eq!(passages, expected, "motion {which}");
            let between = passage(&last, mean) - passage(&first, mean);
            // Each of the two ends lies between two turns.
            assert!((between - apart).abs() <= 0.01 * apart + 2.0, "motion {which}: {between} rows, {apart}");
        }
    }

    #[test]
    fn turns_that_are_too_many_are_those_of_the_end() {
        let rows: Vec<f64> = (0..100_000).map(|row| if row % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let turns = turns(&rows, 1000);
        assert!(turns.turns.len() < 1000 && turns.turns.capacity() <= 1024, "{}", turns.turns.len());
        let (passages, [first, last]) = turns.passages(0.0, 1.0);
        let between = passage(&last, 0.0) - passage(&first, 0.0);
        assert!(passages > 200 && (between - 2.0 * (passages - 1) as f64).abs() < 1e-9, "{passages} in {between} rows");
    }

    #[test]
    fn ripple_that_a_motion_outgrows_is_forgotten_and_costs_no_swing() {
        // Ten thousand turns of ripple, then three swings a million times as wide.
        let motion = |row: u64| match row {
            0..10_000 => 1e-6 * noise(row),
            _ => (TAU * (row - 10_000) as f64 / 10_000.0).sin(),
        };
        let rows: Vec<f64> = (0..40_000).map(motion).collect();
        assert_eq!(turns(&rows, 64).passages(0.0, 1.0).0, 2);
    }

    #[test]
    fn turns_of_blocks_are_those_of_rows() {
        for (slow, fast) in [(1.0, 0.0), (1.0, 0.02), (1.0, 0.3), (0.0, 1.0)] {
            for period in [3.0, 40.0, 130.0, 1000.0, 10_000.0] {
                let wave = |row: u64| slow * (TAU * row as f64 / period).sin() + fast * noise(row);
                // Rounded, so that neighbours are alike.
                let rows: Vec<f64> = (0..3001).map(|row| (100.0 * wave(row)).round()).collect();
                let [low, high] = range(&rows);
                let mut alone = Turns { low, high, ..Turns::new(usize::MAX) };
                (0..).zip(&rows).for_each(|(row, x)| alone.turn(row, *x));
                assert_eq!(super::turns(&rows, [low, high]), alone.inner(), "{slow}, {fast}, {period}");
            }
        }
    }

    #[test]
    fn numbers_of_the_window_are_those_of_its_rows() {
        let rows: Vec<f64> = (0..10_001).map(|row| 5.0 + 1e-3 * noise(row) + 1e-7 * row as f64).collect();
        let mut streamed = Streamed::new(2, rows.len() as u64, 0);
        rows.iter().enumerate().for_each(|(row, x)| streamed.add(row as u64, *x));
        let window = &rows[window(rows.len() as u64, 0).start as usize..];
        assert_eq!((window.len(), streamed.start()), (3000, 7001));
        let mean = window.iter().sum::<f64>() / 3000.0;
        let rms = (window.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 3000.0).sqrt();
        let (found_rms, found_mean) = streamed.rms_about_mean();
        assert!((found_mean - mean).abs() < 1e-14 && (found_rms - rms).abs() < 1e-12 * rms, "{found_rms} {rms}");
        let range = |rows: &[f64]| {
            let (low, high) = rows.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
            [low, high]
        };
        let expected = [0, 375, 750, 1125, 1500, 1875, 2250, 2625].map(|from| range(&window[from..from + 375]));
        assert_eq!(streamed.parts(), expected);
        let means = [0, 750, 1500, 2250].map(|from| window[from..from + 750].iter().sum::<f64>() / 750.0);
        for (found, mean) in streamed.quarter_means().into_iter().zip(means) {
            assert!((found - mean).abs() < 1e-14, "{found} {mean}");
        }
        assert!(streamed.is_finite());
        for lost in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut streamed = Streamed::new(2, 100, 0);
            (0..100).for_each(|row| streamed.add(row, if row == 80 { lost } else { 0.0 }));
            assert!(!streamed.is_finite(), "{lost}");
        }
    }
}
