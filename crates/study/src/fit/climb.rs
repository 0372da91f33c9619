//! The search for the least model, from the cheapest model up.

mod reasons;

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::time::Duration;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, Output};

use super::Device;
use super::found::{Fit, Tried, percent};
use super::knobs::{Simplification, models, on_its_own, overrides, worth};
use super::measured::Measured;
use super::simplifications;
use crate::accuracy::usual;
use crate::map::SceneText;
use crate::timing::{LEAST_TURNS, Spread, in_turn};
use crate::watch::watched;
use crate::{Error, Kind};

type Set = Vec<(String, String)>;

/// Ratio of wall times below which a model does not count as slower: wall times are not more precise than this.
const WORTH: f64 = 1.05;

/// Greatest number of turns in which two models are timed against each other.
const MOST_TURNS: usize = 7;

/// Wall time of these turns after which no more than [`LEAST_TURNS`] are begun, in s.
const ENOUGH_S: f64 = 1.0;

/// A model worth this much less than the best so far may still be the faster one, so it is tried too.
const NEARLY: u32 = 2;

/// A run of a model is given up after `LATE` times the wall time of the scene as written plus `LATEST`: such a model
/// cannot be the pick.
const LATE: u32 = 3;
const LATEST: Duration = Duration::from_millis(200);

/// Share of the tolerance below which an error of a fixed step may grow when the step gets shorter: where in a step a
/// contact falls is chance.
const NOISE: f64 = 0.05;

/// Finds the least model of a scene (its text under `set`) whose outputs are within the tolerance `within` of the
/// outputs of the scene as written.
///
/// # Errors
///
/// Returns an error if the scene cannot be run, is a recording, or if `control` stopped it.
pub fn fit(scene: &SceneText, set: &Set, within: f64, control: &Control) -> Result<Fit, Error> {
    let experiment = scene.parse(set)?;
    let all = simplifications(&experiment);
    let mut climb = Climb {
        scene,
        set,
        within,
        control,
        all: &all,
        outputs: Vec::new(),
        around: neighbours(&experiment),
        seen: BTreeMap::new(),
        seen_around: BTreeMap::new(),
        timed: BTreeMap::new(),
        patience: Duration::MAX,
        runs: 0,
    };
    let reference = climb.told(&[]).map_err(|why| climb.error(why))?;
    climb.patience = LATE * Duration::from_secs_f64(reference.wall_s) + LATEST;
    climb.outputs = experiment.accuracy.outputs.clone().unwrap_or_else(|| usual(reference.outputs.outcome));
    let mut tried = 0;
    let mut pick = (Vec::new(), reference.clone(), 0.0);
    // A model's worth predicts its speed only roughly, so models worth nearly as much as the first one are tried too.
    let mut least = 1;
    for model in models(&all) {
        if control.stop.load(Ordering::Relaxed) {
            return Err(Error::of(Kind::Stopped, "stopped"));
        }
        let worth = worth(&all, &model);
        if worth < least {
            break;
        }
        tried += 1;
        if climb.told(&model).is_ok_and(|told| WORTH * told.wall_s < pick.1.wall_s)
            && let Some((measured, around)) = climb.holds(&model, &reference)
        {
            pick = (model, measured, around);
            least = least.max(worth.saturating_sub(NEARLY));
        }
    }
    // A simplification that gains no time is taken back.
    while let Some(better) = climb.fuller(&pick, &reference) {
        pick = better;
    }
    if reference.wall_s <= WORTH * pick.1.wall_s {
        pick = (Vec::new(), reference.clone(), 0.0);
    }
    let mut speedup = climb.speedup(&[], &pick.0).map_err(|why| climb.error(why))?;
    if speedup.told().is_some_and(|told| told < 1.0) {
        (pick, speedup) = ((Vec::new(), reference.clone(), 0.0), Spread::ONE);
    }
    let (model, measured, worst) = pick;
    let left_out = climb.left_out(&model);
    let kept = climb.kept(&model, &reference);
    if control.stop.load(Ordering::Relaxed) {
        return Err(Error::of(Kind::Stopped, "stopped"));
    }
    Ok(Fit {
        models: climb.models(&model, &reference),
        set: overrides(&all, &model),
        within,
        errors: climb.errors(&measured, &reference),
        not_judged: climb.not_judged(&measured, &reference),
        around: worst,
        contact_share: reference.contact_share,
        speedup,
        wall_s: measured.wall_s,
        left_out,
        kept,
        tried,
        runs: climb.runs,
    })
}

/// A model, its measured run, and its worst error in the neighbouring scenes.
type Pick = (Vec<usize>, Measured, f64);

struct Climb<'a> {
    scene: &'a SceneText,
    set: &'a Set,
    within: f64,
    control: &'a Control,
    all: &'a [Simplification],
    /// The outputs that are judged.
    outputs: Vec<Output>,
    around: Vec<Neighbour>,
    /// Measured runs of models on the scene itself.
    seen: BTreeMap<Vec<usize>, Result<Measured, Error>>,
    /// Errors of models in the neighbouring scenes.
    seen_around: BTreeMap<(Vec<usize>, usize), Result<Errors, Error>>,
    /// How many times as fast the second of two models is as the first, as they were timed in turn.
    timed: BTreeMap<[Vec<usize>; 2], Spread>,
    /// How long a run of a model may take. A run that diverges can take thousands of times as long as the scene.
    patience: Duration,
    runs: usize,
}

/// Returns the neighbouring scenes of the scene as written.
fn neighbours(experiment: &Experiment) -> Vec<Neighbour> {
    let around = experiment.around().into_iter();
    let changes = around.map(|(key, value)| vec![(key.to_string(), format!("{value:?}"))]);
    changes.map(|change| Neighbour { change, reference: None }).collect()
}

/// A neighbouring scene: the scene as written with its wall changed slightly.
struct Neighbour {
    change: Set,
    /// The reference's run in this scene, made when the first model is compared with it. `Some(None)`: the scene cannot
    /// be run with this change (its wall no longer fits the word), so no model is judged by it.
    reference: Option<Option<Measured>>,
}

type Errors = Vec<(Output, f64)>;

impl Climb<'_> {
    /// Returns the measured run of a model on the scene itself; a model is run only once.
    fn told(&mut self, model: &[usize]) -> Result<Measured, Error> {
        if let Some(told) = self.seen.get(model) {
            return told.clone();
        }
        self.runs += 1;
        let told = self.experiment(model, &Set::new()).and_then(|experiment| self.waited(Measured::of, &experiment));
        self.seen.insert(model.to_vec(), told.clone());
        told
    }

    /// Runs a model once in a neighbouring scene; the wall time of this run is not used.
    fn once(&mut self, model: &[usize], index: usize) -> Result<Measured, Error> {
        self.runs += 1;
        let experiment = self.experiment(model, &self.around[index].change)?;
        self.waited(Measured::once, &experiment)
    }

    /// Runs an experiment, and gives up when it takes longer than `patience`.
    fn waited(
        &self,
        run: impl FnOnce(&Experiment, &Control) -> Result<Measured, Error>,
        experiment: &Experiment,
    ) -> Result<Measured, Error> {
        let (told, late) = watched(self.patience, self.control, |own| run(experiment, own));
        if late { Err("it takes longer than the scene as written".into()) } else { told }
    }

    /// Returns the reference's run in a neighbouring scene; `None` if that scene cannot be run.
    fn there(&mut self, index: usize) -> Option<&Measured> {
        if self.around[index].reference.is_none() {
            self.around[index].reference = Some(self.once(&[], index).ok());
        }
        self.around[index].reference.as_ref().and_then(Option::as_ref)
    }

    /// Returns the errors of a model in a neighbouring scene; none if the scene as written cannot be run there.
    fn errors_there(&mut self, model: &[usize], index: usize) -> Result<Errors, Error> {
        let key = (model.to_vec(), index);
        if let Some(seen) = self.seen_around.get(&key) {
            return seen.clone();
        }
        let errors = match self.there(index).cloned() {
            None => Ok(Vec::new()),
            Some(there) => self.once(model, index).map(|measured| self.errors(&measured, &there)),
        };
        self.seen_around.insert(key, errors.clone());
        errors
    }

    /// Whether the verdict is near its limit, in the scene itself or in a neighbouring one.
    fn is_thin(&mut self, reference: &Measured) -> bool {
        reference.thin || (0..self.around.len()).any(|index| self.there(index).is_some_and(|there| there.thin))
    }

    fn experiment(&self, model: &[usize], change: &Set) -> Result<Experiment, Error> {
        let set: Set = [self.set, change, &overrides(self.all, model)].into_iter().flatten().cloned().collect();
        self.scene.parse(&set).map_err(Error::from)
    }

    /// Returns how many times as fast a model is as another one. Both are run in turn, so that a machine that is slow
    /// for a while is slow for both. Two models are timed only once: one change has one figure.
    fn speedup(&mut self, before: &[usize], model: &[usize]) -> Result<Spread, Error> {
        if before == model {
            return Ok(Spread::ONE);
        }
        let key = [before.to_vec(), model.to_vec()];
        if let Some(timed) = self.timed.get(&key) {
            return Ok(*timed);
        }
        let nothing = Set::new();
        let both = [self.experiment(before, &nothing)?, self.experiment(model, &nothing)?];
        let goes_on = |_: usize, walls: &[Vec<f64>]| {
            let (turns, spent_s) = (walls[0].len(), walls.iter().flatten().sum::<f64>());
            turns < LEAST_TURNS || turns < MOST_TURNS && spent_s < ENOUGH_S
        };
        let walls = in_turn(2, goes_on, |index| Measured::of(&both[index], self.control).map(|run| run.wall_s))?;
        let timed = Spread::ratio(&walls[0], &walls[1]);
        self.timed.insert(key, timed);
        Ok(timed)
    }

    /// Returns the errors of the outputs that are judged.
    fn errors(&self, run: &Measured, reference: &Measured) -> Errors {
        let all = run.outputs.errors(&reference.outputs);
        all.into_iter().filter(|(output, _)| self.outputs.contains(output)).collect()
    }

    /// Returns the errors of the outputs that are not judged.
    fn not_judged(&self, run: &Measured, reference: &Measured) -> Errors {
        let all = run.outputs.errors(&reference.outputs);
        all.into_iter().filter(|(output, _)| !self.outputs.contains(output)).collect()
    }

    fn worst(&self, run: &Measured, reference: &Measured) -> f64 {
        self.errors(run, reference).into_iter().map(|(_, error)| error).fold(0.0, f64::max)
    }

    fn error(&self, why: Error) -> Error {
        if self.control.stop.load(Ordering::Relaxed) { Error::of(Kind::Stopped, "stopped") } else { why }
    }

    /// Returns the models whose runs were measured.
    fn models(&self, chosen: &[usize], reference: &Measured) -> Vec<Tried> {
        let told = |(model, told): (&Vec<usize>, &Result<Measured, Error>)| {
            let measured = told.as_ref().ok()?;
            Some(Tried {
                set: overrides(self.all, model),
                error: self.worst(measured, reference),
                speedup: match self.timed.get(&[Vec::new(), model.clone()]) {
                    Some(timed) => timed.median,
                    None => reference.wall_s / measured.wall_s,
                },
                chosen: model == chosen,
            })
        };
        self.seen.iter().filter_map(told).collect()
    }

    /// Returns the model's measured run and its worst error in the neighbouring scenes, if the model meets all
    /// conditions listed in [`crate::fit`].
    fn holds(&mut self, model: &[usize], reference: &Measured) -> Option<(Measured, f64)> {
        let measured = self.told(model).ok()?;
        if self.worst(&measured, reference) > self.within / 2.0 {
            return None;
        }
        // Two errors that cancel each other in this scene will not cancel in another.
        for &index in model {
            let [with, without] = on_its_own(self.all, model, index).map(|model| self.told(&model));
            if self.worst(&with.ok()?, &without.ok()?) > self.within / 2.0 {
                return None;
            }
        }
        if self.lucky(model, reference).is_some() {
            return None;
        }
        let worst = self.worst_around(model)?;
        // Near a boundary of stability a step is taken only if the next longer one would do as well.
        if self.rung(model).is_some() && self.is_thin(reference) {
            let longer = self.longer(model)?;
            let told = self.told(&longer).ok()?;
            if self.worst(&told, reference) > self.within / 2.0 {
                return None;
            }
            self.worst_around(&longer)?;
        }
        Some((measured, worst))
    }

    /// Returns the worst error in the neighbouring scenes, if it is within the tolerance in all of them.
    fn worst_around(&mut self, model: &[usize]) -> Option<f64> {
        let mut worst = 0.0f64;
        for index in 0..self.around.len() {
            let errors = self.errors_there(model, index).ok()?;
            worst = errors.into_iter().map(|(_, error)| error).fold(worst, f64::max);
            if worst > self.within {
                return None;
            }
        }
        Some(worst)
    }

    /// Returns the fixed step of a model, if it has one.
    fn rung(&self, model: &[usize]) -> Option<usize> {
        model.iter().copied().find(|&index| !self.all[index].shorter.is_empty())
    }

    /// Returns the same model with the next longer step of the ladder, if there is one.
    fn longer(&self, model: &[usize]) -> Option<Vec<usize>> {
        let rung = self.rung(model)?;
        let longer = self.all.iter().position(|one| one.shorter.first() == Some(&rung))?;
        Some(model.iter().map(|&index| if index == rung { longer } else { index }).collect())
    }

    /// Returns why the fixed step of a model, if it has one, is right by luck: a shorter step of its ladder is not as
    /// good.
    fn lucky(&mut self, model: &[usize], reference: &Measured) -> Option<String> {
        let rung = self.rung(model)?;
        let [with, without] = on_its_own(self.all, model, rung);
        let exact = self.told(&without).ok()?;
        let mut before = self.told(&with).map_or(f64::INFINITY, |longer| self.worst(&longer, &exact));
        for &shorter in &self.all[rung].shorter {
            let instead: Vec<_> = model.iter().map(|&index| if index == rung { shorter } else { index }).collect();
            let what = &self.all[shorter].what;
            let told = match self.told(&instead) {
                Ok(told) => told,
                Err(why) => return Some(format!("is right by luck: without {what} {why}")),
            };
            let (error, own) = (self.worst(&told, reference), self.worst(&told, &exact));
            if error > self.within / 2.0 || own > before.max(NOISE * self.within) {
                return Some(format!(
                    "is right by luck: without {what} it would be off by {}",
                    percent(error.max(own))
                ));
            }
            before = own;
        }
        None
    }

    /// Returns, for each simplification of a model, the model without it and without all that need it.
    fn less(&self, model: &[usize]) -> Vec<Vec<usize>> {
        model.iter().map(|&index| on_its_own(self.all, model, index)).map(|[_, less]| less).collect()
    }

    /// Returns a model that leaves out less and takes no longer, if there is one.
    fn fuller(&mut self, pick: &Pick, reference: &Measured) -> Option<Pick> {
        for less in self.less(&pick.0) {
            // A slower model is not examined further.
            if self.told(&less).is_ok_and(|told| told.wall_s > WORTH * pick.1.wall_s) {
                continue;
            }
            let found = match less.is_empty() {
                true => Some((reference.clone(), 0.0)),
                false => self.holds(&less, reference),
            };
            if let Some((measured, around)) = found
                && measured.wall_s <= WORTH * pick.1.wall_s
            {
                return Some((less, measured, around));
            }
        }
        None
    }
}
