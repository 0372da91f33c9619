//! The device of an axis's world: flowed exactly, or stepped.

use hpu_plant::{Device, Drive, Energy, Event, Measured, Pace, Pulses, REALS};

use crate::encoder::side_of;
use crate::stepped::Stepped;

/// Index of the angle in a state.
const ANGLE: usize = 2;

/// A device in motion. Both kinds have the same functions.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run, and the larger is the usual one")]
pub(crate) enum Body<'p> {
    /// Flowed exactly.
    Exact(Device<'p>),
    /// In fixed steps.
    Stepped(Box<Stepped<'p>>),
}

macro_rules! forward {
    ($self:ident, $body:ident => $call:expr) => {
        match $self {
            Self::Exact($body) => $call,
            Self::Stepped($body) => $call,
        }
    };
}

impl Body<'_> {
    /// The angle at an edge that has not been left yet.
    #[inline]
    pub(crate) fn angle_rad(&self, edge: u64) -> f64 {
        forward!(self, body => body.state(edge)[ANGLE])
    }

    /// The outputs at such an edge.
    pub(crate) fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        forward!(self, body => body.reals(edge))
    }

    /// The outputs at such an edge, `stride` after it, and so on.
    pub(crate) fn rows(&self, first: u64, stride: u64, rows: &mut [[f64; REALS.len()]]) {
        match self {
            Self::Exact(body) => body.rows(first, stride, rows),
            Self::Stepped(body) => {
                for (row, index) in rows.iter_mut().zip(0..) {
                    *row = body.reals(first + index * stride);
                }
            }
        }
    }

    /// Keeps what [`measured`](Self::measured) tells.
    pub(crate) fn measure(&mut self, pace: Pace) {
        forward!(self, body => body.measure(pace));
    }

    /// Current and speed between the row at such an edge and the one before it.
    pub(crate) fn measured(&self, edge: u64) -> Option<[Measured; 2]> {
        forward!(self, body => body.measured(edge))
    }

    /// The hand's angle and torque at such an edge.
    pub(crate) fn felt(&self, edge: u64) -> [f64; 2] {
        forward!(self, body => body.felt(edge))
    }

    /// From `edge` on the hand means to be at this angle and to move at this speed.
    pub(crate) fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        forward!(self, body => body.intend(edge, angle_rad, speed_rad_per_s));
    }

    /// Sets what drives it from `edge` on.
    #[inline(always)]
    pub(crate) fn driven(&mut self, edge: u64, drive: Drive) {
        forward!(self, body => body.driven(edge, drive));
    }

    /// See [`Device::cruise`]; a body in steps keeps to those.
    pub(crate) fn cruise(&mut self, edge: u64, last: u64, band: (f64, f64), pulses: &Pulses) -> Option<u64> {
        match self {
            Self::Exact(body) => body.cruise(edge, last, band, pulses),
            Self::Stepped(_) => None,
        }
    }

    /// The first edge in (`from`, `to`] at which the motion changes by itself or the angle leaves a band.
    #[inline]
    pub(crate) fn next_event(&mut self, from: u64, to: u64, band: (f64, f64)) -> Option<Event> {
        forward!(self, body => body.next_event(from, to, band))
    }

    /// Comes to the edge of an event, and returns the angle there.
    #[inline(always)]
    pub(crate) fn arrive(&mut self, event: Event) -> f64 {
        forward!(self, body => body.arrive(event)[ANGLE])
    }

    /// Comes to the next edge, and returns the angle there.
    #[inline(always)]
    pub(crate) fn step(&mut self, edge: u64) -> f64 {
        forward!(self, body => body.step(edge)[ANGLE])
    }

    /// On which side of a band the angle lies at an edge, where its `f64` value is `angle_rad`: -1 below, 0 inside, 1
    /// above.
    #[inline(always)]
    pub(crate) fn side_of_band(&mut self, edge: u64, angle_rad: f64, band: (f64, f64)) -> i8 {
        match self {
            Self::Exact(body) => body.side_of_band(edge, angle_rad, band),
            Self::Stepped(_) => side_of(band, angle_rad),
        }
    }

    /// Whether the angle, whose `f64` value this is, lies inside a band so far that `f64` can tell.
    #[inline(always)]
    pub(crate) fn is_surely_within(&mut self, edge: u64, angle_rad: f64, band: (f64, f64)) -> bool {
        match self {
            Self::Exact(body) => body.is_surely_within(edge, angle_rad, band),
            Self::Stepped(_) => side_of(band, angle_rad) == 0,
        }
    }

    /// Decisions made again in higher precision: of a body that has it.
    pub(crate) fn redecided(&self) -> u64 {
        match self {
            Self::Exact(body) => body.redecided(),
            Self::Stepped(_) => 0,
        }
    }

    pub(crate) fn energy(&self, edge: u64) -> Energy {
        forward!(self, body => body.energy(edge))
    }

    pub(crate) fn stored_j(&self, edge: u64) -> f64 {
        forward!(self, body => body.stored_j(edge))
    }

    pub(crate) fn mode_changes(&self) -> u64 {
        forward!(self, body => body.mode_changes())
    }

    /// Why it cannot go on, if it cannot.
    #[inline]
    pub(crate) fn over(&self) -> Option<&'static str> {
        match self {
            Self::Exact(_) => None,
            Self::Stepped(body) => body.over(),
        }
    }

    /// Steps done: of a body that has them.
    pub(crate) fn steps(&self) -> u64 {
        match self {
            Self::Exact(_) => 0,
            Self::Stepped(body) => body.steps(),
        }
    }
}
