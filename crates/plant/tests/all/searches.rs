//! The search for the first exit against every edge, on motions that graze their limits. The motions are polynomials
//! of the edge with integer coefficients, so that each edge is decided in integers.

use hpu_plant::{Band, Guard, Linear, MotionPoint, Trajectory};

use crate::random::Random;

/// Edges a motion lasts.
const EDGES: u64 = 1000;
/// An edge lasts this many seconds, a power of two.
const EDGE_S: f64 = 1.0 / 1_048_576.0;

/// A polynomial of the edge, by its coefficients.
#[derive(Clone, Debug)]
struct Polynomial(Vec<i128>);

impl Polynomial {
    fn times(&self, factor: &[i128]) -> Self {
        let mut product = vec![0; self.0.len() + factor.len() - 1];
        for (i, x) in self.0.iter().enumerate() {
            for (j, y) in factor.iter().enumerate() {
                product[i + j] += x * y;
            }
        }
        Self(product)
    }

    fn at(&self, edge: u64) -> i128 {
        self.0.iter().rev().fold(0, |sum, coefficient| sum * i128::from(edge) + coefficient)
    }

    /// Returns the motion of four integrators in a row whose last state is this polynomial plus `base`.
    fn motion<'a>(&self, system: &'a Linear, base: f64) -> Trajectory<'a> {
        let mut derivatives = [0.0; 5];
        let mut factorial = 1;
        for (k, &coefficient) in self.0.iter().enumerate() {
            factorial *= k.max(1) as i128;
            let exact = (coefficient * factorial) as f64;
            assert!(exact as i128 == coefficient * factorial);
            derivatives[k] = exact * EDGE_S.powi(-(k as i32));
        }
        let [value, first, second, third, fourth] = derivatives;
        let start = base + value;
        assert!((start - base) as i128 == self.0[0], "the start is exact");
        Trajectory::new(system, [second, first, start, third], [0.0, 0.0, 0.0, fourth])
    }
}

/// Four integrators in a row: from the last state to the first, the second, the third.
fn integrators() -> Linear {
    let a = [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]];
    Linear::new(a, EDGE_S, 1 << 20)
}

/// Returns a polynomial whose values at edges are odd: a product of roots between two edges, and of parabolas that come
/// near to zero and turn.
fn grazing(random: &mut Random) -> Polynomial {
    let odd = |random: &mut Random| 2 * random.below(EDGES + 200) as i128 - 199;
    let mut polynomial = Polynomial(vec![if random.below(2) == 0 { 1 } else { -1 }]);
    let degree = 1 + random.below(4) as usize;
    while polynomial.0.len() <= degree {
        let k = odd(random);
        match random.below(3) {
            // A pair of roots with few edges in between.
            0 if polynomial.0.len() < degree => {
                let gap = 2 * [1, 1, 2, 3, 10, 100][random.below(6) as usize];
                polynomial = polynomial.times(&[-k, 2]).times(&[-k - gap, 2]);
            }
            // No root, but nearly one.
            1 if polynomial.0.len() < degree => {
                let above = 2 * [1, 2, 30, 1000, 100_000][random.below(5) as usize];
                polynomial = polynomial.times(&[k * k + above, -4 * k, 4]);
            }
            _ => polynomial = polynomial.times(&[-k, 2]),
        }
    }
    polynomial
}

#[test]
fn no_edge_is_missed_by_a_motion_that_grazes_its_limits() {
    let system = integrators();
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let mut random = Random(14);
    let (mut exits, mut others) = (0, 0);
    for trial in 0..20_000 {
        let mut polynomial = grazing(&mut random);
        // Far from zero an f64 holds multiples of `unit` alone: values at neighbouring edges may be the same.
        let (base, unit) = [(0.0, 1), (2f64.powi(52), 1), (-2f64.powi(56), 16), (2f64.powi(60), 256)][trial % 4];
        polynomial.0[0] -= polynomial.0[0].rem_euclid(unit);
        let values: Vec<i128> = (0..=EDGES).map(|edge| polynomial.at(edge)).collect();
        let motion = polynomial.motion(&system, base);
        let from = if random.below(2) == 0 { 0 } else { random.below(EDGES - 1) };
        let to = if random.below(2) == 0 { EDGES } else { from + 1 + random.below(EDGES - from) };
        // One limit is zero, the other is none or just about where the motion comes.
        let now = values[from as usize];
        let most = values[from as usize..=to as usize].iter().map(|value| value * now.signum()).max().expect("edges");
        let far = [None, Some(most + unit), Some(most), Some(most - 1)][random.below(4) as usize];
        let far = far.map(|far| far - far.rem_euclid(unit)).filter(|far| *far >= now.abs());
        let (low, high) = if now > 0 { (Some(0), far) } else { (far.map(|far| -far), Some(0)) };
        let open = random.below(2) == 0;
        let is_outside = |value: i128| {
            low.is_some_and(|low| value < low) || high.is_some_and(|high| value > high || open && value == high)
        };
        // The engine's values are exact up to the second degree; beyond it they are not told from a limit's.
        let is_tied = polynomial.0.len() > 3 && values.iter().any(|value| low == Some(*value) || high == Some(*value));
        if is_outside(now) || is_tied {
            continue;
        }
        let limit = |limit: Option<i128>, none: f64| limit.map_or(none, |limit| base + limit as f64);
        let band = Band { low: limit(low, f64::NEG_INFINITY), high: limit(high, f64::INFINITY), open };
        let expected = (from + 1..=to).find(|&edge| is_outside(values[edge as usize]));
        let ends = [from, to].map(|edge| MotionPoint::of(&motion, edge));
        let found = guard.first(&motion, &band, &ends[0], &ends[1]);
        assert_eq!(found, expected, "trial {trial}: {polynomial:?} from {from} to {to} in {low:?} to {high:?}, {open}");
        exits += u64::from(expected.is_some());
        others += u64::from(expected.is_none());
    }
    assert!(exits > 5000 && others > 2000, "{exits} exits, {others} others");
}
