//! The figures of a cruise between the rows of a trace.

use std::array::from_fn;

use super::cruise::{Cruise, Shape};
use crate::flow::gauge::{Extent, Flow, ROUNDING, Stretch, blur, reach, turns};
use crate::flow::guard::{Guard, MotionPoint, dyadic};
use crate::flow::matrix::{dot, sizes};

/// Current and speed on a cruise: the smooth motion and the ripple, which is the same in every period.
pub(super) struct Waves<'m, 'a> {
    pub(super) cruise: &'m Cruise<'a>,
    pub(super) flow: Flow<'m, 'a>,
}

impl Stretch<2> for Waves<'_, '_> {
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; 2] {
        let (smooth, shape) = (self.flow.integral(from, to), self.shape());
        let [from, to] =
            [from, to].map(|edge| self.cruise.ripple_until(self.flow.motion.system(), shape, self.flow.since(edge)));
        from_fn(|k| smooth[k] + (to[k] - from[k]))
    }

    fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; 2]) {
        let [from, to] = [from, to].map(|edge| MotionPoint::of(self.flow.motion, self.flow.since(edge)));
        let mut parts = Vec::new();
        self.part(from, to, extents, &mut parts);
        // Between the ends, most parts of a steady drift lie inside.
        if parts.len() > 2 {
            let last = parts.len() - 1;
            parts.swap(1, last);
        }
        parts.iter().for_each(|part| self.search(part, extents));
    }
}

/// A part of a cruise in which an extreme may lie.
struct Part {
    from: u64,
    to: u64,
    /// For each output an extent that it does not leave, and a bound of the error of its values.
    kept: [(Extent, f64); 2],
}

/// The smooth course of an output between two points.
struct Course {
    values: [f64; 2],
    slopes: [f64; 2],
    length_s: f64,
    /// Bound of the second derivative; infinite if the tables do not reach as far.
    bend: f64,
}

impl Course {
    fn of(guard: &Guard, a: &MotionPoint, b: &MotionPoint, edge_s: f64) -> Self {
        let edges = b.edge - a.edge;
        let bend = guard.derivatives(dyadic(edges)).map(|[second, _]| dot(&second, &sizes(&a.w)));
        Self {
            values: [&a.x, &b.x].map(|x| guard.value(x)),
            slopes: [&a.w, &b.w].map(|w| guard.value(w)),
            length_s: edges as f64 * edge_s,
            bend: bend.unwrap_or(f64::INFINITY),
        }
    }

    fn goes_one_way(&self) -> bool {
        let Self { bend, values, slopes, length_s } = *self;
        slopes[0] * slopes[1] >= 0.0 && slopes[0].abs() + slopes[1].abs() >= bend * length_s
            || 0.125 * bend * length_s * length_s <= ROUNDING * values[0].abs().max(values[1].abs())
    }

    /// Returns an extent that the course does not leave.
    fn whole(&self) -> Extent {
        reach(self.values, self.slopes, self.bend, self.length_s)
    }

    /// Returns an extent that the course does not leave within a time after its start (`end` 0) or before its end (1).
    fn near(&self, end: usize, time_s: f64) -> Extent {
        let (value, way) = (self.values[end], if end == 0 { self.slopes[0] } else { -self.slopes[1] } * time_s);
        let more = 0.5 * self.bend * time_s * time_s;
        Extent { least: value + way.min(0.0) - more, greatest: value + way.max(0.0) + more }
    }
}

impl Waves<'_, '_> {
    fn shape(&self) -> &Shape {
        self.cruise.shape(self.flow.motion, self.flow.guards)
    }

    /// Finds the parts between two points of the smooth motion that are to be searched: none whose values certainly lie
    /// inside the extents; if the smooth motion is monotone, the first and the last period alone.
    fn part(&self, a: MotionPoint, b: MotionPoint, extents: &[Extent; 2], parts: &mut Vec<Part>) {
        let (motion, shape, period) = (self.flow.motion, self.shape(), self.cruise.period_edges());
        let (from, to, edge_s) = (a.edge, b.edge, motion.system().edge_s());
        let courses = self.flow.guards.map(|guard| Course::of(guard, &a, &b, edge_s));
        let blurs: [_; 2] = from_fn(|k| blur(motion, self.flow.guards[k], to) + shape.blurs[k]);
        let kept = |smooth: &dyn Fn(&Course) -> Extent| {
            from_fn(|k| {
                let (smooth, ripple) = (smooth(&courses[k]), &shape.extents[k]);
                let sum = Extent { least: smooth.least + ripple.least, greatest: smooth.greatest + ripple.greatest };
                (sum, blurs[k])
            })
        };
        let all = Part { from, to, kept: kept(&Course::whole) };
        if all.open(extents) == [false; 2] {
            return;
        }
        if to - from <= 2 * period {
            return parts.push(all);
        }
        if courses.iter().all(Course::goes_one_way) {
            let period_s = period as f64 * edge_s;
            let near = [from, to - period].into_iter().enumerate();
            parts.extend(near.map(|(end, from)| Part {
                from,
                to: from + period,
                kept: kept(&|course| course.near(end, period_s)),
            }));
            return;
        }
        let middle = MotionPoint::of(motion, from + ((to - from) / 2).div_ceil(period) * period);
        self.part(a, middle, extents, parts);
        self.part(middle, b, extents, parts);
    }

    /// Includes the values of a part, pulse by pulse.
    fn search(&self, part: &Part, extents: &mut [Extent; 2]) {
        let open = part.open(extents);
        let mut edge = if open == [false; 2] { part.to } else { part.from };
        while edge < part.to {
            let (begun, ended, motion) = self.cruise.pulse(self.flow.motion, edge);
            let ends = [edge, ended.min(part.to)].map(|edge| MotionPoint::of(&motion, edge - begun));
            for ((guard, extent), _) in self.flow.guards.iter().zip(&mut *extents).zip(open).filter(|(_, open)| *open) {
                ends.iter().for_each(|end| extent.take(guard.value(&end.x)));
                turns(&motion, guard, ends[0], ends[1], extent);
            }
            edge = ended;
        }
    }
}

impl Part {
    /// Returns for each output whether it may leave the extent.
    fn open(&self, extents: &[Extent; 2]) -> [bool; 2] {
        from_fn(|k| !extents[k].holds(&self.kept[k].0, self.kept[k].1))
    }
}
