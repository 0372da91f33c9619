//! The models of an arm that leave something out: for races of accuracy against speed, and for fits.

use super::{Law, Model, Scene};
use crate::accuracy::{Contestant, SOLVERS, Variant, rungs};
use crate::fit::Simplifications;

/// Returns the places and stiffnesses of the walls of the neighbouring scenes.
pub(super) fn around(scene: &Scene) -> Vec<(&'static str, f64)> {
    let (k, distance) = (scene.room.stiffness_n_per_m, scene.room.distance_m);
    let stiffness = [0.95, 1.05].map(|share| ("room.stiffness", share * k));
    let places = [-5.3, -1.6, 0.7, 3.7].map(|counts| ("room.distance", distance + counts * 29e-6));
    stiffness.into_iter().chain(places).collect()
}

pub(super) fn contestants(scene: &Scene) -> Vec<Contestant> {
    let model = &scene.model;
    let host = scene.platform.is_host();
    let plainest = Model {
        law: Law::Ideal,
        tested_joint_only: true,
        friction: false,
        delay_samples: 0.0,
        latency_s: 0.0,
        amplifier_lag_s: 0.0,
        transmission_n_per_m: 0.0,
        ..*model
    };
    let parts = [
        // A host's law is already in floats.
        ("law", Model { law: if host { model.law } else { Law::Floats }, ..*model }),
        ("ideal", Model { law: Law::Ideal, ..*model }),
        ("one-joint", Model { tested_joint_only: true, ..*model }),
        ("frictionless", Model { friction: false, ..*model }),
        ("undelayed", Model { delay_samples: if host { 0.0 } else { model.delay_samples }, ..*model }),
        ("no-latency", Model { latency_s: 0.0, ..*model }),
        ("no-lag", Model { amplifier_lag_s: 0.0, ..*model }),
        ("rigid", Model { transmission_n_per_m: 0.0, ..*model }),
        ("one-joint+rigid", Model { tested_joint_only: true, transmission_n_per_m: 0.0, ..*model }),
        (
            "ideal+one-joint+rigid",
            Model { amplifier_lag_s: model.amplifier_lag_s, friction: model.friction, ..plainest },
        ),
        ("plainest", plainest),
    ];
    let mut known = vec![*model];
    let mut all = Vec::new();
    for (name, simpler) in parts {
        if !known.contains(&simpler) {
            known.push(simpler);
            let all_of_it = in_toml(&simpler);
            all.push(Contestant::new(name, &[("model", &all_of_it)]));
        }
    }
    // A host's samples end the steps of a law without a clock; an FPGA's law follows the arm within a step.
    let most_s = if host { scene.sample_period_s() } else { 1e-3 };
    let ladder = rungs(1e-6, most_s);
    let mut variants = vec![Variant::new("", &[])];
    if model.law == Law::Words {
        variants.push(Variant::new("+law", &[("model.law", Law::Floats.name())]));
    }
    for (variant, solver) in variants.iter().flat_map(|variant| SOLVERS.map(|solver| (variant, solver))) {
        all.extend(ladder.iter().map(|step_s| Contestant::solver(solver, Some(*step_s), variant)));
    }
    all
}

/// Returns the whole section, because some of its keys are refused beside others.
fn in_toml(model: &Model) -> String {
    let law = model.law.name();
    let joints = if model.tested_joint_only { "tested" } else { "all" };
    let mut text = format!(
        "{{ law = \"{law}\", joints = \"{joints}\", friction = {}, delay = {:?}, latency = {:?}, amplifier_lag = {:?}",
        model.friction, model.delay_samples, model.latency_s, model.amplifier_lag_s
    );
    if model.transmission_n_per_m > 0.0 {
        text += &format!(
            ", transmission_stiffness = {:?}, transmission_damping = {:?}, motor_share = {:?}",
            model.transmission_n_per_m, model.transmission_n_s_per_m, model.motor_share
        );
    }
    text + " }"
}

pub(super) fn simplifications(scene: &Scene) -> Simplifications {
    let mut list = Simplifications::default();
    let model = &scene.model;
    if model.transmission_n_per_m > 0.0 {
        list.add("the transmission's flexibility", 4, &[("model.transmission_stiffness", "0")], &[]);
    }
    if model.amplifier_lag_s > 0.0 {
        list.add("the amplifier's lag", 2, &[("model.amplifier_lag", "0")], &[]);
    }
    if model.friction {
        list.add("friction", 3, &[("model.friction", "false")], &[]);
    }
    if !model.tested_joint_only {
        list.add("the joints that are not under test", 3, &[("model.joints", "tested")], &[]);
    }
    if model.solver.is_exact() {
        // A host's samples end steps; an FPGA's law follows the arm within a step.
        let most_s = if scene.platform.is_host() { scene.sample_period_s() } else { f64::INFINITY };
        let (mut set, mut words) = (vec![("model.solver", "rk4")], "");
        if model.law == Law::Words {
            set.push(("model.law", "floats"));
            words = if scene.platform.is_host() { "the FPGA's clock, and " } else { "the words of the datapath, and " };
        }
        let what = |step: &str| format!("{words}what happens within steps of {step} (Runge-Kutta)");
        list.ladder(&(4.0 * scene.clock.period_s()..=most_s), what, &set, &[], &mut Vec::new());
    }
    list
}
