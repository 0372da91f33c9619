//! What a device knows of its motion, so that it need not compute it again.

use crate::flow::guard::{MotionPoint, Steady};
use crate::flow::matrix::State;

use super::Event;

/// What is known of the present motion in the present mode; all of it can be computed again. Code that changes the
/// motion or its checks must [`forget`](Self::forget) it.
#[derive(Clone)]
pub(crate) struct Known {
    /// The terms that the states at neighbouring edges share, and the edge after the anchor to which they belong.
    pub(super) prefix: (u64, (State, State)),
    /// The next event.
    pub(super) ahead: Ahead,
    /// The point of the last event found.
    pub(super) found: Option<MotionPoint>,
    /// How long the angle certainly moves in one direction.
    pub(super) steady: Steady,
    /// The number of edges after the anchor up to which no check ends the mode, as far as that is known.
    pub(super) kept: u64,
    /// The number of edges after the anchor below which `noise` holds.
    pub(super) heard: u64,
    /// Bounds of the errors of the angle and of the checked functions.
    pub(super) noise: [f64; 3],
}

/// The next event while the angle is in a band, as far as it is known.
#[derive(Clone, Copy)]
pub(super) struct Ahead {
    /// The edge up to which the event is known; 0 if nothing is known.
    pub(super) until: u64,
    /// The band of the angle.
    pub(super) band_rad: (f64, f64),
    /// The event, if there is one up to that edge.
    pub(super) event: Option<Event>,
}

impl Known {
    /// What is known of a motion that is new.
    pub(super) const NOTHING: Self = Self {
        prefix: (u64::MAX, ([0.0; 4], [0.0; 4])),
        ahead: Ahead::NOTHING,
        found: None,
        steady: Steady::UNKNOWN,
        kept: 0,
        heard: 0,
        noise: [0.0; 3],
    };

    /// Forgets everything, as the motion or its checks have changed. `kept` and `noise` mean nothing until `heard` is
    /// set again, which sets them too.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        self.prefix.0 = u64::MAX;
        (self.heard, self.ahead.until, self.found, self.steady.until) = (0, 0, None, 0);
    }
}

impl Ahead {
    pub(super) const NOTHING: Self = Self { until: 0, band_rad: (0.0, 0.0), event: None };

    /// Whether the first event in (`from`, `to`] while the angle is in this band is known: `event`, if it is not later.
    #[inline(always)]
    pub(super) fn holds(&self, from: u64, to: u64, band_rad: (f64, f64)) -> bool {
        // An event that was found is the next one, however far the question reaches.
        let is_known = self.event.as_ref().map_or(to <= self.until, |event| event.0 > from);
        is_known && self.until != 0 && band_rad == self.band_rad
    }
}
