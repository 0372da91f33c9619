//! The device of an axis's world: flowed exactly, or stepped.

use hpu_plant::network::{MOST_STATES, NetworkDevice};
use hpu_plant::pmsm::PmsmDevice;
use hpu_plant::{Device, Drive, Energy, Event, Measured, Pace, Pulses, REALS, State};

use crate::world::encoder::side_of;
use crate::world::plant::SMALL;
use crate::world::stepped::Stepped;
use hpu_scene::{Phase, Reading};

/// Index of the angle in a state.
const ANGLE: usize = 2;

/// A device in motion. All kinds have the same functions.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run, and the larger is the usual one")]
pub(crate) enum AnyDevice<'p> {
    /// A motor or a mass, flowed exactly: the usual one, which one question tells from all others.
    Exact(Device<'p>),
    /// Another one.
    Other(Box<Other<'p>>),
}

/// A device that is no axis flowed exactly.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub(crate) enum Other<'p> {
    /// A network of few states.
    Small(NetworkDevice<'p, SMALL>),
    /// Any other network.
    Large(NetworkDevice<'p, MOST_STATES>),
    /// In fixed steps.
    Stepped(Stepped<'p>),
    /// A motor with three phases.
    Pmsm(Phased<'p>),
}

/// A motor with three phases.
#[derive(Clone)]
pub(crate) struct Phased<'p> {
    body: PmsmDevice<'p>,
    /// A page has no design of a user's own, so it has no such motor, and loads no code for one.
    #[cfg(target_family = "wasm")]
    never: std::convert::Infallible,
}

impl<'p> Phased<'p> {
    /// Creates a motor that no further encoder watches.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn new(body: PmsmDevice<'p>) -> Self {
        Self { body }
    }
}

macro_rules! forward {
    ($self:ident, $body:ident => $call:expr) => {
        match $self {
            Self::Exact($body) => $call,
            Self::Other(other) => each!(&**other, $body => $call),
        }
    };
}

macro_rules! each {
    ($other:expr, $body:ident => $call:expr) => {
        match $other {
            Other::Small($body) => $call,
            Other::Large($body) => $call,
            Other::Stepped($body) => $call,
            Other::Pmsm(Phased { body: $body, .. }) => $call,
        }
    };
}

macro_rules! network {
    ($self:ident, $body:ident => $call:expr) => {
        match $self {
            Self::Other(other) => match &mut **other {
                Other::Small($body) => $call,
                Other::Large($body) => $call,
                Other::Stepped(_) | Other::Pmsm(_) => unreachable!("no sensor reads a body of it"),
            },
            Self::Exact(_) => unreachable!("an axis has no further sensors"),
        }
    };
}

/// The functions that a run calls most, out of the way of the usual device's.
impl Other<'_> {
    #[inline(never)]
    fn driven(&mut self, edge: u64, drive: Drive) {
        each!(self, body => body.driven(edge, drive));
    }

    #[inline(never)]
    fn next_event(&mut self, from: u64, to: u64, band: (f64, f64)) -> Option<Event> {
        match self {
            Self::Small(body) => body.next_event(from, to, band),
            Self::Large(body) => body.next_event(from, to, band),
            Self::Stepped(body) => body.next_event(from, to, band),
            Self::Pmsm(Phased { body, .. }) => body.next_event(from, to, band).map(|edge| (edge, State::default())),
        }
    }

    #[inline(never)]
    fn arrive(&mut self, event: Event) -> f64 {
        match self {
            Self::Small(body) => body.arrive(event)[ANGLE],
            Self::Large(body) => body.arrive(event)[ANGLE],
            Self::Stepped(body) => body.arrive(event)[ANGLE],
            // It knows no more of its event than the edge.
            Self::Pmsm(Phased { body, .. }) => body.step(event.0)[ANGLE],
        }
    }

    #[inline(never)]
    fn step(&mut self, edge: u64) -> f64 {
        each!(self, body => body.step(edge)[ANGLE])
    }

    #[inline(never)]
    fn side_of_band(&mut self, edge: u64, angle_rad: f64, band: (f64, f64)) -> i8 {
        match self {
            Self::Small(body) => body.side_of_band(edge, angle_rad, band),
            Self::Large(body) => body.side_of_band(edge, angle_rad, band),
            Self::Pmsm(Phased { body, .. }) => body.side_of_band(edge, angle_rad, band),
            Self::Stepped(_) => side_of(band, angle_rad),
        }
    }

    #[inline(never)]
    fn is_surely_within(&mut self, edge: u64, angle_rad: f64, band: (f64, f64)) -> bool {
        match self {
            Self::Small(body) => body.is_surely_within(edge, angle_rad, band),
            Self::Large(body) => body.is_surely_within(edge, angle_rad, band),
            Self::Pmsm(Phased { body, .. }) => body.is_surely_within(edge, angle_rad, band),
            Self::Stepped(_) => side_of(band, angle_rad) == 0,
        }
    }
}

impl<'p> AnyDevice<'p> {
    /// Returns the body if it is one in steps.
    #[inline(always)]
    pub(crate) fn stepped(&self) -> Option<&Stepped<'_>> {
        match self {
            Self::Other(other) => match &**other {
                Other::Stepped(body) => Some(body),
                _ => None,
            },
            Self::Exact(_) => None,
        }
    }

    /// Returns the angle at an edge that has not been left yet.
    #[inline]
    pub(crate) fn angle_rad(&self, edge: u64) -> f64 {
        forward!(self, body => body.state(edge)[ANGLE])
    }

    /// Returns the outputs at an edge that has not been left yet.
    pub(crate) fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        forward!(self, body => body.reals(edge))
    }

    /// Returns the state at an edge that has not been left yet, rounded once; of a body in steps its straight line.
    pub(crate) fn exact_state(&self, edge: u64) -> State {
        match self {
            Self::Exact(body) => body.exact_state(edge),
            Self::Other(other) => match &**other {
                Other::Small(body) => body.exact_state(edge),
                Other::Large(body) => body.exact_state(edge),
                Other::Stepped(body) => body.state(edge),
                Other::Pmsm(Phased { body, .. }) => body.exact_state(edge),
            },
        }
    }

    /// Returns the outputs of the state at an edge.
    pub(crate) fn shown(&self, edge: u64, x: &State) -> [f64; REALS.len()] {
        match self {
            Self::Exact(body) => body.shown(x),
            Self::Other(other) => match &**other {
                Other::Small(body) => body.shown(x),
                Other::Large(body) => body.shown(x),
                Other::Stepped(body) => body.shown(x),
                Other::Pmsm(Phased { body, .. }) => body.shown(edge, x),
            },
        }
    }

    /// Returns the outputs at this edge and at all later ones, if the body is known to move no more as it is driven.
    pub(crate) fn still(&self, edge: u64) -> Option<[f64; REALS.len()]> {
        match self {
            Self::Exact(body) => body.still(edge),
            Self::Other(other) => match &**other {
                Other::Small(body) => body.still(edge),
                Other::Large(body) => body.still(edge),
                Other::Pmsm(Phased { body, .. }) => body.still(edge),
                Other::Stepped(_) => None,
            },
        }
    }

    /// Returns whether the body certainly still knows its outputs at all earlier edges when it has moved to this one,
    /// until it is driven anew.
    #[inline(always)]
    pub(crate) fn keeps(&self, edge: u64) -> bool {
        match self {
            Self::Exact(body) => body.keeps(edge),
            Self::Other(_) => false,
        }
    }

    /// Writes the outputs at the edges `first`, `first + stride` and so on; the body has not left them yet.
    pub(crate) fn rows(&self, first: u64, stride: u64, rows: &mut [[f64; REALS.len()]]) {
        match self {
            Self::Exact(body) => body.rows(first, stride, rows),
            Self::Other(_) => {
                for (row, index) in rows.iter_mut().zip(0..) {
                    *row = self.reals(first + index * stride);
                }
            }
        }
    }

    /// Gathers from now on what [`measured`](Self::measured) returns, with the extremes of current and speed where they
    /// are read.
    pub(crate) fn measure(&mut self, pace: Pace, read: [bool; 2]) {
        match self {
            Self::Exact(body) => body.measure(pace, read),
            Self::Other(other) => each!(&mut **other, body => body.measure(pace, read)),
        }
    }

    /// Returns mean and extremes of current and speed between the row at an edge not left yet, at which the state is
    /// `x`, and the row before it.
    pub(crate) fn measured(&self, edge: u64, x: &State) -> Option<[Measured; 2]> {
        forward!(self, body => body.measured(edge, x))
    }

    /// Returns the hand's angle and torque in the state at an edge; of a network at the body that the hand holds.
    pub(crate) fn felt(&self, edge: u64, x: &State) -> [f64; 2] {
        match self {
            Self::Exact(body) => body.felt(x),
            Self::Other(other) => match &**other {
                Other::Small(body) => body.felt(edge),
                Other::Large(body) => body.felt(edge),
                Other::Pmsm(Phased { body, .. }) => body.felt(edge),
                Other::Stepped(body) => body.felt(x),
            },
        }
    }

    /// Sets the angle and the speed that the hand intends from `edge` on.
    pub(crate) fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        match self {
            Self::Exact(body) => body.intend(edge, angle_rad, speed_rad_per_s),
            Self::Other(other) => each!(&mut **other, body => body.intend(edge, angle_rad, speed_rad_per_s)),
        }
    }

    /// Sets the drive of the device from `edge` on.
    #[inline(always)]
    pub(crate) fn driven(&mut self, edge: u64, drive: Drive) {
        match self {
            Self::Exact(body) => body.driven(edge, drive),
            Self::Other(other) => other.driven(edge, drive),
        }
    }

    /// Cruises as [`Device::cruise`] does; a body in steps never cruises and returns `None`.
    pub(crate) fn cruise(&mut self, edge: u64, last: u64, band: (f64, f64), pulses: &Pulses) -> Option<u64> {
        match self {
            Self::Exact(body) => body.cruise(edge, last, band, pulses),
            Self::Other(_) => None,
        }
    }

    /// Returns the first edge in (`from`, `to`] at which the motion changes its mode or the angle leaves a band.
    #[inline]
    pub(crate) fn next_event(&mut self, from: u64, to: u64, band: (f64, f64)) -> Option<Event> {
        match self {
            Self::Exact(body) => body.next_event(from, to, band),
            Self::Other(other) => other.next_event(from, to, band),
        }
    }

    /// Returns for how many edges after this one, up to `edges`, nothing happens while the angle is in this band. For a
    /// body in steps it returns 0, which promises nothing.
    #[inline]
    pub(crate) fn idles(&mut self, edge: u64, edges: u64, band: (f64, f64)) -> u64 {
        let event = match self {
            Self::Exact(body) => body.next_event(edge, edge + edges, band),
            Self::Other(other) if matches!(**other, Other::Stepped(_)) => return 0,
            Self::Other(other) => other.next_event(edge, edge + edges, band),
        };
        event.map_or(edges, |event| event.0 - edge - 1)
    }

    /// Moves to the edge of an event and returns the angle there.
    #[inline(always)]
    pub(crate) fn arrive(&mut self, event: Event) -> f64 {
        match self {
            Self::Exact(body) => body.arrive(event)[ANGLE],
            Self::Other(other) => other.arrive(event),
        }
    }

    /// Moves to the next edge and returns the angle there.
    #[inline(always)]
    pub(crate) fn step(&mut self, edge: u64) -> f64 {
        match self {
            Self::Exact(body) => body.step(edge)[ANGLE],
            Self::Other(other) => other.step(edge),
        }
    }

    /// Returns on which side of a band the angle lies at an edge, where its `f64` value is `angle_rad`: -1 below, 0
    /// inside, 1 above.
    #[inline(always)]
    pub(crate) fn side_of_band(&mut self, edge: u64, angle_rad: f64, band: (f64, f64)) -> i8 {
        match self {
            Self::Exact(body) => body.side_of_band(edge, angle_rad, band),
            Self::Other(other) => other.side_of_band(edge, angle_rad, band),
        }
    }

    /// Returns whether the angle, whose `f64` value this is, lies so far inside a band that `f64` can tell.
    #[inline(always)]
    pub(crate) fn is_surely_within(&mut self, edge: u64, angle_rad: f64, band: (f64, f64)) -> bool {
        match self {
            Self::Exact(body) => body.is_surely_within(edge, angle_rad, band),
            Self::Other(other) => other.is_surely_within(edge, angle_rad, band),
        }
    }

    /// Watches the reading of a further sensor. See [`NetworkDevice::watch`].
    pub(crate) fn watch(&mut self, sensor: usize, band: (f64, f64)) {
        if let Some(Phased { body, .. }) = self.phased() {
            return body.watch(sensor, band);
        }
        network!(self, body => body.watch(sensor, band));
    }

    /// Returns the motor with three phases, if it is one.
    fn phased(&mut self) -> Option<&mut Phased<'p>> {
        let Self::Other(other) = self else { return None };
        if let Other::Pmsm(phased) = &mut **other { Some(phased) } else { None }
    }

    /// Returns the reading of a further sensor at an edge that has not been left yet.
    pub(crate) fn reading(&mut self, sensor: usize, edge: u64) -> f64 {
        if let Some(Phased { body, .. }) = self.phased() {
            return body.reading_of(sensor, edge);
        }
        network!(self, body => body.reading(sensor, edge))
    }

    /// Returns the greatest integer up to a multiple of a reading. See [`NetworkDevice::floor`].
    pub(crate) fn floor(&mut self, reading: Reading, edge: u64, scale: f64) -> i64 {
        let Self::Other(other) = self else { unreachable!("an axis has no further sensors") };
        match (&mut **other, reading) {
            (Other::Pmsm(Phased { body, .. }), Reading::Phase(phase)) => body.floor(Some(phase.leg), edge, scale),
            (Other::Pmsm(Phased { body, .. }), Reading::Position(sensor)) => body.floor_of_reading(sensor, edge, scale),
            (_, Reading::Position(sensor)) => network!(self, body => body.floor(Some(sensor), edge, scale)),
            _ => network!(self, body => body.floor(None, edge, scale)),
        }
    }

    /// Puts a first-order lag behind the current of a phase, and returns its index.
    pub(crate) fn lag(&mut self, phase: Phase, corner_rad_per_s: f64) -> usize {
        match self.phased() {
            Some(Phased { body, .. }) => body.lag(phase.leg, phase.is_low_side, corner_rad_per_s),
            None => unreachable!("a motor with three phases alone has such lags"),
        }
    }

    /// Returns the greatest integer up to a multiple of the current behind a lag at an edge.
    pub(crate) fn floor_of_lag(&mut self, lag: usize, edge: u64, scale: f64) -> i64 {
        match self.phased() {
            Some(Phased { body, .. }) => (scale * body.lagged(lag, edge)).floor() as i64,
            None => unreachable!("a motor with three phases alone has such lags"),
        }
    }

    /// Returns the charge that has flowed through a phase of a motor with three, or else through the drive.
    pub(crate) fn charge_as(&self, winding: Option<usize>, edge: u64) -> f64 {
        match (self, winding) {
            (Self::Other(other), Some(phase)) if let Other::Pmsm(Phased { body, .. }) = &**other => {
                body.charges(edge)[phase]
            }
            _ => self.energy(edge).current_and_angle_since(&Energy::default())[0],
        }
    }

    /// Gives the floors of multiples of the current at edges that have not been left yet. See
    /// [`NetworkDevice::floors`].
    pub(crate) fn floors(&mut self, (first, stride): (u64, u64), scale: f64, count: usize, give: impl FnMut(i64)) {
        network!(self, body => body.floors(first, stride, scale, count, give));
    }

    /// Returns on which side of a band the reading of a further sensor lies. See [`NetworkDevice::side_of_reading`].
    pub(crate) fn side_of_reading(&mut self, sensor: usize, edge: u64, value: f64, band: (f64, f64)) -> i8 {
        if let Some(Phased { body, .. }) = self.phased() {
            return body.side_of_reading(sensor, edge, band);
        }
        network!(self, body => body.side_of_reading(sensor, edge, value, band))
    }

    /// Returns how many decisions were made again in double-double; 0 for a body in steps.
    pub(crate) fn redecided(&self) -> u64 {
        match self {
            Self::Exact(body) => body.redecided(),
            Self::Other(other) => match &**other {
                Other::Small(body) => body.redecided(),
                Other::Large(body) => body.redecided(),
                Other::Stepped(_) | Other::Pmsm(_) => 0,
            },
        }
    }

    /// Returns the last edge to which the present motion can be computed.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn reach(&self) -> u64 {
        match self {
            Self::Exact(body) => body.reach(),
            Self::Other(other) => match &**other {
                Other::Small(body) => body.reach(),
                Other::Large(body) => body.reach(),
                Other::Stepped(_) | Other::Pmsm(_) => u64::MAX,
            },
        }
    }

    /// Returns a number that is the same at two edges of which the device recurs; `None` of a body in steps
    /// and of a motor with three phases.
    #[inline]
    pub(crate) fn mark(&self, edge: u64) -> Option<u64> {
        match self {
            Self::Exact(body) => Some(body.mark(edge)),
            Self::Other(other) => match &**other {
                Other::Small(body) => Some(body.mark(edge)),
                Other::Large(body) => Some(body.mark(edge)),
                Other::Stepped(_) | Other::Pmsm(_) => None,
            },
        }
    }

    /// Returns whether the device is at `edge`, in every bit that decides how it moves, as an earlier one was at
    /// `then`.
    pub(crate) fn recurs(&self, edge: u64, earlier: &Self, then: u64) -> bool {
        match (self, earlier) {
            (Self::Exact(now), Self::Exact(earlier)) => now.recurs(edge, earlier, then),
            (Self::Other(now), Self::Other(earlier)) => match (&**now, &**earlier) {
                (Other::Small(now), Other::Small(earlier)) => now.recurs(edge, earlier, then),
                (Other::Large(now), Other::Large(earlier)) => now.recurs(edge, earlier, then),
                _ => false,
            },
            _ => false,
        }
    }

    /// Moves on by `times` repetitions of all that has happened between two states, in which `edges` pass altogether.
    pub(crate) fn repeat(&mut self, edges: u64, states: [&Self; 2], times: u64) {
        match (self, states) {
            (Self::Exact(body), [Self::Exact(then), Self::Exact(now)]) => body.repeat(edges, [then, now], times),
            (Self::Other(body), [Self::Other(then), Self::Other(now)]) => match (&mut **body, &**then, &**now) {
                (Other::Small(body), Other::Small(then), Other::Small(now)) => body.repeat(edges, [then, now], times),
                (Other::Large(body), Other::Large(then), Other::Large(now)) => {
                    body.repeat(edges, [then, now], times);
                }
                _ => {}
            },
            _ => {}
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

    /// Returns why the motion cannot go on, or `None` if it can.
    #[inline]
    pub(crate) fn over(&self) -> Option<&'static str> {
        self.stepped().and_then(Stepped::over)
    }

    /// Returns the steps done; 0 for a body flowed exactly.
    pub(crate) fn steps(&self) -> u64 {
        self.stepped().map_or(0, Stepped::steps)
    }
}
