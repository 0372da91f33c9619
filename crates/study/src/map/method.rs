//! A method of a map: a label and its overrides of the scene.

use std::str::FromStr;

use crate::Error;
use hpu_cosim::figure;
use hpu_cosim::method::{Layer, PASSIVE, layers};
use hpu_cosim::scene::{Device, Scene};

/// A layer of a map.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Method {
    /// Label of the method.
    pub label: String,
    /// Overrides of the scene.
    pub set: Vec<(String, String)>,
}

impl FromStr for Method {
    type Err = Error;

    /// Reads `LABEL:KEY=VALUE,KEY=VALUE`; a comma within brackets or quotes does not separate.
    fn from_str(text: &str) -> Result<Self, Error> {
        const SYNTAX: &str =
            "write LABEL:KEY=VALUE,KEY=VALUE, as in 1khz:method.kind=conventional,method.sample_rate='1 kHz'";
        let (label, changes) = text.split_once(':').unwrap_or((text, ""));
        if label.trim().is_empty() || label.contains('=') {
            return Err(SYNTAX.into());
        }
        let pair = |change: &str| {
            let (key, value) = change.split_once('=').ok_or(SYNTAX)?;
            Ok((key.trim().to_string(), value.trim().to_string()))
        };
        let changes = parts(changes).into_iter().filter(|change| !change.trim().is_empty());
        Ok(Self { label: label.trim().to_string(), set: changes.map(pair).collect::<Result<_, Error>>()? })
    }
}

impl Method {
    /// Returns every method that a scene's device can run: the two loops, the laws without constants, then the laws
    /// whose constants are the largest that the device's own damping `b` keeps passive at the scene's sample rate, as
    /// `b/T`. All methods are sampled at that rate, except for the hybrid loop's spring.
    pub fn all(scene: &Scene) -> Vec<Self> {
        let period_s = scene.sample_period_s();
        let has_bridge = scene.network.as_ref().is_none_or(|network| network.dac.is_none());
        let (damping, unit) = match &scene.device {
            Device::Motor(motor) if !has_bridge => (motor.viscous_friction_nm_s_per_rad, "N.m/rad"),
            Device::Motor(motor) => {
                let resistance_ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
                let k = motor.torque_constant_nm_per_a;
                (motor.viscous_friction_nm_s_per_rad + k * k / resistance_ohm, "N.m/rad")
            }
            Device::Mass(mass) => (mass.damping_n_s_per_m, "N/m"),
        };
        let passive = format!("{} {unit}", figure(damping / period_s));
        let method = |(kind, layer): (&str, &Layer)| {
            let value = |value: &str| if value == PASSIVE { passive.clone() } else { value.to_string() };
            let kind = ("method.kind".to_string(), kind.to_string());
            let set = layer.set.iter().map(|(key, set)| (key.to_string(), value(set)));
            Self { label: layer.label.into(), set: [kind].into_iter().chain(set).collect() }
        };
        let has_constant = |(_, layer): &(&str, &Layer)| layer.set.iter().any(|(_, value)| *value == PASSIVE);
        let (constant, plain): (Vec<_>, Vec<_>) = layers().partition(has_constant);
        let mut all: Vec<_> =
            ["conventional", "hybrid"].map(|kind| method((kind, &Layer { label: kind, set: &[] }))).into();
        all.extend(plain.into_iter().map(method));
        if damping > 0.0 {
            all.extend(constant.into_iter().map(method));
        }
        all
    }
}

/// Splits a text at the commas that are in no brackets and no quotes.
fn parts(text: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quoted) = (Vec::new(), 0, 0, false);
    for (at, letter) in text.char_indices() {
        match letter {
            '"' => quoted = !quoted,
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 && !quoted => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}
