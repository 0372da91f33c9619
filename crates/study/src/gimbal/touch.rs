//! The limits of a touch: the stiffnesses at which its criteria predict that a finger can rest on the segment.

use hpu_cosim::scene::GimbalScene;

use crate::Error;
use hpu_prove::criteria::touch::{Criteria, NAMES};

/// Stiffnesses that are looked at, each by as large a factor above the one before.
const LOOKS: u32 = 512;

/// The limits of a touch.
#[derive(Clone, PartialEq, Debug)]
pub struct TouchLimits {
    /// The criteria at the scene's own stiffness.
    pub criteria: Criteria,
    /// The stiffnesses that the scene's words hold: the least above 0 and the greatest, in N/m.
    pub range_n_per_m: [f64; 2],
    /// For each criterion, in the order of [`NAMES`], the stretches of stiffness, in N/m, at which it predicts no
    /// failure. A stretch, or a gap, that is narrower than one of [`looks`](Self::looks) steps can be missed.
    pub rests_n_per_m: [Vec<[f64; 2]>; NAMES.len()],
}

impl TouchLimits {
    /// Returns the limits of a scene.
    ///
    /// # Errors
    ///
    /// Those of [`Criteria::of`].
    pub fn of(scene: &GimbalScene) -> Result<Self, Error> {
        let criteria = Criteria::of(scene)?;
        let format = scene.method.config.impedance.stiffness;
        let word_n_per_m = format.lsb() * scene.force_lsb_n() / scene.method.config.gimbal.length.lsb();
        let range_n_per_m = [1.0, format.max() as f64].map(|word| word * word_n_per_m);
        let fails = |stiffness_n_per_m: f64| {
            Ok::<_, Error>(Criteria::of(&GimbalScene { stiffness_n_per_m, ..scene.clone() })?.fails())
        };
        let [least, most] = range_n_per_m;
        let at = |look: u32| least * libm::pow(most / least, f64::from(look) / f64::from(LOOKS));
        let looks = (0..=LOOKS).map(at).map(|at| Ok((at, fails(at)?))).collect::<Result<Vec<_>, Error>>()?;
        let mut rests_n_per_m = [const { Vec::new() }; NAMES.len()];
        for (index, stretches) in rests_n_per_m.iter_mut().enumerate() {
            *stretches = stretched(&looks, index, &fails)?;
        }
        Ok(Self { criteria, range_n_per_m, rests_n_per_m })
    }

    /// Returns the number of stiffnesses that were looked at.
    pub fn looks() -> u32 {
        LOOKS + 1
    }
}

type Fails = [bool; NAMES.len()];

/// Returns the stretches at which a criterion predicts no failure; their ends between two looks are bisected.
fn stretched(
    looks: &[(f64, Fails)],
    index: usize,
    fails: &impl Fn(f64) -> Result<Fails, Error>,
) -> Result<Vec<[f64; 2]>, Error> {
    let mut stretches: Vec<[f64; 2]> = Vec::new();
    let mut before: Option<(f64, bool)> = None;
    for &(here, failed) in looks {
        let rests = !failed[index];
        let edge = match before {
            Some((mut low, was)) if was != rests => {
                let mut high = here;
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if fails(middle)?[index] == was { high = middle } else { low = middle }
                }
                0.5 * (low + high)
            }
            _ => here,
        };
        match (before.is_some_and(|(_, was)| was), stretches.last_mut()) {
            (true, Some(stretch)) => stretch[1] = edge,
            _ if rests => stretches.push([edge, here]),
            _ => {}
        }
        before = Some((here, rests));
    }
    Ok(stretches)
}
