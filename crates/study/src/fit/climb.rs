//! From the cheapest model up.

use std::fmt;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, Output};

use super::knobs::{Simplification, models, overrides, simplifications};
use super::measured::Measured;
use crate::accuracy::usual;
use crate::map::SceneText;

type Set = Vec<(String, String)>;

/// Something that the model leaves out.
#[derive(Clone, PartialEq, Debug)]
pub struct LeftOut {
    /// What.
    pub what: &'static str,
    /// The output that it changes most.
    pub output: Output,
    /// By how much, relative.
    pub effect: f64,
    /// How many times faster the model is without it.
    pub gain: f64,
}

/// Something that the model has to keep.
#[derive(Clone, PartialEq, Debug)]
pub struct Kept {
    /// What.
    pub what: &'static str,
    /// Why.
    pub why: String,
}

/// The least model of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// What to set in the scene to have it; nothing when all of it is needed.
    pub set: Set,
    /// The tolerance asked for.
    pub within: f64,
    /// Errors of all the scene's outputs against the reference, relative.
    pub errors: Vec<(Output, f64)>,
    /// The worst error in the scenes around.
    pub around: f64,
    /// Wall time of the reference over that of the model.
    pub speedup: f64,
    /// The wall time of the model, in s.
    pub wall_s: f64,
    /// What is not in it.
    pub left_out: Vec<LeftOut>,
    /// What is.
    pub kept: Vec<Kept>,
    /// Models that were tried.
    pub tried: usize,
    /// Runs of any scene.
    pub runs: usize,
}

/// Why there is no fit.
#[derive(Clone, PartialEq, Debug)]
pub enum FitError {
    /// The scene itself cannot be run, or judged.
    Scene(String),
    /// Stopped.
    Stopped,
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Scene(why) => f.write_str(why),
            Self::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for FitError {}

/// Finds the least model of a scene (its text under `set`) whose outputs are within `within` of those of the scene as it is
/// written.
///
/// # Errors
///
/// When the scene cannot be run, is a recording, or `control` stopped.
pub fn fit(scene: &SceneText, set: &Set, within: f64, control: &Control) -> Result<Fit, FitError> {
    let experiment = scene.parse(set).map_err(|error| FitError::Scene(error.to_string()))?;
    let all = simplifications(&experiment);
    let mut climb = Climb { scene, set, within, control, all: &all, outputs: Vec::new(), around: Vec::new(), runs: 0 };
    let reference = climb.run(&[], &Set::new()).map_err(|why| climb.error(why))?;
    climb.outputs = experiment.accuracy().outputs.clone().unwrap_or_else(|| usual(reference.outputs.outcome));
    for change in around(&experiment) {
        // A neighbour that cannot be run (a wall that no longer fits its word) says nothing.
        if let Ok(measured) = climb.run(&[], &change) {
            climb.around.push((change, measured));
        }
    }
    let mut tried = 0;
    let mut pick = (Vec::new(), reference.clone(), 0.0);
    for model in models(&all).into_iter().filter(|model| !model.is_empty()) {
        if control.stop.load(Ordering::Relaxed) {
            return Err(FitError::Stopped);
        }
        tried += 1;
        if let Some((measured, around)) = climb.holds(&model, &reference) {
            pick = (model, measured, around);
            break;
        }
    }
    // What gains nothing is kept.
    while let Some(better) = climb.fuller(&pick, &reference) {
        pick = better;
    }
    let (model, measured, worst) = pick;
    let left_out = climb.left_out(&model, &measured);
    let kept = climb.kept(&model, &reference);
    Ok(Fit {
        set: overrides(&all, &model),
        within,
        errors: climb.errors(&measured, &reference),
        around: worst,
        speedup: reference.wall_s / measured.wall_s,
        wall_s: measured.wall_s,
        left_out,
        kept,
        tried,
        runs: climb.runs,
    })
}

/// A model, what it measured, and its worst error around.
type Pick = (Vec<usize>, Measured, f64);

struct Climb<'a> {
    scene: &'a SceneText,
    set: &'a Set,
    within: f64,
    control: &'a Control,
    all: &'a [Simplification],
    /// The outputs that count.
    outputs: Vec<Output>,
    /// Changes of the scene, and what the reference measured there.
    around: Vec<(Set, Measured)>,
    runs: usize,
}

impl Climb<'_> {
    fn run(&mut self, model: &[usize], change: &Set) -> Result<Measured, String> {
        self.runs += 1;
        let set: Set = [self.set, change, &overrides(self.all, model)].into_iter().flatten().cloned().collect();
        let experiment = self.scene.parse(&set).map_err(|error| error.to_string())?;
        Measured::of(&experiment, self.control)?.ok_or_else(|| "stopped".to_string())
    }

    /// Errors of the outputs that count.
    fn errors(&self, run: &Measured, reference: &Measured) -> Vec<(Output, f64)> {
        let all = run.outputs.errors(&reference.outputs);
        all.into_iter().filter(|(output, _)| self.outputs.contains(output)).collect()
    }

    fn worst(&self, run: &Measured, reference: &Measured) -> f64 {
        self.errors(run, reference).into_iter().map(|(_, error)| error).fold(0.0, f64::max)
    }

    fn error(&self, why: String) -> FitError {
        if self.control.stop.load(Ordering::Relaxed) { FitError::Stopped } else { FitError::Scene(why) }
    }

    /// What the model measures and its worst error around, if it answers as the reference does with room to spare.
    fn holds(&mut self, model: &[usize], reference: &Measured) -> Option<(Measured, f64)> {
        let measured = self.run(model, &Set::new()).ok()?;
        if self.worst(&measured, reference) > self.within / 2.0 {
            return None;
        }
        let mut worst = 0.0f64;
        for index in 0..self.around.len() {
            let there = self.run(model, &self.around[index].0.clone()).ok()?;
            worst = worst.max(self.worst(&there, &self.around[index].1));
            if worst > self.within {
                return None;
            }
        }
        Some((measured, worst))
    }

    /// The models that leave out one thing less: that thing, and the model.
    fn less(&self, model: &[usize]) -> Vec<(usize, Vec<usize>)> {
        let without = |index: usize| model.iter().copied().filter(|&other| other != index).collect::<Vec<_>>();
        let possible = models(self.all);
        model.iter().map(|&index| (index, without(index))).filter(|(_, less)| possible.contains(less)).collect()
    }

    /// A fuller model that takes no longer, if there is one.
    fn fuller(&mut self, pick: &Pick, reference: &Measured) -> Option<Pick> {
        for (_, less) in self.less(&pick.0) {
            let (measured, around) = match less.is_empty() {
                true => (reference.clone(), 0.0),
                false => self.holds(&less, reference)?,
            };
            if measured.wall_s <= pick.1.wall_s {
                return Some((less, measured, around));
            }
        }
        None
    }

    fn left_out(&mut self, model: &[usize], measured: &Measured) -> Vec<LeftOut> {
        let mut all = Vec::new();
        for (index, less) in self.less(model) {
            let Ok(fuller) = self.run(&less, &Set::new()) else { continue };
            let errors = self.errors(measured, &fuller);
            let Some((output, effect)) = errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let gain = fuller.wall_s / measured.wall_s;
            all.push(LeftOut { what: self.all[index].what, output, effect, gain });
        }
        all
    }

    /// Why what the model still has may not be left out as well.
    fn kept(&mut self, model: &[usize], reference: &Measured) -> Vec<Kept> {
        let possible = models(self.all);
        let mut all = Vec::new();
        for (index, Simplification { what, .. }) in self.all.iter().enumerate() {
            if model.contains(&index) {
                continue;
            }
            let more: Vec<usize> =
                (0..self.all.len()).filter(|other| *other == index || model.contains(other)).collect();
            if !possible.contains(&more) {
                continue;
            }
            let why = match self.run(&more, &Set::new()) {
                Err(why) => format!("cannot be left out: {why}"),
                Ok(measured) => self.reason(&more, &measured, reference),
            };
            all.push(Kept { what, why });
        }
        all
    }

    fn reason(&mut self, model: &[usize], measured: &Measured, reference: &Measured) -> String {
        let worst = |errors: Vec<(Output, f64)>| errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let said = |(output, error): (Output, f64)| match output {
            Output::Verdict => "the verdict would be wrong".to_string(),
            _ => format!("{} would be off by {}", output.name(), percent(error)),
        };
        match worst(self.errors(measured, reference)) {
            Some(found) if found.1 > self.within / 2.0 => return said(found),
            _ => {}
        }
        for index in 0..self.around.len() {
            let (change, there) = self.around[index].clone();
            let Ok(measured) = self.run(model, &change) else { continue };
            if let Some(found) = worst(self.errors(&measured, &there)).filter(|found| found.1 > self.within) {
                let (key, value) = &change[0];
                return format!("at {key} = {value} {}", said(found));
            }
        }
        "leaving it out saves no time".into()
    }
}

/// A relative error as people read it.
#[must_use]
pub fn percent(error: f64) -> String {
    match error {
        0.0 => "nothing".into(),
        e if e.is_infinite() => "everything".into(),
        e if e < 1e-6 => format!("{:.0e} %", 100.0 * e),
        e => format!("{:.2} %", 100.0 * e),
    }
}

/// The scenes around: the wall 5 % softer and stiffer, and a few counts nearer and farther.
fn around(experiment: &Experiment) -> Vec<Set> {
    let one = |key: &str, value: f64| vec![(key.to_string(), format!("{value:?}"))];
    match experiment {
        Experiment::Axis(scene) => {
            let (k, position) = (scene.wall.stiffness_nm_per_rad, scene.wall.position_rad);
            let count = scene.encoder.count_rad();
            let stiffness = [0.95, 1.05].map(|share| one("wall.stiffness", share * k));
            // No whole counts, and not the same both ways.
            let places = [-5.3, 3.7].map(|counts| one("wall.position", position + counts * count));
            let stiffness = stiffness.into_iter().filter(|_| k > 0.0);
            stiffness.chain(places).collect()
        }
        Experiment::Phantom(scene) => {
            let (k, distance) = (scene.room.stiffness_n_per_m, scene.room.distance_m);
            let stiffness = [0.95, 1.05].map(|share| one("room.stiffness", share * k));
            let places = [-1.1e-4, 0.7e-4].map(|metres| one("room.distance", distance + metres));
            stiffness.into_iter().chain(places).collect()
        }
    }
}
