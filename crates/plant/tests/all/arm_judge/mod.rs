//! A judge of the arm's motion: the *published* equations `M(θ) θ'' + C(θ, θ') θ' + N(θ) = τ` of Çavuşoğlu, Feygin and
//! Tendick 2002 (with the sign that makes `C` skew) in double-double, by Taylor series of order 24 whose last terms
//! stay below 1e-30. The code under test works with momenta, in f64, to order 16; the two share only the parameters.
//!
//! Stick and slip: among all combinations of the joints at rest, the judge takes the one whose accelerations and
//! holding torques agree with it.

pub mod twice;

use hpu_plant::arm::ArmModel;
use twice::{Twice, ZERO};

const N: usize = 24;
const LOCAL: f64 = 1e-30;
/// Number of points within a segment at which a change of mode is looked for.
const LOOKS: usize = 64;

type Terms = [Twice; N + 1];
type Joints<T> = [T; 3];

#[derive(Clone, Copy, PartialEq, Debug)]
enum Mode {
    Locked,
    Stuck,
    Slip(f64),
}

fn product(a: &Terms, b: &Terms, from: usize, k: usize) -> Twice {
    (from..=k).fold(ZERO, |sum, j| sum + a[j] * b[k - j])
}

fn value(terms: &Terms, t: Twice) -> Twice {
    terms.iter().rev().fold(ZERO, |sum, &term| sum * t + term)
}

fn slope(terms: &Terms, t: Twice) -> Twice {
    (1..=N).rev().fold(ZERO, |sum, k| sum * t + terms[k] * k as f64)
}

pub struct Judge {
    model: ArmModel,
    anchor: Twice,
    end: Twice,
    mode: Joints<Mode>,
    u: Joints<f64>,
    /// Angles and speeds of links and motors, torques minus their commands, holding torques of the stuck joints.
    q: Joints<Terms>,
    v: Joints<Terms>,
    p: Joints<Terms>,
    w: Joints<Terms>,
    lag: Joints<Terms>,
    hold: Joints<Terms>,
    /// The joint whose mode ends at the end, and the direction in which it breaks away if it was stuck.
    next: Option<(usize, Option<f64>)>,
}

impl Judge {
    pub fn new(model: ArmModel, angles: Joints<f64>) -> Self {
        let rest = [[ZERO; N + 1]; 3];
        let mut q = rest;
        for i in 0..3 {
            q[i][0] = angles[i].into();
        }
        let mode = [Mode::Stuck; 3];
        let (anchor, end) = (ZERO, ZERO);
        let mut judge = Self {
            model,
            anchor,
            end,
            mode,
            u: [0.0; 3],
            q,
            v: rest,
            p: q,
            w: rest,
            lag: rest,
            hold: rest,
            next: None,
        };
        judge.begin(None);
        judge
    }

    /// Returns the angles at the motors.
    pub fn angles(&mut self, time: Twice) -> Joints<Twice> {
        self.go(time);
        self.p.map(|terms| value(&terms, time - self.anchor))
    }

    pub fn drive(&mut self, time: Twice, u: Joints<f64>) {
        self.go(time);
        self.move_to(time);
        for i in (0..3).filter(|&i| self.model.free[i]) {
            if self.model.amplifier_s > 0.0 {
                self.lag[i][0] = self.lag[i][0] + Twice::from(self.u[i]) - Twice::from(u[i]);
            }
            self.u[i] = u[i];
        }
        self.begin(None);
    }

    fn go(&mut self, time: Twice) {
        while time > self.end {
            self.move_to(self.end);
            let mut broke = None;
            if let Some((joint, direction)) = self.next {
                broke = direction.map(|direction| (joint, direction));
                self.w[joint][0] = ZERO;
                if self.model.transmission[joint].is_none() {
                    self.v[joint][0] = ZERO;
                }
            }
            self.begin(broke);
        }
    }

    fn move_to(&mut self, time: Twice) {
        let t = time - self.anchor;
        for i in 0..3 {
            for terms in [&mut self.q[i], &mut self.v[i], &mut self.p[i], &mut self.w[i], &mut self.lag[i]] {
                terms[0] = value(terms, t);
            }
        }
        self.anchor = time;
    }

    fn rigid(&self, i: usize) -> bool {
        self.model.transmission[i].is_none()
    }

    fn begin(&mut self, broke: Option<(usize, f64)>) {
        let options = |i: usize| -> Vec<Mode> {
            if !self.model.free[i] {
                vec![Mode::Locked]
            } else if self.model.coulomb_nm[i] == 0.0 {
                vec![Mode::Slip(0.0)]
            } else if let Some((joint, direction)) = broke
                && joint == i
            {
                vec![Mode::Slip(direction)]
            } else if self.w[i][0] != ZERO {
                vec![Mode::Slip(self.w[i][0].hi.signum())]
            } else {
                vec![Mode::Stuck, Mode::Slip(1.0), Mode::Slip(-1.0)]
            }
        };
        let [one, two, three] = [0, 1, 2].map(options);
        'found: {
            for &a in &one {
                for &b in &two {
                    for &c in &three {
                        self.mode = [a, b, c];
                        self.write(2);
                        if self.agrees(broke) {
                            break 'found;
                        }
                    }
                }
            }
            panic!("no consistent mode");
        }
        self.write(N);
        let last = |k: usize| {
            let all = [&self.v, &self.w, &self.lag].into_iter().flatten();
            let size = all.fold(0.0, |most: f64, terms| most.max(terms[k].hi.abs()));
            if size == 0.0 { 1.0 } else { (LOCAL / size).powf(1.0 / k as f64) }
        };
        let length = last(N - 1).min(last(N - 2)).min(1e-3);
        self.end = self.anchor + length.into();
        self.next = None;
        for i in 0..3 {
            match self.mode[i] {
                Mode::Slip(sign) if sign != 0.0 => {
                    let speed = self.w[i].map(|term| term * sign);
                    self.shorten(&speed, (i, None));
                }
                Mode::Stuck => {
                    for direction in [1.0, -1.0] {
                        let mut room = self.hold[i].map(|term| term * -direction);
                        room[0] = room[0] + self.model.coulomb_nm[i].into();
                        self.shorten(&room, (i, Some(direction)));
                    }
                }
                _ => {}
            }
        }
    }

    /// Returns whether the modes of the joints at rest agree with their accelerations and holding torques.
    fn agrees(&self, broke: Option<(usize, f64)>) -> bool {
        (0..3).all(|i| match self.mode[i] {
            Mode::Stuck => self.hold[i][0].hi.abs() <= self.model.coulomb_nm[i],
            Mode::Slip(sign) if sign != 0.0 && self.w[i][0] == ZERO => {
                broke.is_some_and(|(joint, _)| joint == i) || self.w[i][1].hi * sign > 0.0
            }
            _ => true,
        })
    }

    /// Ends the segment where `room`, which is not negative at the start, becomes negative.
    fn shorten(&mut self, room: &Terms, next: (usize, Option<f64>)) {
        let length = self.end - self.anchor;
        let look = |n: usize| length * (n as f64 / LOOKS as f64);
        let Some(after) = (1..=LOOKS).find(|&n| value(room, look(n)).hi < 0.0) else { return };
        let (mut low, mut high) = (look(after - 1), look(after));
        for _ in 0..40 {
            let middle = (low + high) * 0.5;
            if value(room, middle).hi < 0.0 { high = middle } else { low = middle }
        }
        let mut t = (low + high) * 0.5;
        for _ in 0..3 {
            let rate = slope(room, t);
            if rate.hi < 0.0 {
                t = t - value(room, t) / rate;
            }
        }
        (self.end, self.next) = (self.anchor + t, Some(next));
    }

    /// Writes all series up to this power.
    fn write(&mut self, powers: usize) {
        let model = self.model;
        let ([a0, a2, a3], p) = (model.turning_kg_m2, model.coupling_kg_m2);
        let [a, b] = model.moments_kg_m;
        let gravity = -model.gravity_m_per_s2[1];
        let none = [ZERO; N + 1];
        // Angles 2θ2, 2θ3, θ2, θ3, θ2-θ3 with their sines and cosines.
        let (mut angle, mut sine, mut cosine) = ([none; 5], [none; 5], [none; 5]);
        let (mut m11, mut m23, mut d2, mut d3, mut bend) = (none, none, none, none, none);
        let (mut turn, mut square, mut acceleration) = (none, [none; 3], [none; 3]);
        let mass = |i: usize| {
            let links = [0.0, model.swinging_kg_m2[0], model.swinging_kg_m2[1]][i];
            Twice::from(links) + if self.model.transmission[i].is_none() { model.rotor_kg_m2[i].into() } else { ZERO }
        };
        let [rotor, m22, m33] = [0, 1, 2].map(mass);
        for k in 0..powers {
            let share = Twice::from((k + 1) as f64);
            let [_, q2, q3] = self.q.map(|terms| terms[k]);
            for (terms, now) in angle.iter_mut().zip([q2 * 2.0, q3 * 2.0, q2, q3, q2 - q3]) {
                terms[k] = now;
            }
            for i in 0..5 {
                if k == 0 {
                    (sine[i][0], cosine[i][0]) = angle[i][0].sin_cos();
                } else {
                    let rate = |j: usize| angle[i][j] * j as f64;
                    let along = |other: &Terms| (1..=k).fold(ZERO, |sum, j| sum + rate(j) * other[k - j]);
                    let (up, down) = (along(&cosine[i]), along(&sine[i]));
                    let power = Twice::from(k as f64);
                    (sine[i][k], cosine[i][k]) = (up / power, -down / power);
                }
            }
            // M, and the slopes of M that make up C.
            m11[k] = cosine[0][k] * a2 + cosine[1][k] * a3 + product(&cosine[2], &sine[3], 0, k) * p;
            if k == 0 {
                m11[0] = m11[0] + a0.into() + rotor;
            }
            m23[k] = sine[4][k] * (-0.5 * p);
            d2[k] = sine[0][k] * (-2.0 * a2) - product(&sine[2], &sine[3], 0, k) * p;
            d3[k] = sine[1][k] * (-2.0 * a3) + product(&cosine[2], &cosine[3], 0, k) * p;
            bend[k] = cosine[4][k] * p;
            // C θ' and N.
            turn[k] = product(&d2, &self.v[1], 0, k) + product(&d3, &self.v[2], 0, k);
            for (square, v) in square.iter_mut().zip(&self.v) {
                square[k] = product(v, v, 0, k);
            }
            let coriolis = [
                product(&turn, &self.v[0], 0, k),
                (product(&bend, &square[2], 0, k) - product(&d2, &square[0], 0, k)) * 0.5,
                -(product(&bend, &square[1], 0, k) + product(&d3, &square[0], 0, k)) * 0.5,
            ];
            let weight = [ZERO, cosine[2][k] * a * gravity, sine[3][k] * b * gravity];
            let mut force: Joints<Twice> = [0, 1, 2].map(|i| -coriolis[i] - weight[i]);
            for (i, force) in force.iter_mut().enumerate() {
                let mut torque = self.lag[i][k] - self.w[i][k] * model.viscous_nm_s_per_rad[i];
                if k == 0 {
                    torque = torque + self.u[i].into();
                    if let Mode::Slip(sign) = self.mode[i] {
                        torque = torque - Twice::from(sign) * model.coulomb_nm[i];
                    }
                }
                if model.amplifier_s > 0.0 {
                    self.lag[i][k + 1] = -self.lag[i][k] / (share * model.amplifier_s);
                }
                if let Some(flexible) = model.transmission[i] {
                    let spring = (self.p[i][k] - self.q[i][k]) * flexible.stiffness_nm_per_rad
                        + (self.w[i][k] - self.v[i][k]) * flexible.damping_nm_s_per_rad;
                    self.hold[i][k] = torque - spring;
                    self.p[i][k + 1] = self.w[i][k] / share;
                    self.w[i][k + 1] = match self.mode[i] {
                        Mode::Slip(_) => (torque - spring) / (share * model.rotor_kg_m2[i]),
                        _ => ZERO,
                    };
                    torque = spring;
                }
                *force = *force + torque;
            }
            // M θ'' = force, where the terms of M beyond the first are known.
            let [c1, c2, c3] = [
                product(&m11, &acceleration[0], 1, k),
                product(&m23, &acceleration[2], 1, k),
                product(&m23, &acceleration[1], 1, k),
            ];
            let [r1, r2, r3] = [force[0] - c1, force[1] - c2, force[2] - c3];
            let moves = [0, 1, 2].map(|i| match self.mode[i] {
                Mode::Locked => false,
                Mode::Stuck => !self.rigid(i),
                Mode::Slip(_) => true,
            });
            let m = m23[0];
            let (x2, x3) = match (moves[1], moves[2]) {
                (true, true) => {
                    let determinant = m22 * m33 - m * m;
                    ((m33 * r2 - m * r3) / determinant, (m22 * r3 - m * r2) / determinant)
                }
                (true, false) => (r2 / m22, ZERO),
                (false, true) => (ZERO, r3 / m33),
                (false, false) => (ZERO, ZERO),
            };
            let x = [if moves[0] { r1 / m11[0] } else { ZERO }, x2, x3];
            let held = [r1, r2 - m * x3, r3 - m * x2];
            for i in 0..3 {
                acceleration[i][k] = x[i];
                self.q[i][k + 1] = self.v[i][k] / share;
                self.v[i][k + 1] = x[i] / share;
                if self.rigid(i) {
                    self.hold[i][k] = held[i];
                    (self.p[i][k + 1], self.w[i][k + 1]) = (self.q[i][k + 1], self.v[i][k + 1]);
                }
            }
        }
        for terms in &mut self.hold {
            terms[powers] = ZERO;
        }
    }
}
