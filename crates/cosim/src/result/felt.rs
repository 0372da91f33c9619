//! What a run tells of its wall: the stiffness that is felt, a product that has wrapped, contact that the datapath did
//! not see.

use crate::result::summary::Summary;
use crate::result::trace::{ANGLE, Trace};
use crate::result::verdict::Verdict;
use crate::scene::{Loop, Realised, Scene};

/// How far a device was past the wall while the datapath saw no contact.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Unseen {
    /// Greatest depth in the judged window, in rad, of a mass in m.
    pub depth: f64,
    /// Whether the depth is half of the position counter's range or more: the counter wrapped, and reads a position
    /// before the wall.
    pub wrapped: bool,
}

/// Counts past the wall that may stay hidden because of the encoder and of the wall's rounded place.
const HIDDEN_COUNTS: f64 = 2.0;

/// Returns the depth that the datapath did not see in the judged window; `None` if it saw contact or the device stayed
/// before the wall.
pub fn unseen_contact(scene: &Scene, realised: &Realised, trace: &Trace, summary: &Summary) -> Option<Unseen> {
    if summary.contact_share != Some(0.0) {
        return None;
    }
    let farthest_rad = trace.judged_rows(ANGLE).iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let depth = farthest_rad - realised.wall_position_rad;
    let half_range = realised.count_rad * libm::exp2(f64::from(scene.method.position_bits - 1));
    let is_past = depth > HIDDEN_COUNTS * realised.count_rad;
    is_past.then_some(Unseen { depth, wrapped: realised.count_rad > 0.0 && depth >= half_range })
}

/// Returns how often the spring's product had wrapped when the motion came to rest in the wall; `None` if it had not,
/// or if the loop's product does not drop its upper bits.
pub fn product_wraps(scene: &Scene, realised: &Realised, trace: &Trace, summary: &Summary) -> Option<u64> {
    let settled = matches!(summary.verdict, Some(Verdict::Settled { .. }));
    if !settled || scene.method.saturate || matches!(scene.method.kind, Loop::Law(_)) {
        return None;
    }
    displayed_stiffness((scene.wall.position_rad, scene.wall.stiffness_nm_per_rad), trace, summary.averages)?;
    let depth = trace.judged_rows(ANGLE).last()? - scene.wall.position_rad;
    let full = realised.torque_quantum_nm * libm::exp2(f64::from(scene.method.pwm.bits));
    let wraps = (realised.stiffness_nm_per_rad * depth / full) as u64;
    (wraps > 0).then_some(wraps)
}

/// Returns the displayed stiffness and its ratio to the stiffness asked for. The displayed stiffness is the actuator's
/// mean torque or force divided by the mean penetration of the wall as asked for, both exact, in the judged window.
/// Returns `None` if the wall is not touched during all of this time.
pub fn displayed_stiffness(
    (wall_rad, asked): (f64, f64),
    trace: &Trace,
    averages: Option<[f64; 2]>,
) -> Option<(f64, Option<f64>)> {
    if trace.judged_rows(ANGLE).iter().any(|angle_rad| *angle_rad <= wall_rad) {
        return None;
    }
    let [torque_nm, angle_rad] = averages?;
    let displayed = -torque_nm / (angle_rad - wall_rad);
    displayed.is_finite().then_some((displayed, (asked > 0.0).then_some(displayed / asked)))
}
