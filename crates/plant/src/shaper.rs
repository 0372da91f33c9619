//! The analog input shaper between controller and amplifier: a high-pass filter and two rectifiers.
//!
//! | equation | |
//! |---|---|
//! | `h = G u`, `G = s² / (s² + √2 ω s + ω²)` | second-order Butterworth high-pass |
//! | `y = max(0, u - max(0, h))` | the two rectifiers: pushes out of the wall only |
//!
//! `u` is the force against the penetration that the controller asks for, `y` the force that the amplifier gets. While
//! `u` is constant, with `z = ω t / √2`, `h = e⁻ᶻ (A cos z + B sin z)`; with time `(A, B)` rotates and shrinks, and a
//! step `Δu` adds `(Δu, -Δu)`.
//!
//! `y` is continuous where `u` is. A sampled copy of it, updated every `τ`, is late by less than `τ`, so it differs
//! from `y` by less than `τ` times the greatest slope ([`Shaper::slope_bound_per_s`]). With `|u| <= 1` that slope is
//! the total variation of the impulse response of `1 - G`, `ℓ = √2 ω e⁻ᶻ cos z`: a jump of `√2 ω`, then oscillations
//! that turn at `z = 3π/4 + n π`, `√2 ω (2 + √2 e^{-3π/4} / (1 - e^{-π}))` in all. If the force on a mass is wrong by
//! at most `ε`, then after a time `t` the speed is off by at most `ε t / m` and the position by `ε t² / 2m`; with
//! viscous friction `b` by at most `ε / b` and `ε t / b`. In a loop this holds as long as the encoder's counts lead to
//! the same commands.
//!
//! Source: "An Analog Input Shaper for Stability Enhancement of Haptic Interfaces and Its Application to
//! Energy-Bounding Algorithm", Fig. 1 and the cutoff of 2.5 Hz; the equations and the flow are derived from them.
//! **Differs from the hardware**: ideal diodes and amplifiers, no noise, no limits.

use std::f64::consts::{PI, SQRT_2};

/// The state of a shaper under a constant force.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shaper {
    /// `ω / √2`.
    rate_per_s: f64,
    input: f64,
    /// `A` and `B`.
    wave: [f64; 2],
}

impl Shaper {
    /// Creates a shaper at rest without input.
    pub fn new(cutoff_hz: f64) -> Self {
        Self { rate_per_s: SQRT_2 * PI * cutoff_hz, input: 0.0, wave: [0.0; 2] }
    }

    /// Returns the present input.
    pub fn input(&self) -> f64 {
        self.input
    }

    /// Returns the high-pass filter's output.
    pub fn high_pass(&self) -> f64 {
        self.wave[0]
    }

    /// Returns the shaped force: it is not negative, and not above the input unless the input is negative.
    pub fn output(&self) -> f64 {
        (self.input - self.high_pass().max(0.0)).max(0.0)
    }

    /// Returns the shaper after `time_s` seconds under the same input: exact for any time.
    pub fn after(&self, time_s: f64) -> Self {
        let z = self.rate_per_s * time_s;
        let (sin, cos) = libm::sincos(z);
        let shrunk = libm::exp(-z);
        let [a, b] = self.wave;
        Self { wave: [shrunk * (a * cos + b * sin), shrunk * (b * cos - a * sin)], ..*self }
    }

    /// Returns the shaper with another input.
    pub fn stepped(&self, input: f64) -> Self {
        let step = input - self.input;
        Self { input, wave: [self.wave[0] + step, self.wave[1] - step], ..*self }
    }

    /// Returns the greatest slope of the output between steps of the input, in 1/s, for inputs between -1 and 1.
    pub fn slope_bound_per_s(&self) -> f64 {
        let swings = SQRT_2 * libm::exp(-0.75 * PI) / (1.0 - libm::exp(-PI));
        2.0 * self.rate_per_s * (2.0 + swings)
    }
}
