//! The start of a series: the state there, and what friction does.

use super::Pmsm;
use super::circuit::Plane;
use crate::flow::double::two_sum;
use crate::flow::lanes::Lanes as InLanes;
use crate::flow::polynomial::{Lanes, ORDER};

/// Lanes of [`Start::x`] and of [`Series::x`].
pub(super) const ALPHA: usize = 0;
pub(super) const BETA: usize = 1;
pub(super) const SPEED: usize = 2;
pub(super) const ANGLE: usize = 3;

/// `1 / k`.
pub(super) const SHARES: [f64; ORDER + 2] = {
    let mut shares = [0.0; ORDER + 2];
    let mut k = 1;
    while k < ORDER + 2 {
        shares[k] = 1.0 / k as f64;
        k += 1;
    }
    shares
};

/// The state of a body under friction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Hold {
    /// Friction holds the body.
    Stuck,
    /// The body moves, or is about to, in this direction; 0 without friction.
    Slip(f64),
    /// A hand imposes its speed.
    Imposed,
}

/// The start of a series.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Currents in the stator's frame, speed and angle.
    pub x: Lanes,
    /// The parts of `x` lost by rounding, kept so that no anchor adds to the error.
    pub low: Lanes,
    /// The rotor's electrical direction.
    pub e: Plane,
    /// The hand's intention minus the position that it holds, and the speed of the intention.
    pub twist_rad: f64,
    pub intent_rad_per_s: f64,
}

impl Start {
    pub fn current(&self) -> Plane {
        [self.x[ALPHA], self.x[BETA]]
    }

    /// Returns the state a time after this start, with the parts that rounding takes from it, by the terms of the state
    /// from the first power on: the start and the change since are added without error, and the change is small.
    #[inline(always)]
    pub fn after<L: InLanes>(&self, terms: &[Lanes], t: f64) -> (Lanes, Lanes) {
        let (x, low, t) = (L::of(&self.x), L::of(&self.low), L::all(t));
        let rates = terms.iter().rev().fold(L::all(0.0), |sum, term| sum * t + L::of(term));
        // The angle also moves by the low part of the speed; -0 changes no number.
        let rates = rates + L::of(&[-0.0, -0.0, -0.0, self.low[SPEED]]);
        let (whole, rest) = two_sum(x, low + rates * t);
        (whole.state(), rest.state())
    }

    /// Returns the rate at which the rotor's direction changes.
    pub fn turning(&self, laws: &Pmsm) -> Plane {
        let speed = f64::from(laws.motor.pole_pairs) * self.x[SPEED];
        [-speed * self.e[1], speed * self.e[0]]
    }
}
