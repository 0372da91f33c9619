//! Enclosures of real numbers, and what is proved of linear systems with them: the poles of a loop over ranges of its
//! stiffness, and how far a bounded input drives a system.
//!
//! It is the arithmetic of studies, and all that takes their time beside the runs: it is optimised, and they are not.

mod characteristic;
mod crossings;
mod interval;
mod jet;
mod open_loop;
mod response;
mod series;

pub use characteristic::{Characteristic, Of, OnArc};
pub use crossings::{BOXES_A_RANGE, Crossings, Place, crossings, first_crossings, joined, settles};
pub use interval::{Complex, Interval, Matrix};
pub use jet::{ALONG, Jet, MOST_SIDES};
pub use open_loop::{OpenLoop, Plants, Side, Term};
pub use response::{Flow, Output, Parts};
pub use series::{Series, exponential};
