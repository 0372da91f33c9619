//! A device as data: bodies on joints, one drive, stops, a hand.
//!
//! | equation | |
//! |---|---|
//! | `m q'' = -d q' - s q + c - φ + forces` | a body: inertia or mass, friction, return spring, a constant force |
//! | `e = ρ q_a - q_b`, `F = k e + c e'`; on a `-ρ F`, on b `F` | a joint: `ρ` units of b for one of a |
//! | `F = k (q - q_s) + c q'` while positive | a pressed stop; it never pulls |
//! | `i' = ω (i_r - i)`, or a winding under its voltage | the drive, with the supply's limit |
//!
//! A joint without stiffness is rigid: its bodies are one, with inertias and friction as the ratio carries them. The
//! hand holds one body; a hand with a mass is a body more, on a joint that is its grip.
//!
//! A body sticks while what moves it, friction apart, stays within its stiction. Each set of bodies that stick, stops
//! that press and limits that hold is a *mode*, a linear system that flows exactly; modes end as those of an axis do.
//!
//! States: current, speed and angle of the body with the encoder, the hand's intention; then speed and angle of each
//! other body; then the integral of a drive that has one, and the outputs of sensors with a lag. They are held in
//! registers of four, so a network has 8 or 12.

mod ends;
mod energy;
mod free;
mod laws;
mod motion;

use std::fmt;

use crate::{Bridge, Hand};

pub use crate::flow::lanes::{Count, Size};
pub use free::Free;
pub use laws::NetworkLaws;
pub(crate) use laws::Touch;
pub use motion::NetworkDevice;

/// The most states of a network.
pub const MOST_STATES: usize = 12;
/// The most bodies with Coulomb friction, after rigid joints are removed.
pub const MOST_FRICTIONS: usize = 3;
/// The most pairs of stops.
pub const MOST_STOPS: usize = 2;

/// A body that turns or slides, in SI units of its coordinate (rad or m).
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Body {
    /// Inertia in kg·m², or mass in kg.
    pub inertia: f64,
    /// Viscous friction in N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// Coulomb friction in N·m or N.
    pub coulomb: f64,
    /// Friction up to which the body sticks, at least Coulomb friction.
    pub stiction: f64,
    /// Stiffness of its return spring, with that of gravity, in N·m/rad or N/m.
    pub spring: f64,
    /// A constant torque or force on it.
    pub constant: f64,
    /// Position at the start. A body on a rigid joint starts where the joint holds it.
    pub position: f64,
    /// Speed at the start.
    pub speed: f64,
}

/// A transmission from one body to another.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Joint {
    /// The body that it comes from, by its index.
    pub from: usize,
    /// The body that it goes to.
    pub to: usize,
    /// Units of the second body for one unit of the first: not 0.
    pub ratio: f64,
    /// Stiffness and damping in units of the second body; `None` if rigid.
    pub compliance: Option<(f64, f64)>,
}

/// A pair of end stops of a body: springs with dampers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stop {
    /// The body.
    pub body: usize,
    /// Positions at which it touches the stops.
    pub low: f64,
    /// The upper one.
    pub high: f64,
    /// Stiffness of either.
    pub stiffness: f64,
    /// Damping of either.
    pub damping: f64,
}

/// The drive of one body.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Feed {
    /// Torque constant in N·m/A, or N/A of a drive that pushes; also that of the back-EMF.
    pub torque_constant: f64,
    /// Resistance of the winding in Ω; 0 if it does not matter.
    pub resistance_ohm: f64,
    /// Inductance of the winding in H; 0 if it does not matter.
    pub inductance_h: f64,
    /// How it is fed.
    pub kind: FeedKind,
}

/// How a drive feeds its winding.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum FeedKind {
    /// By the voltage of a bridge.
    Bridge(Bridge),
    /// By a current that follows its reference.
    Current {
        /// The bandwidth in rad/s; infinite if it follows at once.
        bandwidth_rad_per_s: f64,
        /// Voltage of the supply in V; infinite if it sets no limit.
        supply_v: f64,
    },
    /// By a voltage from the error of the current and its integral, with back-calculation at the limit.
    Pi {
        /// Volts an ampere.
        proportional_ohm: f64,
        /// Volts an ampere and second.
        integral_ohm_per_s: f64,
        /// Whether the back-EMF is added.
        feeds_forward: bool,
        /// Voltage of the supply in V; infinite if it sets no limit.
        supply_v: f64,
    },
}

impl FeedKind {
    fn supply_v(&self) -> f64 {
        match *self {
            Self::Bridge(_) => f64::INFINITY,
            Self::Current { supply_v, .. } | Self::Pi { supply_v, .. } => supply_v,
        }
    }

    /// Returns whether the current is what is asked for, at once.
    fn is_ideal(&self) -> bool {
        matches!(self, Self::Current { bandwidth_rad_per_s, .. } if bandwidth_rad_per_s.is_infinite())
    }
}

/// A body that a further sensor reads.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sensed {
    /// The body.
    pub body: usize,
    /// The corner of a first-order lag between its position and the sensor's output, in rad/s; `None` without a lag.
    pub lag_rad_per_s: Option<f64>,
}

/// A device of bodies and joints.
#[derive(Clone, PartialEq, Debug)]
pub struct Network {
    /// The bodies.
    pub bodies: Vec<Body>,
    /// The joints between them.
    pub joints: Vec<Joint>,
    /// The end stops.
    pub stops: Vec<Stop>,
    /// The drive.
    pub feed: Feed,
    /// The body that the drive moves.
    pub driven: usize,
    /// The body with the encoder.
    pub seen: usize,
    /// The body that the hand holds.
    pub grip: usize,
    /// The hand.
    pub hand: Hand,
    /// The bodies that further sensors read.
    pub sensed: Vec<Sensed>,
}

/// The part of a network that is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// The network as a whole.
    Device,
    /// A body.
    Body(usize),
    /// A joint.
    Joint(usize),
}

/// The reason why a network is refused.
#[derive(Clone, PartialEq, Debug)]
pub struct NetworkError {
    /// The part that is refused.
    pub place: Place,
    /// The reason, and what is accepted.
    pub reason: String,
}

impl fmt::Display for NetworkError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.reason)
    }
}

impl std::error::Error for NetworkError {}

fn refused<T>(place: Place, reason: impl Into<String>) -> Result<T, NetworkError> {
    Err(NetworkError { place, reason: reason.into() })
}

/// A joint with stiffness between two bodies of a reduced network: `e = ways[0] q_a - ways[1] q_b`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub ends: [usize; 2],
    pub ways: [f64; 2],
    pub stiffness: f64,
    pub damping: f64,
}

/// A network without rigid joints. Its first body is the one with the encoder, in that body's own units.
#[derive(Clone, Debug)]
pub struct Reduced {
    pub(crate) bodies: Vec<Body>,
    pub(crate) links: Vec<Link>,
    pub(crate) stops: Vec<Stop>,
    pub(crate) feed: Feed,
    /// Torque or force of one ampere at the body with the encoder, all joints taken as rigid.
    pub(crate) effort_per_a: f64,
    /// Bodies of drive and hand, each with its units for one of the reduced body.
    pub(crate) driven: (usize, f64),
    pub(crate) grip: (usize, f64),
    pub(crate) hand: Hand,
    /// Bodies of the further sensors, each with its units for one of the reduced body, and its lag.
    pub(crate) sensed: Vec<(usize, f64, Option<f64>)>,
}

impl Network {
    /// Returns for each body the body that stands for it and all that are rigidly joined to it, and its units for one
    /// of that.
    ///
    /// # Errors
    ///
    /// When rigid joints form a cycle.
    pub fn rigid(&self) -> Result<Vec<(usize, f64)>, NetworkError> {
        let mut groups: Vec<Option<(usize, f64)>> = vec![None; self.bodies.len()];
        let mut used = vec![false; self.joints.len()];
        for root in [self.seen, self.grip, self.driven].into_iter().chain(0..self.bodies.len()) {
            if groups[root].is_some() {
                continue;
            }
            groups[root] = Some((root, 1.0));
            let mut open = vec![(root, 1.0)];
            while let Some((body, units)) = open.pop() {
                for (index, joint) in self.joints.iter().enumerate() {
                    let next = match joint {
                        Joint { compliance: Some(_), .. } => continue,
                        _ if used[index] => continue,
                        joint if joint.from == body => (joint.to, units * joint.ratio),
                        joint if joint.to == body => (joint.from, units / joint.ratio),
                        _ => continue,
                    };
                    used[index] = true;
                    if groups[next.0].is_some() {
                        let reason = "closes a cycle of rigid joints; leave it out, or give it a stiffness";
                        return refused(Place::Joint(index), reason);
                    }
                    groups[next.0] = Some((root, next.1));
                    open.push(next);
                }
            }
        }
        Ok(groups.into_iter().map(|group| group.expect("each body has been a root")).collect())
    }

    /// Returns the units of a body for one unit of the body with the encoder, all joints taken as rigid; of two ways
    /// the first that is found.
    pub fn ratio(&self, body: usize) -> f64 {
        let mut units = vec![None; self.bodies.len()];
        units[self.seen] = Some(1.0);
        for _ in &self.bodies {
            for Joint { from, to, ratio, .. } in &self.joints {
                match (units[*from], units[*to]) {
                    (Some(known), None) => units[*to] = Some(known * ratio),
                    (None, Some(known)) => units[*from] = Some(known / ratio),
                    _ => {}
                }
            }
        }
        units[body].unwrap_or(0.0)
    }

    /// Returns the inertia, the viscous and the Coulomb friction that move with the body with the encoder, in its
    /// units, all joints taken as rigid.
    pub fn seen_rigidly(&self) -> [f64; 3] {
        self.bodies.iter().enumerate().fold([0.0; 3], |[inertia, viscous, coulomb], (index, body)| {
            let units = self.ratio(index);
            let square = units * units;
            [inertia + square * body.inertia, viscous + square * body.viscous, coulomb + units.abs() * body.coulomb]
        })
    }

    /// Returns the network with rigid joints removed.
    ///
    /// # Errors
    ///
    /// When rigid joints form a cycle, when a body is joined to nothing, and when there are too many states, frictions
    /// or stops.
    pub fn reduced(&self) -> Result<Reduced, NetworkError> {
        let groups = self.rigid()?;
        self.check_joined()?;
        let mut roots = vec![self.seen];
        roots.extend((0..self.bodies.len()).filter(|&body| groups[body].0 == body && body != groups[self.seen].0));
        let place = |body: usize| {
            let (root, units) = groups[body];
            (roots.iter().position(|&it| it == root).expect("a root"), units)
        };
        let mut bodies: Vec<Body> = roots
            .iter()
            .map(|&root| Body {
                position: self.bodies[root].position,
                speed: self.bodies[root].speed,
                ..Body::default()
            })
            .collect();
        for (index, body) in self.bodies.iter().enumerate() {
            let (at, units) = place(index);
            let square = units * units;
            let whole = &mut bodies[at];
            whole.inertia += square * body.inertia;
            whole.viscous += square * body.viscous;
            whole.spring += square * body.spring;
            whole.constant += units * body.constant;
            whole.coulomb += units.abs() * body.coulomb;
            whole.stiction += units.abs() * body.stiction.max(body.coulomb);
        }
        let mut links = Vec::new();
        for (index, joint) in self.joints.iter().enumerate() {
            let Some((stiffness, damping)) = joint.compliance else { continue };
            let ((a, units_a), (b, units_b)) = (place(joint.from), place(joint.to));
            if a == b {
                return refused(
                    Place::Joint(index),
                    "its bodies are joined rigidly already; leave one of the joints out",
                );
            }
            links.push(Link { ends: [a, b], ways: [joint.ratio * units_a, units_b], stiffness, damping });
        }
        let stops = self.stops.iter().map(|stop| {
            let (body, units) = place(stop.body);
            let ends = [stop.low / units, stop.high / units];
            Stop {
                body,
                low: ends[0].min(ends[1]),
                high: ends[0].max(ends[1]),
                stiffness: units * units * stop.stiffness,
                damping: units * units * stop.damping,
            }
        });
        let stops: Vec<Stop> = stops.collect();
        for (stop, own) in stops.iter().zip(&self.stops) {
            if !(stop.low..=stop.high).contains(&bodies[stop.body].position) {
                let reason = "starts inside its stop, where a body on a rigid joint puts it; start it between both";
                return refused(Place::Body(own.body), reason);
            }
        }
        let (driven, grip) = (place(self.driven), place(self.grip));
        let Self { feed, hand, .. } = *self;
        let effort_per_a = self.ratio(self.driven) * feed.torque_constant;
        let sensed = self.sensed.iter().map(|Sensed { body, lag_rad_per_s }| {
            let (body, units) = place(*body);
            (body, units, *lag_rad_per_s)
        });
        let sensed = sensed.collect();
        let reduced = Reduced { bodies, links, stops, feed, effort_per_a, driven, grip, hand, sensed };
        reduced.check_size()?;
        Ok(reduced)
    }

    fn check_joined(&self) -> Result<(), NetworkError> {
        let mut joined = vec![false; self.bodies.len()];
        joined[self.seen] = true;
        for _ in &self.bodies {
            for joint in &self.joints {
                let both = joined[joint.from] || joined[joint.to];
                (joined[joint.from], joined[joint.to]) = (both, both);
            }
        }
        match joined.iter().position(|joined| !joined) {
            Some(body) => refused(Place::Body(body), "nothing joins it to the body with the encoder; write a joint"),
            None => Ok(()),
        }
    }
}

impl Reduced {
    /// Returns the number of its states.
    pub fn size(&self) -> usize {
        self.moving() + self.sensed.iter().filter(|(_, _, lag)| lag.is_some()).count()
    }

    /// Returns the number of the states that move the device; those of the sensors' lags come after them.
    fn moving(&self) -> usize {
        2 + 2 * self.bodies.len() + usize::from(matches!(self.feed.kind, FeedKind::Pi { .. }))
    }

    /// Returns the index of the state that a further sensor reads, a position or the output of its lag, and units of
    /// the reading for one of the state.
    fn reading(&self, sensor: usize) -> (usize, f64) {
        let (body, units, lag) = self.sensed[sensor];
        let has_lag = |(_, _, lag): &&(usize, f64, Option<f64>)| lag.is_some();
        match lag {
            None => (laws::position_of(body), units),
            Some(_) => (self.moving() + self.sensed[..sensor].iter().filter(has_lag).count(), 1.0),
        }
    }

    /// Returns the frequency of each joint's own mode, between the two bodies alone, in Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        let of = |link: &Link| {
            let [a, b] = [0, 1].map(|end| link.ways[end] * link.ways[end] / self.bodies[link.ends[end]].inertia);
            (link.stiffness * (a + b)).sqrt() / (2.0 * std::f64::consts::PI)
        };
        self.links.iter().map(of).collect()
    }

    fn check_size(&self) -> Result<(), NetworkError> {
        let (states, bodies) = (self.size(), self.bodies.len());
        if states > MOST_STATES {
            let lags = match states - self.moving() {
                0 => String::new(),
                lags => format!(", lags of sensors {lags}"),
            };
            let reason = format!(
                "{states} states ({} of drive and hand, {bodies} bodies {}{lags}); accepted: {MOST_STATES}. Make a \
                 joint rigid: leave its stiffness out",
                self.moving() - 2 * bodies,
                2 * bodies
            );
            return refused(Place::Device, reason);
        }
        let frictions = self.bodies.iter().filter(|body| body.stiction > 0.0).count();
        if frictions > MOST_FRICTIONS {
            let reason = format!("{frictions} bodies with friction that sticks; accepted: {MOST_FRICTIONS}");
            return refused(Place::Device, reason);
        }
        if self.stops.len() > MOST_STOPS {
            let reason = format!("{} bodies with stops; accepted: {MOST_STOPS}", self.stops.len());
            return refused(Place::Device, reason);
        }
        Ok(())
    }
}
