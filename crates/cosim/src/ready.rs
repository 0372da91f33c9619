//! Any scene, made ready.

use hpu_signal::{Clock, Observe, Real, Signal};

use crate::engine::{Comparison, Control, Driver};
use crate::phantom::PhantomSession;
use crate::rig::{Direct, Rig, TheLoop, Visit, Wired};
use crate::scene::{Experiment, Record};
use crate::session::Session;
use crate::session_error::SessionError;
use crate::summary::Summary;
use crate::trace::Trace;
use crate::verdict::{Abort, Verdict};

/// Any scene, made ready.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum Ready<'s> {
    /// An axis.
    Axis(Session<'s>),
    /// A PHANToM.
    Phantom(PhantomSession<'s>),
}

macro_rules! forward {
    ($self:ident, $rig:ident => $call:expr) => {
        match $self {
            Self::Axis($rig) => $call,
            Self::Phantom($rig) => $call,
        }
    };
}

impl<'s> Ready<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible, or its device has no datapath.
    pub fn new(experiment: &'s Experiment) -> Result<Self, SessionError> {
        match experiment {
            Experiment::Axis(scene) => Session::new(scene).map(Self::Axis),
            Experiment::Phantom(scene) => PhantomSession::new(scene).map(Self::Phantom),
            Experiment::Dut(scene) => {
                let reason = "this asks for blocks of hpu's own, and the scene has a design of yours";
                Err(SessionError::Scene(scene.error("dut", reason)))
            }
        }
    }
}

impl Rig for Ready<'_> {
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

    fn closed_by(&self) -> &str {
        forward!(self, rig => rig.closed_by())
    }

    fn nets(&self) -> Vec<Signal> {
        forward!(self, rig => rig.nets())
    }
}

impl Wired for Ready<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        forward!(self, rig => rig.wiring())
    }

    fn gates_drive(&self) -> bool {
        forward!(self, rig => rig.gates_drive())
    }

    fn visit<'v, V: Visit<'v>>(&'v self, visit: V) -> V::Out {
        forward!(self, rig => rig.visit(visit))
    }

    fn run(&self, driver: Driver, trace: &mut Trace, observer: &mut dyn Observe, control: &Control) -> Summary {
        forward!(self, rig => rig.run(driver, trace, observer, control))
    }

    fn compare(&self, edges: u64) -> Comparison {
        forward!(self, rig => rig.compare(edges))
    }

    fn direct(&self) -> Option<Box<dyn Direct + '_>> {
        forward!(self, rig => rig.direct())
    }

    fn driver(&self) -> Driver {
        forward!(self, rig => rig.driver())
    }
}
