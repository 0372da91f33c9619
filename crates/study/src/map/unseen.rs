//! A device past its wall whose datapath saw no contact.

use hpu_cosim::scene::{Realised, Scene};
use hpu_cosim::{ANGLE, Summary, Trace};

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
    let half_range = realised.count_rad * f64::from(scene.method.position_bits - 1).exp2();
    let is_past = depth > HIDDEN_COUNTS * realised.count_rad;
    is_past.then_some(Unseen { depth, wrapped: realised.count_rad > 0.0 && depth >= half_range })
}
