//! The trials of a drop test: for the command on one machine, and as a sweep does them.

use std::num::NonZeroUsize;

use hpu_cosim::Control;
use hpu_farm::{Failed, Points, Schema, UnitResult, typed, units, untyped};
use hpu_page::{Column, Value};
use hpu_papers::phantom::{self as study, Study, Trial, TrialSetup};
use hpu_study::map::SceneText;

use super::{Args, Name, outcomes};
use crate::answers::read_words;
use crate::shell::Failure;
use crate::work::{Find, Rows, Take, Work};

/// The trials of a drop test.
pub struct Trials {
    pub(super) name: Name,
    pub(super) study: Study,
    /// All trials that may be run.
    pub(super) points: Vec<TrialSetup>,
    /// The command, without options that change no row.
    pub(super) command: String,
}

impl Trials {
    /// Returns the trials that the command's words ask for. Refuses a `find` that knows another scene of a drop than
    /// this program, as the manifest of another build does.
    pub fn new(name: Name, words: &[String], find: &Find) -> Result<Self, Failure> {
        if find(study::SCENE)?.scene.text != study::scene().text {
            return Err(Failure::file(format!("{} is not the scene that this build of hpu has", study::SCENE)));
        }
        Self::of(name, &read_words(name.text(), words)?)
    }

    /// Returns the trials that the command asks for.
    pub(super) fn of(name: Name, args: &Args) -> Result<Self, Failure> {
        let study = args.study(name)?;
        Ok(Self { name, points: study.points(), command: args.command(name, &study), study })
    }

    /// Returns the overrides of each trial at the first seed: the command has the seeds, which change nothing else.
    pub(super) fn overrides_at_first_seed(&self) -> Vec<String> {
        let first = self.points.iter().filter(|point| point.seed == self.study.first_seed);
        first.map(|point| format!("{:?}", self.study.overrides(point))).collect()
    }

    /// Runs a trial; `None` when it was stopped.
    pub(super) fn trial(&self, place: usize, control: &Control) -> Option<UnitResult<Trial>> {
        let trial = study::run_trial(&self.study.overrides(&self.points[place]), control);
        trial.map_err(Failed::new).transpose()
    }
}

impl Work for Trials {
    fn schema(&self) -> Schema {
        let place = vec![
            Column::text("model", ""),
            Column::text("axis", ""),
            Column::text("platform", ""),
            Column::number("stiffness", ""),
            Column::integer("seed", ""),
            Column::integer("trial", ""),
        ];
        let fields = vec![
            Column::text("outcome", ""),
            Column::number("rms", ""),
            Column::number("at", ""),
            Column::integer("edges", ""),
            Column::text("why", ""),
        ];
        Schema::new(place, fields)
    }

    fn meanings(&self) -> Vec<(String, String)> {
        let meanings = [
            ("model", "the rung of the ladder of models"),
            ("stiffness", "N/m, of the wall"),
            ("rms", "m, about the steady value; of a trial that was not aborted"),
            ("at", "s, the time of the abortion"),
            ("edges", "clock edges"),
            ("why", "why the trial was aborted"),
        ];
        meanings.map(|(key, meaning)| (key.to_string(), meaning.to_string())).into()
    }

    fn command(&self) -> String {
        self.command.clone()
    }

    fn scenes(&self) -> Vec<(String, SceneText)> {
        let scene = study::scene();
        let text = SceneText { name: scene.name.to_string(), text: scene.text.to_string(), files: Default::default() };
        vec![(study::SCENE.to_string(), text)]
    }

    fn place(&self, point: usize) -> Vec<Value> {
        let TrialSetup { rung, axis, platform, stiffness_n_per_m, seed, trial } = self.points[point];
        let names = [self.study.rungs[rung].name, axis.name(), platform.name()].map(Value::from);
        let numbers = [Value::Number(stiffness_n_per_m), Value::from(seed), Value::from(trial)];
        names.into_iter().chain(numbers).collect()
    }

    fn count(&self) -> Option<u64> {
        Some(self.points.len() as u64)
    }

    fn is_adaptive(&self) -> bool {
        self.study.seeds > 1
    }

    fn next(&self, done: Rows, _control: &Control) -> Result<Points, Failure> {
        Ok(Points::of(self.study.wanted(&outcomes(typed(done))).into_iter().map(|trial| trial as u64)))
    }

    fn run(&self, _done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure> {
        units::run_some(
            points,
            NonZeroUsize::MIN,
            control,
            |place, own| self.trial(place, own),
            |place, row| take(place, untyped(&row)),
        )
    }
}
