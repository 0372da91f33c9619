//! Any scene made ready, whether blocks of this project or a design of the user's own close its loop.

use crate::dut::{Designs, DutSimulation, Fault, Inside};
use crate::result::outline::Outline;
use crate::run::simulation::Simulation;
use crate::wired_simulation::WiredSimulation;
use hpu_scene::Experiment;

/// Any scene made ready.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum AnySimulation<'s> {
    /// Blocks of this project close the loop.
    Ours(WiredSimulation<'s>),
    /// A design of the user's own closes the loop.
    Dut(DutSimulation<'s>),
}

impl<'s> AnySimulation<'s> {
    /// Makes a scene ready. If the scene has a design, `designs` builds it, with the signals `inside`.
    ///
    /// # Errors
    ///
    /// As [`WiredSimulation::new`] and [`DutSimulation::new`].
    pub fn new(experiment: &'s Experiment, designs: &dyn Designs, inside: Inside) -> Result<Self, Fault> {
        Ok(match experiment {
            Experiment::Dut(scene) => Self::Dut(DutSimulation::new(scene, designs, inside)?),
            ours => Self::Ours(WiredSimulation::new(ours)?),
        })
    }
}

macro_rules! forward {
    ($self:ident, $simulation:ident => $call:expr) => {
        match $self {
            Self::Ours($simulation) => $call,
            Self::Dut($simulation) => $call,
        }
    };
}

impl Simulation for AnySimulation<'_> {
    fn outline(&self) -> &Outline {
        forward!(self, simulation => simulation.outline())
    }
}
