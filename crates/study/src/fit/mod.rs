//! The least model that still answers a scene's question.
//!
//! A scene says which outputs it is about (`[accuracy] outputs`) and how exact they have to be. A fit leaves out what
//! these outputs do not need, one simplification at a time ([`simplifications`]): the bridge's switching, the winding's
//! inductance, friction or its sticking, the fixed-point words, everything that happens between samples or within a
//! fixed step, the encoder's counts; of an arm its transmission, its amplifiers, its joints.
//!
//! The models are tried from the cheapest up, by an estimate. Once one will do, models that should be nearly as cheap
//! are tried too, and the fastest by measurement is taken. A model will do if
//!
//! 1. every output is within *half* of the tolerance of the reference's (the scene as written, from event to event),
//!    with the same verdict;
//! 2. each thing that it leaves out changes no output by more than half of the tolerance either, so that no two errors
//!    cancel each other;
//! 3. its fixed step, if it has one, is not right by luck: the next two shorter steps of its ladder are as good, and
//!    the change that each of them makes does not grow;
//! 4. it is within the tolerance, with the same verdict, in the neighbouring scenes: the wall 5 % softer and stiffer,
//!    and moved either way by up to 7.5 counts, so that each time a contact meets the sampling in another phase and
//!    fixed-point words meet another count; of a device without a wall its other parts, 5 % less and more;
//! 5. where the verdict's rms is between half of its limit and twice its limit, in the scene itself or in a
//!    neighbouring one, the next longer step of its ladder would do as well.
//!
//! The wall time is measured from a parsed scene to its verdict, as the best of a few runs while runs are short; each
//! run reuses the memory of the previous run's rows. Then the models beside the pick are examined. A model that leaves
//! out one thing less shows what this thing costs in accuracy and whether leaving it out saves time. A model that
//! leaves out one thing more shows why this thing has to stay. How many times as fast a model is as another one is
//! measured on runs in turn ([`crate::timing`]), once for each pair of models.

mod climb;
mod device;
mod found;
mod knobs;
mod measured;

pub use climb::fit;
pub use device::Device;
pub use found::{Fit, Kept, LeftOut, Tried, percent};
pub use knobs::{Simplification, Simplifications, models, overrides};

use hpu_cosim::scene::Experiment;

/// Returns the simplifications of an experiment.
pub fn simplifications(experiment: &Experiment) -> Vec<Simplification> {
    experiment.simplifications().all()
}
