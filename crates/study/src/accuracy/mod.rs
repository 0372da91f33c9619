//! Speed against accuracy: every way to run a scene, how fast it is and how wrong.
//!
//! The reference is the scene as it is written, from event to event. A contestant ([`contestants`]) is the scene under
//! overrides, or a published criterion, which tells a verdict and runs nothing. What counts as its error is the worst
//! of the outputs that the scene names, or that the reference's verdict makes worth comparing ([`Outputs`]); what
//! counts as its speed is motion over wall time, from a parsed scene to a verdict ([`Race`]).
//!
//! Errors are of the whole motion. So are wall times, but for long runs that go on by edges or fixed steps: these are
//! timed over the first part of the motion, and scaled to all of it by how the wall time of the run for the errors was
//! spread ([`Speed::timed_s`] says which).

mod contestants;
mod found;
mod front;
mod outputs;
mod over_map;
mod profile;
mod race;
mod table;

pub use contestants::{Contestant, EVENTS, SOLVERS, contestants, named, time};
pub use found::{Chart, Entry, Grade, Row, Speed};
pub use front::front;
pub(crate) use outputs::ready;
pub use outputs::{Outputs, driver, usual, worst};
pub use over_map::{SHORTEST_STEP_S, Share, Tour, front_of_shares};
pub use race::{Plan, Race, RaceError};
pub use table::{csv, grade_name, outputs_of};
