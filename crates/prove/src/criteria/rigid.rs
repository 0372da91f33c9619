//! The published criteria for a rigid body in contact with a sampled wall, as numbers.
//!
//! The model is `m x'' + b x' + f_c sgn x' = -F`. The position is quantised by `Δ` and sampled with a period `T`. The
//! wall's force `F = K p + B Δp/T` is held after a delay `t_d`. Most criteria use this model. A motor fits it as far as
//! its drive is ideal: `b` is then `B + K²/R`, including the braking by the back-EMF. Angles and torques are at the
//! shaft; for a mass read m instead of rad and N instead of N·m.

use std::f64::consts::PI;

use hpu_cosim::scene::{Device, Scene};

use crate::waits::delay_s;

/// A rigid body in contact with a sampled wall.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rigid {
    /// Inertia, in kg·m² (kg).
    pub inertia_kg_m2: f64,
    /// Viscous damping `b` of the device, in N·m·s/rad (N·s/m).
    pub damping_nm_s_per_rad: f64,
    /// Coulomb friction `f_c`, in N·m (N).
    pub coulomb_nm: f64,
    /// Step `Δ` of the position, in rad (m). 0 means no quantisation, which then asks for no friction.
    pub quantum_rad: f64,
    /// Sample period `T`, in s.
    pub period_s: f64,
    /// Delay `t_d` beside sampling and holding, in s: that of the linear law, or the clocks of encoder, registers and
    /// `method.settling` and the modulator's wait at rest on the scene's own wall.
    pub delay_s: f64,
    /// Damping `B` of the wall, in N·m·s/rad (N·s/m).
    pub wall_damping_nm_s_per_rad: f64,
}

hpu_signal::named! {
    /// The behaviour of a wall, by the energy that a quantum and a sample generate.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Region {
        /// The wall is passive at every speed.
        Passive = "passive",
        /// The motion settles from below the critical speed, and grows beyond it.
        LocallyStable = "locally stable",
        /// The motion goes on without end, no faster than the critical speed.
        LimitCycle = "limit cycle",
        /// The motion grows at every speed.
        Unstable = "unstable",
    }
}

/// The energy balance of Diolaiti et al. at some stiffness.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Balance {
    /// `b / (K T)`; sampling asks for at least `1/2 + t_d/T`.
    pub beta: f64,
    /// `f_c / (K Δ)`; the quantum asks for at least 1/2.
    pub sigma: f64,
    /// The region: which of the two conditions are met.
    pub region: Region,
    /// Speed at which both sides of the balance are equal, if only one of the two conditions is met.
    pub critical_rad_per_s: Option<f64>,
}

impl Rigid {
    /// Returns the rigid body of a scene; a winding on a bridge is treated as a damper. Of a network it is the body
    /// with the encoder, with all that is joined to it as if no joint bent.
    pub fn new(scene: &Scene) -> Self {
        let (inertia_kg_m2, viscous, coulomb_nm) = match &scene.device {
            Device::Motor(motor) => {
                (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad, motor.coulomb_friction_nm)
            }
            Device::Mass(mass) => (mass.mass_kg, mass.damping_n_s_per_m, mass.coulomb_n),
        };
        // Torque or force of an ampere, and the resistance, of a winding that a voltage drives.
        let winding = match (scene.network.as_deref(), &scene.device) {
            (None, Device::Motor(motor)) => Some((motor.torque_constant_nm_per_a, motor.resistance_ohm)),
            (Some(network), _) => network.winding(),
            (None, Device::Mass(_)) => None,
        };
        let braking = winding.map_or(0.0, |(constant, resistance_ohm)| {
            constant * constant / (resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm)
        });
        let damping_nm_s_per_rad = viscous + braking;
        Self {
            inertia_kg_m2,
            damping_nm_s_per_rad,
            coulomb_nm,
            quantum_rad: scene.encoder.count_rad(),
            period_s: scene.sample_period_s(),
            delay_s: delay_s(scene),
            wall_damping_nm_s_per_rad: scene.wall.damping_nm_s_per_rad,
        }
    }

    /// Returns the mean age of the wall's force: `T/2 + t_d`.
    pub fn lag_s(&self) -> f64 {
        0.5 * self.period_s + self.delay_s
    }

    /// Returns `f_c / Δ`.
    fn friction_of_a_quantum(&self) -> f64 {
        if self.quantum_rad > 0.0 { self.coulomb_nm / self.quantum_rad } else { f64::INFINITY }
    }

    /// Returns the limit of Colgate and Schenkel: passive with any passive hand while `b > K (T/2 + t_d) + |B|`.
    ///
    /// With no delay, or with a delay of whole samples and `B = 0`, this condition is necessary as well.
    pub fn colgate_schenkel(&self) -> f64 {
        (self.damping_nm_s_per_rad - self.wall_damping_nm_s_per_rad.abs()).max(0.0) / self.lag_s()
    }

    /// Returns both limits of Abbott and Okamura, `K <= min(2 b/T, 2 f_c/Δ)`; the limit of sampling first.
    pub fn abbott_okamura(&self) -> (f64, f64) {
        (2.0 * self.damping_nm_s_per_rad / self.period_s, 2.0 * self.friction_of_a_quantum())
    }

    /// Returns both limits of Diolaiti et al. for the stiffest passive wall, `β >= 1/2 + t_d/T` and `σ >= 1/2`; the
    /// limit of sampling first.
    pub fn diolaiti(&self) -> (f64, f64) {
        (self.damping_nm_s_per_rad / self.lag_s(), 2.0 * self.friction_of_a_quantum())
    }

    /// Returns the region of a stiffness above zero; the balance of one sample is
    /// `v T (1/2 + t_d/T - β) <= Δ (σ - 1/2)`.
    pub fn balance(&self, stiffness: f64) -> Balance {
        let beta = self.damping_nm_s_per_rad / (stiffness * self.period_s);
        let sigma = self.friction_of_a_quantum() / stiffness;
        let (sampling, quantum) = self.diolaiti();
        let region = match (stiffness <= sampling, stiffness <= quantum) {
            (true, true) => Region::Passive,
            (false, true) => Region::LocallyStable,
            (true, false) => Region::LimitCycle,
            (false, false) => Region::Unstable,
        };
        let speed = (self.coulomb_nm / stiffness - 0.5 * self.quantum_rad)
            / (self.lag_s() - self.damping_nm_s_per_rad / stiffness);
        let one_of_two = matches!(region, Region::LocallyStable | Region::LimitCycle);
        let critical_rad_per_s = (one_of_two && speed.is_finite()).then_some(speed);
        Balance { beta, sigma, region, critical_rad_per_s }
    }

    /// Returns the limit of Gil and Hulin: `K < (b + b_h + B) / (T/2 + t_d)`, to first order in damping and delay.
    pub fn gil_hulin(&self, hand_damping_nm_s_per_rad: f64) -> f64 {
        let damping = self.damping_nm_s_per_rad + hand_damping_nm_s_per_rad + self.wall_damping_nm_s_per_rad;
        damping / self.lag_s()
    }

    /// Returns the stiffest wall on which a body comes to rest after a constant effort `w > f_c` has dropped it onto
    /// the wall.
    ///
    /// A contact lasts half a period and multiplies the energy by `e^(π ω (T/2 + t_d))`. The way out and back
    /// multiplies it by `(w - f_c)/(w + f_c)`. Both balance at `K = m (ln((w + f_c)/(w - f_c)) / (π (T/2 + t_d)))²`.
    /// Returns `None` if friction holds the body against the effort.
    pub fn drop_threshold(&self, effort_nm: f64) -> Option<f64> {
        let (more, less) = (effort_nm + self.coulomb_nm, effort_nm - self.coulomb_nm);
        let swing_rad_per_s = libm::log(more / less) / (PI * self.lag_s());
        (less > 0.0).then_some(self.inertia_kg_m2 * swing_rad_per_s * swing_rad_per_s)
    }
}
