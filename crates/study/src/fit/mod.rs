//! The least model that still answers a scene's question.
//!
//! A scene says which outputs it is about (`[accuracy] outputs`) and how exact they have to be. What its model has
//! beyond what they need is left out, one simplification at a time ([`simplifications`]): the bridge's switching, the
//! winding's inductance, friction or its sticking, the words, what happens between samples or within a fixed step, the
//! encoder's counts; of a PHANToM its transmission, its amplifiers, its joints.
//!
//! The models are tried from the cheapest up, by an estimate; once one will do, those that should be nearly as cheap
//! are tried too, and the one that was measured to be the fastest is taken. One will do when
//!
//! 1. every output is within *half* of the tolerance of the reference's (the scene as written, from event to event),
//!    with the same verdict;
//! 2. each thing that it leaves out changes no output by more than that either, so that no two errors cancel each
//!    other;
//! 3. a fixed step is no lucky one: the next two shorter steps of its ladder are as good, and what they change does not
//!    grow;
//! 4. it is within the tolerance, with the same verdict, in the scenes around: the wall 5 % softer and stiffer, and
//!    moved either way by up to 7.5 counts, so that a contact meets the sampling in another phase and words another
//!    count each time;
//! 5. where the verdict's rms is within twice of its limit, here or around, the next longer step of its ladder would do
//!    as well.
//!
//! What is measured is a run from a parsed scene to its verdict, the best of a few while they are short; the memory of
//! the rows is that of the run before. Then its neighbours are looked at: those with one thing less left out, for what
//! each costs in accuracy, and whether it gains any time; those with one thing more, for why that had to stay. Nothing
//! is taken on trust: each figure is of a run against a run.

mod climb;
mod found;
mod knobs;
mod measured;

pub use climb::fit;
pub use found::{Fit, FitError, Kept, LeftOut, percent};
pub use knobs::{Simplification, models, overrides, simplifications};
