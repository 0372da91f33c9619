//! The drive of an axis from one instant to the next, as integrators in steps use it.

use crate::Circuit;
use crate::axis::{Axis, Hand};
use crate::device::{Device, Drive, REALS};
use crate::energy::{Energy, stored_j};
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};

/// The drive of an axis over one step: its circuit at the step's start, and the hand's speed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Excitation {
    /// Voltage across resistance, inductance and back-EMF.
    pub(crate) voltage_v: f64,
    pub(crate) resistance_ohm: f64,
    /// `1 / L`; 0 if no voltage drives the current.
    pub(crate) per_henry: f64,
    /// Whether the current follows the voltage at once.
    pub(crate) ohmic: bool,
    /// Voltage of the supply, or of an amplifier across the winding.
    pub(crate) source_v: f64,
    /// Torque of an imposed current.
    pub(crate) source_nm: f64,
    pub(crate) diode_v: f64,
    /// Direction of a current that flows through diodes; else 0.
    pub(crate) direction: f64,
    pub(crate) intent_rad_per_s: f64,
}

impl Axis {
    /// Returns the excitation from this state on, with the hand's intention moving at `intent_rad_per_s`.
    pub fn excitation(&self, drive: Drive, x: &State, intent_rad_per_s: f64) -> Excitation {
        let motor = &self.motor;
        let circuit = match drive {
            Drive::Current(_) => Circuit::Amplified,
            Drive::Average(duty) => self.bridge.averaged(duty),
            Drive::Gates(gates) => self.bridge.circuit(gates, x[CURRENT], motor.torque_constant_nm_per_a * x[SPEED]),
            Drive::Legs(_) | Drive::Averages(_) => panic!("an axis has no inverter"),
        };
        let mut excitation = Excitation {
            voltage_v: self.bridge.voltage_v(circuit),
            resistance_ohm: motor.resistance_ohm,
            per_henry: 0.0,
            ohmic: false,
            source_v: 0.0,
            source_nm: 0.0,
            diode_v: 0.0,
            direction: 0.0,
            intent_rad_per_s,
        };
        match circuit {
            Circuit::Closed { supply_share, diodes, direction, switches } => {
                excitation.resistance_ohm = self.path_ohm(switches);
                excitation.source_v = self.bridge.supply_v * supply_share;
                excitation.diode_v = f64::from(diodes) * self.bridge.diode_drop_v;
                excitation.direction = f64::from(direction);
                excitation.ohmic = self.is_resistive();
                excitation.per_henry = if excitation.ohmic { 0.0 } else { 1.0 / motor.inductance_h };
            }
            Circuit::Amplified => {
                excitation.source_v = motor.resistance_ohm * x[CURRENT];
                excitation.source_nm = motor.torque_constant_nm_per_a * x[CURRENT];
            }
            Circuit::Open { .. } => {}
        }
        excitation
    }

    /// Returns whether a drive gives the same excitation in every state.
    pub fn feeds_alike(&self, drive: Drive) -> bool {
        match drive {
            Drive::Average(_) => true,
            // With both legs switched, no current flows through diodes.
            Drive::Gates(gates) => (gates.a_high || gates.a_low) && (gates.b_high || gates.b_low),
            Drive::Current(_) | Drive::Legs(_) | Drive::Averages(_) => false,
        }
    }

    /// Returns whether [`taken`](Self::taken) leaves every state as it is under this drive.
    pub fn takes_alike(&self, drive: Drive) -> bool {
        match drive {
            Drive::Average(_) => !self.is_resistive(),
            Drive::Gates(_) => true,
            Drive::Current(_) | Drive::Legs(_) | Drive::Averages(_) => false,
        }
    }

    /// Returns the state at the moment at which a drive begins: an imposed current, or one without inductance, takes
    /// its value at once.
    pub fn taken(&self, drive: Drive, x: &State) -> State {
        let mut x = *x;
        match drive {
            Drive::Current(current_a) => x[CURRENT] = current_a,
            Drive::Average(duty) if self.is_resistive() => {
                x[CURRENT] = self.ohmic_a(self.bridge.voltage_v(self.bridge.averaged(duty)), 2, x[SPEED]);
            }
            Drive::Average(_) | Drive::Gates(_) | Drive::Legs(_) | Drive::Averages(_) => {}
        }
        x
    }

    /// Returns the energy stored in a state, in inductance and inertia.
    pub fn stored_j(&self, x: &State) -> f64 {
        stored_j(self.motor.inductance_h, self.motor.inertia_kg_m2, x)
    }

    /// Returns the outputs named by [`REALS`] in a state.
    #[inline]
    pub fn reals(&self, x: &State) -> [f64; REALS.len()] {
        [x[CURRENT], x[SPEED], x[ANGLE], self.motor.torque_constant_nm_per_a * x[CURRENT]]
    }

    /// Returns the hand's angle in a state, and its torque on the shaft, positive along the positive angle. The angle
    /// is the intended one for a hand with an intention, and the shaft's for any other. A hand that imposes the motion
    /// bears the torques of friction and motor.
    pub fn felt(&self, x: &State, intent_rad_per_s: f64) -> [f64; 2] {
        let motor = &self.motor;
        match self.hand {
            Hand::Torque(torque_nm) => [x[ANGLE], torque_nm],
            Hand::Spring(push) => {
                let spring = push.stiffness_nm_per_rad * (x[INTENT] - x[ANGLE]);
                [x[INTENT], spring + push.damping_nm_s_per_rad * (intent_rad_per_s - x[SPEED])]
            }
            Hand::Prescribed => {
                let friction_nm = motor.viscous_nm_s_per_rad * x[SPEED] + self.friction_nm(x[SPEED]);
                [x[ANGLE], friction_nm - motor.torque_constant_nm_per_a * x[CURRENT]]
            }
        }
    }

    /// Returns the torque constant in N·m/A.
    pub fn torque_constant_nm_per_a(&self) -> f64 {
        self.motor.torque_constant_nm_per_a
    }

    /// Returns whether the hand imposes the motion.
    pub fn is_prescribed(&self) -> bool {
        self.hand == Hand::Prescribed
    }

    /// Accounts for a jump to another state: the source supplies that of an imposed current, the hand that of a
    /// prescribed speed.
    pub fn jumped(&self, energy: &mut Energy, from: &State, to: &State) {
        energy.surge(self.motor.inductance_h, from[CURRENT], to[CURRENT]);
        energy.jerk(self.motor.inertia_kg_m2, from[SPEED], to[SPEED]);
    }
}

impl Device<'_> {
    /// Returns the present drive.
    pub fn drive_now(&self) -> Drive {
        self.drive
    }

    /// Flows exactly from one edge to another, through every change of mode, and returns the state there.
    pub fn flow(&mut self, from: u64, to: u64) -> State {
        let mut edge = from;
        while let Some(event) = self.next_event(edge, to, (f64::NEG_INFINITY, f64::INFINITY)) {
            edge = event.0;
            self.arrive(event);
        }
        self.state(to)
    }
}
