//! Runs for other verbs and programs, which hold the result.

use std::time::Duration;

use hpu_chart::Picture;
use hpu_cosim::dut::Inside;
use hpu_cosim::scene::Experiment;
use hpu_cosim::{AnySimulation, SceneFile, Summary, Trace};
use hpu_page::Page;
use hpu_signal::Observe;
use serde_json::Value;

use super::device::shown;
use super::plan::{self, Engine, load};
use super::simulate::{Ran, Recorder, simulate};
use super::{Args, page};
use crate::parameters;
use crate::scene::{self, Loaded};
use crate::shell::{Failure, Watch, interrupt};

/// Runs a scene as it is written, and returns its summary as `hpu run --json` prints it; `None` when interrupted.
pub fn summary(name: &str) -> Result<Option<Value>, Failure> {
    Ok(finished(&scene::source(name)?, &[], None, interrupt::watch(), unseen)?
        .map(|(finished, _)| finished.page.json()))
}

/// A run of a scene, which other programs hold.
pub struct Finished {
    /// The page of the run.
    pub page: Page,
    loaded: Loaded,
    args: Args,
}

/// A run that was recorded: its trace for pictures, its summary, and its observer.
pub struct Recorded<O> {
    /// The observer, which has seen the whole run.
    pub observer: O,
    /// The summary of the run.
    pub summary: Summary,
    driver: &'static str,
    trace: Trace,
}

impl<O> Recorded<O> {
    /// Returns the recording without its observer, and the observer.
    pub fn split(self) -> (Recorded<()>, O) {
        let Self { observer, summary, driver, trace } = self;
        (Recorded { observer: (), summary, driver, trace }, observer)
    }
}

/// Makes no observer of a run.
///
/// # Errors
///
/// None.
pub fn unseen(_: &AnySimulation) -> Result<(), Failure> {
    Ok(())
}

/// Runs a scene with these overrides, as `hpu run` does. `observed` makes an observer of the run from the simulation.
/// It looks on after the end for as long as `for_ever`, if that is given.
/// Returns the run and its recording, which has a trace for pictures if the observer watches; `None` when interrupted.
///
/// # Errors
///
/// As the command.
pub fn finished<O: Observe>(
    source: &SceneFile,
    set: &[(String, String)],
    for_ever: Option<Duration>,
    watch: Watch,
    observed: impl FnOnce(&AnySimulation) -> Result<O, Failure>,
) -> Result<Option<(Finished, Recorded<O>)>, Failure> {
    let args = Args { set: scene::Set { set: set.to_vec() }, for_ever, ..Args::default() };
    let Some((loaded, fitted)) = load(source, set, None, watch)? else { return Ok(None) };
    let page = |mut ran: Ran| {
        ran.parameters = parameters::of(&loaded.scene, fitted.as_ref(), false);
        ran.fitted = fitted;
        let page = page::page(&ran);
        (page, ran.driver, ran.summary, ran.trace)
    };
    let Some(((page, driver, summary, trace), observer)) = observe(&loaded, &args, watch, observed, page)? else {
        return Ok(None);
    };
    Ok(Some((Finished { page, loaded, args }, Recorded { observer, summary, driver, trace })))
}

/// Runs a scene and shows it to an observer; `None` when interrupted.
fn observe<O: Observe, T>(
    loaded: &Loaded,
    args: &Args,
    watch: Watch,
    observed: impl FnOnce(&AnySimulation) -> Result<O, Failure>,
    told: impl FnOnce(Ran) -> T,
) -> Result<Option<(T, O)>, Failure> {
    let simulation = AnySimulation::new(&loaded.scene, &args.hdl.simulators(), Inside::Nothing)?;
    plan::agree_for_ever(args, &simulation)?;
    let mut observer = observed(&simulation)?;
    let engine = Engine::new(args, loaded, &simulation);
    let ran = simulate(args, loaded, &simulation, &engine, Recorder::Other(&mut observer), watch)?;
    if watch.is_stopped() {
        return Ok(None);
    }
    Ok(Some((told(ran), observer)))
}

impl Finished {
    /// Returns the scene that was run, with its model if that was chosen.
    pub fn scene(&self) -> &Experiment {
        &self.loaded.scene
    }

    /// Returns the command that runs the scene.
    pub fn command(&self) -> String {
        let longest = self.args.for_ever.map(|longest| format!(" --for-ever={}s", longest.as_secs_f64()));
        self.loaded.command() + &longest.unwrap_or_default()
    }

    /// Runs the scene again, to the same bits, for another observer; `None` when interrupted.
    ///
    /// # Errors
    ///
    /// As the run.
    pub fn again<O: Observe>(
        &self,
        watch: Watch,
        observed: impl FnOnce(&AnySimulation) -> Result<O, Failure>,
    ) -> Result<Option<Recorded<O>>, Failure> {
        let parts = |ran: Ran| (ran.driver, ran.summary, ran.trace);
        let seen = observe(&self.loaded, &self.args, watch, observed, parts)?;
        Ok(seen.map(|((driver, summary, trace), observer)| Recorded { observer, summary, driver, trace }))
    }

    /// Draws the pictures of a recording of this run.
    ///
    /// # Errors
    ///
    /// As [`AnySimulation::new`].
    pub fn pictures<O>(&self, recorded: &Recorded<O>) -> Result<Vec<Picture>, Failure> {
        let simulation = AnySimulation::new(&self.loaded.scene, &self.args.hdl.simulators(), Inside::Nothing)?;
        Ok(shown(&simulation).pictures(&recorded.trace, &recorded.summary, &self.loaded.command()))
    }
}
