//! The published criteria of a wall's stability.
//!
//! Each is told for every scene that gives it its numbers, with what it assumes and whether the scene is like that; where a
//! scene has no such number (no Coulomb friction, no winding), that is told instead.

mod describing;
mod linear;
mod rigid;
mod sampled_wall;

pub use describing::{describing_function, stable_amplitude};
pub use rigid::{Balance, Region, Rigid};

use hpu_cosim::scene::{Datapath, Device, Hand, Loop, Scene};

use crate::SampledLoop;
use crate::limits::{LimitsError, bisect, start};

/// A criterion's answer.
#[derive(Clone, PartialEq, Debug)]
pub struct Criterion {
    /// Its name.
    pub name: &'static str,
    /// The greatest stiffness it allows.
    pub limit: f64,
    /// Unit of the limit.
    pub unit: &'static str,
    /// Whether it speaks of loops of this kind at all: of springs that are sampled, or of those that are not.
    pub speaks: bool,
    /// What it assumes.
    pub assumptions: Vec<Assumption>,
    /// What else it tells, at the scene's own stiffness.
    pub figures: Vec<Figure>,
    /// What it says becomes of the scene's own stiffness, where it tells more than two cases apart.
    pub region: Option<Region>,
}

impl Criterion {
    /// With these figures, as far as they are finite: without a quantum some are not.
    fn with(mut self, figures: Vec<Figure>) -> Self {
        self.figures = figures.into_iter().filter(|figure| figure.value.is_finite()).collect();
        self
    }

    /// Whether the scene is as the criterion assumes.
    #[must_use]
    pub fn assumptions_met(&self) -> bool {
        self.assumptions.iter().all(|assumption| assumption.met)
    }
}

/// Something that a criterion assumes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Assumption {
    /// In words.
    pub text: &'static str,
    /// Whether the scene is like that.
    pub met: bool,
}

impl Assumption {
    fn new(text: &'static str, met: bool) -> Self {
        Self { text, met }
    }
}

/// A number beside a limit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Figure {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit, empty for a ratio.
    pub unit: &'static str,
}

/// A criterion that has no limit for a scene.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Silent {
    /// Its name.
    pub name: &'static str,
    /// Why it has none.
    pub why: String,
}

/// Their names.
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

/// Every criterion on a scene: its answer, or why it has none.
#[must_use]
pub fn all(scene: &Scene) -> Vec<Result<Criterion, Silent>> {
    NAMES.iter().filter_map(|name| named(name, scene)).collect()
}

/// The criterion of this name on a scene; `None` where there is none for its device.
#[must_use]
pub fn named(name: &str, scene: &Scene) -> Option<Result<Criterion, Silent>> {
    let body = Rigid::new(scene);
    match (name, &scene.device) {
        ("spectral_radius", _) => Some(linear::spectral_radius(scene)),
        ("routh", _) => Some(linear::routh(scene)),
        ("low_frequency", Device::Motor(motor)) => Some(Ok(linear::low_frequency(scene, motor))),
        ("gil_hulin", _) => Some(Ok(sampled_wall::gil_hulin(scene, &body))),
        ("colgate_schenkel", _) => Some(Ok(sampled_wall::colgate_schenkel(scene, &body))),
        ("abbott_okamura", _) => Some(Ok(sampled_wall::abbott_okamura(scene, &body))),
        ("diolaiti", _) => Some(Ok(sampled_wall::diolaiti(scene, &body))),
        ("describing_function", _) => Some(describing::criterion(scene)),
        ("drop_threshold", _) => Some(sampled_wall::drop_threshold(scene, &body)),
        _ => None,
    }
}

/// The stiffness at which the exact linear loop leaves the unit circle.
fn critical(scene: &Scene, damping: f64) -> Result<f64, LimitsError> {
    // The loop's matrix has a row for each sample of delay, and its powers cost the cube of that.
    const MOST_WAITING: u64 = 64;
    let waiting = scene.clock.edges(scene.model.delay_s) / scene.period_clocks();
    if waiting > MOST_WAITING {
        return Err(LimitsError::Late { samples: waiting, most: MOST_WAITING });
    }
    let settles = |stiffness| SampledLoop::new(scene, stiffness, damping).spectral_radius() < 1.0;
    bisect(start(scene), 1e-12, |stiffness| Some(settles(stiffness))).map(|(low, high)| 0.5 * (low + high))
}

fn linear_law(scene: &Scene) -> Assumption {
    Assumption::new(
        "spring and backward difference alone, without quantisation or saturation, pulling as well as pushing",
        scene.model.datapath == Datapath::Linear && !matches!(scene.method.kind, Loop::Law(_)),
    )
}

fn frictionless(scene: &Scene) -> Assumption {
    let coulomb = Rigid::new(scene).coulomb_nm;
    Assumption::new("no Coulomb friction", coulomb == 0.0)
}

fn known_hand(scene: &Scene) -> Assumption {
    let known = matches!(scene.hand, Hand::None | Hand::ConstantTorque { .. } | Hand::SpringDamper { .. });
    Assumption::new("a hand that is absent, a constant effort, or a spring and damper", known)
}

fn sampled(scene: &Scene) -> Assumption {
    Assumption::new("a spring that is sampled and held", !scene.method.kind.is_live())
}

fn continuous(scene: &Scene) -> Assumption {
    Assumption::new("a spring that is not sampled", scene.method.kind.is_live())
}

fn ideal_drive(scene: &Scene) -> Assumption {
    Assumption::new("a rigid body driven by an ideal force or current", matches!(scene.device, Device::Mass(_)))
}

fn undelayed(scene: &Scene) -> Assumption {
    Assumption::new("no delay beside sampling", scene.model.delay_s == 0.0)
}

fn undamped_wall(scene: &Scene) -> Assumption {
    Assumption::new("a wall without damping", scene.wall.damping_nm_s_per_rad == 0.0)
}

fn in_counts(scene: &Scene) -> Assumption {
    Assumption::new("a position in whole counts", scene.model.datapath != Datapath::Linear)
}
