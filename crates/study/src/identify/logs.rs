//! Runs of scenes beside their logs.

use std::thread;

use hpu_cosim::replay::{Motion, Taken, Unit};
use hpu_cosim::scene::keys::{KeyRow, Takes, is_any_name, rows};
use hpu_cosim::scene::{Experiment, Log, ParameterValue};
use hpu_cosim::{Control, Driver, LogBeside, LogBesideError, LogHeld, SceneFile, Simulation, Trace, Wired};
use hpu_signal::Cycle;

use super::{Free, Rows};
use crate::map::any_simulation;
use crate::{Error, Kind};

/// Changes of keys: overrides.
type Set = Vec<(String, String)>;

/// By how many times a log may move farther than its run, or less far, before its unit is doubted.
const FARTHEST: f64 = 20.0;

/// A log, and the scene whose run is held beside it.
pub struct LogRun {
    /// The name of the log's file.
    pub file: String,
    /// The part of the file that was read.
    pub taken: Taken,
    /// The unit of positions, rad or m.
    pub unit: &'static str,
    /// The size of an encoder's count in it.
    pub count: f64,
    scene: SceneFile,
    set: Set,
    log: Log,
    motion: Motion,
}

impl LogRun {
    /// Reads a log for a scene under overrides: the log that the scene names, or another one, read as the scene says.
    ///
    /// # Errors
    ///
    /// The scene's errors; a scene that names no log, or whose device has several positions; the log's errors with its
    /// name and line.
    pub fn open(scene: SceneFile, set: Set, other: Option<(String, Vec<u8>)>) -> Result<Self, Error> {
        let experiment = scene.parse(&set)?;
        let named = experiment.expect.recording.clone();
        let failed = |reason: String| Error::new(experiment.error("expect.recording", reason));
        let (file, bytes) = match (other, &named) {
            (Some(other), _) => other,
            (None, Some(log)) => {
                let bytes = scene.load(&log.file);
                (log.file.clone(), bytes.map_err(|error| failed(format!("cannot read `{}`: {error}", log.file)))?)
            }
            (None, None) => {
                let reason = "no log; name one behind the scene, or in its [expect.recording]";
                return Err(Error::of(Kind::Usage, format_args!("{}: {reason}", scene.name)));
            }
        };
        let mut log = named.unwrap_or_default();
        let count = LogBeside::count(&experiment).map_err(|error| failed(error.to_string()))?;
        let unit = experiment.setup().units().position;
        let kind = if unit == "m" { Unit::Length } else { Unit::Angle };
        let (mut motion, taken) = log.read(&bytes, kind).map_err(|error| Error::new(format!("{file}:{error}")))?;
        if let Motion::Counts(counts) = &motion
            && let Some(step) = coarser(counts)
        {
            let reason = format!(
                "all {} counts are {step} apart, or a multiple of it, which the scene's encoder would not give; \
                 write the lines, or the resolution, of the encoder that made the log",
                counts.len()
            );
            return Err(Error::new(format!("{file}: {reason}")));
        }
        // The middle of a count beside the position itself: a sum of squares without the steps of this quantiser.
        if let (Motion::Counts(counts), None) = (&motion, &log.column) {
            let middle = |(time_s, number): &(f64, i64)| (*time_s, (*number as f64 + 0.5) * count);
            motion = Motion::Positions(counts.iter().map(middle).collect());
        }
        log.file.clone_from(&file);
        Ok(Self { file, taken, unit, count, scene, set, log, motion })
    }

    /// Runs the scene with keys changed. Returns it beside its log at a shift, or at the best one; `None` when stopped.
    ///
    /// # Errors
    ///
    /// An error of the scene or of its run; a log that cannot be held beside it.
    pub fn held(
        &self,
        changed: &[(String, String)],
        shift: Option<i64>,
        control: &Control,
    ) -> Result<Option<LogHeld>, Error> {
        let set: Set = self.set.iter().chain(changed).cloned().collect();
        let experiment = self.scene.parse(&set)?;
        let at_log = |reason: LogBesideError| Error::new(format!("{}: {reason}", self.file));
        let simulation = any_simulation(&experiment)?;
        let mut beside = LogBeside::new(&simulation, self.count, &self.log, &self.motion).map_err(at_log)?;
        let mut trace = simulation.verdict_trace().bounded(Trace::USUAL, &simulation.judged());
        let summary = match &simulation {
            hpu_cosim::AnySimulation::Ours(ours) => ours.run(Driver::Events, &mut trace, &mut beside, control),
            hpu_cosim::AnySimulation::Dut(dut) => {
                dut.run(true, &mut trace, &mut beside, control).map_err(Error::design)?
            }
        };
        if !summary.complete {
            return Ok(None);
        }
        beside.finish(Cycle(summary.edges), shift).map(Some).map_err(at_log)
    }

    /// Refuses a log whose motion cannot be that of the run: another unit, or steps that the sensor does not have.
    fn check(&self, held: &LogHeld) -> Result<(), Error> {
        let power = |at: usize| {
            let mean = held.rows.iter().map(|row| row[at]).sum::<f64>() / held.rows.len() as f64;
            held.rows.iter().map(|row| (row[at] - mean).powi(2)).sum::<f64>().sqrt()
        };
        let farther = power(1) / power(2);
        if farther > FARTHEST || farther < FARTHEST.recip() {
            let reason = format!("the log moves {farther:.3} times as far as the run; give the unit of its column");
            return Err(Error::new(format!("{}: {reason}", self.file)));
        }
        if held.column == "position" {
            let off = |row: &&[f64; 3]| (row[1] / self.count - (row[1] / self.count).round()).abs() > 0.01;
            if let Some([time_s, measured, _]) = held.rows.iter().find(off) {
                let counts = measured / self.count;
                let reason = format!("{counts:.3} counts at {time_s:.6} s of the run; a counter has whole counts");
                return Err(Error::new(format!("{}: {reason}", self.file)));
            }
        }
        Ok(())
    }

    /// Returns gaps of the log as they are told: rows more than five times as far apart as usual.
    pub fn gaps(&self) -> Option<String> {
        let times_s: Vec<f64> = match &self.motion {
            Motion::Positions(rows) => rows.iter().map(|row| row.0).collect(),
            Motion::Counts(rows) => rows.iter().map(|row| row.0).collect(),
        };
        let apart: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = apart.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2)?;
        let gaps: Vec<usize> = (0..apart.len()).filter(|at| apart[*at] > 5.0 * usual).collect();
        let first = *gaps.first()?;
        let of = if gaps.len() == 1 { "a gap".into() } else { format!("{} gaps, the first", gaps.len()) };
        Some(format!("{of} of {:.6} s behind row {}, of rows {usual:.6} s apart", apart[first], first + 1))
    }
}

/// Returns the step of which all changes of at least ten are multiples, if it is not 1.
fn coarser(counts: &[(f64, i64)]) -> Option<u64> {
    let changes = counts.windows(2).map(|pair| pair[1].1.abs_diff(pair[0].1)).filter(|change| *change > 0);
    let divisor = |mut a: u64, mut b: u64| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let (step, found) = changes.fold((0, 0), |(step, found), change| (divisor(step, change), found + 1));
    (found >= 10 && step > 1).then_some(step)
}

/// Runs all scenes beside their logs with keys changed; each log at its shift, or at the best one. Returns `None` when
/// stopped.
///
/// # Errors
///
/// As [`LogRun::held`].
pub fn held(
    runs: &[LogRun],
    changed: &[(String, String)],
    shifts: Option<&[i64]>,
    control: &Control,
) -> Result<Option<Vec<LogHeld>>, Error> {
    let one = |at: usize| runs[at].held(changed, shifts.map(|shifts| shifts[at]), control);
    let all: Vec<_> = thread::scope(|scope| {
        let others: Vec<_> = (1..runs.len()).map(|at| scope.spawn(move || one(at))).collect();
        let first = one(0);
        let others = others.into_iter().map(|other| other.join().unwrap_or_else(|why| std::panic::resume_unwind(why)));
        std::iter::once(first).chain(others).collect()
    });
    all.into_iter().collect()
}

/// Returns the rows of runs beside their logs, in counts.
pub fn in_counts(runs: &[LogRun], held: &[LogHeld]) -> Vec<Rows> {
    let rows = |(run, held): (&LogRun, &LogHeld)| {
        let off = held.rows.iter().map(|[_, measured, predicted]| (predicted - measured) / run.count).collect();
        Rows { times_s: held.rows.iter().map(|row| row[0]).collect(), off, shift: held.shift }
    };
    runs.iter().zip(held).map(rows).collect()
}

/// Returns overrides that give keys these values.
pub fn changed(free: &[Free], values: &[f64]) -> Vec<(String, String)> {
    free.iter().zip(values).map(|(free, value)| (free.key.clone(), format!("{value:?}"))).collect()
}

/// Identifies keys from logs, as [`identify`](super::identify); `None` when stopped.
///
/// # Errors
///
/// As [`identify`](super::identify) and [`LogRun::held`]; a log in another unit, or with steps that the sensor does not
/// have.
pub fn identify(free: &[Free], runs: &[LogRun], control: &Control) -> Result<Option<super::Identified>, Error> {
    let mut is_first = true;
    super::identify(free, &mut |values, shifts| {
        let Some(held) = held(runs, &changed(free, values), shifts, control)? else { return Ok(None) };
        if std::mem::take(&mut is_first) {
            runs.iter().zip(&held).try_for_each(|(run, held)| run.check(held))?;
        }
        Ok(Some(in_counts(runs, &held)))
    })
}

impl Free {
    /// Returns a key of a scene as a free one, which starts at the scene's value.
    ///
    /// # Errors
    ///
    /// The keys with a quantity that the scene has, if this is none of them.
    pub fn of(experiment: &Experiment, key: &str) -> Result<Self, Error> {
        let number = |value: &ParameterValue| match value {
            ParameterValue::Number(value) => Some(*value),
            _ => None,
        };
        let found = experiment.parameters.iter().find(|parameter| parameter.key == key);
        let Some(start) = found.and_then(|parameter| number(&parameter.value)) else {
            let keys = experiment.parameters.iter().filter(|parameter| number(&parameter.value).is_some());
            let keys: Vec<&str> = keys.map(|parameter| parameter.key.as_str()).collect();
            let near = hpu_cosim::did_you_mean(key, &keys);
            let reason =
                format!("--free {key}: no key of this scene with a quantity; it has {}{near}", keys.join(", "));
            return Err(Error::of(Kind::Usage, reason));
        };
        let sizes = rows().filter(|row| is_of(row, key)).filter_map(|row| match row.takes {
            Takes::Quantity(sizes) => Some(sizes),
            _ => None,
        });
        // The sizes of a key whose dimension depends on the motion hold for both.
        let sizes: Vec<_> = sizes.flatten().collect();
        let least = sizes.iter().map(|sizes| if start < 0.0 { -sizes.most } else { sizes.least.max(0.0) });
        let most = sizes.iter().map(|sizes| if start < 0.0 { 0.0 } else { sizes.most });
        let bounds = (least.fold(f64::NEG_INFINITY, f64::max), most.fold(f64::INFINITY, f64::min));
        Ok(Self { key: key.to_string(), start, bounds })
    }
}

/// Whether a row describes a key; words in capitals stand for any name.
fn is_of(row: &KeyRow, key: &str) -> bool {
    let names: Vec<&str> = row.section.split('.').filter(|name| !name.is_empty()).chain([row.key]).collect();
    let parts: Vec<&str> = key.split('.').collect();
    names.len() == parts.len() && names.iter().zip(parts).all(|(name, part)| *name == part || is_any_name(name))
}
