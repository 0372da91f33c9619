//! Parameters of a device from logs of it.
//!
//! The least sum of squared differences between runs and logs, in counts, over some keys of a scene. The steps of a
//! quantiser make that sum a staircase, so slopes are secants over distances at which the runs differ by a part of a
//! count to some counts, and the optimum is where these slopes call the sum least: the mean of many steps, which
//! scatters less than the lowest place.
//!
//! Intervals allow for differences that last for many rows (`scatter.rs`), and for a sum that is rough by more than
//! these tell; the naive ones of independent rows stand beside them. Each key is moved away from its optimum, the
//! others following, to see on which sides the sum rises at all.

pub mod logs;

mod scatter;
mod solve;

use crate::Error;
use scatter::Scatter;
use solve::{Matrix, inverse};

/// Duration of the windows in which the differences of a log are looked at, in s.
const WINDOW_S: f64 = 0.04;
/// Greatest change in one step, as a difference of logarithms.
const STRIDE: f64 = 0.4;
/// The farthest that a profile goes, as a difference of logarithms: four times and a quarter of the optimum.
const FARTHEST: f64 = 1.386_294_4;
/// Change of the runs, in counts rms, over which a secant is taken: at least, and at most.
const SECANT: [f64; 2] = [0.25, 4.0];
/// The last steps, at most.
const POLISHES: usize = 3;
/// The roughness of a sum that intervals allow for, at most: a sum near 0 has no other share.
const MOST_ROUGH: f64 = 0.25;
/// By how much steps may raise the sum at an optimum.
const ROUGH: f64 = 1.1;
/// The most steps by which logs are shifted, all together.
const MOST_SHIFTS: usize = 20;

/// A key that is free.
#[derive(Clone, PartialEq, Debug)]
pub struct Free {
    /// The key.
    pub key: String,
    /// Its value at the start, which is not 0. The key keeps its sign.
    pub start: f64,
    /// The least and the greatest value that it may have.
    pub bounds: (f64, f64),
}

impl Free {
    /// Returns the value whose size has this logarithm, within the bounds.
    fn value(&self, at: f64) -> f64 {
        libm::exp(at).copysign(self.start).clamp(self.bounds.0, self.bounds.1)
    }
}

/// The rows of one log.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Rows {
    /// Times, in s.
    pub times_s: Vec<f64>,
    /// The run less the log, in counts.
    pub off: Vec<f64>,
    /// The steps by which the log comes later in the run.
    pub shift: i64,
}

/// The sides on which the sum of squares rises with a key, up to 95 %.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Bound {
    /// Both: the interval.
    Both(f64, f64),
    /// Below alone: the key is at least this.
    Lower(f64),
    /// Above alone: the key is at most this.
    Upper(f64),
    /// Neither: the logs do not tell the key.
    None,
}

/// An identified key.
#[derive(Clone, PartialEq, Debug)]
pub struct Found {
    /// The key.
    pub key: String,
    /// Its value at the start.
    pub start: f64,
    /// Its optimum.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// The 95 % quantile of Student's distribution, both sides: the interval reaches so many standard deviations.
    pub quantile: f64,
    /// That of independent rows, which is too small.
    pub naive_sd: f64,
    /// The sides on which the sum of squares rises.
    pub bound: Bound,
    /// Whether the optimum lies at a bound of the key.
    pub is_at_bound: bool,
    /// Values of the key, in their order, and by how many times the sum is larger there with the other keys at their
    /// best.
    pub profile: Vec<(f64, f64)>,
}

/// How one log was met.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Met {
    /// Rows.
    pub rows: usize,
    /// The steps by which the log comes later in the run.
    pub shift: i64,
    /// Root mean square of the difference, in counts.
    pub rms: f64,
    /// Correlation of a row's difference with that of the next row.
    pub correlation: f64,
    /// The window that is met worst: its begin and end in s.
    pub worst_s: [f64; 2],
    /// Root mean square of the difference there, in counts.
    pub worst_rms: f64,
    /// Median of that of all windows.
    pub usual_rms: f64,
}

impl Met {
    /// Returns how a log was met.
    pub fn of(rows: &Rows) -> Self {
        let Rows { times_s, off, shift } = rows;
        let count = off.len().max(1) as f64;
        let mean = off.iter().sum::<f64>() / count;
        let power: f64 = off.iter().map(|off| (off - mean).powi(2)).sum();
        let with_next: f64 = off.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
        let rms = |off: &[f64]| (off.iter().map(|off| off * off).sum::<f64>() / off.len().max(1) as f64).sqrt();
        let start = times_s.first().copied().unwrap_or(0.0);
        let window = |time_s: &f64| ((time_s - start) / WINDOW_S) as u64;
        let mut at = 0;
        let mut windows: Vec<([f64; 2], f64)> = times_s
            .chunk_by(|one, other| window(one) == window(other))
            .map(|times_s| {
                at += times_s.len();
                ([times_s[0], times_s[times_s.len() - 1]], rms(&off[at - times_s.len()..at]))
            })
            .collect();
        windows.sort_by(|one, other| one.1.total_cmp(&other.1));
        let (worst_s, worst_rms) = windows.last().copied().unwrap_or_default();
        let usual_rms = windows.get(windows.len() / 2).map_or(0.0, |(_, rms)| *rms);
        let correlation = if power > 0.0 { with_next / power } else { 0.0 };
        Self { rows: off.len(), shift: *shift, rms: rms(off), correlation, worst_s, worst_rms, usual_rms }
    }

    /// Whether the model leaves something out that the log has. The differences are not at random, and have more than
    /// two counts, or more than five in a window and four times what is usual.
    pub fn is_rejected(&self) -> bool {
        self.correlation > 0.5 && (self.rms > 2.0 || self.worst_rms > (4.0 * self.usual_rms).max(5.0))
    }
}

/// Keys as the logs tell them, and how well the logs are met.
#[derive(Clone, PartialEq, Debug)]
pub struct Identified {
    /// The keys.
    pub found: Vec<Found>,
    /// Correlations of the keys.
    pub correlations: Vec<Vec<f64>>,
    /// How each log was met at the start, and at the optimum.
    pub met: Vec<(Met, Met)>,
    /// The rows of each log at the optimum.
    pub rows: Vec<Rows>,
    /// Sets of runs that were made.
    pub sets: usize,
}

/// Runs all scenes with these values of the free keys, and returns the rows of their logs; `None` when stopped. The
/// logs are shifted by these numbers of steps, as far as they may be; `None` for those that meet the runs best.
pub type Runs<'a> = &'a mut dyn FnMut(&[f64], Option<&[i64]>) -> Result<Option<Vec<Rows>>, Error>;

/// Identifies keys: the least sum of squares, its intervals and profiles. Returns `None` when stopped.
///
/// # Errors
///
/// An error of a run; a key that is 0 or has no effect; fewer rows than keys.
pub fn identify(free: &[Free], runs: Runs) -> Result<Option<Identified>, Error> {
    if let Some(Free { key, .. }) = free.iter().find(|free| free.start == 0.0) {
        return Err(Error::new(format!("{key} starts at 0; set a start of its size and sign: --set {key}=...")));
    }
    let mut search = Search { free, runs, sets: 0, shifts: None, rough: Vec::new() };
    match search.identify() {
        Ok(found) => Ok(Some(found)),
        Err(Ended::Stopped) => Ok(None),
        Err(Ended::Failed(error)) => Err(error),
    }
}

/// Why a search ends without a result.
enum Ended {
    Stopped,
    Failed(Error),
}

/// A place of the search: logarithms of the keys' sizes, and the rows there.
#[derive(Clone)]
struct Place {
    at: Vec<f64>,
    rows: Vec<Rows>,
    sum: f64,
}

/// Slopes at a place: one row a difference, one column a key; in counts for one unit of the logarithm.
type Slopes = Vec<Vec<f64>>;

struct Search<'a, 'r> {
    free: &'a [Free],
    runs: Runs<'r>,
    sets: usize,
    /// The shifts of the logs; none while each run finds its own.
    shifts: Option<Vec<i64>>,
    /// By what share the sum lies beside what the slopes expect, along each key or at most keys, at the last place with
    /// slopes: 0 of a smooth sum.
    rough: Vec<f64>,
}

impl Search<'_, '_> {
    fn place(&mut self, at: &[f64]) -> Result<Place, Ended> {
        let inside = |(at, free): (&f64, &Free)| free.value(*at);
        let values: Vec<f64> = at.iter().zip(self.free).map(inside).collect();
        self.sets += 1;
        let rows = (self.runs)(&values, self.shifts.as_deref()).map_err(Ended::Failed)?.ok_or(Ended::Stopped)?;
        let sum = rows.iter().flat_map(|rows| &rows.off).map(|off| off * off).sum();
        Ok(Place { at: values.iter().map(|value| libm::log(value.abs())).collect(), rows, sum })
    }

    fn moved(&mut self, from: &Place, key: usize, by: f64) -> Result<Place, Ended> {
        let mut at = from.at.clone();
        at[key] += by;
        self.place(&at)
    }

    /// Returns the secants around a place. `over` are their half lengths, which are made longer or shorter until the
    /// runs differ as [`SECANT`] says, and kept.
    fn slopes(&mut self, at: &Place, over: &mut [f64]) -> Result<Slopes, Ended> {
        let (mut columns, mut rough) = (Vec::new(), Vec::new());
        for (key, over) in over.iter_mut().enumerate() {
            let mut tries = 0;
            let (above, below, apart, length) = loop {
                let (above, below) = (self.moved(at, key, *over)?, self.moved(at, key, -*over)?);
                let length = above.at[key] - below.at[key];
                let apart = apart(&above.rows, &below.rows);
                let rms = (apart.iter().map(|off| off * off).sum::<f64>() / apart.len() as f64).sqrt();
                tries += 1;
                if tries == 6 || (SECANT[0]..=SECANT[1]).contains(&rms) {
                    break (above, below, apart, length);
                }
                let wanted = if rms < SECANT[0] { *over * 3.0 } else { *over / 3.0 };
                let wanted = wanted.clamp(1e-5, 0.5);
                if wanted == *over {
                    break (above, below, apart, length);
                }
                *over = wanted;
            };
            if apart.iter().all(|off| *off == 0.0) || length == 0.0 {
                let key = &self.free[key].key;
                let reason = format!("{key} has no effect on the runs; leave it out of --free");
                return Err(Ended::Failed(Error::new(reason)));
            }
            let column: Vec<f64> = apart.iter().map(|off| off / length).collect();
            // Where a limit is near on one side, the other one tells how rough the sum is.
            let beside = [above, below].map(|place| {
                let by = place.at[key] - at.at[key];
                let along = at.rows.iter().flat_map(|rows| &rows.off).zip(&column);
                let expected: f64 = along.map(|(off, slope)| (off + by * slope).powi(2)).sum();
                (place.sum / expected - 1.0).abs()
            });
            rough.push(beside[0].min(beside[1]).min(MOST_ROUGH));
            columns.push(column);
        }
        let mut sorted = rough.clone();
        sorted.sort_by(f64::total_cmp);
        self.rough = rough.iter().map(|own| own.max(sorted[(rough.len() - 1) / 2])).collect();
        Ok((0..columns[0].len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect())
    }

    /// Returns a better place by one step along the slopes of the keys that are not held, if one is found.
    fn step(
        &mut self,
        from: &Place,
        slopes: &Slopes,
        held: Option<usize>,
        damping: &mut f64,
    ) -> Result<Option<Place>, Ended> {
        let keys: Vec<usize> = (0..self.free.len()).filter(|key| Some(*key) != held).collect();
        if keys.is_empty() {
            return Ok(None);
        }
        let (normal, slope) = normal(slopes, &from.rows, &keys);
        for _ in 0..5 {
            let mut damped = normal.clone();
            (0..keys.len()).for_each(|key| damped[key][key] *= 1.0 + *damping);
            if let Some(inverse) = inverse(&damped) {
                let mut at = from.at.clone();
                for (row, key) in keys.iter().enumerate() {
                    let by: f64 = inverse[row].iter().zip(&slope).map(|(a, b)| a * b).sum();
                    at[*key] -= by.clamp(-STRIDE, STRIDE);
                }
                let place = self.place(&at)?;
                if place.sum < from.sum {
                    *damping = (*damping / 10.0).max(1e-6);
                    return Ok(Some(place));
                }
            }
            *damping *= 10.0;
        }
        Ok(None)
    }

    /// Moves to where the slopes call the sum least, though a lucky place may be lower. Quantised feedback makes the
    /// sum a staircase, on which the lowest place lies where the steps happen to be; the slopes are the mean of many
    /// steps.
    fn polish(&mut self, mut best: Place, mut slopes: Slopes, over: &mut [f64]) -> Result<(Place, Slopes), Ended> {
        let keys: Vec<usize> = (0..self.free.len()).collect();
        for _ in 0..POLISHES {
            let (normal, slope) = normal(&slopes, &best.rows, &keys);
            let Some(inverse) = inverse(&normal) else { break };
            let mut at = best.at.clone();
            for (at, row) in at.iter_mut().zip(&inverse) {
                *at -= row.iter().zip(&slope).map(|(a, b)| a * b).sum::<f64>().clamp(-STRIDE, STRIDE);
            }
            let place = self.place(&at)?;
            if place.sum > ROUGH * best.sum {
                break;
            }
            best = place;
            slopes = self.slopes(&best, over)?;
        }
        Ok((best, slopes))
    }

    /// Goes down along slopes until nothing is gained, and returns the place and the slopes there.
    fn descend(&mut self, mut best: Place, over: &mut [f64]) -> Result<(Place, Slopes), Ended> {
        let mut damping = 1e-3;
        let mut slopes = self.slopes(&best, over)?;
        for _ in 0..20 {
            let Some(place) = self.step(&best, &slopes, None, &mut damping)? else { break };
            let gain = 1.0 - place.sum / best.sum;
            best = place;
            slopes = self.slopes(&best, over)?;
            if gain < 1e-4 {
                break;
            }
        }
        Ok((best, slopes))
    }

    /// Shifts a log by a step if that, with the keys following, lets the sum fall; `None` if no log is to be shifted.
    fn shifted(&mut self, best: &Place, slopes: &Slopes) -> Result<Option<Place>, Ended> {
        let keys: Vec<usize> = (0..self.free.len()).collect();
        let left = |place: &Place| {
            let (normal, slope) = normal(slopes, &place.rows, &keys);
            let taken = inverse(&normal).map_or(0.0, |inverse| {
                let along = |row: &Vec<f64>| row.iter().zip(&slope).map(|(a, b)| a * b).sum::<f64>();
                inverse.iter().zip(&slope).map(|(row, slope)| slope * along(row)).sum()
            });
            place.sum - taken
        };
        let shifts: Vec<i64> = best.rows.iter().map(|rows| rows.shift).collect();
        for log in 0..shifts.len() {
            for by in [-1, 1] {
                let mut moved = shifts.clone();
                moved[log] += by;
                self.shifts = Some(moved.clone());
                let place = self.place(&best.at)?;
                if place.rows[log].shift == moved[log] && left(&place) < 0.999 * left(best) {
                    return Ok(Some(place));
                }
            }
        }
        self.shifts = Some(shifts);
        Ok(None)
    }

    fn identify(&mut self) -> Result<Identified, Ended> {
        let start = self.place(&self.free.iter().map(|free| libm::log(free.start.abs())).collect::<Vec<_>>())?;
        let rows: usize = start.rows.iter().map(|rows| rows.off.len()).sum();
        if rows <= self.free.len() {
            let reason = format!("{rows} rows for {} keys; give longer logs, or fewer keys", self.free.len());
            return Err(Ended::Failed(Error::new(reason)));
        }
        self.shifts = Some(start.rows.iter().map(|rows| rows.shift).collect());
        let mut over = vec![0.01; self.free.len()];
        let (mut best, mut slopes) = self.descend(start.clone(), &mut over)?;
        for _ in 0..MOST_SHIFTS {
            let Some(place) = self.shifted(&best, &slopes)? else { break };
            (best, slopes) = self.descend(place, &mut over)?;
        }
        (best, slopes) = self.polish(best, slopes, &mut over)?;
        let scatter = Scatter::new(&slopes, &best.rows);
        let mut found = Vec::new();
        for (key, free) in self.free.iter().enumerate() {
            let (sd, quantile) = (scatter.sds[key], scatter.quantiles[key]);
            let most = 1.0 + quantile.powi(2) / scatter.effective[key] + 2.0 * self.rough[key];
            let (bound, profile) = self.profile(&best, &slopes, key, (sd, most))?;
            let value = free.value(best.at[key]);
            // Steps of the sum can end a profile too early.
            let bound = match bound {
                Bound::Both(low, high) => {
                    let reach = [-1.0, 1.0].map(|side| free.value(best.at[key] + side * quantile * sd));
                    Bound::Both(reach[0].min(reach[1]).min(low), reach[0].max(reach[1]).max(high))
                }
                bound => bound,
            };
            let [sd, naive_sd] = [sd, scatter.naive[key]].map(|sd| value.abs() * sd);
            let is_at_bound = [free.bounds.0, free.bounds.1].contains(&value);
            let (key, start) = (free.key.clone(), free.start);
            found.push(Found { key, start, value, sd, quantile, naive_sd, bound, is_at_bound, profile });
        }
        let met = start.rows.iter().zip(&best.rows).map(|(start, best)| (Met::of(start), Met::of(best))).collect();
        Ok(Identified { found, correlations: scatter.correlations, met, rows: best.rows, sets: self.sets })
    }

    /// Moves a key away from its best value, the other keys following, until the sum has risen to `most` times the
    /// least or the key is far away. Returns the sides on which it rises, and all places.
    fn profile(
        &mut self,
        best: &Place,
        slopes: &Slopes,
        key: usize,
        (sd, most): (f64, f64),
    ) -> Result<(Bound, Vec<(f64, f64)>), Ended> {
        let all = self.free;
        let free = &all[key];
        let mut profile = vec![(free.value(best.at[key]), 1.0)];
        let direction = followed(slopes, &best.rows, key);
        let mut ends = [None, None];
        for (side, end) in [-1.0, 1.0].into_iter().zip(&mut ends) {
            // How the sum has risen at a distance, with the other keys at their best.
            let mut risen = |distance: f64| -> Result<(f64, f64), Ended> {
                let by = side * distance;
                let at: Vec<f64> = best.at.iter().zip(&direction).map(|(at, along)| at + by * along).collect();
                let mut place = self.place(&at)?;
                let mut damping = 1e-6;
                for _ in 0..2 {
                    let Some(better) = self.step(&place, slopes, Some(key), &mut damping)? else { break };
                    place = better;
                }
                let ratio = place.sum / best.sum;
                profile.push((free.value(place.at[key]), ratio));
                Ok(((place.at[key] - best.at[key]).abs(), ratio))
            };
            let (mut inside, mut distance) = ((0.0, 1.0), sd.clamp(1e-4, FARTHEST / 16.0));
            // A step of a rough sum may reach as far up, and the sum fall again: what lies farther has to be as high.
            let mut above = None;
            let mut outside = loop {
                let (reached, ratio) = risen(distance)?;
                if ratio < most {
                    (inside, above) = ((reached, ratio), None);
                } else if above.is_some() {
                    break above;
                } else {
                    above = Some((reached, ratio));
                }
                if distance >= FARTHEST || reached < 0.999 * distance {
                    break above;
                }
                distance = (distance * 1.8).min(FARTHEST);
            };
            // Most sums rise as a square, but a limit that the motion does not reach costs nothing up to a point.
            let root = |ratio: f64| (ratio.max(1.0) - 1.0).sqrt();
            let crossing = |inside: (f64, f64), outside: (f64, f64)| {
                let (low, high) = (root(inside.1), root(outside.1));
                let share = if high > low { ((root(most) - low) / (high - low)).clamp(0.1, 0.9) } else { 0.5 };
                inside.0 + share * (outside.0 - inside.0)
            };
            for _ in 0..4 {
                let Some(far) = outside.filter(|far| far.0 - inside.0 > 0.02 * far.0) else { break };
                let (reached, ratio) = risen(crossing(inside, far))?;
                if (root(ratio) / root(most) - 1.0).abs() < 0.02 {
                    (inside, outside) = ((reached, ratio), Some((reached, ratio)));
                } else if ratio >= most {
                    outside = Some((reached, ratio));
                } else {
                    inside = (reached, ratio);
                }
            }
            *end = outside.map(|outside| free.value(best.at[key] + side * crossing(inside, outside)));
        }
        profile.sort_by(|one, other| one.0.total_cmp(&other.0));
        if free.start < 0.0 {
            ends.reverse();
        }
        let bound = match ends {
            [Some(low), Some(high)] => Bound::Both(low, high),
            [Some(low), None] => Bound::Lower(low),
            [None, Some(high)] => Bound::Upper(high),
            [None, None] => Bound::None,
        };
        Ok((bound, profile))
    }
}

/// Returns the direction in which a key moves by one and the others so that the sum rises least.
fn followed(slopes: &Slopes, rows: &[Rows], key: usize) -> Vec<f64> {
    let count = slopes[0].len();
    let (all, others): (Vec<usize>, Vec<usize>) = ((0..count).collect(), (0..count).filter(|at| *at != key).collect());
    let (of_all, _) = normal(slopes, rows, &all);
    let (of_others, _) = normal(slopes, rows, &others);
    let mut direction = vec![0.0; count];
    direction[key] = 1.0;
    if let Some(inverse) = inverse(&of_others) {
        for (row, other) in inverse.iter().zip(&others) {
            direction[*other] = -row.iter().zip(&others).map(|(a, other)| a * of_all[*other][key]).sum::<f64>();
        }
    }
    direction
}

/// Returns the differences of two sets of rows.
fn apart(one: &[Rows], other: &[Rows]) -> Vec<f64> {
    let offs =
        |rows: &Rows, other: &Rows| -> Vec<f64> { rows.off.iter().zip(&other.off).map(|(a, b)| a - b).collect() };
    one.iter().zip(other).flat_map(|(rows, other)| offs(rows, other)).collect()
}

/// Returns the normal matrix of some keys, and the slope of half of the sum.
fn normal(slopes: &Slopes, rows: &[Rows], keys: &[usize]) -> (Matrix, Vec<f64>) {
    let mut normal = vec![vec![0.0; keys.len()]; keys.len()];
    let mut slope = vec![0.0; keys.len()];
    for (slopes, off) in slopes.iter().zip(rows.iter().flat_map(|rows| &rows.off)) {
        for (row, one) in keys.iter().enumerate() {
            slope[row] += slopes[*one] * off;
            for (column, other) in keys.iter().enumerate() {
                normal[row][column] += slopes[*one] * slopes[*other];
            }
        }
    }
    (normal, slope)
}
