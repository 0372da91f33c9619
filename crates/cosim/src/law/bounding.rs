//! The energy-bounding algorithm: the force is limited so that the damping of the device dissipates the energy that the
//! hold adds.
//!
//! - [`BoundingForm::C1C2`]: `F(n) = F(n-1) + β Δx`, `β = (F_e - F(n-1))/Δx` bounded by `c₁` and by
//!   `γ = c₂ - F(n-1)/Δx ± √(c₂² + 2 c₂ E(n-1)/Δx²)`, in that order; `E(n) = E(n-1) + F(n) Δx`. The γ are exactly
//!   `E(n) ≥ F(n)²/(2 c₂)`; `c₁ ≤ b/T` bounds what the hold adds. `Δx = 0` holds `F`. Feasible for `0 < c₂ ≤ c₁`.
//! - [`BoundingForm::ForceBound`]: `E(n) = E(n-1) + c Δx² + F(n-1) Δx`, begun afresh when `F(n-1) = 0`;
//!   `|F| ≤ 2 √(c E)`: necessary and sufficient for `E(n+1) ≥ 0` whatever the next `Δx`.
//!
//! Multiplied by `Δx`, every bound of β is one of `F`: no division is left, here or in the datapath.
//!
//! **Sources**: Kim and Ryu 2004, 2010 (the structure; the inequalities derived anew); the force bound after Ryu's
//! public least conservative algorithm.
//! **Known failures**: the felt stiffness is never above `c₁` (a steady ramp gives `2c` by the force bound), however
//! stiff the wall; a force may linger just outside the wall.

use super::{SampledLaw, Wall};

/// The published forms.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum BoundingForm {
    /// By `c₁` and `c₂`, in N/m.
    C1C2(f64, f64),
    /// By the greatest passive force; `c = b/T`, in N/m.
    ForceBound(f64),
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct EnergyBounding {
    /// The wall whose force is bounded.
    pub wall: Wall,
    /// The form of the bound.
    pub form: BoundingForm,
    /// The actuator's greatest force.
    pub limit_n: f64,
    energy_j: f64,
    force_n: f64,
    previous_m: f64,
}

impl EnergyBounding {
    /// Creates an algorithm around a wall, the device at `start_m` beyond the surface.
    #[must_use]
    pub fn new(wall: Wall, form: BoundingForm, limit_n: f64, start_m: f64) -> Self {
        Self { wall, form, limit_n, energy_j: 0.0, force_n: 0.0, previous_m: start_m }
    }

    /// Returns `E`.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }
}

impl SampledLaw for EnergyBounding {
    fn sample(&mut self, x_m: f64) -> f64 {
        let wanted_n = self.wall.sample(x_m).clamp(-self.limit_n, self.limit_n);
        let motion_m = x_m - self.previous_m;
        self.previous_m = x_m;
        match self.form {
            BoundingForm::C1C2(c1, c2) => {
                let across_n = c2 * motion_m;
                let root_n = (across_n * across_n + 2.0 * c2 * self.energy_j).sqrt();
                let (low_n, high_n) = (across_n - root_n, across_n + root_n);
                let step_n = self.force_n + c1 * motion_m;
                let force_n = if motion_m > 0.0 {
                    wanted_n.min(step_n).min(high_n).max(low_n)
                } else if motion_m < 0.0 {
                    wanted_n.max(step_n).max(low_n).min(high_n)
                } else {
                    self.force_n
                };
                self.force_n = force_n.clamp(-self.limit_n, self.limit_n);
                // Rounding alone can bring it below zero.
                self.energy_j = (self.energy_j + self.force_n * motion_m).max(0.0);
            }
            BoundingForm::ForceBound(c) => {
                let before_j = if self.force_n == 0.0 { 0.0 } else { self.energy_j };
                self.energy_j = (before_j + c * motion_m * motion_m + self.force_n * motion_m).max(0.0);
                let bound_n = (2.0 * (c * self.energy_j).sqrt()).min(self.limit_n);
                self.force_n = wanted_n.clamp(-bound_n, bound_n);
            }
        }
        self.force_n
    }
}
