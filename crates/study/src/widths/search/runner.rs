//! One run of a search.

use std::sync::atomic::Ordering;
use std::time::Duration;

use hpu_cosim::scene::{Experiment, OutcomeKind, Output, Scene};
use hpu_cosim::{Control, Driver, Rig, Summary, Wired};
use hpu_signal::SignalUse;

use super::memory::{Depth, Gains, Ran};
use crate::accuracy::{Outputs, ready, worst};
use crate::map::{CellLimits, more_events};
use crate::watch::limited;

/// The data that all runs of one scene share.
pub(super) struct Runner<'a> {
    pub scene: &'a Scene,
    /// The reference's outputs, and those of them that count.
    pub reference: Outputs,
    pub outputs: Vec<Output>,
    /// The stiffness at which one count gives a full command.
    pub full_scale: f64,
}

/// Runs a scene; `None` when stopped.
pub(super) fn run(experiment: &Experiment, control: &Control) -> Result<Option<(Outputs, Summary)>, String> {
    let ready = ready(experiment)?;
    let mut trace = ready.brief_trace();
    let most = CellLimits::default().events;
    let run = |own: &Control| ready.run(Driver::Events, &mut trace, &mut (), own);
    let (summary, _) = limited(Some(most), Duration::MAX, control, run);
    if !summary.complete {
        return if control.stop.load(Ordering::Relaxed) { Ok(None) } else { Err(more_events(most)) };
    }
    Ok(Some((Outputs::new(experiment, &summary, &trace)?, summary)))
}

impl Runner<'_> {
    /// Returns the scene of a run.
    pub fn scene(&self, gains: &Gains, (position, velocity): Depth) -> Scene {
        let mut scene = self.scene.clone();
        let Gains { pwm, stiffness, damping, .. } = *gains;
        scene.wall.stiffness_nm_per_rad =
            stiffness.format().to_f64(stiffness.word as i64) * self.full_scale / f64::from(1u32 << pwm);
        let method = &mut scene.method;
        (method.position_bits, method.velocity_bits, method.pwm.bits) = (position, velocity, pwm);
        // The scene's damping rounds to the same value in the same word with fewer fraction bits.
        (method.stiffness_format, method.damping_format) = (stiffness.format(), damping.format());
        scene
    }

    /// Does a run; `None` when stopped.
    pub fn run(&self, gains: &Gains, depth: Depth, control: &Control) -> Result<Option<Ran>, String> {
        let Some((outputs, summary)) = run(&Experiment::Axis(self.scene(gains, depth)), control)? else {
            return Ok(None);
        };
        let used = |name: &str| -> Result<SignalUse, String> {
            let net = summary.nets.iter().find(|net| net.signal.name == name);
            Ok(net.ok_or_else(|| format!("the loop has no net {name}"))?.usage)
        };
        let (delta, velocity) = (used("delta")?, used("velocity")?);
        Ok(Some(Ran {
            settled: outputs.outcome == OutcomeKind::Settled,
            error: worst(&outputs.errors(&self.reference), &self.outputs),
            delta: (delta.min, delta.max),
            velocity: (velocity.overflowed == 0).then_some((velocity.min, velocity.max)),
            rescaled: self.scene.method.reference_rate_hz.is_some(),
        }))
    }
}
