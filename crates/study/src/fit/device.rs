//! The questions of a search of the least model to a device.

use super::Simplifications;

/// A `Device` says what a cheaper model of its scene may leave out. Implemented by the scene of each kind of device.
pub trait Device {
    /// Returns the neighbouring scenes in which a model is also judged, each as a key and its value in SI units: the
    /// wall 5 % softer and stiffer, and a few counts nearer and farther; other parts by 5 % where there is no wall.
    fn around(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// Returns what a cheaper model of the scene may leave out.
    fn simplifications(&self) -> Simplifications {
        Simplifications::default()
    }
}
