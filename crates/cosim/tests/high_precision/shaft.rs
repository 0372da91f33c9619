//! Coulomb friction: a shaft that slips one way or the other, or is stuck. Each mode is linear; it ends at an instant
//! that is found to all places.

use crate::fixed::Fixed;
use crate::flow::{ANGLE, CURRENT, SPEED, Vector};

/// What friction makes of the shaft.
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
    /// What the state does to the speed.
    pub row: Vector<N>,
    /// Of friction, while it slips.
    pub least: Fixed<N>,
}

impl<const N: usize> Friction<N> {
    /// The shaft of a state. `pull` is the part of the acceleration that does not depend on the state.
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

    /// The shaft that friction no longer holds.
    pub fn torn_off(&self, x: &Vector<N>, pull: Fixed<N>) -> Shaft {
        Shaft::Slips { forward: !self.net(x, pull).is_negative() }
    }

    /// The acceleration without friction, and without the speed's part: of a shaft at rest.
    fn net(&self, x: &Vector<N>, pull: Fixed<N>) -> Fixed<N> {
        self.row[CURRENT] * x[CURRENT] + self.row[ANGLE] * x[ANGLE] + pull
    }

    /// The acceleration that is not the state's.
    pub fn push(&self, shaft: Shaft, pull: Fixed<N>) -> Fixed<N> {
        match shaft {
            Shaft::Free => pull,
            Shaft::Slips { forward: true } => pull - self.least,
            Shaft::Slips { forward: false } => pull + self.least,
            Shaft::Stuck => Fixed::ZERO,
        }
    }

    /// How far the state is from the mode's end, negative beyond it.
    pub fn margin(&self, shaft: Shaft, x: &Vector<N>, pull: Fixed<N>) -> Fixed<N> {
        match shaft {
            Shaft::Free => Fixed::ZERO,
            Shaft::Slips { forward: true } => x[SPEED],
            Shaft::Slips { forward: false } => -x[SPEED],
            Shaft::Stuck => self.least - self.net(x, pull).abs(),
        }
    }

    /// Whether no margin is used up during a time, for certain. A stuck shaft's current fades or grows to where it is
    /// driven, ever more slowly, and its hand moves steadily; a slipping one's speed is no less than `slowest`, in its
    /// own direction.
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
