//! The first edge at which a linear function of the state leaves a band. It is found without stepping, and none is
//! missed.
//!
//! For `g = c·x` every derivative is linear in the slope `w = x'` as well, and bounded over an interval through
//! `|c Aᵏ| · max|e^{At}| · |w|`. The first of these bounds already shows most intervals to be free of exits. The second
//! derivative lies between its values at the ends, within a bound of its own curvature. This limits how far `g` can sag
//! below or bulge above its chord: an interval whose ends lie in the band and whose chord stays clear of the limits
//! contains no exit. A function that leaves through a limit toward which it bends, or toward which it moves throughout,
//! leaves exactly once, and a few secant steps find that edge. An interval that neither argument decides is halved,
//! down to single edges.
//!
//! # How it is decided
//!
//! Whether `g` is outside at an edge is decided on its `f64` value if that is farther from the limits than its error
//! can reach, and otherwise on its double-double value ([`Guard::side`]). So every decision is the exact one, for every
//! caller and from every starting edge. The error, with `u` = 2⁻⁵³, `M` ≥ |e^{At}| up to the time `T` of the edge, `d`
//! digits of the edge count, and |x₀|, |w₀| of the anchor, all element by element:
//!
//! - rounding the double-double slope, and `w ← w + (A P) w` at each digit, with |A P| ≤ M + I: the slope errs by at
//!   most `e = u M (I + 5.2 d (M + I) M) |w₀|` ([`Linear::slope_error`]);
//! - rounding the anchor, and `x ← x + P w` at each digit, with Σ|P| ≤ T M: the state errs by at most
//!   `u (d + 1) (|x₀| + T M |w₀|) + T M (4.2 u M |w₀| + e)`;
//! - the products and sums of `c·x`: at most `4 u |c| (|x₀| + T M |w₀|)`, and the limits' own rounding, `u` of their
//!   size.
//!
//! [`Guard`] keeps twice the sum as two rows, for |x₀| and |w₀|, so that it also covers the terms of second order and
//! the slope's error times `T`.
//!
//! # The order of looks
//!
//! - A quick look comes first: a parabola from the present state that bends toward the limit as fast as the motion can.
//!   Where it keeps clear of the limit, nothing else is computed. This settles most stretches.
//! - Else value and three derivatives forecast the exit. Newton's steps close in on the edge; slopes and curvatures at
//!   both ends then prove that it is the first (`Guard::confirm`). What they do not prove is searched as above.
//! - Where the slope lets it, the direction is proved for eight times as long (`Guard::pursue`): the counts that
//!   follow then need Newton's steps alone.

use std::cmp::Ordering;

use crate::flow::double::{Double, Doubles, Product, versions};
use crate::flow::lanes::{Count, Size};
use crate::flow::linear::Trajectory;
use crate::flow::matrix::{Columns, State, dot, plus, row_times, sizes};
use crate::{Linear, Matrix};

/// Unit roundoff of an `f64`.
const UNIT: f64 = 0.5 * f64::EPSILON;

/// Values from `low`, inclusive, to `high`; either may be infinite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Band {
    /// The value leaves the band when it is below this.
    pub low: f64,
    /// The value leaves the band when it is above this, or equal to it if `open`.
    pub high: f64,
    /// Whether `high` itself is outside.
    pub open: bool,
}

impl Band {
    /// Returns whether a value is outside.
    #[inline(always)]
    pub fn left_by(&self, value: f64) -> bool {
        value < self.low || if self.open { value >= self.high } else { value > self.high }
    }
}

/// A band whose limits are known to double-double.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Limits {
    pub low: Double,
    pub high: Double,
    pub open: bool,
}

/// The position of a value with respect to a band.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Side {
    Below,
    Inside,
    Above,
}

impl Side {
    /// Returns -1 below, 0 inside, 1 above.
    #[inline(always)]
    pub fn way(self) -> i8 {
        match self {
            Self::Below => -1,
            Self::Inside => 0,
            Self::Above => 1,
        }
    }
}

impl From<&Band> for Limits {
    #[inline(always)]
    fn from(band: &Band) -> Self {
        Self { low: band.low.into(), high: band.high.into(), open: band.open }
    }
}

impl Limits {
    /// All values.
    pub const ANY: Self = Self { low: Double::LEAST, high: Double::MOST, open: false };
    /// Values of zero and above.
    pub const POSITIVE: Self = Self { low: Double::ZERO, ..Self::ANY };
    /// Values of zero and below.
    pub const NEGATIVE: Self = Self { high: Double::ZERO, ..Self::ANY };

    /// Returns the side on which an exact value lies.
    #[inline(always)]
    pub fn side(&self, value: Double) -> Side {
        let most = if self.open { Ordering::Less } else { Ordering::Equal };
        if value.order(self.low) == Ordering::Less {
            Side::Below
        } else if value.order(self.high) > most {
            Side::Above
        } else {
            Side::Inside
        }
    }

    /// Returns the limits moved inward, if they are finite.
    pub fn narrowed(&self, margin: f64) -> Self {
        let moved = |limit: Double, by: f64| if limit.hi.is_finite() { limit + by.into() } else { limit };
        Self { low: moved(self.low, margin), high: moved(self.high, -margin), ..*self }
    }

    /// Returns the sum of the sizes of the finite limits; their rounding is proportional to it.
    #[inline(always)]
    fn size(&self) -> f64 {
        let finite = |limit: f64| if limit.is_finite() { limit.abs() } else { 0.0 };
        finite(self.low.hi) + finite(self.high.hi)
    }
}

/// A state of a motion and its slope, at an edge.
#[derive(Clone, Copy)]
pub struct MotionPoint<const N: usize = 4> {
    /// Edges since the anchor.
    pub edge: u64,
    /// The state.
    pub x: State<N>,
    /// Its slope.
    pub w: State<N>,
}

impl<const N: usize> MotionPoint<N>
where
    Count<N>: Size<N>,
{
    /// Returns the point of a motion at an edge.
    #[inline(always)]
    pub fn of(motion: &Trajectory<N>, edge: u64) -> Self {
        let (x, w) = if edge == 0 { (motion.x.hi, motion.w.hi) } else { motion.at_with_slope(edge) };
        Self { edge, x, w }
    }

    /// Returns the point of a motion at an edge, for a function that is compiled for a two-product; of more than four
    /// states by a function of its own.
    #[inline(always)]
    pub(crate) fn of_with<P: Product>(motion: &Trajectory<N>, edge: u64) -> Self {
        let (x, w) = if N > 4 { motion.at_with_slope(edge) } else { motion.slope_with::<P>(edge) };
        Self { edge, x, w }
    }
}

/// The parameters of a decision: the motion, the band, and the error of the values.
pub(crate) struct Watch<'m, 'a, const N: usize = 4> {
    pub motion: &'m Trajectory<'a, N>,
    pub limits: Limits,
    /// Bound of the error of the values.
    pub noise: f64,
    /// Counts the decisions made in double-double.
    pub again: &'m mut u64,
}

/// A linear function of the state, with the bounds of its derivatives for one system.
pub struct Guard<const N: usize = 4> {
    row: State<N>,
    /// Index of the state, if the row picks a single one: then the value is exact.
    pick: Option<usize>,
    /// Coefficients of the second derivative as a function of the slope.
    bend: State<N>,
    /// Coefficients of the third derivative as a function of the slope.
    third: State<N>,
    /// Coefficients of the fourth derivative as a function of the slope.
    fourth: State<N>,
    /// Bounds for each dyadic length.
    bounds: Vec<Bounds<N>>,
}

/// Coefficients of the slope's sizes that bound the derivatives over an interval, and coefficients of anchor and slope
/// that bound the error of the values.
struct Bounds<const N: usize> {
    /// Rows for the first derivative to the fourth.
    derivatives: Columns<N, 4>,
    noise_x: State<N>,
    noise_w: State<N>,
    /// The slope's error in the bulge over the interval, wherever the interval lies.
    noise_bulge: State<N>,
}

/// Distance to a limit at the start, its slope there, distance at the end, least and greatest second derivative.
type Sight = (f64, f64, f64, f64, f64);

/// The exit that a course lets expect.
#[derive(Clone, Copy)]
pub(crate) struct Forecast {
    /// Edges after the point; NaN or negative if the course shows no exit.
    pub edges: f64,
    /// The direction: 1 through the upper limit, -1 through the lower.
    pub rising: f64,
}

impl Forecast {
    /// Returns the greatest number of edges after which the exit is looked for.
    #[inline(always)]
    pub fn late(&self) -> u64 {
        (1.25 * self.edges.max(0.0)) as u64 + 2
    }
}

/// How long a function certainly moves in one direction, by more than the noise per edge.
#[derive(Clone, Copy)]
pub(crate) struct Steady {
    /// The last edge after the anchor; 0 if nothing is known.
    pub until: u64,
    /// The direction: 1 up, -1 down.
    rising: f64,
    /// A bound of the second derivative until then.
    second: f64,
}

impl Steady {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { until: 0, rising: 1.0, second: 0.0 };
}

/// The length over which a direction, or a mode, is proved to last, in times of the way to the exit that is looked for:
/// others follow it.
pub(crate) const STEADY: u64 = 8;

enum Verdict<const N: usize> {
    Clear,
    Split(u64),
    At(MotionPoint<N>),
}

/// Returns the exponent of the least power of two that is not below a number of edges.
#[inline(always)]
pub(crate) fn dyadic(edges: u64) -> usize {
    if edges <= 1 { 0 } else { (u64::BITS - (edges - 1).leading_zeros()) as usize }
}

impl<const N: usize> Guard<N>
where
    Count<N>: Size<N>,
{
    /// Creates the function `row · x` on a system.
    pub fn new(row: State<N>, system: &Linear<N>) -> Self {
        let a: &Matrix<N> = system.matrix();
        let bend = row_times(&row, a);
        let third = row_times(&bend, a);
        let fourth = row_times(&third, a);
        let used: Vec<usize> = (0..N).filter(|&k| row[k] != 0.0).collect();
        let pick = (used.len() == 1 && row[used[0]] == 1.0).then(|| used[0]);
        let late = &system.slope_error(system.dyadic() - 1).rows();
        let bounds = (0..system.dyadic()).map(|dyadic| {
            let m = system.bound(dyadic);
            let bound = |r: &State<N>| row_times(&sizes(r), m);
            let digits = Linear::<N>::digits(dyadic) as f64;
            let length_s = (1u64 << dyadic.min(62)) as f64 * system.edge_s();
            let (first, second) = (bound(&row), bound(&bend));
            let (twice, slopes) = (row_times(&first, m), row_times(&first, &system.slope_error(dyadic).rows()));
            Bounds {
                derivatives: Columns::of(&[first, second, bound(&third), bound(&fourth)]),
                noise_bulge: row_times(&second, late).map(|c| 0.5 * length_s * length_s * c),
                noise_x: sizes(&row).map(|c| 2.0 * UNIT * (digits + 5.0) * c),
                noise_w: std::array::from_fn(|k| {
                    length_s * (2.0 * UNIT * ((digits + 5.0) * first[k] + 4.2 * twice[k]) + slopes[k])
                }),
            }
        });
        Self { row, pick, bend, third, fourth, bounds: bounds.collect() }
    }

    /// Returns the function's coefficients.
    pub fn row(&self) -> &State<N> {
        &self.row
    }

    /// Returns the value at a state.
    #[inline(always)]
    pub fn value(&self, x: &State<N>) -> f64 {
        match self.pick {
            Some(index) => x[index],
            None => dot(&self.row, x),
        }
    }

    /// Returns a bound of the error of the `f64` value at every edge up to 2^`dyadic` after the anchor of a motion.
    #[inline(always)]
    pub(crate) fn noise(&self, motion: &Trajectory<N>, dyadic: usize, limits: &Limits) -> f64 {
        let bounds = &self.bounds[dyadic];
        dot(&bounds.noise_x, &sizes(&motion.x.hi))
            + dot(&bounds.noise_w, &sizes(&motion.w.hi))
            + 4.0 * UNIT * limits.size()
    }

    /// Returns the part of [`noise`](Self::noise) that follows from an anchor's slope.
    pub(crate) fn blur(&self, dyadic: usize, slope: &State<N>) -> f64 {
        self.bounds.get(dyadic).map_or(0.0, |bounds| dot(&bounds.noise_w, &sizes(slope)))
    }

    /// Returns whether a state that is exact but for the rounding to `f64` certainly lies inside.
    #[inline(always)]
    pub(crate) fn is_surely_inside(&self, x: &State<N>, limits: &Limits) -> bool {
        let (value, blur) = (self.value(x), 8.0 * UNIT * dot(&sizes(&self.row), &sizes(x)));
        let margin = |limit: f64| blur + 4.0 * UNIT * limit.abs();
        let (low, high) = (limits.low.hi, limits.high.hi);
        (low == f64::NEG_INFINITY || value - low > margin(low))
            && (high == f64::INFINITY || high - value > margin(high))
    }

    /// Returns the side on which the function lies at an edge where its `f64` value is `value`.
    #[inline(always)]
    pub(crate) fn side(&self, watch: &mut Watch<N>, edge: u64, value: f64) -> Side {
        let (above_low, below_high) = (value - watch.limits.low.hi, watch.limits.high.hi - value);
        if above_low > watch.noise && below_high > watch.noise {
            Side::Inside
        } else if above_low < -watch.noise {
            Side::Below
        } else if below_high < -watch.noise {
            Side::Above
        } else {
            self.side_again(watch, edge)
        }
    }

    #[cold]
    fn side_again(&self, watch: &mut Watch<N>, edge: u64) -> Side {
        *watch.again += 1;
        watch.limits.side(self.exact(watch.motion, edge))
    }

    versions! {
        /// Returns the function's value at an edge, in double-double.
        pub(crate) fn exact[exact_fused, exact_native, exact_with](
            self: &Self, motion: &Trajectory<N>, edge: u64
        ) -> Double
    }

    #[inline(always)]
    fn exact_with<P: Product>(&self, motion: &Trajectory<N>, edge: u64) -> Double {
        self.exact_value::<P>(&motion.flow::<P>(edge))
    }

    /// Returns the value at a state in double-double.
    #[inline(always)]
    pub(crate) fn exact_value<P: Product>(&self, x: &Doubles<N>) -> Double {
        match self.pick {
            Some(index) => x.lane(index),
            None => x.dot::<P>(&self.row),
        }
    }

    /// Returns the function's slope where the state's slope is `w`.
    #[inline(always)]
    fn slope(&self, w: &State<N>) -> f64 {
        self.value(w)
    }

    /// Returns the second derivative where the state's slope is `w`.
    #[inline(always)]
    pub(crate) fn curvature(&self, w: &State<N>) -> f64 {
        dot(&self.bend, w)
    }

    /// Returns coefficients of the slope's sizes that bound the second and the fourth derivative over 2^`dyadic` edges;
    /// `None` if they are not tabulated.
    #[inline(always)]
    pub(crate) fn derivatives(&self, dyadic: usize) -> Option<[State<N>; 2]> {
        self.bounds.get(dyadic).map(|bounds| [1, 3].map(|order| bounds.derivatives.row(order)))
    }

    /// Returns the greatest size of the function over 2^`dyadic` edges of the system's flow without a drive, from a
    /// state of these sizes.
    pub(crate) fn bound(&self, dyadic: usize, sizes: &State<N>) -> f64 {
        dot(&self.bounds[dyadic].derivatives.row(0), sizes)
    }

    /// Returns a bound of the second derivative over 2^`dyadic` edges from a state whose slope is `w`.
    pub(crate) fn bend(&self, dyadic: usize, w: &State<N>) -> f64 {
        self.bounds[dyadic].derivatives.times(&sizes(w))[1]
    }

    /// Returns whether the function certainly stays inside for this number of edges after a point inside, by its slope
    /// there and the greatest second derivative; `true` if nothing moves it.
    ///
    /// On the side of a limit the function is not beyond a parabola that bends toward the limit. Such a parabola comes
    /// nearest to the limit at one end of any stretch: here at the last edge, and at the point itself or, where the
    /// function moves away from the limit, at the edge after it.
    #[inline(always)]
    pub(crate) fn stays(
        &self,
        motion: &Trajectory<N>,
        limits: &Limits,
        noise: f64,
        from: &MotionPoint<N>,
        edges: u64,
    ) -> bool {
        let Some(bounds) = self.bounds.get(dyadic(edges)) else { return false };
        let speeds = sizes(&from.w);
        let edge_s = motion.system().edge_s();
        let length_s = edges as f64 * edge_s;
        let (value, slope) = (self.value(&from.x), self.slope(&from.w));
        let [first, second, ..] = bounds.derivatives.times(&speeds);
        // The error of a value is below the noise, and so is that of a slope times the length.
        let error = dot(&bounds.noise_bulge, &sizes(&motion.w.hi)) + 3.0 * noise;
        let bend = 0.5 * (1.0 + 1e-9) * second;
        let (end, bulge) = (value + length_s * slope, length_s * length_s * bend + error);
        let (step, least) = (edge_s * slope, edge_s * edge_s * bend + error + noise);
        let (low, high) = (limits.low.hi, limits.high.hi);
        (end - bulge > low
            && end + bulge < high
            && (value - error > low || step > least)
            && (value + error < high || -step > least))
            || first == 0.0
    }

    /// Returns whether the function certainly lies inside at every edge after a point inside, up to the edge `last`.
    /// The state there is computed if it is not given and the steepest way does not tell. At all edges but that one the
    /// function's slope has the sign `direction`, or is 0.
    ///
    /// Between two such edges the slope passes 0 by an eighth of an edge squared times its second derivative at most.
    /// Within the last edge the function may turn, and so come to lie behind the start.
    #[inline(always)]
    pub(crate) fn moves_inside<P: Product>(
        &self,
        motion: &Trajectory<N>,
        limits: &Limits,
        noise: f64,
        (from, direction): (&MotionPoint<N>, f64),
        (last, state): (u64, Option<&State<N>>),
    ) -> bool {
        let Some(bounds) = self.bounds.get(dyadic(last - from.edge)) else { return false };
        let edge_s = motion.system().edge_s();
        let length_s = (last - from.edge) as f64 * edge_s;
        let [steepest, _, third, _] = bounds.derivatives.times(&sizes(&from.w));
        let start = self.value(&from.x);
        let (below, above) = (start - limits.low.hi, limits.high.hi - start);
        let (behind, ahead) = if direction > 0.0 { (below, above) } else { (above, below) };
        let margin = 2.0 * noise + length_s * edge_s * edge_s * third;
        let back = edge_s * steepest;
        let is_inside = |way: f64| way + margin < ahead;
        if behind <= margin {
            return false;
        }
        if behind > margin + back && is_inside(length_s * steepest) {
            return true;
        }
        let state = match state {
            Some(state) => *state,
            // A function that would leave at its present slope is not worth a state.
            None if !is_inside(length_s * direction * self.slope(&from.w)) => return false,
            None => motion.at_with::<P>(last),
        };
        let way = direction * (self.value(&state) - start);
        behind + way > margin && is_inside(way + back)
    }

    /// Returns the first edge after `from`, up to and including that of `to`, at which the value is outside the band,
    /// given that it is inside at `from`.
    pub fn first(
        &self,
        motion: &Trajectory<N>,
        band: &Band,
        from: &MotionPoint<N>,
        to: &MotionPoint<N>,
    ) -> Option<u64> {
        let limits = Limits::from(band);
        let noise = self.noise(motion, dyadic(to.edge), &limits);
        self.exit(&mut Watch { motion, limits, noise, again: &mut 0 }, from, to).map(|point| point.edge)
    }

    versions! {
        /// Returns the point of the first exit, with a watch whose noise holds up to `to`.
        pub(crate) fn exit[exit_fused, exit_native, exit_with](
            self: &Self, watch: &mut Watch<N>, from: &MotionPoint<N>, to: &MotionPoint<N>
        ) -> Option<MotionPoint<N>>
    }

    #[inline(always)]
    fn exit_with<P: Product>(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        to: &MotionPoint<N>,
    ) -> Option<MotionPoint<N>> {
        if to.edge - from.edge > 1 && self.stays(watch.motion, &watch.limits, watch.noise, from, to.edge - from.edge) {
            return None;
        }
        self.seek_with::<P>(watch, from, to)
    }

    versions! {
        /// Returns the point of the first exit where [`stays`](Self::stays) does not rule it out.
        pub(crate) fn seek[seek_fused, seek_native, seek_with](
            self: &Self, watch: &mut Watch<N>, from: &MotionPoint<N>, to: &MotionPoint<N>
        ) -> Option<MotionPoint<N>>
    }

    #[inline(always)]
    fn seek_with<P: Product>(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        to: &MotionPoint<N>,
    ) -> Option<MotionPoint<N>> {
        match self.look_with::<P>(watch, from, to) {
            Verdict::Clear => None,
            Verdict::At(point) => Some(point),
            Verdict::Split(middle) => self.divide(watch, from, middle, to),
        }
    }

    versions! {
        /// Returns what is known of a stretch without dividing it.
        fn look[look_fused, look_native, look_with](
            self: &Self, watch: &mut Watch<N>, from: &MotionPoint<N>, to: &MotionPoint<N>
        ) -> Verdict<N>
    }

    #[inline(always)]
    fn look_with<P: Product>(&self, watch: &mut Watch<N>, from: &MotionPoint<N>, to: &MotionPoint<N>) -> Verdict<N> {
        if to.edge == from.edge {
            return Verdict::Clear;
        }
        let side = self.side(watch, to.edge, self.value(&to.x));
        if to.edge - from.edge == 1 {
            return if side == Side::Inside { Verdict::Clear } else { Verdict::At(*to) };
        }
        self.judge::<P>(watch, from, to, side)
    }

    /// Looks at a stretch part by part, each of which ends at the last point that is open; of four states half by half,
    /// which takes fewer instructions, and whose frames are small.
    #[cold]
    fn divide(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        middle: u64,
        to: &MotionPoint<N>,
    ) -> Option<MotionPoint<N>> {
        let middle = MotionPoint::of(watch.motion, middle);
        if N == 4 {
            return self.exit(watch, from, &middle).or_else(|| self.exit(watch, &middle, to));
        }
        let (mut from, mut open) = (*from, vec![*to, middle]);
        while let Some(to) = open.last() {
            let edges = to.edge - from.edge;
            let stays = edges > 1 && self.stays(watch.motion, &watch.limits, watch.noise, &from, edges);
            match if stays { Verdict::Clear } else { self.look(watch, &from, to) } {
                Verdict::Clear => {
                    from = *to;
                    open.pop();
                }
                Verdict::At(point) => return Some(point),
                Verdict::Split(middle) => open.push(MotionPoint::of(watch.motion, middle)),
            }
        }
        None
    }

    #[inline(always)]
    fn judge<P: Product>(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        to: &MotionPoint<N>,
        side: Side,
    ) -> Verdict<N> {
        let edges = to.edge - from.edge;
        let bounds = &self.bounds[dyadic(edges)];
        let (va, vb) = (self.value(&from.x), self.value(&to.x));
        let (noise, edge_s) = (watch.noise, watch.motion.system().edge_s());
        let length_s = edges as f64 * edge_s;
        let sag = length_s * length_s * 0.125;
        let error = watch.motion.slope_error(dyadic(to.edge));
        let speeds = plus(&sizes(&from.w), &error);
        // The second derivative lies between these.
        let (ca, cb) = (dot(&self.bend, &from.w), dot(&self.bend, &to.w));
        let [_, second, third, fourth] = bounds.derivatives.times(&speeds);
        let spread = sag * fourth + dot(&sizes(&self.bend), &error);
        let (least, most) = (ca.min(cb) - spread, ca.max(cb) + spread);
        let (sa, sb) = (self.slope(&from.w), self.slope(&to.w));
        // More than the error of values in an edge, and more than the error of slopes times an edge.
        let step = 4.0 * noise;
        // `start` is the distance to a limit and grows by `inward` per second there, to `end`; `pull` bends it toward
        // the limit. The roots are those of the least distances: the root of a short one errs by much more than itself.
        let clear = |start: f64, inward: f64, end: f64, pull: f64| {
            end > noise
                && (start > noise || inward * edge_s > step)
                && (pull <= 0.0
                    || (start - noise).max(0.0).sqrt() + (end - noise).sqrt() > (4.0 * sag * pull + noise).sqrt())
        };
        // For each limit: distance and its slope at the start, distance at the end, bounds of its second derivative.
        let low = (va - watch.limits.low.hi, sa, vb - watch.limits.low.hi, least, most);
        let high = (watch.limits.high.hi - va, -sa, watch.limits.high.hi - vb, -most, -least);
        let is_clear = |side: Sight| side.0 == f64::INFINITY || clear(side.0, side.1, side.2, side.4);
        // Halve at the turning point, if there is one.
        let share = if sa * sb < 0.0 { (sa / (sa - sb)).clamp(0.1, 0.9) } else { 0.5 };
        let split = Verdict::Split(from.edge + ((edges as f64 * share) as u64).clamp(1, edges - 1));
        let (ahead, behind, rising) = match side {
            Side::Inside if is_clear(low) && is_clear(high) => return Verdict::Clear,
            Side::Inside => return split,
            Side::Below => (low, high, -1.0),
            Side::Above => (high, low, 1.0),
        };
        let (start, _, end, least, most) = ahead;
        if !is_clear(behind) {
            return split;
        }
        // The ends lie on either side of the limit. A function that bends one way only passes the limit once, and so
        // does one that approaches it throughout. Each must move by more than the noise per edge.
        let fall = step * edges as f64;
        let concave = most <= 0.0 && start - end > fall;
        let convex = least >= 0.0 && start > noise && end < -fall;
        let approaches = || ((rising * sa).min(rising * sb) - sag * third) * edge_s > step;
        if concave || convex || approaches() {
            Verdict::At(self.unique::<P>(watch, from, to, rising, second))
        } else {
            split
        }
    }

    /// Returns the exit that value and four derivatives at a point inside let expect: through the limit toward which
    /// the function moves, or else the one toward which it bends. An estimate: [`confirm`](Self::confirm) proves it.
    #[inline(always)]
    pub(crate) fn forecast(&self, motion: &Trajectory<N>, limits: &Limits, from: &MotionPoint<N>) -> Forecast {
        let (value, slope) = (self.value(&from.x), self.slope(&from.w));
        let (bend, third, fourth) = (dot(&self.bend, &from.w), dot(&self.third, &from.w), dot(&self.fourth, &from.w));
        let (below, above) = (value - limits.low.hi, limits.high.hi - value);
        let turns = |gap: f64, bend: f64| slope * slope + 2.0 * bend * gap < 0.0 || gap == f64::INFINITY;
        let is_rising = if slope > 0.0 { !turns(above, bend) } else { turns(below, -bend) };
        let (rising, gap) = if is_rising { (1.0, above) } else { (-1.0, below) };
        let (slope, bend, third, fourth) = (rising * slope, rising * bend, rising * third, rising * fourth);
        // The root of the parabola, then one step of Newton's on the quartic.
        let root = (slope * slope + 2.0 * bend * gap).sqrt();
        let time_s = if slope > 0.0 { 2.0 * gap / (slope + root) } else { (root - slope) / bend };
        let cubic = third * (1.0 / 6.0) + time_s * fourth * (1.0 / 24.0);
        let off = time_s * (slope + time_s * (0.5 * bend + time_s * cubic)) - gap;
        let time_s = time_s - off / (slope + time_s * (bend + 0.5 * time_s * (third + time_s * fourth * (1.0 / 3.0))));
        Forecast { edges: time_s / motion.system().edge_s(), rising }
    }

    /// Returns the point of the first exit after a point inside, if it is at the edge that was forecast or near it, as
    /// [`confirm`](Self::confirm) does. `steady` tells what is known of this motion from the point on; it is found anew
    /// if it does not reach the exit, so that it spares the exits that follow most of their proof.
    #[inline(always)]
    pub(crate) fn pursue<P: Product>(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        forecast: Forecast,
        steady: &mut Steady,
    ) -> Option<MotionPoint<N>> {
        let last = from.edge + forecast.late();
        if last > steady.until || forecast.rising != steady.rising {
            *steady = self.steady(watch, from, forecast);
        }
        if last > steady.until {
            return self.confirm(watch, from, forecast, forecast.late());
        }
        // A function that approaches its limit throughout passes it once.
        let aim = from.edge as f64 + forecast.edges.max(0.5);
        self.close::<P>(watch, (from.edge, last), None, aim, steady.rising, steady.second)
    }

    /// Returns how long the function certainly moves in the direction of its forecast, up to [`STEADY`] times as far as
    /// that: until the greatest second derivative has taken its slope.
    #[inline(always)]
    fn steady(&self, watch: &Watch<N>, from: &MotionPoint<N>, Forecast { edges, rising }: Forecast) -> Steady {
        let most = Forecast { edges: STEADY as f64 * edges, rising }.late();
        let Some(bounds) = self.bounds.get(dyadic(most)) else { return Steady::UNKNOWN };
        let edge_s = watch.motion.system().edge_s();
        let error = watch.motion.slope_error(dyadic(from.edge));
        let [_, second, ..] = bounds.derivatives.times(&plus(&sizes(&from.w), &error));
        // More than the error of slopes times an edge.
        let spare = rising * self.slope(&from.w) * edge_s - 4.0 * watch.noise;
        let until = from.edge + most.min((spare / (second * edge_s * edge_s)) as u64);
        Steady { until, rising, second }
    }

    versions! {
        /// Returns the point of the first exit after a point inside, if it is at the edge that was forecast or near it,
        /// and the function moves, or bends, toward its limit all the way. It is looked for up to `most` edges after
        /// the point; the watch's noise holds so far.
        pub(crate) fn confirm[confirm_fused, confirm_native, confirm_with](
            self: &Self, watch: &mut Watch<N>, from: &MotionPoint<N>, forecast: Forecast, most: u64
        ) -> Option<MotionPoint<N>>
    }

    #[inline(always)]
    fn confirm_with<P: Product>(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        Forecast { edges, rising }: Forecast,
        most: u64,
    ) -> Option<MotionPoint<N>> {
        let (motion, first) = (watch.motion, from.edge as f64);
        let edge_s = motion.system().edge_s();
        let bounds = self.bounds.get(dyadic(most))?;
        let error = motion.slope_error(dyadic(from.edge + most));
        let [_, second, third, fourth] = bounds.derivatives.times(&plus(&sizes(&from.w), &error));
        let aim = first + edges.max(0.5);
        let end = self.close::<P>(watch, (from.edge, from.edge + most), None, aim, rising, second)?;
        let edges = (end.edge - from.edge) as f64;
        let sag = (edges * edge_s) * (edges * edge_s) * 0.125;
        let step = 4.0 * watch.noise;
        // A function that approaches its limit throughout passes it once, and so does one that bends toward it. Each
        // must move by more than the noise per edge.
        let slopes = [from, &end].map(|point| rising * self.slope(&point.w));
        if (slopes[0].min(slopes[1]) - sag * third) * edge_s > step {
            return Some(end);
        }
        let bends = [from, &end].map(|point| rising * dot(&self.bend, &point.w));
        let bend = bends[0].min(bends[1]) - (sag * fourth + dot(&sizes(&self.bend), &error));
        let value = self.value(&from.x);
        let way = rising * (self.value(&end.x) - value);
        // Until it turns, it comes nearer to the other limit, by no more than a parabola with the least bend.
        let behind = if rising > 0.0 { value - watch.limits.low.hi } else { watch.limits.high.hi - value };
        let back = (step / edge_s - slopes[0]).max(0.0);
        (bend > 0.0 && way > step * edges && (behind - step) * (2.0 * bend) > back * back).then_some(end)
    }

    /// Returns the only exit between `from` (inside) and `to` (outside) of a function that keeps its direction.
    /// `second` bounds its second derivative.
    #[inline(always)]
    fn unique<P: Product>(
        &self,
        watch: &mut Watch<N>,
        from: &MotionPoint<N>,
        to: &MotionPoint<N>,
        rising: f64,
        second: f64,
    ) -> MotionPoint<N> {
        let limit = if rising > 0.0 { watch.limits.high.hi } else { watch.limits.low.hi };
        let edge_s = watch.motion.system().edge_s();
        let (a, b) = (from.edge, to.edge);
        let (ga, gb) = (self.value(&from.x) - limit, self.value(&to.x) - limit);
        // The Hermite cubic through both ends gives the first estimate. Newton's steps start at the steeper end, where
        // they do not overshoot a function that bends one way.
        let span = (b - a) as f64;
        let length_s = span * edge_s;
        let (sa, sb) = (self.slope(&from.w) * length_s, self.slope(&to.w) * length_s);
        let (c2, c3) = (3.0 * (gb - ga) - 2.0 * sa - sb, 2.0 * (ga - gb) + sa + sb);
        let mut share = f64::from(u8::from(sb.abs() > sa.abs()));
        for _ in 0..4 {
            let value = ga + share * (sa + share * (c2 + share * c3));
            let slope = sa + share * (2.0 * c2 + 3.0 * c3 * share);
            share -= value / slope;
        }
        let aim = a as f64 + span * share;
        self.close::<P>(watch, (a, b), Some(*to), aim, rising, second).unwrap_or(*to)
    }

    /// Closes in on the only exit of a function that keeps its direction, by Newton's steps from `aim`, in edges. It is
    /// inside at the first edge of the bracket. If `end` is given, it is outside there, at the last edge; otherwise the
    /// bracket is only a limit of the search, and `None` means that it gave up. `second` bounds the second derivative.
    #[inline(always)]
    fn close<P: Product>(
        &self,
        watch: &mut Watch<N>,
        (mut a, mut b): (u64, u64),
        mut end: Option<MotionPoint<N>>,
        mut aim: f64,
        rising: f64,
        second: f64,
    ) -> Option<MotionPoint<N>> {
        let limit = if rising > 0.0 { watch.limits.high.hi } else { watch.limits.low.hi };
        let motion = watch.motion;
        let edge_s = motion.system().edge_s();
        let mut tries = 0;
        // The most by which a value one edge before a point can differ from the straight line through the point: the
        // errors of value and slope, and the bend.
        let off_line = 3.0 * watch.noise + 0.5 * (edge_s * edge_s) * (1.0 + 1e-9) * second;
        while b - a > 1 {
            // The first edge at or after the estimate, then the edge before it: two good guesses close the bracket.
            if !(aim > a as f64 && aim <= b as f64) {
                end?;
                aim = 0.5 * (a + b) as f64;
            }
            let at = aim.ceil() as u64;
            let guess = if at == b { b - 1 } else { at };
            let point = MotionPoint::of_with::<P>(motion, guess);
            let (value, slope) = (self.value(&point.x), self.slope(&point.w));
            if self.side(watch, guess, value) == Side::Inside {
                a = guess;
            } else {
                (b, end) = (guess, Some(point));
                if rising * (value - edge_s * slope - limit) < -off_line {
                    break;
                }
            }
            tries += 1;
            aim = if tries < 12 {
                // Newton's step, and what the bend adds to it where that is little.
                let time_s = (value - limit) / slope;
                let share = 0.5 * self.curvature(&point.w) * time_s / slope;
                let bent = if share.abs() < 0.25 { share * (1.0 + 2.0 * share) } else { 0.0 };
                guess as f64 - time_s * (1.0 + bent) / edge_s
            } else {
                0.5 * (a + b) as f64
            };
        }
        end
    }
}

#[cfg(test)]
#[path = "guard_tests.rs"]
mod tests;
