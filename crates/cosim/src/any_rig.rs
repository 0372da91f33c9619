//! Any scene made ready, whether blocks of this project or a design of the user's own close its loop.

use crate::dut::{Designs, DutSession, Fault};
use crate::outline::Outline;
use crate::ready::Ready;
use crate::rig::Rig;
use crate::scene::Experiment;

/// Any scene made ready.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum AnyRig<'s> {
    /// Blocks of this project close the loop.
    Ours(Ready<'s>),
    /// A design of the user's own closes the loop.
    Dut(DutSession<'s>),
}

impl<'s> AnyRig<'s> {
    /// Makes a scene ready. If the scene has a design, `designs` builds it, with the signals `inside` if they are asked
    /// for.
    ///
    /// # Errors
    ///
    /// As [`Ready::new`] and [`DutSession::new`].
    pub fn new(experiment: &'s Experiment, designs: &dyn Designs, inside: bool) -> Result<Self, Fault> {
        Ok(match experiment {
            Experiment::Dut(scene) => Self::Dut(DutSession::new(scene, designs, inside)?),
            ours => Self::Ours(Ready::new(ours)?),
        })
    }
}

macro_rules! forward {
    ($self:ident, $rig:ident => $call:expr) => {
        match $self {
            Self::Ours($rig) => $call,
            Self::Dut($rig) => $call,
        }
    };
}

impl Rig for AnyRig<'_> {
    fn outline(&self) -> &Outline {
        forward!(self, rig => rig.outline())
    }
}
