//! Ranges of the words of arms: of the PHANToM's three joints, of the segment on a gimbal, and of EPFL's paddle.

mod gappa;
mod gimbal;
#[cfg(not(target_family = "wasm"))]
mod paddle;
mod phantom;
mod posture;

pub use gappa::script;
pub use gimbal::proof as gimbal_proof;
#[cfg(not(target_family = "wasm"))]
pub use paddle::proof as paddle_proof;
pub use phantom::proof as phantom_proof;
pub use posture::{SIGNALS, SignalBound, bounds};
