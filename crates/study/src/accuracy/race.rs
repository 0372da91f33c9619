//! The race: first every contestant's outputs are compared with the reference's, many at a time. Then wall times are
//! taken in turn: in each turn every contestant runs once, one by one, over the whole motion or over enough of it to
//! scale. So a machine that is slow for a while is slow for all, and the ratio of two contestants hardly changes.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::io;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use hpu_cosim::scene::{Experiment, OutcomeKind, Output};
use hpu_cosim::{Control, Driver, Simulation, Trace};
use hpu_farm::{Failed, units};
use hpu_prove::criteria;

use super::contestants;
use super::contestants::{Contestant, named};
use super::found::{Chart, ContestantResult, Entry, Grade, Speed};
use super::outputs::{self, Outputs, any, driver, usual, worst};
use super::profile::Profile;
use crate::Error;
use crate::map::SceneText;
use crate::timing::{LEAST_TURNS, in_turn};
use crate::watch::watched;

/// A scene, and the contestants that run it.
#[derive(Clone, PartialEq, Debug)]
pub struct Race {
    /// The scene.
    pub scene: SceneText,
    /// Overrides for all contestants.
    pub set: Vec<(String, String)>,
    /// The contestants.
    pub contestants: Vec<Contestant>,
    /// The scene as written.
    pub written: Experiment,
}

/// How a race is run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Plan {
    /// Number of runs at a time, while errors are measured.
    pub jobs: NonZeroUsize,
    /// Greatest wall time of a run; a contestant that takes longer runs a shorter motion.
    pub longest: Duration,
    /// Wall time after which a contestant that has run in three turns runs in no further one. A run by edges or steps
    /// that takes longer is timed for this long over three turns, and scaled.
    pub enough: Duration,
    /// Greatest number of turns.
    pub repeats: u32,
}

impl Plan {
    /// Returns the usual plan: at most 60 s a run, which no run of a scene of 2 s takes; three turns, or until 0.15 s
    /// are spent, at most 7.
    pub fn usual(jobs: NonZeroUsize) -> Self {
        Self { jobs, longest: Duration::from_secs(60), enough: Duration::from_millis(150), repeats: 7 }
    }
}

/// A contestant whose errors are known and whose wall time is not taken yet.
struct Judged {
    grade: Grade,
    errors: Vec<(Output, f64)>,
    outcome: Option<OutcomeKind>,
    shortened_s: Option<f64>,
    /// How the wall time of a run by edges or steps was spread.
    profile: Option<Profile>,
}

/// The time that a run is expected to take, in ms of one core; the progress line counts in this unit.
struct Work {
    judge: u64,
    time: u64,
}

impl Race {
    /// Returns a race of the contestants with these names, or of all contestants if there are no names.
    ///
    /// `load` reads the data files that the scene names; the race keeps them.
    ///
    /// # Errors
    ///
    /// Fails for a scene that is not valid, cannot be run or has nothing to compare, and for an unknown name.
    pub fn new(
        text: (&str, &str),
        set: &[(String, String)],
        names: &[String],
        load: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    ) -> Result<Self, Error> {
        let (scene, written) = SceneText::read(text, set, load)?;
        any(&written)?;
        let mut contestants = contestants(&written);
        if !names.is_empty() {
            contestants = named(&contestants, names)?;
        }
        Ok(Self { scene, set: set.to_vec(), contestants, written })
    }

    /// Returns the overrides that turn the scene into a contestant's.
    pub fn overrides(&self, contestant: &Contestant) -> Vec<(String, String)> {
        self.set.iter().chain(&contestant.overrides).cloned().collect()
    }

    fn experiment(&self, contestant: &Contestant, shortened_s: Option<f64>) -> Result<Experiment, Error> {
        let mut overrides = self.overrides(contestant);
        overrides.extend(shortened_s.map(|seconds| ("run.duration".to_string(), format!("{seconds:?}"))));
        self.scene.parse(&overrides).map_err(Error::from)
    }

    /// Returns the final value of the progress counter. It is roughly the time in ms, so that a share of it is a share
    /// of the time.
    pub fn work(&self, plan: Plan) -> u64 {
        let all = self.contestants.iter().map(|contestant| self.work_of(contestant, plan));
        all.map(|work| work.judge + work.time).sum()
    }

    fn work_of(&self, contestant: &Contestant, plan: Plan) -> Work {
        // An edge or a step takes some 40 ns; everything else takes little time.
        let run = contestant.paces(&self.written) / 25_000;
        let most = plan.enough.as_millis() as u64;
        // Nothing else runs while a contestant is timed.
        Work { judge: 2 + run, time: (2 + run.min(most)) * plan.jobs.get() as u64 }
    }

    /// Runs all contestants; returns `None` when `control` stopped it. Progress is counted up to [`work`](Self::work).
    ///
    /// # Errors
    ///
    /// Returns why the reference cannot be run.
    pub fn run(&self, plan: Plan, control: &Control) -> Result<Option<Chart>, Error> {
        let (reference, _) =
            watched(Duration::MAX, control, |own| Outputs::printed(&self.written, Driver::Events, own)).0?;
        let Some(reference) = reference else { return Ok(None) };
        let accuracy = &self.written.accuracy;
        let outputs = accuracy.outputs.clone().unwrap_or_else(|| usual(reference.outcome));

        let judge = |index: usize, control: &Control| {
            Some(self.judge(index, &reference, &outputs, plan, control).transpose()?.map_err(Failed::new))
        };
        let mut rows = BTreeMap::new();
        let works: Vec<Work> = self.contestants.iter().map(|contestant| self.work_of(contestant, plan)).collect();
        // The longest run first, so that no core is left alone with it at the end.
        let mut all: Vec<usize> = (0..self.contestants.len()).collect();
        all.sort_by_key(|&index| std::cmp::Reverse(works[index].judge));
        let Ok(()) = units::run_some(&all, plan.jobs, control, judge, |index, row| {
            rows.insert(index, row);
            // `run_some` itself counts one for every unit.
            control.progress.fetch_add(works[index].judge - 1, Ordering::Relaxed);
            Ok::<(), std::convert::Infallible>(())
        });
        if rows.len() < self.contestants.len() {
            return Ok(None);
        }
        let entrants = self.contestants.iter().zip(&rows).filter_map(|(contestant, (index, row))| {
            let Judged { shortened_s, profile, .. } = row.as_ref().ok()?;
            let entrant =
                Entrant { contestant: contestant.clone(), shortened_s: *shortened_s, profile: profile.clone() };
            Some((*index, entrant))
        });
        let (places, entrants): (Vec<usize>, Vec<Entrant>) = entrants.unzip();
        let Some(speeds) = self.time(&entrants, plan, control)? else { return Ok(None) };
        let mut speeds: BTreeMap<usize, Speed> = places.into_iter().zip(speeds).collect();
        let mut entries = Vec::new();
        for (contestant, (index, row)) in self.contestants.iter().zip(rows) {
            let row = row.map(|Judged { grade, errors, outcome, shortened_s, .. }| {
                let speed = speeds.remove(&index).expect("a contestant that is judged is timed");
                ContestantResult { grade, errors, outcome, shortened_s, speed }
            });
            control.progress.fetch_add(works[index].time, Ordering::Relaxed);
            entries.push(Entry { contestant: contestant.clone(), row });
        }
        Ok(Some(Chart { outcome: reference.outcome, outputs, within: accuracy.within, entries }))
    }

    /// Compares a contestant with the reference; returns `None` when it was stopped.
    fn judge(
        &self,
        index: usize,
        reference: &Outputs,
        outputs: &[Output],
        plan: Plan,
        control: &Control,
    ) -> Result<Option<Judged>, Error> {
        let contestant = &self.contestants[index];
        if let Some(name) = contestant.criterion {
            return criterion(name, &self.written, reference.outcome, outputs).map(Some);
        }
        let experiment = self.experiment(contestant, None)?;
        let driver = driver(&contestant.overrides);
        let run = |own: &Control| Profile::of(own, || Outputs::printed(&experiment, driver, own));
        let ((run, profile), late) = watched(plan.longest, control, run);
        match run? {
            (Some(run), _) => {
                let profile = (contestant.paces(&experiment) > 0).then_some(profile);
                Ok(Some(Judged { profile, ..held_against(&run, reference, outputs, None) }))
            }
            (None, _) if !late => Ok(None),
            (None, summary) => {
                // Half as far as the run came, in two digits.
                let shortened_s = format!("{:.1e}", 0.5 * summary.motion_s).parse().unwrap_or(summary.motion_s);
                let short = |contestant, driver| {
                    let experiment = self.experiment(contestant, Some(shortened_s))?;
                    let run = |own: &Control| Profile::of(own, || Outputs::printed(&experiment, driver, own));
                    let ((run, profile), late) = watched(3 * plan.longest, control, run);
                    match run? {
                        (None, _) if late => {
                            Err(Error::new(format_args!("too slow even for {shortened_s} s of motion")))
                        }
                        (run, _) => Ok(run.map(|run| (run, profile))),
                    }
                };
                let as_written = Contestant { overrides: Vec::new(), ..contestant.clone() };
                let (Some((reference, _)), Some((run, profile))) =
                    (short(&as_written, Driver::Events)?, short(contestant, driver)?)
                else {
                    return Ok(None);
                };
                let judged = held_against(&run, &reference, outputs, Some(shortened_s));
                let profile = (contestant.paces(&experiment) > 0).then_some(profile);
                Ok(Some(Judged { profile, ..judged }))
            }
        }
    }

    /// Returns whether a contestant can run the scene.
    pub(super) fn can_run(&self, contestant: &Contestant) -> bool {
        let experiment = self.experiment(contestant, None);
        experiment.is_ok_and(|experiment| contestant.criterion.is_some() || any(&experiment).is_ok())
    }

    /// Returns the wall times of contestants, taken in turn; `None` when stopped. With the profile of a run that took
    /// longer than [`Plan::enough`], only a part of the motion is run, and its wall time is scaled to the whole.
    ///
    /// # Errors
    ///
    /// Returns why a contestant cannot be run.
    pub(super) fn time(
        &self,
        entrants: &[Entrant],
        plan: Plan,
        control: &Control,
    ) -> Result<Option<Vec<Speed>>, Error> {
        let experiments = entrants.iter().map(|entrant| self.experiment(&entrant.contestant, entrant.shortened_s));
        let experiments = experiments.collect::<Result<Vec<_>, Error>>()?;
        // The memory of the rows is not part of the model's cost: repeated runs take it over from each other.
        let mut memory: Vec<Option<Trace>> = vec![None; entrants.len()];
        let mut timed_s: Vec<Option<f64>> = vec![None; entrants.len()];
        let enough_s = plan.enough.as_secs_f64();
        let most = plan.repeats as usize;
        let goes_on = |index: usize, walls: &[Vec<f64>]| {
            let (turns, spent_s) = (walls[index].len(), walls[index].iter().sum::<f64>());
            let is_scaled = entrants[index].is_scaled(enough_s);
            turns < LEAST_TURNS.min(most) || !is_scaled && turns < most && spent_s < enough_s
        };
        let walls = in_turn(entrants.len(), goes_on, |index| {
            let (entrant, experiment) = (&entrants[index], &experiments[index]);
            let part = entrant.profile.as_ref().filter(|_| entrant.is_scaled(enough_s));
            let timeout = part.map_or(Duration::MAX, |_| plan.enough / LEAST_TURNS as u32);
            let start = Instant::now();
            let (run, late) = watched(timeout, control, |own| entrant.run(experiment, &mut memory[index], own));
            let (wall_s, (edges, complete)) = (start.elapsed().as_secs_f64(), run.map_err(Some)?);
            match part {
                _ if !complete && !late => Err(None),
                None => Ok(wall_s),
                Some(profile) => {
                    timed_s[index] = (!complete).then(|| edges as f64 * experiment.clock.period_s());
                    Ok(wall_s / profile.share(edges))
                }
            }
        });
        let walls = match walls {
            Ok(walls) => walls,
            Err(Some(why)) => return Err(why),
            Err(None) => return Ok(None),
        };
        let speeds = walls.into_iter().zip(timed_s).zip(entrants.iter().zip(&experiments));
        let speeds = speeds.map(|((walls_s, timed_s), (entrant, experiment))| Speed {
            motion_s: experiment.edges() as f64 * experiment.clock.period_s(),
            walls_s,
            edges: if entrant.contestant.criterion.is_some() { 0 } else { experiment.edges() },
            timed_s,
        });
        Ok(Some(speeds.collect()))
    }
}

/// A contestant that is timed.
pub(super) struct Entrant {
    /// The contestant.
    pub contestant: Contestant,
    /// The duration, in s, to which its motion is shortened, if it is.
    pub shortened_s: Option<f64>,
    /// How the wall time of a run by edges or steps was spread.
    pub profile: Option<Profile>,
}

impl Entrant {
    /// Whether a part of the motion is timed and scaled to the whole.
    fn is_scaled(&self, enough_s: f64) -> bool {
        self.profile.as_ref().is_some_and(|profile| profile.wall_s() > enough_s)
    }

    /// Runs the contestant once. Returns the number of edges done, and whether these are all.
    fn run(
        &self,
        experiment: &Experiment,
        memory: &mut Option<Trace>,
        control: &Control,
    ) -> Result<(u64, bool), Error> {
        if let (Some(name), Experiment::Axis(scene)) = (self.contestant.criterion, experiment) {
            black_box(criteria::named(name, scene));
            return Ok((0, true));
        }
        let simulation = any(experiment)?;
        let trace = memory.get_or_insert_with(|| simulation.brief_trace());
        let summary = outputs::run(&simulation, driver(&self.contestant.overrides), (trace, &mut ()), control)?;
        Ok((summary.edges, summary.complete))
    }
}

fn held_against(run: &Outputs, reference: &Outputs, outputs: &[Output], shortened_s: Option<f64>) -> Judged {
    let errors = run.errors(reference);
    let grade = match worst(&errors, outputs) {
        _ if run.same_edges(reference) => Grade::Exact,
        error if error.is_finite() => Grade::Off(error),
        _ => Grade::Wrong,
    };
    Judged { grade, errors, outcome: Some(run.outcome), shortened_s, profile: None }
}

/// Judges whether a criterion predicts the reference's verdict: rest below its limit, motion above.
fn criterion(
    name: &'static str,
    experiment: &Experiment,
    outcome: OutcomeKind,
    outputs: &[Output],
) -> Result<Judged, Error> {
    let Experiment::Axis(scene) = experiment else { return Err("the criteria speak of an axis".into()) };
    let criterion = criteria::named(name, scene).ok_or("not of this device")?.map_err(|silent| silent.why)?;
    if !outcome.tells() {
        return Err("the scene as written does not tell whether it comes to rest".into());
    }
    let rests = scene.wall.stiffness_nm_per_rad < criterion.limit;
    let right = rests == (outcome == OutcomeKind::Settled);
    let grade = match right {
        true if outputs == [Output::Verdict] => Grade::Off(0.0),
        true => Grade::VerdictOnly,
        false => Grade::Wrong,
    };
    let errors = vec![(Output::Verdict, if right { 0.0 } else { f64::INFINITY })];
    let outcome = rests.then_some(OutcomeKind::Settled);
    Ok(Judged { grade, errors, outcome, shortened_s: None, profile: None })
}
