//! The laws of a network: the linear system of each of its modes.

use std::array::from_fn;
use std::sync::OnceLock;

use super::{Body, Feed, FeedKind, Link, MOST_FRICTIONS, MOST_STOPS, Reduced, Stop};
use crate::flow::double::Double;
use crate::flow::guard::Guard;
use crate::flow::lanes::{Count, Size};
use crate::flow::leap::Square;
use crate::flow::linear::Linear;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};
use crate::{Bridge, Circuit, Drive, Hand};

/// The most edges that a search for the next event looks beyond the edge that it is asked for.
pub(super) const FAR: u64 = 16384;

/// A bound of how a state follows from itself that is larger than this is loose: of a body that swings it is about 1.
const LOOSE: f64 = 4.0;
/// A functional of the state, in double-double.
pub(super) type Row<const N: usize> = [Double; N];

/// Lanes of the audit's squares: of the current, of all that is viscous, of the speed of the grip, and the product of
/// current and the drive's speed.
pub(super) const COPPER: usize = 0;
pub(super) const VISCOUS: usize = 1;
pub(super) const GRIP: usize = 2;
pub(super) const EMF: usize = 3;

/// Where a pair of stops is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Touch {
    #[default]
    Out,
    /// The body is beyond a stop (-1 the low one, 1 the high one) that pushes it back.
    Pressed(i8),
    /// The body is beyond a stop and leaves it faster than the stop follows.
    Lifted(i8),
}

/// Stuck bodies and stops, beside the circuit: each set of signs has the system of its mode.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Key {
    /// For each body with friction the direction in which it slips, or 0 if it sticks.
    pub slips: [i8; MOST_FRICTIONS],
    pub touches: [Touch; MOST_STOPS],
    /// The sign of the supply's limit, or 0 within it.
    pub limited: i8,
}

impl Key {
    fn sticks(&self, friction: usize) -> bool {
        self.slips[friction] == 0
    }

    pub(super) fn presses(&self, stop: usize) -> bool {
        matches!(self.touches[stop], Touch::Pressed(_))
    }
}

/// A linear system, with the functions of its state that are watched.
pub(super) struct Mode<const N: usize> {
    pub system: Linear<N>,
    pub current: Guard<N>,
    pub speed: Guard<N>,
    pub angle: Guard<N>,
    /// Of each body with friction its speed, or what moves it while it sticks.
    pub rubs: Vec<Guard<N>>,
    /// Of each pair of stops the body's position, and the force of a stop but for its constant part.
    pub stops: Vec<[Guard<N>; 2]>,
    /// The voltage that the drive asks for, and the back-EMF.
    pub demand: Guard<N>,
    pub emf: Guard<N>,
    /// The force on the body at the grip, but for its constant part.
    pub borne: State<N>,
    /// The readings of the further sensors, in units of their bodies.
    pub sensed: Vec<Guard<N>>,
    /// The exponent of the length of two over which the bounds of a motion are far larger than the motion itself, as
    /// those of one that swings on and on become with time.
    pub loose: usize,
}

/// The immutable laws of a network on a clock, with `N` states in use or spare; each mode is tabulated when it is first
/// entered.
pub struct NetworkLaws<const N: usize> {
    pub(super) net: Reduced,
    /// The bodies with friction that can stick.
    pub(super) rubs: Vec<usize>,
    edge_s: f64,
    horizon: u64,
    modes: Vec<OnceLock<Box<Mode<N>>>>,
}

/// Returns the index of a body's speed; its position comes after it.
pub(super) fn speed_of(body: usize) -> usize {
    if body == 0 { SPEED } else { 2 + 2 * body }
}

pub(super) fn position_of(body: usize) -> usize {
    speed_of(body) + 1
}

fn rounded<const N: usize>(row: &Row<N>) -> State<N> {
    from_fn(|k| row[k].hi)
}

fn add<const N: usize>(row: &mut Row<N>, index: usize, value: Double) {
    row[index] = row[index] + value;
}

impl<const N: usize> NetworkLaws<N>
where
    Count<N>: Size<N>,
{
    /// Creates the laws on a clock of period `edge_s`, tabulated for leaps of up to `horizon` edges.
    ///
    /// # Panics
    ///
    /// If the network has more than `N` states.
    pub fn new(net: Reduced, edge_s: f64, horizon: u64) -> Self {
        assert!(net.size() <= N && N.is_multiple_of(4), "{} states do not fit {N}", net.size());
        let held = net.hand == Hand::Prescribed;
        let rubs = (0..net.bodies.len()).filter(|&b| net.bodies[b].stiction > 0.0 && !(held && net.grip.0 == b));
        let rubs = rubs.collect();
        Self { net, rubs, edge_s, horizon, modes: (0..256).map(|_| OnceLock::new()).collect() }
    }

    /// Returns the torque or force of one ampere at the body with the encoder, all joints taken as rigid.
    pub fn effort_per_a(&self) -> f64 {
        self.net.effort_per_a
    }

    pub(super) fn bridge(&self) -> Option<&Bridge> {
        match &self.net.feed.kind {
            FeedKind::Bridge(bridge) => Some(bridge),
            _ => None,
        }
    }

    /// Returns the torque of the drive on its reduced body for one ampere, which is its back-EMF for one unit of speed.
    pub(super) fn drive_constant(&self) -> f64 {
        self.net.driven.1 * self.net.feed.torque_constant
    }

    /// Returns the index of the integral of a drive that has one.
    pub(super) fn integral(&self) -> usize {
        2 + 2 * self.net.bodies.len()
    }

    /// Returns the resistance of the path of the current.
    pub(super) fn path_ohm(&self, switches: u8) -> f64 {
        let on_ohm = self.bridge().map_or(0.0, |bridge| bridge.on_resistance_ohm);
        self.net.feed.resistance_ohm + f64::from(switches) * on_ohm
    }

    /// Returns the mode of a key; `switches` is `None` if no voltage of a bridge drives the current.
    pub(super) fn mode(&self, key: &Key, switches: Option<u8>) -> &Mode<N> {
        let sticks = (0..self.rubs.len()).filter(|&r| key.sticks(r)).fold(0, |bits, r| bits | 1 << r);
        let presses = (0..self.net.stops.len()).filter(|&s| key.presses(s)).fold(0, |bits, s| bits | 8 << s);
        let index = sticks | presses | usize::from(key.limited != 0) << 5 | switches.map_or(3, usize::from) << 6;
        self.modes[index].get_or_init(|| Box::new(self.make(key, switches)))
    }

    /// Returns for each body what moves it, friction and constant parts apart, as a functional of the state.
    pub(super) fn forces(&self, key: &Key) -> Vec<Row<N>> {
        let Reduced { bodies, links, stops, driven, grip, hand, .. } = &self.net;
        let mut rows = vec![[Double::ZERO; N]; bodies.len()];
        for (b, Body { viscous, spring, .. }) in bodies.iter().enumerate() {
            add(&mut rows[b], speed_of(b), (-viscous).into());
            add(&mut rows[b], position_of(b), (-spring).into());
        }
        for Link { ends, ways, stiffness, damping } in links {
            for (to, sign) in [(0, -1.0), (1, 1.0)] {
                for (from, of) in [(0, sign), (1, -sign)] {
                    let ways = Double::product(ways[to], of * ways[from]);
                    let row = &mut rows[ends[to]];
                    add(row, position_of(ends[from]), ways * (*stiffness).into());
                    add(row, speed_of(ends[from]), ways * (*damping).into());
                }
            }
        }
        for (index, Stop { body, stiffness, damping, .. }) in stops.iter().enumerate() {
            if key.presses(index) {
                add(&mut rows[*body], position_of(*body), (-stiffness).into());
                add(&mut rows[*body], speed_of(*body), (-damping).into());
            }
        }
        add(&mut rows[driven.0], CURRENT, Double::product(driven.1, self.net.feed.torque_constant));
        if let Hand::Spring(push) = hand {
            let (body, units) = *grip;
            let (square, stiffness) = (Double::product(units, units), push.stiffness_nm_per_rad);
            add(&mut rows[body], INTENT, Double::product(units, stiffness));
            add(&mut rows[body], position_of(body), -(square * stiffness.into()));
            add(&mut rows[body], speed_of(body), -(square * push.damping_nm_s_per_rad.into()));
        }
        rows
    }

    /// Returns the constant part of what moves each body, friction apart.
    pub(super) fn constants(&self, key: &Key, intent_per_s: f64) -> Vec<Double> {
        let mut constants: Vec<Double> = self.net.bodies.iter().map(|body| body.constant.into()).collect();
        for (index, stop) in self.net.stops.iter().enumerate() {
            if let Touch::Pressed(side) = key.touches[index] {
                let end = if side < 0 { stop.low } else { stop.high };
                constants[stop.body] = constants[stop.body] + Double::product(stop.stiffness, end);
            }
        }
        let (body, units) = self.net.grip;
        let hand = match self.net.hand {
            Hand::Torque(torque) => Double::product(units, torque),
            Hand::Spring(push) => Double::product(units, push.damping_nm_s_per_rad) * intent_per_s.into(),
            Hand::Prescribed => Double::ZERO,
        };
        constants[body] = constants[body] + hand;
        constants
    }

    /// Returns the functional of the voltage that the drive asks for.
    fn demand(&self) -> Row<N> {
        let Feed { resistance_ohm, inductance_h, kind, .. } = self.net.feed;
        let emf = Double::product(self.net.driven.1, self.net.feed.torque_constant);
        let mut row = [Double::ZERO; N];
        match kind {
            FeedKind::Bridge(_) => {}
            FeedKind::Current { bandwidth_rad_per_s, .. } if bandwidth_rad_per_s.is_finite() => {
                row[CURRENT] = Double::from(resistance_ohm) - Double::product(inductance_h, bandwidth_rad_per_s);
                row[speed_of(self.net.driven.0)] = emf;
            }
            FeedKind::Current { .. } => {}
            FeedKind::Pi { proportional_ohm, integral_ohm_per_s, feeds_forward, .. } => {
                row[CURRENT] = (-proportional_ohm).into();
                row[self.integral()] = integral_ohm_per_s.into();
                if feeds_forward {
                    row[speed_of(self.net.driven.0)] = emf;
                }
            }
        }
        row
    }

    /// Returns the constant part of that voltage, for this reference of the current.
    pub(super) fn demand_constant(&self, reference_a: f64) -> Double {
        match self.net.feed.kind {
            FeedKind::Current { bandwidth_rad_per_s, .. } if bandwidth_rad_per_s.is_finite() => {
                Double::product(self.net.feed.inductance_h, bandwidth_rad_per_s) * reference_a.into()
            }
            FeedKind::Pi { proportional_ohm, .. } => Double::product(proportional_ohm, reference_a),
            _ => Double::ZERO,
        }
    }

    /// Writes the rows of the drive's states.
    fn feed_rows(&self, rows: &mut [Row<N>; N], key: &Key, switches: Option<u8>) {
        let Feed { resistance_ohm, inductance_h, kind, .. } = self.net.feed;
        let emf = Double::product(self.net.driven.1, self.net.feed.torque_constant);
        let inductance = Double::from(inductance_h);
        let speed = speed_of(self.net.driven.0);
        // A voltage that is given drives a winding.
        let mut winding = [Double::ZERO; N];
        let on_ohm = self.bridge().map_or(0.0, |bridge| bridge.on_resistance_ohm);
        let path_ohm = Double::product(f64::from(switches.unwrap_or(0)), on_ohm) + resistance_ohm.into();
        if inductance_h != 0.0 {
            (winding[CURRENT], winding[speed]) = ((-path_ohm).over(inductance), (-emf).over(inductance));
        }
        match kind {
            FeedKind::Bridge(_) if switches.is_none() => {}
            FeedKind::Bridge(_) => rows[CURRENT] = winding,
            FeedKind::Current { .. } if key.limited != 0 => rows[CURRENT] = winding,
            FeedKind::Current { bandwidth_rad_per_s, .. } => {
                if bandwidth_rad_per_s.is_finite() {
                    rows[CURRENT][CURRENT] = (-bandwidth_rad_per_s).into();
                }
            }
            FeedKind::Pi { proportional_ohm, integral_ohm_per_s, feeds_forward, .. } => {
                let integral = self.integral();
                rows[CURRENT] = winding;
                if key.limited == 0 {
                    let demand = self.demand();
                    rows[CURRENT] = from_fn(|k| winding[k] + demand[k].over(inductance));
                    rows[integral][CURRENT] = (-1.0).into();
                } else {
                    let proportional = Double::from(proportional_ohm);
                    rows[integral][integral] = -Double::from(integral_ohm_per_s).over(proportional);
                    if feeds_forward {
                        rows[integral][speed] = -emf.over(proportional);
                    }
                }
            }
        }
    }

    /// Returns the constant input of each state.
    pub(super) fn inputs(&self, key: &Key, drive: Drive, circuit: Circuit, intent_per_s: f64) -> Row<N> {
        let mut f = [Double::ZERO; N];
        let constants = self.constants(key, intent_per_s);
        for (b, body) in self.net.bodies.iter().enumerate() {
            let friction =
                self.rubs.iter().position(|&it| it == b).map_or(0.0, |r| f64::from(key.slips[r]) * body.coulomb);
            if !self.is_held(key, b) {
                f[speed_of(b)] = (constants[b] - friction.into()).over(body.inertia.into());
            }
        }
        f[INTENT] = intent_per_s.into();
        let reference_a = if let Drive::Current(reference_a) = drive { reference_a } else { 0.0 };
        let limit_v = f64::from(key.limited) * self.net.feed.kind.supply_v();
        let inductance = Double::from(self.net.feed.inductance_h);
        match self.net.feed.kind {
            FeedKind::Bridge(bridge) => {
                if let Circuit::Closed { .. } = circuit {
                    f[CURRENT] = Double::from(bridge.voltage_v(circuit)).over(inductance);
                }
            }
            FeedKind::Current { .. } if key.limited != 0 => f[CURRENT] = Double::from(limit_v).over(inductance),
            FeedKind::Current { bandwidth_rad_per_s, .. } if bandwidth_rad_per_s.is_finite() => {
                f[CURRENT] = Double::product(bandwidth_rad_per_s, reference_a);
            }
            FeedKind::Current { .. } => {}
            FeedKind::Pi { proportional_ohm, .. } => {
                let (volts, error) = if key.limited == 0 {
                    (self.demand_constant(reference_a), reference_a.into())
                } else {
                    (limit_v.into(), Double::from(limit_v).over(proportional_ohm.into()))
                };
                (f[CURRENT], f[self.integral()]) = (volts.over(inductance), error);
            }
        }
        f
    }

    /// Returns whether a body's speed is fixed: by friction, or by a hand that prescribes it.
    pub(super) fn is_held(&self, key: &Key, body: usize) -> bool {
        self.net.hand == Hand::Prescribed && self.net.grip.0 == body
            || self.rubs.iter().position(|&it| it == body).is_some_and(|r| key.sticks(r))
    }

    /// Returns the matrix of a mode, whose functionals of what moves each body are these.
    pub(super) fn rows(&self, key: &Key, switches: Option<u8>, forces: &[Row<N>]) -> [Row<N>; N] {
        let mut rows = [[Double::ZERO; N]; N];
        self.feed_rows(&mut rows, key, switches);
        for (b, body) in self.net.bodies.iter().enumerate() {
            let is_stuck = self.rubs.iter().position(|&it| it == b).is_some_and(|r| key.sticks(r));
            if !self.is_held(key, b) {
                rows[speed_of(b)] = forces[b].map(|force| force.over(body.inertia.into()));
            }
            if !is_stuck {
                rows[position_of(b)][speed_of(b)] = 1.0.into();
            }
        }
        for (sensor, &(body, units, lag)) in self.net.sensed.iter().enumerate() {
            if let Some(corner) = lag {
                let (index, _) = self.net.reading(sensor);
                rows[index][index] = (-corner).into();
                rows[index][position_of(body)] = Double::product(units, corner);
            }
        }
        rows
    }

    fn make(&self, key: &Key, switches: Option<u8>) -> Mode<N> {
        let forces = self.forces(key);
        let rows = self.rows(key, switches, &forces);
        let system = Linear::exact(&rows, self.squares(key), self.edge_s, self.horizon + FAR);
        let guard = |row: &Row<N>| Guard::new(rounded(row), &system);
        let unit = |index: usize, value: f64| from_fn(|k| if k == index { value.into() } else { Double::ZERO });
        let pick = |index: usize| guard(&unit(index, 1.0));
        let rub = |(r, &b): (usize, &usize)| if key.sticks(r) { guard(&forces[b]) } else { pick(speed_of(b)) };
        let stop = |stop: &Stop| {
            let mut force = unit(position_of(stop.body), stop.stiffness);
            force[speed_of(stop.body)] = stop.damping.into();
            [pick(position_of(stop.body)), guard(&force)]
        };
        let (current, speed, angle) = (pick(CURRENT), pick(SPEED), pick(ANGLE));
        let rubs = self.rubs.iter().enumerate().map(rub).collect();
        let stops = self.net.stops.iter().map(stop).collect();
        let (demand, emf) = (guard(&self.demand()), guard(&unit(speed_of(self.net.driven.0), self.drive_constant())));
        let borne = rounded(&forces[self.net.grip.0]);
        let reading = |sensor: usize| {
            let (index, units) = self.net.reading(sensor);
            guard(&unit(index, units))
        };
        let sensed = (0..self.net.sensed.len()).map(reading).collect();
        let is_loose = |dyadic: &usize| (0..N).any(|k| system.bound(*dyadic)[k][k] > LOOSE);
        let loose = (0..system.dyadic()).find(is_loose).unwrap_or(usize::MAX);
        Mode { borne, system, current, speed, angle, rubs, stops, demand, emf, sensed, loose }
    }

    /// Returns the factor of a current that makes it about as large as a speed divided by it; `None` if the audit needs
    /// no product of both.
    fn scale(&self) -> Option<f64> {
        let Feed { torque_constant, inductance_h, kind, .. } = self.net.feed;
        let inertia = self.net.bodies[self.net.driven.0].inertia;
        match kind {
            FeedKind::Bridge(_) => None,
            _ if kind.is_ideal() => None,
            FeedKind::Current { bandwidth_rad_per_s, .. } if inductance_h == 0.0 => {
                Some((torque_constant / (inertia * bandwidth_rad_per_s)).sqrt())
            }
            _ => Some((inductance_h / inertia).sqrt().sqrt()),
        }
    }

    /// Returns the squares whose integrals the audit of a mode needs.
    fn squares(&self, key: &Key) -> Vec<Square<N>> {
        let Reduced { bodies, links, stops, grip, driven, .. } = &self.net;
        let sum = |terms: &[(usize, f64)]| {
            let mut row = [0.0; N];
            terms.iter().for_each(|(index, value)| row[*index] += value);
            row
        };
        let mut squares = vec![
            Square { lane: COPPER, weight: 1.0, row: sum(&[(CURRENT, 1.0)]) },
            Square { lane: GRIP, weight: grip.1 * grip.1, row: sum(&[(speed_of(grip.0), 1.0)]) },
        ];
        let mut viscous = |weight: f64, row: State<N>| {
            if weight != 0.0 {
                squares.push(Square { lane: VISCOUS, weight, row });
            }
        };
        for (b, body) in bodies.iter().enumerate() {
            viscous(body.viscous, sum(&[(speed_of(b), 1.0)]));
        }
        for Link { ends: [a, b], ways, damping, .. } in links {
            viscous(*damping, sum(&[(speed_of(*a), ways[0]), (speed_of(*b), -ways[1])]));
        }
        for (_, stop) in stops.iter().enumerate().filter(|(index, _)| key.presses(*index)) {
            viscous(stop.damping, sum(&[(speed_of(stop.body), 1.0)]));
        }
        if let Some(scale) = self.scale() {
            // The product of two is a quarter of the square of their sum less that of their difference.
            for sign in [1.0, -1.0] {
                let row = sum(&[(CURRENT, scale), (speed_of(driven.0), sign / scale)]);
                squares.push(Square { lane: EMF, weight: 0.25 * sign, row });
            }
        }
        squares
    }
}
