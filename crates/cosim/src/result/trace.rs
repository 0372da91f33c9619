//! The trace of a run, for pictures and verdicts: the plant's outputs at a fixed rate, and the datapath's words at the
//! same instants.

use std::ops::Range;

use hpu_signal::{Clock, Cycle, Observe};

use crate::result::window::{Streamed, range};
use hpu_scene::judged::window;

/// Index of an axis's angle among its outputs.
pub const ANGLE: usize = 2;
/// Index of the torque or force of an axis's actuator among its outputs.
pub(crate) const TORQUE: usize = 3;

/// Recorded rows at a fixed interval, from edge 0 on, with selected outputs of the plant and selected nets.
///
/// All rows are held, unless the trace is [`bounded`](Self::bounded) and the run has more. Then it holds every second
/// row, later every fourth, and so on, and gathers from all rows, as they come, the figures that verdicts and metrics
/// need. A trace [of the window](Self::of_window) holds no other rows, and gathers the extremes of the rows before it.
#[derive(Clone, PartialEq, Debug)]
pub struct Trace {
    clock: Clock,
    stride: u64,
    rows: usize,
    /// The first row at which the hand stands still.
    still: u64,
    kept: Vec<usize>,
    /// Indices, among the kept outputs, of mean, least and greatest value of an output.
    between: Vec<usize>,
    reals: Vec<Vec<f64>>,
    picks: Vec<usize>,
    now: Vec<i64>,
    words: Vec<Vec<i64>>,
    /// The most rows that may be held, and the outputs that a verdict may need.
    bound: Option<(usize, Vec<usize>)>,
    /// The figures gathered in a run with more rows than may be held.
    beyond: Option<Box<Beyond>>,
    /// Whether only the judged window is wanted.
    is_of_window: bool,
    /// The rows before the window, if only the window is held.
    before: Option<Box<Before>>,
    /// The number of held rows at which those before the window are let go.
    full: usize,
}

/// Rows that have been let go, because they come before the judged window.
#[derive(Clone, PartialEq, Debug)]
struct Before {
    /// Number of these rows so far.
    gone: u64,
    /// The first row of the window.
    window: u64,
    /// Least, greatest and last value of each kept output.
    extremes: Vec<[f64; 3]>,
}

/// Rows before the window that are held until they are let go together.
const TOGETHER: usize = 1 << 10;

/// Figures gathered from all rows of a run that holds only some of them.
#[derive(Clone, PartialEq, Debug)]
struct Beyond {
    /// Number of rows so far.
    came: u64,
    /// Rows from one held row to the next, a power of two.
    every: u64,
    /// Least, greatest and last value of each kept output.
    extremes: Vec<[f64; 3]>,
    judged: Vec<Streamed>,
    /// For each output with mean and extremes in rows: sum of the means, least and greatest value of the rows after the
    /// last held one.
    waiting: Vec<[f64; 3]>,
}

const NOTHING: [f64; 3] = [0.0, f64::INFINITY, f64::NEG_INFINITY];

impl Trace {
    /// Number of values, over all columns, that a bounded trace of usual size may hold: 64 MB.
    pub const USUAL: usize = 1 << 23;

    /// Creates a trace, with a row every `stride` edges, of the plant's outputs and of the nets at these indices.
    pub fn new(clock: Clock, stride: u64, kept: Vec<usize>, picks: Vec<usize>) -> Self {
        Self {
            clock,
            stride,
            rows: 0,
            still: 0,
            reals: vec![Vec::new(); kept.len()],
            kept,
            between: Vec::new(),
            now: vec![0; picks.len()],
            words: vec![Vec::new(); picks.len()],
            picks,
            bound: None,
            beyond: None,
            is_of_window: false,
            before: None,
            full: usize::MAX,
        }
    }

    /// Returns the trace for verdicts and metrics alone: it holds the rows of the judged window, and few others. Least
    /// and greatest values are still those of all rows. A run with [too many rows](Self::bounded) is held as before.
    #[must_use]
    pub fn of_window(mut self) -> Self {
        self.is_of_window = true;
        self
    }

    /// Returns the trace with mean, least and greatest value of an output, which are these columns of a row. If not all
    /// rows are held, the held ones also cover the others: the mean of their means, the least, the greatest.
    #[must_use]
    pub fn keeping(mut self, between: &[[usize; 3]]) -> Self {
        for columns in between {
            self.between.push(self.kept.len());
            self.kept.extend(columns);
        }
        self.reals.resize(self.kept.len(), Vec::new());
        self
    }

    /// Returns whether the trace keeps any column at or beyond index `reals` of a row.
    pub(crate) fn keeps_beyond(&self, reals: usize) -> bool {
        self.keeps_any(reals..usize::MAX)
    }

    /// Returns whether the trace keeps any of these columns of a row.
    pub(crate) fn keeps_any(&self, columns: Range<usize>) -> bool {
        self.kept.iter().any(|kept| columns.contains(kept))
    }

    /// Returns the trace, limited to this number of values, whatever the length of the run. A verdict may need the
    /// outputs `judged`.
    #[must_use]
    pub fn bounded(mut self, values: usize, judged: &[usize]) -> Self {
        let columns = (self.kept.len() + self.picks.len()).max(1);
        self.bound = Some(((values / columns).max(2) & !1, judged.to_vec()));
        self
    }

    /// Begins anew, with room for this number of rows, whose hand stands still from edge `still` on: the rows of an
    /// earlier run are dropped, and their memory is used again.
    pub(crate) fn begin(&mut self, rows: u64, still: u64) {
        self.still = still.div_ceil(self.stride);
        let still = self.still;
        let mut room = usize::try_from(rows).unwrap_or(0).min(1 << 20);
        (self.beyond, self.before, self.full) = (None, None, usize::MAX);
        if let Some((most, judged)) = self.bound.as_ref().filter(|(most, _)| rows > *most as u64) {
            room = *most;
            self.beyond = Some(Box::new(Beyond {
                came: 0,
                every: 1,
                extremes: vec![[f64::INFINITY, f64::NEG_INFINITY, f64::NAN]; self.kept.len()],
                judged: judged.iter().map(|index| Streamed::new(*index, rows, still)).collect(),
                waiting: vec![NOTHING; self.between.len()],
            }));
        } else if self.is_of_window {
            let Range { start, end } = window(rows, still);
            let extremes = vec![[f64::INFINITY, f64::NEG_INFINITY, f64::NAN]; self.kept.len()];
            (room, self.full) = (room.min((end - start) as usize + 2 * TOGETHER), TOGETHER);
            self.before = Some(Box::new(Before { gone: 0, window: start, extremes }));
        }
        self.rows = 0;
        self.now.fill(0);
        for column in &mut self.reals {
            column.clear();
            column.reserve_exact(room);
        }
        for column in &mut self.words {
            column.clear();
            column.reserve_exact(room);
        }
    }

    /// Takes a row of a run with more rows than may be held.
    fn beyond(&mut self, real: impl Fn(usize) -> f64, word: impl Fn(usize, i64) -> i64) {
        let beyond = self.beyond.as_deref_mut().expect("a run with more rows than may be held");
        for ([least, greatest, last], &at) in beyond.extremes.iter_mut().zip(&self.kept) {
            let x = real(at);
            (*least, *greatest, *last) = (least.min(x), greatest.max(x), x);
        }
        for judged in &mut beyond.judged {
            judged.add(beyond.came, real(judged.index));
        }
        for ([sum, least, greatest], &of) in beyond.waiting.iter_mut().zip(&self.between) {
            let [mean, low, high] = [0, 1, 2].map(|k| real(self.kept[of + k]));
            (*sum, *least, *greatest) = (*sum + mean, least.min(low), greatest.max(high));
        }
        if beyond.came.is_multiple_of(beyond.every) {
            if self.bound.as_ref().is_some_and(|(most, _)| self.rows == *most) {
                for (&of, waiting) in self.between.iter().zip(&mut beyond.waiting) {
                    join(&mut self.reals[of..of + 3], beyond.every, waiting);
                }
                self.reals.iter_mut().for_each(halve);
                self.words.iter_mut().for_each(halve);
                self.rows /= 2;
                beyond.every *= 2;
            }
            self.rows += 1;
            for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
                column.push(real(at));
            }
            let rows = if beyond.came == 0 { 1 } else { beyond.every };
            for (waiting, &of) in beyond.waiting.iter_mut().zip(&self.between) {
                let [sum, least, greatest] = std::mem::replace(waiting, NOTHING);
                for (column, value) in self.reals[of..].iter_mut().zip([sum / rows as f64, least, greatest]) {
                    let last = column.len() - 1;
                    column[last] = value;
                }
            }
            for ((column, &pick), &now) in self.words.iter_mut().zip(&self.picks).zip(&self.now) {
                column.push(word(pick, now));
            }
        }
        beyond.came += 1;
    }

    /// Lets go of the held rows before the window, once they are many.
    #[inline(always)]
    fn let_go(&mut self) {
        if self.rows >= self.full {
            self.let_go_all();
        }
    }

    #[inline(never)]
    fn let_go_all(&mut self) {
        let Some(before) = &mut self.before else { return };
        let gone = usize::try_from(before.window - before.gone).map_or(self.rows, |left| left.min(self.rows));
        for (extremes, column) in before.extremes.iter_mut().zip(&mut self.reals) {
            widen(extremes, &column[..gone]);
            column.drain(..gone);
        }
        self.words.iter_mut().for_each(|column| drop(column.drain(..gone)));
        self.rows -= gone;
        before.gone += gone as u64;
        if before.gone == before.window {
            self.full = usize::MAX;
        }
    }

    /// Lets go of the held rows before the window, and of those of `count` equal rows with these values that come
    /// before it. Returns how many of the equal rows remain.
    fn pass_still(&mut self, count: u64, values: &[f64]) -> u64 {
        self.let_go_all();
        let Some(before) = self.before.as_mut().filter(|_| self.rows == 0) else { return count };
        let gone = count.min(before.window - before.gone);
        if gone != 0 {
            for (extremes, &at) in before.extremes.iter_mut().zip(&self.kept) {
                widen(extremes, &[values[at]]);
            }
            before.gone += gone;
        }
        count - gone
    }

    /// Appends rows of outputs that move on straight lines. For a net, `all` returns the word of all rows, or `None`;
    /// then `each` is asked for the word of each row.
    #[inline]
    pub(crate) fn extend<const N: usize>(
        &mut self,
        lines: &Lines<N>,
        all: impl Fn(usize) -> Option<i64>,
        each: impl Fn(usize, &[f64; N]) -> i64,
    ) {
        debug_assert_eq!((self.came() * self.stride, self.stride), (lines.first, lines.stride));
        if self.beyond.is_some() {
            for row in 0..lines.rows {
                let values = lines.at(row);
                self.beyond(|at| values[at], |pick, _| all(pick).unwrap_or_else(|| each(pick, &values)));
            }
            return;
        }
        self.rows += lines.rows as usize;
        for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
            let (start, change) = (lines.start[at], lines.change[at]);
            // The row index is signed because processors convert many signed integers to floats at once.
            column.extend((0..lines.rows.cast_signed()).map(|row| start + change * f64::from(row)));
        }
        for (column, &pick) in self.words.iter_mut().zip(&self.picks) {
            match all(pick) {
                Some(word) => column.extend((0..lines.rows).map(|_| word)),
                None => column.extend((0..lines.rows).map(|row| each(pick, &lines.at(row)))),
            }
        }
        self.let_go();
    }

    /// Returns the number of rows from one held row to the next: 1 if all are held.
    pub fn every(&self) -> u64 {
        self.beyond.as_ref().map_or(1, |beyond| beyond.every)
    }

    /// Returns the number of rows of the run, held or not.
    pub fn came(&self) -> u64 {
        self.beyond.as_ref().map_or(self.gone() + self.rows as u64, |beyond| beyond.came)
    }

    /// Returns the number of rows before the first held row.
    fn gone(&self) -> u64 {
        self.before.as_ref().map_or(0, |before| before.gone)
    }

    /// Returns the clock edges between held rows.
    pub fn edges_apart(&self) -> u64 {
        self.every() * self.stride
    }

    /// Returns the seconds between held rows.
    pub fn interval_s(&self) -> f64 {
        (self.every() * self.stride) as f64 * self.clock.period_s()
    }

    /// Returns the number of held rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the time in seconds of a held row.
    pub fn time_s(&self, row: usize) -> f64 {
        self.clock.seconds(Cycle((self.gone() + row as u64 * self.every()) * self.stride))
    }

    /// Returns the first held row at or after a row of the run.
    pub(crate) fn held_from(&self, row: u64) -> usize {
        row.saturating_sub(self.gone()).div_ceil(self.every()) as usize
    }

    /// Returns the times in seconds of the held rows.
    pub fn times_s(&self) -> impl ExactSizeIterator<Item = f64> + Clone {
        (0..self.rows).map(|row| self.time_s(row))
    }

    /// Returns one output of the plant in the held rows, by its index in the world's list.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn real(&self, index: usize) -> &[f64] {
        &self.reals[self.column(index)]
    }

    /// Returns one output of the plant in the held rows of the judged window, after the end of a run.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn judged_rows(&self, index: usize) -> &[f64] {
        let rows = self.real(index);
        match &self.before {
            Some(before) => &rows[rows.len().min((before.window - before.gone) as usize)..],
            None => &rows[window(rows.len() as u64, self.still).start as usize..],
        }
    }

    /// Returns least, greatest and last value of an output in all rows; the last is NaN if there are none.
    fn extremes(&self, index: usize) -> [f64; 3] {
        let column = self.column(index);
        if let Some(beyond) = &self.beyond {
            return beyond.extremes[column];
        }
        let none = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        let mut extremes = self.before.as_ref().map_or(none, |before| before.extremes[column]);
        widen(&mut extremes, self.real(index));
        extremes
    }

    fn column(&self, index: usize) -> usize {
        self.kept.iter().position(|&kept| kept == index).expect("an output that the trace keeps")
    }

    /// Returns the least value of an output in all rows, held or not; infinity if there are none.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn least(&self, index: usize) -> f64 {
        self.extremes(index)[0]
    }

    /// Returns the greatest value of an output in all rows, held or not; minus infinity if there are none.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn greatest(&self, index: usize) -> f64 {
        self.extremes(index)[1]
    }

    /// Returns the greatest absolute value of an output in all rows; 0 if there are none.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn greatest_size(&self, index: usize) -> f64 {
        self.greatest(index).max(-self.least(index)).max(0.0).abs()
    }

    /// Returns the value of an output in the last row, held or not.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn last(&self, index: usize) -> Option<f64> {
        (self.came() > 0).then(|| self.extremes(index)[2])
    }

    /// Returns the figures of a verdict's window over an output; `None` if all rows are held.
    pub(crate) fn streamed(&self, index: usize) -> Option<&Streamed> {
        let beyond = self.beyond.as_ref()?;
        Some(beyond.judged.iter().find(|judged| judged.index == index).expect("an output that is judged"))
    }

    /// Returns the time in seconds of a row of the run, held or not.
    pub(crate) fn time_of_s(&self, row: u64) -> f64 {
        self.clock.seconds(Cycle(row * self.stride))
    }

    /// Returns the seconds from one row of the run to the next.
    pub(crate) fn step_s(&self) -> f64 {
        self.stride as f64 * self.clock.period_s()
    }

    /// Returns the shaft's angle of an axis in the held rows.
    ///
    /// # Panics
    ///
    /// When the trace does not keep it.
    pub fn angles_rad(&self) -> &[f64] {
        self.real(ANGLE)
    }

    /// Returns the words of the picked net number `index` in the held rows.
    pub fn words(&self, index: usize) -> &[i64] {
        &self.words[index]
    }
}

/// Adds values to their least, greatest and last value so far.
fn widen([least, greatest, last]: &mut [f64; 3], values: &[f64]) {
    let [low, high] = range(values);
    (*least, *greatest) = (least.min(low), greatest.max(high));
    *last = values.last().copied().unwrap_or(*last);
}

/// Merges every second row of mean, least and greatest value with the row before it; the last row, of `every` rows,
/// waits.
fn join(columns: &mut [Vec<f64>], every: u64, [sum, low, high]: &mut [f64; 3]) {
    let [mean, least, greatest] = columns else { unreachable!("three columns") };
    for row in (2..mean.len()).step_by(2) {
        mean[row] = 0.5 * (mean[row - 1] + mean[row]);
        least[row] = least[row].min(least[row - 1]);
        greatest[row] = greatest[row].max(greatest[row - 1]);
    }
    let last = mean.len() - 1;
    (*sum, *low, *high) = (*sum + every as f64 * mean[last], low.min(least[last]), high.max(greatest[last]));
}

/// Keeps every second value of a column, from the first.
fn halve<T: Copy>(column: &mut Vec<T>) {
    let half = column.len() / 2;
    (0..half).for_each(|row| column[row] = column[2 * row]);
    column.truncate(half);
}

/// Rows of outputs that move on straight lines.
pub(crate) struct Lines<const N: usize> {
    /// Edge of the first row.
    pub(crate) first: u64,
    /// Edges from one row to the next.
    pub(crate) stride: u64,
    /// Number of rows, below 2^31.
    pub(crate) rows: u32,
    /// The first row.
    pub(crate) start: [f64; N],
    /// The change from one row to the next.
    pub(crate) change: [f64; N],
}

impl<const N: usize> Lines<N> {
    /// Returns a row.
    #[inline(always)]
    pub(crate) fn at(&self, row: u32) -> [f64; N] {
        std::array::from_fn(|k| self.start[k] + self.change[k] * f64::from(row))
    }
}

impl Observe for Trace {
    fn relates(&self) -> bool {
        !self.picks.is_empty()
    }
    fn follows(&self, nets: Range<usize>) -> bool {
        self.picks.iter().any(|pick| nets.contains(pick))
    }

    #[inline]
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        for (now, &pick) in self.now.iter_mut().zip(&self.picks) {
            *now = words[pick];
        }
    }

    #[inline]
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        debug_assert_eq!(self.came() * self.stride, cycle.0);
        if self.beyond.is_some() {
            return self.beyond(|at| values[at], |_, now| now);
        }
        self.rows += 1;
        for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
            column.push(values[at]);
        }
        for (column, &word) in self.words.iter_mut().zip(&self.now) {
            column.push(word);
        }
        self.let_go();
    }

    #[inline]
    fn block(&mut self, first: Cycle, stride: u64, width: usize, values: &[f64]) {
        let rows = || values.chunks_exact(width);
        if self.beyond.is_some() {
            for (row, index) in rows().zip(0..) {
                self.reals(Cycle(first.0 + index * stride), row);
            }
            return;
        }
        debug_assert_eq!((self.came() * self.stride, self.stride), (first.0, stride));
        self.rows += rows().len();
        for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
            column.extend(rows().map(|row| row[at]));
        }
        for (column, &word) in self.words.iter_mut().zip(&self.now) {
            column.extend(rows().map(|_| word));
        }
        self.let_go();
    }

    #[inline]
    fn still(&mut self, first: Cycle, stride: u64, count: u64, values: &[f64]) {
        if self.beyond.is_some() {
            (0..count).for_each(|index| self.reals(Cycle(first.0 + index * stride), values));
            return;
        }
        debug_assert_eq!((self.came() * self.stride, self.stride), (first.0, stride));
        let count = if self.full == usize::MAX { count } else { self.pass_still(count, values) };
        let rows = self.rows + count as usize;
        self.rows = rows;
        for (column, &at) in self.reals.iter_mut().zip(&self.kept) {
            column.resize(rows, values[at]);
        }
        for (column, &word) in self.words.iter_mut().zip(&self.now) {
            column.resize(rows, word);
        }
    }
}
