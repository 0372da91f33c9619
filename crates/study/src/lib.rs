//! Many runs and their pictures: limits of a scene's stiffness, charts of a run.

pub mod chart;
pub mod limits;

mod criteria;
mod sampled;

pub use sampled::SampledLoop;
