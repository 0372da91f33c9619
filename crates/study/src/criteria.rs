//! The published criteria of a wall's stability, as far as they speak of a scene's device.

use hpu_cosim::scene::{Device, Loop, Mass, Motor, Scene};

use crate::limits::{Criterion, LimitsError, bisect, unit};
use crate::sampled::SampledLoop;

/// Every criterion that speaks of the scene; `start` is a stiffness to search from.
pub(crate) fn all(scene: &Scene, start: f64) -> Result<Vec<Criterion>, LimitsError> {
    let mut criteria = vec![spectral_radius(scene, start)?];
    match &scene.device {
        Device::Motor(motor) if scene.method.kind == Loop::Hybrid => criteria.push(routh(scene, motor)),
        Device::Motor(motor) => criteria.push(low_frequency(scene, motor)),
        Device::Mass(mass) => criteria.extend([colgate_schenkel(scene, mass), gil_hulin(scene, mass)]),
    }
    Ok(criteria)
}

/// The eigenvalues of the map from one sample to the next, within the unit circle.
fn spectral_radius(scene: &Scene, start: f64) -> Result<Criterion, LimitsError> {
    let (low, high) =
        bisect(start, 1e-12, |stiffness| Some(SampledLoop::new(scene, stiffness).spectral_radius() < 1.0))?;
    Ok(Criterion {
        name: "spectral_radius",
        limit: 0.5 * (low + high),
        unit: unit(scene),
        assumptions_met: true,
        assumptions: "linear loop with bilateral contact; exact for it",
    })
}

fn resistance_ohm(scene: &Scene, motor: &Motor) -> f64 {
    motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm
}

/// Routh and Hurwitz on `L J s³ + (R J + L B) s² + (R B + K² + R b) s + R k`.
fn routh(scene: &Scene, motor: &Motor) -> Criterion {
    let (r, l, k) = (resistance_ohm(scene, motor), motor.inductance_h, motor.torque_constant_nm_per_a);
    let (j, b) = (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad);
    let damping = scene.wall.damping_nm_s_per_rad;
    Criterion {
        name: "routh",
        limit: (r * j + l * b) * (r * b + k * k + r * damping) / (l * j * r),
        unit: unit(scene),
        assumptions_met: damping == 0.0,
        assumptions: "spring and damping continuous; a sampled damping lowers the limit; exact without damping",
    }
}

/// Damping over lag: `k < (B + K²/R + b) / (T/2 + t_d + L/R)`.
fn low_frequency(scene: &Scene, motor: &Motor) -> Criterion {
    let (r, k) = (resistance_ohm(scene, motor), motor.torque_constant_nm_per_a);
    let lag_s = 0.5 * scene.sample_period_s() + scene.model.delay_s + motor.inductance_h / r;
    let damping = motor.viscous_friction_nm_s_per_rad + k * k / r + scene.wall.damping_nm_s_per_rad;
    let limit = damping / lag_s;
    Criterion {
        name: "low_frequency",
        limit,
        unit: unit(scene),
        // It leaves out terms of second order in swing rate times lag: one per cent at a tenth.
        assumptions_met: (limit / motor.inertia_kg_m2()).sqrt() * lag_s < 0.1,
        assumptions: "swings slow against sampling, delay and winding: sqrt(k/J) (T/2 + t_d + L/R) below 0.1",
    }
}

/// Passive against every passive hand: `b > K T/2 + |B|`.
fn colgate_schenkel(scene: &Scene, mass: &Mass) -> Criterion {
    let damping = scene.wall.damping_nm_s_per_rad;
    Criterion {
        name: "colgate_schenkel",
        limit: 2.0 * (mass.damping_n_s_per_m - damping.abs()).max(0.0) / scene.sample_period_s(),
        unit: unit(scene),
        assumptions_met: sampled(scene) && scene.model.delay_s == 0.0,
        assumptions: "spring and damping sampled and held, no delay; passive with any hand, so below the limit of stability",
    }
}

/// `K < (b + B) / (T/2 + t_d)`.
fn gil_hulin(scene: &Scene, mass: &Mass) -> Criterion {
    let damping = mass.damping_n_s_per_m + scene.wall.damping_nm_s_per_rad;
    let (period_s, delay_s) = (scene.sample_period_s(), scene.model.delay_s);
    Criterion {
        name: "gil_hulin",
        limit: damping / (0.5 * period_s + delay_s),
        unit: unit(scene),
        // Both damping and delay enter to first order only: one per cent at a hundredth.
        assumptions_met: sampled(scene) && damping * (period_s + delay_s) < 0.01 * mass.mass_kg,
        assumptions: "spring and damping sampled and held; (b + B) (T + t_d) below m/100",
    }
}

fn sampled(scene: &Scene) -> bool {
    scene.method.kind == Loop::Conventional
}
