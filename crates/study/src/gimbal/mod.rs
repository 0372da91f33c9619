//! The segment on a gimbal, for studies.

mod criteria;
mod switches;

use hpu_cosim::Trace;
use hpu_cosim::scene::{GimbalScene, Scene};

use crate::device::{Device, Reach};

pub use criteria::{Criteria, NAMES, Rest};
pub use switches::Switches;

impl Device for GimbalScene {
    /// Each servo passes through all its positions.
    fn reaches(&self) -> Result<Vec<Reach>, String> {
        let half = f64::from(self.method.config.gimbal.count_width - 1).exp2() - 1.0;
        Ok((0..3).map(|_| Reach { counts: [-half, half], most_per_s: f64::INFINITY }).collect())
    }

    /// The radius, by its column in a trace.
    fn motion<'t>(&self, trace: &'t Trace) -> &'t [f64] {
        trace.real(hpu_cosim::RADIUS)
    }

    fn priced(&self) -> Result<(), String> {
        Err("Yosys takes minutes for the loop of a gimbal".into())
    }

    fn limited(&self) -> Result<&Scene, String> {
        Err("limits are those of an axis; where a gimbal's switch is stable, a map tells: hpu map --help".into())
    }

    fn loops(&self) -> Result<&'static dyn crate::widths::search::Loops, String> {
        Err("a search varies the loops of an axis and of a PHANToM; change a gimbal's words in its blocks".into())
    }

    fn bounds(&self) -> Result<crate::widths::proof::Proof, String> {
        Err("proofs know the loops of an axis and of a PHANToM; hpu widths without --prove measures a gimbal's".into())
    }

    fn gappa(&self) -> Result<String, String> {
        Err("proofs know the loops of an axis and of a PHANToM".into())
    }

    fn tables(&self) -> Result<crate::tables::Tables, String> {
        Err("a gimbal has one table, that of its crank; hpu block crank_table shows it".into())
    }
}
