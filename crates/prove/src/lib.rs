#![doc = include_str!("../README.md")]

pub mod arms;
pub mod certify;
#[cfg(not(target_family = "wasm"))]
pub mod confined;
pub mod criteria;
#[cfg(not(target_family = "wasm"))]
pub mod escaping;
pub mod exact;
mod form;
pub mod interval;
pub mod lasting;
pub mod linear;
pub mod ranges;
pub mod real;
#[cfg(not(target_family = "wasm"))]
pub mod recurring;
mod responses;
pub mod sampled;
mod series;
mod square;
pub mod steady;
pub mod waits;

pub use sampled::SampledLoop;
pub use waits::Wait;

hpu_signal::error! {
    /// Why nothing is proved of a scene.
    pub struct Error from hpu_cosim::scene::SceneError, hpu_cosim::SimulationError, hpu_datapath::ConfigError;
}
