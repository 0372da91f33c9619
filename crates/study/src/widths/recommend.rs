//! What each width is good for: the least one that keeps the scene's outputs within a tolerance, and what one bit less
//! breaks.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::thread;

use hpu_cosim::scene::{Experiment, Output};
use hpu_cosim::{Control, Rig, Wired};
use hpu_signal::Format;

use super::field::Field;
use super::measured::{Measured, ready};
use crate::accuracy::{Outputs, driver, usual, worst};
use crate::fit::percent;
use crate::map::outcome_name;

/// What one width is good for.
#[derive(Clone, PartialEq, Debug)]
pub struct Needed {
    /// The width.
    pub field: Field,
    /// The scene's bits.
    pub bits: i32,
    /// The fewest that keep every output within the tolerance while all other widths stay.
    pub least: i32,
    /// The worst error of an output with these.
    pub error: f64,
    /// What one bit less than that breaks.
    pub breaks: String,
}

/// What widths are good for.
#[derive(Clone, PartialEq, Debug)]
pub struct Recommended {
    /// The tolerance.
    pub within: f64,
    /// The outputs that count.
    pub outputs: Vec<Output>,
    /// Every width.
    pub needed: Vec<Needed>,
    /// Bits of every width when all go down together, in the order of `needed`.
    pub together: Vec<i32>,
    /// The worst error of an output then.
    pub error: f64,
    /// Every net and its format then.
    pub formats: Vec<(&'static str, Format)>,
    /// Runs that it took.
    pub runs: usize,
}

/// Finds the widths that a scene needs; `None` when `control` stopped it.
///
/// Bits that the measured range leaves idle go first: without them no word changes. The rest is halved between what
/// holds and what breaks: the width found holds and one bit less breaks, both tried; widths below that are not tried
/// again. Then all go down together, and whichever has the worst error by itself gives a bit back until the outputs
/// hold.
///
/// # Errors
///
/// Why the scene cannot be run, or has no outputs or no widths.
pub fn recommend(
    experiment: &Experiment,
    measured: &Measured,
    within: f64,
    jobs: NonZeroUsize,
    control: &Control,
) -> Result<Option<Recommended>, String> {
    let made = ready(experiment)?;
    if !made.has_device() {
        return Err("a recording has no outputs that a width could break".into());
    }
    let fields = Field::all(experiment);
    if fields.is_empty() {
        return Err("a host computes its force: there are no widths to choose".into());
    }
    let (Some(reference), _) = Outputs::of(experiment, driver(&[]), control)? else { return Ok(None) };
    let outputs = experiment.accuracy().outputs.clone().unwrap_or_else(|| usual(reference.outcome));
    let trial = Trial { experiment, reference: &reference, outputs: &outputs, within, control, runs: Mutex::new(1) };

    let found: Mutex<Vec<Option<Needed>>> = Mutex::new(vec![None; fields.len()]);
    let next = Mutex::new(0..fields.len());
    thread::scope(|scope| {
        for _ in 0..jobs.get().min(fields.len()) {
            scope.spawn(|| {
                while let Some(index) = next.lock().ok().and_then(|mut next| next.next()) {
                    let needed = trial.least(fields[index], measured);
                    if let Ok(mut found) = found.lock() {
                        found[index] = needed;
                    }
                }
            });
        }
    });
    let found = found.into_inner().map_err(|_| "a run failed")?;
    let Some(needed) = found.into_iter().collect::<Option<Vec<_>>>() else { return Ok(None) };
    let Some((together, error, scene)) = trial.together(&needed) else { return Ok(None) };
    let formats = ready(&scene)?.wiring().nets().iter().map(|net| (net.name, net.format)).collect();
    let runs = trial.runs.into_inner().unwrap_or(0);
    Ok(Some(Recommended { within, outputs, needed, together, error, formats, runs }))
}

/// The scene, and what it is compared with.
struct Trial<'a> {
    experiment: &'a Experiment,
    reference: &'a Outputs,
    outputs: &'a [Output],
    within: f64,
    control: &'a Control,
    runs: Mutex<usize>,
}

impl Trial<'_> {
    /// The worst error of a scene's outputs, or what it breaks.
    fn run(&self, scene: Result<Experiment, String>) -> Result<f64, String> {
        if let Ok(mut runs) = self.runs.lock() {
            *runs += 1;
        }
        self.control.progress.fetch_add(1, Ordering::Relaxed);
        let scene = scene.map_err(|why| format!("refused: {why}"))?;
        let run = Outputs::of(&scene, driver(&[]), self.control).map_err(|why| format!("refused: {}", reason(&why)))?;
        let outputs = run.0.ok_or("stopped")?;
        let errors = outputs.errors(self.reference);
        let broken = errors.iter().find(|(output, error)| self.outputs.contains(output) && *error > self.within);
        match broken {
            None => Ok(worst(&errors, self.outputs)),
            Some(_) if outputs.outcome != self.reference.outcome => {
                let [from, to] = [self.reference.outcome, outputs.outcome].map(|outcome| outcome_name(Some(outcome)));
                Err(format!("{from} becomes {to}"))
            }
            Some((output, error)) => Err(format!("{} off by {}", output.name(), percent(*error))),
        }
    }

    fn stopped(&self) -> bool {
        self.control.stop.load(Ordering::Relaxed)
    }

    /// The least bits of a field; `None` when stopped.
    fn least(&self, field: Field, measured: &Measured) -> Option<Needed> {
        let bits = field.bits(self.experiment);
        let idle = field.nets().iter().filter_map(|net| measured.row(net)).map(|row| row.headroom_bits).min();
        let run = |bits: i32| self.run(field.with(self.experiment, bits));
        let (mut least, mut error) = (bits, 0.0);
        let (mut low, mut breaks) = (-1, "there is nothing less".to_string());
        // Idle bits first, if they are what they seem.
        if let Some(idle) = idle.filter(|idle| *idle > 0) {
            match run(bits - idle) {
                Ok(found) => (least, error) = (bits - idle, found),
                Err(why) => (low, breaks) = (bits - idle, why),
            }
        }
        while least - low > 1 && !self.stopped() {
            let probe = (least + low).div_euclid(2);
            match run(probe) {
                Ok(found) => (least, error) = (probe, found),
                Err(why) => (low, breaks) = (probe, why),
            }
        }
        (!self.stopped()).then_some(Needed { field, bits, least, error, breaks })
    }

    /// Every width down at once, as far as that holds: the bits, the error, the scene.
    fn together(&self, needed: &[Needed]) -> Option<(Vec<i32>, f64, Experiment)> {
        let mut bits: Vec<i32> = needed.iter().map(|needed| needed.least).collect();
        loop {
            let scene = needed
                .iter()
                .zip(&bits)
                .try_fold(self.experiment.clone(), |scene, (needed, &bits)| needed.field.with(&scene, bits));
            if let (Ok(error), Ok(scene)) = (self.run(scene.clone()), scene) {
                return Some((bits, error, scene));
            }
            let own = |index: &usize| needed[*index].error;
            let back = (0..bits.len())
                .filter(|&index| bits[index] < needed[index].bits)
                .max_by(|a, b| own(a).total_cmp(&own(b)));
            let index = back.filter(|_| !self.stopped())?;
            bits[index] += 1;
        }
    }
}

/// A scene's reason without the place of a key that nobody wrote.
fn reason(why: &str) -> String {
    let short = why.split_once(": ").filter(|(place, _)| place.contains(':')).map_or(why, |(_, rest)| rest);
    short.split(';').next().unwrap_or(short).to_string()
}

/// The format that the measured range needs, with the fraction bits that are there.
#[must_use]
pub fn by_range(format: Format, headroom_bits: i32) -> Option<Format> {
    Format::new(format.is_signed(), format.int() - headroom_bits, format.frac()).ok()
}

impl Recommended {
    /// What two scenes of one wiring need together: of each width the greater number of bits, formats as `scene` has
    /// them then.
    ///
    /// # Errors
    ///
    /// When there are no such words.
    pub fn and(self, other: Self, scene: &Experiment) -> Result<Self, String> {
        let pairs = self.needed.into_iter().zip(other.needed);
        let needed: Vec<_> = pairs.map(|(one, two)| if two.least > one.least { two } else { one }).collect();
        let together: Vec<i32> = self.together.iter().zip(&other.together).map(|(one, two)| *one.max(two)).collect();
        let pairs = needed.iter().zip(&together);
        let scene =
            pairs.into_iter().try_fold(scene.clone(), |scene, (needed, &bits)| needed.field.with(&scene, bits))?;
        let formats = ready(&scene)?.wiring().nets().iter().map(|net| (net.name, net.format)).collect();
        Ok(Self {
            within: self.within.max(other.within),
            outputs: self.outputs,
            needed,
            together,
            error: self.error.max(other.error),
            formats,
            runs: self.runs + other.runs,
        })
    }
}
