//! Finds whether a loop changes when its torque needs more clock cycles to settle.
//!
//! To first order, a spring `k` that answers `t` late is the same spring with a damper of `-k t` beside it. The device
//! must have that much damping to spare.

use std::num::NonZeroUsize;

use hpu_cosim::Control;
use hpu_cosim::scene::{Datapath, Experiment, Loop, OutcomeKind, Output, Scene};

use super::{Looks, WordsSet};
use crate::Error;
use crate::accuracy::{Outputs, driver, usual};
use hpu_prove::linear::usual_range;

/// A scene whose command is delayed by further clock cycles, beside the scene as it is. All figures are *measured*.
#[derive(Clone, PartialEq, Debug)]
pub struct Settling {
    /// `method.settling` of the scene, and of the delayed one.
    pub clocks: [u32; 2],
    /// The verdicts of both.
    pub outcomes: [OutcomeKind; 2],
    /// The relative errors of the delayed run, for the outputs that the verdict makes worth comparing.
    pub errors: Vec<(Output, f64)>,
    /// The set of stable stiffnesses in words of both, or why there is none.
    pub limits: [Result<WordsSet, Error>; 2],
    /// The damping that the delay takes from the wall, in the scene's unit.
    pub lost_damping: f64,
}

impl Settling {
    /// Returns whether the verdict differs, or whether one set in words has ended, at every phase, at a stiffness where
    /// the other has not begun to end.
    pub fn noticed(&self) -> bool {
        let moved = match &self.limits {
            [Ok(prompt), Ok(late)] => prompt.is_apart_from(late) || late.is_apart_from(prompt),
            [prompt, late] => prompt.is_ok() != late.is_ok(),
        };
        moved || self.outcomes[0] != self.outcomes[1]
    }
}

/// Runs a scene as it is, and with its command delayed by `clocks` in all. Returns `None` if it was stopped.
///
/// # Errors
///
/// Why it cannot be run: only the hybrid and the conventional loop in words can be delayed.
pub fn settling(scene: &Scene, clocks: u32, control: &Control) -> Result<Option<Settling>, Error> {
    if !matches!(scene.method.kind, Loop::Hybrid | Loop::Conventional) || scene.model.datapath != Datapath::Words {
        return Err("only the hybrid and the conventional loop in words have method.settling".into());
    }
    let mut late = scene.clone();
    late.method.settling = clocks;
    let mut outputs = Vec::new();
    let mut limits = Vec::new();
    // A range around the scene's own stiffness.
    let (own, [least, most]) = (scene.wall.stiffness_nm_per_rad, usual_range(scene));
    let range = if own > 0.0 { [least.max(own / 16.0), most.min(own * 16.0)] } else { [least, most] };
    for scene in [scene, &late] {
        let (found, _) = Outputs::of(&Experiment::Axis(scene.clone()), driver(&[]), control)?;
        let Some(found) = found else { return Ok(None) };
        outputs.push(found);
        let looks = Looks { phases: 1, nearest: 0.0, coarse: 8, ..Looks::BRIEF };
        limits.push(WordsSet::new(std::slice::from_ref(scene), range, looks, NonZeroUsize::MIN, control));
    }
    let shown = usual(outputs[0].outcome);
    let mut errors = outputs[1].errors(&outputs[0]);
    errors.retain(|(output, _)| shown.contains(output) && *output != Output::Verdict);
    let delay_s = f64::from(clocks - scene.method.settling.min(clocks)) * scene.clock.period_s();
    Ok(Some(Settling {
        clocks: [scene.method.settling, clocks],
        outcomes: [outputs[0].outcome, outputs[1].outcome],
        errors,
        limits: limits.try_into().expect("two scenes"),
        lost_damping: scene.wall.stiffness_nm_per_rad * delay_s,
    }))
}
