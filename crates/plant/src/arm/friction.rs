//! The joints that friction holds: the one consistent state of the coupled joints, found by trying all combinations.

use super::Arm;
use super::series::Start;

/// The state of a joint's motor under friction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Hold {
    /// Locked: it never moves.
    Locked,
    /// Stuck: friction holds it.
    Stuck,
    /// Slipping: it moves, or is about to, in this direction; 0 without Coulomb friction.
    Slip(f64),
}

/// The terms of the equations of motion that depend on the pose and the speeds.
pub(super) struct Pose {
    /// `M11` of the links alone, and `M23`.
    pub(super) m11: f64,
    pub(super) m23: f64,
    /// Torques of gravity and of the motion itself, with the sign of the motors' torques.
    pub(super) bias_nm: [f64; 3],
}

impl Pose {
    /// Computes the terms from the sines and cosines of the angles, and from the speeds.
    pub(super) fn of(arm: &Arm, sines: [(f64, f64); 3], v: [f64; 3]) -> Self {
        let model = &arm.model;
        let [(s1, c1), (s2, c2), (s3, c3)] = sines;
        let ([a0, a2, a3], p, [a, b], g) =
            (model.turning_kg_m2, model.coupling_kg_m2, model.moments_kg_m, model.gravity_m_per_s2);
        let (away, along) = (g[0] * s1 + g[2] * c1, g[0] * c1 - g[2] * s1);
        let (sine, cosine) = (s2 * c3 - c2 * s3, c2 * c3 + s2 * s3);
        let (d2, d3) = (-2.0 * a2 * s2 * c2 - 0.5 * p * s2 * s3, -2.0 * a3 * s3 * c3 + 0.5 * p * c2 * c3);
        let bias_nm = [
            along * (a * c2 + b * s3) - 2.0 * (d2 * v[1] + d3 * v[2]) * v[0],
            a * (g[1] * c2 - away * s2) + d2 * v[0] * v[0] - 0.5 * p * cosine * v[2] * v[2],
            b * (g[1] * s3 + away * c3) + d3 * v[0] * v[0] + 0.5 * p * cosine * v[1] * v[1],
        ];
        let m11 = a0 + a2 * (c2 * c2 - s2 * s2) + a3 * (c3 * c3 - s3 * s3) + p * c2 * s3;
        Self { m11, m23: -0.5 * p * sine, bias_nm }
    }
}

impl Arm {
    /// Returns the state of each joint from a start on. `broke` names a joint that friction has just ceased to hold,
    /// and the direction in which it moves.
    pub(super) fn holds(&self, x: &Start, broke: Option<(usize, f64)>) -> [Hold; 3] {
        let model = &self.model;
        let mut holds: [Hold; 3] = std::array::from_fn(|i| {
            if !model.free[i] {
                Hold::Locked
            } else if model.coulomb_nm[i] == 0.0 {
                Hold::Slip(0.0)
            } else if x.w[i] != 0.0 {
                Hold::Slip(x.w[i].signum())
            } else {
                Hold::Stuck
            }
        });
        if !holds.contains(&Hold::Stuck) {
            return holds;
        }
        // The torque on each motor without its friction at rest, and on the links.
        let mut open = [false; 3];
        let mut drive_nm = [0.0; 3];
        for i in 0..3 {
            let torque_nm = x.u[i] + x.lag[i];
            open[i] = holds[i] == Hold::Stuck;
            drive_nm[i] = match (model.transmission[i], holds[i]) {
                (Some(flexible), hold) => {
                    let spring_nm = flexible.stiffness_nm_per_rad * x.twist_rad(i)
                        + flexible.damping_nm_s_per_rad * (x.w[i] - x.v[i]);
                    if hold == Hold::Stuck {
                        open[i] = false;
                        holds[i] = decide(torque_nm - spring_nm, model.coulomb_nm[i]);
                    }
                    spring_nm
                }
                (None, Hold::Slip(sign)) => {
                    torque_nm - model.viscous_nm_s_per_rad[i] * x.w[i] - sign * model.coulomb_nm[i]
                }
                (None, _) => torque_nm,
            };
        }
        if open != [false; 3] {
            let [q, v] = [x.q, x.v].map(|[a, b, c, _]| [a, b, c]);
            let pose = Pose::of(self, q.map(libm::sincos), v);
            for (drive_nm, bias_nm) in drive_nm.iter_mut().zip(pose.bias_nm) {
                *drive_nm += bias_nm;
            }
            if open[0] {
                holds[0] = decide(drive_nm[0], model.coulomb_nm[0]);
            }
            self.settle(&mut holds, open, broke, &drive_nm, pose.m23);
        }
        if let Some((joint, sign)) = broke {
            holds[joint] = Hold::Slip(sign);
        }
        holds
    }

    /// Decides the states of joints 2 and 3 where `open`: it takes the combination whose accelerations and holding
    /// torques agree with it. Exactly one does, as the mass matrix is positive; if rounding leaves none, it takes that
    /// of least disagreement.
    fn settle(
        &self,
        holds: &mut [Hold; 3],
        open: [bool; 3],
        broke: Option<(usize, f64)>,
        drive_nm: &[f64; 3],
        m23: f64,
    ) {
        let [_, m22, m33] = self.diagonal_kg_m2();
        let options = |joint: usize| match broke {
            Some((broken, sign)) if broken == joint => [Some(Hold::Slip(sign)), None, None],
            _ if open[joint] => [Hold::Stuck, Hold::Slip(1.0), Hold::Slip(-1.0)].map(Some),
            _ => [Some(holds[joint]), None, None],
        };
        let mut best = (f64::INFINITY, holds[1], holds[2]);
        for two in options(1).into_iter().flatten() {
            for three in options(2).into_iter().flatten() {
                let moves: [bool; 2] = std::array::from_fn(|k| match [two, three][k] {
                    Hold::Locked => false,
                    Hold::Stuck => !open[k + 1],
                    Hold::Slip(_) => true,
                });
                // Torques with the friction of the joints about to slip.
                let net: [f64; 2] = std::array::from_fn(|k| match [two, three][k] {
                    Hold::Slip(sign) if open[k + 1] => drive_nm[k + 1] - sign * self.model.coulomb_nm[k + 1],
                    _ => drive_nm[k + 1],
                });
                let acceleration = match moves {
                    [true, true] => {
                        let determinant = m22 * m33 - m23 * m23;
                        [(m33 * net[0] - m23 * net[1]) / determinant, (m22 * net[1] - m23 * net[0]) / determinant]
                    }
                    [true, false] => [net[0] / m22, 0.0],
                    [false, true] => [0.0, net[1] / m33],
                    [false, false] => [0.0, 0.0],
                };
                let disagreement: f64 = (0..2)
                    .map(|k| match [two, three][k] {
                        Hold::Stuck if open[k + 1] => {
                            ((net[k] - m23 * acceleration[1 - k]).abs() - self.model.coulomb_nm[k + 1]).max(0.0)
                        }
                        Hold::Slip(sign) if open[k + 1] => (-sign * acceleration[k] * [m22, m33][k]).max(0.0),
                        _ => 0.0,
                    })
                    .sum();
                if disagreement < best.0 {
                    best = (disagreement, two, three);
                }
            }
        }
        (holds[1], holds[2]) = (best.1, best.2);
    }
}

/// Returns the state of a joint at rest, without coupling to other joints.
fn decide(net_nm: f64, coulomb_nm: f64) -> Hold {
    if net_nm.abs() <= coulomb_nm { Hold::Stuck } else { Hold::Slip(net_nm.signum()) }
}
