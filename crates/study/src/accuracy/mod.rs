//! Speed against accuracy: every way to run a scene, with its speed and its error.
//!
//! The reference is the scene as written, from event to event. A contestant ([`contestants`]) is the scene under
//! overrides, or a published criterion, which gives a verdict and runs nothing. Its error is the worst of the outputs
//! that the scene names, or of those that the reference's verdict makes worth comparing ([`Outputs`]). Its speed is
//! motion over wall time, from a parsed scene to a verdict ([`Race`]).
//!
//! Errors are those of the whole motion. Wall times are too, except for long runs that go on by edges or by fixed
//! steps. These are timed over the first part of the motion, and scaled to all of it by how the wall time was spread in
//! the run for the errors ([`Speed::timed_s`] says over which part).

mod contestants;
mod device;
mod found;
mod front;
mod outputs;
mod over_map;
mod profile;
mod race;

pub use contestants::{Contestant, EVENTS, SOLVERS, named, time};
pub(crate) use contestants::{Variant, rungs};
pub use device::Device;
pub use found::{Chart, ContestantResult, Entry, Grade, Speed};
pub use front::front;
pub(crate) use outputs::simulation;
pub use outputs::{Outputs, driver, usual, worst};
pub use over_map::{SHORTEST_STEP_S, Share, Tour, TourRow, front_of_shares};
pub use race::{Plan, Race};

use hpu_cosim::scene::Experiment;

use contestants::CLOCK;
use hpu_prove::criteria;

/// Returns every way to run a scene that differs from the scene as written, with `events` first; of a design of the
/// user's own its simulators.
///
/// A combination that the scene refuses is reported only when it is tried.
pub fn contestants(experiment: &Experiment) -> Vec<Contestant> {
    if matches!(experiment, Experiment::Dut(_)) {
        return experiment.contestants();
    }
    let as_written = Variant::new("", &[]);
    let mut all = vec![Contestant::new(EVENTS, &[]), Contestant::solver(CLOCK, None, &as_written)];
    all.extend(experiment.contestants());
    if let Experiment::Axis(scene) = experiment {
        let speaking = criteria::all(scene).into_iter().flatten().filter(|criterion| criterion.speaks);
        all.extend(speaking.map(|criterion| Contestant::criterion(criterion.name)));
    }
    all
}
