//! A network between the ends of its modes, as one linear system.

use super::laws::{Key, NetworkLaws, Touch, position_of};
use super::{FeedKind, MOST_FRICTIONS, MOST_STATES, MOST_STOPS, Reduced};
use crate::Hand;
use crate::flow::double::Double;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT};

/// The linear system `x' = A x + b u` of a network whose bodies all move without Coulomb friction, away from their
/// stops, while the drive stays within its supply. The hand's intention stays at 0.
///
/// Each number is that of the network's parameters, rounded once.
#[derive(Clone, PartialEq, Debug)]
pub struct Free {
    /// `A`, by rows. The position of the body with the encoder is the last state.
    pub a: Vec<Vec<f64>>,
    /// `b`: the effect of one ampere of the drive's reference, or of one volt of a bridge.
    pub drive: Vec<f64>,
}

impl Reduced {
    /// Returns the network as one linear system; a bridge drives through `switches` of its switches.
    pub fn free(&self, switches: u8) -> Free {
        let laws = NetworkLaws::<MOST_STATES>::new(self.clone(), 1.0, 1);
        let key = Key { slips: [1; MOST_FRICTIONS], touches: [Touch::Out; MOST_STOPS], limited: 0 };
        let is_bridge = matches!(self.feed.kind, FeedKind::Bridge(_));
        let rows = laws.rows(&key, is_bridge.then_some(switches), &laws.forces(&key));
        let mut drive = vec![Double::ZERO; MOST_STATES];
        let inductance = Double::from(self.feed.inductance_h);
        match self.feed.kind {
            FeedKind::Bridge(_) => drive[CURRENT] = Double::from(1.0).over(inductance),
            // A current that follows at once is no state.
            FeedKind::Current { .. } if self.feed.kind.is_ideal() => {
                drive = rows.iter().map(|row| row[CURRENT]).collect();
            }
            FeedKind::Current { bandwidth_rad_per_s, .. } => drive[CURRENT] = bandwidth_rad_per_s.into(),
            FeedKind::Pi { proportional_ohm, .. } => {
                drive[CURRENT] = Double::from(proportional_ohm).over(inductance);
                drive[laws.integral()] = 1.0.into();
            }
        }
        let used = |state: &usize| *state != INTENT && (*state != CURRENT || !self.feed.kind.is_ideal());
        let states = 0..self.moving();
        let order: Vec<usize> = states.filter(|state| used(state) && *state != ANGLE).chain([position_of(0)]).collect();
        Free {
            a: order.iter().map(|&row| order.iter().map(|&of| rows[row][of].hi).collect()).collect(),
            drive: order.iter().map(|&row| drive[row].hi).collect(),
        }
    }
}

impl Reduced {
    /// Returns the position at which the body with the encoder rests without the drive, and how far one unit of the
    /// drive's torque or force moves it from there, as it is at that body with all joints taken as rigid. The hand's
    /// spring intends the position `hand`, in units of the body that it holds. Friction and stops are left out. Returns
    /// `None` if no spring holds the device, or the hand imposes its motion.
    pub fn rest(&self, hand: f64) -> Option<[f64; 2]> {
        let count = self.bodies.len();
        // Stiffness by rows, then the force without the drive, then that of a unit of the drive.
        let mut rows = vec![vec![0.0; count + 2]; count];
        for (row, body) in rows.iter_mut().zip(&self.bodies) {
            (row[count], row[count + 1]) = (body.constant, 0.0);
        }
        for (at, body) in self.bodies.iter().enumerate() {
            rows[at][at] += body.spring;
        }
        for link in &self.links {
            for (end, sign) in [(0, [1.0, -1.0]), (1, [-1.0, 1.0])] {
                for other in 0..2 {
                    rows[link.ends[end]][link.ends[other]] +=
                        link.stiffness * link.ways[end] * link.ways[other] * sign[other];
                }
            }
        }
        let (grip, units) = self.grip;
        match self.hand {
            Hand::Torque(torque) => rows[grip][count] += units * torque,
            Hand::Spring(push) => {
                rows[grip][grip] += units * units * push.stiffness_nm_per_rad;
                rows[grip][count] += units * push.stiffness_nm_per_rad * hand;
            }
            Hand::Prescribed => return None,
        }
        let (driven, units) = self.driven;
        rows[driven][count + 1] = units * self.feed.torque_constant / self.effort_per_a;
        // Elimination; the body with the encoder is the first. The stiffness is symmetric and not negative.
        let own: Vec<f64> = (0..count).map(|at| rows[at][at]).collect();
        for at in (0..count).rev() {
            if rows[at][at] <= 1e-12 * own[at] {
                return None;
            }
            let (others, pivot) = rows.split_at_mut(at);
            for row in others {
                let share = row[at] / pivot[0][at];
                for (cell, by) in row.iter_mut().zip(&pivot[0]) {
                    *cell -= share * by;
                }
            }
        }
        let [place, compliance] = [count, count + 1].map(|column| rows[0][column] / rows[0][0]);
        (compliance > 0.0 && compliance.is_finite()).then_some([place, compliance])
    }
}
