//! Ranges of the words of arms: of the PHANToM's three joints, and of the segment on a gimbal.

mod gappa;
mod gimbal;
mod phantom;
mod posture;

pub use gappa::script;
pub use gimbal::proof as gimbal_proof;
pub use phantom::proof as phantom_proof;
pub use posture::{SIGNALS, SignalBound, bounds};
