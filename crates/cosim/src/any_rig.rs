//! Any scene made ready, whether blocks of this project or a design of the user's own close its loop.

use hpu_signal::{Clock, Real, Signal};

use crate::dut::{Designs, DutSession, Fault};
use crate::ready::Ready;
use crate::rig::Rig;
use crate::scene::{Experiment, Record};
use crate::trace::Trace;
use crate::verdict::{Abort, Verdict};

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
    fn name(&self) -> &str {
        forward!(self, rig => rig.name())
    }

    fn clock(&self) -> Clock {
        forward!(self, rig => rig.clock())
    }

    fn edges(&self) -> u64 {
        forward!(self, rig => rig.edges())
    }

    fn record(&self) -> Record {
        forward!(self, rig => rig.record())
    }

    fn closed_by(&self) -> &str {
        forward!(self, rig => rig.closed_by())
    }

    fn nets(&self) -> Vec<Signal> {
        forward!(self, rig => rig.nets())
    }

    fn reals(&self) -> &'static [Real] {
        forward!(self, rig => rig.reals())
    }

    fn row(&self) -> &'static [Real] {
        forward!(self, rig => rig.row())
    }

    fn columns(&self) -> Vec<usize> {
        forward!(self, rig => rig.columns())
    }

    fn commands(&self) -> Vec<(&'static str, &'static str, f64)> {
        forward!(self, rig => rig.commands())
    }

    fn drawn(&self) -> Vec<[usize; 3]> {
        forward!(self, rig => rig.drawn())
    }

    fn has_device(&self) -> bool {
        forward!(self, rig => rig.has_device())
    }

    fn judged(&self) -> Vec<usize> {
        forward!(self, rig => rig.judged())
    }

    fn judge(&self, trace: &Trace, aborted: Option<Abort>) -> Verdict {
        forward!(self, rig => rig.judge(trace, aborted))
    }
}
