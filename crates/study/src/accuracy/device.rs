//! The questions of a comparison of models to a device.

use hpu_cosim::Trace;

use super::Contestant;

/// A `Device` says how models of its scene are made and compared. Implemented by the scene of each kind of device.
pub trait Device {
    /// Returns the motion of a trace by which models are compared.
    fn motion<'t>(&self, trace: &'t Trace) -> &'t [f64] {
        trace.angles_rad()
    }

    /// Returns the models of the scene that differ from the scene as written.
    fn contestants(&self) -> Vec<Contestant> {
        Vec::new()
    }
}
