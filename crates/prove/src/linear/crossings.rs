//! Every stiffness of a range at which a pole of the linear loop is on the unit circle.
//!
//! The module searches boxes of stiffness and angle `ω`, `z = e^jω`, on the enclosed [`Characteristic`]. A box is
//! dropped when the function cannot be zero in it. It stays as a crossing when Krawczyk's interval operator maps it
//! into itself, which proves that it holds exactly one root. Every other box is halved.
//!
//! At `z = 1` and `z = -1` the function is real, and the search is over the stiffness alone. In an arc that ends at one
//! of these points the imaginary part vanishes at the end of the arc, so its derivative is examined instead.
//!
//! So no crossing is missed: a box that cannot be decided within the numbers' precision, or within the limit on the
//! number of boxes, is returned as open.

use std::f64::consts::PI;

use super::characteristic::{Characteristic, Of};
use super::open_loop::OpenLoop;
use crate::interval::{Complex, Interval};

/// A place on the upper half of the unit circle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Place {
    Arc(Interval),
    One,
    MinusOne,
}

/// Ranges of stiffnesses, ascending and disjoint, outside which no pole is on the unit circle.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Crossings {
    /// Ranges that hold at least one crossing, or may hold some.
    pub at: Vec<[f64; 2]>,
    /// Ranges in which some pole is outside the circle at every stiffness; other poles' crossings were not searched
    /// there.
    pub unstable: Vec<[f64; 2]>,
    /// Whether the search ended before all of the range was examined. What was not is among [`at`](Self::at).
    pub ended: bool,
}

impl Place {
    /// Returns the places that make up the upper half of the circle.
    pub fn all() -> Vec<Self> {
        vec![Self::One, Self::MinusOne, Self::Arc(Interval { lo: 0.0, hi: END })]
    }
}

/// The angle of half a turn, rounded up so that the whole half circle is covered.
const END: f64 = PI.next_up();
/// Number of boxes after which the rest of the range is left open.
const MOST_BOXES: u32 = 200_000;
/// Number of boxes of one range of stiffnesses after which it is halved.
const MOST_A_RANGE: u32 = 5_000;
/// Number of arcs that are looked at to tell whether loops settle.
pub(super) const MOST_ARCS: u32 = 100_000;
/// Number of boxes that cost as much time as enclosing the function over one range of stiffnesses.
pub(super) const BOXES_A_RANGE: u32 = 10;
/// Relative width below which halving gains nothing.
const LEAST: f64 = 1e-13;

/// Result of examining one box.
enum Found {
    Nothing,
    /// The box holds exactly one root.
    Root([f64; 2], Place),
    /// The part of the box that may hold a root; the stiffnesses are to be halved next.
    Perhaps([f64; 2], Place),
    /// The part of the box that may hold a root; the arc is to be halved next.
    Halve([f64; 2], Interval),
}

/// Returns all crossings over a range of stiffnesses.
pub(super) fn crossings(open: &OpenLoop, range: [f64; 2]) -> Crossings {
    searched(open, range, false)
}

/// Returns the crossings up to the end of the softest range in which there is one, or in which some pole is outside the
/// circle at every stiffness. There may be others beyond this end.
pub(super) fn first_crossings(open: &OpenLoop, range: [f64; 2]) -> Crossings {
    searched(open, range, true)
}

fn searched(open: &OpenLoop, range: [f64; 2], only_first: bool) -> Crossings {
    let (mut at, mut unstable): (Vec<[f64; 2]>, Vec<[f64; 2]>) = (Vec::new(), Vec::new());
    let mut boxes = 0;
    let mut left = vec![(range, Place::all())];
    while let Some((stiffness, mut places)) = left.pop() {
        if only_first && at.iter().chain(&unstable).any(|[_, high]| *high < stiffness[0]) {
            continue;
        }
        if boxes > MOST_BOXES {
            at.push(stiffness);
            continue;
        }
        boxes += BOXES_A_RANGE;
        let function = open.over(stiffness);
        if function.is_surely_unstable() {
            unstable.push(stiffness);
            continue;
        }
        let width = stiffness[1] - stiffness[0];
        let (mut perhaps, before) = (Vec::new(), boxes);
        while let Some(place) = places.pop() {
            boxes += 1;
            if boxes - before > MOST_A_RANGE {
                perhaps.push(place);
                continue;
            }
            if boxes > MOST_BOXES {
                at.push(stiffness);
                (places, perhaps) = (Vec::new(), Vec::new());
                continue;
            }
            let (narrow, next) = match look(&function, place) {
                Found::Nothing => continue,
                Found::Root(stiffness, place) => {
                    at.push(narrowed(open, stiffness, place));
                    continue;
                }
                Found::Halve([low, high], arc) if high - low > 0.3 * width => {
                    let middle = arc.middle();
                    places.push(Place::Arc(Interval { lo: arc.lo, hi: middle }));
                    places.push(Place::Arc(Interval { lo: middle, hi: arc.hi }));
                    continue;
                }
                Found::Halve(narrow, arc) => (narrow, Place::Arc(arc)),
                Found::Perhaps(narrow, place) => (narrow, place),
            };
            let [low, high] = narrow;
            let shrinks = high - low < 0.3 * width;
            if shrinks && let Some((stiffness, place)) = proved(open, narrow, next) {
                at.push(narrowed(open, stiffness, place));
            } else if high - low <= LEAST * high {
                at.push(narrow);
            } else if shrinks {
                left.push((narrow, vec![next]));
            } else {
                perhaps.push(next);
            }
        }
        if !perhaps.is_empty() {
            let [low, high] = stiffness;
            let middle = if high > 4.0 * low { (low * high).sqrt() } else { 0.5 * (low + high) };
            // The softer half is next.
            left.push(([middle, high], perhaps.clone()));
            left.push(([low, middle], perhaps));
        }
    }
    at.retain(|[low, high]| *high >= range[0] && *low <= range[1]);
    Crossings { at: joined(at), unstable: joined(unstable), ended: boxes > MOST_BOXES }
}

/// Returns the ranges in ascending order, with overlapping ranges joined.
pub(super) fn joined(mut ranges: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    ranges.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut apart: Vec<[f64; 2]> = Vec::new();
    for [low, high] in ranges {
        match apart.last_mut() {
            Some(last) if low <= last[1] => last[1] = last[1].max(high),
            _ => apart.push([low, high]),
        }
    }
    apart
}

/// Returns a box around one that may hold a root, if that box is proved to hold exactly one.
fn proved(open: &OpenLoop, [low, high]: [f64; 2], place: Place) -> Option<([f64; 2], Place)> {
    let spare = 0.5 * (high - low) + 1e-14 * high;
    let wider = [low - spare, high + spare];
    if wider[0] <= 0.0 {
        return None;
    }
    let place = match place {
        Place::Arc(arc) => {
            let spare = 0.5 * arc.width() + 1e-15;
            Place::Arc(Interval { lo: (arc.lo - spare).max(0.0), hi: (arc.hi + spare).min(END) })
        }
        end => end,
    };
    match look(&open.over(wider), place) {
        Found::Root(stiffness, place) => Some((stiffness, place)),
        _ => None,
    }
}

/// Narrows a box that holds one root as far as the function's precision allows, and returns its stiffnesses.
fn narrowed(open: &OpenLoop, mut stiffness: [f64; 2], mut place: Place) -> [f64; 2] {
    for _ in 0..100 {
        let (found, there) = match look(&open.over(stiffness), place) {
            Found::Root(stiffness, place) | Found::Perhaps(stiffness, place) => (stiffness, place),
            Found::Halve(stiffness, arc) => (stiffness, Place::Arc(arc)),
            Found::Nothing => unreachable!("a box that holds a root"),
        };
        let done = found[1] - found[0] > 0.95 * (stiffness[1] - stiffness[0]);
        (stiffness, place) = (found, there);
        if done {
            break;
        }
    }
    stiffness
}

/// Returns a quotient by an interval that does not contain zero.
fn quotient(by: Interval, over: Interval) -> Interval {
    if over.lo > 0.0 { by.divided(over) } else { Interval::ZERO.minus(by).divided(Interval::ZERO.minus(over)) }
}

/// Examines a range of stiffnesses at `z = 1` or `z = -1`.
fn look_at_end(function: &Characteristic, place: Place) -> Found {
    let [low, high] = function.range;
    let (stiffness, middle) = (Interval { lo: low, hi: high }, Interval::exact(0.5 * (low + high)));
    let [value, over, slope] =
        [Of::Middle, Of::Range, Of::Slope(0)].map(|of| function.at(place == Place::MinusOne, of));
    if !over.has_zero() || !value.plus(slope.times(stiffness.minus(middle))).has_zero() {
        return Found::Nothing;
    }
    if slope.has_zero() {
        return Found::Perhaps([low, high], place);
    }
    let newton = middle.minus(quotient(value, slope));
    match newton.common(stiffness) {
        None => Found::Nothing,
        Some(both) if newton.is_inside(stiffness) => Found::Root([both.lo, both.hi], place),
        Some(both) => Found::Perhaps([both.lo, both.hi], place),
    }
}

/// Examines a range of stiffnesses at a place on the circle.
fn look(function: &Characteristic, place: Place) -> Found {
    let [low, high] = function.range;
    let stiffness = Interval { lo: low, hi: high };
    let middle = Interval::exact(0.5 * (low + high));
    let away = stiffness.minus(middle);
    let Place::Arc(arc) = place else { return look_at_end(function, place) };
    let centre = Interval::exact(arc.middle());
    let aside = arc.minus(centre);
    let over = function.on(arc, Of::Range);
    let slope = function.on(arc, Of::Slope(0));
    let mean = function.on(arc, Of::Middle);
    let [here, slope_here] = [Of::Middle, Of::Slope(0)].map(|of| function.on(centre, of).value);
    let meant = here.plus(slope.value.scaled(away)).plus(over.by_angle.scaled(aside));
    let ends = arc.lo == 0.0 || arc.hi >= PI;
    if !over.value.has_zero() || !meant.has_zero() || ends && !over.by_angle.im.has_zero() {
        return Found::Nothing;
    }
    // Where F(K) = F(m) + F'(K - m) is zero, F(m) conj F' is real. The stiffness enters this condition only through F'.
    let quadrature = |f: Complex, g: Complex| f.im.times(g.re).minus(f.re.times(g.im));
    let bend = quadrature(mean.by_angle, slope.value).plus(quadrature(mean.value, slope.by_angle));
    let flat = quadrature(here, slope_here).plus(bend.times(aside));
    if !flat.has_zero() && !ends {
        return Found::Nothing;
    }
    // That zero lies at K = m - F(m) conj F' / |F'|².
    let square = |x: Interval| {
        let ends = x.times(x);
        if x.has_zero() { Interval { lo: 0.0, hi: ends.hi } } else { Interval { lo: ends.lo.max(0.0), hi: ends.hi } }
    };
    let size = square(slope.value.re).plus(square(slope.value.im));
    let mut narrow = stiffness;
    if size.lo > 0.0 {
        let along = |f: Complex| f.re.times(slope.value.re).plus(f.im.times(slope.value.im));
        let quotient = along(mean.value).divided(size);
        match middle.minus(quotient).common(stiffness) {
            None => return Found::Nothing,
            Some(both) => narrow = both,
        }
    }
    // Krawczyk's operator: m - Y F(m) + (1 - Y J) (X - m), with Y an approximate inverse of J.
    let (a, b) = (slope.value.re, over.by_angle.re);
    let (c, d) = (slope.value.im, over.by_angle.im);
    let determinant = a.middle() * d.middle() - b.middle() * c.middle();
    let mut next = arc;
    if determinant.is_normal() {
        let inverse = [[d.middle(), -b.middle()], [-c.middle(), a.middle()]].map(|row| row.map(|x| x / determinant));
        let number = Interval::exact;
        let row = |k: usize| {
            let [y, w] = inverse[k].map(number);
            let step = y.times(here.re).plus(w.times(here.im));
            let unit = |of: usize| number(f64::from(u8::from(k == of)));
            let by = [unit(0).minus(y.times(a).plus(w.times(c))), unit(1).minus(y.times(b).plus(w.times(d)))];
            let from = if k == 0 { middle } else { centre };
            from.minus(step).plus(by[0].times(away)).plus(by[1].times(aside))
        };
        let image = [row(0), row(1)];
        let (Some(first), Some(second)) = (image[0].common(narrow), image[1].common(arc)) else {
            return Found::Nothing;
        };
        if image[0].is_inside(stiffness) && image[1].is_inside(arc) {
            return Found::Root([first.lo, first.hi], Place::Arc(second));
        }
        (narrow, next) = (first, second);
    }
    let narrow = [narrow.lo, narrow.hi];
    // Where the slope is known precisely, halving the arc narrows the stiffnesses further and further. Elsewhere the
    // side along which the function varies more is halved.
    let vary = |by: Complex, width: f64| by.re.size().max(by.im.size()) * width;
    let known = |x: Interval| x.width() <= 1e-9 * slope_here.re.size().max(slope_here.im.size());
    let exact = known(slope_here.re) && known(slope_here.im);
    let turns = vary(over.by_angle, next.width()) > 0.5 * vary(slope.value, narrow[1] - narrow[0]);
    if (exact || turns) && next.width() > LEAST * (1e-3 + next.hi) {
        return Found::Halve(narrow, next);
    }
    Found::Perhaps(narrow, Place::Arc(next))
}

/// Whether all poles are within the unit circle at a stiffness; `None` where that cannot be told, with the precision of
/// the numbers or with the arcs that are left to be looked at.
///
/// `F` has no poles outside the circle and grows there like `z` to the power of the plant's degree. So along the circle
/// it turns around zero as many times as that degree, less one turn for each root outside. The function is followed
/// along arcs on which it is proved not to be zero: on each arc it turns by less than half a turn.
pub(super) fn settles(open: &OpenLoop, stiffness: f64, left: &mut u32) -> Option<bool> {
    let function = open.over([stiffness; 2]);
    let at = |angle: f64| {
        let value = function.on(Interval::exact(angle), Of::Middle).value;
        (value.re.middle(), value.im.middle())
    };
    let mut arcs = vec![Interval { lo: 0.0, hi: END }];
    let mut before = at(0.0);
    let mut turned = 0.0;
    while let Some(arc) = arcs.pop() {
        *left = left.checked_sub(1)?;
        let on = function.on(arc, Of::Middle);
        let centre = Interval::exact(arc.middle());
        let meant = function.on(centre, Of::Middle).value.plus(on.by_angle.scaled(arc.minus(centre)));
        if on.value.has_zero() && meant.has_zero() {
            if arc.width() < 1e-15 {
                return None;
            }
            let middle = arc.middle();
            arcs.push(Interval { lo: middle, hi: arc.hi });
            arcs.push(Interval { lo: arc.lo, hi: middle });
            continue;
        }
        let after = at(arc.hi);
        turned += libm::atan2(before.0 * after.1 - before.1 * after.0, before.0 * after.0 + before.1 * after.1);
        before = after;
    }
    let turns = turned / PI;
    // Half a turn along the upper half of the circle is one turn along the whole circle.
    ((turns - turns.round()).abs() < 1e-3).then(|| turns.round() == open.degree() as f64)
}
