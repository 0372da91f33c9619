//! Virtual coupling: a spring and a damper between the device and a massless tool that the wall stops.
//!
//! With `e = x - x_t`, `x_t` being the tool's position: `K_c e + (B_c/T)(e - e⁻) = K_e x_t` inside the wall, `= 0`
//! outside; the force is the left side. The stiffness felt at rest is `1 / (1/K_c + 1/K_e)`, never more than that of
//! the coupling.
//!
//! **Source**: Colgate, Stanley and Brown 1995; Adams and Hannaford 1999.
//! **Known failures**: felt stiffness is bounded by `K_c < 2 (b - B_c) / T` (passivity with any environment), however
//! stiff the wall.

use hpu_datapath::CouplingConfig;

use crate::method::published::{Features, Layer, PASSIVE, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::schema::Otherwise::{Is, Required};
use crate::schema::quantity::Sense::{NotNegative, Positive};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Flag, Group, Key, Quantity, keys};

keys! { virtual_coupling: "method" of ["virtual_coupling"];
    /// Stiffness of the coupling between device and virtual tool.
    coupling_stiffness: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Required);
    /// Damping of the coupling.
    coupling_damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
    /// Makes the wall rigid, whatever its stiffness.
    rigid: Flag = Flag(false);
}

/// A massless tool between device and wall in a scene; the wall's stiffness is the environment's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CouplingMethod {
    /// `K_c`.
    pub coupling_nm_per_rad: f64,
    /// `B_c`.
    pub coupling_nm_s_per_rad: f64,
    /// Whether the wall is rigid, whatever its stiffness.
    pub rigid: bool,
}

impl Published for CouplingMethod {
    type Block = hpu_datapath::VirtualCoupling;
    type Float = VirtualCoupling;

    const KEYS: &'static Group = &virtual_coupling::GROUP;
    const LAYERS: &'static [Layer] =
        &[Layer { label: "coupling b/T", set: &[("method.coupling_stiffness", PASSIVE), ("method.rigid", "true")] }];

    fn read(s: &Section) -> Result<Self, SceneError> {
        use virtual_coupling as key;
        Ok(Self {
            coupling_nm_per_rad: s.read(&key::coupling_stiffness)?,
            coupling_nm_s_per_rad: s.read(&key::coupling_damping)?,
            rigid: s.read(&key::rigid)?,
        })
    }

    /// Returns the coupling with shares computed from the gains that the words realise.
    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade> {
        let shares = self.float(setting)?.shares();
        let gain_frac = 16;
        let word = |share: f64| (share * f64::from(1u32 << gain_frac)).round() as u32;
        Ok(Self::Block::new(CouplingConfig {
            widths: setting.widths,
            extension_frac: 8,
            gain_frac,
            share: word(shares.share),
            free: word(shares.free),
            held: word(shares.held),
        })?)
    }

    fn float(&self, setting: &Setting) -> Result<VirtualCoupling, SceneError> {
        let Setting { stiffness_n_per_m, damping_n_s_per_m, wall_n_per_m, period_s, .. } = *setting;
        let environment_n_per_m = if self.rigid { f64::INFINITY } else { wall_n_per_m };
        Ok(VirtualCoupling::new(stiffness_n_per_m, damping_n_s_per_m, environment_n_per_m, period_s))
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        vec![&mut self.coupling_nm_per_rad, &mut self.coupling_nm_s_per_rad]
    }

    fn features(&self) -> Features {
        Features {
            // Through a coupling, the felt stiffness never exceeds that of the coupling.
            stiffest: self.coupling_nm_per_rad,
            gains: Some([
                ("method.coupling_stiffness", self.coupling_nm_per_rad),
                ("method.coupling_damping", self.coupling_nm_s_per_rad),
            ]),
            fixed_wall: Some(
                "behind a coupling the wall's stiffness is part of constants, which do not change; leave it out",
            ),
            ..Features::default()
        }
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct VirtualCoupling {
    /// `K_c`.
    pub coupling_n_per_m: f64,
    /// `B_c`.
    pub coupling_n_s_per_m: f64,
    /// `K_e`, infinite for a rigid wall.
    pub environment_n_per_m: f64,
    /// `T`.
    pub period_s: f64,
    extension_m: f64,
}

/// The shares by which a coupling's extension is renewed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shares {
    /// Of `x`, the tool touching.
    pub share: f64,
    /// Of `e⁻`, the tool touching.
    pub held: f64,
    /// Of `e⁻`, the tool free.
    pub free: f64,
}

impl VirtualCoupling {
    /// Creates a coupling at rest.
    pub fn new(coupling_n_per_m: f64, coupling_n_s_per_m: f64, environment_n_per_m: f64, period_s: f64) -> Self {
        Self { coupling_n_per_m, coupling_n_s_per_m, environment_n_per_m, period_s, extension_m: 0.0 }
    }

    /// Returns the shares: `e = share x + held e⁻` with the tool touching, `e = free e⁻` with the tool free.
    pub fn shares(&self) -> Shares {
        let (k, damper) = (self.coupling_n_per_m, self.coupling_n_s_per_m / self.period_s);
        let free = if damper == 0.0 { 0.0 } else { damper / (k + damper) };
        if self.environment_n_per_m.is_infinite() {
            return Shares { share: 1.0, held: 0.0, free };
        }
        let all = self.environment_n_per_m + k + damper;
        Shares { share: self.environment_n_per_m / all, held: damper / all, free }
    }
}

impl SampledLaw for VirtualCoupling {
    fn sample(&mut self, x_m: f64) -> f64 {
        let Shares { share, held, free } = self.shares();
        let before_m = self.extension_m;
        if x_m - free * before_m <= 0.0 {
            self.extension_m = free * before_m;
            return 0.0;
        }
        self.extension_m = share * x_m + held * before_m;
        let damper = self.coupling_n_s_per_m / self.period_s;
        (self.coupling_n_per_m * self.extension_m + damper * (self.extension_m - before_m)).max(0.0)
    }

    fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
        self.coupling_n_per_m = stiffness_n_per_m;
    }
}
