//! Mathematics on a scene and its datapath: stable sets of linear loops, and ranges of words for every motion.
//!
//! [`linear`] proves at which stiffnesses a linear loop settles. [`ranges`] proves bounds that no word exceeds, [`arms`]
//! those of arms. They compute with [intervals](interval), whose ends are rounded outwards. [`criteria`] are the
//! published limits, as formulas.

pub mod arms;
pub mod criteria;
pub mod exact;
pub mod interval;
pub mod linear;
pub mod ranges;
pub mod real;
pub mod sampled;
mod series;
pub mod waits;

pub use sampled::SampledLoop;
pub use waits::Wait;
