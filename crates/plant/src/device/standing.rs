//! A device that is left alone: what decides how it goes on, for proofs.

use super::{Circuit, Device, Gates, Shaft};
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED};

/// The state of a device at an edge from which on its hand stands still.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Standing {
    /// Current in A.
    pub current_a: f64,
    /// Speed in rad/s.
    pub speed_rad_per_s: f64,
    /// Angle in rad.
    pub angle_rad: f64,
    /// The angle that the hand intends, in rad.
    pub intent_rad: f64,
    /// Whether friction holds the shaft.
    pub is_stuck: bool,
}

impl Device<'_> {
    /// Returns the last edge to which the present motion can be computed.
    pub fn reach(&self) -> u64 {
        self.anchor.saturating_add(self.motion.system().longest())
    }

    /// Returns the state at an edge, each number rounded once; `None` while the hand moves.
    pub fn standing(&self, edge: u64) -> Option<Standing> {
        let x = self.exact_state(edge);
        (self.intent_rad_per_s == 0.0).then_some(Standing {
            current_a: x[CURRENT],
            speed_rad_per_s: x[SPEED],
            angle_rad: x[ANGLE],
            intent_rad: x[INTENT],
            is_stuck: self.shaft == Shaft::Stuck,
        })
    }

    /// Returns the share of the supply that these gates put across the motor, or that is across it now; `None` unless
    /// two closed switches carry the current either way.
    pub fn supply_share(&self, gates: Option<Gates>) -> Option<f64> {
        match gates.map_or(self.circuit, |gates| self.axis.bridge.circuit(gates, 0.0, 0.0)) {
            Circuit::Closed { supply_share, diodes: 0, switches: 2, .. } => Some(supply_share),
            _ => None,
        }
    }
}
