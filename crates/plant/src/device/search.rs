//! The search for the next event of a device: an encoder's edge, or the end of a mode.

use super::known::Ahead;
use super::modes::Check;
use super::{Device, Drive, Event};
use crate::axis::Shaft;
use crate::flow::double::{Double, Product, versions};
use crate::flow::guard::{Band, Forecast, Guard, Limits, MotionPoint, STEADY, Watch, dyadic};
use crate::flow::matrix::{SPEED, State};

/// The least number of edges that the next event is searched for.
const NEAR: u64 = 64;
/// The greatest number of edges over which a quick look is tried where `NEAR` would do.
const FAR: f64 = 4096.0;
/// The least number of edges for which the bounds of the errors are made.
pub(super) const HEARD: u64 = 4096;
/// The greatest number of edges that a search looks ahead at a time.
const FARTHEST: f64 = 65536.0;

impl<'a> Device<'a> {
    /// Makes sure that the bounds of the errors hold this number of edges after the anchor.
    #[inline(always)]
    pub(super) fn hear(&mut self, edges: u64) {
        if edges >= self.known.heard {
            self.listen(edges);
        }
    }

    #[inline(always)]
    fn listen(&mut self, edges: u64) {
        // Farther than asked: the searches that follow ask for more, and a longer time hardly adds to the bounds.
        // An end beyond the tables is not reached in one leap.
        let edges = edges.max(HEARD);
        let dyadic = dyadic(edges).min(self.motion.system().dyadic() - 1);
        // Of a motion that is new, nothing else is known either.
        (self.known.heard, self.known.kept) = ((1 << dyadic) + 1, 0);
        let check = |index: usize| {
            self.checks[index].as_ref().map_or(0.0, |check| check.guard.noise(&self.motion, dyadic, &check.limits))
        };
        let anywhere = Limits { low: Double::ZERO, high: Double::ZERO, open: true };
        self.known.noise = [self.mode.angle.noise(&self.motion, dyadic, &anywhere), check(0), check(1)];
    }

    /// Returns whether an angle is within a band by more than the error of its `f64` value.
    #[inline(always)]
    pub fn is_surely_within(&mut self, edge: u64, angle_rad: f64, (low_rad, high_rad): (f64, f64)) -> bool {
        if self.cruise.is_some() {
            // The limits of a cruise are narrower by far more than this error.
            return angle_rad > low_rad && angle_rad < high_rad;
        }
        self.hear(edge - self.anchor);
        angle_rad - low_rad > self.known.noise[0] && high_rad - angle_rad > self.known.noise[0]
    }

    /// Returns where the angle lies with respect to the band from `low_rad`, inclusive, to `high_rad`, at an edge where
    /// its `f64` value is `angle_rad`: -1 below, 0 inside, 1 above. Decided in double-double where `f64` cannot tell.
    pub fn side_of_band(&mut self, edge: u64, angle_rad: f64, (low_rad, high_rad): (f64, f64)) -> i8 {
        if self.cruise.is_some() {
            return i8::from(angle_rad >= high_rad) - i8::from(angle_rad < low_rad);
        }
        let edges = edge - self.anchor;
        self.hear(edges);
        let limits = Limits::from(&Band { low: low_rad, high: high_rad, open: true });
        let mut watch = Watch { motion: &self.motion, limits, noise: self.known.noise[0], again: &mut self.redecided };
        self.mode.angle.side(&mut watch, edges, angle_rad).way()
    }

    /// Returns the first edge in (`from`, `to`] at which a mode ends or the angle leaves `[low_rad, high_rad)`, where
    /// neither has happened at `from`; or the end of a [`cruise`](Self::cruise).
    #[must_use]
    #[inline]
    pub fn next_event(&mut self, from: u64, to: u64, band_rad: (f64, f64)) -> Option<Event> {
        let ahead = &self.known.ahead;
        if ahead.holds(from, to, band_rad) {
            return ahead.event.filter(|event| event.0 <= to);
        }
        self.look_for(from, to, band_rad)
    }

    versions! {
        /// Searches for the [`next_event`](Self::next_event).
        fn look_for[look_for_fused, look_for_native, look_for_with](
            self: &mut Self, from: u64, to: u64, band_rad: (f64, f64)
        ) -> Option<Event>
    }

    #[inline(always)]
    fn look_for_with<P: Product>(&mut self, from: u64, to: u64, band_rad: (f64, f64)) -> Option<Event> {
        if let Some(end) = self.cruise_end() {
            return (to >= end).then(|| (end, self.motion.at(end - self.anchor)));
        }
        if to == from {
            return None;
        }
        let (first, mut last) = (from - self.anchor, to - self.anchor);
        let ahead = &self.known.ahead;
        let is_clear = ahead.until >= from && ahead.band_rad == band_rad && ahead.event.is_none();
        let a = match self.known.found {
            // A search often begins where the one before has found a count, or a few edges after one that has found
            // nothing.
            Some(point) if point.edge == first || is_clear && first - point.edge <= NEAR => point,
            _ => MotionPoint::of_with::<P>(&self.motion, first),
        };
        let encoder = Limits::from(&Band { low: band_rad.0, high: band_rad.1, open: true });
        let most = 1 << (self.motion.system().dyadic() - 1).min(62);
        let is_short = last < first + NEAR;
        // A short search costs as much as a longer one, and similar searches follow, because edges come through the
        // datapath one by one.
        if is_short && first + NEAR < most {
            let way = self.way(&encoder, &a);
            // Gates are switched within a period of some thousand edges.
            let reach = if matches!(self.drive, Drive::Gates(_)) { FAR } else { FARTHEST };
            if way < reach && self.shaft != Shaft::Stuck {
                // The next event is probably a count.
                let forecast = self.mode.angle.forecast(&self.motion, &encoder, &a);
                let far = a.edge + forecast.late();
                if forecast.edges < reach && far < most {
                    self.hear(far);
                    if self.keeps_mode(&a, far)
                        && let Some(point) = self.pursue::<P>(&encoder, &a, forecast)
                    {
                        let event = (self.anchor + point.edge, point.x);
                        self.known.ahead = Ahead { until: event.0, band_rad, event: Some(event) };
                        self.known.found = Some(point);
                        return Some(event).filter(|event| event.0 <= to);
                    }
                }
            }
            // A quick look over most of the way to the next count often settles all of them.
            let far = first + (0.75 * way).min(FAR) as u64;
            if far > first + NEAR && far < most {
                self.hear(far);
                if self.doubtful(&encoder, &a, far - a.edge) == [false; 3] {
                    self.known.ahead = Ahead { until: self.anchor + far, band_rad, event: None };
                    self.known.found = Some(a);
                    return None;
                }
            }
            last = first + NEAR;
        }
        self.hear(last);
        self.known.found = Some(a);
        let (until, doubtful, end) = self.settle::<P>(&encoder, &a, last);
        let mut event = None;
        if doubtful != [false; 3] {
            event = self.search::<P>(&encoder, a, until, doubtful);
        }
        if event.is_none()
            && let Some(end) = end
        {
            self.known.found = Some(end);
            event = Some((self.anchor + end.edge, end.x));
        }
        self.known.ahead = Ahead { until: self.anchor + last, band_rad, event };
        event.filter(|event| event.0 <= to)
    }

    /// Returns the point after `from` at which the angle leaves its band, if its forecast there can be proved.
    #[inline(always)]
    fn pursue<P: Product>(&mut self, encoder: &Limits, from: &MotionPoint, forecast: Forecast) -> Option<MotionPoint> {
        let (motion, noise) = (&self.motion, self.known.noise[0]);
        let mut watch = Watch { motion, limits: *encoder, noise, again: &mut self.redecided };
        self.mode.angle.pursue::<P>(&mut watch, from, forecast, &mut self.known.steady)
    }

    /// Returns the edges that the angle takes for a count at the speed of a point, between [`NEAR`] and [`FARTHEST`].
    #[inline(always)]
    fn way(&self, encoder: &Limits, from: &MotionPoint) -> f64 {
        let gap_s = (encoder.high.hi - encoder.low.hi) / from.x[SPEED].abs();
        (gap_s / self.motion.system().edge_s()).clamp(NEAR as f64, FARTHEST)
    }

    /// Returns whether a quick look leaves open that a function leaves its band within this number of edges after a
    /// point: those of the checks, then the angle.
    #[inline(always)]
    fn doubtful(&self, encoder: &Limits, from: &MotionPoint, edges: u64) -> [bool; 3] {
        let [first, second] = self.ends_of_modes(from, edges);
        let angle = self.shaft != Shaft::Stuck
            && !self.mode.angle.stays(&self.motion, encoder, self.known.noise[0], from, edges);
        [first, second, angle]
    }

    /// Returns whether quick looks show that the mode lasts from a point to an edge. They look farther than that, for
    /// the searches that follow.
    #[inline(always)]
    fn keeps_mode(&mut self, from: &MotionPoint, last: u64) -> bool {
        if last <= self.known.kept || self.checks.iter().all(Option::is_none) {
            return true;
        }
        let edges = last - from.edge;
        let beyond = from.edge + STEADY * edges;
        if dyadic(beyond) < self.motion.system().dyadic() {
            self.hear(beyond);
            if self.ends_of_modes(from, beyond - from.edge) == [false; 2] {
                self.known.kept = beyond;
                return true;
            }
        }
        self.ends_of_modes(from, edges) == [false; 2]
    }

    /// Returns for each check whether a quick look leaves open that it ends the mode within this number of edges after
    /// a point.
    #[inline(always)]
    fn ends_of_modes(&self, from: &MotionPoint, edges: u64) -> [bool; 2] {
        let mut doubtful = [false; 2];
        for (index, check) in self.checks.iter().enumerate() {
            if let Some(Check { guard, limits, .. }) = check {
                doubtful[index] = !guard.stays(&self.motion, limits, self.known.noise[index + 1], from, edges);
            }
        }
        doubtful
    }

    /// Returns the function of a check (0 or 1) or of the angle (2), and how to decide where it lies.
    #[inline(always)]
    fn watched(&mut self, index: usize, encoder: &Limits) -> (&'a Guard, Watch<'_, 'a>) {
        let (guard, limits, noise) = match self.checks.get(index) {
            Some(Some(check)) => (check.guard, check.limits, self.known.noise[index + 1]),
            _ => (&self.mode.angle, *encoder, self.known.noise[0]),
        };
        (guard, Watch { motion: &self.motion, limits, noise, again: &mut self.redecided })
    }

    /// Returns what is [`doubtful`](Self::doubtful) from a point to an edge, and that edge: `last`, or the end of the
    /// mode, which is returned too if it is found at once. Both edges are counted from the anchor.
    #[inline(always)]
    fn settle<P: Product>(
        &mut self,
        encoder: &Limits,
        from: &MotionPoint,
        last: u64,
    ) -> (u64, [bool; 3], Option<MotionPoint>) {
        let (Shaft::Slip(1 | -1), [Some(_), None]) = (self.shaft, &self.checks) else {
            return (last, self.doubtful(encoder, from, last - from.edge), None);
        };
        let mut end = None;
        if self.ends_of_modes(from, last - from.edge)[0] {
            end = self.expect(0, encoder, from, last);
            if end.is_none() {
                return (last, [true, false, true], None);
            }
        }
        let reach = end.map_or(last, |end| end.edge);
        let state = end.as_ref().map(|end| &end.x);
        (reach, [false, false, !self.slides_inside::<P>(encoder, from, reach, state)], end)
    }

    /// Returns whether a shaft certainly slides from a point to an edge, counted from the anchor, without a count. The
    /// state there is computed if need be. Until its speed ends the mode, the angle moves in one direction. So it does
    /// on the smooth motion of a cruise: its slope is the speed there less the mean of the speed's ripple, and the
    /// limits of the speed are narrowed by more than the ripple.
    #[inline(always)]
    fn slides_inside<P: Product>(
        &self,
        encoder: &Limits,
        from: &MotionPoint,
        edge: u64,
        state: Option<&State>,
    ) -> bool {
        let Shaft::Slip(sign @ (1 | -1)) = self.shaft else { return false };
        self.mode.angle.moves_inside::<P>(
            &self.motion,
            encoder,
            self.known.noise[0],
            (from, sign.into()),
            (edge, state),
        )
    }

    /// Returns the first event from a point to the edge `last`, both counted from the anchor, of the functions that a
    /// quick look over all of this time leaves [`doubtful`](Self::doubtful).
    #[inline(always)]
    fn search<P: Product>(
        &mut self,
        encoder: &Limits,
        mut a: MotionPoint,
        last: u64,
        doubtful: [bool; 3],
    ) -> Option<Event> {
        let first = a.edge;
        let mut events = (0..3).filter(|&index| doubtful[index]);
        let foremost = events.next().expect("a function in doubt");
        if let Some(mut soonest) = self.expect(foremost, encoder, &a, last) {
            for index in events {
                let (guard, mut watch) = self.watched(index, encoder);
                soonest = guard.exit(&mut watch, &a, &soonest).unwrap_or(soonest);
            }
            self.known.found = Some(soonest);
            return Some((self.anchor + soonest.edge, soonest.x));
        }
        while a.edge < last {
            // Searches a little farther than the next encoder edge is away at this speed.
            let end = last.min(a.edge + (1.25 * self.way(encoder, &a)) as u64);
            let b = MotionPoint::of_with::<P>(&self.motion, end);
            let mut found: Option<MotionPoint> = None;
            for (index, _) in doubtful.iter().enumerate().filter(|(_, doubtful)| **doubtful) {
                // Events of other functions after this one do not matter. All of the time has had its quick look.
                let to = found.as_ref().unwrap_or(&b);
                if index == 2 && self.slides_inside::<P>(encoder, &a, to.edge, Some(&to.x)) {
                    continue;
                }
                let (guard, mut watch) = self.watched(index, encoder);
                let is_all = a.edge == first && to.edge == last;
                let sought = if is_all { guard.seek(&mut watch, &a, to) } else { guard.exit(&mut watch, &a, to) };
                if sought.is_some() {
                    found = sought;
                }
            }
            if let Some(MotionPoint { edge, x, .. }) = found {
                self.known.found = found;
                return Some((self.anchor + edge, x));
            }
            a = b;
        }
        None
    }

    /// Returns the first exit of one function after a point, if its forecast there can be proved up to the edge `last`.
    #[inline(always)]
    fn expect(&mut self, index: usize, encoder: &Limits, from: &MotionPoint, last: u64) -> Option<MotionPoint> {
        let (guard, mut watch) = self.watched(index, encoder);
        let forecast = guard.forecast(watch.motion, &watch.limits, from);
        let reach = last - from.edge;
        if forecast.edges < reach as f64 {
            guard.confirm(&mut watch, from, forecast, forecast.late().min(reach))
        } else {
            None
        }
    }
}
