//! The figures of a cruise between the rows of a trace.

use super::cruise::Cruise;
use crate::gauge::{Extent, Flow, ROUNDING, Stretch, turns};
use crate::guard::{Guard, MotionPoint, dyadic};
use crate::matrix::{dot, sizes};

/// Current and speed on a cruise: the smooth motion and the ripple, which is the same in every period.
pub(super) struct Waves<'m, 'a> {
    pub(super) cruise: &'m Cruise<'a>,
    pub(super) flow: Flow<'m, 'a>,
}

impl Stretch<2> for Waves<'_, '_> {
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; 2] {
        let smooth = self.flow.integral(from, to);
        let [from, to] = [from, to].map(|edge| self.cruise.ripple_until(self.flow.motion, self.flow.since(edge)));
        std::array::from_fn(|k| smooth[k] + (to[k] - from[k]))
    }

    fn extent(&self, from: Option<u64>, to: Option<u64>) -> [Extent; 2] {
        let mut extents = [Extent::NONE; 2];
        self.look(self.flow.since(from), self.flow.since(to), &mut extents);
        extents
    }
}

impl Waves<'_, '_> {
    /// Includes the values from one edge to another. If the smooth motion is monotone, the extremes lie in the first
    /// and in the last period.
    fn look(&self, from: u64, to: u64, extents: &mut [Extent; 2]) {
        let period = self.cruise.period_edges();
        if to - from <= 2 * period {
            return self.walk(from, to, extents);
        }
        if self.flow.guards.iter().all(|guard| self.goes_one_way(guard, from, to)) {
            self.walk(from, from + period, extents);
            return self.walk(to - period, to, extents);
        }
        let middle = from + ((to - from) / 2).div_ceil(period) * period;
        self.look(from, middle, extents);
        self.look(middle, to, extents);
    }

    fn goes_one_way(&self, guard: &Guard, from: u64, to: u64) -> bool {
        let motion = self.flow.motion;
        let [a, b] = [from, to].map(|edge| MotionPoint::of(motion, edge));
        let Some([second, _]) = guard.derivatives(dyadic(to - from)) else { return false };
        let (length_s, bend) = ((to - from) as f64 * motion.system().edge_s(), dot(&second, &sizes(&a.w)));
        let [slope, later] = [guard.value(&a.w), guard.value(&b.w)];
        slope * later >= 0.0 && slope.abs() + later.abs() >= bend * length_s
            || 0.125 * bend * length_s * length_s <= ROUNDING * guard.value(&a.x).abs().max(guard.value(&b.x).abs())
    }

    /// Includes the values pulse by pulse.
    fn walk(&self, from: u64, to: u64, extents: &mut [Extent; 2]) {
        let mut edge = from;
        while edge < to {
            let (begun, ended, motion) = self.cruise.pulse(self.flow.motion, edge);
            let ends = [edge, ended.min(to)].map(|edge| MotionPoint::of(&motion, edge - begun));
            for (guard, extent) in self.flow.guards.iter().zip(&mut *extents) {
                ends.iter().for_each(|end| extent.take(guard.value(&end.x)));
                turns(&motion, guard, ends[0], ends[1], extent);
            }
            edge = ended;
        }
    }
}
