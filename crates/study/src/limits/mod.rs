//! How stiff a wall may be: what the emulator finds, beside what the published criteria say.
//!
//! The emulated limit is a bisection over the wall's stiffness, its damping fixed, on the verdict of the scene's linear,
//! unquantised loop: the sign of [`LinearLoop::growth_per_s`]. Bilateral contact, no Coulomb friction; of the hand its spring
//! and damper. Beside it stands the limit of the scene as it is, in words ([`InWords`]).

mod words;

use std::fmt;

use hpu_cosim::figure;
use hpu_cosim::scene::{Datapath, Miss, Scene};
use hpu_cosim::{Control, LinearLoop};

use crate::criteria::{self, Criterion, Silent};

pub use words::{InWords, in_words};

/// The limits of a scene's stiffness.
#[derive(Clone, PartialEq, Debug)]
pub struct Limits {
    /// What the published criteria say.
    pub criteria: Vec<Criterion>,
    /// Which of them have no limit for this scene, and why.
    pub silent: Vec<Silent>,
    /// What the emulator finds of the linear loop.
    pub emulated: Result<Emulated, LimitsError>,
    /// What it finds of the scene in words, or why it cannot.
    pub in_words: Result<InWords, String>,
    /// The scene's own stiffness, where its words miss it by far.
    pub stiffness_miss: Option<Miss>,
}

/// The emulator's answer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Emulated {
    /// The stiffness between the stiffest loop known to settle and the softest known to diverge.
    pub limit: f64,
    /// Half of the distance between these two.
    pub uncertainty: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// Why a scene's stiffness has no limit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LimitsError {
    /// It diverges however soft the wall.
    NeverStable {
        /// The softest that was tried, in SI units.
        down_to: f64,
    },
    /// Whether it settles stays open.
    Open {
        /// At this stiffness, in SI units.
        at: f64,
    },
    /// The delay makes too large a loop.
    Late {
        /// Whole samples of delay.
        samples: u64,
        /// As many as are worked out.
        most: u64,
    },
    /// It settles however stiff the wall.
    AlwaysStable {
        /// The stiffest that was tried, in SI units.
        up_to: f64,
    },
}

impl fmt::Display for LimitsError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NeverStable { down_to } => {
                write!(
                    f,
                    "no stiffness settles, down to {}: the damping alone is too much for the loop",
                    figure(*down_to)
                )
            }
            Self::Open { at } => {
                write!(f, "at {} the motion neither grows nor decays by more than is known", figure(*at))
            }
            Self::Late { samples, most } => {
                write!(f, "a delay of {samples} samples, of {most} at most for which this is worked out")
            }
            Self::AlwaysStable { up_to } => write!(f, "every stiffness settles, up to {}", figure(*up_to)),
        }
    }
}

impl std::error::Error for LimitsError {}

/// The limits of a scene's wall, over its stiffness, the damping being the scene's.
#[must_use]
pub fn limits(scene: &Scene) -> Limits {
    let emulated = emulated(scene, 0.5e-9);
    let (mut criteria, mut silent) = (vec![], vec![]);
    for criterion in criteria::all(scene) {
        match criterion {
            Ok(criterion) => criteria.push(criterion),
            Err(why) => silent.push(why),
        }
    }
    let in_words = words::in_words(scene, emulated.map_or(start(scene), |linear| linear.limit), &Control::default());
    // The linear loop has no words to miss it.
    let words = if scene.model.datapath == Datapath::Linear { None } else { scene.words().ok() };
    let stiffness_miss = words.and_then(|words| words.realised.stiffness_miss);
    Limits { criteria, silent, emulated, in_words, stiffness_miss }
}

/// A stiffness to search from.
pub(crate) fn start(scene: &Scene) -> f64 {
    if scene.wall.stiffness_nm_per_rad > 0.0 { scene.wall.stiffness_nm_per_rad } else { 1.0 }
}

/// The limit of a scene's linear loop, to this share of itself.
///
/// # Errors
///
/// [`LimitsError`] when the loop settles, or diverges, at every stiffness.
pub fn emulated(scene: &Scene, relative: f64) -> Result<Emulated, LimitsError> {
    let (low, high) = bisect(start(scene), relative, |stiffness| settles(scene, stiffness))?;
    Ok(Emulated { limit: 0.5 * (low + high), uncertainty: 0.5 * (high - low), unit: unit(scene) })
}

/// The unit of the scene's stiffness.
pub(crate) fn unit(scene: &Scene) -> &'static str {
    scene.device.units().stiffness
}

/// The verdict of the linear loop; `None` where the motion neither grows nor decays by more than is known.
pub(crate) fn settles(scene: &Scene, stiffness: f64) -> Option<bool> {
    const FEWEST: usize = 1 << 11;
    const MOST: usize = 1 << 22;
    // A growth as small as this comes from rounding at every sample.
    let least = 16.0 * f64::EPSILON / scene.sample_period_s();
    let law = LinearLoop::new(scene, stiffness, scene.wall.damping_nm_s_per_rad);
    let mut samples = FEWEST;
    let mut before = law.growth_per_s(samples);
    let mut spread = f64::INFINITY;
    while samples < MOST {
        samples *= 2;
        let growth = law.growth_per_s(samples);
        // End effects shrink at least eightfold from one doubling to the next: the last two changes tell their size.
        let change = (growth - before).abs();
        if growth.abs() > spread.max(change).max(least) {
            return Some(growth < 0.0);
        }
        (before, spread) = (growth, change);
    }
    None
}

/// The stiffest value known to be stable and the softest known not to be, at most `relative` of themselves to either side
/// of their middle unless the verdict stays open there.
pub(crate) fn bisect(
    start: f64,
    relative: f64,
    mut stable: impl FnMut(f64) -> Option<bool>,
) -> Result<(f64, f64), LimitsError> {
    const DOUBLINGS: i32 = 40;
    // An open verdict takes the longest run, and after a few in turn the next ones stay open too.
    const OPEN: i32 = 6;
    let mut sought = |wanted: bool, factor: f64| {
        let (mut at, mut open) = (start, 0);
        for _ in 0..DOUBLINGS {
            match stable(at) {
                Some(found) if found == wanted => return Ok(at),
                Some(_) => open = 0,
                None => open += 1,
            }
            if open == OPEN {
                return Err(LimitsError::Open { at });
            }
            at *= factor;
        }
        Err(if wanted { LimitsError::NeverStable { down_to: at } } else { LimitsError::AlwaysStable { up_to: at } })
    };
    let (mut low, mut high) = (sought(true, 0.5)?, sought(false, 2.0)?);
    while high - low > relative * (high + low) {
        let middle = 0.5 * (low + high);
        match stable(middle) {
            Some(true) => low = middle,
            Some(false) => high = middle,
            None => break,
        }
    }
    Ok((low, high))
}
