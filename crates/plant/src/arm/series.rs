//! The Taylor series of the arm's motion from one start, term by term.

use super::finger::Press;
use super::joints::Joints;
use crate::flow::polynomial::{Coefficients, Lanes, ORDER};

/// The state of a joint's motor under friction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Hold {
    /// Locked: it never moves.
    Locked,
    /// Stuck: friction holds it.
    Stuck,
    /// Slipping: it moves, or is about to, in this direction; 0 without Coulomb friction.
    Slip(f64),
}

/// The start of a series, and the command at the start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Start {
    /// Angles and speeds of the links.
    pub(super) q: Lanes,
    pub(super) v: Lanes,
    /// Angles and speeds of the motors.
    pub(super) p: Lanes,
    pub(super) w: Lanes,
    /// Commanded torques, and the actual torques minus these.
    pub(super) u: Lanes,
    pub(super) lag: Lanes,
    /// The finger.
    pub(super) press: Press,
    /// The parts of `q`, `v`, `p` and `w` lost by rounding, kept so that no anchor adds to the error.
    pub(super) low: [Lanes; 4],
}

/// Number of powers that most segments need, because a command or friction cuts them short; the others are written only
/// if the motion reaches them.
pub(super) const FIRST: usize = 6;
/// If the first powers are good for less than this time, all powers are written at once.
pub(super) const FIRST_LASTS_S: f64 = 2e-5;

pub(super) const ZERO: Coefficients = [[0.0; 4]; ORDER + 1];

/// Series of all quantities of [`Start`], and of the torque that holds each stuck joint.
#[derive(Clone)]
pub struct Series {
    pub(super) q: Coefficients,
    pub(super) v: Coefficients,
    pub(super) p: Coefficients,
    pub(super) w: Coefficients,
    pub(super) lag: Coefficients,
    pub(super) hold: Coefficients,
    /// Depth and force of the finger's pad, as if it pressed, and the speed of the surface.
    pub(super) touch: Coefficients,
    /// Powers in use: 0 where all is at rest.
    pub(super) powers: usize,
    /// Time for which the series are good.
    pub(super) good_s: f64,
}

/// Returns whether a joint's link moves.
pub(super) fn moves(joints: &Joints, holds: &[Hold; 3], i: usize) -> bool {
    let held = holds[i] == Hold::Stuck && joints.transmission[i].is_none();
    holds[i] != Hold::Locked && !held
}

impl Start {
    /// Returns the angle by which a motor is ahead of its link.
    pub(super) fn twist_rad(&self, i: usize) -> f64 {
        (self.p[i] - self.q[i]) + (self.low[2][i] - self.low[0][i])
    }
}

impl Series {
    pub(super) fn new() -> Self {
        Self { q: ZERO, v: ZERO, p: ZERO, w: ZERO, lag: ZERO, hold: ZERO, touch: ZERO, powers: 0, good_s: 0.0 }
    }

    /// Writes power `k + 1` of the angles, and of motors, transmissions and amplifiers, from power `k` of the speeds.
    /// Returns the terms of power `k` of the torques on the links.
    #[inline(always)]
    pub(super) fn motors(&mut self, joints: &Joints, x: &Start, holds: &[Hold; 3], k: usize, v: [f64; 3]) -> [f64; 3] {
        let share = 1.0 / (k + 1) as f64;
        // A loop is compiled into its caller, a closure over an array is not.
        let mut torques_nm = [0.0; 3];
        for i in 0..3 {
            let flexible = joints.transmission[i];
            let (w, lag) = (if flexible.is_some() { self.w[k][i] } else { v[i] }, self.lag[k][i]);
            let mut torque_nm = lag;
            if k == 0 {
                torque_nm += x.u[i];
                if let Hold::Slip(sign) = holds[i] {
                    torque_nm -= sign * joints.coulomb_nm[i];
                }
            }
            self.lag[k + 1][i] = if joints.amplifier_s > 0.0 { -lag * share / joints.amplifier_s } else { 0.0 };
            torque_nm -= joints.viscous_nm_s_per_rad[i] * w;
            if let Some(flexible) = flexible {
                let twist = if k == 0 { x.twist_rad(i) } else { self.p[k][i] - self.q[k][i] };
                let spring_nm = flexible.stiffness_nm_per_rad * twist + flexible.damping_nm_s_per_rad * (w - v[i]);
                self.hold[k][i] = torque_nm - spring_nm;
                let rests = !matches!(holds[i], Hold::Slip(_));
                let next = if rests { 0.0 } else { (torque_nm - spring_nm) * share / joints.rotor_kg_m2[i] };
                self.w[k + 1][i] = if k == 0 { onward(holds[i], x.w[i], next) } else { next };
                self.p[k + 1][i] = w * share;
                torque_nm = spring_nm;
            } else {
                self.w[k][i] = w;
                self.p[k + 1][i] = v[i] * share;
            }
            self.q[k + 1][i] = v[i] * share;
            torques_nm[i] = torque_nm;
        }
        torques_nm
    }

    /// Clears the highest power of those quantities that follow only from the next power, and finds how long the
    /// series are good.
    pub(super) fn close(&mut self, joints: &Joints, tolerance: f64) {
        let powers = self.powers;
        self.v[powers] = [0.0; 4];
        self.hold[powers] = [0.0; 4];
        self.touch[powers] = [0.0; 4];
        for i in (0..3).filter(|&i| joints.transmission[i].is_none()) {
            self.w[powers][i] = 0.0;
            self.hold[powers - 1][i] = 0.0;
        }
        self.good_s = self.good_for(tolerance);
    }

    /// Returns how long the terms of the last two powers of speeds and torques stay below the tolerance.
    fn good_for(&self, tolerance: f64) -> f64 {
        let size = |k: usize| {
            [&self.v, &self.w, &self.lag].iter().flat_map(|terms| terms[k]).fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        let length = |k: usize| {
            let size = size(k);
            if size == 0.0 { f64::INFINITY } else { libm::pow(tolerance / size, 1.0 / k as f64) }
        };
        length(self.powers - 1).min(length(self.powers - 2))
    }
}

/// Returns the first power of the speed of a joint that starts to slip from rest; rounding must not make it negative.
#[inline]
pub(super) fn onward(hold: Hold, speed: f64, first: f64) -> f64 {
    match hold {
        Hold::Slip(sign) if speed == 0.0 && sign * first < 0.0 => 0.0,
        _ => first,
    }
}
