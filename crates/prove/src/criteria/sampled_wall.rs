//! Criteria for a rigid body in contact with a sampled wall, applied to a scene; [`Rigid`] computes their numbers.

use hpu_cosim::figure;
use hpu_cosim::scene::{Datapath, Hand, Scene};

use super::{
    Assumption, Criterion, Figure, Rigid, Silent, frictionless, ideal_drive, in_counts, is_small, known_hand,
    known_hand_for, linear_law, sampled, sampled_for, speed_unit, undamped_wall, undelayed, waited,
};
use crate::linear::unit;

fn criterion<const N: usize>(name: &'static str, scene: &Scene, limit: f64, others: [Assumption; N]) -> Criterion {
    let assumptions = [sampled(scene), ideal_drive(scene)].into_iter().chain(others).collect();
    Criterion { name, limit, unit: unit(scene), speaks: sampled(scene).met, assumptions, figures: vec![], region: None }
}

/// Gil and Hulin: stable to first order.
pub(super) fn gil_hulin(scene: &Scene, body: &Rigid) -> Criterion {
    let (grip, grip_damping) = scene.hand.grip();
    let damping = body.damping_nm_s_per_rad + grip_damping + body.wall_damping_nm_s_per_rad;
    let late_s = body.period_s + body.delay_s;
    // Damping, delay and the hand's stiffness enter to first order only: one per cent at a hundredth.
    let large = (damping * late_s).max(grip * late_s * late_s) / body.inertia_kg_m2;
    let others = [
        Assumption::new("(b + b_h + B) (T + t_d) and k_h (T + t_d)^2 below m/100", large < 0.01, || {
            format!("the greater is {} times m", figure(large))
        }),
        linear_law(scene),
        frictionless(scene),
        known_hand(scene),
    ];
    criterion("gil_hulin", scene, body.gil_hulin(grip_damping), others)
}

/// Colgate and Schenkel: passive with any hand.
pub(super) fn colgate_schenkel(scene: &Scene, body: &Rigid) -> Criterion {
    let delay = scene.clock.edges(body.delay_s);
    let exact = is_small(body.delay_s, scene)
        || (delay.is_multiple_of(scene.period_clocks()) && body.wall_damping_nm_s_per_rad == 0.0);
    let others = [
        Assumption::new("no delay, or one of whole samples and a wall without damping", exact, || waited(scene)),
        linear_law(scene),
        frictionless(scene),
        known_hand_for("the worst of all passive hands: any other allows more", scene),
    ];
    criterion("colgate_schenkel", scene, body.colgate_schenkel(), others)
}

/// Abbott and Okamura: passive in spite of the quantum.
pub(super) fn abbott_okamura(scene: &Scene, body: &Rigid) -> Criterion {
    let (sampling, quantum) = body.abbott_okamura();
    let others = [undelayed(scene), undamped_wall(scene), in_counts(scene), known_hand(scene)];
    let figures = vec![
        Figure { name: "2b/T", value: sampling, unit: unit(scene) },
        Figure { name: "2f_c/quantum", value: quantum, unit: unit(scene) },
    ];
    criterion("abbott_okamura", scene, sampling.min(quantum), others).with(figures)
}

/// Diolaiti et al.: the regions of behaviour.
pub(super) fn diolaiti(scene: &Scene, body: &Rigid) -> Criterion {
    let (sampling, quantum) = body.diolaiti();
    let others = [
        undamped_wall(scene),
        in_counts(scene),
        sampled_for("a constant speed within a sample", scene),
        known_hand(scene),
    ];
    let plain = criterion("diolaiti", scene, sampling.min(quantum), others);
    let stiffness = scene.wall.stiffness_nm_per_rad;
    if stiffness == 0.0 {
        return plain;
    }
    let balance = body.balance(stiffness);
    let mut figures = vec![
        Figure { name: "beta", value: balance.beta, unit: "" },
        Figure { name: "sigma", value: balance.sigma, unit: "" },
    ];
    let unit = speed_unit(&scene.device.units());
    figures.extend(balance.critical_rad_per_s.map(|value| Figure { name: "v_c", value, unit }));
    Criterion { region: Some(balance.region), ..plain }.with(figures)
}

/// The drop threshold: at rest after a fall.
pub(super) fn drop_threshold(scene: &Scene, body: &Rigid) -> Result<Criterion, Silent> {
    let silent = |why: &str| Err(Silent { name: "drop_threshold", why: why.into() });
    let Hand::ConstantTorque { torque_nm } = scene.hand else {
        return silent("no constant effort presses the device into the wall");
    };
    if body.coulomb_nm == 0.0 {
        return silent("without Coulomb friction the fall loses nothing outside the wall");
    }
    let Some(limit) = body.drop_threshold(torque_nm) else {
        return silent("Coulomb friction holds the device against the constant effort");
    };
    let others = [
        undamped_wall(scene),
        Assumption::new("a wall that only pushes", scene.model.datapath != Datapath::Linear, || {
            "the linear law pulls too".to_string()
        }),
        Assumption::new(
            "viscous damping below a hundredth of K (T/2 + t_d)",
            body.damping_nm_s_per_rad < 0.01 * limit * body.lag_s(),
            || format!("{} of it", figure(body.damping_nm_s_per_rad / (limit * body.lag_s()))),
        ),
        Assumption::new("a rest deeper than a count: w/K above it", torque_nm / limit > body.quantum_rad, || {
            format!("{} of a count", figure(torque_nm / limit / body.quantum_rad))
        }),
    ];
    Ok(criterion("drop_threshold", scene, limit, others))
}
