//! A spring and a damper inside the wall, and a negative damper everywhere.
//!
//! `F = K x + B v` for `x ≥ 0`, else 0, and everywhere minus `b v`; `v = (x(k) - x(k-N)) / (N T)`, computed at every
//! `N`-th sample. `N = 1` is the plain wall. `N > 1` is dual-rate sampling (spring fast, damping slow), which keeps the
//! velocity's quantum at `Δ / (N T)`.
//!
//! **Sources**: Colgate and Schenkel 1997 (the plain wall); Colgate and Brown 1994 (a physical damper `b` together with
//! `-b`); the dual rate after the page that cites Vasudevan et al. 2007.
//! **Known failures**: a held spring gives `K v² T² / 2` a sample; the quantum of `v` grows with the rate; `-b` must
//! not exceed the physical damping, and even then the device only feels undamped: the two together lie at the boundary
//! of passivity.

use crate::method::sampled_law::SampledLaw;

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct Wall {
    /// `K`.
    pub stiffness_n_per_m: f64,
    /// `B`, inside the wall.
    pub damping_n_s_per_m: f64,
    /// `b`, subtracted everywhere.
    pub relief_n_s_per_m: f64,
    /// Samples of the spring per sample of the velocity.
    pub ratio: u32,
    /// `T`.
    pub period_s: f64,
    previous_m: f64,
    velocity_m_per_s: f64,
    samples: u32,
}

impl Wall {
    /// Creates a wall whose velocity is computed every `ratio` samples, the device at `start_m` beyond its surface.
    pub fn new(stiffness_n_per_m: f64, damping_n_s_per_m: f64, ratio: u32, period_s: f64, start_m: f64) -> Self {
        Self {
            stiffness_n_per_m,
            damping_n_s_per_m,
            relief_n_s_per_m: 0.0,
            ratio,
            period_s,
            previous_m: start_m,
            velocity_m_per_s: 0.0,
            samples: 0,
        }
    }

    /// Returns the force at a position, with the velocity of the latest sample.
    pub fn force_n(&self, x_m: f64) -> f64 {
        let inside_n = if x_m >= 0.0 {
            self.stiffness_n_per_m * x_m + self.damping_n_s_per_m * self.velocity_m_per_s
        } else {
            0.0
        };
        inside_n - self.relief_n_s_per_m * self.velocity_m_per_s
    }
}

impl SampledLaw for Wall {
    #[inline]
    fn sample(&mut self, x_m: f64) -> f64 {
        if self.samples == 0 {
            self.velocity_m_per_s = (x_m - self.previous_m) / (f64::from(self.ratio) * self.period_s);
            self.previous_m = x_m;
            self.samples = self.ratio;
        }
        self.samples -= 1;
        self.force_n(x_m)
    }

    fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
        self.stiffness_n_per_m = stiffness_n_per_m;
    }

    #[inline]
    fn live_n(&self, x_m: f64) -> Option<f64> {
        Some(self.force_n(x_m))
    }
}
