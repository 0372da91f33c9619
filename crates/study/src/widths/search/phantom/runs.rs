//! The runs of a search: their results, and the runs that are saved.
//!
//! **Ladder.** Rung `k` is a wall of `2^(k/16)` times the scene's own stiffness. The stable stiffness is that of the
//! highest rung up to which every rung is passive. Nothing is assumed of the rungs above.
//!
//! **Narrower tables, the same run.** An entry is a function of its count alone, and the depth affects nothing else in
//! a run. So if no count leaves the narrower tables, no word changes. The scene is aborted at the first count outside.
//! A run tells the range of the sampled counts. Between samples, a decoder moves by at most a count an edge. So the
//! range must fit with a margin of one sample period and two edges.

use std::collections::BTreeMap;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, OutcomeKind, Output, PhantomScene};

use super::super::runner::run;
use super::knob::Design;
use crate::accuracy::{Outputs, worst};
use crate::widths::Field;

/// Returns the stiffness of a rung, relative to the scene's own.
#[must_use]
pub fn rung(rung: u32) -> f64 {
    libm::exp2(f64::from(rung) / 16.0)
}

/// The result of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Ran {
    pub passive: bool,
    /// Error of its outputs; valid only at the scene's own stiffness.
    pub error: f64,
    /// Least and greatest count of all joints.
    counts: (i64, i64),
}

impl Ran {
    /// Returns whether a run with tables of `depth` bits is the same.
    fn covers(&self, depth: i32) -> bool {
        let half = 1i64 << (depth - 1);
        self.counts.0 >= -half && self.counts.1 < half
    }
}

/// The data that all runs share.
pub(super) struct Runner<'a> {
    pub base: &'a PhantomScene,
    /// The reference's outputs, and those of them that count.
    pub reference: &'a Outputs,
    pub outputs: &'a [Output],
    pub control: &'a Control,
}

/// The runs of designs that differ only in depth.
pub(super) struct Runs<'a> {
    runner: &'a Runner<'a>,
    design: Design,
    known: BTreeMap<u32, Vec<(i32, Option<Ran>)>>,
    /// The number of runs done.
    pub done: usize,
}

/// The reason why there is no answer.
pub(super) enum Unknown {
    Stopped,
    Failed(String),
}

impl<'a> Runs<'a> {
    /// Makes the runs of a design, given with its widest tables.
    pub fn new(runner: &'a Runner<'a>, design: Design) -> Self {
        Self { runner, design, known: BTreeMap::new(), done: 0 }
    }

    /// Returns the design with its widest tables.
    pub fn design(&self) -> Design {
        self.design
    }

    /// Returns the run at a rung with tables of that depth; `None` where the stiffness format does not hold the rung.
    pub fn at(&mut self, step: u32, depth: i32) -> Result<Option<Ran>, Unknown> {
        let widest = self.design.get(Field::Depth);
        if let Some(ran) = self.recall(step, depth) {
            return Ok(ran);
        }
        // The widest tables come first: their run may answer for the others.
        for tried in [widest, depth] {
            let ran = self.run(step, tried)?;
            self.done += usize::from(ran.is_some());
            self.known.entry(step).or_default().push((tried, ran));
            if let Some(ran) = self.recall(step, depth) {
                return Ok(ran);
            }
        }
        unreachable!("a run answers for its own depth")
    }

    fn recall(&self, step: u32, depth: i32) -> Option<Option<Ran>> {
        let runs = self.known.get(&step)?;
        let same = |of: i32, ran: &Option<Ran>| of == depth || (of >= depth && ran.is_none_or(|ran| ran.covers(depth)));
        runs.iter().find(|(of, ran)| same(*of, ran)).map(|(_, ran)| *ran)
    }

    fn run(&self, step: u32, depth: i32) -> Result<Option<Ran>, Unknown> {
        let Runner { base, reference, outputs: counted, control } = *self.runner;
        let mut scene = self.design.with(Field::Depth, depth).scene(base).map_err(Unknown::Failed)?;
        scene.room.stiffness_n_per_m *= rung(step);
        if scene.words().is_err() {
            return Ok(None);
        }
        let (outputs, summary) =
            run(&Experiment::Phantom(scene), control).map_err(Unknown::Failed)?.ok_or(Unknown::Stopped)?;
        let counters = summary.nets.iter().filter(|net| ["count1", "count2", "count3"].contains(&net.signal.name));
        let counts = counters.fold((0, 0), |(least, most), net| (net.usage.min.min(least), net.usage.max.max(most)));
        let spare = base.period_clocks() as i64 + 2;
        let counts = (counts.0 - spare, counts.1 + spare);
        let error = worst(&outputs.errors(reference), counted);
        Ok(Some(Ran { passive: outputs.outcome == OutcomeKind::Passive, error, counts }))
    }
}
