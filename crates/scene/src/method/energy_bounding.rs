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

use hpu_datapath::BoundingConfig;
use hpu_signal::Format;

use crate::method::published::{ENERGY, Features, Layer, PASSIVE, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::method::wall::Wall;
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::parameter::Origin;
use crate::schema::quantity::Sense::Positive;
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, GainFormat, Group, Key, Quantity, Whole, keys};

keys! { energy_bounding: "method" of ["energy_bounding"];
    /// Published form of the bound: by the constants c1 and c2, or by the force.
    form: Choice<bool> = Choice::new(|| vec![("c1_c2", false), ("force_bound", true)], Is(false));
    /// First constant of the bound; of a force bound b/T.
    c1: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Required);
    /// Second constant of the bound, at most c1; a force bound has none.
    c2: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Said("c1"));
    /// Format of the constants, in PWM counts per count.
    bound_format: GainFormat = GainFormat(10, 4);
    /// Width of the energy.
    energy_bits: Whole<u32> = ENERGY;
}

/// Energy bounding in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BoundingMethod {
    /// The published form, its constants in N·m/rad.
    pub form: BoundingForm,
    /// Format of the constants, in PWM counts per count.
    pub bound_format: Format,
    /// Width of the energy.
    pub energy_bits: u32,
}

impl Published for BoundingMethod {
    type Block = hpu_datapath::EnergyBounding;
    type Float = EnergyBounding;

    const KEYS: &'static Group = &energy_bounding::GROUP;
    const LAYERS: &'static [Layer] = &[
        Layer { label: "energy bounding", set: &[("method.c1", PASSIVE)] },
        Layer { label: "force bound", set: &[("method.form", "force_bound"), ("method.c1", PASSIVE)] },
    ];

    fn read(s: &Section) -> Result<Self, SceneError> {
        use energy_bounding as key;
        let c1 = s.read(&key::c1)?;
        let by_force = s.read(&key::form)?;
        let form = if by_force {
            if s.has(key::c2.name) {
                return Err(s.error("c2", "the force bound has one constant, c1 = b/T; leave this out"));
            }
            BoundingForm::ForceBound(c1)
        } else {
            let c2 = s.read_or(&key::c2, c1, Origin::Default)?;
            if c2 > c1 {
                return Err(s.error("c2", "above c1, where no force is feasible for some motions; write 0 < c2 <= c1"));
            }
            BoundingForm::C1C2(c1, c2)
        };
        Ok(Self { form, bound_format: s.read(&key::bound_format)?, energy_bits: s.read(&key::energy_bits)? })
    }

    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade> {
        let word = |key, value| setting.word(key, value, setting.stiffness_unit(), "", self.bound_format);
        let (least_conservative, c1, c2) = match self.form {
            BoundingForm::C1C2(c1, c2) => (false, word("method.c1", c1)?, word("method.c2", c2)?),
            BoundingForm::ForceBound(c) => (true, word("method.c1", c)?, 0),
        };
        let (widths, energy_width) = (setting.widths, self.energy_bits);
        let (bound_width, bound_frac) = (self.bound_format.width(), self.bound_format.frac().unsigned_abs());
        let root = (2 * (bound_width + widths.width)).max(bound_width + energy_width + bound_frac + 2);
        let root_width = root.next_multiple_of(2);
        let config =
            BoundingConfig { widths, least_conservative, c1, c2, bound_frac, bound_width, energy_width, root_width };
        Ok(Self::Block::new(config)?)
    }

    fn float(&self, setting: &Setting) -> Result<EnergyBounding, SceneError> {
        Ok(EnergyBounding::new(setting.wall(1), self.form, setting.limit_n, setting.start_m))
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        match &mut self.form {
            BoundingForm::C1C2(c1, c2) => vec![c1, c2],
            BoundingForm::ForceBound(c) => vec![c],
        }
    }

    fn features(&self) -> Features {
        let (BoundingForm::C1C2(stiffest, _) | BoundingForm::ForceBound(stiffest)) = self.form;
        Features { stiffest, ..Features::default() }
    }
}

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
    pub fn new(wall: Wall, form: BoundingForm, limit_n: f64, start_m: f64) -> Self {
        Self { wall, form, limit_n, energy_j: 0.0, force_n: 0.0, previous_m: start_m }
    }

    /// Returns `E`.
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

    fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
        self.wall.stiffness_n_per_m = stiffness_n_per_m;
    }
}
