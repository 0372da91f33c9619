//! The reversal of a sliding shaft: friction changes its side where the speed passes 0, and nothing else changes.
//!
//! This is nearly every end of a mode where friction holds a wheel that its motor's ripple moves to and fro. Both
//! modes have the same matrix, and their inputs differ by a constant `Δ` in the speed alone. So the motion after the
//! reversal is the motion before it, continued, plus `K(t) Δ`, with `K(t) = t + A t²/2 + A² t³/6 + …` and `t` the time
//! since the reversal. The continued motion is one leap from the anchor to the clock edge, and the terms of the sum are
//! constants of the mode. The instant is a root of the speed alone: its derivatives at the edge are one product of a
//! matrix, whose rows are those of the powers of `A`, with the slope there.
//!
//! Any other end of a mode, or a reversal that is not certain in `f64`, is left to the general search of
//! `device/modes.rs`.

use crate::flow::double::{Double, Doubles, Native, Product, Wide, two_sum};
use crate::flow::lanes::Lanes;
use crate::flow::leap::Integrals;
use crate::flow::linear::Linear;
use crate::flow::matrix::{CURRENT, Columns, SPEED, State};

/// The greatest (rate τ) of a clock edge. The first term left out is the ninth, 4e-35 of the first; the first term in
/// `f64` alone is the fifth, 3e-17 of it.
const SHORT: f64 = 2.5e-4;
/// The reversal is left to the general search nearer to either edge than this share of the time between them.
const MARGIN: f64 = 1e-6;
/// The most by which the slope may change within an edge, as a share of it. A step of Newton's then makes an error of
/// `e` edges less than `e²/6`.
const BEND: f64 = 0.25;
/// The most of these steps, and the step after which another would not change an `f64`.
const STEPS: u32 = 4;
const CLOSE: f64 = 1e-8;

/// Constants of the reversals in a mode.
pub(crate) struct Reversal {
    /// Row `k` times a slope is the speed's term of order `k + 2`: the row of the speed in `Aᵏ⁺¹ / (k + 2)!`.
    rows: Wide,
    /// The same for the orders 6 to 8, in `f64`; the last row is zero.
    late: Columns,
    /// `Aᵏ⁻¹ Δ / k!` for `k` from 1 to 4, and from 5 to 8 in `f64`, where `Δ` is twice the friction that opposes a
    /// negative speed.
    kicks: [Doubles; 4],
    late_kicks: [State; 4],
    /// The first three of them over `k + 1`, for their integrals.
    paths: [State; 3],
    /// The second to the fourth times `k`, for the slope of their sum.
    slopes: [State; 3],
}

/// The last part of an edge, from the reversal on.
pub(crate) struct Rest {
    /// Its length, and the rest of it: some units in its last place.
    left_s: f64,
    more_s: f64,
    /// The slope of the speed at the reversal, before it.
    pub slope: f64,
    /// Half the second derivative of the speed there.
    bend: f64,
    /// The angle that the motion would turn in it without a reversal.
    pub turn_rad: f64,
}

impl Reversal {
    /// Returns the constants of a mode; `None` if an edge is too long for them.
    pub(crate) fn new(system: &Linear, coulomb: Double) -> Option<Box<Self>> {
        if system.rate * system.edge_s >= SHORT {
            return None;
        }
        let over = |k: usize| Double::from(1.0).over((k as f64).into());
        let a = |r: usize, c: usize| system.wide.column(c).lane(r);
        let mut row: [Double; 4] = std::array::from_fn(|c| Double::from(f64::from(u8::from(c == SPEED))));
        let rows: [[Double; 4]; 7] = std::array::from_fn(|k| {
            row = std::array::from_fn(|c| (0..4).fold(Double::ZERO, |sum, r| sum + row[r] * a(r, c)) * over(k + 2));
            row
        });
        let late: [State; 4] = std::array::from_fn(|k| rows.get(k + 4).map_or([0.0; 4], |row| row.map(|x| x.hi)));
        let mut kick = Doubles::ZERO;
        kick.set(SPEED, coulomb + coulomb);
        let kicks: [Doubles; 8] = std::array::from_fn(|k| {
            if k > 0 {
                kick = system.derived::<Native>(&kick).scaled::<Native>(over(k + 1));
            }
            kick
        });
        Some(Box::new(Self {
            rows: Wide::of(&[rows[0], rows[1], rows[2], rows[3]]),
            late: Columns::of(&late),
            kicks: [kicks[0], kicks[1], kicks[2], kicks[3]],
            late_kicks: std::array::from_fn(|k| kicks[k + 4].hi),
            paths: std::array::from_fn(|k| kicks[k].hi.map(|x| x / (k + 2) as f64)),
            slopes: std::array::from_fn(|k| kicks[k + 1].hi.map(|x| x * (k + 2) as f64)),
        }))
    }

    /// Returns the jump of the speed's slope at the reversal of a positive speed.
    #[inline(always)]
    pub(crate) fn kick(&self) -> f64 {
        self.kicks[0].hi[SPEED]
    }

    /// Returns the part of an edge after the reversal. `x` and `w` are state and slope at the end of the edge of the
    /// motion without a reversal. `None` if `f64` is not certain that the speed passes 0 once in the edge.
    #[inline(always)]
    pub(crate) fn rest<P: Product>(&self, x: &Doubles, w: &Doubles, edge_s: f64) -> Option<Rest> {
        let orders = self.rows.image::<P>(w);
        let late = self.late.image::<P::Lanes>(&w.hi).state();
        let (speed, slope) = (x.hi[SPEED], w.hi[SPEED]);
        let [c2, c3, c4, c5] = orders.hi;
        // At the edge before, the speed still has its sign; in between it is nearly straight.
        let straight = slope * edge_s;
        let start = speed - edge_s * (slope - edge_s * (c2 - edge_s * c3));
        let is_certain = speed * straight > MARGIN * straight * straight
            && start * straight < -MARGIN * straight * straight
            && 2.0 * edge_s * (c2.abs() + 2.0 * edge_s * c3.abs()) < BEND * slope.abs();
        if !is_certain {
            return None;
        }
        // The time from the reversal to the edge: four terms of the series that inverts the polynomial, then Newton's
        // steps, mostly one. Time runs backward, so that every other sign changes.
        let descent = |s: f64| slope - s * (2.0 * c2 - s * (3.0 * c3 - s * (4.0 * c4)));
        let inverse = 1.0 / slope;
        let first = speed * inverse;
        let square = first * first;
        let (second, third, fourth) =
            (first * (c2 * inverse), square * (c3 * inverse), square * first * (c4 * inverse));
        let (cubic, quartic) = (second * (2.0 * second) - third, second * (5.0 * (second * second - third)) + fourth);
        let mut s = first * (1.0 + second + (cubic + quartic));
        for _ in 0..STEPS {
            let step = (speed - s * (slope - s * (c2 - s * (c3 - s * c4)))) / descent(s);
            s += step;
            if step.abs() <= CLOSE * s {
                break;
            }
        }
        // One more step, from the value in double-double. Rests are joined only at the end: they stay far below their
        // numbers, because each term is a small part of the one before it.
        let small = -s * (c5 - s * (late[0] - s * (late[1] - s * late[2])));
        let mut sum = (c4, orders.lo[2] + small);
        let terms = [orders.lane(1), orders.lane(0), w.lane(SPEED), x.lane(SPEED)];
        for term in terms {
            let (product, error) = P::two(sum.0, -s);
            let (high, rest) = two_sum(term.hi, product);
            sum = (high, rest + (term.lo + (error - sum.1 * s)));
        }
        Some(Rest {
            left_s: s,
            more_s: (sum.0 + sum.1) / descent(s),
            slope: descent(s),
            bend: c2 - s * (3.0 * c3),
            turn_rad: s * (speed - s * (0.5 * slope - s * (c2 * (1.0 / 3.0) - s * (0.25 * c3)))),
        })
    }

    /// Returns the state at the end of the edge after the reversal of a speed of this sign, and its change by the
    /// reversal, rounded. `x` is the state there of the motion without it.
    #[inline(always)]
    pub(crate) fn end<P: Product>(&self, x: &Doubles, rest: &Rest, sign: f64) -> (Doubles, State) {
        let (t, signed) = (P::all(rest.left_s), P::all(sign * rest.left_s));
        let mut small = P::all(0.0);
        for term in self.late_kicks.iter().rev() {
            small = (small + P::lanes(term)) * t;
        }
        let [first, second, third, fourth] = &self.kicks;
        let (mut high, mut low) = (P::lanes(&fourth.hi), P::lanes(&fourth.lo) + small);
        for term in [third, second, first] {
            let (product, error) = P::two_of(high, t);
            let (sum, lost) = two_sum(P::lanes(&term.hi), product);
            (high, low) = (sum, lost + (P::lanes(&term.lo) + (error + low * t)));
        }
        let (change, error) = P::two_of(high, signed);
        let (moved, lost) = two_sum(P::lanes(&x.hi), change);
        let low = lost + (P::lanes(&x.lo) + (error + low * signed));
        // The rest of the time is known last: nothing else waits for it. Four terms of the slope are enough for it.
        let [then, later, last] = &self.slopes;
        let slope = P::lanes(&first.hi) + (P::lanes(then) + (P::lanes(later) + P::lanes(last) * t) * t) * t;
        let more = slope * P::all(sign * rest.more_s);
        (Doubles::joined::<P::Lanes>(moved, low + more), (change + more).state())
    }

    /// Changes the integrals of the motion without a reversal into those with the reversal of a speed of this sign. `x`
    /// and `w` are state and slope at the end of the edge of the motion without it.
    #[inline(always)]
    pub(crate) fn include<L: Lanes>(&self, rest: &Rest, sign: f64, x: &State, w: &State, done: &mut Integrals<L, L>) {
        let t = rest.left_s;
        let ([path, then, last], all) = (&self.paths, L::all(t));
        let path = L::of(path) + all * (L::of(then) + all * L::of(last));
        done.states = done.states + L::all(sign * t * t) * path;
        // ∫ (x + δ)² - x² = ∫ (2 x + δ) δ, with the first two orders of x and δ: the next is 1e-5 of them.
        let cube = t * t * t;
        let [first, second, third, _] = &self.kicks;
        let (kick, drag) = (sign * first.hi[SPEED], sign * second.hi[SPEED]);
        let (slope, bend) = (2.0 * rest.slope + kick, 2.0 * rest.bend + drag);
        let mut squares = [0.0; 4];
        squares[SPEED] = cube * (slope * kick * (1.0 / 3.0) + 0.25 * t * (slope * drag + bend * kick));
        let current = x[CURRENT] - t * w[CURRENT];
        let (emf, more) = (sign * second.hi[CURRENT], sign * third.hi[CURRENT]);
        squares[CURRENT] = 2.0 * cube * (current * emf * (1.0 / 3.0) + 0.25 * t * (current * more + w[CURRENT] * emf));
        done.squares = done.squares + L::of(&squares);
    }
}
