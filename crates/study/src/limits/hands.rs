//! Published hands, shipped as `testbench/hands.toml`.

use hpu_cosim::figure;
use hpu_cosim::scene::{Device, Hand, Scene};
use toml_edit::{DocumentMut, Item};

use super::{Overrides, Unknown};
use crate::Error;

/// A published hand: a spring and a damper to ground.
#[derive(Clone, PartialEq, Debug)]
pub struct PublishedHand {
    /// Name of the hand: its grip and direction.
    pub name: String,
    /// Stiffness of the hand, in N/m.
    pub stiffness_n_per_m: f64,
    /// Damping of the hand, in N·s/m.
    pub damping_n_s_per_m: f64,
    /// Authors of the measurement, and the publication.
    pub source: String,
}

/// Returns the shipped hands.
///
/// # Panics
///
/// If the shipped file is not a list of hands.
pub fn published_hands() -> Vec<PublishedHand> {
    let text = hpu_assets::text("testbench/hands.toml");
    let document: DocumentMut = text.parse().expect("the shipped file is TOML");
    let hands = document["hand"].as_array_of_tables().expect("a list of hands");
    let text = |item: &Item| item.as_str().expect("a text").to_string();
    let real = |item: &Item| item.as_float().expect("a number");
    let hand = |table: &toml_edit::Table| PublishedHand {
        name: text(&table["name"]),
        stiffness_n_per_m: real(&table["stiffness_n_per_m"]),
        damping_n_s_per_m: real(&table["damping_n_s_per_m"]),
        source: text(&table["source"]),
    };
    hands.iter().map(hand).collect()
}

/// Returns the published hands for a scene: the box from no hand to the firmest, and each hand as overrides of the
/// scene.
///
/// A hand holds a motor's wheel at `lever_m` from its axis. At the shaft, the hand's stiffness and damping are
/// therefore multiplied by `(lever_m / ratio)²`, with the wheel's ratio. It holds a body of a network that turns at
/// that distance from its axis, too.
///
/// # Errors
///
/// Returns why the scene cannot take these hands: its hand is not a spring and damper, a motor's lever is missing, or a
/// lever is given for a mass.
pub fn hands_of(scene: &Scene, lever_m: Option<f64>) -> Result<(Vec<Unknown>, Vec<Overrides>), Error> {
    if !matches!(scene.hand, Hand::SpringDamper { .. }) {
        return Err("the scene's hand is no spring and damper on a path; write hand.kind = \"spring_damper\"".into());
    }
    // The turns of what the hand's keys are of for one turn of what it holds; none where it holds what slides.
    let turns = match (&scene.device, scene.network.as_deref()) {
        (_, Some(network)) => (!network.slides[network.network.grip]).then_some(1.0),
        (Device::Motor(motor), None) => Some(motor.wheel_ratio),
        (Device::Mass(_), None) => None,
    };
    let (square, stiffness_unit, damping_unit) = match (turns, lever_m) {
        (None, None) => (1.0, "N/m", "N.s/m"),
        (None, Some(_)) => return Err("a mass has no lever; write --hands alone".into()),
        (Some(_), None) => {
            return Err("a motor's wheel is held at some radius; write it, as in --hands 50mm".into());
        }
        (Some(turns), Some(lever_m)) => {
            let arm_m = lever_m / turns;
            (arm_m * arm_m, "N.m/rad", "N.m.s/rad")
        }
    };
    let with = |value: f64, unit: &str| format!("{} {unit}", figure(value * square));
    let hands = published_hands();
    let set = |hand: &PublishedHand| {
        let stiffness = ("hand.stiffness".to_string(), with(hand.stiffness_n_per_m, stiffness_unit));
        vec![stiffness, ("hand.damping".to_string(), with(hand.damping_n_s_per_m, damping_unit))]
    };
    let most = |of: fn(&PublishedHand) -> f64| hands.iter().map(of).fold(0.0, f64::max) * square;
    let side = |key: &str, most: f64, unit: &str| format!("{key}=0..{} {unit}", figure(most)).parse();
    let sides = vec![
        side("hand.stiffness", most(|hand| hand.stiffness_n_per_m), stiffness_unit)?,
        side("hand.damping", most(|hand| hand.damping_n_s_per_m), damping_unit)?,
    ];
    Ok((sides, hands.iter().map(set).collect()))
}
