//! How stiff a wall may be: the stable set of the scene's linear loop, the behaviour of the scene in fixed-point words,
//! and the published criteria.
//!
//! The answer is a set, not a single number: a loop may settle, oscillate and settle again as its wall becomes stiffer.
//! The linear loop's set with an ideal drive is proved ([`StableSet`]), and so is the set of the linear loop that runs,
//! with its modulator and its registers ([`DrivenSet`]). The scene in fixed-point words, with its quantisation,
//! friction, hand and contact, is run at a grid of stiffnesses and phases of its contact ([`WordsSet`]).

mod hands;
mod looks;
pub mod settling;
mod swings;
mod unknown;
mod words;

use hpu_cosim::number;
use hpu_cosim::scene::{Datapath, Friction, Miss, Scene};

use hpu_prove::linear::{BoxSet, Damping, DrivenSet, NotDriven, Ripple, StableSet};

use crate::Error;
use hpu_prove::criteria::{self, Criterion, Rigid, Silent};
use hpu_prove::steady::SteadySet;

pub use hands::{PublishedHand, hands_of, published_hands};
pub use looks::{Looks, MOST_EVENTS};
pub use swings::swings;
pub use unknown::{MOST_UNKNOWN, Unknown, World};
pub use words::{Group, Seen, WordsSet};

/// Keys of a scene and the values that replace the scene's own.
pub type Overrides = Vec<(String, String)>;

/// The limits of a scene's stiffness.
#[derive(Clone, PartialEq, Debug)]
pub struct Limits {
    /// The key that is varied instead of the stiffness, for a design of the user's own: only that design knows which
    /// stiffness the key's values make.
    pub varied: Option<String>,
    /// The range of stiffnesses that was examined, in SI units; these and all others are those of the body with the
    /// encoder, or [at the wall](Self::at_wall).
    pub range: [f64; 2],
    /// Limits by the published criteria.
    pub criteria: Vec<Criterion>,
    /// The criteria that give no limit for this scene, and why.
    pub silent: Vec<Silent>,
    /// The stable set of the linear loop with an ideal drive, which waits for nothing but its samples and the linear
    /// law's delay, or the reason why there is none.
    pub linear: Result<StableSet, Error>,
    /// The stable set of the linear loop as the scene drives it, or why it is not worked out.
    pub driven: Result<DrivenSet, NotDriven>,
    /// The ripple of the scene's modulator at rest, if pulses drive its device.
    pub ripple: Option<Ripple>,
    /// The stable set of the linear loop with an ideal drive over a box of unknown parameters, or the reason why there
    /// is none; `None` without a box.
    pub in_box: Option<Result<BoxSet, Error>>,
    /// The stable set of the scene in fixed-point words, or the reason why there is none.
    pub in_words: Result<WordsSet, Error>,
    /// The scene's own stiffness, if its fixed-point word misses it by far.
    pub stiffness_miss: Option<Miss>,
    /// Relative error of the word of the scene's damping, if it is more than [`Miss::FLAGGED`]: the runs in words have
    /// the word's damping, linear loops and criteria what is asked for.
    pub damping_error: Option<f64>,
    /// The words that are proved to settle at every phase for ever, or why that is not worked out; `None` if nobody
    /// asks.
    pub steady: Option<Result<SteadySet, Error>>,
    /// What linear loops leave out of a network or a bridge beside Coulomb friction, each as text.
    pub left_out: Vec<String>,
    /// Coulomb friction of the device, in SI units: linear loops and ripple leave it out.
    pub coulomb: f64,
    /// Whether `wall.ramp` changes the wall during the runs: a stiffness is then that before the ramp.
    pub is_ramped: bool,
}

impl Limits {
    /// Returns the limits of a scene in the units of the body at its wall. They are found in those of the body with the
    /// encoder, which are others where the device is a network.
    #[must_use]
    pub fn at_wall(self, scene: &Scene) -> Self {
        let Some(network) = scene.network.as_deref() else { return self };
        let (ratio, unit) = (network.wall_ratio, network.wall_units.stiffness);
        let one = ratio * ratio;
        Self {
            range: self.range.map(|stiffness| stiffness / one),
            linear: self.linear.map(|set| set.in_units(one, unit)),
            driven: self.driven.map(|driven| DrivenSet { set: driven.set.in_units(one, unit), ..driven }),
            in_box: self.in_box.map(|set| set.map(|set| set.in_units(one, unit))),
            in_words: self.in_words.map(|set| set.in_units(one, unit)),
            coulomb: self.coulomb / ratio.abs(),
            criteria: self.criteria.into_iter().map(|it| it.in_units(ratio, &network.wall_units)).collect(),
            ..self
        }
    }
}

/// Returns the limits of a scene's wall over a range of stiffnesses, with the scene's damping. Calls `in_words` last,
/// for the set in fixed-point words over the same range: it takes most of the time.
pub fn limits(scene: &Scene, range: [f64; 2], in_words: impl FnOnce() -> Result<WordsSet, Error>) -> Limits {
    let linear = StableSet::new(scene, Damping::Fixed(scene.wall.damping_nm_s_per_rad), range).map_err(Error::from);
    let (driven, ripple) = (DrivenSet::new(scene, range), Ripple::new(scene, range));
    let (mut criteria, mut silent) = (vec![], vec![]);
    for criterion in criteria::all(scene) {
        match criterion {
            Ok(criterion) => criteria.push(criterion),
            Err(why) => silent.push(why),
        }
    }
    let in_words = in_words();
    let mut left_out = scene.network.as_ref().map_or_else(Vec::new, |network| network.left_out());
    if scene.bridge.dead_band_v > 0.0 {
        left_out.push(format!("the bridge's dead band, {} V", number(scene.bridge.dead_band_v)));
    }
    // The linear loop has no words that could miss the stiffness.
    let words = if scene.model.datapath == Datapath::Linear { None } else { scene.words().ok() };
    let realised = words.as_ref().map(|words| &words.realised);
    Limits {
        varied: None,
        range,
        criteria,
        silent,
        linear,
        driven,
        ripple,
        in_box: None,
        in_words,
        stiffness_miss: realised.and_then(|realised| realised.stiffness_miss),
        steady: None,
        damping_error: realised.map(|realised| realised.damping_error).filter(|error| error.abs() > Miss::FLAGGED),
        left_out,
        coulomb: if scene.model.friction == Friction::None { 0.0 } else { Rigid::new(scene).coulomb_nm },
        is_ramped: scene.wall.ramp.is_some(),
    }
}
