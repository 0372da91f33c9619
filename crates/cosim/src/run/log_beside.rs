//! The log of a real device, or of another simulator, beside a run.

use std::fmt;
use std::ops::Range;

use hpu_scene::replay::{Motion, Unit};
use hpu_scene::{Experiment, Log};
use hpu_signal::{Clock, Cycle, Observe, Signal};

use crate::result::trace::ANGLE;
use crate::run::simulation::Simulation;

/// The most pairs of a row and a shift.
const MOST_PAIRS: usize = 1 << 24;

/// The reason why a log cannot be held beside a run, with what is accepted.
#[derive(Clone, PartialEq, Debug)]
pub struct LogBesideError(String);

impl fmt::Display for LogBesideError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for LogBesideError {}

/// The part of a run that is held beside the log.
#[derive(Clone, Debug)]
enum Watched {
    /// An output of the device, at this index.
    Real(usize),
    /// A net, at this index.
    Net(usize, Signal),
}

/// A `LogBeside` observes a run at the instants of a log's rows, at every shift that the log may have.
///
/// Words of nets are those at the instant, counted from the count at the run's start. Positions of the device are
/// straight between two rows of its record.
#[derive(Clone, Debug)]
pub struct LogBeside {
    clock: Clock,
    watched: Watched,
    name: &'static str,
    /// The size of one unit of what is watched, in rad or m.
    scale: f64,
    /// Times of the run in s, and measured positions in rad or m.
    rows: Vec<(f64, f64)>,
    reach: i64,
    step_s: f64,
    /// The clock edges at which a row may lie, in their order, and what was there, in the unit of what is watched.
    edges: Vec<u64>,
    seen: Vec<f64>,
    last: (u64, f64),
    /// The position at the run's start, from which nets count.
    start: Option<f64>,
    count: f64,
}

/// A log and a run at the shift at which they differ least. Positions are in rad or m.
#[derive(Clone, PartialEq, Debug)]
pub struct LogHeld {
    /// The name of what was held beside the log.
    pub column: &'static str,
    /// The steps by which the log comes later in the run.
    pub shift: i64,
    /// One step, in s.
    pub step_s: f64,
    /// The best shifts of the first and of the second half of the rows.
    pub halves: [i64; 2],
    /// The rows that were held beside the run: time of the run in s, measured, predicted.
    pub rows: Vec<[f64; 3]>,
    /// Rows that are outside the run at one of the shifts.
    pub left_out: usize,
    /// Root mean square of predicted less measured.
    pub rms: f64,
    /// Mean of predicted less measured.
    pub mean: f64,
    /// The greatest difference.
    pub greatest: f64,
}

impl LogBeside {
    /// Returns the size of a count of the encoder whose position is held beside a log, in rad or m.
    ///
    /// # Errors
    ///
    /// No log can be held beside a run of this scene.
    pub fn count(scene: &Experiment) -> Result<f64, LogBesideError> {
        match scene {
            Experiment::Axis(scene) => Ok(scene.encoder.count_rad()),
            Experiment::Dut(scene) => Ok(scene.encoder.count_rad()),
            Experiment::Paddle(scene) => Ok(scene.encoder.count_rad()),
            Experiment::Foc(scene) => Ok(scene.encoder.count_rad()),
            _ => {
                let reason = "a log is held beside the one position of an axis; this device has several";
                Err(LogBesideError(reason.into()))
            }
        }
    }

    /// Prepares a run for a log. `count` is the size of an encoder's count, in rad or m.
    ///
    /// # Errors
    ///
    /// The log cannot be held beside this run.
    pub fn new(simulation: &dyn Simulation, count: f64, log: &Log, motion: &Motion) -> Result<Self, LogBesideError> {
        let is_counts = matches!(motion, Motion::Counts(_));
        let (watched, name, scale) = watched(simulation, count, log.column.as_deref(), is_counts)?;
        let rows: Vec<(f64, f64)> = match motion {
            Motion::Positions(rows) => rows.clone(),
            Motion::Counts(rows) => {
                // A position is anywhere in its count: beside one, the middle is taken.
                let part = if matches!(watched, Watched::Real(_)) { 0.5 } else { 0.0 };
                rows.iter().map(|(time_s, number)| (*time_s, (*number as f64 + part) * count)).collect()
            }
        };
        let least_s = rows.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(f64::INFINITY, f64::min);
        let step_s = log.step_s.unwrap_or(if least_s.is_finite() { least_s } else { simulation.clock().period_s() });
        let reach = i64::from(log.shift);
        let pairs = rows.len().saturating_mul(2 * log.shift as usize + 1);
        if pairs > MOST_PAIRS {
            let reason = format!("{} rows at {} shifts; at most {MOST_PAIRS} together", rows.len(), 2 * reach + 1);
            return Err(LogBesideError(reason));
        }
        let clock = simulation.clock();
        let (edges, seen, last, start) = (Vec::new(), Vec::new(), (0, f64::NAN), None);
        let mut beside = Self { clock, watched, name, scale, rows, reach, step_s, edges, seen, last, start, count };
        let all = beside.rows.iter().flat_map(|(time_s, _)| (-reach..=reach).map(|shift| (*time_s, shift)));
        let mut edges: Vec<u64> = all.filter_map(|(time_s, shift)| beside.edge(time_s, shift)).collect();
        edges.sort_unstable();
        edges.dedup();
        beside.edges = edges;
        Ok(beside)
    }

    /// Returns the clock edge of a row at a shift; `None` before the run.
    fn edge(&self, time_s: f64, shift: i64) -> Option<u64> {
        let edge = ((time_s + shift as f64 * self.step_s) * self.clock.frequency_hz() as f64).round();
        (0.0..u64::MAX as f64).contains(&edge).then_some(edge as u64)
    }

    /// Fills in what lies before an edge, from the value before it on.
    fn fill(&mut self, edge: u64, between: impl Fn(u64) -> f64) {
        while let Some(&next) = self.edges.get(self.seen.len())
            && next < edge
        {
            self.seen.push(between(next));
        }
    }

    /// Returns the log and the run, which ended at an edge, at a shift, or at the nearest one that the log may have.
    /// Without one it is the shift at which they differ least; of alike shifts the least.
    ///
    /// # Errors
    ///
    /// No row lies in the run at every shift, so nothing can be told.
    pub fn finish(mut self, end: Cycle, shift: Option<i64>) -> Result<LogHeld, LogBesideError> {
        let (last_edge, last) = self.last;
        match self.watched {
            Watched::Net(..) => self.fill(end.0 + 1, |_| last),
            Watched::Real(_) => self.fill(last_edge + 1, |_| last),
        }
        let from = match self.watched {
            Watched::Net(..) => (self.start.unwrap_or(0.0) / self.count).floor() * self.count,
            Watched::Real(_) => 0.0,
        };
        let predicted = |time_s: f64, shift: i64| {
            let at = self.edges.binary_search(&self.edge(time_s, shift)?).ok()?;
            self.seen.get(at).map(|value| value * self.scale + from)
        };
        let all = self.rows.iter();
        let held: Vec<(f64, f64)> = all
            .filter(|(time_s, _)| [-self.reach, self.reach].iter().all(|shift| predicted(*time_s, *shift).is_some()))
            .copied()
            .collect();
        if held.is_empty() {
            let reason = "no row of the log lies in the run at every shift; write a longer run.duration, or another \
                          offset";
            return Err(LogBesideError(reason.into()));
        }
        let squares = |rows: &[(f64, f64)], shift: i64| -> f64 {
            let off = |(time_s, value): &(f64, f64)| predicted(*time_s, shift).unwrap_or(f64::NAN) - value;
            rows.iter().map(|row| off(row).powi(2)).sum()
        };
        let best = |rows: &[(f64, f64)]| -> i64 {
            let mut shifts: Vec<i64> = (-self.reach..=self.reach).collect();
            shifts.sort_by_key(|shift| shift.abs());
            let mut least = (f64::INFINITY, 0);
            for shift in shifts {
                let sum = squares(rows, shift);
                least = if sum < least.0 { (sum, shift) } else { least };
            }
            least.1
        };
        let shift = shift.map_or_else(|| best(&held), |shift| shift.clamp(-self.reach, self.reach));
        let halves = held.split_at(held.len() / 2);
        let halves = [best(halves.0), best(halves.1)];
        let moved_s = shift as f64 * self.step_s;
        let rows: Vec<[f64; 3]> = held
            .iter()
            .filter_map(|(time_s, value)| Some([time_s + moved_s, *value, predicted(*time_s, shift)?]))
            .collect();
        let off = || rows.iter().map(|[_, measured, predicted]| predicted - measured);
        Ok(LogHeld {
            column: self.name,
            shift,
            step_s: self.step_s,
            halves,
            left_out: self.rows.len() - rows.len(),
            rms: (squares(&held, shift) / rows.len() as f64).sqrt(),
            mean: off().sum::<f64>() / rows.len() as f64,
            greatest: off().map(f64::abs).fold(0.0, f64::max),
            rows,
        })
    }
}

/// Returns what is held beside a log, its name, and the size of one unit of it in rad or m.
fn watched(
    simulation: &dyn Simulation,
    count: f64,
    asked: Option<&str>,
    is_counts: bool,
) -> Result<(Watched, &'static str, f64), LogBesideError> {
    let reals = simulation.reals();
    let place = reals.get(ANGLE).filter(|_| simulation.has_device()).map(|real| real.name);
    let unit = if place.is_some_and(|name| name.ends_with("_m")) { Unit::Length } else { Unit::Angle };
    let size = |net: &Signal| match net.unit {
        "count" => Some(count),
        other => unit.size(other),
    };
    let nets: Vec<(usize, Signal, f64)> = simulation
        .nets()
        .into_iter()
        .enumerate()
        .filter_map(|(at, net)| size(&net).map(|size| (at, net, size)))
        .collect();
    let is_place = |asked: &str| {
        place.is_some_and(|name| name == asked || name.rsplit_once('_').is_some_and(|(stem, _)| stem == asked))
    };
    let counter = || nets.iter().find(|(_, net, _)| net.name == "position");
    let net = match asked {
        None if is_counts => counter(),
        None => None,
        Some(asked) => nets.iter().find(|(_, net, _)| net.name == asked),
    };
    match (net, asked, place) {
        (Some((at, net, size)), ..) => Ok((Watched::Net(*at, net.clone()), net.name, *size)),
        (None, None, Some(name)) => Ok((Watched::Real(ANGLE), name, 1.0)),
        (None, Some(asked), Some(name)) if is_place(asked) => Ok((Watched::Real(ANGLE), name, 1.0)),
        _ => {
            let names: Vec<_> = place.into_iter().chain(nets.iter().map(|(_, net, _)| net.name)).collect();
            let asked = asked.map_or("no position of the device".into(), |asked| format!("`{asked}` is no position"));
            Err(LogBesideError(format!("{asked}; write column as one of {}", names.join(", "))))
        }
    }
}

impl Observe for LogBeside {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        let Watched::Net(at, signal) = &self.watched else { return };
        let now = signal.shown(words[*at]);
        let last = self.last.1;
        self.fill(cycle.0, |_| last);
        self.last = (cycle.0, now);
    }

    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        let Watched::Real(at) = self.watched else {
            self.start.get_or_insert(values[ANGLE]);
            return;
        };
        let (from, was) = self.last;
        let (to, now) = (cycle.0, values[at]);
        self.fill(to, |edge| {
            let share = (edge - from) as f64 / (to - from) as f64;
            libm::fma(share, now - was, was)
        });
        self.last = (to, now);
    }

    fn follows(&self, nets: Range<usize>) -> bool {
        matches!(self.watched, Watched::Net(at, _) if nets.contains(&at))
    }

    fn relates(&self) -> bool {
        false
    }
}
