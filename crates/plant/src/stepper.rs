//! Fixed steps of the same axis, as in ordinary programs.
//!
//! A [`Stepper`] integrates `x' = f(x)`, [`derivative`](Stepper::derivative), over steps of one length, by a textbook
//! method, with the drive held over the step. Nothing is located inside a step:
//!
//! - Coulomb friction is `τ_c sgn ω` with the speed of the step's start; a shaft that stands still there, pulled by at
//!   most `τ_c`, stays for the step. A step that would reverse the speed ends at speed 0 if friction can hold the shaft
//!   there. Smoothed friction is computed at every stage as a function of the speed.
//! - Diodes conduct as at the start of the step; a current that they would not carry ends at 0.
//! - A winding without inductance follows Ohm's law at every stage.
//!
//! The implicit midpoint's equations are linear except for friction, which is monotonic in the speed alone: they are
//! solved in closed form, with friction at the midpoint.
//!
//! Energies are summed by the trapezoid rule, so the residual of the balance measures the error of the method.

use crate::axis::{Axis, Hand};
use crate::energy::Energy;
use crate::excitation::Excitation;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};

/// A method of integration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// `x₁ = x₀ + h f(x₀)`.
    Euler,
    /// The current from the old state, the speed from the new current, the angle from the new speed.
    SemiImplicit,
    /// `x₁ = x₀ + h f((x₀ + x₁) / 2)`.
    Midpoint,
    /// The classic Runge-Kutta method of order 4.
    Rk4,
}

/// Friction over a step.
struct Rub {
    friction_nm: f64,
    /// One over the inertia; 0 on a shaft that friction holds.
    per_inertia: f64,
    /// Whether friction is a function of the speed; `friction_nm` is then unused.
    smoothed: bool,
}

/// An axis in steps of one length.
#[derive(Clone, Copy, Debug)]
pub struct Stepper {
    method: Method,
    step_s: f64,
    torque_constant_nm_per_a: f64,
    per_inertia: f64,
    viscous_nm_s_per_rad: f64,
    coulomb_nm: f64,
    /// See [`Axis::with_smoothed_friction`]; 0 if friction sticks.
    creep_rad_per_s: f64,
    torque_nm: f64,
    hand_nm_per_rad: f64,
    hand_nm_s_per_rad: f64,
    prescribed: bool,
}

impl Stepper {
    /// Creates a stepper of an axis with steps of `step_s` seconds.
    pub fn new(axis: &Axis, method: Method, step_s: f64) -> Self {
        let motor = &axis.motor;
        let (torque_nm, hand_nm_per_rad, hand_nm_s_per_rad) = match axis.hand {
            Hand::Torque(torque_nm) => (torque_nm, 0.0, 0.0),
            Hand::Spring(push) => (0.0, push.stiffness_nm_per_rad, push.damping_nm_s_per_rad),
            Hand::Prescribed => (0.0, 0.0, 0.0),
        };
        Self {
            method,
            step_s,
            torque_constant_nm_per_a: motor.torque_constant_nm_per_a,
            per_inertia: if axis.hand == Hand::Prescribed { 0.0 } else { 1.0 / motor.inertia_kg_m2 },
            viscous_nm_s_per_rad: motor.viscous_nm_s_per_rad,
            coulomb_nm: motor.coulomb_nm,
            creep_rad_per_s: axis.creep_rad_per_s,
            torque_nm,
            hand_nm_per_rad,
            hand_nm_s_per_rad,
            prescribed: axis.hand == Hand::Prescribed,
        }
    }

    /// Returns the stepper with steps of another length.
    #[must_use]
    pub fn with_step(self, step_s: f64) -> Self {
        Self { step_s, ..self }
    }

    /// Returns the length of a step in seconds.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Returns `i`, or the current by Ohm's law at this speed.
    #[inline(always)]
    fn current_a(&self, current_a: f64, speed: f64, excitation: &Excitation) -> f64 {
        if excitation.ohmic {
            (excitation.voltage_v - self.torque_constant_nm_per_a * speed) / excitation.resistance_ohm
        } else {
            current_a
        }
    }

    /// Returns the torque of motor and hand.
    #[inline(always)]
    fn torque_nm(&self, x: &State, excitation: &Excitation) -> f64 {
        self.torque_constant_nm_per_a * x[CURRENT] + self.hand_nm(x, excitation)
    }

    #[inline(always)]
    fn hand_nm(&self, x: &State, excitation: &Excitation) -> f64 {
        self.torque_nm
            + self.hand_nm_per_rad * (x[INTENT] - x[ANGLE])
            + self.hand_nm_s_per_rad * (excitation.intent_rad_per_s - x[SPEED])
    }

    /// Returns the Coulomb friction against a speed, 0 at a standstill.
    #[inline(always)]
    fn friction_nm(&self, speed: f64) -> f64 {
        if self.creep_rad_per_s != 0.0 {
            self.coulomb_nm * (speed / self.creep_rad_per_s).clamp(-1.0, 1.0)
        } else if speed == 0.0 {
            0.0
        } else {
            self.coulomb_nm.copysign(speed)
        }
    }

    /// Returns the friction in a state.
    #[inline(always)]
    fn rub(&self, x: &State, excitation: &Excitation) -> Rub {
        let rub = |friction_nm, per_inertia| Rub { friction_nm, per_inertia, smoothed: false };
        if self.creep_rad_per_s != 0.0 {
            return Rub { smoothed: true, ..rub(0.0, self.per_inertia) };
        }
        if x[SPEED] != 0.0 || self.coulomb_nm == 0.0 {
            return rub(self.friction_nm(x[SPEED]), self.per_inertia);
        }
        let still = [self.current_a(x[CURRENT], 0.0, excitation), 0.0, x[ANGLE], x[INTENT]];
        let other_nm = self.torque_nm(&still, excitation);
        let breaks = other_nm.abs() > self.coulomb_nm;
        rub(self.coulomb_nm.copysign(other_nm), if breaks { self.per_inertia } else { 0.0 })
    }

    #[inline(always)]
    fn slope(&self, x: &State, excitation: &Excitation, rub: &Rub) -> State {
        let speed = x[SPEED];
        let x = [self.current_a(x[CURRENT], speed, excitation), speed, x[ANGLE], x[INTENT]];
        let friction_nm = if rub.smoothed { self.friction_nm(speed) } else { rub.friction_nm };
        let torque_nm = self.torque_nm(&x, excitation) - self.viscous_nm_s_per_rad * speed - friction_nm;
        let voltage_v =
            excitation.voltage_v - excitation.resistance_ohm * x[CURRENT] - self.torque_constant_nm_per_a * speed;
        [excitation.per_henry * voltage_v, rub.per_inertia * torque_nm, speed, excitation.intent_rad_per_s]
    }

    /// Returns `x'` at a state.
    pub fn derivative(&self, x: &State, excitation: &Excitation) -> State {
        self.slope(x, excitation, &self.rub(x, excitation))
    }

    /// Returns the state one step later.
    #[inline]
    pub fn step(&self, x: &State, excitation: &Excitation) -> State {
        let h = self.step_s;
        let along = |slope: &State, h: f64| -> State { std::array::from_fn(|k| x[k] + h * slope[k]) };
        let rub = self.rub(x, excitation);
        let mut next = match self.method {
            Method::Euler => along(&self.slope(x, excitation, &rub), h),
            Method::SemiImplicit => {
                let mut next = *x;
                next[CURRENT] += h * self.slope(x, excitation, &rub)[CURRENT];
                next[SPEED] += h * self.slope(&next, excitation, &rub)[SPEED];
                next[ANGLE] += h * next[SPEED];
                next[INTENT] += h * excitation.intent_rad_per_s;
                next
            }
            Method::Midpoint => self.midpoint(x, excitation),
            Method::Rk4 => {
                let k1 = self.slope(x, excitation, &rub);
                let k2 = self.slope(&along(&k1, 0.5 * h), excitation, &rub);
                let k3 = self.slope(&along(&k2, 0.5 * h), excitation, &rub);
                let k4 = self.slope(&along(&k3, h), excitation, &rub);
                std::array::from_fn(|k| x[k] + h / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]))
            }
        };
        if next[CURRENT] * excitation.direction < 0.0 {
            next[CURRENT] = 0.0;
        }
        if next[SPEED] * x[SPEED] < 0.0 && self.coulomb_nm != 0.0 && self.creep_rad_per_s == 0.0 && !self.prescribed {
            let still = [self.current_a(next[CURRENT], 0.0, excitation), 0.0, next[ANGLE], next[INTENT]];
            if self.torque_nm(&still, excitation).abs() <= self.coulomb_nm {
                next[SPEED] = 0.0;
            }
        }
        next[CURRENT] = self.current_a(next[CURRENT], next[SPEED], excitation);
        next
    }

    /// Makes a step of the implicit midpoint: the current in its middle is `i₀ - κ ω`, and its speed then follows from
    /// one linear equation with friction.
    #[inline(always)]
    fn midpoint(&self, x: &State, excitation: &Excitation) -> State {
        let half = 0.5 * self.step_s;
        let k = self.torque_constant_nm_per_a;
        let (current, kappa) = if excitation.ohmic {
            (excitation.voltage_v / excitation.resistance_ohm, k / excitation.resistance_ohm)
        } else {
            let share = half * excitation.per_henry;
            let scale = 1.0 / (1.0 + share * excitation.resistance_ohm);
            ((x[CURRENT] + share * excitation.voltage_v) * scale, share * k * scale)
        };
        let intent = x[INTENT] + half * excitation.intent_rad_per_s;
        let speed = if self.prescribed {
            x[SPEED]
        } else {
            let kick = half * self.per_inertia;
            let against = self.viscous_nm_s_per_rad + self.hand_nm_s_per_rad + self.hand_nm_per_rad * half + k * kappa;
            let scale = 1.0 / (1.0 + kick * against);
            let torque_nm = k * current
                + self.torque_nm
                + self.hand_nm_per_rad * (intent - x[ANGLE])
                + self.hand_nm_s_per_rad * excitation.intent_rad_per_s;
            self.slowed((x[SPEED] + kick * torque_nm) * scale, kick * scale * self.coulomb_nm)
        };
        [
            2.0 * (current - kappa * speed) - x[CURRENT],
            2.0 * speed - x[SPEED],
            x[ANGLE] + self.step_s * speed,
            x[INTENT] + self.step_s * excitation.intent_rad_per_s,
        ]
    }

    /// Returns the speed `ω` with `ω + most · s = free`, where `s` is friction's share of its greatest value at `ω`.
    #[inline(always)]
    fn slowed(&self, free: f64, most: f64) -> f64 {
        if most != 0.0 && free.abs() <= self.creep_rad_per_s + most {
            // Friction that sticks holds the shaft here.
            free * (self.creep_rad_per_s / (self.creep_rad_per_s + most))
        } else {
            free - most.copysign(free)
        }
    }

    /// Returns the powers of an excitation in a state.
    #[inline(always)]
    pub fn powers(&self, x: &State, excitation: &Excitation) -> Powers {
        Powers([
            excitation.source_v * x[CURRENT] + excitation.source_nm * x[SPEED],
            if self.prescribed {
                self.torque_constant_nm_per_a * x[CURRENT] * x[SPEED]
            } else {
                self.hand_nm(x, excitation) * x[SPEED]
            },
            excitation.resistance_ohm * x[CURRENT] * x[CURRENT],
            excitation.diode_v * x[CURRENT].abs(),
            self.viscous_nm_s_per_rad * x[SPEED] * x[SPEED],
            self.friction_nm(x[SPEED]) * x[SPEED],
        ])
    }

    /// Accounts for `length_s` seconds of one excitation, from its powers at the start and at the end.
    #[inline(always)]
    pub fn account(&self, energy: &mut Energy, length_s: f64, from: &Powers, to: &Powers) {
        let half = 0.5 * length_s;
        let mut flows: [f64; 6] = std::array::from_fn(|k| half * (from.0[k] + to.0[k]));
        if self.prescribed {
            // The hand bears friction and the motor's torque.
            flows[1] = flows[4] + flows[5] - flows[1];
        }
        energy.take(flows);
    }
}

/// Powers in one state: of the source, of the hand (of the motor on the hand, where the hand imposes the motion), in
/// copper, diodes, viscous and Coulomb friction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Powers([f64; 6]);
