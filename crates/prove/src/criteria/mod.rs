//! The published criteria for the stability of a wall, and those of a switched [`touch`].
//!
//! Each criterion is reported for every scene that has the numbers it needs, with its assumptions and whether the scene
//! meets them. If a scene lacks such a number (no Coulomb friction, no winding), that is reported instead.

mod describing;
mod linear;
mod rigid;
mod sampled_wall;
pub mod touch;

pub use describing::{describing_function, stable_amplitude};
pub use rigid::{Balance, Region, Rigid};

use hpu_cosim::figure;
use hpu_cosim::scene::{Datapath, Device, Hand, Loop, Scene, Units};
use serde::Serialize;

use crate::Error;
use crate::linear::{Damping, StableSet, Stretch, usual_range};
use crate::waits::{delay_s, waits};

/// A criterion's answer for a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Criterion {
    /// Name of the criterion.
    pub name: &'static str,
    /// The greatest stiffness that the criterion allows.
    pub limit: f64,
    /// Unit of the limit.
    pub unit: &'static str,
    /// Whether the criterion applies to loops of this kind: to sampled springs, or to springs that are not sampled.
    pub speaks: bool,
    /// The assumptions of the criterion.
    pub assumptions: Vec<Assumption>,
    /// Further numbers of the criterion, at the scene's own stiffness.
    pub figures: Vec<Figure>,
    /// The region of behaviour that the scene's own stiffness is in, if the criterion distinguishes more than two.
    pub region: Option<Region>,
}

impl Criterion {
    /// Returns the criterion with those of these figures that are finite; without a quantum some are not.
    fn with(mut self, figures: Vec<Figure>) -> Self {
        self.figures = figures.into_iter().filter(|figure| figure.value.is_finite()).collect();
        self
    }

    /// Returns the criterion in the units of another body, of which one of its own units is `ratio`.
    #[must_use]
    pub fn in_units(self, ratio: f64, units: &Units) -> Self {
        let told = |figure: Figure| match figure.unit {
            unit if unit == self.unit => {
                Figure { value: figure.value / (ratio * ratio), unit: units.stiffness, ..figure }
            }
            "rad/s" | "m/s" => Figure { value: figure.value * ratio.abs(), unit: speed_unit(units), ..figure },
            _ => figure,
        };
        let figures = self.figures.iter().copied().map(told).collect();
        Self { limit: self.limit / (ratio * ratio), unit: units.stiffness, figures, ..self }
    }

    /// Whether the scene meets all assumptions of the criterion.
    pub fn assumptions_met(&self) -> bool {
        self.met() == self.assumptions.len()
    }

    /// Returns how many assumptions of the criterion the scene meets.
    pub fn met(&self) -> usize {
        self.assumptions.iter().filter(|assumption| assumption.met).count()
    }
}

/// An assumption of a criterion.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Assumption {
    /// The assumption as text.
    pub text: &'static str,
    /// Whether the scene meets it.
    pub met: bool,
    /// The scene's own property, as text, if it does not meet the assumption; else empty.
    pub here: String,
}

impl Assumption {
    fn new(text: &'static str, met: bool, here: impl FnOnce() -> String) -> Self {
        Self { text, met, here: if met { String::new() } else { here() } }
    }
}

/// A number beside a limit.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Figure {
    /// Name of the number.
    pub name: &'static str,
    /// Value of the number.
    pub value: f64,
    /// Unit of the number; empty for a ratio.
    pub unit: &'static str,
}

/// A criterion that has no limit for a scene.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Silent {
    /// Name of the criterion.
    pub name: &'static str,
    /// Why the criterion has no limit.
    #[serde(rename = "reason")]
    pub why: String,
}

/// Names of all criteria.
pub const NAMES: [&str; 9] = [
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

/// Returns every criterion's answer for a scene, or why the criterion has none.
pub fn all(scene: &Scene) -> Vec<Result<Criterion, Silent>> {
    NAMES.iter().filter_map(|name| named(name, scene)).collect()
}

/// Returns the answer of the criterion with this name for a scene; `None` if the criterion does not exist for its
/// device.
pub fn named(name: &str, scene: &Scene) -> Option<Result<Criterion, Silent>> {
    if scene.target.is_some() {
        let why = "not met: the criterion is one of a wall, and the method follows a target".into();
        return NAMES.into_iter().find(|it| *it == name).map(|name| Err(Silent { name, why }));
    }
    let body = Rigid::new(scene);
    match (name, &scene.device) {
        ("spectral_radius", _) => Some(linear::spectral_radius(scene)),
        ("routh", _) => Some(linear::routh(scene)),
        ("low_frequency", Device::Motor(motor)) => Some(linear::low_frequency(scene, motor)),
        ("gil_hulin", _) => Some(Ok(sampled_wall::gil_hulin(scene, &body))),
        ("colgate_schenkel", _) => Some(Ok(sampled_wall::colgate_schenkel(scene, &body))),
        ("abbott_okamura", _) => Some(Ok(sampled_wall::abbott_okamura(scene, &body))),
        ("diolaiti", _) => Some(Ok(sampled_wall::diolaiti(scene, &body))),
        ("describing_function", _) => Some(describing::criterion(scene)),
        ("drop_threshold", _) => Some(sampled_wall::drop_threshold(scene, &body)),
        _ => None,
    }
}

/// Returns the greatest stiffness up to which the linear loop with this damping settles.
fn critical(scene: &Scene, damping: f64) -> Result<f64, Error> {
    let (damping, range) = (Damping::Fixed(damping), usual_range(scene));
    match Stretch::softest(scene, damping, range)? {
        Some(Stretch { to, .. }) if to.beyond.is_some() => Ok(to.middle()),
        _ => Err(StableSet::new(scene, damping, range)?.said().into()),
    }
}

/// Returns the unit of speeds beside these units.
fn speed_unit(units: &Units) -> &'static str {
    if units.position == "m" { "m/s" } else { "rad/s" }
}

fn linear_law(scene: &Scene) -> Assumption {
    Assumption::new(
        "spring and backward difference alone, without quantisation or saturation, pulling as well as pushing",
        scene.model.datapath == Datapath::Linear && !matches!(scene.method.kind, Loop::Law(_)),
        || format!("{} {}", scene.method.kind.name(), law(scene)),
    )
}

/// Returns as text how the scene's law is computed.
fn law(scene: &Scene) -> &'static str {
    match scene.model.datapath {
        Datapath::Words => "in words",
        Datapath::Law => "in floats, on counts",
        Datapath::Linear => "in the linear law",
    }
}

fn frictionless(scene: &Scene) -> Assumption {
    let coulomb = Rigid::new(scene).coulomb_nm;
    let here = || format!("{} {}", figure(coulomb), scene.device.units().effort);
    Assumption::new("no Coulomb friction", coulomb == 0.0, here)
}

fn known_hand(scene: &Scene) -> Assumption {
    known_hand_for("a hand that is absent, a constant effort, or a spring and damper", scene)
}

/// Returns an assumption that depends on the kind of the hand.
fn known_hand_for(text: &'static str, scene: &Scene) -> Assumption {
    let own_mass = scene.network.as_deref().is_some_and(|network| network.hand_has_mass);
    let (known, here) = match scene.hand {
        Hand::SpringDamper { .. } if own_mass => (false, "the hand has a mass of its own"),
        Hand::None | Hand::ConstantTorque { .. } | Hand::SpringDamper { .. } => (true, ""),
        Hand::Prescribed { .. } => (false, "the hand imposes the motion"),
        Hand::Capture { .. } => (false, "a recording stands in the place of the device"),
    };
    Assumption::new(text, known, || here.to_string())
}

fn sampled(scene: &Scene) -> Assumption {
    sampled_for("a spring that is sampled and held", scene)
}

/// Returns an assumption about a sampled spring.
fn sampled_for(text: &'static str, scene: &Scene) -> Assumption {
    let here = || format!("the spring of {} reads the position at once", scene.method.kind.name());
    Assumption::new(text, !scene.method.kind.is_live(), here)
}

fn continuous(scene: &Scene) -> Assumption {
    let here = || format!("sampled every {} s", figure(scene.sample_period_s()));
    Assumption::new("a spring that is not sampled", scene.method.kind.is_live(), here)
}

fn ideal_drive(scene: &Scene) -> Assumption {
    let here = match scene.network.as_deref() {
        None => matches!(scene.device, Device::Motor(_)).then(|| "a motor with a winding, behind a bridge".to_string()),
        Some(network) => {
            let apart = [network.bends(), network.lags(), network.springs()];
            let all: Vec<String> = apart.into_iter().flatten().collect();
            (!all.is_empty()).then(|| all.join(", "))
        }
    };
    Assumption::new("a rigid body driven by an ideal force or current", here.is_none(), || here.unwrap_or_default())
}

/// The share of a sample period below which a delay counts as none.
const SMALL_DELAY: f64 = 0.01;

/// Returns whether a delay counts as none beside a scene's sample period.
fn is_small(delay_s: f64, scene: &Scene) -> bool {
    delay_s <= SMALL_DELAY * scene.sample_period_s()
}

/// Returns the times that a scene's loop waits, as text.
fn waited(scene: &Scene) -> String {
    let waits = waits(scene);
    let all: Vec<String> = waits.iter().map(|wait| format!("{} {} s", wait.what, figure(wait.seconds))).collect();
    all.join(", ")
}

fn undelayed(scene: &Scene) -> Assumption {
    Assumption::new(
        "no delay beside sampling: less than a hundredth of a sample",
        is_small(delay_s(scene), scene),
        || waited(scene),
    )
}

/// Returns an assumption of a criterion that takes the linear law's delay but no other one.
fn prompt(scene: &Scene) -> Assumption {
    Assumption::new(
        "a drive that waits for neither logic nor modulator: less than a hundredth of a sample",
        scene.model.datapath == Datapath::Linear || is_small(delay_s(scene), scene),
        || waited(scene),
    )
}

fn undamped_wall(scene: &Scene) -> Assumption {
    undamped_wall_for("a wall without damping", scene)
}

/// Returns an assumption about a wall without damping.
fn undamped_wall_for(text: &'static str, scene: &Scene) -> Assumption {
    let damping = scene.wall.damping_nm_s_per_rad;
    Assumption::new(text, damping == 0.0, || format!("{} {}", figure(damping), scene.device.units().damping))
}

fn in_counts(scene: &Scene) -> Assumption {
    let here = || "the linear law has none".to_string();
    Assumption::new("a position in whole counts", scene.model.datapath != Datapath::Linear, here)
}
