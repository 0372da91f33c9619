//! Criteria for the stability of the linear loop.

use hpu_cosim::figure;
use hpu_cosim::scene::{Device, Motor, Scene};

use super::{
    Assumption, Criterion, Silent, continuous, critical, frictionless, known_hand, linear_law, prompt, sampled,
    undamped_wall_for, undelayed,
};
use crate::linear::unit;
use crate::waits::delay_s;

/// All eigenvalues of the map from one sample to the next lie within the unit circle, with the hand and the linear
/// law's delay; the drive is ideal.
pub(super) fn spectral_radius(scene: &Scene) -> Result<Criterion, Silent> {
    let name = "spectral_radius";
    let limit =
        critical(scene, scene.wall.damping_nm_s_per_rad).map_err(|why| Silent { name, why: why.to_string() })?;
    Ok(Criterion {
        name,
        limit,
        unit: unit(scene),
        speaks: true,
        assumptions: vec![linear_law(scene), prompt(scene), frictionless(scene), known_hand(scene)],
        figures: vec![],
        region: None,
    })
}

fn resistance_ohm(scene: &Scene, motor: &Motor) -> f64 {
    motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm
}

/// Refuses a network that is no motor on a bridge: these two criteria are of a rigid shaft with a winding.
fn wound(name: &'static str, scene: &Scene) -> Result<(), Silent> {
    let Some(network) = scene.network.as_deref() else { return Ok(()) };
    let unlike = network.bends().or_else(|| network.springs()).or_else(|| match &scene.device {
        Device::Motor(_) if network.dac.is_none() => None,
        Device::Motor(_) => Some("a current drives it, and no voltage".to_string()),
        Device::Mass(_) => Some("it slides".to_string()),
    });
    unlike.map_or(Ok(()), |why| {
        let why = format!("not met: the criterion is one of a rigid motor on its bridge; here: {why}");
        Err(Silent { name, why })
    })
}

/// Routh and Hurwitz on `L J s³ + (R J + L D) s² + (R D + K² + R b + L k_h) s + R (k + k_h)`, with `D = B + b_h`.
pub(super) fn routh(scene: &Scene) -> Result<Criterion, Silent> {
    wound("routh", scene)?;
    let Device::Motor(motor) = &scene.device else {
        let why = "a mass, a spring and a damper without sampling settle at every stiffness".into();
        return Err(Silent { name: "routh", why });
    };
    let (r, l, k) = (resistance_ohm(scene, motor), motor.inductance_h, motor.torque_constant_nm_per_a);
    let (grip, grip_damping) = scene.hand.grip();
    let (j, b) = (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad + grip_damping);
    let braking = r * b + k * k + r * scene.wall.damping_nm_s_per_rad + l * grip;
    Ok(Criterion {
        name: "routh",
        limit: (r * j + l * b) * braking / (l * j * r) - grip,
        unit: unit(scene),
        speaks: continuous(scene).met,
        assumptions: vec![
            continuous(scene),
            undamped_wall_for("a wall without damping: sampled damping lowers the limit", scene),
            linear_law(scene),
            undelayed(scene),
            frictionless(scene),
            known_hand(scene),
        ],
        figures: vec![],
        region: None,
    })
}

/// Damping over lag: `k < (B + K²/R + b + b_h) / (T/2 + t_d + L/R)`.
pub(super) fn low_frequency(scene: &Scene, motor: &Motor) -> Result<Criterion, Silent> {
    wound("low_frequency", scene)?;
    let (r, k) = (resistance_ohm(scene, motor), motor.torque_constant_nm_per_a);
    let (grip, grip_damping) = scene.hand.grip();
    let lag_s = 0.5 * scene.sample_period_s() + delay_s(scene) + motor.inductance_h / r;
    let own = motor.viscous_friction_nm_s_per_rad + k * k / r;
    let limit = (own + grip_damping + scene.wall.damping_nm_s_per_rad) / lag_s;
    let swing = ((limit + grip) / motor.inertia_kg_m2()).sqrt() * lag_s;
    Ok(Criterion {
        name: "low_frequency",
        limit,
        unit: unit(scene),
        speaks: sampled(scene).met,
        assumptions: vec![
            sampled(scene),
            // The criterion leaves out terms of second order in swing rate times lag: one per cent at a tenth.
            Assumption::new(
                "swings slow against sampling, delay and winding: sqrt((k + k_h)/J) (T/2 + t_d + L/R) below 0.1",
                swing < 0.1,
                || figure(swing),
            ),
            linear_law(scene),
            frictionless(scene),
            known_hand(scene),
        ],
        figures: vec![],
        region: None,
    })
}
