//! Bodies beside the rotor, springs with dampers between bodies and to the ground, and stops.

use std::array::from_fn;

use super::start::{ANGLE, Hold, SHARES, SPEED, Start};
use super::{MOST_BODIES, Pmsm};
use crate::flow::double::{Double, two_sum};
use crate::flow::polynomial::{Coefficients, ORDER};
use crate::network::{Link, MOST_STOPS, Reduced, Touch};

/// A spring with a damper, whose stretch is `Σ way position - at`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Tie {
    /// Two bodies, each with its way; the way of the ground is 0.
    pub ends: [(usize, f64); 2],
    pub at: f64,
    pub stiffness: f64,
    pub damping: f64,
}

impl Tie {
    /// Returns the return springs and the joints of a network.
    pub fn of(net: &Reduced) -> Vec<Self> {
        let springs = net.bodies.iter().enumerate().filter(|(_, body)| body.spring != 0.0);
        let springs =
            springs.map(|(b, body)| Self { ends: [(b, 1.0), (b, 0.0)], at: 0.0, stiffness: body.spring, damping: 0.0 });
        let joints = net.links.iter().map(|&Link { ends: [a, b], ways, stiffness, damping }| Self {
            ends: [(a, ways[0]), (b, -ways[1])],
            at: 0.0,
            stiffness,
            damping,
        });
        springs.chain(joints).collect()
    }

    /// Returns of each pair of stops the low and the high one; a stretch above 0 is what a body is beyond it.
    pub fn of_stops(net: &Reduced) -> Vec<[Self; 2]> {
        let pair = |stop: &crate::network::Stop| {
            [(-1.0, stop.low), (1.0, stop.high)].map(|(side, end)| Self {
                ends: [(stop.body, side), (stop.body, 0.0)],
                at: side * end,
                stiffness: stop.stiffness,
                damping: stop.damping,
            })
        };
        net.stops.iter().map(pair).collect()
    }

    /// Returns the sum of a quantity of its bodies, each times its way.
    #[inline(always)]
    pub fn sum(&self, of: impl Fn(usize) -> f64) -> f64 {
        let [(a, one), (b, other)] = self.ends;
        one * of(a) + other * of(b)
    }

    /// Returns the sum of the sizes of a quantity of its bodies, each times the size of its way.
    pub fn most(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.ends.iter().map(|&(body, way)| way.abs() * of(body)).sum()
    }

    /// Returns the size of the way of one of its bodies.
    pub fn way(&self, body: usize) -> f64 {
        self.ends.iter().filter(|(of, _)| *of == body).map(|(_, way)| way.abs()).sum()
    }

    /// Returns its stretch where each body has this position, given with its low part.
    pub fn stretch(&self, position: impl Fn(usize) -> [f64; 2]) -> f64 {
        let ends = self.ends.iter().filter(|(_, way)| *way != 0.0);
        let sum = ends.fold(Double::from(-self.at), |sum, &(body, way)| {
            let [high, low] = position(body);
            sum + Double::product(way, high) + (way * low).into()
        });
        sum.hi
    }
}

/// A body beside the rotor on a segment.
#[derive(Clone)]
pub(super) struct Further {
    /// Speed and position at the anchor, and what rounding takes from both.
    pub x: [f64; 2],
    pub low: [f64; 2],
    /// Whether friction holds it, and which way it acts, now and on the segment before.
    pub hold: Hold,
    pub before: Hold,
    /// The terms of speed and position, by power.
    pub terms: [[f64; 2]; ORDER + 1],
    /// The terms of what moves it, friction apart.
    pub force: [f64; ORDER + 1],
}

impl Further {
    /// Returns the state a time after the anchor, with what rounding takes from it.
    pub fn at(&self, t: f64, powers: usize) -> ([f64; 2], [f64; 2]) {
        let rates = self.terms[1..=powers].iter().rev().fold([0.0; 2], |sum, term| from_fn(|k| sum[k] * t + term[k]));
        // The position also moves by the low part of the speed.
        let rates = [rates[0], rates[1] + self.low[0]];
        let sums: [(f64, f64); 2] = from_fn(|lane| two_sum(self.x[lane], self.low[lane] + rates[lane] * t));
        (sums.map(|(whole, _)| whole), sums.map(|(_, low)| low))
    }
}

/// The bodies, ties and stops around the rotor on a segment.
#[derive(Clone, Default)]
pub(super) struct Around {
    pub bodies: Vec<Further>,
    pub touches: [Touch; MOST_STOPS],
    /// The ties that act, stops that press among them, and their stretches at the anchor.
    pub ties: Vec<Tie>,
    pub stretches: Vec<f64>,
}

impl Around {
    pub fn new(laws: &Pmsm) -> Self {
        let body = |body: &crate::network::Body| Further {
            x: [body.speed, body.position],
            low: [0.0; 2],
            hold: Hold::Slip(0.0),
            before: Hold::Slip(0.0),
            terms: [[0.0; 2]; ORDER + 1],
            force: [0.0; ORDER + 1],
        };
        let bodies = laws.net.bodies[1..].iter().map(body).collect();
        Self { bodies, ties: laws.ties.clone(), ..Self::default() }
    }

    /// Sets where a pair of stops is touched.
    pub fn touch(&mut self, laws: &Pmsm, stop: usize, touch: Touch) {
        self.touches[stop] = touch;
        self.ties.truncate(laws.ties.len());
        for (pair, touch) in laws.stops.iter().zip(self.touches) {
            if let Touch::Pressed(side) = touch {
                self.ties.push(pair[usize::from(side > 0)]);
            }
        }
    }

    /// Returns a body's position at the start of a segment, with its low part.
    pub fn position(&self, start: &Start, body: usize) -> [f64; 2] {
        match body {
            0 => [start.x[ANGLE], start.low[ANGLE]],
            _ => [self.bodies[body - 1].x[1], self.bodies[body - 1].low[1]],
        }
    }

    /// Returns the terms of power `k` of a body's speed and position.
    #[inline(always)]
    pub fn terms(&self, rotor: &Coefficients, body: usize, k: usize) -> [f64; 2] {
        match body {
            0 => [rotor[k][SPEED], rotor[k][ANGLE]],
            _ => self.bodies[body - 1].terms[k],
        }
    }

    /// Returns the terms of power `k` of a tie's rate and stretch; the stretch at the start is the exact one.
    pub fn tie(&self, rotor: &Coefficients, tie: &Tie, first: f64, k: usize) -> [f64; 2] {
        let rate = tie.sum(|body| self.terms(rotor, body, k)[0]);
        [rate, if k == 0 { first } else { tie.sum(|body| self.terms(rotor, body, k)[1]) }]
    }

    /// Begins a series at the start of a segment.
    pub fn begin(&mut self, start: &Start) {
        let stretches = self.ties.iter().map(|tie| tie.stretch(|body| self.position(start, body)));
        self.stretches = stretches.collect();
        for body in &mut self.bodies {
            body.terms[0] = body.x;
        }
    }

    /// Writes the terms of power `k + 1` of the bodies beside the rotor from those of power `k` of all. Returns the
    /// term of power `k` of what acts on the rotor beside its own torques.
    #[inline(never)]
    pub fn write(&mut self, laws: &Pmsm, rotor: &Coefficients, start: &Start, k: usize) -> f64 {
        let mut forces = [0.0; MOST_BODIES];
        for (tie, first) in self.ties.iter().zip(&self.stretches) {
            let [rate, stretch] = self.tie(rotor, tie, *first, k);
            let force = tie.stiffness * stretch + tie.damping * rate;
            for (body, way) in tie.ends {
                forces[body] -= way * force;
            }
        }
        let grip = laws.grip;
        if grip.body != 0 {
            let [speed, position] = self.terms(rotor, grip.body, k).map(|term| grip.units * term);
            let mut force = -grip.damping_nm_s_per_rad * speed;
            force += match k {
                0 => {
                    let pull = grip.stiffness_nm_per_rad * start.twist_rad;
                    grip.torque_nm + pull + grip.damping_nm_s_per_rad * start.intent_rad_per_s
                }
                1 => grip.stiffness_nm_per_rad * (start.intent_rad_per_s - position),
                _ => -grip.stiffness_nm_per_rad * position,
            };
            forces[grip.body] += grip.units * force;
        }
        for (force, body) in forces.iter_mut().zip(&laws.net.bodies).filter(|_| k == 0) {
            *force += body.constant;
        }
        let share = SHARES[k + 1];
        for ((further, body), force) in self.bodies.iter_mut().zip(&laws.net.bodies[1..]).zip(&forces[1..]) {
            let [speed, _] = further.terms[k];
            further.force[k] = *force;
            let mut next = 0.0;
            if let Hold::Slip(sign) = further.hold {
                let rub = if k == 0 { sign * body.coulomb } else { 0.0 };
                next = (force - body.viscous * speed - rub) * (share / body.inertia);
                if k == 0 && speed == 0.0 && sign * next < 0.0 {
                    // Rounding must not make a body that begins to slip go back.
                    next = 0.0;
                }
            }
            further.terms[k + 1] = [next, speed * share];
        }
        forces[0]
    }
}
