//! Time-domain passivity: an observer that sums the energy which the wall takes in, and a controller that adds a damper
//! for one sample whenever that sum is negative.
//!
//! - [`Observer::Velocity`], as published: `W(n) = W(n-1) + F₂(n) d(n) + c(n-1) d(n-1)`, `F₂` being the force that the
//!   wall asks for now.
//! - [`Observer::HeldForce`]: `W(n) = W(n-1) + F(n-1) d(n)`, with the force that really was held while the device moved
//!   by `d(n)`: the exact energy between the samples.
//!
//! `c(n) = -W(n)/d(n)` if `W(n) < 0` and `d(n) ≠ 0`, else 0; `F = F₂ + c`, each within what the actuator can give.
//! Energy that this limit leaves undissipated stays in `W`, and later samples dissipate it.
//!
//! **Source**: Hannaford and Ryu 2002.
//! **Known failures**: at standstill (`d = 0`) no energy can be dissipated; credit stored earlier delays the action
//! (`credit_j` bounds it); the published observer does not see the energy that the hold adds between samples.

use super::{SampledLaw, Wall};

/// The force that the passivity observer multiplies a motion by.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Observer {
    /// The force wanted at the motion's end, as published.
    Velocity,
    /// The force held during the motion.
    HeldForce,
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct PassivityController {
    /// The wall whose energy is watched.
    pub wall: Wall,
    /// The observer's force.
    pub observer: Observer,
    /// The most energy that may be stored; infinite in the published method.
    pub credit_j: f64,
    /// The actuator's greatest force.
    pub limit_n: f64,
    energy_j: f64,
    previous_m: f64,
    motion_m: f64,
    correction_n: f64,
    force_n: f64,
}

impl PassivityController {
    /// Creates a controller of a wall, the device at `start_m` beyond the surface.
    #[must_use]
    pub fn new(wall: Wall, observer: Observer, credit_j: f64, limit_n: f64, start_m: f64) -> Self {
        Self {
            wall,
            observer,
            credit_j,
            limit_n,
            energy_j: 0.0,
            previous_m: start_m,
            motion_m: 0.0,
            correction_n: 0.0,
            force_n: 0.0,
        }
    }

    /// Returns `W`.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }
}

impl SampledLaw for PassivityController {
    fn sample(&mut self, x_m: f64) -> f64 {
        let wanted_n = self.wall.sample(x_m).clamp(-self.limit_n, self.limit_n);
        let motion_m = x_m - self.previous_m;
        let taken_j = match self.observer {
            Observer::Velocity => wanted_n * motion_m + self.correction_n * self.motion_m,
            Observer::HeldForce => self.force_n * motion_m,
        };
        self.energy_j = (self.energy_j + taken_j).min(self.credit_j);
        let needed_n = if self.energy_j < 0.0 && motion_m != 0.0 { -self.energy_j / motion_m } else { 0.0 };
        self.force_n = (wanted_n + needed_n.clamp(-self.limit_n, self.limit_n)).clamp(-self.limit_n, self.limit_n);
        self.correction_n = self.force_n - wanted_n;
        (self.previous_m, self.motion_m) = (x_m, motion_m);
        self.force_n
    }
}
