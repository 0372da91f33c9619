//! A method of a map: a label and its overrides of the scene.

use std::str::FromStr;

use hpu_cosim::figure;
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
    type Err = String;

    /// Reads `LABEL:KEY=VALUE,KEY=VALUE`; a comma within brackets or quotes does not separate.
    fn from_str(text: &str) -> Result<Self, String> {
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
        Ok(Self { label: label.trim().to_string(), set: changes.map(pair).collect::<Result<_, String>>()? })
    }
}

impl Method {
    /// Returns every method that a scene's device can run. The constants are the largest that the device's own damping
    /// `b` keeps passive at the scene's sample rate: energy bounding by `c = b/T`, and a coupling of `b/T` to a rigid
    /// wall. All methods are sampled at that rate, except for the hybrid loop's spring. Dual rate takes the velocity
    /// every tenth sample.
    #[must_use]
    pub fn all(scene: &Scene) -> Vec<Self> {
        let period_s = scene.sample_period_s();
        let (damping, unit) = match &scene.device {
            Device::Motor(motor) => {
                let resistance_ohm = motor.resistance_ohm + 2.0 * scene.bridge.on_resistance_ohm;
                let k = motor.torque_constant_nm_per_a;
                (motor.viscous_friction_nm_s_per_rad + k * k / resistance_ohm, "N.m/rad")
            }
            Device::Mass(mass) => (mass.damping_n_s_per_m, "N/m"),
        };
        let c = format!("{} {unit}", figure(damping / period_s));
        let method = |label: &str, kind: &str, set: &[(&str, &str)]| {
            let kind = [("method.kind", kind)];
            let set = kind.iter().chain(set).map(|(key, value)| (key.to_string(), value.to_string())).collect();
            Self { label: label.into(), set }
        };
        let mut all = vec![
            method("conventional", "conventional", &[]),
            method("hybrid", "hybrid", &[]),
            method("dual rate", "sampled_wall", &[("method.velocity_every", "10")]),
            method("FOAW", "sampled_wall", &[("method.estimator", "foaw")]),
            method("input shaper", "sampled_wall", &[("method.shaper.cutoff", "2.5 Hz")]),
            method("PO/PC", "passivity_controller", &[]),
            method("PO/PC, held force", "passivity_controller", &[("method.observer", "held_force")]),
            method("passive spring", "passive_spring", &[]),
        ];
        if damping > 0.0 {
            let rigid = ("method.rigid", "true");
            all.extend([
                method("coupling b/T", "virtual_coupling", &[("method.coupling_stiffness", &c), rigid]),
                method("energy bounding", "energy_bounding", &[("method.c1", &c)]),
                method("force bound", "energy_bounding", &[("method.form", "force_bound"), ("method.c1", &c)]),
            ]);
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
