//! The motor in motion: its anchor, the end of each segment, and its state at a clock edge.
//!
//! Between two changes (a switching, a zero of a phase current, a diode that opens, friction that holds or lets go) the
//! motion is a segment: Taylor series from an anchor, which need not lie on a clock edge. A segment ends at the instant
//! of the change, or where its series are good no longer. Its powers are written in stages, because most segments are
//! cut short by the next switching. Everything is a function of the segment and of the edge, so that it does not depend
//! on who asked before.

mod bodies;
mod course;
mod readings;
mod stops;

use std::borrow::Cow;

use super::circuit::{Affine, Change, Circuit, Freedom, PHASES, Path, Plane, dot, settled};
use super::energy::{Passed, charge};
use super::lag::Lag;
use super::room::Room;
use super::series::{ALPHA, ANGLE, BETA, Driven, FEWEST, Hold, SPEED, Series, Start};
use super::{Grip, Pmsm};
use crate::Leg;
use crate::device::{Drive, REALS};
use crate::energy::Energy;
use crate::flow::double::{Double, two_sum};
use crate::flow::gauge::{Gauge, Measured, Pace};
use crate::flow::lanes::Array;
use crate::flow::matrix::State;
use crate::flow::polynomial::{Bounds, Lanes, ORDER, Polynomial, Reach, keeps};
use crate::network::Touch;

/// The longest duration of a segment, unless all is at rest.
const LONGEST_S: f64 = 1.0;
/// The shortest duration of a segment that ends because its series do.
const SHORTEST_S: f64 = 1e-9;
/// The time by which the motion goes on where a condition comes too near to its limit to be decided.
const ONWARD_S: f64 = 1e-12;
/// The switchings in a period of three legs with dead time.
const PATTERN: usize = 12;
/// The most segments that begin within one edge; more would be a fault of rounding.
const MOST_WITHIN: u32 = 64;
/// The segments after which the room of the motion is made anew.
const ROOM_LASTS: u32 = 1024;

/// The reason for the end of a segment, and so for the begin of the next.
#[derive(Clone, Copy, PartialEq)]
enum End {
    /// The powers written so far are good no longer.
    Short,
    /// The whole series is, or the hand intends something else.
    Worn,
    /// A body comes to rest.
    Stop(usize),
    /// Friction does not hold a body any longer; it moves in this direction.
    Break(usize, f64),
    /// A pair of stops is touched otherwise.
    Touch(usize, Touch),
    /// The circuit changes by itself.
    Circuit(Change),
    /// Legs are switched.
    Legs,
}

/// A motor of three phases in motion.
#[derive(Clone)]
pub struct PmsmDevice<'a> {
    laws: &'a Pmsm,
    /// The anchor: the first edge at or after it, and the time from the anchor to that edge.
    anchor: u64,
    offset_s: f64,
    start: Start,
    drive: Drive,
    circuit: Cow<'a, Circuit>,
    /// The phase whose current is 0 at the anchor, because its diode begins to conduct there.
    begun: [bool; 3],
    hold: Hold,
    /// The pair of stops whose force is 0 at the anchor, because it begins or ceases there.
    freed: Option<usize>,
    /// The bands that readings of sensors are in, each with its sensor.
    watched: Vec<(usize, (f64, f64))>,
    /// The currents behind the lags of shunts.
    lags: Vec<Lag>,
    /// The hand's intention: an edge, the angle there, and the speed from there on.
    told: (u64, f64, f64),
    series: Series,
    room: Room,
    room_lasts: u32,
    /// The edge of the last switching, the edges between the last switchings, and the place of the oldest.
    switched: u64,
    lasted: [u64; PATTERN],
    turn: usize,
    /// End of the segment as a time after the anchor, its reason, and the first edge that the segment does not reach.
    end_s: f64,
    end: End,
    end_edge: u64,
    energy: Energy,
    /// Integrals of the current, with the rests dropped by rounding.
    charge: [Plane; 2],
    initial_j: f64,
    mode_changes: u64,
    circuit_changes: u64,
    segments: u64,
    /// Segments that began at the present anchor edge, and edges at which there were too many.
    within: u32,
    crowded: u64,
    gauge: Option<Box<Gauge<2>>>,
}

impl<'a> PmsmDevice<'a> {
    /// Creates a device at edge 0 with all legs open, with currents `i_d` and `i_q` in A, a speed in rad/s and an angle
    /// in rad; the hand intends that angle.
    pub fn new(laws: &'a Pmsm, [direct, across]: [f64; 2], speed_rad_per_s: f64, angle_rad: f64) -> Self {
        let e = laws.direction(angle_rad, 0.0);
        let i = [direct * e[0] - across * e[1], direct * e[1] + across * e[0]];
        let x = [i[0], i[1], speed_rad_per_s, angle_rad];
        let start = Start { x, low: [0.0; 4], e, twist_rad: 0.0, intent_rad_per_s: 0.0 };
        let mut device = Self {
            laws,
            anchor: 0,
            offset_s: 0.0,
            start,
            drive: Drive::Legs([Leg::Open; 3]),
            circuit: Cow::Owned(Circuit::averaged(laws, [0.0; 3])),
            begun: [false; 3],
            hold: Hold::Slip(0.0),
            freed: None,
            watched: Vec::new(),
            lags: Vec::new(),
            told: (0, angle_rad, 0.0),
            series: Series::new(laws),
            room: Room::NONE,
            room_lasts: 0,
            switched: 0,
            lasted: [0; PATTERN],
            turn: 0,
            end_s: 0.0,
            end: End::Worn,
            end_edge: 0,
            energy: Energy::default(),
            charge: [[0.0; 2]; 2],
            initial_j: 0.0,
            mode_changes: 0,
            circuit_changes: 0,
            segments: 0,
            within: 0,
            crowded: 0,
            gauge: None,
        };
        let grip = laws.grip;
        device.told.1 = grip.units * device.place(grip.body, 0.0)[0];
        device.initial_j = device.stored_at((&x, &[0.0; 4]), 0.0);
        device.begin(0, 0.0, (x, [0.0; 4]), End::Legs);
        device.mode_changes = 0;
        device
    }

    /// Returns the time from the anchor to an edge at or after it.
    #[inline(always)]
    fn time_s(&self, edge: u64) -> f64 {
        (edge - self.anchor) as f64 * self.laws.edge_s + self.offset_s
    }

    /// Returns the state a time after the anchor, with the parts that rounding takes from it: the anchor and the change
    /// since are added without error, and the change is small.
    #[inline(always)]
    fn sum(&self, t: f64) -> (Lanes, Lanes) {
        self.start.after::<Array>(&self.series.x[1..=self.series.powers], t)
    }

    /// Returns the angle of [`sum`](Self::sum) alone, with the part that rounding takes from it.
    #[inline(always)]
    fn angle(&self, t: f64) -> (f64, f64) {
        let (x, low) = (self.start.x[ANGLE], self.start.low[ANGLE]);
        let terms = self.series.x[1..=self.series.powers].iter().rev();
        let rate = terms.fold(0.0, |sum, term| sum * t + term[ANGLE]) + self.start.low[SPEED];
        two_sum(x, low + rate * t)
    }

    /// Returns the current a time after the anchor, in the stator's frame.
    #[inline(always)]
    fn current(&self, t: f64) -> Plane {
        let ([a, b, ..], _) = self.sum(t);
        [a, b]
    }

    /// Returns `i_d` and `i_q` for a current a time after the anchor.
    #[inline(always)]
    fn rotated(&self, t: f64, x: &Lanes) -> [f64; 2] {
        let (mut sine, mut cosine) = (0.0, 0.0);
        for term in self.series.turned[..=self.series.powers].iter().rev() {
            (sine, cosine) = (sine * t + term[0], cosine * t + term[1]);
        }
        [cosine * x[ALPHA] + sine * x[BETA], cosine * x[BETA] - sine * x[ALPHA]]
    }

    /// Calls a function with the device as it is when it has come to an edge, and the time from its anchor to the edge.
    #[inline(always)]
    fn on<T>(&self, edge: u64, read: impl FnOnce(&Self, f64) -> T) -> T {
        if edge < self.end_edge {
            return read(self, self.time_s(edge));
        }
        let mut then = self.clone();
        then.reach(edge);
        read(&then, then.time_s(edge))
    }

    /// Moves the anchor until the segment reaches beyond an edge.
    #[inline(always)]
    fn reach(&mut self, edge: u64) {
        while self.end_edge <= edge {
            self.follow();
        }
    }

    /// Returns `i_q` in A, the speed in rad/s, the angle and the hand's intention in rad, at an edge that has not been
    /// left yet.
    #[inline]
    pub fn state(&self, edge: u64) -> State {
        self.on(edge, |then, _| then.state_at(edge))
    }

    #[inline(always)]
    fn state_at(&self, edge: u64) -> State {
        let t = self.time_s(edge);
        let (x, _) = self.sum(t);
        let [_, across] = self.rotated(t, &x);
        [across, x[SPEED], x[ANGLE], self.intent_rad(edge)]
    }

    /// Returns the hand's intention at an edge.
    #[inline(always)]
    fn intent_rad(&self, edge: u64) -> f64 {
        let (told, angle_rad, speed_rad_per_s) = self.told;
        angle_rad + speed_rad_per_s * ((edge - told) as f64 * self.laws.edge_s)
    }

    /// Returns the [`state`](Self::state): it does not depend on who asked before.
    pub fn exact_state(&self, edge: u64) -> State {
        self.state(edge)
    }

    /// Returns the outputs of the state at an edge, in the order of [`REALS`](crate::REALS). The torque is that of the
    /// motor at that edge, which with `L_d != L_q` depends on `i_d` too.
    pub fn shown(&self, edge: u64, x: &State) -> [f64; REALS.len()] {
        let motor = &self.laws.motor;
        let salience = motor.direct_h - motor.quadrature_h;
        let active = motor.flux_vs + if salience == 0.0 { 0.0 } else { salience * self.dq(edge)[0] };
        [x[0], x[1], x[2], 1.5 * f64::from(motor.pole_pairs) * active * x[0]]
    }

    /// Returns the outputs named by [`REALS`](crate::REALS) at an edge.
    pub fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        self.shown(edge, &self.state(edge))
    }

    /// Returns the outputs at this edge and at all later ones, if nothing moves as the device is driven.
    pub fn still(&self, edge: u64) -> Option<[f64; REALS.len()]> {
        (self.end_edge == u64::MAX).then(|| self.reals(edge))
    }

    /// Returns the currents into the three phases at an edge, in A; they sum to 0, and that of a floating phase is 0.
    pub fn phases(&self, edge: u64) -> [f64; 3] {
        self.on(edge, |then, t| then.circuit.phases(then.current(t)))
    }

    /// Returns the charges that flowed into the three phases until an edge, in A·s.
    pub fn charges(&self, edge: u64) -> [f64; 3] {
        self.on(edge, |then, t| {
            let ([done, rest], passed) = (then.charge, charge(&then.series, t));
            PHASES.map(|u| dot(u, done) + dot(u, [rest[0] + passed[0], rest[1] + passed[1]]))
        })
    }

    /// Returns `i_d` and `i_q` at an edge, in A.
    pub fn dq(&self, edge: u64) -> [f64; 2] {
        self.on(edge, |then, t| then.rotated(t, &then.sum(t).0))
    }

    /// Returns the voltages of the three terminals against ground from an edge on, in V. If no phase carries a current
    /// and no switch is on, the star point is taken at half the supply.
    pub fn voltages(&self, edge: u64) -> [f64; 3] {
        self.on(edge, |then, t| {
            let terms = (0..then.series.powers).rev().map(|k| then.series.flux_rate(then.laws, k));
            let rate = terms.fold([0.0; 2], |sum, term| [sum[0] * t + term[0], sum[1] * t + term[1]]);
            then.circuit.terminals.map(|terminal| terminal.at(then.current(t), rate))
        })
    }

    /// Returns the current out of the supply from an edge on, in A; negative where it flows back.
    pub fn supply_current(&self, edge: u64) -> f64 {
        self.on(edge, |then, t| dot(then.circuit.rail, then.current(t)))
    }

    /// Returns whether friction holds the shaft.
    pub fn is_stuck(&self) -> bool {
        self.hold == Hold::Stuck
    }

    /// Returns the current of phase 0, 1 or 2 at an edge, in A.
    pub fn reading(&self, phase: usize, edge: u64) -> f64 {
        self.phases(edge)[phase]
    }

    /// Puts a first-order lag behind the current of phase 0, 1 or 2, whose shunt may be below the lower switch; its
    /// output is 0 so far. Returns its index.
    pub fn lag(&mut self, phase: usize, is_low_side: bool, corner_rad_per_s: f64) -> usize {
        self.lags.push(Lag { leg: phase, is_low_side, corner_rad_per_s, output_a: 0.0 });
        self.lags.len() - 1
    }

    /// Returns the output of a lag at an edge, in A.
    pub fn lagged(&self, lag: usize, edge: u64) -> f64 {
        self.on(edge, |then, t| then.lags[lag].at(&then.series, &then.circuit, then.drive, t))
    }

    /// Returns the greatest integer up to `scale` times the current of a phase at an edge, or times `i_q` without a
    /// phase.
    pub fn floor(&self, phase: Option<usize>, edge: u64, scale: f64) -> i64 {
        let current = phase.map_or_else(|| self.state(edge)[0], |phase| self.reading(phase, edge));
        (scale * current).floor() as i64
    }

    /// Gathers means of `i_q` and speed between rows from edge 0 on, and extremes where they are `read`.
    pub fn measure(&mut self, pace: Pace, read: [bool; 2]) {
        self.gauge = Some(Box::new(Gauge::new(pace, read)));
    }

    /// Returns means and extremes of `i_q` and speed since the row before the row at this edge, at which the state is
    /// `x`; `None` unless [`measure`](Self::measure) asked for them.
    pub fn measured(&self, edge: u64, x: &State) -> Option<[Measured; 2]> {
        self.gauge.as_ref()?;
        self.on(edge, |then, t| {
            let gauge = then.gauge.as_deref()?;
            let passed = (t > 0.0).then(|| gauge.after(then.anchor, edge, Some(edge), &then.course()));
            let now = passed.as_ref().unwrap_or(gauge);
            Some(now.row(edge, then.laws.edge_s, &[x[0], x[1]]))
        })
    }

    /// Tells the gauge the segment up to an edge, or up to its end.
    #[inline(always)]
    fn pass(&mut self, now: u64, to: Option<u64>) {
        if let Some(gauge) = &self.gauge
            && to.is_none_or(|edge| self.time_s(edge) > 0.0)
        {
            let passed = gauge.after(self.anchor, now, to, &self.course());
            self.gauge = Some(Box::new(passed));
        }
    }

    /// Sets the hand's intended position and its speed from `edge` on, in units of the body that it holds: rad and
    /// rad/s, or m and m/s. A prescribing hand moves the body to them.
    pub fn intend(&mut self, edge: u64, position: f64, speed: f64) {
        self.reach(edge);
        self.pass(edge, Some(edge));
        let mut x = self.account(self.time_s(edge));
        self.told = (edge, position, speed);
        let Grip { body, units, .. } = self.laws.grip;
        if self.laws.imposes(body) {
            let stored_j = |device: &Self, (x, low): &(Lanes, Lanes)| {
                let others = &device.series.around.bodies;
                let others: Vec<_> = others.iter().map(|body| (body.x, body.low)).collect();
                device.laws.stored_j(x, low, &others, &device.series.around)
            };
            let before = stored_j(self, &x);
            match body {
                0 => {
                    (x.0[ANGLE], x.0[SPEED]) = (position / units, speed / units);
                    (x.1[ANGLE], x.1[SPEED]) = (0.0, 0.0);
                }
                _ => {
                    let body = &mut self.series.around.bodies[body - 1];
                    (body.x, body.low) = ([speed / units, position / units], [0.0; 2]);
                }
            }
            // The hand does the work of the jump.
            let mut flows = [0.0; 6];
            flows[1] = stored_j(self, &x) - before;
            self.energy.take(flows);
        }
        self.begin(edge, 0.0, x, End::Worn);
    }

    /// Sets the legs of the inverter from `edge` on: [`Drive::Legs`] or [`Drive::Averages`]. Shares are limited to 0
    /// to 1.
    ///
    /// # Panics
    ///
    /// When the drive is of another kind.
    pub fn driven(&mut self, edge: u64, drive: Drive) {
        if self.drive == drive {
            return;
        }
        self.reach(edge);
        self.pass(edge, Some(edge));
        let x = self.account(self.time_s(edge));
        self.drive = drive;
        self.lasted[self.turn] = edge - self.switched;
        self.switched = edge;
        self.turn = (self.turn + 1) % PATTERN;
        self.begin(edge, 0.0, x, End::Legs);
    }

    /// Returns the first edge in (`from`, `to`] at which the angle leaves `[low_rad, high_rad)`, a mode ends, or the
    /// series that describe the motion end, where none of it has happened at `from`.
    #[must_use]
    #[inline]
    pub fn next_event(&mut self, from: u64, to: u64, (low, high): (f64, f64)) -> Option<u64> {
        self.reach(from);
        if self.end_edge == u64::MAX {
            return None;
        }
        let ended = self.end_edge <= to;
        // The last edge of this segment to be searched.
        let last = if ended { self.end_edge - 1 } else { to };
        let mut left = if last > from { self.leaves(from, last, (low, high)) } else { None };
        for (sensor, band) in &self.watched {
            let last = left.map_or(last, |edge| edge - 1);
            if last > from {
                left = self.reads_beyond(*sensor, from, last, *band).or(left);
            }
        }
        left.or(ended.then_some(self.end_edge))
    }

    /// Returns the first edge in (`from`, `last`] at which the angle is outside a band.
    #[inline]
    fn leaves(&self, from: u64, last: u64, band: (f64, f64)) -> Option<u64> {
        if self.hold == Hold::Stuck {
            return None;
        }
        let (low, high) = band;
        let t = self.time_s(last);
        let [.., speed, angle] = self.start.x;
        // Bounds of what the acceleration moves, and of the rounding of the angle's value and of its way.
        let bend = 0.5 * self.room.accelerations[0] * t * t;
        let noise = 4.0 * f64::EPSILON * (angle.abs() + speed.abs() * t + bend);
        let (back, ahead) = ((speed * t).min(0.0) - bend - noise, (speed * t).max(0.0) + bend + noise);
        if angle + back > low && angle + ahead < high {
            return None;
        }
        let terms = &self.series.x[..=self.series.powers];
        let bounds = Bounds::of(terms, t);
        let polynomial = Polynomial::bounded(terms, ANGLE, &bounds);
        let noise = noise + bounds.noise[ANGLE];
        let now = polynomial.at(self.time_s(from));
        let is_out = |edge| self.side(edge, band) != 0;
        polynomial.leaves(now, (low, high, noise), (from, last), self.laws.edge_s, |edge| self.time_s(edge), is_out)
    }

    /// Returns on which side of a band the angle, with its low part, lies at an edge of the segment.
    fn side(&self, edge: u64, (low, high): (f64, f64)) -> i8 {
        let (angle, part) = self.angle(self.time_s(edge));
        // An angle rounded downward is below a limit exactly if the angle before rounding is.
        let angle = if part < 0.0 { angle.next_down() } else { angle };
        if angle < low { -1 } else { i8::from(angle >= high) }
    }

    /// Moves to an edge at or after the last one, and returns the state there.
    #[inline]
    pub fn step(&mut self, edge: u64) -> State {
        self.reach(edge);
        self.state_at(edge)
    }

    /// Returns where the angle lies with respect to the band from `low_rad`, inclusive, to `high_rad`, at an edge where
    /// its `f64` value is `angle_rad`: -1 below, 0 inside, 1 above.
    pub fn side_of_band(&self, edge: u64, angle_rad: f64, (low_rad, high_rad): (f64, f64)) -> i8 {
        if self.is_surely_within(edge, angle_rad, (low_rad, high_rad)) {
            return 0;
        }
        self.on(edge, |then, _| then.side(edge, (low_rad, high_rad)))
    }

    /// Returns whether an angle lies within a band by more than the rounding of its `f64` value.
    pub fn is_surely_within(&self, _edge: u64, angle_rad: f64, (low_rad, high_rad): (f64, f64)) -> bool {
        angle_rad > low_rad && angle_rad < high_rad
    }

    /// Returns the energy exchanged until `edge`.
    pub fn energy(&self, edge: u64) -> Energy {
        self.on(edge, |then, t| {
            let mut energy = then.energy;
            then.pass_into(&mut energy, t);
            energy
        })
    }

    /// Adds the flows of the first `t` of the segment to an audit, and returns what passed.
    #[inline(always)]
    fn pass_into(&self, energy: &mut Energy, t: f64) -> Passed {
        let driven = Driven { laws: self.laws, circuit: &self.circuit, hold: self.hold };
        Passed::take(energy, &driven, &self.start, &self.series, t)
    }

    /// Accounts for the first `t` after the anchor and returns the state there.
    #[inline(always)]
    fn account(&mut self, t: f64) -> (Lanes, Lanes) {
        if t == 0.0 {
            return (self.start.x, self.start.low);
        }
        let driven = Driven { laws: self.laws, circuit: &self.circuit, hold: self.hold };
        let passed = Passed::take(&mut self.energy, &driven, &self.start, &self.series, t);
        let powers = self.series.powers;
        for body in &mut self.series.around.bodies {
            (body.x, body.low) = body.at(t, powers);
        }
        for lag in &mut self.lags {
            lag.output_a = lag.at(&self.series, &self.circuit, self.drive, t);
        }
        let [done, rest] = &mut self.charge;
        for axis in 0..2 {
            let (sum, error) = two_sum(done[axis], passed.states[axis]);
            (done[axis], rest[axis]) = (sum, rest[axis] + error);
        }
        passed.end
    }

    /// Returns the energy stored at `edge` minus that at the start, in J.
    pub fn stored_j(&self, edge: u64) -> f64 {
        self.on(edge, |then, t| {
            let (x, low) = then.sum(t);
            then.stored_at((&x, &low), t) - then.initial_j
        })
    }

    /// Returns how often friction or a diode has begun or ceased to hold.
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Returns how often a diode has begun or ceased to conduct while no leg was switched.
    pub fn circuit_changes(&self) -> u64 {
        self.circuit_changes
    }

    /// Returns the number of segments computed so far.
    pub fn segments(&self) -> u64 {
        self.segments
    }

    /// Returns how many edges had more changes than are followed each to its instant.
    pub fn crowded_edges(&self) -> u64 {
        self.crowded
    }

    /// Computes the segment after the present one.
    #[cold]
    fn follow(&mut self) {
        if self.end == End::Short {
            let (good_s, done) = (&self.room.good_s, self.series.powers);
            let powers = (done + 1..ORDER).find(|&n| good_s[n] >= 2.0 * self.end_s).unwrap_or(ORDER);
            self.write(done, powers);
            return self.look_ahead(self.end_s);
        }
        self.pass(self.end_edge, None);
        let (mut x, mut low) = self.account(self.end_s);
        match self.end {
            End::Stop(0) => (x[SPEED], low[SPEED]) = (0.0, 0.0),
            End::Stop(body) => {
                let body = &mut self.series.around.bodies[body - 1];
                (body.x[0], body.low[0]) = (0.0, 0.0);
            }
            End::Touch(stop, touch) => self.touch(stop, touch, (&mut x, &mut low)),
            _ => {}
        }
        let offset_s = (self.time_s(self.end_edge) - self.end_s).max(0.0);
        self.begin(self.end_edge, offset_s, (x, low), self.end);
    }

    /// Sets the anchor at a state, `offset_s` before `edge`.
    fn begin(&mut self, edge: u64, offset_s: f64, (x, low): (Lanes, Lanes), cause: End) {
        self.within = if edge == self.anchor { self.within + 1 } else { 0 };
        self.segments += 1;
        (self.anchor, self.offset_s) = (edge, offset_s);
        let (told, angle_rad, speed_rad_per_s) = self.told;
        let intent = angle_rad + speed_rad_per_s * (real(edge - told) * self.laws.edge_s - offset_s);
        self.start = Start {
            x,
            low,
            e: self.laws.direction(x[ANGLE], low[ANGLE]),
            twist_rad: (intent - x[ANGLE]) - low[ANGLE],
            intent_rad_per_s: speed_rad_per_s,
        };
        let Grip { body, units, .. } = self.laws.grip;
        if self.laws.is_around || units != 1.0 {
            let [high, rest] = self.series.around.position(&self.start, body);
            let held = Double::product(units, high) + (units * rest).into();
            self.start.twist_rad = (Double::from(intent) - held).hi;
        }
        self.begun = [false; 3];
        match cause {
            End::Legs => self.connect(None),
            End::Circuit(change) => {
                self.mode_changes += 1;
                self.circuit_changes += 1;
                self.connect(Some(change));
            }
            _ => {}
        }
        let before = self.hold;
        self.hold = self.hold_at(0, self.start.x[SPEED], cause);
        let mut further = Vec::new();
        if self.laws.is_around {
            further = self.look_around(cause);
        }
        let [a, b, speed, _] = self.start.x;
        let stretch = if self.laws.is_sprung { [self.start.twist_rad.abs(), speed_rad_per_s.abs()] } else { [0.0; 2] };
        let bounds = [a.abs() + b.abs(), speed.abs(), stretch[0], stretch[1]];
        // The times between switchings are much as a period before.
        let (expected, passed) = (1.1 * real(self.lasted[self.turn]), real(edge - self.switched));
        let expected_s = (expected - passed).max(0.25 * expected.max(passed)) * self.laws.edge_s;
        let around = &self.series.around;
        let is_around = self.laws.is_around;
        let takes = self.room.takes(bounds) && (!is_around || self.room.takes_around(around, &further));
        if self.room_lasts == 0 || !takes {
            self.room = Room::made(self.laws, around, bounds, &further, expected_s);
            self.room_lasts = ROOM_LASTS;
        }
        self.room_lasts -= 1;
        let good_s = &self.room.good_s;
        let powers = (FEWEST..ORDER).find(|&n| good_s[n] >= expected_s).unwrap_or(ORDER);
        self.write(0, powers);
        let torque = self.series.torque[0];
        let mut slips = self.hold == Hold::Stuck && torque.abs() > self.laws.net.bodies[0].stiction;
        if slips {
            self.hold = Hold::Slip(torque.signum());
        }
        for (body, of) in self.series.around.bodies.iter_mut().zip(&self.laws.net.bodies[1..]) {
            if body.hold == Hold::Stuck && body.force[0].abs() > of.stiction {
                (body.hold, slips) = (Hold::Slip(body.force[0].signum()), true);
            }
            self.mode_changes += u64::from(body.before != body.hold);
        }
        if slips {
            self.write(0, powers);
        }
        self.mode_changes += u64::from(before != self.hold);
        self.look_ahead(0.0);
    }

    /// Writes the series from one power to another.
    #[inline(always)]
    fn write(&mut self, done: usize, powers: usize) {
        self.series.powers = done;
        let driven = Driven { laws: self.laws, circuit: &self.circuit, hold: self.hold };
        Series::write(&mut self.series, &driven, &self.start, powers);
    }

    /// Finds the circuit that holds from the anchor on.
    fn connect(&mut self, change: Option<Change>) {
        let mut resting = self.circuit.paths.map(|path| path == Path::Floating);
        if let Some(Change::Zero(x)) = change {
            resting[x] = true;
        }
        if self.start.current() == [0.0; 2] {
            resting = [true; 3];
        }
        let freedom = Freedom::of(resting);
        if freedom == Freedom::None {
            resting = [true; 3];
        }
        for of in [&mut self.start.x, &mut self.start.low] {
            [of[ALPHA], of[BETA]] = freedom.part([of[ALPHA], of[BETA]]);
        }
        match self.drive {
            Drive::Legs(legs) => {
                let rotor = (self.start.e, self.start.turning(self.laws));
                let circuit = settled(self.laws, legs, (self.start.current(), resting), rotor, change);
                self.circuit = Cow::Borrowed(circuit);
            }
            Drive::Averages(shares) => {
                let shares = shares.map(|share| share.clamp(0.0, 1.0));
                self.circuit = Cow::Owned(Circuit::averaged(self.laws, shares));
            }
            _ => panic!("an inverter is driven by its legs"),
        }
        self.begun = resting;
    }

    /// Returns whether nothing moves on the segment, nor the torque that friction holds.
    fn is_still(&self) -> bool {
        let Series { x, torque, powers, .. } = &self.series;
        let is_still =
            x[1..=*powers].iter().all(|x| *x == [0.0; 4]) && torque[1..*powers].iter().all(|torque| *torque == 0.0);
        let stays = |body: &super::around::Further| {
            let terms = body.terms[1..=*powers].iter().all(|term| *term == [0.0; 2]);
            terms && body.force[1..*powers].iter().all(|force| *force == 0.0)
        };
        is_still && self.series.around.bodies.iter().all(stays)
    }

    /// Finds the end of the segment, which lasts until `from` at least.
    fn look_ahead(&mut self, from: f64) {
        let powers = self.series.powers;
        if self.is_still() || self.series.x[1][ANGLE].is_nan() {
            // At rest, or beyond all numbers: the state does not change any more.
            self.end_edge = u64::MAX;
            return;
        }
        self.end_s = self.room.good_s[powers].clamp(SHORTEST_S, LONGEST_S).max(from);
        self.end = if powers < ORDER { End::Short } else { End::Worn };
        if self.within > MOST_WITHIN {
            self.crowded += 1;
            (self.end_s, self.end) = (self.offset_s + self.laws.edge_s, End::Worn);
        } else {
            self.watch_friction(0, from);
            if self.laws.is_around {
                self.watch_around(from);
            }
            if let Cow::Borrowed(circuit) = self.circuit {
                for (check, change) in &circuit.checks {
                    self.watch_circuit(check, *change, from);
                }
            }
        }
        let (edge_s, offset_s) = (self.laws.edge_s, self.offset_s);
        let mut edges = (((self.end_s - offset_s) / edge_s) as i64 - 1).max(0);
        while edges as f64 * edge_s + offset_s < self.end_s {
            edges += 1;
        }
        self.end_edge = self.anchor + edges.unsigned_abs();
    }

    /// Ends the segment where a condition of the circuit ceases to hold.
    fn watch_circuit(&mut self, check: &Affine, change: Change, from: f64) {
        let Series { x, powers, .. } = &self.series;
        let current = |k: usize| dot(check.current, [x[k][ALPHA], x[k][BETA]]);
        let reach = match change {
            // From 0, the first term only gives the direction of the start; rounding must not turn it.
            Change::Zero(phase) if self.begun[phase] => {
                let term = |k: usize| if k == 0 { current(1).max(0.0) } else { current(k + 1) };
                keeps(term, *powers, self.end_s, from)
            }
            Change::Zero(_) => keeps(current, powers + 1, self.end_s, from),
            _ => {
                let rate = |k: usize| current(k) + dot(check.flux_rate, self.series.flux_rate(self.laws, k));
                let term = |k: usize| if k == 0 { rate(0) + check.constant } else { rate(k) };
                keeps(term, *powers, self.end_s, from)
            }
        };
        self.shorten(reach, End::Circuit(change));
    }

    /// Ends the segment where a condition ceases to hold, if that comes first.
    #[inline(always)]
    fn shorten(&mut self, reach: Reach, end: End) {
        match reach {
            Reach::At(t) if t < self.end_s => (self.end_s, self.end) = (t, end),
            Reach::Until(t) if t < self.end_s => (self.end_s, self.end) = (t.max(ONWARD_S), End::Worn),
            _ => {}
        }
    }
}

/// Returns a number of edges. Processors convert signed numbers faster, and no run has 2^63 edges.
#[inline(always)]
fn real(edges: u64) -> f64 {
    edges.cast_signed() as f64
}
