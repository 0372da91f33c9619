//! The search; it takes designs that differ only in depth together, in batches.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::thread;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, OutcomeKind, PhantomLaw, PhantomScene};
use hpu_datapath::ConfigError;
use hpu_datapath::phantom::{PhantomLoop, PhantomSharedLoop};

use super::super::Ended;
use super::super::refused::SearchError;
use super::super::runner::run;
use super::cost::{cells, rams};
use super::knob::{Design, Knob, key};
use super::runs::{Runner, Runs, Unknown};
use super::{Found, Plan, Point};
use crate::accuracy::usual;
use crate::map::SceneText;
use crate::widths::Field;

/// The most designs that a search may have.
const MOST: usize = 1 << 15;
/// The number of choices of words whose ladders are climbed before their results count for others.
const BATCH: usize = 16;

/// A choice of words, with its tables.
struct Kind<'a> {
    runs: Runs<'a>,
    /// Its designs whose error is allowed, narrowest tables first.
    points: Vec<Point>,
    /// The number of runs of a grid.
    grid_runs: usize,
    off: usize,
    failed: Option<String>,
}

/// Searches the designs of a PHANToM's scene (its text under `set`) over some knobs, until `control` stops it. `told`
/// receives the number of runs done.
///
/// # Errors
///
/// [`Ended`].
pub fn search(
    (text, set): (&SceneText, &[(String, String)]),
    knobs: &[Knob],
    plan: Plan,
    control: &Control,
    mut told: impl FnMut(usize),
) -> Result<Found, Ended<Infallible>> {
    let experiment = text.parse(set).map_err(|error| SearchError::Scene(error.to_string()))?;
    let base = searchable(experiment)?;
    let designs = grid(knobs, base.method.shared)?;
    let own = Design::of(&base);
    let knob_of = |field: Field| knobs.iter().find(|knob| knob.field == field);

    // The scene itself refuses tables that do not hold its walls.
    let mut refused: BTreeMap<String, usize> = BTreeMap::new();
    let depths =
        knob_of(Field::Depth).map_or(own.get(Field::Depth)..=own.get(Field::Depth), |knob| knob.from..=knob.to);
    let each = designs / depths.clone().count();
    let mut held: Vec<i32> = Vec::new();
    for depth in depths {
        let deep = [set, &[("method.depth_bits".into(), depth.to_string())]].concat();
        match text.parse(&deep) {
            Ok(_) => held.push(depth),
            Err(error) => drop(refused.insert(format!("depth_bits {depth}: {error}"), each)),
        }
    }
    let all_refused = |refused: &BTreeMap<String, usize>| {
        SearchError::AllRefused(designs, refused.iter().map(|(why, count)| (why.clone(), *count)).collect())
    };
    let Some(&deepest) = held.last() else { return Err(all_refused(&refused).into()) };

    let wide = knobs.iter().fold(own, |wide, knob| wide.with(knob.field, knob.to)).with(Field::Depth, deepest);
    let no_reference = |why: String| SearchError::Reference(format!("the reference, {wide}: {why}"));
    let wide_scene = Experiment::Phantom(wide.scene(&base).map_err(no_reference)?);
    let Some((reference, _)) = run(&wide_scene, control).map_err(no_reference)? else { return Err(Ended::Stopped) };
    if reference.outcome != OutcomeKind::Passive {
        let why = "is not passive at the scene's own wall, where the ladder begins; write a softer room.stiffness";
        return Err(no_reference(why.into()).into());
    }
    let outputs = text.parse(set).ok().and_then(|scene| scene.accuracy.outputs.clone());
    let outputs = outputs.unwrap_or_else(|| usual(reference.outcome));
    let runner = Runner { base: &base, reference: &reference, outputs: &outputs, control };

    // Every choice of words that makes a loop.
    let mut kinds: Vec<Mutex<Kind>> = Vec::new();
    for mut index in 0..each {
        let mut design = own.with(Field::Depth, deepest);
        for knob in knobs.iter().filter(|knob| knob.field != Field::Depth) {
            design = design.with(knob.field, knob.from + (index % knob.values()) as i32);
            index /= knob.values();
        }
        match Kind::new(&runner, &base, design, &held) {
            Ok(kind) => kinds.push(Mutex::new(kind)),
            Err(why) => *refused.entry(why).or_default() += held.len(),
        }
    }
    if kinds.is_empty() {
        return Err(all_refused(&refused).into());
    }

    // First all errors, then the stiffness of designs that can be on the front, the cheapest first.
    let done = |kinds: &[Mutex<Kind>]| locked(kinds).map(|kind| kind.runs.done).sum::<usize>() + 1;
    for batch in kinds.chunks(BATCH) {
        on_all(batch, plan.jobs, |kind| kind.look(plan.within));
        told(done(&kinds));
        stopped(control)?;
    }
    kinds.sort_by_key(|kind| {
        let kind = kind.lock().ok();
        kind.and_then(|kind| kind.points.first().map(|point| (point.rams, point.cells)))
    });
    let mut known: Vec<Point> = Vec::new();
    for batch in kinds.chunks(BATCH) {
        on_all(batch, plan.jobs, |kind| kind.climb(&known));
        told(done(&kinds));
        stopped(control)?;
        known.extend(locked(batch).flat_map(|kind| kind.points.clone()));
        known = front(known);
    }
    let mut first = Kind::new(&runner, &base, wide, &[deepest]).map_err(no_reference)?;
    first.look(f64::MAX);
    first.climb(&[]);
    stopped(control)?;
    let Some(&best) = first.points.first() else {
        return Err(no_reference(first.failed.unwrap_or_default()).into());
    };
    let runs = done(&kinds) + first.runs.done;
    let kinds: Vec<Kind> = kinds.into_iter().filter_map(|kind| kind.into_inner().ok()).collect();
    Ok(Found {
        reference: best,
        own_n_per_m: base.room.stiffness_n_per_m,
        designs,
        refused: refused.into_iter().collect(),
        off: kinds.iter().map(|kind| kind.off).sum(),
        front: known,
        runs,
        grid_runs: kinds.iter().map(|kind| kind.grid_runs).sum(),
        failed: kinds.iter().filter_map(|kind| kind.failed.clone()).collect(),
        outputs: outputs.clone(),
    })
}

impl<'a> Kind<'a> {
    /// Makes the designs of some words, one for each depth.
    fn new(runner: &'a Runner<'a>, base: &PhantomScene, design: Design, depths: &[i32]) -> Result<Self, String> {
        let point = |&depth: &i32| {
            let design = design.with(Field::Depth, depth);
            let scene = design.scene(base)?;
            let config = scene.method.config;
            let words = |error: ConfigError| error.to_string();
            if scene.method.shared {
                PhantomSharedLoop::new(config).map_err(words)?;
            } else {
                PhantomLoop::new(config).map_err(words)?;
            }
            let cells = (!scene.method.shared).then(|| cells(&config).iter().sum());
            Ok(Point { design, rams: rams(&config).map_err(words)?, cells, error: 0.0, rung: 0, capped: false })
        };
        let points = depths.iter().map(point).collect::<Result<_, String>>()?;
        Ok(Self { runs: Runs::new(runner, design), points, grid_runs: 0, off: 0, failed: None })
    }

    /// Finds the errors, and drops the designs whose error is larger than allowed.
    fn look(&mut self, within: f64) {
        for mut point in std::mem::take(&mut self.points) {
            self.grid_runs += 1;
            match self.runs.at(0, point.design.get(Field::Depth)) {
                Ok(Some(ran)) if ran.passive && ran.error <= within => {
                    point.error = ran.error;
                    self.points.push(point);
                }
                Ok(_) => self.off += 1,
                Err(why) => return self.fail(why),
            }
        }
    }

    /// Finds the stable stiffness of the designs that no known design beats, and drops the others.
    fn climb(&mut self, known: &[Point]) {
        for mut point in std::mem::take(&mut self.points) {
            // Rivals are at least as good in all but the stiffness, which is not known yet.
            let best = Point { rung: 0, ..point };
            let rivals = known.iter().chain(&self.points).filter(|rival| rival.is_as_good_as(&best));
            let least = rivals.map(|rival| rival.rung + 1).max();
            match self.stable(&mut point, least) {
                Ok(true) => self.points.push(point),
                Ok(false) => {}
                Err(why) => return self.fail(why),
            }
        }
    }

    /// Climbs the ladder, if the rung that the design must reach is passive. Returns whether the design may be on the
    /// front.
    fn stable(&mut self, point: &mut Point, least: Option<u32>) -> Result<bool, Unknown> {
        let depth = point.design.get(Field::Depth);
        if let Some(least) = least
            && !self.runs.at(least, depth)?.is_some_and(|ran| ran.passive)
        {
            self.grid_runs += 1;
            return Ok(false);
        }
        while let Some(ran) = self.runs.at(point.rung + 1, depth)? {
            self.grid_runs += 1;
            if !ran.passive {
                return Ok(least.is_none_or(|least| point.rung >= least));
            }
            point.rung += 1;
        }
        point.capped = true;
        Ok(true)
    }

    fn fail(&mut self, why: Unknown) {
        self.points.clear();
        if let Unknown::Failed(why) = why {
            self.failed = Some(format!("{}: {why}", self.runs.design()));
        }
    }
}

fn locked<'a, 'b>(kinds: &'a [Mutex<Kind<'b>>]) -> impl Iterator<Item = MutexGuard<'a, Kind<'b>>> {
    kinds.iter().filter_map(|kind| kind.lock().ok())
}

/// Does `work` with every kind, on `jobs` threads.
fn on_all<'a>(kinds: &[Mutex<Kind<'a>>], jobs: NonZeroUsize, work: impl Fn(&mut Kind<'a>) + Sync) {
    let next = AtomicUsize::new(0);
    thread::scope(|scope| {
        for _ in 0..jobs.get().min(kinds.len()) {
            scope.spawn(|| {
                while let Some(kind) = kinds.get(next.fetch_add(1, Ordering::Relaxed)) {
                    kind.lock().iter_mut().for_each(|kind| work(kind));
                }
            });
        }
    });
}

fn stopped(control: &Control) -> Result<(), Ended<Infallible>> {
    if control.stop.load(Ordering::Relaxed) { Err(Ended::Stopped) } else { Ok(()) }
}

/// Returns the points that no other point beats, the cheapest first; of equal points, one.
fn front(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| {
        let cost = |point: &Point| (point.rams, point.cells);
        let bits = |point: &Point| (point.design.bits(), point.design);
        cost(a).cmp(&cost(b)).then(a.error.total_cmp(&b.error)).then(b.rung.cmp(&a.rung)).then(bits(a).cmp(&bits(b)))
    });
    // Of two points in this order, the later never beats the earlier.
    let mut kept: Vec<Point> = Vec::new();
    for point in points {
        if !kept.iter().any(|other| other.is_as_good_as(&point)) {
            kept.push(point);
        }
    }
    kept
}

/// Returns the scene if its widths can be searched.
fn searchable(experiment: Experiment) -> Result<PhantomScene, SearchError> {
    let refused = |why: &str| Err(SearchError::Scene(why.into()));
    if experiment.auto {
        return refused("model = \"auto\" is chosen for one design; set what hpu fit chooses");
    }
    let Experiment::Phantom(scene) = experiment else { return refused("this is no scene of a PHANToM") };
    if scene.platform.is_host() {
        return refused("a host computes the force in floats; write one of the platforms FPGA-20, FPGA-100, FPGA-400");
    }
    if scene.model.law != PhantomLaw::Words {
        let law = scene.model.law.name();
        return refused(&format!("model.law = \"{law}\" is computed in floats; write \"words\""));
    }
    if scene.room.stiffness_n_per_m == 0.0 {
        return refused("room.stiffness = 0: without a wall there is no stable stiffness");
    }
    Ok(scene)
}

/// Refuses knobs that make no grid; returns the number of designs.
fn grid(knobs: &[Knob], shared: bool) -> Result<usize, SearchError> {
    if knobs.is_empty() {
        return Err(SearchError::NothingToVary);
    }
    for (index, knob) in knobs.iter().enumerate() {
        if knobs[..index].iter().any(|other| other.field == knob.field) {
            return Err(SearchError::Twice(key(knob.field)));
        }
        if shared && !matches!(knob.field, Field::Depth | Field::TrigFrac) {
            return Err(SearchError::Scene(format!(
                "{}: of method.architecture = \"shared\" only what block RAM pays for is searched, {} and {}: what other \
                 words cost there has no estimate; write \"parallel\"",
                key(knob.field),
                key(Field::Depth),
                key(Field::TrigFrac)
            )));
        }
    }
    let designs: u128 = knobs.iter().map(|knob| knob.values() as u128).product();
    match usize::try_from(designs) {
        Ok(designs) if designs <= MOST => Ok(designs),
        _ => Err(SearchError::Scene(format!("{designs} designs; at most {MOST} are searched: narrow a range"))),
    }
}

#[cfg(test)]
mod tests {
    use super::front;
    use crate::widths::Field;
    use crate::widths::search::phantom::{Design, Point};

    #[test]
    fn the_front_of_every_small_set_is_that_of_the_definition() {
        for seed in 0..2000u64 {
            let point = |index: u64| {
                let mixed = (seed * 31 + index).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
                let design = Design::default().with(Field::TrigFrac, index as i32);
                let digit = |place: u32| (mixed >> (2 * place) & 3) as u32;
                let (rams, error) = (digit(0).into(), digit(2).into());
                Point { design, rams, cells: Some(digit(1)), error, rung: digit(3), capped: false }
            };
            let points: Vec<Point> = (0..seed % 12).map(point).collect();
            let beaten = |point: &Point| points.iter().any(|other| other.beats(point));
            let equal = |a: &Point, b: &Point| a.is_as_good_as(b) && b.is_as_good_as(a);
            let mut wanted: Vec<Point> = Vec::new();
            for point in points.iter().filter(|point| !beaten(point)) {
                if !wanted.iter().any(|other| equal(other, point)) {
                    wanted.push(*point);
                }
            }
            let mut found = front(points.clone());
            assert!(found.is_sorted_by_key(|point| (point.rams, point.cells)));
            found.sort_by_key(|point| point.design);
            assert_eq!(found, wanted);
        }
    }
}
