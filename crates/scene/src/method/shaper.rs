//! The digital twin of the analog input shaper: it takes the fast part off the force.
//!
//! `y = max(0, u - max(0, H u))`, `H` a second-order Butterworth high-pass by the bilinear transform, prewarped to keep
//! the cutoff.
//!
//! **Source**: the seed on the analog input shaper, Figure 1.
//! **Known failures**: `1 - H` peaks at 1.272 just below the cutoff and overshoots, so that it feeds slow oscillations;
//! it rolls off only with the first order; the stiffness felt in the first tenth of a second is less.

use crate::method::sampled_law::SampledLaw;

/// Returns the coefficients `b0, b1, b2, a1, a2` of the high-pass.
pub fn high_pass(cutoff_hz: f64, period_s: f64) -> [f64; 5] {
    let w = libm::tan(std::f64::consts::PI * cutoff_hz * period_s);
    let norm = 1.0 + std::f64::consts::SQRT_2 * w + w * w;
    [
        1.0 / norm,
        -2.0 / norm,
        1.0 / norm,
        2.0 * (w * w - 1.0) / norm,
        (1.0 - std::f64::consts::SQRT_2 * w + w * w) / norm,
    ]
}

/// A law with the shaper behind it.
#[derive(Clone, PartialEq, Debug)]
pub struct InputShaper<L> {
    /// The law whose force is shaped.
    pub law: L,
    coefficients: [f64; 5],
    inputs_n: [f64; 2],
    outputs_n: [f64; 2],
}

impl<L> InputShaper<L> {
    /// Creates a shaper behind a law.
    pub fn new(law: L, cutoff_hz: f64, period_s: f64) -> Self {
        Self { law, coefficients: high_pass(cutoff_hz, period_s), inputs_n: [0.0; 2], outputs_n: [0.0; 2] }
    }
}

impl<L: SampledLaw> SampledLaw for InputShaper<L> {
    fn sample(&mut self, x_m: f64) -> f64 {
        let u_n = self.law.sample(x_m);
        let [b0, b1, b2, a1, a2] = self.coefficients;
        let fast_n =
            b0 * u_n + b1 * self.inputs_n[0] + b2 * self.inputs_n[1] - a1 * self.outputs_n[0] - a2 * self.outputs_n[1];
        self.inputs_n = [u_n, self.inputs_n[0]];
        self.outputs_n = [fast_n, self.outputs_n[0]];
        (u_n - fast_n.max(0.0)).max(0.0)
    }

    fn vary(&mut self, stiffness_n_per_m: f64, scale: f64) {
        self.law.vary(stiffness_n_per_m, scale);
    }

    fn aim(&mut self, target_m: f64) {
        self.law.aim(target_m);
    }
}
