//! The numbers that studies compute with, and their arithmetic.
//!
//! Enclosures of real numbers prove the poles of a linear loop over ranges of its stiffness, and how far a bounded input
//! drives a system. Equations of blocks are read in real numbers, and as words beside their exact values.
//!
//! Studies spend their time here and in runs: this crate is optimised, and the rest of studies is not.

mod book;
mod characteristic;
mod crossings;
mod exact;
mod exhaust;
mod interval;
mod jet;
mod method;
mod noise;
mod open_loop;
mod parts;
mod real;
mod response;
mod series;

pub use book::Loss;
pub use characteristic::{Characteristic, Of, OnArc};
pub use crossings::{BOXES_A_RANGE, Crossings, Place, crossings, first_crossings, joined, settles};
pub use exact::{Exact, Losses};
pub use exhaust::{Tried, tried_all};
pub use interval::{Complex, Interval, Matrix};
pub use jet::{ALONG, Jet, MOST_SIDES};
pub use noise::{Asked, Beside};
pub use open_loop::{OpenLoop, Plants, Side, Term};
pub use parts::is_on_the_way;
pub use real::{Real, law};
pub use response::{Flow, Output, Parts};
pub use series::{Series, exponential};
