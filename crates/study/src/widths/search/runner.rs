//! One run of a search.

use std::sync::atomic::Ordering;
use std::time::Duration;

use hpu_cosim::scene::{Experiment, Output};
use hpu_cosim::{Control, Driver, Simulation, Summary, Wired};

use super::loops::Loops;
use super::memory::{Ran, Run};
use crate::Error;
use crate::accuracy::{Outputs, simulation, worst};
use crate::map::{CellLimits, more_events};
use crate::watch::limited;

/// The data that all runs of one scene share.
pub(super) struct Runner<'a> {
    pub loops: &'static dyn Loops,
    pub scene: &'a Experiment,
    /// The reference's outputs, and those of them that count.
    pub reference: Outputs,
    pub outputs: Vec<Output>,
}

/// Runs a scene; `None` when stopped.
pub(super) fn run(experiment: &Experiment, control: &Control) -> Result<Option<(Outputs, Summary)>, Error> {
    let simulation = simulation(experiment)?;
    let mut trace = simulation.brief_trace();
    let most = CellLimits::default().events;
    let run = |own: &Control| simulation.run(Driver::Events, &mut trace, &mut (), own);
    let (summary, _) = limited(Some(most), Duration::MAX, control, run);
    if !summary.complete {
        return if control.stop.load(Ordering::Relaxed) { Ok(None) } else { Err(more_events(most)) };
    }
    Ok(Some((Outputs::new(experiment, &summary, &trace)?, summary)))
}

impl Runner<'_> {
    /// Does a run; `None` when stopped.
    pub fn run(&self, asked: &Run, control: &Control) -> Result<Option<Ran>, Error> {
        let scene = self.loops.at(self.scene, &asked.design, asked.wall)?;
        let Some((outputs, summary)) = run(&scene, control)? else { return Ok(None) };
        let settled = outputs.outcome == self.loops.keys().stable;
        let error = worst(&outputs.errors(&self.reference), &self.outputs);
        Ok(Some(Ran::new(settled, error, self.loops.needs(self.scene, &summary)?)))
    }
}
