//! The search; it does its runs in waves.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::Experiment;
use hpu_farm::units::run_some;
use hpu_farm::{Failed, UnitResult};

use super::case::{Case, Cases};
use super::front::{Merit, front};
use super::kinds::{Kind, kinds};
use super::knob::{Depth, Design, Key, Knob};
use super::loops::Limits;
use super::memory::{Memory, Ran, Run};
use super::runner::{Runner, run};
use super::{Found, Line, On, RatedDesign};
use crate::Error;
use crate::accuracy::usual;

/// The options of a search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// Bits of position, gains and velocity of the reference; `None` takes the widest design as the reference.
    pub against: Option<i32>,
    /// The largest error of a design's outputs; designs beyond it are dropped.
    pub within: f64,
    /// Whether position and velocity of a design must hold the ranges that are proved for every motion within the
    /// device's limits.
    pub proved: bool,
    /// Threads.
    pub jobs: NonZeroUsize,
}

/// How far a search has come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Progress {
    /// Runs done.
    pub runs: usize,
    /// Designs that may still be on the front; designs that are alike count once.
    pub open: usize,
}

/// Keeps the result of a run by its number.
type Keep<'a, E> = dyn FnMut(usize, &UnitResult<Ran>) -> Result<(), E> + 'a;

/// The search in progress.
struct Search<'a, E> {
    /// One runner for each scene.
    runners: Vec<Runner<'a>>,
    memory: Memory,
    jobs: NonZeroUsize,
    control: &'a Control,
    done: BTreeMap<usize, UnitResult<Ran>>,
    keep: &'a mut Keep<'a, E>,
    runs: usize,
    failed: BTreeMap<Run, String>,
    /// The numbers of the runs to do of the first wave that is not done; all of every wave if there is none.
    part: Option<&'a [usize]>,
}

/// The reason why a search ended early.
#[derive(Debug)]
pub enum Ended<E> {
    /// The search was refused.
    Refused(Error),
    /// It was stopped.
    Stopped,
    /// A row could not be kept.
    Kept(E),
    /// A part of a wave was asked for. These runs of the wave were not done before.
    Wave(Vec<usize>),
}

impl<E> From<Error> for Ended<E> {
    fn from(error: Error) -> Self {
        Self::Refused(error)
    }
}

impl<E> Search<'_, E> {
    /// Does the requested runs. Of runs that differ in words that only hold their values, it does only the widest: its
    /// result may answer for the others.
    fn wave(&mut self, wanted: Vec<Run>) -> Result<(), Ended<E>> {
        let mut widest: BTreeMap<Run, Depth> = BTreeMap::new();
        for (run, depth) in wanted.into_iter().map(Run::parted) {
            let known = widest.entry(run).or_insert(depth);
            *known = depth.max(*known);
        }
        let units: Vec<Run> = widest.into_iter().map(|(run, depth)| run.joined(depth)).collect();
        let mut rows: BTreeMap<usize, UnitResult<Ran>> = BTreeMap::new();
        let mut left = Vec::new();
        for index in self.runs..self.runs + units.len() {
            match self.done.remove(&index) {
                Some(row) => drop(rows.insert(index, row)),
                None => left.push(index),
            }
        }
        let wave = left.clone();
        if let Some(part) = self.part {
            left.retain(|index| part.binary_search(index).is_ok());
        }
        let (first, runners, keep) = (self.runs, &self.runners, &mut self.keep);
        let unit = |index: usize, control: &Control| {
            let run = &units[index - first];
            Some(runners[run.case].run(run, control).transpose()?.map_err(Failed::new))
        };
        run_some(&left, self.jobs, self.control, unit, |index, row| {
            keep(index, &row)?;
            rows.insert(index, row);
            Ok(())
        })
        .map_err(Ended::Kept)?;
        if rows.len() < units.len() || (self.part.is_some() && !wave.is_empty()) {
            let stopped = self.part.is_none() || self.control.stop.load(Ordering::Relaxed);
            return Err(if stopped { Ended::Stopped } else { Ended::Wave(wave) });
        }
        self.runs += units.len();
        for (run, row) in units.into_iter().zip(rows.into_values()) {
            match row {
                Ok(ran) => self.memory.keep(run, ran),
                Err(why) => drop(self.failed.insert(run, why.to_string())),
            }
        }
        Ok(())
    }

    /// Asks every kind that is picked until none needs a run. `ask` returns the run that a kind needs after everything
    /// known so far; it may look at the stiffness that rivals of the kind have reached.
    fn settle(
        &mut self,
        kinds: &mut [Kind],
        pick: impl Fn(&[Kind]) -> Vec<usize>,
        ask: impl Fn(&mut Kind, &Memory, &dyn Fn() -> f64) -> Option<Run>,
        told: &mut dyn FnMut(Progress),
    ) -> Result<(), Ended<E>> {
        loop {
            let mut wanted = Vec::new();
            let mut asked = false;
            let open = pick(kinds);
            let known: Vec<Merit> = open.iter().map(|&index| kinds[index].at_worst()).collect();
            for (place, &index) in open.iter().enumerate() {
                let kind = &mut kinds[index];
                let rivals = || {
                    let others = known.iter().enumerate().filter(|&(other, _)| other != place);
                    let rivals = others.filter(|(_, other)| other.is_no_dearer(&known[place]));
                    rivals.map(|(_, rival)| rival.stiffness).fold(0.0, f64::max)
                };
                let before = (kind.answers, kind.error.is_some());
                match ask(kind, &self.memory, &rivals) {
                    Some(run) if self.failed.contains_key(&run) => (kind.failed, asked) = (true, true),
                    Some(run) => wanted.push(run),
                    None => {}
                }
                asked |= before != (kind.answers, kind.error.is_some());
            }
            told(Progress { runs: self.runs, open: open.len() });
            // The best possible figures may have changed, so the kinds are picked and asked again before any run.
            if asked {
                continue;
            }
            if wanted.is_empty() {
                return Ok(());
            }
            if self.control.stop.load(Ordering::Relaxed) {
                return Err(Ended::Stopped);
            }
            self.wave(wanted)?;
        }
    }
}

/// Searches the designs of a loop over some knobs, on scenes that all take the same hardware, until `control` stops it.
/// Widths that no knob varies are the first scene's. A design's error is the worst of all scenes, its stable stiffness
/// the least.
///
/// `done` holds the rows of an interrupted search with the same scenes, knobs and plan. Every new row is passed to
/// `keep`, and `told` receives the progress.
///
/// # Errors
///
/// [`Ended`].
pub fn search<E>(
    scenes: &[(String, Experiment)],
    knobs: &[Knob],
    plan: Plan,
    done: BTreeMap<usize, UnitResult<Ran>>,
    control: &Control,
    keep: impl FnMut(usize, &UnitResult<Ran>) -> Result<(), E>,
    told: impl FnMut(Progress),
) -> Result<Found, Ended<E>> {
    search_part(scenes, knobs, plan, done, None, control, keep, told)
}

/// Searches as [`search`] does until a wave has a run that is not `done`. Does those of the wave's runs that are in
/// `part`, in rising order, and ends as [`Ended::Wave`]. Many processes so share a wave: their rows together are the
/// `done` of the next one.
///
/// # Errors
///
/// [`Ended`]; returns what was found when no run was left to do.
pub fn search_wave<E>(
    scenes: &[(String, Experiment)],
    knobs: &[Knob],
    plan: Plan,
    done: BTreeMap<usize, UnitResult<Ran>>,
    part: &[usize],
    control: &Control,
    keep: impl FnMut(usize, &UnitResult<Ran>) -> Result<(), E>,
) -> Result<Found, Ended<E>> {
    search_part(scenes, knobs, plan, done, Some(part), control, keep, |_| {})
}

/// Returns the indices of the kinds that have not failed.
fn unfinished(kinds: &[Kind]) -> Vec<usize> {
    (0..kinds.len()).filter(|&index| !kinds[index].failed).collect()
}

/// Returns the indices of those whose error is not known yet.
fn unknown(kinds: &[Kind]) -> Vec<usize> {
    unfinished(kinds).into_iter().filter(|&index| kinds[index].error.is_none()).collect()
}

#[expect(clippy::too_many_arguments, reason = "those of the two functions above")]
fn search_part<E>(
    scenes: &[(String, Experiment)],
    knobs: &[Knob],
    plan: Plan,
    done: BTreeMap<usize, UnitResult<Ran>>,
    part: Option<&[usize]>,
    control: &Control,
    mut keep: impl FnMut(usize, &UnitResult<Ran>) -> Result<(), E>,
    mut told: impl FnMut(Progress),
) -> Result<Found, Ended<E>> {
    let cases = Cases::new(scenes)?;
    let loops = cases.loops;
    let limits = plan.proved.then(|| limits(&cases)).transpose()?;
    let designs = cases.grid(knobs)?;
    let (mut kinds, refused) = kinds(&cases, knobs, designs, limits.as_deref());
    if kinds.is_empty() {
        return Err(all_refused(designs, &refused).into());
    }

    let wide = loops.reference(cases.base(), knobs, plan.against)?;
    let no_reference = |why: Error| why.at(format_args!("the reference, {wide}"));
    let mut first = Kind::new(&cases, wide).map_err(no_reference)?;
    let runners = runners(&cases, wide, control).map_err(no_reference)?.ok_or(Ended::Stopped)?;
    let (runners, touches): (Vec<Runner>, Vec<bool>) = runners.into_iter().unzip();
    let mut search = Search {
        runs: runners.len(),
        runners,
        memory: Memory::new(loops.keys().aborts),
        jobs: plan.jobs,
        control,
        done,
        keep: &mut keep,
        failed: BTreeMap::new(),
        part,
    };

    // First the reference alone, then all errors and the errors around the reference, then the stiffness of designs
    // that can be on the front.
    let one = std::slice::from_mut(&mut first);
    let (lines, mut around) = around(&cases, wide, knobs);
    let hopeful = |kinds: &[Kind]| front(&kinds.iter().map(Kind::at_best).collect::<Vec<Merit>>());
    let look = |within: f64| move |kind: &mut Kind, memory: &Memory, _: &dyn Fn() -> f64| kind.look(memory, within);
    search.settle(one, unfinished, Kind::follow, &mut told)?;
    search.settle(one, unknown, look(f64::INFINITY), &mut told)?;
    let proved = limits.as_deref().and_then(|limits| first.held(&cases, limits).ok());
    let first = point(&first, wide);
    if first.merit.stiffness == 0.0 {
        return Err(no_reference(loops.never_stable(&wide).into()).into());
    }
    search.settle(&mut around, unknown, look(f64::INFINITY), &mut told)?;
    search.settle(&mut kinds, unknown, look(plan.within), &mut told)?;
    search.settle(&mut kinds, hopeful, Kind::follow, &mut told)?;
    let points = points(&kinds);
    let merits: Vec<Merit> = points.iter().map(|point| point.merit).collect();
    let on = |((case, runner), touches): ((&Case, &Runner), bool)| On {
        scene: case.name.clone(),
        outcome: runner.reference.outcome,
        touches,
        outputs: runner.outputs.clone(),
    };
    let off = |kind: &&Kind| !kind.failed && kind.error == Some(f64::INFINITY);
    Ok(Found {
        reference: first,
        on: cases.all.iter().zip(&search.runners).zip(touches).map(on).collect(),
        proved,
        unit: loops.unit(cases.base()),
        estimate_error: loops.keys().estimate_error,
        designs,
        refused,
        kinds: kinds.len(),
        off: kinds.iter().filter(off).map(|kind| kind.count).sum(),
        front: front(&merits),
        points,
        lines: lines_of(lines, &around),
        runs: search.runs,
        grid_runs: kinds.iter().map(Kind::grid_runs).sum(),
        failed: search.failed.into_values().collect(),
    })
}

/// Runs the reference on each scene; returns the runners of the scenes, and whether the reference touches the wall.
/// `None` when stopped.
fn runners<'a>(cases: &'a Cases, wide: Design, control: &Control) -> Result<Option<Vec<(Runner<'a>, bool)>>, Error> {
    let mut all = Vec::new();
    for case in &cases.all {
        let Some((reference, summary)) = run(&wide.scene(&case.scene)?, control)? else { return Ok(None) };
        let outputs = case.outputs.clone().unwrap_or_else(|| usual(reference.outcome));
        let runner = Runner { loops: cases.loops, scene: &case.scene, reference, outputs };
        all.push((runner, summary.contact_share != Some(0.0)));
    }
    Ok(Some(all))
}

/// Returns the designs whose stiffness is known, the cheapest first.
fn points(kinds: &[Kind]) -> Vec<RatedDesign> {
    let known = kinds.iter().filter(|kind| kind.is_climbed() && kind.at_best().is_some());
    let mut points: Vec<RatedDesign> =
        known.flat_map(|kind| kind.designs.iter().map(|&design| point(kind, design))).collect();
    points.sort_by_key(|point| (point.merit.cost, point.design.bits()));
    points
}

/// Returns the error of a grid whose designs no scene can have: the most frequent reasons with their numbers.
fn all_refused(designs: usize, reasons: &[(String, usize)]) -> Error {
    let shown = reasons.iter().take(3).map(|(why, count)| format!("\n{count} of them: {why}"));
    Error::new(format_args!("no scene has any of the {designs} designs{}", shown.collect::<String>()))
}

/// Returns the limits of every motion of each scene.
fn limits(cases: &Cases) -> Result<Vec<Limits<'_>>, Error> {
    let refused = |case: &Case, why: Error| why.at(format_args!("{}: no range is proved", case.name));
    cases.all.iter().map(|case| cases.loops.limits(&case.scene).map_err(|why| refused(case, why))).collect()
}

/// Each value of each width, with the index of the kind of the design that has it.
type Values = Vec<(Key, i32, Option<usize>)>;

/// Returns the variants of the reference that differ in one width.
fn around(cases: &Cases, wide: Design, knobs: &[Knob]) -> (Values, Vec<Kind>) {
    let (mut lines, mut kinds) = (Vec::new(), Vec::new());
    for knob in knobs {
        for bits in knob.from..=knob.to {
            let kind = Kind::new(cases, wide.with(knob.key.field, bits)).ok();
            lines.push((knob.key, bits, kind.is_some().then_some(kinds.len())));
            kinds.extend(kind);
        }
    }
    (lines, kinds)
}

fn lines_of(values: Values, around: &[Kind]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for (key, bits, kind) in values {
        if lines.last().is_none_or(|line| line.key != key) {
            lines.push(Line { key, errors: Vec::new() });
        }
        let error = kind.and_then(|index| around[index].error);
        lines.last_mut().expect("one was pushed").errors.push((bits, error));
    }
    lines
}

fn point(kind: &Kind, design: Design) -> RatedDesign {
    RatedDesign { design, merit: kind.at_best(), capped: kind.is_capped() }
}
