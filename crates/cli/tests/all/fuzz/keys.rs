//! Learns the keys of a scene, their ranges and their choices from the scene's own error messages.

use std::collections::BTreeMap;

use hpu_cosim::scene::{Experiment, Shipped};

/// A key and the values that it accepts.
#[derive(Clone, Debug)]
pub struct Key {
    pub path: String,
    pub takes: Takes,
}

/// The values that a key accepts.
#[derive(Clone, Debug)]
pub enum Takes {
    /// A quantity: whether 0 is accepted, and the least and the greatest size. If the least is not above 0, both signs
    /// are accepted.
    Size { zero: bool, least: f64, most: f64 },
    /// A whole number.
    Whole(u64, u64),
    /// One of these.
    Choice(Vec<String>),
    /// The format of a gain.
    Format,
}

/// Overrides, in order.
pub type Set = Vec<(String, String)>;

/// Returns the scene under these overrides, or the error.
pub fn parsed(scene: &Shipped, set: &Set) -> Result<Experiment, String> {
    scene.parse(set).map_err(|error| error.to_string())
}

/// Returns every key that a scene accepts.
pub fn keys(scene: &Shipped) -> Vec<Key> {
    let mut found = BTreeMap::new();
    section(scene, "", &mut found);
    found.into_iter().map(|(path, takes)| Key { path, takes }).collect()
}

fn section(scene: &Shipped, path: &str, found: &mut BTreeMap<String, Takes>) {
    let below = |key: &str| if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
    let refuse = |key: String, value: &str| scene.parse(&[(key, value.into())]).err().map(|error| error.to_string());
    let Some(said) = refuse(below("zzz"), "1") else { return };
    let Some((_, names)) = said.split_once("accepted here: ") else { return };
    for name in names.split(", ").filter(|name| !["about", "expect", "kind", "path", "file"].contains(name)) {
        let Some(said) = refuse(below(name), "1e99") else { continue };
        if said.contains("a section is expected") {
            section(scene, &below(name), found);
        } else if let Some(takes) = takes(&said) {
            found.insert(below(name), takes);
        }
    }
}

/// Reads the accepted values from the error for 1e99.
fn takes(said: &str) -> Option<Takes> {
    if let Some((_, range)) = said.split_once("; accepted: ") {
        let (zero, range) = range.strip_prefix("0, or ").map_or((false, range), |range| (true, range));
        let (least, most) = range.split_once(" to ")?;
        let most = most.split(' ').next()?.parse().ok()?;
        return Some(Takes::Size { zero, least: least.parse().ok()?, most });
    }
    if let Some((_, range)) = said.split_once("is not a whole number from ") {
        let (least, most) = range.split_once(" to ")?;
        return Some(Takes::Whole(least.parse().ok()?, most.parse().ok()?));
    }
    if let Some((_, names)) = said.split_once(" is none of ") {
        return Some(Takes::Choice(names.split(", ").map(|name| name.trim_matches('"').to_string()).collect()));
    }
    if said.contains("is not true or false") {
        return Some(Takes::Choice(vec!["true".into(), "false".into()]));
    }
    said.contains("is not a format").then_some(Takes::Format)
}

impl Takes {
    /// Returns a value at one of the ends (`how` 0 and 1), or at the share `at` of the way between them.
    pub fn value(&self, how: u8, at: f64) -> String {
        let share = match how {
            0 => 0.0,
            1 => 1.0,
            _ => at,
        };
        match self {
            Self::Size { zero: true, .. } if how == 2 => "0".into(),
            Self::Size { least, most, .. } if *least > 0.0 => {
                let value = least.ln() + share * (most.ln() - least.ln());
                format!("{:e}", [*least, *most, value.exp()][usize::from(how.min(2))])
            }
            // Values of either sign, whose sizes span fifteen decades.
            Self::Size { most, .. } => {
                let size = most * 10f64.powf(-15.0 * (2.0 * share - 1.0).abs());
                let size = if how < 2 { *most } else { size };
                format!("{:e}", if share < 0.5 { -size } else { size })
            }
            Self::Whole(least, most) => {
                let value = (*least as f64).max(0.5).ln();
                let value = (value + share * ((*most as f64).ln() - value)).exp().round() as u64;
                [*least, *most, value.clamp(*least, *most)][usize::from(how.min(2))].to_string()
            }
            Self::Choice(names) => names[(at * names.len() as f64) as usize % names.len()].clone(),
            Self::Format => {
                let width = 2 + (at * 30.0) as i32;
                let frac = if how == 0 { 0 } else { (at * 7919.0) as i32 % (width + 8) };
                format!("(0,{},{frac})", width - frac)
            }
        }
    }
}
