//! Bodies on a segment: where they are, what friction does to them, and what the hand feels.

use super::{End, PmsmDevice};
use crate::flow::polynomial::{Lanes, ORDER, Polynomial, keeps};
use crate::network::Body;
use crate::pmsm::Grip;
use crate::pmsm::series::{ANGLE, Hold, SPEED, Series};

impl PmsmDevice<'_> {
    /// Returns position and speed of a body a time after the anchor.
    pub(super) fn place(&self, body: usize, t: f64) -> [f64; 2] {
        let Series { around, powers, .. } = &self.series;
        match body {
            0 => {
                let (x, _) = self.sum(t);
                [x[ANGLE], x[SPEED]]
            }
            _ => {
                let ([speed, position], _) = around.bodies[body - 1].at(t, *powers);
                [position, speed]
            }
        }
    }

    /// Returns the energy stored a time after the anchor, where the rotor is in this state.
    pub(super) fn stored_at(&self, (x, low): (&Lanes, &Lanes), t: f64) -> f64 {
        let Series { around, powers, .. } = &self.series;
        let others: Vec<_> = around.bodies.iter().map(|body| body.at(t, *powers)).collect();
        self.laws.stored_j(x, low, &others, around)
    }

    /// Returns the hand's position and its torque or force at an edge, in the units of the body that it holds.
    pub fn felt(&self, edge: u64) -> [f64; 2] {
        let Grip { body, units, torque_nm, stiffness_nm_per_rad, damping_nm_s_per_rad } = self.laws.grip;
        self.on(edge, |then, t| {
            let [position, speed] = then.place(body, t).map(|of| units * of);
            if then.laws.imposes(body) {
                let Body { viscous, coulomb, .. } = then.laws.net.bodies[body];
                let friction = if speed == 0.0 { 0.0 } else { coulomb * (speed * units).signum() };
                return [position, (friction + viscous * speed / units - then.borne(body, t)) / units];
            }
            let intent = then.intent_rad(edge);
            let pull = stiffness_nm_per_rad * (intent - position) + damping_nm_s_per_rad * (then.told.2 - speed);
            [if then.laws.is_sprung { intent } else { position }, torque_nm + pull]
        })
    }

    /// Returns what moves a body a time after the anchor, friction and hand apart.
    pub(super) fn borne(&self, body: usize, t: f64) -> f64 {
        let (laws, around) = (self.laws, &self.series.around);
        let mut force = laws.net.bodies[body].constant;
        for (tie, first) in around.ties.iter().zip(&around.stretches) {
            let moved = tie.sum(|of| self.place(of, t)[0] - self.place(of, 0.0)[0]);
            let pull = tie.stiffness * (first + moved) + tie.damping * tie.sum(|of| self.place(of, t)[1]);
            tie.ends.iter().filter(|(of, _)| *of == body).for_each(|(_, way)| force -= way * pull);
        }
        if body == 0 {
            let ((x, low), motor) = (self.sum(t), &laws.motor);
            let [direct, across] = self.rotated(t, &x);
            let active = motor.flux_vs + (motor.direct_h - motor.quadrature_h) * direct;
            force += 1.5 * f64::from(motor.pole_pairs) * active * across;
            for harmonic in &motor.cogging {
                force -= harmonic.amplitude_nm * laws.wave(harmonic, x[ANGLE], low[ANGLE]).0;
            }
        }
        force
    }

    /// Returns what friction does to a body, which has this speed, from the anchor on.
    #[inline(always)]
    pub(super) fn hold_at(&self, body: usize, speed: f64, cause: End) -> Hold {
        match cause {
            _ if self.laws.imposes(body) => Hold::Imposed,
            _ if self.laws.net.bodies[body].stiction == 0.0 => Hold::Slip(0.0),
            _ if speed != 0.0 => Hold::Slip(speed.signum()),
            End::Break(broken, direction) if broken == body => Hold::Slip(direction),
            // Unless the torque is beyond the stiction; it is known with the series.
            _ => Hold::Stuck,
        }
    }

    /// Finds what friction does to the bodies beside the rotor, and returns the sizes that a room bounds.
    #[inline(never)]
    pub(super) fn look_around(&mut self, cause: End) -> Vec<f64> {
        let mut bounds = Vec::new();
        for index in 0..self.series.around.bodies.len() {
            let speed = self.series.around.bodies[index].x[0];
            let hold = self.hold_at(index + 1, speed, cause);
            let body = &mut self.series.around.bodies[index];
            body.before = std::mem::replace(&mut body.hold, hold);
            bounds.push(speed.abs());
        }
        self.series.around.begin(&self.start);
        bounds.extend(self.series.around.stretches.iter().map(|stretch| stretch.abs()));
        self.freed = match cause {
            End::Touch(stop, _) if self.freed.take() == Some(stop) => Some(stop),
            _ => None,
        };
        bounds
    }

    /// Ends the segment where friction begins to hold a body, or ceases to.
    #[inline(always)]
    pub(super) fn watch_friction(&mut self, body: usize, from: f64) {
        let powers = self.series.powers;
        let hold = if body == 0 { self.hold } else { self.series.around.bodies[body - 1].hold };
        match hold {
            Hold::Slip(sign) if sign != 0.0 => {
                let first = self.series.around.terms(&self.series.x, body, 0)[0];
                let fall = self.room.accelerations[body] * self.end_s;
                if sign * first > fall {
                    return;
                }
                // From rest, the first term only gives the direction of the start.
                let skip = usize::from(first == 0.0);
                let term = |k: usize| sign * self.series.around.terms(&self.series.x, body, k + skip)[0];
                self.shorten(keeps(term, powers + 1 - skip, self.end_s, from), End::Stop(body));
            }
            Hold::Stuck => {
                let mut terms = [0.0; ORDER + 1];
                let force = if body == 0 { &self.series.torque } else { &self.series.around.bodies[body - 1].force };
                terms[..powers].copy_from_slice(&force[..powers]);
                let torque = Polynomial::of(terms, powers, self.end_s);
                // Rounding may have put the torque beyond its limit already; the shaft then breaks away when the torque
                // grows further.
                let beyond = torque.start().abs() * (1.0 + 4.0 * f64::EPSILON);
                let limit = self.laws.net.bodies[body].stiction.max(beyond);
                for direction in [1.0, -1.0] {
                    self.shorten(torque.keeps(limit, -direction, from), End::Break(body, direction));
                }
            }
            Hold::Slip(_) | Hold::Imposed => {}
        }
    }
}
