//! How stiff a wall may be: the stable set of the scene's linear loop, what the scene does in words, and the published
//! criteria.
//!
//! Neither is a single number: a loop may settle, swing and settle again as its wall becomes stiffer. The linear loop's
//! set is proved ([`StableSet`]). The scene in words, with its quantisation, friction, hand and contact, is run at a
//! grid of stiffnesses and phases of its contact ([`WordsSet`]).

mod characteristic;
mod crossings;
mod hands;
mod robust;
mod stable;
mod unknown;
mod words;

use hpu_cosim::scene::{Datapath, Miss, Scene};

use crate::criteria::{self, Criterion, Silent};

pub use characteristic::Damping;
pub use hands::{Overrides, PublishedHand, hands_of, published_hands};
pub use robust::BoxSet;
pub(crate) use stable::linear_settles;
pub use stable::{End, StableSet, Stretch};
pub use unknown::{MOST_UNKNOWN, Unknown, World};
pub use words::{Group, Looks, MOST_EVENTS, Seen, WordsSet};

/// The limits of a scene's stiffness.
#[derive(Clone, PartialEq, Debug)]
pub struct Limits {
    /// The key whose values stand in the place of stiffnesses: of a design of the user's own, which alone knows what they
    /// make.
    pub varied: Option<String>,
    /// The stiffnesses that were looked at, in SI units.
    pub range: [f64; 2],
    /// What the published criteria say.
    pub criteria: Vec<Criterion>,
    /// Which of them have no limit for this scene, and why.
    pub silent: Vec<Silent>,
    /// The stable set of the linear loop, or why there is none.
    pub linear: Result<StableSet, String>,
    /// The linear loop's stable set over a box of what is not known, or why there is none; `None` without such a box.
    pub in_box: Option<Result<BoxSet, String>>,
    /// The set of the scene in words, or why there is none.
    pub in_words: Result<WordsSet, String>,
    /// The scene's own stiffness, where its words miss it by far.
    pub stiffness_miss: Option<Miss>,
}

/// The limits of a scene's wall over a range of stiffnesses, the damping being the scene's. `in_words` is asked last,
/// for the set in words over the same range: it takes the time.
#[must_use]
pub fn limits(scene: &Scene, range: [f64; 2], in_words: impl FnOnce() -> Result<WordsSet, String>) -> Limits {
    let linear = StableSet::new(scene, Damping::Fixed(scene.wall.damping_nm_s_per_rad), range);
    let (mut criteria, mut silent) = (vec![], vec![]);
    for criterion in criteria::all(scene) {
        match criterion {
            Ok(criterion) => criteria.push(criterion),
            Err(why) => silent.push(why),
        }
    }
    let in_words = in_words();
    // The linear loop has no words to miss it.
    let words = if scene.model.datapath == Datapath::Linear { None } else { scene.words().ok() };
    let stiffness_miss = words.and_then(|words| words.realised.stiffness_miss);
    Limits { varied: None, range, criteria, silent, linear, in_box: None, in_words, stiffness_miss }
}

/// The stiffnesses that limits are of unless others are asked for: from one word to the greatest of the scene's format;
/// without words, from a thousandth to a thousand times the scene's own stiffness, or of 1 where that is 0.
#[must_use]
pub fn usual_range(scene: &Scene) -> [f64; 2] {
    if scene.model.datapath != Datapath::Linear
        && let Ok(words) = scene.words()
    {
        let realised = words.realised;
        let format = scene.method.stiffness_format;
        let word = realised.torque_quantum_nm / realised.count_rad * format.lsb();
        return [word, format.max() as f64 * word];
    }
    let own = scene.wall.stiffness_nm_per_rad;
    let around = if own > 0.0 { own } else { 1.0 };
    [1e-3 * around, 1e3 * around]
}

/// The unit of the scene's stiffness.
pub(crate) fn unit(scene: &Scene) -> &'static str {
    scene.device.units().stiffness
}
