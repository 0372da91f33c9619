//! An arm in motion: flowed by its series, or stepped.

use hpu_plant::arm::{Arm, ArmEnergy, ArmModel, ArmMotion, ArmState, Links, SteppedArm};
use hpu_plant::{Band, Measured, Method, Pace};

use crate::world::stepped::DIVERGED;

/// An arm in motion. Both kinds have the same functions.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run, and the larger is the usual one")]
pub(crate) enum ArmBody<'p, L: Links = ArmModel> {
    /// Flowed by its Taylor series.
    Exact(ArmMotion<'p, L>),
    /// In fixed steps.
    Stepped(SteppedArm<'p, L>),
}

macro_rules! forward {
    ($self:ident, $body:ident => $call:expr) => {
        match $self {
            Self::Exact($body) => $call,
            Self::Stepped($body) => $call,
        }
    };
}

impl<'p, L: Links> ArmBody<'p, L> {
    /// Creates an arm at edge 0: stepped by `(method, clock edges of a step)` if these are given, else flowed by its
    /// series.
    pub(crate) fn new(
        arm: &'p Arm<L>,
        stepping: Option<(Method, u64)>,
        angles_rad: [f64; 3],
        speeds_rad_per_s: [f64; 3],
    ) -> Self {
        match stepping {
            None => Self::Exact(ArmMotion::new(arm, angles_rad, speeds_rad_per_s)),
            Some((method, edges)) => Self::Stepped(SteppedArm::new(arm, method, edges, angles_rad, speeds_rad_per_s)),
        }
    }

    /// Returns the first edge in (`from`, `limit`] at which an encoder's angle leaves its band, or the motion changes
    /// without a new command (as when a joint sticks or slips).
    pub(crate) fn next_event(&mut self, from: u64, limit: u64, bands: &[Band; 3]) -> Option<u64> {
        forward!(self, body => body.next_event(from, limit, bands))
    }

    /// Moves the arm to an edge and returns the angles that the encoders see there.
    #[inline]
    pub(crate) fn step(&mut self, edge: u64) -> [f64; 3] {
        forward!(self, body => body.step(edge))
    }

    /// Returns whether an encoder passed a limit so near this edge that `f64` alone may have assigned it to another
    /// edge.
    pub(crate) fn is_near(&self, edge: u64, joint: usize, limit_rad: f64) -> bool {
        match self {
            Self::Exact(body) => body.is_near(edge, joint, limit_rad),
            Self::Stepped(_) => false,
        }
    }

    /// Commands torques from `edge` on. A step that has begun goes on with the torques before.
    pub(crate) fn drive(&mut self, edge: u64, torques_nm: [f64; 3]) {
        match self {
            Self::Exact(body) => body.drive(edge, torques_nm),
            Self::Stepped(body) => body.drive(torques_nm),
        }
    }

    /// Tells the finger from `edge` on where its pad is at rest, and how fast it moves.
    pub(crate) fn press(&mut self, edge: u64, target_m: f64, speed_m_per_s: f64) {
        forward!(self, body => body.press(edge, target_m, speed_m_per_s));
    }

    pub(crate) fn state(&self, edge: u64) -> ArmState {
        forward!(self, body => body.state(edge))
    }

    /// Gathers from now on what [`measured`](Self::measured) returns.
    pub(crate) fn measure(&mut self, pace: Pace) {
        forward!(self, body => body.measure(pace));
    }

    /// Returns mean and extremes of the motors' torques between the row at an edge and the row before it.
    pub(crate) fn measured(&self, edge: u64) -> Option<[Measured; 3]> {
        forward!(self, body => body.measured(edge))
    }

    pub(crate) fn energy(&self, edge: u64) -> ArmEnergy {
        forward!(self, body => body.energy(edge))
    }

    pub(crate) fn stored_j(&self, edge: u64) -> f64 {
        forward!(self, body => body.stored_j(edge))
    }

    pub(crate) fn mode_changes(&self) -> u64 {
        forward!(self, body => body.mode_changes())
    }

    /// Returns the steps done; 0 for an arm flowed by its series.
    pub(crate) fn steps(&self) -> u64 {
        match self {
            Self::Exact(_) => 0,
            Self::Stepped(body) => body.steps(),
        }
    }

    /// Returns why the motion cannot go on, or `None` if it can.
    #[inline]
    pub(crate) fn over(&self) -> Option<&'static str> {
        match self {
            Self::Stepped(body) if body.is_lost() => Some(DIVERGED),
            _ => None,
        }
    }
}
