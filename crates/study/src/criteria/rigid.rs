//! The published criteria of a sampled wall before a rigid body, in numbers.
//!
//! `m x'' + b x' + f_c sgn x' = -F`, the position quantised by `Δ`, sampled with a period `T`, the wall's force
//! `F = K p + B Δp/T` held after a delay `t_d`. Most criteria have this picture. A motor fits it as far as its drive is
//! an ideal one: `b` is then `B + K²/R`, what the back-EMF brakes included. Angles and torques are at the shaft; of a
//! mass read m for rad and N for N·m.

use std::f64::consts::PI;

use hpu_cosim::scene::{Device, Scene};

/// A rigid body before a sampled wall.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rigid {
    /// Inertia, in kg·m² (kg).
    pub inertia_kg_m2: f64,
    /// Viscous damping `b` of the device.
    pub damping_nm_s_per_rad: f64,
    /// Coulomb friction `f_c`.
    pub coulomb_nm: f64,
    /// Step `Δ` of the position, 0 for none: the quantum then asks for nothing.
    pub quantum_rad: f64,
    /// Sample period `T`.
    pub period_s: f64,
    /// Delay `t_d` beside sampling and holding.
    pub delay_s: f64,
    /// Damping `B` of the wall.
    pub wall_damping_nm_s_per_rad: f64,
}

/// What becomes of a wall by the energy that a quantum and a sample generate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Region {
    /// Passive at every speed.
    Passive,
    /// Settles from below the critical speed; beyond it, grows.
    LocallyStable,
    /// Swings without end, no faster than the critical speed.
    LimitCycle,
    /// Grows at every speed.
    Unstable,
}

impl Region {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Passive => "passive",
            Self::LocallyStable => "locally stable",
            Self::LimitCycle => "limit cycle",
            Self::Unstable => "unstable",
        }
    }
}

/// The balance of Diolaiti et al. at some stiffness.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Balance {
    /// `b / (K T)`; the sampling asks for `1/2 + t_d/T`.
    pub beta: f64,
    /// `f_c / (K Δ)`; the quantum asks for 1/2.
    pub sigma: f64,
    /// Which of the two is met.
    pub region: Region,
    /// Speed at which both sides are equal, where only one of the two is met.
    pub critical_rad_per_s: Option<f64>,
}

impl Rigid {
    /// The body of a scene; a motor's winding is taken for a damper.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let (inertia_kg_m2, damping_nm_s_per_rad, coulomb_nm) = match &scene.device {
            Device::Motor(motor) => {
                let resistance_ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
                let braking = motor.torque_constant_nm_per_a * motor.torque_constant_nm_per_a / resistance_ohm;
                (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad + braking, motor.coulomb_friction_nm)
            }
            Device::Mass(mass) => (mass.mass_kg, mass.damping_n_s_per_m, mass.coulomb_n),
        };
        Self {
            inertia_kg_m2,
            damping_nm_s_per_rad,
            coulomb_nm,
            quantum_rad: scene.encoder.count_rad(),
            period_s: scene.sample_period_s(),
            delay_s: scene.model.delay_s,
            wall_damping_nm_s_per_rad: scene.wall.damping_nm_s_per_rad,
        }
    }

    /// Mean age of the wall's force: `T/2 + t_d`.
    #[must_use]
    pub fn lag_s(&self) -> f64 {
        0.5 * self.period_s + self.delay_s
    }

    /// `f_c / Δ`.
    fn friction_of_a_quantum(&self) -> f64 {
        if self.quantum_rad > 0.0 { self.coulomb_nm / self.quantum_rad } else { f64::INFINITY }
    }

    /// Colgate and Schenkel: passive whatever passive hand holds it while `b > K (T/2 + t_d) + |B|`.
    ///
    /// With no delay, or a delay of whole samples and `B = 0`, that is necessary as well.
    #[must_use]
    pub fn colgate_schenkel(&self) -> f64 {
        (self.damping_nm_s_per_rad - self.wall_damping_nm_s_per_rad.abs()).max(0.0) / self.lag_s()
    }

    /// Abbott and Okamura: `K <= min(2 b/T, 2 f_c/Δ)`; both sides, that of sampling first.
    #[must_use]
    pub fn abbott_okamura(&self) -> (f64, f64) {
        (2.0 * self.damping_nm_s_per_rad / self.period_s, 2.0 * self.friction_of_a_quantum())
    }

    /// Diolaiti et al.: the stiffest passive wall, `β >= 1/2 + t_d/T` and `σ >= 1/2`; both sides, that of sampling
    /// first.
    #[must_use]
    pub fn diolaiti(&self) -> (f64, f64) {
        (self.damping_nm_s_per_rad / self.lag_s(), 2.0 * self.friction_of_a_quantum())
    }

    /// Where a stiffness above zero stands: `v T (1/2 + t_d/T - β) <= Δ (σ - 1/2)` is the balance of one sample.
    #[must_use]
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

    /// Gil and Hulin: `K < (b + b_h + B) / (T/2 + t_d)`, to first order in damping and delay.
    #[must_use]
    pub fn gil_hulin(&self, hand_damping_nm_s_per_rad: f64) -> f64 {
        let damping = self.damping_nm_s_per_rad + hand_damping_nm_s_per_rad + self.wall_damping_nm_s_per_rad;
        damping / self.lag_s()
    }

    /// The stiffest wall on which a body comes to rest that a constant effort `w > f_c` drops onto it.
    ///
    /// A contact lasts half a swing and multiplies the energy by `e^(π ω (T/2 + t_d))`; the way out and back by
    /// `(w - f_c)/(w + f_c)`. Both are equal at `K = m (ln((w + f_c)/(w - f_c)) / (π (T/2 + t_d)))²`. `None` for an
    /// effort that friction holds.
    #[must_use]
    pub fn drop_threshold(&self, effort_nm: f64) -> Option<f64> {
        let (more, less) = (effort_nm + self.coulomb_nm, effort_nm - self.coulomb_nm);
        let swing_rad_per_s = libm::log(more / less) / (PI * self.lag_s());
        (less > 0.0).then_some(self.inertia_kg_m2 * swing_rad_per_s * swing_rad_per_s)
    }
}
