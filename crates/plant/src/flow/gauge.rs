//! The mean, least and greatest values of an output between the rows of a trace.
//!
//! A row at edge `r`, after one at `r'`, has
//!
//! - the mean from the last period of the modulator that began at or before `r'` to the last one that began at or
//!   before `r`. A ripple is averaged over whole periods and does not beat with the rows. Without a modulator, or if no
//!   period began between the two rows, it is the mean from `r'` to `r`;
//! - least and greatest value from `r'` to `r`, both included: at every anchor and at stationary points in between.
//!
//! The motion tells a [`Gauge`] each of its stretches, from anchor to anchor, when it leaves it. A row is a function of
//! the gauge at the anchor and of the stretch, so it does not depend on how often anyone looked. Integrals are those of
//! the flow; no sum is taken over samples.
//!
//! Turning points are expensive to find. A part of a stretch whose values certainly lie inside the extremes that the
//! row already has is not searched (`Extent::holds`); the row has the same bits as if it were.

use crate::flow::guard::{Guard, Limits, MotionPoint, dyadic};
use crate::flow::lanes::{Count, Size};
use crate::flow::linear::Trajectory;
use crate::flow::matrix::{CURRENT, SPEED, State, dot, sizes};

/// The edges at which rows are taken and periods of a modulator begin.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pace {
    /// Edges from one row to the next; the first is at edge 0.
    pub stride: u64,
    /// Edges of a period, the first of which begins at edge 1; `None` without a modulator.
    pub period: Option<u64>,
}

impl Pace {
    /// Returns the last row before an edge.
    pub fn row_before(&self, edge: u64) -> u64 {
        edge.saturating_sub(1) / self.stride * self.stride
    }

    /// Returns the last edge up to this one at which a period began, or 0.
    pub fn boundary(&self, edge: u64) -> u64 {
        match self.period {
            Some(period) if edge > 0 => (edge - 1) / period * period + 1,
            _ => 0,
        }
    }

    /// Returns the first and the last edge of the mean of a row.
    pub fn window(&self, row: u64) -> (u64, u64) {
        let before = self.row_before(row);
        let (begun, ended) = (self.boundary(before), self.boundary(row));
        if ended > begun { (begun, ended) } else { (before, row) }
    }
}

/// Least and greatest value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Extent {
    /// The least value.
    pub least: f64,
    /// The greatest value.
    pub greatest: f64,
}

impl Extent {
    /// The extent of no value at all.
    pub const NONE: Self = Self { least: f64::INFINITY, greatest: f64::NEG_INFINITY };
    /// The extent of all values: nothing is searched for it.
    pub const ALL: Self = Self { least: f64::NEG_INFINITY, greatest: f64::INFINITY };

    /// Includes a value.
    #[inline(always)]
    pub fn take(&mut self, x: f64) {
        self.least = if x < self.least { x } else { self.least };
        self.greatest = if x > self.greatest { x } else { self.greatest };
    }

    /// Includes another extent.
    pub fn join(&mut self, other: &Self) {
        self.take(other.least);
        self.take(other.greatest);
    }

    /// Returns whether all values of another extent lie inside this one by more than a margin.
    pub(crate) fn holds(&self, other: &Self, margin: f64) -> bool {
        other.least - margin > self.least && other.greatest + margin < self.greatest
    }

    /// Includes a course within one clock edge, given its values and slopes at both ends; in between it is a parabola.
    fn course(&mut self, length_s: f64, values: [f64; 2], slopes: [f64; 2]) {
        values.into_iter().for_each(|x| self.take(x));
        if slopes[0] * slopes[1] < 0.0 {
            self.take(values[0] + 0.5 * length_s * slopes[0] * (slopes[0] / (slopes[0] - slopes[1])));
        }
    }
}

/// The figures of an output in a row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Measured {
    /// The mean.
    pub mean: f64,
    /// Least and greatest value.
    pub extent: Extent,
}

/// A `Stretch` is a motion from one anchor to the next, as a [`Gauge`] sees it. Exact flows, cruises, arms and steps
/// each implement it, so that one gauge serves them all. An end that is `None` is the stretch's own, which may lie
/// between two edges.
///
/// ```
/// use hpu_plant::{Extent, Stretch};
///
/// /// A motion at a constant speed, in units per edge, from 0 at edge 0.
/// struct Line(f64);
///
/// impl Stretch<1> for Line {
///     fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; 1] {
///         let [from, to] = [from.unwrap_or(0), to.unwrap_or(100)].map(|edge| edge as f64);
///         [self.0 * (to * to - from * from) / 2.0]
///     }
///     fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; 1]) {
///         for edge in [from.unwrap_or(0), to.unwrap_or(100)] {
///             extents[0].take(self.0 * edge as f64);
///         }
///     }
/// }
///
/// assert_eq!(Line(2.0).integral(Some(0), Some(3)), [9.0]);
/// let mut extents = [Extent::NONE];
/// Line(2.0).include(Some(1), Some(3), &mut extents);
/// assert_eq!((extents[0].least, extents[0].greatest), (2.0, 6.0));
/// ```
pub trait Stretch<const N: usize> {
    /// Returns the integrals of the outputs over the time between.
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; N];
    /// Includes the values between in the extents of a row, both ends included. Values that certainly lie inside an
    /// extent as it is may be left out.
    fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; N]);
}

/// The figures of `N` outputs since the last row, at an anchor of their motion.
#[derive(Clone, PartialEq, Debug)]
pub struct Gauge<const N: usize> {
    pace: Pace,
    /// The extents of a row before it has any value.
    fresh: [Extent; N],
    /// Integrals since the last row before the anchor.
    since_row: [f64; N],
    /// Integrals since the modulator's present period began.
    since_boundary: [f64; N],
    /// Integrals over the periods in between, from the period of the last row to the present one.
    periods: [f64; N],
    /// Extents since the last row.
    extent: [Extent; N],
}

fn sum<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|k| a[k] + b[k])
}

impl<const N: usize> Gauge<N> {
    /// Creates a gauge at edge 0. The extents of outputs that nobody reads are [`Extent::ALL`].
    pub fn new(pace: Pace, read: [bool; N]) -> Self {
        let (none, fresh) = ([0.0; N], read.map(|is_read| if is_read { Extent::NONE } else { Extent::ALL }));
        Self { pace, fresh, since_row: none, since_boundary: none, periods: none, extent: fresh }
    }

    /// Returns the gauge at the end of a stretch, or at an edge on its way. `first` is the first edge at or after the
    /// stretch's start, `now` the first at or after the end `to`.
    pub fn after(&self, first: u64, now: u64, to: Option<u64>, stretch: &impl Stretch<N>) -> Self {
        let pace = self.pace;
        let (row, ended) = (pace.row_before(now), pace.boundary(now));
        let (has_row, has_boundary) = (row >= first, ended > first);
        let is_modulated = pace.period.is_some();
        let whole = if has_row && (has_boundary || !is_modulated) { [0.0; N] } else { stretch.integral(None, to) };
        let since_row = if has_row { stretch.integral(Some(row), to) } else { sum(&self.since_row, &whole) };
        let (from, mut extent) = if has_row { (Some(row), self.fresh) } else { (None, self.extent) };
        stretch.include(from, to, &mut extent);
        let mut next = Self { pace, fresh: self.fresh, since_row, extent, since_boundary: [0.0; N], periods: [0.0; N] };
        if is_modulated {
            next.since_boundary =
                if has_boundary { stretch.integral(Some(ended), to) } else { sum(&self.since_boundary, &whole) };
            let begun = pace.boundary(row);
            if ended > begun {
                next.periods = self.between(first, row, (begun, ended), stretch);
            }
        }
        next
    }

    /// Returns the integrals from the period that begins at `begun`, in which `row` lies, to the later one at `ended`.
    fn between(&self, first: u64, row: u64, (begun, ended): (u64, u64), stretch: &impl Stretch<N>) -> [f64; N] {
        if ended <= first {
            return self.periods;
        }
        if begun > first {
            return stretch.integral(Some(begun), Some(ended));
        }
        let open = sum(&self.since_boundary, &stretch.integral(None, Some(ended)));
        if row < first { sum(&self.periods, &open) } else { open }
    }

    /// Returns the figures of the row at the edge `row`, at which the gauge stands and the outputs have these values.
    pub fn row(&self, row: u64, edge_s: f64, values: &[f64; N]) -> [Measured; N] {
        let (from, to) = self.pace.window(row);
        let is_of_periods = self.pace.boundary(row) > self.pace.boundary(self.pace.row_before(row));
        let integrals = if is_of_periods { &self.periods } else { &self.since_row };
        let length_s = (to - from) as f64 * edge_s;
        std::array::from_fn(|k| {
            if row == 0 {
                return Measured { mean: values[k], extent: Extent { least: values[k], greatest: values[k] } };
            }
            let mut extent = self.extent[k];
            extent.take(values[k]);
            Measured { mean: integrals[k] / length_s, extent }
        })
    }
}

/// A stretch that lies within one clock edge, or is known only as a whole.
pub(crate) struct Whole<const N: usize> {
    integral: [f64; N],
    extent: [Extent; N],
}

impl Whole<2> {
    pub(crate) const NOTHING: Self = Self { integral: [0.0; 2], extent: [Extent::NONE; 2] };

    /// Adds a motion within an edge, from one state to another, with its integrals on the way.
    pub(crate) fn add<const N: usize>(
        &mut self,
        motion: &Trajectory<N>,
        length_s: f64,
        states: [&State<N>; 2],
        integrals: &State<N>,
    ) where
        Count<N>: Size<N>,
    {
        let slopes = states.map(|x| motion.slope(x));
        for (k, of) in [CURRENT, SPEED].into_iter().enumerate() {
            self.integral[k] += integrals[of];
            self.extent[k].course(length_s, states.map(|x| x[of]), slopes.map(|w| w[of]));
        }
    }
}

impl<const N: usize> Stretch<N> for Whole<N> {
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; N] {
        if from.is_some() && from == to { [0.0; N] } else { self.integral }
    }

    fn include(&self, _: Option<u64>, _: Option<u64>, extents: &mut [Extent; N]) {
        extents.iter_mut().zip(&self.extent).for_each(|(extent, own)| extent.join(own));
    }
}

/// Outputs on straight lines from one edge to another: a step of a device that moves in steps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Chord<const N: usize> {
    /// First edge.
    pub start: u64,
    /// Number of edges.
    pub edges: u64,
    /// The clock period in seconds.
    pub edge_s: f64,
    /// The outputs at both ends.
    pub ends: [[f64; N]; 2],
}

impl<const N: usize> Chord<N> {
    fn between(&self, from: Option<u64>, to: Option<u64>) -> [(f64, [f64; N]); 2] {
        let [a, b] = &self.ends;
        [from.unwrap_or(self.start), to.unwrap_or(self.start + self.edges)].map(|edge| {
            let share = (edge - self.start) as f64 / self.edges as f64;
            let at = |k: usize| (a[k] + (b[k] - a[k]) * share).clamp(a[k].min(b[k]), a[k].max(b[k]));
            ((edge - self.start) as f64 * self.edge_s, std::array::from_fn(at))
        })
    }
}

impl<const N: usize> Stretch<N> for Chord<N> {
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; N] {
        let [(start_s, a), (end_s, b)] = self.between(from, to);
        std::array::from_fn(|k| 0.5 * (end_s - start_s) * (a[k] + b[k]))
    }

    fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; N]) {
        let [(_, a), (_, b)] = self.between(from, to);
        for (k, extent) in extents.iter_mut().enumerate() {
            extent.join(&Extent { least: a[k].min(b[k]), greatest: a[k].max(b[k]) });
        }
    }
}

/// Current and speed along one motion, from its anchor.
pub(crate) struct Flow<'m, 'a, const N: usize = 4> {
    pub(crate) motion: &'m Trajectory<'a, N>,
    /// The guards of current and speed.
    pub(crate) guards: [&'m Guard<N>; 2],
    pub(crate) anchor: u64,
}

impl<const N: usize> Flow<'_, '_, N>
where
    Count<N>: Size<N>,
{
    pub(crate) fn since(&self, edge: Option<u64>) -> u64 {
        edge.map_or(0, |edge| edge - self.anchor)
    }
}

impl<const N: usize> Stretch<2> for Flow<'_, '_, N>
where
    Count<N>: Size<N>,
{
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; 2] {
        let (from, to) = (self.since(from), self.since(to));
        path(self.motion, from, to)
    }

    fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; 2]) {
        let ends = [from, to].map(|edge| MotionPoint::of(self.motion, self.since(edge)));
        for (guard, extent) in self.guards.iter().zip(extents) {
            ends.iter().for_each(|end| extent.take(guard.value(&end.x)));
            turns(self.motion, guard, ends[0], ends[1], extent);
        }
    }
}

/// Returns the integrals of current and speed between two edges, counted from the anchor.
fn path<const N: usize>(motion: &Trajectory<N>, from: u64, to: u64) -> [f64; 2]
where
    Count<N>: Size<N>,
{
    let MotionPoint { x, w, .. } = MotionPoint::of(motion, from);
    let states = motion.system().path(&x, &w, to - from);
    [states[CURRENT], states[SPEED]]
}

/// Rounding of a value; a bulge below it is no turning point.
pub(crate) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Returns an extent that a function does not leave within a time, given its values and slopes at both ends and a bound
/// of its second derivative. It neglects rounding.
pub(crate) fn reach(values: [f64; 2], slopes: [f64; 2], bend: f64, length_s: f64) -> Extent {
    let [a, b] = values;
    let mut extent = Extent { least: a.min(b), greatest: a.max(b) };
    // To reach 0 and return, the slope would have to change by more than its bound.
    if slopes[0] * slopes[1] < 0.0 || slopes[0].abs() + slopes[1].abs() < bend * length_s {
        // A hundredth more covers the parabolas that stand for the course within an edge.
        let bulge = 1.01 * 0.125 * bend * length_s * length_s;
        extent = Extent { least: extent.least - bulge, greatest: extent.greatest + bulge };
    }
    extent
}

/// Returns a bound of the error of a function's values up to an edge of a motion, with a reserve.
pub(crate) fn blur<const N: usize>(motion: &Trajectory<N>, guard: &Guard<N>, edge: u64) -> f64
where
    Count<N>: Size<N>,
{
    let dyadic = dyadic(edge).min(motion.system().dyadic() - 1);
    4.0 * guard.noise(motion, dyadic, &Limits::ANY)
}

/// Includes the stationary values between two points of a motion, whose own values have been included. Values that
/// certainly lie inside the extent as it is may be left out.
pub(crate) fn turns<const N: usize>(
    motion: &Trajectory<N>,
    guard: &Guard<N>,
    a: MotionPoint<N>,
    b: MotionPoint<N>,
    extent: &mut Extent,
) where
    Count<N>: Size<N>,
{
    let edges = b.edge - a.edge;
    if edges == 0 {
        return;
    }
    let length_s = edges as f64 * motion.system().edge_s();
    let values = [guard.value(&a.x), guard.value(&b.x)];
    let slopes = [guard.value(&a.w), guard.value(&b.w)];
    let has_turned = slopes[0] * slopes[1] < 0.0;
    let is_inside =
        |extent: &Extent, bend| extent.holds(&reach(values, slopes, bend, length_s), blur(motion, guard, b.edge));
    let speeds = sizes(&a.w);
    if let Some([second, fourth]) = guard.derivatives(dyadic(edges)) {
        let bend = dot(&second, &speeds);
        let size = values[0].abs().max(values[1].abs());
        // To reach 0 and return, the slope would have to change by more than its bound; or the value cannot leave its
        // chord.
        if !has_turned && slopes[0].abs() + slopes[1].abs() >= bend * length_s
            || 0.125 * bend * length_s * length_s <= ROUNDING * size
            || is_inside(extent, bend)
        {
            return;
        }
        if edges > 1 {
            let ends = [guard.curvature(&a.w), guard.curvature(&b.w)];
            let sag = 0.125 * length_s * length_s * dot(&fourth, &speeds);
            if ends[0] * ends[1] > 0.0 && ends[0].abs().min(ends[1].abs()) > sag {
                // The slope is monotone: there is one turning point, or none.
                if has_turned {
                    extent.take(turn(motion, guard, a, b));
                }
                return;
            }
            let (start, spread) = curvature(motion, guard, &a.w, length_s, dyadic(edges));
            let most = start.abs() + spread;
            if !has_turned && slopes[0].abs() + slopes[1].abs() >= most * length_s
                || 0.125 * most * length_s * length_s <= ROUNDING * size
                || is_inside(extent, most)
            {
                return;
            }
            if start.abs() > spread {
                if has_turned {
                    extent.take(turn(motion, guard, a, b));
                }
                return;
            }
        }
    }
    if edges == 1 {
        return extent.course(length_s, values, slopes);
    }
    let middle = MotionPoint::of(motion, a.edge + edges / 2);
    extent.take(guard.value(&middle.x));
    turns(motion, guard, a, middle, extent);
    turns(motion, guard, middle, b, extent);
}

/// Terms of the series of [`curvature`].
const TERMS: u32 = 8;

/// Returns the second derivative at the start of a stretch, of at most 2^`dyadic` edges, and the most by which it
/// changes within it: the sizes of the terms of its Taylor series, Lagrange's remainder, and the rounding of the
/// first term.
///
/// [`Guard::derivatives`] bounds the same derivative by sizes of states. Where states all but cancel, as the speeds
/// of a motor and of a hand that hold each other, that bound is many times too large.
fn curvature<const N: usize>(
    motion: &Trajectory<N>,
    guard: &Guard<N>,
    w: &State<N>,
    length_s: f64,
    dyadic: usize,
) -> (f64, f64)
where
    Count<N>: Size<N>,
{
    let system = motion.system();
    let after = |w: &State<N>| system.matrix().map(|row| dot(&row, w));
    let mut derivative = after(w);
    let start = guard.value(&derivative);
    let sums = system.matrix().map(|row| dot(&sizes(&row), &sizes(w)));
    let mut spread = ROUNDING * dot(&sizes(guard.row()), &sums);
    let mut factor = 1.0;
    for order in 1..TERMS {
        derivative = after(&derivative);
        factor *= length_s / f64::from(order);
        spread += factor * guard.value(&derivative).abs();
    }
    let last = sizes(&after(&derivative));
    (start, spread + factor * length_s / f64::from(TERMS) * guard.bound(dyadic, &last))
}

/// Returns the value where the slope is 0, given that the slope is monotone and has different signs at the two ends.
fn turn<const N: usize>(motion: &Trajectory<N>, guard: &Guard<N>, mut a: MotionPoint<N>, mut b: MotionPoint<N>) -> f64
where
    Count<N>: Size<N>,
{
    let edge_s = motion.system().edge_s();
    loop {
        let edges = b.edge - a.edge;
        let slopes = [guard.value(&a.w), guard.value(&b.w)];
        if edges == 1 {
            return guard.value(&a.x) + 0.5 * edge_s * slopes[0] * (slopes[0] / (slopes[0] - slopes[1]));
        }
        let share = slopes[0] / (slopes[0] - slopes[1]);
        let near = MotionPoint::of(motion, a.edge + ((share * edges as f64).round() as u64).clamp(1, edges - 1));
        let (slope, curvature) = (guard.value(&near.w), guard.curvature(&near.w));
        if slope == 0.0 {
            return guard.value(&near.x);
        }
        // Newton's step from there: within an edge the motion is a parabola.
        if (slope / curvature).abs() <= edge_s {
            return guard.value(&near.x) - 0.5 * slope * (slope / curvature);
        }
        if slope * slopes[0] > 0.0 { a = near } else { b = near }
    }
}
