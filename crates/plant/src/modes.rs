//! How a device's modes begin and end: slip and stuck, diodes and open circuits.

use crate::Circuit;
use crate::axis::{Hand, Shaft};
use crate::course::Course;
use crate::device::{Device, Drive};
use crate::energy::Powers;
use crate::guard::{Band, Guard};
use crate::linear::Trajectory;
use crate::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};

/// What a mode depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// Slip: the speed keeps its sign. Stuck: the torque stays within friction.
    Shaft,
    /// The diodes' current keeps its sign, or the back-EMF stays within their range.
    Circuit,
}

/// A mode lasts while a function of the state stays in a band.
#[derive(Clone, Copy)]
pub(crate) struct Check<'a> {
    pub(crate) guard: &'a Guard,
    pub(crate) band: Band,
    cause: Cause,
}

impl Check<'_> {
    #[inline(always)]
    pub(crate) fn passed(&self, x: &State) -> bool {
        self.band.left_by(self.guard.value(x))
    }
}

impl<'a> Device<'a> {
    /// A mode ended between `edge - 1` and `edge`: finds the instant, changes there, and anchors at `edge`.
    #[cold]
    pub(crate) fn change(&mut self, edge: u64, at_edge: State) {
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
            (Cause::Shaft, Shaft::Creep, _) => {
                self.shaft = Shaft::Slip(if above { 1 } else { -1 });
                x[SPEED] = if above { self.axis.creep_rad_per_s } else { -self.axis.creep_rad_per_s };
            }
            (Cause::Shaft, Shaft::Slip(sign), _) if self.axis.creep_rad_per_s != 0.0 => {
                self.shaft = Shaft::Creep;
                x[SPEED] = f64::from(sign) * self.axis.creep_rad_per_s;
            }
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
            (Cause::Circuit, _, Circuit::Amplified) => unreachable!("an imposed current has no modes"),
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

    pub(crate) fn shaft_at(&self, x: &State) -> Shaft {
        let friction_nm = self.axis.motor.coulomb_nm;
        if self.axis.hand == Hand::Prescribed {
            Shaft::Prescribed
        } else if friction_nm == 0.0 {
            Shaft::Slip(0)
        } else if x[SPEED].abs() <= self.axis.creep_rad_per_s && self.axis.creep_rad_per_s != 0.0 {
            Shaft::Creep
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

    /// Anchors at `edge` in state `x`, in the mode that shaft, circuit and hand now make.
    pub(crate) fn enter(&mut self, edge: u64, mut x: State) {
        let axis = self.axis;
        let motor = &axis.motor;
        let voltage_v = axis.bridge.voltage_v(self.circuit);
        let switches = match self.circuit {
            Circuit::Closed { switches, .. } => Some(switches),
            Circuit::Open { .. } | Circuit::Amplified => None,
        };
        self.mode = axis.mode(self.shaft, switches);
        let mut f = [0.0; 4];
        match self.shaft {
            Shaft::Slip(sign) => {
                f[SPEED] = (self.torque_nm() - f64::from(sign) * motor.coulomb_nm) / motor.inertia_kg_m2;
            }
            Shaft::Creep => f[SPEED] = self.torque_nm() / motor.inertia_kg_m2,
            Shaft::Stuck | Shaft::Prescribed => {}
        }
        if let Some(switches) = switches {
            if axis.is_resistive() {
                f[CURRENT] = -f[SPEED] * motor.torque_constant_nm_per_a / axis.path_ohm(switches);
                x[CURRENT] = axis.ohmic_a(voltage_v, switches, x[SPEED]);
            } else {
                f[CURRENT] = voltage_v / motor.inductance_h;
            }
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
        match self.circuit {
            Circuit::Closed { supply_share, diodes, switches, .. } => {
                powers.source_v = axis.bridge.supply_v * supply_share;
                powers.diode_v = f64::from(diodes) * axis.bridge.diode_drop_v;
                powers.resistance_ohm = axis.path_ohm(switches);
            }
            Circuit::Amplified => {
                powers.source_v = motor.resistance_ohm * x[CURRENT];
                powers.source_nm = motor.torque_constant_nm_per_a * x[CURRENT];
                powers.resistance_ohm = motor.resistance_ohm;
            }
            Circuit::Open { .. } => {}
        }
        match self.shaft {
            Shaft::Creep => powers.creep_nm_s_per_rad = axis.creep_nm_s_per_rad(),
            Shaft::Slip(_) | Shaft::Prescribed => powers.coulomb_nm = motor.coulomb_nm,
            Shaft::Stuck => {}
        }
        match axis.hand {
            Hand::Torque(torque_nm) => powers.torque_nm = torque_nm,
            Hand::Spring(push) => {
                powers.hand_nm_per_rad = push.stiffness_nm_per_rad;
                powers.hand_nm_s_per_rad = push.damping_nm_s_per_rad;
            }
            Hand::Prescribed => {
                powers.borne_nm_per_a = motor.torque_constant_nm_per_a;
                powers.coulomb_nm = axis.friction_nm(x[SPEED]).abs();
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
        let creep = self.axis.creep_rad_per_s;
        let shaft = match self.shaft {
            Shaft::Slip(1) => Some((&mode.speed, band(creep, f64::INFINITY))),
            Shaft::Slip(-1) => Some((&mode.speed, band(f64::NEG_INFINITY, -creep))),
            Shaft::Creep => Some((&mode.speed, band(-creep, creep))),
            Shaft::Stuck => {
                let constant_nm = self.torque_nm();
                Some((&mode.net, band(-motor.coulomb_nm - constant_nm, motor.coulomb_nm - constant_nm)))
            }
            _ => None,
        };
        let circuit = match self.circuit {
            Circuit::Closed { direction: 1, .. } => Some((&mode.current, positive)),
            Circuit::Closed { direction: -1, .. } => Some((&mode.current, negative)),
            Circuit::Closed { .. } | Circuit::Amplified => None,
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
