//! Virtual coupling: a spring and a damper between the device and a massless tool that the wall stops.
//!
//! With `e = x - x_t`, `x_t` being the tool's position: `K_c e + (B_c/T)(e - e⁻) = K_e x_t` inside the wall, `= 0`
//! outside; the force is the left side. The stiffness felt at rest is `1 / (1/K_c + 1/K_e)`, never more than that of
//! the coupling.
//!
//! **Source**: Colgate, Stanley and Brown 1995; Adams and Hannaford 1999.
//! **Known failures**: felt stiffness is bounded by `K_c < 2 (b - B_c) / T` (passivity with any environment), however
//! stiff the wall.

use super::SampledLaw;

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
    #[must_use]
    pub fn new(coupling_n_per_m: f64, coupling_n_s_per_m: f64, environment_n_per_m: f64, period_s: f64) -> Self {
        Self { coupling_n_per_m, coupling_n_s_per_m, environment_n_per_m, period_s, extension_m: 0.0 }
    }

    /// Returns the shares: `e = share x + held e⁻` with the tool touching, `e = free e⁻` with the tool free.
    #[must_use]
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
}
