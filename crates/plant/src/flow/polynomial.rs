//! Three series in lanes, and the first time at which one of them passes a limit; no passage is missed.
//!
//! On `[t, t + L]` a polynomial lies above a parabola: that of its value, slope and curvature at `t`, lowered by a
//! bound of its third derivative. Until that parabola meets the limit, the limit is not passed; there the search starts
//! again. Near a crossing this converges to it from before, like a method of third order.

use crate::flow::double::Product;

/// Order of the series.
pub(crate) const ORDER: usize = 16;

/// A value for each joint; the last lane only fills a register.
pub(crate) type Lanes = [f64; 4];

/// Coefficients for each joint, by power.
pub(crate) type Coefficients = [Lanes; ORDER + 1];

/// Returns the value at `t` of a series of these powers.
#[inline(always)]
pub(crate) fn value(terms: &[Lanes], t: f64) -> Lanes {
    let mut sum = [0.0; 4];
    for term in terms.iter().rev() {
        for lane in 0..4 {
            sum[lane] = sum[lane] * t + term[lane];
        }
    }
    sum
}

/// Returns the term of power `k` of the product of two series, from their terms of the powers 0 to `k`, lane by lane.
#[inline(always)]
pub(crate) fn convolved<P: Product>(a: &[Lanes], b: &[Lanes]) -> P::Lanes {
    a.iter().zip(b.iter().rev()).fold(P::all(0.0), |sum, (a, b)| sum + P::lanes(a) * P::lanes(b))
}

/// Returns value, slope and second derivative at `t` of a series of these powers.
#[inline]
pub(crate) fn derivatives(terms: &[Lanes], t: f64) -> [Lanes; 3] {
    let (mut x, mut slope, mut half) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    for term in terms.iter().rev() {
        for lane in 0..4 {
            half[lane] = half[lane] * t + slope[lane];
            slope[lane] = slope[lane] * t + x[lane];
            x[lane] = x[lane] * t + term[lane];
        }
    }
    [x, slope, half.map(|half| 2.0 * half)]
}

/// Bounds on all series over `[0, end]`.
pub(crate) struct Bounds {
    /// Bound of the third derivative.
    third: Lanes,
    /// Bound of the rounding of the value.
    pub(crate) noise: Lanes,
    end: f64,
}

impl Bounds {
    pub(crate) fn of(terms: &[Lanes], end: f64) -> Self {
        let (mut third, mut sum) = ([0.0; 4], [0.0; 4]);
        for (k, term) in terms.iter().enumerate().rev() {
            for lane in 0..4 {
                let size = term[lane].abs();
                if k >= 3 {
                    third[lane] = third[lane] * end + (k * (k - 1) * (k - 2)) as f64 * size;
                }
                sum[lane] = sum[lane] * end + (2 * k + 3) as f64 * size;
            }
        }
        Self { third, noise: sum.map(|sum| f64::EPSILON * sum), end }
    }
}

/// The time for which a polynomial keeps its limit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Reach {
    /// To the end of the segment.
    Clear,
    /// Until this time, at which it passes the limit.
    At(f64),
    /// At least until this time, at which it is too near to the limit for a decision from the start.
    Until(f64),
}

/// Returns [`Polynomial::keeps`] of a polynomial of this number of terms and the limit 0, over `[0, end]`. Most are
/// clear at a glance.
#[inline(always)]
pub(crate) fn keeps(term: impl Fn(usize) -> f64, count: usize, end: f64, from: f64) -> Reach {
    let most = (1..count).rev().fold(0.0, |most, k| (most + (-term(k)).max(0.0)) * end);
    if term(0) > most {
        return Reach::Clear;
    }
    let mut terms = [0.0; ORDER + 1];
    terms[..count].iter_mut().zip(0..).for_each(|(of, k)| *of = term(k));
    Polynomial::of(terms, count, end).keeps(0.0, 1.0, from)
}

/// Returns whether `limit + sign · terms` certainly stays above 0 over `[0, end]`.
#[inline(always)]
fn is_clear(terms: &[f64], end: f64, limit: f64, sign: f64) -> bool {
    let mut most = 0.0;
    for &c in terms[1..].iter().rev() {
        most = (most + (-sign * c).max(0.0)) * end;
    }
    limit + sign * terms[0] > most
}

/// One polynomial over `[0, end]`.
pub(crate) struct Polynomial {
    c: [f64; ORDER + 1],
    /// Number of coefficients in use.
    terms: usize,
    end: f64,
    /// Bound of the third derivative.
    third: f64,
}

impl Polynomial {
    /// Returns the polynomial `sign · terms`, divided by `t^skip`.
    pub(crate) fn new(terms: &[Lanes], lane: usize, sign: f64, skip: usize, end: f64) -> Self {
        let mut c = [0.0; ORDER + 1];
        for (to, from) in c.iter_mut().zip(&terms[skip..]) {
            *to = sign * from[lane];
        }
        let mut third = 0.0;
        for k in (3..terms.len() - skip).rev() {
            third = third * end + (k * (k - 1) * (k - 2)) as f64 * c[k].abs();
        }
        Self { c, terms: terms.len() - skip, end, third }
    }

    /// Returns the polynomial of this number of coefficients over `[0, end]`.
    #[inline]
    pub(crate) fn of(c: [f64; ORDER + 1], terms: usize, end: f64) -> Self {
        let mut third = 0.0;
        for k in (3..terms).rev() {
            third = third * end + (k * (k - 1) * (k - 2)) as f64 * c[k].abs();
        }
        Self { c, terms, end, third }
    }

    /// Returns one of several series, with its bound.
    pub(crate) fn bounded(terms: &[Lanes], lane: usize, bounds: &Bounds) -> Self {
        let mut c = [0.0; ORDER + 1];
        for (to, from) in c.iter_mut().zip(terms) {
            *to = from[lane];
        }
        Self { c, terms: terms.len(), end: bounds.end, third: bounds.third[lane] }
    }

    /// Returns the value at 0.
    pub(crate) fn start(&self) -> f64 {
        self.c[0]
    }

    /// Returns value, slope and second derivative.
    #[inline]
    pub(crate) fn at(&self, t: f64) -> [f64; 3] {
        let (mut x, mut slope, mut half) = (0.0, 0.0, 0.0);
        for &c in self.c[..self.terms].iter().rev() {
            half = half * t + slope;
            slope = slope * t + x;
            x = x * t + c;
        }
        [x, slope, 2.0 * half]
    }

    /// Returns a time from `t` on, at most `rest`, during which a distance that is `[x, slope, curvature]` now stays
    /// positive.
    #[inline]
    pub(crate) fn safe_for(&self, [x, slope, curvature]: [f64; 3], rest: f64) -> f64 {
        let mut ahead = if slope < 0.0 { rest.min(-2.0 * x / slope) } else { rest };
        for _ in 0..8 {
            // The first zero of the parabola x + slope t + bend t²/2.
            let bend = curvature - self.third * ahead / 3.0;
            let square = slope * slope - 2.0 * bend * x;
            let (length, share) = if slope > 0.0 {
                (slope + square.max(0.0).sqrt(), -bend)
            } else {
                (2.0 * x, square.max(0.0).sqrt() - slope)
            };
            let never = square < 0.0 || (bend >= 0.0 && slope >= 0.0);
            let safe = if never {
                ahead
            } else if share > 0.0 {
                ahead.min(length / share)
            } else {
                0.0
            };
            // Over a shorter time the bound is sharper.
            if 4.0 * safe >= ahead {
                return safe;
            }
            ahead = 4.0 * safe;
        }
        0.25 * ahead
    }

    /// Returns the first edge in (`from`, `last`] at which a reading is out of its band. The polynomial, which is `now`
    /// at `from`, is that reading but for the noise; edges at which it is too near to an end of the band are asked one
    /// by one.
    #[inline(always)]
    pub(crate) fn leaves(
        &self,
        mut now: [f64; 3],
        (low, high, noise): (f64, f64, f64),
        (from, last): (u64, u64),
        edge_s: f64,
        time_s: impl Fn(u64) -> f64,
        is_out: impl Fn(u64) -> bool,
    ) -> Option<u64> {
        let mut edge = from;
        while edge < last {
            let mut safe_s = (last - edge) as f64 * edge_s;
            let [x, slope, curvature] = now;
            for [room, slope, curvature] in
                [[x - low - noise, slope, curvature], [high - x - noise, -slope, -curvature]]
            {
                if room < f64::INFINITY {
                    safe_s = if room > 0.0 { self.safe_for([room, slope, curvature], safe_s) } else { 0.0 };
                }
            }
            // The last edge that is proved safe without evaluation.
            let edges = (safe_s / edge_s) as u64;
            if edges >= last - edge {
                return None;
            }
            if edges > 1 {
                edge += edges - 1;
            } else {
                edge += 1;
                if is_out(edge) {
                    return Some(edge);
                }
            }
            now = self.at(time_s(edge));
        }
        None
    }

    /// Returns the first time from `from` on at which `limit + sign · polynomial`, not negative at `from`, becomes
    /// negative.
    pub(crate) fn keeps(&self, limit: f64, sign: f64, from: f64) -> Reach {
        if is_clear(&self.c[..self.terms], self.end, limit, sign) {
            return Reach::Clear;
        }
        let mut t = from;
        for _ in 0..100 {
            let [x, slope, curvature] = self.at(t).map(|v| sign * v);
            let x = limit + x;
            if x < 0.0 || (x == 0.0 && slope < 0.0) {
                return Reach::At(t);
            }
            let next = t + self.safe_for([x, slope, curvature], self.end - t);
            if next >= self.end {
                return Reach::Clear;
            }
            if next - t <= 2.0 * f64::EPSILON * next {
                // Floating point allows no further step: the crossing is here, if the polynomial falls here at all.
                return if slope < 0.0 { Reach::At(next) } else { Reach::Until(next) };
            }
            t = next;
        }
        Reach::Until(t)
    }
}
