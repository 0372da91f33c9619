//! Coulomb friction: a shaft that slips one way or the other, or is stuck. Each mode is linear; it ends at an instant
//! found to all places.

use crate::fixed::Fixed;
use crate::flow::{ANGLE, CURRENT, SPEED, Vector};

/// The mode of the shaft under friction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Shaft {
    /// There is no friction.
    Free,
    Slips {
        forward: bool,
    },
    Stuck,
}

/// The accelerations of a shaft.
#[derive(Clone, Copy)]
pub struct Friction<const N: usize> {
    /// The row of the speed: its rate by the state.
    pub row: Vector<N>,
    /// The deceleration by friction, while the shaft slips.
    pub least: Fixed<N>,
}

impl<const N: usize> Friction<N> {
    /// Returns the mode of the shaft in a state. `pull` is the part of the acceleration that does not depend on the
    /// state.
    pub fn shaft(&self, x: &Vector<N>, pull: Fixed<N>) -> Shaft {
        let rests = x[SPEED] == Fixed::ZERO;
        let net = self.net(x, pull);
        if self.least == Fixed::ZERO {
            Shaft::Free
        } else if rests && net.abs() <= self.least {
            Shaft::Stuck
        } else {
            Shaft::Slips { forward: !(if rests { net } else { x[SPEED] }).is_negative() }
        }
    }

    /// Returns the mode of a shaft that friction no longer holds.
    pub fn torn_off(&self, x: &Vector<N>, pull: Fixed<N>) -> Shaft {
        Shaft::Slips { forward: !self.net(x, pull).is_negative() }
    }

    /// Returns the acceleration of a shaft at rest without friction.
    fn net(&self, x: &Vector<N>, pull: Fixed<N>) -> Fixed<N> {
        self.row[CURRENT] * x[CURRENT] + self.row[ANGLE] * x[ANGLE] + pull
    }

    /// Returns the part of the acceleration that does not depend on the state.
    pub fn push(&self, shaft: Shaft, pull: Fixed<N>) -> Fixed<N> {
        match shaft {
            Shaft::Free => pull,
            Shaft::Slips { forward: true } => pull - self.least,
            Shaft::Slips { forward: false } => pull + self.least,
            Shaft::Stuck => Fixed::ZERO,
        }
    }

    /// Returns the distance of the state from the mode's end, negative beyond it.
    pub fn margin(&self, shaft: Shaft, x: &Vector<N>, pull: Fixed<N>) -> Fixed<N> {
        match shaft {
            Shaft::Free => Fixed::ZERO,
            Shaft::Slips { forward: true } => x[SPEED],
            Shaft::Slips { forward: false } => -x[SPEED],
            Shaft::Stuck => self.least - self.net(x, pull).abs(),
        }
    }

    /// Returns whether the mode certainly lasts for a time. The current of a stuck shaft approaches its final value
    /// ever more slowly, and the hand moves steadily; the speed of a slipping shaft is at least `slowest` in its own
    /// direction.
    pub fn lasts(
        &self,
        shaft: Shaft,
        x: &Vector<N>,
        rate: &Vector<N>,
        pull: Fixed<N>,
        time_s: f64,
        slowest: f64,
    ) -> bool {
        match shaft {
            Shaft::Free => true,
            Shaft::Slips { .. } => slowest > x[SPEED].float().abs() * 1e-9,
            Shaft::Stuck => {
                let most = (self.row[CURRENT] * rate[CURRENT]).abs() + (self.row[ANGLE] * rate[ANGLE]).abs();
                most.float() * time_s + self.least.float() * 1e-9 < self.margin(shaft, x, pull).float()
            }
        }
    }
}
