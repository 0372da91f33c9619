//! Groups designs that are alike in every run.

use std::cmp::{Ordering, Reverse};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::case::Cases;
use super::climb::Climb;
use super::front::{Cost, Merit};
use super::knob::{Design, Knob};
use super::loops::{Limits, Loops, Standing};
use super::memory::{Memory, Run};
use crate::Error;
use hpu_prove::ranges::ProvedRanges;

/// The knowledge about a kind on one scene.
struct On {
    /// The design whose runs stand for those of the kind, up to the format of the stiffness.
    design: Design,
    /// The scene's own wall.
    own: i128,
    /// The error, once known.
    error: Option<f64>,
    /// The climb to the stable stiffness; only one of the scenes that differ in nothing else has one.
    climb: Option<Box<dyn Climb>>,
}

impl On {
    /// Returns bounds of the stable stiffness; infinite where another scene's climb decides it.
    fn between(&self) -> [f64; 2] {
        self.climb.as_ref().map_or([f64::INFINITY; 2], |climb| climb.between())
    }
}

/// Designs that are alike in every run, with their known figures.
pub(super) struct Kind {
    loops: &'static dyn Loops,
    /// The numbers that determine all runs.
    alike: Vec<i128>,
    /// How many designs are alike.
    pub count: usize,
    /// The cheapest designs, and their cost.
    pub designs: Vec<Design>,
    cost: Cost,
    /// The knowledge on each scene.
    on: Vec<On>,
    /// The worst error of all scenes, once known; infinite as soon as one is above the limit.
    pub error: Option<f64>,
    /// The number of verdicts and errors taken from runs.
    pub answers: usize,
    /// Whether one of its runs failed.
    pub failed: bool,
}

impl Kind {
    /// Makes the kind of a design.
    ///
    /// # Errors
    ///
    /// Why no scene can have the design, or which scene cannot.
    pub fn new(cases: &Cases, design: Design) -> Result<Self, Error> {
        let loops = cases.loops;
        let (mut alike, mut on, mut cost) = (Vec::new(), Vec::new(), None);
        for case in &cases.all {
            let scene = loops.scene(&design, &case.scene).map_err(|why| cases.of(case, why))?;
            if cost.is_none() {
                cost = Some(loops.cost(&scene)?);
            }
            let standing = loops.standing(design, &scene).map_err(|why| cases.of(case, why))?;
            let Standing { design, own, climb, alike: numbers } = standing;
            alike.extend(numbers);
            on.push(On { design, own, error: None, climb: case.climbs.then_some(climb) });
        }
        let (designs, cost) = (vec![design], cost.unwrap_or_default());
        Ok(Self { loops, alike, count: 1, designs, cost, on, error: None, answers: 0, failed: false })
    }

    /// Takes a design that is alike.
    fn join(&mut self, other: Self) {
        self.count += 1;
        match other.cost.cmp(&self.cost) {
            Ordering::Less => (self.cost, self.designs) = (other.cost, other.designs),
            Ordering::Equal => self.designs.extend(other.designs),
            Ordering::Greater => {}
        }
    }

    fn run(&self, case: usize, wall: i128) -> Run {
        let (design, wall) = self.loops.run(self.on[case].design, wall);
        Run { case, design, wall }
    }

    /// Returns the scene whose climb decides next. The stable stiffness is the least of all scenes, so a climb that is
    /// known to end no lower than another is not continued.
    fn climbing(&self) -> Option<usize> {
        let lowest = self.at_best().stiffness;
        let open = |on: &On| on.climb.as_ref().is_some_and(|climb| climb.is_open()) && on.between()[0] < lowest;
        let open = (0..self.on.len()).filter(|&case| open(&self.on[case]));
        open.min_by(|&a, &b| self.on[a].between()[1].total_cmp(&self.on[b].between()[1]))
    }

    /// Continues the climbs as far as runs are known. Returns the run that they need next, if any. `rivals` is that of
    /// [`Climb::next`].
    pub fn follow(&mut self, memory: &Memory, rivals: &dyn Fn() -> f64) -> Option<Run> {
        while let Some(case) = self.climbing() {
            let wall = self.on[case].climb.as_ref().and_then(|climb| climb.next(rivals))?;
            let run = self.run(case, wall);
            let Some(ran) = memory.recall(&run) else { return Some(run) };
            if let Some(climb) = &mut self.on[case].climb {
                climb.told(wall, ran.settled);
            }
            self.answers += 1;
        }
        None
    }

    /// Looks up the errors among known runs. Returns the run that is missing, if any. An error above `within` counts as
    /// infinite, and no further scene is asked.
    pub fn look(&mut self, memory: &Memory, within: f64) -> Option<Run> {
        let mut worst = 0.0f64;
        for case in 0..self.on.len() {
            let error = match self.on[case].error {
                Some(error) => error,
                None => {
                    let run = self.run(case, self.on[case].own);
                    let Some(ran) = memory.recall(&run) else { return Some(run) };
                    self.answers += 1;
                    *self.on[case].error.insert(ran.error)
                }
            };
            worst = worst.max(error);
            if worst > within {
                worst = f64::INFINITY;
                break;
            }
        }
        self.error = Some(worst);
        None
    }

    fn merit(&self, end: usize) -> Merit {
        let error = if self.failed { f64::INFINITY } else { self.error.unwrap_or(0.0) };
        let stiffness = self.on.iter().map(|on| on.between()[end]).fold(f64::INFINITY, f64::min);
        Merit { cost: self.cost, error, stiffness }
    }

    /// Returns the figures that the design is known to have at least.
    pub(crate) fn at_worst(&self) -> Merit {
        self.merit(0)
    }

    /// Returns the best figures that the design can still have.
    pub(crate) fn at_best(&self) -> Merit {
        self.merit(1)
    }

    /// Returns whether its stable stiffness is known.
    pub(crate) fn is_climbed(&self) -> bool {
        self.climbing().is_none()
    }

    /// Returns whether its stiffness format holds no stiffer wall than the stable one.
    pub(crate) fn is_capped(&self) -> bool {
        let stable = self.at_best().stiffness;
        self.on.iter().any(|on| on.between()[0] == stable && on.climb.as_ref().is_some_and(|climb| climb.is_capped()))
    }

    /// Returns the number of runs that a search of the whole grid, design by design, takes at least to know as much.
    pub fn grid_runs(&self) -> usize {
        let tries = |on: &On| usize::from(on.error.is_some()) + on.climb.as_ref().map_or(0, |climb| climb.tries());
        self.count * self.on.iter().map(tries).sum::<usize>()
    }

    /// Returns the proved ranges of its words on each scene.
    ///
    /// # Errors
    ///
    /// The scene whose proved range the words do not hold, and why.
    pub fn held(&self, cases: &Cases, limits: &[Limits]) -> Result<Vec<ProvedRanges>, Error> {
        let held = cases.all.iter().zip(limits).map(|(case, limits)| {
            let held = self.loops.scene(&self.designs[0], &case.scene).and_then(|scene| limits(&scene));
            held.map_err(|why| why.at(&case.name))
        });
        held.collect()
    }
}

/// Returns the designs of a grid by kind, and the reasons why no scene can have some designs, with their numbers. With
/// `limits`, designs whose words do not hold the proved ranges are refused too.
pub(super) fn kinds(
    cases: &Cases,
    knobs: &[Knob],
    designs: usize,
    limits: Option<&[Limits]>,
) -> (Vec<Kind>, Vec<(String, usize)>) {
    let own = Design::new(cases.loops.keys(), cases.base());
    let mut all: BTreeMap<Vec<i128>, Kind> = BTreeMap::new();
    let mut refused: BTreeMap<String, usize> = BTreeMap::new();
    for mut index in 0..designs {
        let mut design = own;
        for knob in knobs {
            design = design.with(knob.key.field, knob.from + (index % knob.values()) as i32);
            index /= knob.values();
        }
        let mut kind = match Kind::new(cases, design) {
            Ok(kind) => kind,
            Err(why) => {
                *refused.entry(why.to_string()).or_default() += 1;
                continue;
            }
        };
        match all.entry(std::mem::take(&mut kind.alike)) {
            Entry::Vacant(place) => drop(place.insert(kind)),
            Entry::Occupied(place) => place.into_mut().join(kind),
        }
    }
    if let Some(limits) = limits {
        all.retain(|_, kind| match kind.held(cases, limits) {
            Ok(_) => true,
            Err(why) => {
                *refused.entry(why.to_string()).or_default() += kind.count;
                false
            }
        });
    }
    let mut refused: Vec<_> = refused.into_iter().collect();
    refused.sort_by_key(|(_, count)| Reverse(*count));
    (all.into_values().collect(), refused)
}
