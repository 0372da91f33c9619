//! Linear time-invariant systems of four states, flowed exactly over whole clock edges.
//!
//! `x' = A x + f` with `f` constant. With `w = A x₀ + f` the solution is `x(t) = x₀ + P(t) w`, `P(t) = ∫₀ᵗ e^{As} ds`: the
//! change is computed, never the sum of state and change, so that a short leap of a long motion loses nothing. `P` is
//! tabulated for the digits of the edge count in base 128; a leap of any length costs one small product a digit.
//!
//! The same digits give the exact integrals of the trajectory that an energy audit needs ([`Integrals`]).

use std::sync::OnceLock;

use crate::leap::{Integrals, Leap, joined};
use crate::matrix::{Columns, Matrix, State, map2, plus, product, rate};

const BITS: u32 = 7;
const RADIX: usize = 1 << BITS;
const MASK: u64 = RADIX as u64 - 1;

/// A linear system, its leaps tabulated for one clock period.
pub struct Linear {
    pub(crate) a: Matrix,
    columns: Columns,
    /// How fast it moves, in 1/s.
    pub(crate) rate: f64,
    pub(crate) edge_s: f64,
    /// `P` for digit `d` of level `k`, at `128 k + d`.
    p: Vec<Columns>,
    /// Quadratures, made when first asked for: many runs never audit.
    leaps: OnceLock<Vec<Leap>>,
    /// `bounds[j]` ≥ |e^{At}| element by element, for 0 ≤ t ≤ 2^j edges.
    bounds: Vec<Matrix>,
}

impl Linear {
    /// A system `x' = A x + f` on a clock of period `edge_s`, tabulated for leaps of up to `horizon` edges.
    #[must_use]
    pub fn new(a: Matrix, edge_s: f64, horizon: u64) -> Self {
        let levels = horizon.max(1).ilog2() / BITS + 1;
        let mut p = Vec::with_capacity(RADIX * levels as usize);
        let mut unit = Leap::of(&a, edge_s).p;
        let mut bounds = Vec::with_capacity(1 + (levels * BITS) as usize);
        let identity: Matrix = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        // |e^{At}| ≤ I + |A| e^{|A| edge} edge for t within one edge.
        let size = map2(&a, &a, |x, _| x.abs());
        bounds.push(map2(&identity, &product(&size, &Leap::of(&size, edge_s).p), |x, y| x + y));
        for _ in 0..levels {
            let (level, next) = digits([[0.0; 4]; 4], unit, |first, second| joined(&a, first, second));
            for power in (0..BITS).map(|bit| &level[1 << bit]) {
                // e^{A(t + 2^j)} = e^{At} e^{A 2^j}: the bound doubles with the leap.
                let phi = map2(&identity, &product(&a, power), |x, y| (x + y).abs());
                let last = bounds[bounds.len() - 1];
                bounds.push(map2(&last, &product(&last, &phi), f64::max));
            }
            p.extend(level.iter().map(Columns::of));
            unit = next;
        }
        Self { a, columns: Columns::of(&a), rate: rate(&a), edge_s, p, leaps: OnceLock::new(), bounds }
    }

    /// The matrix `A`.
    #[must_use]
    pub fn matrix(&self) -> &Matrix {
        &self.a
    }

    /// The clock period in seconds.
    #[must_use]
    pub fn edge_s(&self) -> f64 {
        self.edge_s
    }

    /// `A x + f`.
    #[inline(always)]
    pub(crate) fn slope(&self, x: &State, f: &State) -> State {
        plus(&self.columns.times(x), f)
    }

    /// A bound of |e^{At}|, element by element, for every `t` from 0 to `edges` edges.
    #[inline]
    pub(crate) fn bound(&self, dyadic: usize) -> &Matrix {
        &self.bounds[dyadic]
    }

    /// How many dyadic bounds there are.
    pub(crate) fn dyadic(&self) -> usize {
        self.bounds.len()
    }

    fn leaps(&self) -> &[Leap] {
        self.leaps.get_or_init(|| {
            let mut all = Vec::with_capacity(self.p.len());
            let mut unit = Leap::of(&self.a, self.edge_s);
            for _ in 0..self.p.len() / RADIX {
                let (level, next) = digits(Leap::NOTHING, unit, |first, second| first.then(&self.a, second));
                all.extend(level);
                unit = next;
            }
            all
        })
    }
}

/// `unit` repeated 0 to 127 times, by doubling, so that rounding grows with the number of bits only; and 128 times.
fn digits<T: Copy>(nothing: T, unit: T, then: impl Fn(&T, &T) -> T) -> (Vec<T>, T) {
    let mut all = vec![nothing, unit];
    for d in 2..=RADIX {
        all.push(if d % 2 == 0 { then(&all[d / 2], &all[d / 2]) } else { then(&all[d - 1], &unit) });
    }
    let next = all.remove(RADIX);
    (all, next)
}

/// A motion: a system, an anchor state at edge 0 and a constant input.
#[derive(Clone, Copy)]
pub struct Trajectory<'a> {
    pub(crate) system: &'a Linear,
    pub(crate) x: State,
    f: State,
    pub(crate) w: State,
}

impl<'a> Trajectory<'a> {
    /// The motion from state `x` under the constant `f`.
    #[must_use]
    pub fn new(system: &'a Linear, x: State, f: State) -> Self {
        Self { system, x, f, w: system.slope(&x, &f) }
    }

    /// The system.
    #[must_use]
    pub fn system(&self) -> &'a Linear {
        self.system
    }

    /// The anchor state.
    #[must_use]
    pub fn anchor(&self) -> &State {
        &self.x
    }

    /// The constant input `f`.
    #[must_use]
    pub fn constant(&self) -> &State {
        &self.f
    }

    /// `x'` at a state of this motion.
    #[inline(always)]
    #[must_use]
    pub fn slope(&self, x: &State) -> State {
        self.system.slope(x, &self.f)
    }

    /// State and slope at the last multiple of 128 edges: the part that 128 successive edges share.
    #[inline]
    #[must_use]
    pub fn prefix(&self, block: u64) -> (State, State) {
        let (mut x, mut w) = (self.x, self.w);
        if block != 0 {
            let mut level = block.ilog2() / BITS + 1;
            loop {
                let digit = (block >> ((level - 1) * BITS) & MASK) as usize;
                if digit != 0 {
                    x = plus(&x, &self.system.p[level as usize * RADIX + digit].times(&w));
                    w = self.slope(&x);
                }
                level -= 1;
                if level == 0 {
                    break;
                }
            }
        }
        (x, w)
    }

    /// The state `digit` edges (0 to 127) after a [`prefix`](Self::prefix).
    #[inline(always)]
    #[must_use]
    pub fn within(&self, prefix: &(State, State), digit: u64) -> State {
        if digit == 0 { prefix.0 } else { plus(&prefix.0, &self.system.p[digit as usize].times(&prefix.1)) }
    }

    /// The state after `edges` edges. The same function serves every driver, so that they agree to the bit.
    #[inline]
    #[must_use]
    pub fn at(&self, edges: u64) -> State {
        self.within(&self.prefix(edges >> BITS), edges & MASK)
    }

    /// The same for edges asked one after the other: keeps in `cache` what neighbours share.
    #[inline(always)]
    pub(crate) fn at_next(&self, edges: u64, cache: &mut (u64, (State, State))) -> State {
        if cache.0 != edges >> BITS {
            *cache = (edges >> BITS, self.prefix(edges >> BITS));
        }
        self.within(&cache.1, edges & MASK)
    }

    /// The exact integrals from the anchor to `edges` edges later, and the state there, equal to [`at`](Self::at).
    #[must_use]
    pub fn integrals(&self, edges: u64) -> (Integrals, State) {
        let leaps = self.system.leaps();
        let mut total = Integrals::default();
        let (mut x, mut w) = (self.x, self.w);
        if edges == 0 {
            return (total, x);
        }
        for level in (0..=edges.ilog2() / BITS).rev() {
            let digit = (edges >> (level * BITS) & MASK) as usize;
            if digit != 0 {
                let index = level as usize * RADIX + digit;
                total.add(&leaps[index].integrals(&x, &w));
                x = plus(&x, &self.system.p[index].times(&w));
                if level > 0 {
                    w = self.slope(&x);
                }
            }
        }
        (total, x)
    }
}
