//! On which side each criterion errs: the criterion's limit divided by the stiffness at which the scene as written, in
//! fixed-point words, ceases to settle.
//!
//! This comparison is not from a paper. The devices are those that the papers describe or assume, each with its
//! quantisation, its friction and its hand. A ratio above one means that the criterion calls a loop stable that is not;
//! a ratio below one means that it forbids a loop that settles.

use std::num::NonZeroUsize;
use std::sync::{Arc, OnceLock};

use hpu_cosim::scene::{Experiment, Scene};

use super::beside::{Comparison, Line, Measure, shipped_scene};
use crate::limits::{Limits, Looks, WordsSet, limits, usual_range};

/// A device: its heading, the shipped scene, and the overrides of that scene.
type Device = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const DEVICES: [Device; 5] = [
    (
        "Motor of Vasudevan et al. 2007 (data assumed), sampled at 1 kHz, pressed by a hand",
        "conventional-wall-1khz",
        &[("wall.damping", "0")],
    ),
    (
        "The same with 1.2 mN.m of friction",
        "conventional-wall-1khz",
        &[("wall.damping", "0"), ("device.coulomb_friction", "1.2 mN.m")],
    ),
    ("The same, hybrid: the spring is not sampled", "hybrid-wall", &[("wall.damping", "0")]),
    (
        "A PHANToM as a mass of 90 g, b and friction after Diolaiti et al. 2006, dropped by 0.15 N",
        "rail-drop",
        &[("method.stiffness_format", "(0,14,10)")],
    ),
    ("An Impulse Engine's axis (data inferred), pushed by 2 N", "impulse-engine", &[]),
];

/// Criteria that apply to at least one of the devices.
const CRITERIA: [&str; 9] = [
    "spectral_radius",
    "routh",
    "low_frequency",
    "gil_hulin",
    "colgate_schenkel",
    "abbott_okamura",
    "diolaiti",
    "describing_function",
    "drop_threshold",
];

/// Returns the comparison: a line for each criterion and device.
#[must_use]
pub fn comparison() -> Comparison {
    let mut lines = Vec::new();
    for (group, name, set) in DEVICES {
        let of = Arc::new(OnceLock::new());
        lines.push(Line {
            group,
            what: "in words".into(),
            published: "",
            claims: "",
            measure: measure(&of, name, set, in_words),
        });
        for criterion in CRITERIA {
            let told = move |limits: &Limits| told(limits, criterion);
            lines.push(Line {
                group,
                what: criterion.into(),
                published: "",
                claims: "",
                measure: measure(&of, name, set, told),
            });
        }
    }
    Comparison {
        name: "criteria",
        title: "Criteria of stability against the emulator, in words, with friction, hand and contact",
        lines,
        claims: Vec::new(),
        notes: &[
            "A criterion whose limit is above the lowest stiffness that was seen to fail calls stable what is not. In words: a grid of \
             stiffnesses down to 0.5 % where neighbours differ, eight phases of the contact each.",
            "A criterion's assumptions are told by `hpu limits` for each scene; `!` marks those of which one or more is not met.",
        ],
    }
}

/// Returns a measurement; the limits that all lines of a device share are computed once.
fn measure(
    of: &Arc<OnceLock<Result<Limits, String>>>,
    name: &'static str,
    set: &'static [(&'static str, &'static str)],
    tell: impl Fn(&Limits) -> String + Sync + 'static,
) -> Measure {
    let of = Arc::clone(of);
    Box::new(move |control| {
        let found = of.get_or_init(|| {
            scene(name, set).map(|scene| {
                let range = usual_range(&scene);
                limits(&scene, range, || {
                    WordsSet::new(std::slice::from_ref(&scene), range, Looks::BRIEF, NonZeroUsize::MIN, control)
                })
            })
        });
        Some(found.as_ref().map(|limits| tell(limits).into()).map_err(String::clone))
    })
}

fn scene(name: &str, set: &[(&str, &str)]) -> Result<Scene, String> {
    match shipped_scene(name, set)? {
        Experiment::Axis(scene) => Ok(scene),
        Experiment::Phantom(_) | Experiment::Dut(_) => Err(format!("{name} is no axis")),
    }
}

fn in_words(limits: &Limits) -> String {
    match &limits.in_words {
        Ok(words) => words.turn(),
        Err(why) => why.clone(),
    }
}

fn told(limits: &Limits, name: &str) -> String {
    if let Some(criterion) = limits.criteria.iter().find(|criterion| criterion.name == name) {
        let mark = if criterion.assumptions_met() { ' ' } else { '!' };
        let over = match &limits.in_words {
            Ok(words) => format!(", {}", words.against(criterion.limit)),
            Err(_) => String::new(),
        };
        return format!("{mark} {:.5} {}{over}", criterion.limit, criterion.unit);
    }
    let silent = limits.silent.iter().find(|silent| silent.name == name);
    silent.map_or("says nothing of it".into(), |silent| format!("silent: {}", silent.why))
}
