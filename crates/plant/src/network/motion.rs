//! A network in motion: its state, its modes, and its energy exchanged so far.
//!
//! As of an axis, the state is kept at an anchor edge in double-double and flowed from there; the anchor moves only
//! when drive, intention or mode change.

use super::laws::{FAR, Key, Mode, NetworkLaws, Touch, position_of, speed_of};
use super::{MOST_FRICTIONS, MOST_STOPS};
use crate::device::{Drive, Event, REALS};
use crate::energy::Energy;
use crate::flow::double::{Double, Doubles, Product, versions};
use crate::flow::gauge::{Flow, Gauge, Measured, Pace, Whole};
use crate::flow::guard::{Band, Guard, Limits, MotionPoint, Side, Watch, dyadic};
use crate::flow::lanes::{Count, Size};
use crate::flow::leap::{Integrals, Quadrature};
use crate::flow::linear::Trajectory;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};
use crate::{Circuit, Gates, Hand};

/// The least number of edges that the next event is searched for.
const NEAR: u64 = 64;
/// A search goes this many times as far as the motion has gone from its anchor, up to [`FAR`] edges.
const AGAIN: u64 = 4;
/// The most edges that a search looks ahead at a time.
const FARTHEST: f64 = 65536.0;
/// The least number of edges for which the bounds of the errors are made.
const HEARD: u64 = 4096;
/// The least edges after which a motion may be anchored anew, and the factor by which errors hide it then.
const RENEWED: u64 = 8192;

/// The condition of a mode.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Cause {
    /// A body with friction keeps its direction, or sticks.
    Rub(usize),
    /// A body keeps to its side of a stop.
    Reach(usize),
    /// A stop keeps pressing, or not.
    Press(usize),
    /// The drive's voltage stays within the supply, or beyond it.
    Limit,
    /// The diodes' current keeps its sign, or the back-EMF stays within their range.
    Circuit,
}

/// A mode lasts while this function of the state stays in a band.
#[derive(Clone, Copy)]
pub(super) struct Check<'a, const N: usize> {
    pub guard: &'a Guard<N>,
    pub limits: Limits,
    pub cause: Cause,
}

/// The next event while the angle is in a band, as far as it is known; `until` 0 if nothing is.
#[derive(Clone, Copy)]
struct Ahead {
    until: u64,
    band: (f64, f64),
    event: Option<Event>,
}

/// A network in motion.
#[derive(Clone)]
pub struct NetworkDevice<'a, const N: usize> {
    pub(super) laws: &'a NetworkLaws<N>,
    pub(super) anchor: u64,
    pub(super) motion: Trajectory<'a, N>,
    pub(super) mode: &'a Mode<N>,
    pub(super) key: Key,
    pub(super) drive: Drive,
    pub(super) circuit: Circuit,
    pub(super) intent_per_s: f64,
    pub(super) checks: Vec<Check<'a, N>>,
    /// The constant part of what moves each body.
    pub(super) constants: Vec<Double>,
    pub(super) energy: Energy,
    initial_j: f64,
    pub(super) mode_changes: u64,
    /// Edges at which more modes ended than are followed each to its instant.
    pub(super) crowded: u64,
    redecided: u64,
    /// The edges after the anchor below which `noise` holds: bounds of the errors of the angle and of the checks.
    heard: u64,
    noise: Vec<f64>,
    /// The further encoders by the indices of their sensors, and the bands of their present counts.
    watched: Vec<(usize, Limits)>,
    ahead: Ahead,
    prefix: (u64, (State<N>, State<N>)),
    gauge: Option<Box<Gauge<2>>>,
}

/// Returns the first four states.
fn first<const N: usize>(x: &State<N>) -> State {
    [x[CURRENT], x[SPEED], x[ANGLE], x[INTENT]]
}

impl<'a, const N: usize> NetworkDevice<'a, N>
where
    Count<N>: Size<N>,
{
    /// Creates a device at edge 0 as its bodies start, with this current: with all gates off, or a reference of 0 A.
    pub fn new(laws: &'a NetworkLaws<N>, current_a: f64) -> Self {
        let mut x = [0.0; N];
        x[CURRENT] = current_a;
        for (b, body) in laws.net.bodies.iter().enumerate() {
            (x[speed_of(b)], x[position_of(b)]) = (body.speed, body.position);
        }
        x[INTENT] = laws.net.grip.1 * x[position_of(laws.net.grip.0)];
        for (sensor, &(body, units, lag)) in laws.net.sensed.iter().enumerate() {
            if lag.is_some() {
                x[laws.net.reading(sensor).0] = units * x[position_of(body)];
            }
        }
        let (drive, circuit) = match laws.bridge() {
            None => (Drive::Current(0.0), Circuit::Amplified),
            Some(bridge) => {
                let emf_v = laws.drive_constant() * x[speed_of(laws.net.driven.0)];
                (Drive::Gates(Gates::default()), bridge.circuit(Gates::default(), current_a, emf_v))
            }
        };
        let mut touches = [Touch::Out; MOST_STOPS];
        for (touch, stop) in touches.iter_mut().zip(&laws.net.stops) {
            let at = x[position_of(stop.body)];
            *touch = if at > stop.high {
                Touch::Pressed(1)
            } else if at < stop.low {
                Touch::Pressed(-1)
            } else {
                Touch::Out
            };
        }
        let key = Key { slips: [1; MOST_FRICTIONS], touches, limited: 0 };
        let mode = laws.mode(&key, None);
        let mut device = Self {
            laws,
            anchor: 0,
            motion: Trajectory::new(&mode.system, x, [0.0; N]),
            mode,
            key,
            drive,
            circuit,
            intent_per_s: 0.0,
            checks: Vec::new(),
            constants: Vec::new(),
            energy: Energy::default(),
            initial_j: 0.0,
            mode_changes: 0,
            crowded: 0,
            redecided: 0,
            heard: 0,
            noise: Vec::new(),
            watched: Vec::new(),
            ahead: Ahead { until: 0, band: (0.0, 0.0), event: None },
            prefix: (u64::MAX, ([0.0; N], [0.0; N])),
            gauge: None,
        };
        device.settle(&x.into());
        device.enter(0, x.into());
        device.initial_j = device.stored_at(&x);
        device.mode_changes = 0;
        device
    }

    /// Returns all states at an edge at or after the anchor: those of [`state`](Self::state), then speed and position
    /// of each other body, in the order of the network's bodies without those on rigid joints.
    pub fn states(&self, edge: u64) -> State<N> {
        self.motion.at(edge - self.anchor)
    }

    /// Returns current, speed and angle of the body with the encoder, and the hand's intention, at an edge at or after
    /// the anchor.
    pub fn state(&self, edge: u64) -> State {
        first(&self.states(edge))
    }

    versions! {
        /// Returns all states at an edge, computed in double-double and rounded once.
        fn exact[exact_fused, exact_native, exact_with](self: &Self, edge: u64) -> Doubles<N>
    }

    #[inline(always)]
    fn exact_with<P: Product>(&self, edge: u64) -> Doubles<N> {
        self.motion.flow::<P>(edge - self.anchor)
    }

    /// Returns the [`state`](Self::state) at an edge, computed in double-double and rounded once.
    pub fn exact_state(&self, edge: u64) -> State {
        first(&self.exact(edge).hi)
    }

    /// Returns all states at an edge in double-double: the nearest `f64` and the rest of each.
    pub fn exact_states(&self, edge: u64) -> (State<N>, State<N>) {
        let x = self.exact(edge);
        (x.hi, x.lo)
    }

    /// Returns the outputs of a state, as those of a [`Device`](crate::Device); the torque is the drive's, as it is at
    /// the body with the encoder if all joints are rigid.
    pub fn shown(&self, x: &State) -> [f64; REALS.len()] {
        [x[CURRENT], x[SPEED], x[ANGLE], self.laws.effort_per_a() * x[CURRENT]]
    }

    /// Returns the outputs named by [`REALS`] at an edge.
    pub fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        self.shown(&self.state(edge))
    }

    /// Returns the outputs at this edge and at all later ones, if nothing moves in the present mode.
    pub fn still(&self, edge: u64) -> Option<[f64; REALS.len()]> {
        (edge > self.anchor).then(|| self.motion.still())?.map(|x| self.shown(&first(&x)))
    }

    /// Returns the hand's position and its torque or force at an edge, in the units of the body that it holds.
    pub fn felt(&self, edge: u64) -> [f64; 2] {
        let x = self.exact(edge).hi;
        let (body, units) = self.laws.net.grip;
        let (position, speed) = (units * x[position_of(body)], units * x[speed_of(body)]);
        match self.laws.net.hand {
            Hand::Torque(torque) => [position, torque],
            Hand::Spring(push) => {
                let spring = push.stiffness_nm_per_rad * (x[INTENT] - position);
                [x[INTENT], spring + push.damping_nm_s_per_rad * (self.intent_per_s - speed)]
            }
            Hand::Prescribed => {
                let friction = self.laws.net.bodies[body].coulomb * if speed == 0.0 { 0.0 } else { speed.signum() };
                let force = self.mode.borne.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>() + self.constants[body].hi;
                [position, (friction * units.signum() - force) / units]
            }
        }
    }

    /// Gathers means of current and speed between rows from edge 0 on, and extremes where they are `read`.
    pub fn measure(&mut self, pace: Pace, read: [bool; 2]) {
        self.gauge = Some(Box::new(Gauge::new(pace, read)));
    }

    /// Returns the exact means and extremes of current and speed since the row before the row at this edge, at which
    /// the state is `x`; `None` unless [`measure`](Self::measure) asked for them.
    pub fn measured(&self, edge: u64, x: &State) -> Option<[Measured; 2]> {
        let gauge = self.gauge.as_deref()?;
        let gauge = self.gauge_at(gauge, edge);
        Some(gauge.row(edge, self.motion.system().edge_s(), &[x[CURRENT], x[SPEED]]))
    }

    fn gauge_at(&self, gauge: &Gauge<2>, edge: u64) -> Gauge<2> {
        if edge == self.anchor {
            return gauge.clone();
        }
        let guards = [&self.mode.current, &self.mode.speed];
        gauge.after(self.anchor, edge, Some(edge), &Flow { motion: &self.motion, guards, anchor: self.anchor })
    }

    fn pass(&mut self, edge: u64) {
        if let Some(gauge) = self.gauge.as_deref() {
            self.gauge = Some(Box::new(self.gauge_at(gauge, edge)));
        }
    }

    pub(super) fn is_measured(&self) -> bool {
        self.gauge.is_some()
    }

    pub(super) fn pass_course(&mut self, edge: u64, course: &Whole<2>) {
        if let Some(gauge) = &mut self.gauge {
            **gauge = gauge.after(edge - 1, edge, Some(edge), course);
        }
    }

    /// Returns how often a mode has changed.
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Returns how many edges had more ends of modes than are followed each to its instant.
    pub fn crowded_edges(&self) -> u64 {
        self.crowded
    }

    /// Returns the last edge to which the present motion can be computed.
    pub fn reach(&self) -> u64 {
        self.anchor.saturating_add(self.motion.system().longest() - FAR)
    }

    /// Returns how many decisions were made again in double-double because `f64` was not exact enough.
    pub fn redecided(&self) -> u64 {
        self.redecided
    }

    /// Returns the energy exchanged until `edge`.
    pub fn energy(&self, edge: u64) -> Energy {
        let mut then = self.clone();
        then.account(edge);
        then.energy
    }

    /// Returns the energy stored at `edge` minus that at the start.
    pub fn stored_j(&self, edge: u64) -> f64 {
        self.stored_at(&self.states(edge)) - self.initial_j
    }

    versions! {
        /// Returns the integrals from the anchor to an edge, and the state there.
        pub(super) fn passed[passed_fused, passed_native, passed_with](
            self: &Self, edge: u64
        ) -> (Integrals<State<N>>, Doubles<N>)
    }

    #[inline(always)]
    fn passed_with<P: Product>(&self, edge: u64) -> (Integrals<State<N>>, Doubles<N>) {
        let (done, x) = self.motion.integrals::<P>(edge - self.anchor);
        (Quadrature::in_memory::<P::Lanes>(&done), x)
    }

    /// Accounts for the energy until `edge` and returns the state there.
    pub(super) fn account(&mut self, edge: u64) -> Doubles<N> {
        let (done, x) = self.passed(edge);
        let length_s = (edge - self.anchor) as f64 * self.motion.system().edge_s();
        let from = self.motion.x;
        self.tally(length_s, &from, &x, &done);
        x
    }

    /// Sets the drive from `edge` on: gates or the mean voltage of a bridge, or the reference of a current.
    ///
    /// # Panics
    ///
    /// When the network's drive is of another kind.
    pub fn driven(&mut self, edge: u64, drive: Drive) {
        if self.drive == drive {
            return;
        }
        self.pass(edge);
        let mut x = self.account(edge);
        self.drive = drive;
        self.circuit = match (drive, self.laws.bridge()) {
            (Drive::Gates(gates), Some(bridge)) => bridge.circuit(gates, x.hi[CURRENT], self.mode.emf.value(&x.hi)),
            (Drive::Average(duty), Some(bridge)) => bridge.averaged(duty),
            (Drive::Current(reference_a), None) => {
                if self.laws.net.feed.kind.is_ideal() {
                    let before = x.hi;
                    x.set(CURRENT, reference_a.into());
                    self.jumped(&before, &x.hi);
                }
                Circuit::Amplified
            }
            _ => panic!("the network's drive is of another kind"),
        };
        self.let_go(&x);
        self.enter(edge, x);
    }

    /// Sets the hand's intended position and speed from `edge` on, in units of the body that it holds; a prescribing
    /// hand moves the body to them.
    pub fn intend(&mut self, edge: u64, position: f64, speed: f64) {
        self.pass(edge);
        let mut x = self.account(edge);
        x.set(INTENT, position.into());
        self.intent_per_s = speed;
        if self.laws.net.hand == Hand::Prescribed {
            let (body, units) = self.laws.net.grip;
            let before = x.hi;
            x.set(speed_of(body), (speed / units).into());
            x.set(position_of(body), (position / units).into());
            self.jumped(&before, &x.hi);
        }
        self.let_go(&x);
        self.enter(edge, x);
    }

    pub(super) fn switches(&self) -> Option<u8> {
        match self.circuit {
            // Without on-resistance every closed path has the same system.
            Circuit::Closed { switches, .. } => {
                Some(if self.laws.path_ohm(1) == self.laws.path_ohm(0) { 0 } else { switches })
            }
            _ => None,
        }
    }

    /// Anchors at `edge` in state `x`, in the mode of the present key and circuit.
    pub(super) fn enter(&mut self, edge: u64, x: Doubles<N>) {
        self.constants = self.laws.constants(&self.key, self.intent_per_s);
        let inputs = self.laws.inputs(&self.key, self.drive, self.circuit, self.intent_per_s);
        let mut f = Doubles::ZERO;
        (0..N).for_each(|k| f.set(k, inputs[k]));
        self.mode = self.laws.mode(&self.key, self.switches());
        self.anchor = edge;
        self.motion = Trajectory::exact(&self.mode.system, x, f);
        self.checks = self.checks_now();
        (self.heard, self.ahead.until, self.prefix.0) = (0, 0, u64::MAX);
    }

    fn checks_now(&self) -> Vec<Check<'a, N>> {
        let (laws, mode) = (self.laws, self.mode);
        let mut checks = Vec::new();
        for (r, &body) in laws.rubs.iter().enumerate() {
            let limits = match self.key.slips[r] {
                0 => self.hold(body),
                1 => Limits::POSITIVE,
                _ => Limits::NEGATIVE,
            };
            checks.push(Check { guard: &mode.rubs[r], limits, cause: Cause::Rub(r) });
        }
        for (s, stop) in laws.net.stops.iter().enumerate() {
            let [position, force] = &mode.stops[s];
            let at = |side: i8| if side < 0 { stop.low } else { stop.high };
            let force_at = |side: i8| Double::product(stop.stiffness, at(side));
            let (reach, press) = match self.key.touches[s] {
                Touch::Out => (Some(Limits { low: stop.low.into(), high: stop.high.into(), open: false }), None),
                Touch::Pressed(side) => (None, Some(beyond(side, force_at(side)))),
                Touch::Lifted(side) => (Some(beyond(side, at(side).into())), Some(beyond(-side, force_at(side)))),
            };
            checks.extend(reach.map(|limits| Check { guard: position, limits, cause: Cause::Reach(s) }));
            checks.extend(press.map(|limits| Check { guard: force, limits, cause: Cause::Press(s) }));
        }
        let supply = laws.net.feed.kind.supply_v();
        if supply.is_finite() {
            let reference_a = if let Drive::Current(reference_a) = self.drive { reference_a } else { 0.0 };
            let constant = laws.demand_constant(reference_a);
            let (low, high) = (-constant - supply.into(), Double::from(supply) - constant);
            let limits = match self.key.limited {
                0 => Limits { low, high, open: false },
                1 => beyond(1, high),
                _ => beyond(-1, low),
            };
            checks.push(Check { guard: &mode.demand, limits, cause: Cause::Limit });
        }
        let circuit = match self.circuit {
            Circuit::Closed { direction: 1, .. } => Some((&mode.current, Limits::POSITIVE)),
            Circuit::Closed { direction: -1, .. } => Some((&mode.current, Limits::NEGATIVE)),
            Circuit::Closed { .. } | Circuit::Amplified => None,
            Circuit::Open { emf_min_v, emf_max_v } => {
                Some((&mode.emf, Limits { low: emf_min_v.into(), high: emf_max_v.into(), open: false }))
            }
        };
        checks.extend(circuit.map(|(guard, limits)| Check { guard, limits, cause: Cause::Circuit }));
        checks
    }

    /// Returns the band of what moves a stuck body, its constant part apart.
    pub(super) fn hold(&self, body: usize) -> Limits {
        let (stiction, constant) = (Double::from(self.laws.net.bodies[body].stiction), self.constants[body]);
        Limits { low: -stiction - constant, high: stiction - constant, open: false }
    }

    /// Makes sure that the bounds of the errors hold this number of edges after the anchor.
    fn hear(&mut self, edges: u64) {
        if edges < self.heard {
            return;
        }
        let dyadic = dyadic(edges.max(HEARD)).min(self.motion.system().dyadic() - 1);
        self.heard = (1 << dyadic) + 1;
        let anywhere = Limits { low: Double::ZERO, high: Double::ZERO, open: true };
        self.noise.clear();
        self.noise.push(self.mode.angle.noise(&self.motion, dyadic, &anywhere));
        self.noise.extend(self.checks.iter().map(|check| check.guard.noise(&self.motion, dyadic, &check.limits)));
        let watched = self.watched.iter().map(|(sensor, _)| &self.mode.sensed[*sensor]);
        self.noise.extend(watched.map(|guard| guard.noise(&self.motion, dyadic, &anywhere)));
    }

    /// Makes [`next_event`](Self::next_event) tell too where the reading of a sensor leaves `[low, high)`, in the place
    /// of the band that it had.
    pub fn watch(&mut self, sensor: usize, (low, high): (f64, f64)) {
        let limits = Limits::from(&Band { low, high, open: true });
        match self.watched.iter_mut().find(|(watched, _)| *watched == sensor) {
            Some((_, known)) => *known = limits,
            None => {
                self.watched.push((sensor, limits));
                self.heard = 0;
            }
        }
        self.ahead.until = 0;
    }

    /// Returns the reading of a sensor at an edge.
    pub fn reading(&self, sensor: usize, edge: u64) -> f64 {
        self.mode.sensed[sensor].value(&self.states(edge))
    }

    /// Returns where the reading of a watched sensor, whose `f64` value at an edge this is, lies with respect to the
    /// band from `low`, inclusive, to `high`: -1 below, 0 inside, 1 above.
    pub fn side_of_reading(&mut self, sensor: usize, edge: u64, value: f64, (low, high): (f64, f64)) -> i8 {
        let edges = edge - self.anchor;
        self.hear(edges);
        let place = self.watched.iter().position(|(watched, _)| *watched == sensor).expect("a watched sensor");
        let limits = Limits::from(&Band { low, high, open: true });
        let noise = self.noise[1 + self.checks.len() + place];
        let mut watch = Watch { motion: &self.motion, limits, noise, again: &mut self.redecided };
        self.mode.sensed[sensor].side(&mut watch, edges, value).way()
    }

    /// Returns the greatest integer up to `scale` times the reading of a sensor at an edge, or times the current
    /// without a sensor: in double-double where the `f64` value is too near to an integer to tell.
    pub fn floor(&self, sensor: Option<usize>, edge: u64, scale: f64) -> i64 {
        let (index, units) = sensor.map_or((CURRENT, 1.0), |sensor| self.laws.net.reading(sensor));
        let guard = sensor.map_or(&self.mode.current, |sensor| &self.mode.sensed[sensor]);
        let scales = (scale, Double::product(units, scale));
        self.floor_of(edge, guard.value(&self.states(edge)), index, scales, self.blur(guard, edge, scale))
    }

    /// Returns the [`floor`](Self::floor)s of the current at the edges `first`, `first + stride` and so on.
    pub fn floors(&self, first: u64, stride: u64, scale: f64, count: usize, mut give: impl FnMut(i64)) {
        let last = first + stride * (count as u64).saturating_sub(1);
        let blur = self.blur(&self.mode.current, last, scale);
        let mut states = [[0.0; N]; 16];
        for from in (0..count).step_by(states.len()) {
            let states = &mut states[..(count - from).min(16)];
            let begin = first + stride * from as u64;
            self.motion.rows(begin - self.anchor, stride, states);
            for (x, edge) in states.iter().zip((begin..).step_by(stride as usize)) {
                give(self.floor_of(edge, x[CURRENT], CURRENT, (scale, scale.into()), blur));
            }
        }
    }

    /// Returns a bound of the error of `scale` times a function's `f64` value at every edge up to this one.
    fn blur(&self, guard: &Guard<N>, edge: u64, scale: f64) -> f64 {
        let dyadic = dyadic((edge - self.anchor).max(HEARD)).min(self.motion.system().dyadic() - 1);
        let anywhere = Limits { low: Double::ZERO, high: Double::ZERO, open: true };
        scale.abs() * guard.noise(&self.motion, dyadic, &anywhere)
    }

    /// Returns the greatest integer up to `scale` times a value, which is `units` of the state at an index.
    #[inline]
    fn floor_of(&self, edge: u64, value: f64, index: usize, (scale, units): (f64, Double), blur: f64) -> i64 {
        let value = scale * value;
        let (toward_0, blur) = (value as i64, blur + 4.0 * f64::EPSILON * value.abs());
        let whole = toward_0 - i64::from(toward_0 as f64 > value);
        let part = value - whole as f64;
        if part > blur && 1.0 - part > blur {
            return whole;
        }
        let Double { hi, lo } = self.exact(edge).lane(index) * units;
        let whole = hi.floor();
        whole as i64 - i64::from(whole == hi && lo < 0.0)
    }

    /// Returns whether an angle is within a band by more than the error of its `f64` value.
    pub fn is_surely_within(&mut self, edge: u64, angle_rad: f64, (low_rad, high_rad): (f64, f64)) -> bool {
        self.hear(edge - self.anchor);
        angle_rad - low_rad > self.noise[0] && high_rad - angle_rad > self.noise[0]
    }

    /// Returns where the angle lies with respect to the band from `low_rad`, inclusive, to `high_rad`, at an edge where
    /// its `f64` value is `angle_rad`: -1 below, 0 inside, 1 above.
    pub fn side_of_band(&mut self, edge: u64, angle_rad: f64, (low_rad, high_rad): (f64, f64)) -> i8 {
        let edges = edge - self.anchor;
        self.hear(edges);
        let limits = Limits::from(&Band { low: low_rad, high: high_rad, open: true });
        let mut watch = Watch { motion: &self.motion, limits, noise: self.noise[0], again: &mut self.redecided };
        self.mode.angle.side(&mut watch, edges, angle_rad).way()
    }

    /// Returns the first edge in (`from`, `to`] at which the motion is anchored anew.
    fn renewal(&self, from: u64, to: u64) -> Option<u64> {
        let next = |edges: &u64| edges.checked_mul(2);
        let first = (from - self.anchor).saturating_add(1).checked_next_power_of_two()?.max(RENEWED);
        let mut all = std::iter::successors(Some(first), next).take_while(|edges| *edges <= to - self.anchor);
        all.find(|edges| self.is_stale(*edges)).map(|edges| self.anchor + edges)
    }

    /// Returns whether the motion is anchored anew this number of edges after its anchor, a power of two: its bounds
    /// have become loose, or it has all but come to rest, so that errors of the motion before hide what is left of it.
    fn is_stale(&self, edges: u64) -> bool {
        let dyadic = dyadic(edges);
        let (_, now) = self.motion.at_with_slope(edges);
        let is_hidden = |guard: &Guard<N>| {
            let [before, after] = [&self.motion.w.hi, &now].map(|w| guard.blur(dyadic, w));
            after < before / RENEWED as f64
        };
        dyadic >= self.mode.loose || self.checks.iter().any(|check| is_hidden(check.guard))
    }

    /// Returns the first edge in (`from`, `to`] at which a mode ends or the angle leaves `[low_rad, high_rad)`, or a
    /// watched sensor its band, where none of it has happened at `from`; or, before it, the one at which the motion is
    /// anchored anew.
    #[must_use]
    pub fn next_event(&mut self, from: u64, to: u64, band: (f64, f64)) -> Option<Event> {
        let ahead = &self.ahead;
        let is_known = ahead.event.map_or(to <= ahead.until, |event| event.0 > from);
        if ahead.until == 0 || band != ahead.band || !is_known {
            // A short search costs as much as a longer one; whoever asks again and again, as a converter does, is
            // answered for longer and longer.
            let until = to.max(from + (AGAIN * (from - self.anchor)).clamp(NEAR, FAR));
            let renewal = self.renewal(from, until);
            let until = renewal.unwrap_or(until);
            let event = self.look_for(from, until, band);
            let event = event.or_else(|| renewal.map(|edge| (edge, first(&self.states(edge)))));
            self.ahead = Ahead { until, band, event };
        }
        self.ahead.event.filter(|event| event.0 <= to)
    }

    fn look_for(&mut self, from: u64, to: u64, band: (f64, f64)) -> Option<Event> {
        let (first_edge, last) = (from - self.anchor, to - self.anchor);
        let encoder = Limits::from(&Band { low: band.0, high: band.1, open: true });
        let most = 1u64 << (self.motion.system().dyadic() - 1).min(62);
        let mut a = MotionPoint::of(&self.motion, first_edge);
        while a.edge < last {
            let gap_s = (encoder.high.hi - encoder.low.hi) / a.x[SPEED].abs();
            // Searches a little farther than the next encoder edge is away at this speed.
            let way = (gap_s / self.motion.system().edge_s()).clamp(NEAR as f64, FARTHEST);
            let end = last.min(a.edge + (1.25 * way).min(most as f64) as u64);
            self.hear(end);
            let (motion, again) = (&self.motion, &mut self.redecided);
            let mut found: Option<MotionPoint<N>> = None;
            let mut b = None;
            let watched = self.checks.iter().map(|check| (check.guard, check.limits));
            let watched = watched.chain(self.watched.iter().map(|(of, limits)| (&self.mode.sensed[*of], *limits)));
            let watched = watched.chain([(&self.mode.angle, encoder)]);
            let noises = self.noise[1..].iter().chain([&self.noise[0]]);
            for ((guard, limits), &noise) in watched.zip(noises) {
                let edges = found.as_ref().map_or(end, |found| found.edge) - a.edge;
                if guard.stays(motion, &limits, noise, &a, edges) {
                    continue;
                }
                // Events of other functions after the one found do not matter.
                let to = found.unwrap_or_else(|| *b.get_or_insert_with(|| MotionPoint::of(motion, end)));
                let mut watch = Watch { motion, limits, noise, again: &mut *again };
                found = guard.seek(&mut watch, &a, &to).or(found);
            }
            if let Some(found) = found {
                return Some((self.anchor + found.edge, first(&found.x)));
            }
            a = b.unwrap_or_else(|| MotionPoint::of(&self.motion, end));
        }
        None
    }

    /// Returns a number that is the same at two edges of which the device [recurs](Self::recurs), and at few others.
    pub fn mark(&self, edge: u64) -> u64 {
        let Double { hi, lo } = self.motion.x.lane(ANGLE);
        (hi.to_bits() ^ lo.to_bits().rotate_left(32) ^ (edge - self.anchor)).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }

    /// Returns whether the device is at `edge`, in every bit that decides how it moves, as an earlier one was at the
    /// edge `then`.
    pub fn recurs(&self, edge: u64, earlier: &Self, then: u64) -> bool {
        let state = |device: &Self, edge: u64| {
            let bits = [device.motion.x, device.motion.f].map(|of| (of.hi.map(f64::to_bits), of.lo.map(f64::to_bits)));
            (bits, edge - device.anchor, device.intent_per_s.to_bits())
        };
        state(self, edge) == state(earlier, then)
            && (self.key, self.drive, self.circuit) == (earlier.key, earlier.drive, earlier.circuit)
    }

    /// Moves on by `times` repetitions of all that has happened between two states, in which `edges` pass altogether.
    pub fn repeat(&mut self, edges: u64, [then, now]: [&Self; 2], times: u64) {
        self.energy.repeat([&then.energy, &now.energy], times);
        self.mode_changes += times * (now.mode_changes - then.mode_changes);
        self.crowded += times * (now.crowded - then.crowded);
        self.redecided += times * (now.redecided - then.redecided);
        self.anchor += edges;
        self.ahead.until = 0;
    }

    /// Moves to the next edge after the last one asked, and changes the mode if it has ended.
    pub fn step(&mut self, edge: u64) -> State {
        let x = self.motion.at_next(edge - self.anchor, &mut self.prefix);
        self.move_to(edge, &x)
    }

    /// Moves to the edge of an event, and changes the mode if the event is the end of one.
    pub fn arrive(&mut self, (edge, _): Event) -> State {
        let x = self.states(edge);
        self.move_to(edge, &x)
    }

    fn move_to(&mut self, edge: u64, x: &State<N>) -> State {
        let edges = edge - self.anchor;
        self.hear(edges);
        let mut has_ended = false;
        for (check, &noise) in self.checks.iter().zip(&self.noise[1..]) {
            let again = &mut self.redecided;
            let mut watch = Watch { motion: &self.motion, limits: check.limits, noise, again };
            has_ended |= check.guard.side(&mut watch, edges, check.guard.value(x)) != Side::Inside;
        }
        if !has_ended {
            if !edges.is_power_of_two() || edges < RENEWED || !self.is_stale(edges) {
                return first(x);
            }
            self.pass(edge);
            let x = self.account(edge);
            self.enter(edge, x);
            return first(self.motion.anchor());
        }
        self.pass(edge - 1);
        self.change(edge);
        first(self.motion.anchor())
    }
}

/// Returns the values on one side of a limit.
fn beyond(side: i8, limit: Double) -> Limits {
    if side > 0 { Limits { low: limit, ..Limits::ANY } } else { Limits { high: limit, ..Limits::ANY } }
}
