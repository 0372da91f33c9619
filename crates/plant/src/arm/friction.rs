//! The joints that friction holds: the one consistent state of the coupled joints, found by trying all combinations.

use super::kinematics::Sines;
use super::links::Pose;
use super::links::{Arm, Links};
use super::series::{Hold, Start};

impl<L: Links> Arm<L> {
    /// Returns the state of each joint from a start on. `broke` names a joint that friction has just ceased to hold,
    /// and the direction in which it moves.
    pub(super) fn holds(&self, x: &Start, broke: Option<(usize, f64)>) -> [Hold; 3] {
        let joints = &self.joints;
        let mut holds: [Hold; 3] = std::array::from_fn(|i| {
            if !joints.free[i] {
                Hold::Locked
            } else if joints.coulomb_nm[i] == 0.0 {
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
            drive_nm[i] = match (joints.transmission[i], holds[i]) {
                (Some(flexible), hold) => {
                    let spring_nm = flexible.stiffness_nm_per_rad * x.twist_rad(i)
                        + flexible.damping_nm_s_per_rad * (x.w[i] - x.v[i]);
                    if hold == Hold::Stuck {
                        open[i] = false;
                        holds[i] = decide(torque_nm - spring_nm, joints.coulomb_nm[i]);
                    }
                    spring_nm
                }
                (None, Hold::Slip(sign)) => {
                    torque_nm - joints.viscous_nm_s_per_rad[i] * x.w[i] - sign * joints.coulomb_nm[i]
                }
                (None, _) => torque_nm,
            };
        }
        if open != [false; 3] {
            let [q, v] = [x.q, x.v].map(|[a, b, c, _]| [a, b, c]);
            let pose = self.pose(&Sines::of(q), q, v);
            for (drive_nm, bias_nm) in drive_nm.iter_mut().zip(pose.bias_nm) {
                *drive_nm += bias_nm;
            }
            if open[0] && pose.is_first_alone() {
                holds[0] = decide(drive_nm[0], joints.coulomb_nm[0]);
                open[0] = false;
            }
            self.settle(&mut holds, open, broke, &drive_nm, &pose);
        }
        if let Some((joint, sign)) = broke {
            holds[joint] = Hold::Slip(sign);
        }
        holds
    }

    /// Decides the states of the joints that are `open`: it takes the combination whose accelerations and holding
    /// torques agree with it. Exactly one does, as the mass matrix is positive; if rounding leaves none, it takes that
    /// of least disagreement.
    fn settle(
        &self,
        holds: &mut [Hold; 3],
        open: [bool; 3],
        broke: Option<(usize, f64)>,
        drive_nm: &[f64; 3],
        pose: &Pose,
    ) {
        let coulomb_nm = &self.joints.coulomb_nm;
        let options = |joint: usize| match broke {
            Some((broken, sign)) if broken == joint => [Some(Hold::Slip(sign)), None, None],
            _ if open[joint] => [Hold::Stuck, Hold::Slip(1.0), Hold::Slip(-1.0)].map(Some),
            _ => [Some(holds[joint]), None, None],
        };
        let pairs = |one: Hold| {
            let threes = move |two: Hold| options(2).into_iter().flatten().map(move |three| [one, two, three]);
            options(1).into_iter().flatten().flat_map(threes)
        };
        let mut best = (f64::INFINITY, *holds);
        for tried in options(0).into_iter().flatten().flat_map(pairs) {
            let moves: [bool; 3] = std::array::from_fn(|k| match tried[k] {
                Hold::Locked => false,
                Hold::Stuck => !open[k],
                Hold::Slip(_) => true,
            });
            // Torques with the friction of the joints about to slip.
            let net_nm: [f64; 3] = std::array::from_fn(|k| match tried[k] {
                Hold::Slip(sign) if open[k] => drive_nm[k] - sign * coulomb_nm[k],
                _ => drive_nm[k],
            });
            let acceleration = pose.accelerations(net_nm, moves);
            // The torque that a joint at rest feels beyond its own inertia.
            let felt_nm = |k: usize| {
                let others = (0..3).filter(|&j| j != k && pose.mass_kg_m2[k][j] != 0.0);
                others.fold(net_nm[k], |felt_nm, j| felt_nm - pose.mass_kg_m2[k][j] * acceleration[j])
            };
            let disagreement: f64 = (0..3)
                .map(|k| match tried[k] {
                    Hold::Stuck if open[k] => (felt_nm(k).abs() - coulomb_nm[k]).max(0.0),
                    Hold::Slip(sign) if open[k] => (-sign * acceleration[k] * pose.mass_kg_m2[k][k]).max(0.0),
                    _ => 0.0,
                })
                .sum();
            if disagreement < best.0 {
                best = (disagreement, tried);
            }
            if disagreement == 0.0 {
                break;
            }
        }
        *holds = best.1;
    }
}

/// Returns the state of a joint at rest, without coupling to other joints.
fn decide(net_nm: f64, coulomb_nm: f64) -> Hold {
    if net_nm.abs() <= coulomb_nm { Hold::Stuck } else { Hold::Slip(net_nm.signum()) }
}
