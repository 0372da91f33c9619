//! Recommends widths: for each, the least that keeps the scene's outputs within a tolerance, and the failure that one
//! bit less causes.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

use hpu_cosim::scene::{Experiment, OutcomeKind, Output};
use hpu_cosim::{Control, Simulation, Wired};
use hpu_signal::Format;

use super::Device;
use super::field::Field;
use super::measured::{Measured, simulation};
use crate::Error;
use crate::accuracy::{Outputs, driver, usual, worst};
use crate::fit::percent;
use hpu_farm::units::on_threads;

/// The recommendation for one width.
#[derive(Clone, PartialEq, Debug)]
pub struct Needed {
    /// The width.
    pub field: Field,
    /// Its bits in the scene.
    pub bits: i32,
    /// The fewest bits that keep every output within the tolerance while all other widths stay.
    pub least: i32,
    /// The worst error of an output with these bits.
    pub error: f64,
    /// The failure that one bit less causes.
    pub breaks: String,
}

/// The recommendations for all widths of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Recommended {
    /// The tolerance: the largest error of an output that is accepted.
    pub within: f64,
    /// The outputs that count.
    pub outputs: Vec<Output>,
    /// The recommendation for every width.
    pub needed: Vec<Needed>,
    /// Bits of every width when all go down together, in the order of `needed`.
    pub together: Vec<i32>,
    /// The worst error of an output with these bits.
    pub error: f64,
    /// Every net and its format with these bits.
    pub formats: Vec<(&'static str, Format)>,
    /// The number of runs done.
    pub runs: usize,
}

/// Finds the widths that a scene needs; `None` when `control` stopped it.
///
/// Bits that the measured range leaves idle go first: without them no word changes. Then it bisects between widths that
/// hold and widths that break. The width found holds and one bit less breaks; both were tried, and narrower widths are
/// not. At last all widths go down together, and the width with the worst error by itself gets bits back until the
/// outputs hold.
///
/// # Errors
///
/// Why the scene cannot be run, or that it has no outputs or no widths.
pub fn recommend(
    experiment: &Experiment,
    measured: &Measured,
    within: f64,
    jobs: NonZeroUsize,
    control: &Control,
) -> Result<Option<Recommended>, Error> {
    let made = simulation(experiment)?;
    if !made.has_device() {
        return Err("a recording has no outputs that a width could break".into());
    }
    let fields = experiment.fields();
    if fields.is_empty() {
        return Err(experiment.no_fields().into());
    }
    let (Some(reference), _) = Outputs::of(experiment, driver(&[]), control)? else { return Ok(None) };
    let outputs = experiment.accuracy.outputs.clone().unwrap_or_else(|| usual(reference.outcome));
    let trial =
        Trial { experiment, reference: &reference, outputs: &outputs, within, control, runs: AtomicUsize::new(1) };

    let found = on_threads(fields.len(), jobs, control, |index| trial.least(fields[index], measured));
    let Some(needed) = found.into_iter().map(Option::flatten).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let Some((together, error, scene)) = trial.together(&needed) else { return Ok(None) };
    let formats = simulation(&scene)?.wiring().nets().iter().map(|net| (net.name, net.format)).collect();
    let runs = trial.runs.into_inner();
    Ok(Some(Recommended { within, outputs, needed, together, error, formats, runs }))
}

/// The scene, and the outputs that its variants are compared with.
struct Trial<'a> {
    experiment: &'a Experiment,
    reference: &'a Outputs,
    outputs: &'a [Output],
    within: f64,
    control: &'a Control,
    runs: AtomicUsize,
}

impl Trial<'_> {
    /// Runs a variant of the scene. Returns the worst error of its outputs, or a text that says how it fails.
    fn run(&self, scene: Result<Experiment, Error>) -> Result<f64, Error> {
        self.runs.fetch_add(1, Ordering::Relaxed);
        self.control.progress.fetch_add(1, Ordering::Relaxed);
        let scene = scene.map_err(|why| why.at("refused"))?;
        let run = Outputs::of(&scene, driver(&[]), self.control)
            .map_err(|why| Error::new(reason(&why.to_string())).at("refused"))?;
        let outputs = run.0.ok_or("stopped")?;
        let errors = outputs.errors(self.reference);
        let broken = errors.iter().find(|(output, error)| self.outputs.contains(output) && *error > self.within);
        match broken {
            None => Ok(worst(&errors, self.outputs)),
            Some(_) if outputs.outcome != self.reference.outcome => {
                let [from, to] = [self.reference.outcome, outputs.outcome].map(OutcomeKind::name);
                Err(Error::new(format_args!("{from} becomes {to}")))
            }
            Some((output, error)) => Err(Error::new(format_args!("{} off by {}", output.name(), percent(*error)))),
        }
    }

    fn stopped(&self) -> bool {
        self.control.stop.load(Ordering::Relaxed)
    }

    /// Returns the least bits of a field; `None` when stopped.
    fn least(&self, field: Field, measured: &Measured) -> Option<Needed> {
        let bits = field.bits(self.experiment);
        let idle = field.nets.iter().filter_map(|net| measured.row(net)).map(|row| row.headroom_bits).min();
        let run = |bits: i32| self.run(field.with(self.experiment, bits));
        let (mut least, mut error) = (bits, 0.0);
        let (mut low, mut breaks) = (-1, "there is nothing less".to_string());
        // Idle bits first, if they prove idle.
        if let Some(idle) = idle.filter(|idle| *idle > 0) {
            match run(bits - idle) {
                Ok(found) => (least, error) = (bits - idle, found),
                Err(why) => (low, breaks) = (bits - idle, why.to_string()),
            }
        }
        while least - low > 1 && !self.stopped() {
            let probe = (least + low).div_euclid(2);
            match run(probe) {
                Ok(found) => (least, error) = (probe, found),
                Err(why) => (low, breaks) = (probe, why.to_string()),
            }
        }
        (!self.stopped()).then_some(Needed { field, bits, least, error, breaks })
    }

    /// Narrows every width at once, as far as the outputs hold. Returns the bits, the error and the scene.
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

/// Returns a scene's reason for refusal without the place of a key that nobody wrote.
fn reason(why: &str) -> String {
    let short = why.split_once(": ").filter(|(place, _)| place.contains(':')).map_or(why, |(_, rest)| rest);
    short.split(';').next().unwrap_or(short).to_string()
}

/// Returns the format that the measured range needs; its fraction bits stay.
pub fn by_range(format: Format, headroom_bits: i32) -> Option<Format> {
    Format::new(format.is_signed(), format.int() - headroom_bits, format.frac()).ok()
}

impl Recommended {
    /// Merges the needs of two scenes of one wiring: takes the greater number of bits of each width, and gives the
    /// formats that `scene` then has.
    ///
    /// # Errors
    ///
    /// When `scene` cannot have these widths.
    /// When there are no such words.
    pub fn and(self, other: Self, scene: &Experiment) -> Result<Self, Error> {
        let pairs = self.needed.into_iter().zip(other.needed);
        let needed: Vec<_> = pairs.map(|(one, two)| if two.least > one.least { two } else { one }).collect();
        let together: Vec<i32> = self.together.iter().zip(&other.together).map(|(one, two)| *one.max(two)).collect();
        let pairs = needed.iter().zip(&together);
        let scene =
            pairs.into_iter().try_fold(scene.clone(), |scene, (needed, &bits)| needed.field.with(&scene, bits))?;
        let formats = simulation(&scene)?.wiring().nets().iter().map(|net| (net.name, net.format)).collect();
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
