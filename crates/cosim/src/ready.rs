//! Any scene, made ready.

use hpu_signal::Observe;

use crate::engine::{Comparison, Control, Driver};
use crate::gimbal::GimbalSession;
use crate::outline::Outline;
use crate::phantom::PhantomSession;
use crate::rig::{Direct, Rig, TheLoop, Visit, Wired};
use crate::scene::Experiment;
use crate::session::Session;
use crate::session_error::SessionError;
use crate::summary::Summary;
use crate::trace::Trace;

/// Any scene, made ready.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum Ready<'s> {
    /// An axis.
    Axis(Session<'s>),
    /// A PHANToM.
    Phantom(PhantomSession<'s>),
    /// A segment on a gimbal.
    Gimbal(GimbalSession<'s>),
}

macro_rules! forward {
    ($self:ident, $rig:ident => $call:expr) => {
        match $self {
            Self::Axis($rig) => $call,
            Self::Phantom($rig) => $call,
            Self::Gimbal($rig) => $call,
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
            Experiment::Gimbal(scene) => GimbalSession::new(scene).map(Self::Gimbal),
            Experiment::Dut(scene) => {
                let reason = "this asks for blocks of hpu's own, and the scene has a design of yours";
                Err(SessionError::Scene(scene.error("dut", reason)))
            }
        }
    }
}

impl Rig for Ready<'_> {
    fn outline(&self) -> &Outline {
        forward!(self, rig => rig.outline())
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
