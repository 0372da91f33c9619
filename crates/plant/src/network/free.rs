//! A network between the ends of its modes, as one linear system.

use super::laws::{Key, NetworkLaws, Touch, position_of};
use super::{FeedKind, MOST_FRICTIONS, MOST_STATES, MOST_STOPS, Reduced};
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
