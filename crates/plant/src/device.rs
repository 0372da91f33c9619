//! An axis in motion: its state, its modes, and the energy it has exchanged.
//!
//! The state is kept at an *anchor* edge and flowed from there, never stepped. The anchor moves only when what drives the
//! motion changes: the gates, the hand's intention, or a mode (slip and stuck, diode and open circuit).

use hpu_signal::Real;

use crate::axis::{Hand, Mode, Shaft};
use crate::energy::{Energy, Powers, stored_j};
use crate::guard::{Band, Guard, Point};
use crate::linear::{ANGLE, CURRENT, Course, INTENT, Integrals, SPEED, State, Trajectory};
use crate::{Axis, Bridge, Circuit, Gates};

/// The continuous outputs, in the order of [`Device::reals`].
pub const REALS: [Real; 4] = [
    Real { name: "current_a", doc: "Motor current" },
    Real { name: "speed_rad_per_s", doc: "Speed of the motor's shaft" },
    Real { name: "angle_rad", doc: "Angle of the motor's shaft" },
    Real { name: "torque_nm", doc: "Torque of the motor on its shaft" },
];

/// What a mode depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cause {
    /// Slip: the speed keeps its sign. Stuck: the torque stays within friction.
    Shaft,
    /// The diodes' current keeps its sign, or the back-EMF stays within their range.
    Circuit,
}

/// A mode lasts while a function of the state stays in a band.
#[derive(Clone, Copy)]
struct Check<'a> {
    guard: &'a Guard,
    band: Band,
    cause: Cause,
}

impl Check<'_> {
    #[inline(always)]
    fn passed(&self, x: &State) -> bool {
        self.band.left_by(self.guard.value(x))
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Drive {
    Gates(Gates),
    Average(f64),
}

/// An axis in motion.
#[derive(Clone)]
pub struct Device<'a> {
    axis: &'a Axis,
    anchor: u64,
    motion: Trajectory<'a>,
    mode: &'a Mode,
    shaft: Shaft,
    drive: Drive,
    circuit: Circuit,
    intent_rad_per_s: f64,
    checks: [Option<Check<'a>>; 2],
    powers: Powers,
    energy: Energy,
    initial_j: f64,
    mode_changes: u64,
    prefix: (u64, (State, State)),
}

/// The edge of an event, and the state that the motion brings there.
pub type Event = (u64, State);

impl<'a> Device<'a> {
    /// A device at rest in its circuit (all gates off) at edge 0, with initial current, speed and angle.
    #[must_use]
    pub fn new(axis: &'a Axis, current_a: f64, speed_rad_per_s: f64, angle_rad: f64) -> Self {
        let x = [current_a, speed_rad_per_s, angle_rad, angle_rad];
        let drive = Drive::Gates(Gates::default());
        let emf_v = axis.motor.torque_constant_nm_per_a * speed_rad_per_s;
        let circuit = axis.bridge.circuit(Gates::default(), current_a, emf_v);
        let mode = axis.mode(Shaft::Slip(0), None);
        let motor = &axis.motor;
        let mut device = Self {
            axis,
            anchor: 0,
            motion: Trajectory::new(&mode.system, x, [0.0; 4]),
            mode,
            shaft: Shaft::Slip(0),
            drive,
            circuit,
            intent_rad_per_s: 0.0,
            checks: [None; 2],
            powers: Powers::default(),
            energy: Energy::default(),
            initial_j: stored_j(motor.inductance_h, motor.inertia_kg_m2, &x),
            mode_changes: 0,
            prefix: (u64::MAX, (x, x)),
        };
        device.shaft = device.shaft_at(&x);
        device.enter(0, x);
        device
    }

    /// The state at an edge at or after the anchor.
    #[inline]
    #[must_use]
    pub fn state(&self, edge: u64) -> State {
        self.motion.at(edge - self.anchor)
    }

    /// The same for edges asked in rising order, one by one: remembers what neighbours share.
    #[inline(always)]
    pub fn state_next(&mut self, edge: u64) -> State {
        self.motion.at_next(edge - self.anchor, &mut self.prefix)
    }

    /// The outputs named by [`REALS`] at an edge.
    #[must_use]
    pub fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        let x = self.state(edge);
        [x[CURRENT], x[SPEED], x[ANGLE], self.axis.motor.torque_constant_nm_per_a * x[CURRENT]]
    }

    /// How often a mode has changed.
    #[must_use]
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Whether friction holds the shaft.
    #[must_use]
    pub fn is_stuck(&self) -> bool {
        self.shaft == Shaft::Stuck
    }

    /// The energy exchanged until `edge`.
    #[must_use]
    pub fn energy(&self, edge: u64) -> Energy {
        self.tallied(edge).0
    }

    /// Energy stored at `edge` over that at the start.
    #[must_use]
    pub fn stored_j(&self, edge: u64) -> f64 {
        let motor = &self.axis.motor;
        stored_j(motor.inductance_h, motor.inertia_kg_m2, &self.state(edge)) - self.initial_j
    }

    /// Sets the gates from `edge` on.
    pub fn drive(&mut self, edge: u64, gates: Gates) {
        if self.drive != Drive::Gates(gates) {
            self.set(edge, Drive::Gates(gates));
        }
    }

    /// Drives with the average voltage of a duty between -1 and 1 from `edge` on.
    pub fn drive_average(&mut self, edge: u64, duty: f64) {
        if self.drive != Drive::Average(duty) {
            self.set(edge, Drive::Average(duty));
        }
    }

    fn set(&mut self, edge: u64, drive: Drive) {
        let x = self.account(edge);
        self.drive = drive;
        self.circuit = match drive {
            Drive::Average(duty) => Bridge::averaged(duty),
            Drive::Gates(gates) => {
                self.axis.bridge.circuit(gates, x[CURRENT], self.axis.motor.torque_constant_nm_per_a * x[SPEED])
            }
        };
        self.enter(edge, x);
    }

    /// From `edge` on the hand means to be at `angle_rad` and to move at `speed_rad_per_s`; a prescribing hand is.
    pub fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        let mut x = self.account(edge);
        x[INTENT] = angle_rad;
        self.intent_rad_per_s = speed_rad_per_s;
        if self.axis.hand == Hand::Prescribed {
            self.energy.jerk(self.axis.motor.inertia_kg_m2, x[SPEED], speed_rad_per_s);
            x[SPEED] = speed_rad_per_s;
            x[ANGLE] = angle_rad;
        }
        self.enter(edge, x);
    }

    /// The first edge in (`from`, `to`] at which a mode ends or the angle leaves `[low_rad, high_rad)`, where neither has
    /// happened at `from`.
    #[must_use]
    pub fn next_event(&self, from: u64, to: u64, (low_rad, high_rad): (f64, f64)) -> Option<Event> {
        let last = to - self.anchor;
        let mut a = Point::of(&self.motion, from - self.anchor);
        let encoder = Band { low: low_rad, high: high_rad, open: true };
        while a.edge < last {
            // Look about as far as the next encoder edge is at this speed.
            let gap_s = (high_rad - low_rad) / a.x[SPEED].abs();
            let guess = (gap_s / self.motion.system().edge_s()).clamp(64.0, 65536.0) as u64;
            let b = Point::of(&self.motion, last.min(a.edge + guess));
            let mut end = b;
            let mut found = None;
            let angle = (self.shaft != Shaft::Stuck).then_some((&self.mode.angle, &encoder));
            let checks = self.checks.iter().flatten().map(|check| (check.guard, &check.band));
            for (guard, band) in checks.chain(angle) {
                if let Some(edge) = guard.first(&self.motion, band, &a, &end) {
                    found = Some(edge);
                    // Others matter only before this one.
                    end = Point::of(&self.motion, edge);
                }
            }
            if let Some(edge) = found {
                return Some((self.anchor + edge, end.x));
            }
            a = b;
        }
        None
    }

    /// Comes to the next edge after the last one asked: changes the mode if it has ended.
    #[inline(always)]
    pub fn step(&mut self, edge: u64) -> State {
        let x = self.state_next(edge);
        self.arrive((edge, x))
    }

    /// Comes to the edge of an event: changes the mode if it is one that has ended.
    #[inline(always)]
    pub fn arrive(&mut self, (edge, x): Event) -> State {
        if self.checks.iter().flatten().any(|check| check.passed(&x)) {
            self.change(edge, x);
            return *self.motion.anchor();
        }
        x
    }

    /// A mode ended between `edge - 1` and `edge`: finds the instant, changes there, and anchors at `edge`.
    #[cold]
    fn change(&mut self, edge: u64, at_edge: State) {
        let x = self.account(edge - 1);
        let edge_s = self.motion.system().edge_s();
        let course = Course::new(Trajectory::new(self.motion.system(), x, *self.motion.constant()));
        let mut first = (edge_s, None);
        for check in self.checks.into_iter().flatten().filter(|check| check.passed(&at_edge)) {
            let above = check.guard.value(&at_edge) > check.band.low;
            let limit = if above { check.band.high } else { check.band.low };
            let (before, after) = (check.guard.value(&x) - limit, check.guard.value(&at_edge) - limit);
            let tau_s = if before == 0.0 || before.signum() == after.signum() {
                // Already there at the start, or only just there at the end.
                if before.abs() <= after.abs() { 0.0 } else { edge_s }
            } else {
                course.crossing_s(check.guard.row(), limit, before, edge_s * before / (before - after))
            };
            if first.1.is_none() || tau_s < first.0 {
                first = (tau_s, Some((check.cause, above)));
            }
        }
        let (tau_s, ended) = first;
        let (cause, above) = ended.expect("a mode ended");
        let mut there = course.at(tau_s);
        self.tally(tau_s, &x, &there, &course.integrals(tau_s, &there));
        self.turn(cause, above, &mut there);
        self.enter(edge - 1, there);
        // The rest of the edge in the new mode, then whatever else is due by then.
        let rest_s = edge_s - tau_s;
        let course = Course::new(self.motion);
        let mut x = course.at(rest_s);
        self.tally(rest_s, &there, &x, &course.integrals(rest_s, &x));
        self.enter(edge, x);
        for _ in 0..self.checks.len() {
            let Some(check) = self.checks.into_iter().flatten().find(|check| check.passed(&x)) else { break };
            self.turn(check.cause, check.guard.value(&x) > check.band.low, &mut x);
            self.enter(edge, x);
        }
    }

    /// The new mode after one ended, at the state where it did, above or below its band.
    fn turn(&mut self, cause: Cause, above: bool, x: &mut State) {
        self.mode_changes += 1;
        match (cause, self.shaft, self.circuit) {
            (Cause::Shaft, Shaft::Stuck, _) => self.shaft = Shaft::Slip(if above { 1 } else { -1 }),
            (Cause::Shaft, ..) => {
                x[SPEED] = 0.0;
                self.shaft = self.shaft_at(x);
            }
            (Cause::Circuit, _, Circuit::Closed { .. }) => {
                x[CURRENT] = 0.0;
                self.reroute(x, self.axis.motor.torque_constant_nm_per_a * x[SPEED]);
            }
            (Cause::Circuit, _, Circuit::Open { .. }) => {
                self.reroute(x, if above { f64::INFINITY } else { f64::NEG_INFINITY });
            }
        }
    }

    fn reroute(&mut self, x: &State, emf_v: f64) {
        if let Drive::Gates(gates) = self.drive {
            self.circuit = self.axis.bridge.circuit(gates, x[CURRENT], emf_v);
        }
    }

    /// Torque on the shaft except friction, while it stands still.
    fn net_nm(&self, x: &State) -> f64 {
        let torque_nm = self.axis.motor.torque_constant_nm_per_a * x[CURRENT] + self.torque_nm();
        match self.axis.hand {
            Hand::Spring(push) => torque_nm + push.stiffness_nm_per_rad * (x[INTENT] - x[ANGLE]),
            _ => torque_nm,
        }
    }

    /// The constant part of the hand's torque on a shaft that stands still.
    fn torque_nm(&self) -> f64 {
        match self.axis.hand {
            Hand::Torque(torque_nm) => torque_nm,
            Hand::Spring(push) => push.damping_nm_s_per_rad * self.intent_rad_per_s,
            Hand::Prescribed => 0.0,
        }
    }

    fn shaft_at(&self, x: &State) -> Shaft {
        let friction_nm = self.axis.motor.coulomb_nm;
        if self.axis.hand == Hand::Prescribed {
            Shaft::Prescribed
        } else if friction_nm == 0.0 {
            Shaft::Slip(0)
        } else if x[SPEED] != 0.0 {
            Shaft::Slip(if x[SPEED] > 0.0 { 1 } else { -1 })
        } else {
            match self.net_nm(x) {
                net if net > friction_nm => Shaft::Slip(1),
                net if net < -friction_nm => Shaft::Slip(-1),
                _ => Shaft::Stuck,
            }
        }
    }

    /// The energy exchanged until `edge`, and the state there.
    fn tallied(&self, edge: u64) -> (Energy, State) {
        let mut energy = self.energy;
        let edges = edge - self.anchor;
        let (done, x) = self.motion.integrals(edges);
        let length_s = edges as f64 * self.motion.system().edge_s();
        energy.add(&self.powers, length_s, self.motion.anchor(), &x, &done);
        (energy, x)
    }

    /// Accounts for the energy until `edge` and returns the state there.
    fn account(&mut self, edge: u64) -> State {
        let (energy, x) = self.tallied(edge);
        self.energy = energy;
        x
    }

    fn tally(&mut self, length_s: f64, before: &State, after: &State, done: &Integrals) {
        self.energy.add(&self.powers, length_s, before, after, done);
    }

    /// Anchors at `edge` in state `x`, in the mode that shaft, circuit and hand now make.
    fn enter(&mut self, edge: u64, x: State) {
        let axis = self.axis;
        let motor = &axis.motor;
        let voltage_v = axis.bridge.voltage_v(self.circuit);
        let switches = match self.circuit {
            Circuit::Closed { switches, .. } => Some(switches),
            Circuit::Open { .. } => None,
        };
        self.mode = axis.mode(self.shaft, switches);
        let mut f = [0.0; 4];
        if switches.is_some() {
            f[CURRENT] = voltage_v / motor.inductance_h;
        }
        if let Shaft::Slip(sign) = self.shaft {
            f[SPEED] = (self.torque_nm() - f64::from(sign) * motor.coulomb_nm) / motor.inertia_kg_m2;
        }
        f[INTENT] = self.intent_rad_per_s;
        self.anchor = edge;
        self.motion = Trajectory::new(&self.mode.system, x, f);
        self.prefix.0 = u64::MAX;
        self.powers = self.powers_now(&x);
        self.checks = self.checks_now();
    }

    fn powers_now(&self, x: &State) -> Powers {
        let (axis, motor) = (self.axis, &self.axis.motor);
        let mut powers = Powers {
            viscous_nm_s_per_rad: motor.viscous_nm_s_per_rad,
            intent_rad_per_s: self.intent_rad_per_s,
            ..Powers::default()
        };
        if let Circuit::Closed { supply_share, diodes, switches, .. } = self.circuit {
            powers.source_v = axis.bridge.supply_v * supply_share;
            powers.diode_v = f64::from(diodes) * axis.bridge.diode_drop_v;
            powers.resistance_ohm = axis.path_ohm(switches);
        }
        if self.shaft != Shaft::Stuck {
            powers.coulomb_nm = motor.coulomb_nm;
        }
        match axis.hand {
            Hand::Torque(torque_nm) => powers.torque_nm = torque_nm,
            Hand::Spring(push) => {
                powers.hand_nm_per_rad = push.stiffness_nm_per_rad;
                powers.hand_nm_s_per_rad = push.damping_nm_s_per_rad;
            }
            Hand::Prescribed => {
                powers.borne_nm_per_a = motor.torque_constant_nm_per_a;
                if x[SPEED] == 0.0 {
                    powers.coulomb_nm = 0.0;
                }
            }
        }
        powers
    }

    fn checks_now(&self) -> [Option<Check<'a>>; 2] {
        let mode = self.mode;
        let motor = &self.axis.motor;
        let band = |low, high| Band { low, high, open: false };
        let positive = band(0.0, f64::INFINITY);
        let negative = band(f64::NEG_INFINITY, 0.0);
        let shaft = match self.shaft {
            Shaft::Slip(1) => Some((&mode.speed, positive)),
            Shaft::Slip(-1) => Some((&mode.speed, negative)),
            Shaft::Stuck => {
                let constant_nm = self.torque_nm();
                Some((&mode.net, band(-motor.coulomb_nm - constant_nm, motor.coulomb_nm - constant_nm)))
            }
            _ => None,
        };
        let circuit = match self.circuit {
            Circuit::Closed { direction: 1, .. } => Some((&mode.current, positive)),
            Circuit::Closed { direction: -1, .. } => Some((&mode.current, negative)),
            Circuit::Closed { .. } => None,
            Circuit::Open { emf_min_v, emf_max_v } => {
                let k = motor.torque_constant_nm_per_a;
                Some((&mode.speed, band(emf_min_v / k, emf_max_v / k)))
            }
        };
        [
            shaft.map(|(guard, band)| Check { guard, band, cause: Cause::Shaft }),
            circuit.map(|(guard, band)| Check { guard, band, cause: Cause::Circuit }),
        ]
    }
}
