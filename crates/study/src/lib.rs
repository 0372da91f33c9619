//! Studies of many runs and their pictures: limits of a scene's stiffness, published tables run again, charts of a run.

pub mod accuracy;
pub mod chart;
pub mod criteria;
pub mod fit;
pub mod limits;
pub mod map;
pub mod page;
pub mod reproduce;
pub mod trace_table;
pub mod units;
pub mod widths;

mod interval;
mod sampled;
mod watch;

pub use sampled::SampledLoop;
