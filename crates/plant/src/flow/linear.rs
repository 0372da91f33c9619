//! Linear time-invariant systems of four states or more, flowed exactly over whole clock edges.
//!
//! `x' = A x + f` with `f` constant. With `w = A x₀ + f` the solution is `x(t) = x₀ + P(t) w` and its slope `w + A P(t)
//! w`, `P(t) = ∫₀ᵗ e^{As} ds`. The change of the state is computed, not the sum of state and change, so that a short
//! leap of a long motion loses no digits. `P` and `A P` are tabulated for the digits of the edge count in base 128; a
//! leap of any length takes two small products per digit.
//!
//! Anchor, constants and tables are double-double. A motion's next anchor is computed in double-double
//! ([`Trajectory::flow`]). States in between are computed with the high parts only ([`Trajectory::at`]);
//! [`Guard`](crate::Guard) bounds their error.
//!
//! The same digits give the exact integrals of the trajectory that an energy audit needs ([`Integrals`]).

use std::sync::OnceLock;

use crate::flow::double::{Double, Doubles, Product, Wide, versions};
use crate::flow::lanes::{Array, Blocks, Count, Lanes, Numbers, Size};
use crate::flow::leap::{Integrals, Leap, Passed, Quadrature, Square};
use crate::flow::matrix::{Columns, Matrix, State, map2, norm, plus, product, rate, sizes};

const BITS: u32 = 7;
const RADIX: usize = 1 << BITS;
const MASK: u64 = RADIX as u64 - 1;

/// The effect of a leap on state and slope.
#[derive(Clone, Copy)]
struct Digit<const N: usize> {
    /// `P`: maps the slope to the change of the state.
    p: Wide<N>,
    /// `A P`: maps the slope to its own change.
    turn: Wide<N>,
}

/// State and slope, or two other vectors, in lanes.
type Two<L, const N: usize> = (Blocks<L, N>, Blocks<L, N>);

impl<const N: usize> Digit<N>
where
    Count<N>: Size<N>,
{
    /// Returns state and slope after the leap, in `f64`.
    #[inline(always)]
    fn after<L: Lanes>(&self, (x, w): Two<L, N>) -> Two<L, N> {
        let slopes = w.numbers();
        (x + self.p.hi.image::<L>(&slopes), w + self.turn.hi.image::<L>(&slopes))
    }

    /// Returns only the state.
    #[inline(always)]
    fn state_after<L: Lanes>(&self, (x, w): Two<L, N>) -> Blocks<L, N> {
        x + self.p.hi.image::<L>(&w.numbers())
    }
}

/// A value for each digit of each level, computed when first needed: a run needs only few of them.
type Table<T> = Vec<OnceLock<Box<T>>>;

fn table<T>(levels: usize) -> Table<T> {
    (0..levels * RADIX).map(|_| OnceLock::new()).collect()
}

/// Returns the index of a digit of a level in a [`Table`].
#[inline(always)]
fn place(level: u32, digit: usize) -> usize {
    (level as usize) << BITS | digit
}

/// A linear system, with its leaps tabulated for one clock period.
pub struct Linear<const N: usize = 4> {
    pub(crate) a: Matrix<N>,
    pub(crate) wide: Wide<N>,
    /// How fast it moves, in 1/s: the `rate` of its matrix.
    pub(crate) rate: f64,
    pub(crate) edge_s: f64,
    /// `P` of one unit of each level, and the leaps of the digits.
    units: Vec<Wide<N>>,
    digits: Table<Digit<N>>,
    /// `P` of the lowest level again, rounded and stored contiguously, for callers that ask edge by edge.
    high: OnceLock<Vec<Columns<N>>>,
    /// Quadratures of the digits, and the squares whose integrals they give.
    quadratures: Table<(Leap<N>, Quadrature<N>)>,
    pub(crate) squares: Vec<Square<N>>,
    /// `bounds[j]` ≥ |e^{At}| element by element, for 0 ≤ t ≤ 2^j edges.
    bounds: Vec<Matrix<N>>,
    /// For the same lengths: twice the greatest error of the slope's `f64` value, for a slope of one at the anchor.
    errors: Vec<Columns<N>>,
}

impl<const N: usize> Linear<N>
where
    Count<N>: Size<N>,
{
    /// Creates the system `x' = A x + f` on a clock of period `edge_s`, tabulated for leaps of up to `horizon` edges.
    pub fn new(a: Matrix<N>, edge_s: f64, horizon: u64) -> Self {
        Self::exact(&a.map(|row| row.map(Double::from)), Square::of_axis(), edge_s, horizon)
    }

    versions! {
        /// Creates the system from a matrix in double-double.
        pub(crate) fn exact[exact_fused, exact_native, exact_with](
            rows: &[[Double; N]; N], squares: Vec<Square<N>>, edge_s: f64, horizon: u64
        ) -> Self
    }

    #[inline(always)]
    fn exact_with<P: Product>(rows: &[[Double; N]; N], squares: Vec<Square<N>>, edge_s: f64, horizon: u64) -> Self {
        let (wide, a) = (Wide::of(rows), rows.map(|row| row.map(|x| x.hi)));
        let count = (horizon.max(1).ilog2() / BITS + 1) as usize;
        let identity: Matrix<N> = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        // |e^{At}| ≤ I + |A| e^{|A| edge} edge for t within one edge.
        let size = map2(&a, &a, |x, _| x.abs());
        let mut bounds = vec![map2(&identity, &product(&size, &Leap::of(&size, &[], edge_s).p), |x, y| x + y)];
        let mut units = Vec::with_capacity(count);
        let mut unit = spread::<P, N>(&wide, &a, edge_s.into());
        for _ in 0..count {
            units.push(unit);
            for _ in 0..BITS {
                // e^{A(t + 2^j)} = e^{At} e^{A 2^j}: the bound doubles with the leap.
                let turn = wide.after::<P>(&unit);
                let phi = map2(&identity, &turn.rows(), |x, y| (x + y).abs());
                let last = bounds[bounds.len() - 1];
                bounds.push(map2(&last, &product(&last, &phi), f64::max));
                unit = joined::<P, N>(&unit, &turn, &unit);
            }
        }
        let (digits, high, quadratures) = (table(count), OnceLock::new(), table(count));
        let errors = bounds.iter().enumerate().map(|(dyadic, m)| {
            let sum = |x: &Matrix<N>, y: &Matrix<N>| map2(x, y, |x, y| x + y);
            let turns = product(&sum(m, &identity), m);
            let most = 5.2 * Self::digits(dyadic) as f64;
            let all = sum(&identity, &map2(&turns, &turns, |x, _| x * most));
            Columns::of(&map2(&product(m, &all), m, |x, _| x * f64::EPSILON))
        });
        let errors = errors.collect();
        Self { a, wide, rate: rate(&a), edge_s, units, digits, high, quadratures, squares, bounds, errors }
    }

    /// Returns the greatest number of edges of a leap.
    pub(crate) fn longest(&self) -> u64 {
        u64::MAX.checked_shr(u64::BITS.saturating_sub(BITS * self.units.len() as u32)).unwrap_or(0)
    }

    /// Returns the matrix `A`, rounded.
    pub fn matrix(&self) -> &Matrix<N> {
        &self.a
    }

    /// Returns the clock period in seconds.
    pub fn edge_s(&self) -> f64 {
        self.edge_s
    }

    /// Returns `A x + f`.
    #[inline(always)]
    pub(crate) fn slope<P: Product>(&self, x: &Doubles<N>, f: &Doubles<N>) -> Doubles<N> {
        self.wide.times::<P>(x, f)
    }

    /// Returns `A w`, for derivatives.
    #[inline(always)]
    pub(crate) fn derived<P: Product>(&self, w: &Doubles<N>) -> Doubles<N> {
        self.wide.image::<P>(w)
    }

    versions! {
        /// Returns `P` for any time.
        pub(crate) fn spread[spread_fused, spread_native, spread_with](self: &Self, time_s: Double) -> Wide<N>
    }

    #[inline(always)]
    fn spread_with<P: Product>(&self, time_s: Double) -> Wide<N> {
        spread::<P, N>(&self.wide, &self.a, time_s)
    }

    /// Returns steps of this number of edges.
    pub fn stride(&self, edges: u64) -> Stride<N> {
        let p = self.spread(Double::product(edges as f64, self.edge_s)).hi;
        Stride { a: Columns::of(&self.a), p }
    }

    /// Returns a bound of |e^{At}|, element by element, for every `t` from 0 to 2^`dyadic` edges.
    #[inline]
    pub(crate) fn bound(&self, dyadic: usize) -> &Matrix<N> {
        &self.bounds[dyadic]
    }

    /// Returns a bound of the error of the slope's `f64` value up to 2^`dyadic` edges after an anchor with a slope of
    /// one. It covers the terms of second order too.
    #[inline(always)]
    pub(crate) fn slope_error(&self, dyadic: usize) -> &Columns<N> {
        &self.errors[dyadic]
    }

    /// Returns the number of dyadic bounds.
    pub(crate) fn dyadic(&self) -> usize {
        self.bounds.len()
    }

    /// Returns the number of digits of an edge count below 2^`dyadic`.
    pub(crate) fn digits(dyadic: usize) -> usize {
        dyadic / BITS as usize + 1
    }

    /// Returns state and slope after `block` times 128 edges.
    #[inline(always)]
    fn prefix<L: Lanes>(&self, from: Two<L, N>, block: u64) -> Two<L, N> {
        self.coarse::<L, 1>(from, block)
    }

    /// Returns state and slope after `blocks` times 128^`LEAST` edges.
    #[inline(always)]
    fn coarse<L: Lanes, const LEAST: u32>(&self, mut moved: Two<L, N>, blocks: u64) -> Two<L, N> {
        if blocks != 0 {
            let mut level = blocks.ilog2() / BITS + LEAST;
            loop {
                let digit = (blocks >> ((level - LEAST) * BITS) & MASK) as usize;
                if digit != 0 {
                    moved = self.digit(level, digit).after::<L>(moved);
                }
                if level == LEAST {
                    break;
                }
                level -= 1;
            }
        }
        moved
    }

    /// Returns state and slope this number of edges after the given ones, in `f64`.
    #[inline(always)]
    pub(crate) fn after<P: Product>(&self, x: &State<N>, w: &State<N>, edges: u64) -> (State<N>, State<N>) {
        let mut moved = self.prefix::<P::Lanes>((P::blocks(x), P::blocks(w)), edges >> BITS);
        let digit = (edges & MASK) as usize;
        if digit != 0 {
            moved = self.digit(0, digit).after::<P::Lanes>(moved);
        }
        (moved.0.numbers(), moved.1.numbers())
    }

    /// Returns only the state this number of edges after the given one, in `f64`.
    #[inline(always)]
    pub(crate) fn state_after<P: Product>(&self, x: &State<N>, w: &State<N>, edges: u64) -> State<N> {
        let moved = self.prefix::<P::Lanes>((P::blocks(x), P::blocks(w)), edges >> BITS);
        let digit = (edges & MASK) as usize;
        if digit == 0 { moved.0 } else { self.digit(0, digit).state_after::<P::Lanes>(moved) }.numbers()
    }

    /// Returns the integrals over this number of edges from state `x` with slope `w`, and state and slope after them,
    /// in `f64`.
    #[inline(always)]
    pub(crate) fn glide<P: Product>(
        &self,
        x: &State<N>,
        w: &State<N>,
        edges: u64,
    ) -> (Integrals<State<N>>, State<N>, State<N>) {
        let (mut x, mut w, mut total) = (P::blocks(x), P::blocks(w), Quadrature::<N>::nothing::<P::Lanes>());
        for level in (0..=edges.max(1).ilog2() / BITS).rev() {
            let digit = (edges >> (level * BITS) & MASK) as usize;
            if digit != 0 {
                self.quadrature(level, digit).1.add_lanes::<P::Lanes>(
                    &self.squares,
                    &x.numbers(),
                    &w.numbers(),
                    &mut total,
                );
                (x, w) = self.digit(level, digit).after::<P::Lanes>((x, w));
            }
        }
        (Quadrature::<N>::in_memory::<P::Lanes>(&total), x.numbers(), w.numbers())
    }

    /// Returns `∫ x dt` over this number of edges from state `x` with slope `w`, in `f64`.
    pub(crate) fn path(&self, x: &State<N>, w: &State<N>, edges: u64) -> State<N> {
        let (mut x, mut w): Two<Array, N> = (Numbers::taken(x), Numbers::taken(w));
        let mut total = [0.0; N];
        for level in (0..=edges.max(1).ilog2() / BITS).rev() {
            let digit = (edges >> (level * BITS) & MASK) as usize;
            if digit != 0 {
                self.quadrature(level, digit).1.add_path(&x.numbers(), &w.numbers(), &mut total);
                (x, w) = self.digit(level, digit).after::<Array>((x, w));
            }
        }
        total
    }

    /// Returns the leap of a digit (at least 1) of a level.
    #[inline(always)]
    fn digit(&self, level: u32, digit: usize) -> &Digit<N> {
        match self.digits[place(level, digit)].get() {
            Some(digit) => digit,
            None => self.tabulate(level, digit),
        }
    }

    #[cold]
    fn tabulate(&self, level: u32, digit: usize) -> &Digit<N> {
        let unit = &self.units[level as usize];
        self.digits[place(level, digit)].get_or_init(|| {
            // By doubling, so that rounding grows only with the number of bits.
            let pair = match digit {
                1 => None,
                _ if digit.is_multiple_of(2) => Some(self.digit(level, digit / 2)).map(|half| (half, &half.p)),
                _ => Some((self.digit(level, digit - 1), unit)),
            };
            Box::new(Self::follow(&self.wide, unit, pair))
        })
    }

    versions! {
        /// Returns the leap of one unit, or of two leaps one after the other.
        fn follow[follow_fused, follow_native, follow_with](
            a: &Wide<N>, unit: &Wide<N>, pair: Option<(&Digit<N>, &Wide<N>)>
        ) -> Digit<N>
    }

    #[inline(always)]
    fn follow_with<P: Product>(a: &Wide<N>, unit: &Wide<N>, pair: Option<(&Digit<N>, &Wide<N>)>) -> Digit<N> {
        let p = match pair {
            None => *unit,
            Some((Digit { p, turn }, second)) => joined::<P, N>(p, turn, second),
        };
        Digit { p, turn: a.after::<P>(&p) }
    }

    /// Returns `P` of up to 127 edges, rounded.
    #[inline(always)]
    fn high(&self) -> &[Columns<N>] {
        match self.high.get() {
            Some(high) => high,
            None => self.gather(),
        }
    }

    #[cold]
    fn gather(&self) -> &[Columns<N>] {
        let all = || (1..RADIX).map(|digit| self.digit(0, digit).p.hi);
        self.high.get_or_init(|| std::iter::once(Columns([[0.0; N]; N])).chain(all()).collect())
    }

    #[inline(always)]
    fn quadrature(&self, level: u32, digit: usize) -> &(Leap<N>, Quadrature<N>) {
        match self.quadratures[place(level, digit)].get() {
            Some(quadrature) => quadrature,
            None => self.integrate(level, digit),
        }
    }

    #[cold]
    fn integrate(&self, level: u32, digit: usize) -> &(Leap<N>, Quadrature<N>) {
        self.quadratures[place(level, digit)].get_or_init(|| {
            let squares = &self.squares;
            let twice = |leap: &Leap<N>| leap.then(&self.a, squares, leap);
            let leap = match (digit, level) {
                (1, 0) => Leap::of(&self.a, squares, self.edge_s),
                (1, _) => twice(&self.quadrature(level - 1, RADIX / 2).0),
                _ if digit.is_multiple_of(2) => twice(&self.quadrature(level, digit / 2).0),
                _ => self.quadrature(level, digit - 1).0.then(&self.a, squares, &self.quadrature(level, 1).0),
            };
            Box::new((leap, Quadrature::of(&leap)))
        })
    }
}

/// Returns `P(a+b) = P(a) + P(b) Φ(a)` with `Φ(a) = I + A P(a)`, where `turn` is `A P(a)`.
#[inline(always)]
fn joined<P: Product, const N: usize>(first: &Wide<N>, turn: &Wide<N>, second: &Wide<N>) -> Wide<N>
where
    Count<N>: Size<N>,
{
    let mut columns = [Doubles::ZERO; N];
    for (c, column) in columns.iter_mut().enumerate() {
        *column = first.column(c).plus::<P>(&second.times::<P>(&turn.column(c), &second.column(c)));
    }
    Wide::from_columns(&columns)
}

/// Returns `P` for any time: by halving until the Taylor series converges, and doubling back.
#[inline(always)]
fn spread<P: Product, const N: usize>(a: &Wide<N>, rows: &Matrix<N>, time_s: Double) -> Wide<N>
where
    Count<N>: Size<N>,
{
    // The last term is 2⁻²⁴ / 24! of the first.
    const TERMS: usize = 24;
    let mut halvings = 0;
    let mut part = time_s;
    while norm(rows) * part.hi > 0.5 && halvings < 200 {
        part = Double { hi: 0.5 * part.hi, lo: 0.5 * part.lo };
        halvings += 1;
    }
    // P = Σ A^k t^{k+1} / (k+1)!, column by column.
    let mut columns = [Doubles::ZERO; N];
    for (c, column) in columns.iter_mut().enumerate() {
        let mut terms = [Doubles::ZERO; TERMS];
        terms[0].set(c, part);
        for k in 1..TERMS {
            let factor = part.over(((k + 1) as f64).into());
            terms[k] = a.times::<P>(&terms[k - 1], &Doubles::ZERO).scaled::<P>(factor);
        }
        for term in terms.iter().rev() {
            *column = column.plus::<P>(term);
        }
    }
    let mut p = Wide::from_columns(&columns);
    for _ in 0..halvings {
        p = joined::<P, N>(&p, &a.after::<P>(&p), &p);
    }
    p
}

/// Steps of one length in `f64`, each rounded, for a motion of which only the ends of steps matter. Error of a step: a
/// few units in the last place of `|A| |x|` times its length.
#[derive(Clone, Copy)]
pub struct Stride<const N: usize = 4> {
    a: Columns<N>,
    p: Columns<N>,
}

impl<const N: usize> Stride<N>
where
    Count<N>: Size<N>,
{
    /// Returns the state a step after `x` under the constant input `f`.
    #[inline(always)]
    pub fn after(&self, x: &State<N>, f: &State<N>) -> State<N> {
        plus(x, &self.change(&self.slope(x, f)))
    }

    /// Returns the slope `A x + f`.
    #[inline(always)]
    pub(crate) fn slope(&self, x: &State<N>, f: &State<N>) -> State<N> {
        plus(&self.a.times(x), f)
    }

    /// Returns the change of the state over a step that starts with the slope `w`.
    #[inline(always)]
    pub(crate) fn change(&self, w: &State<N>) -> State<N> {
        self.p.times(w)
    }
}

/// A motion: a system, an anchor state at edge 0 and a constant input.
#[derive(Clone, Copy)]
pub struct Trajectory<'a, const N: usize = 4> {
    pub(crate) system: &'a Linear<N>,
    pub(crate) x: Doubles<N>,
    pub(crate) f: Doubles<N>,
    pub(crate) w: Doubles<N>,
}

impl<'a, const N: usize> Trajectory<'a, N>
where
    Count<N>: Size<N>,
{
    /// Creates the motion from state `x` under the constant `f`.
    pub fn new(system: &'a Linear<N>, x: State<N>, f: State<N>) -> Self {
        Self::exact(system, x.into(), f.into())
    }

    versions! {
        /// Creates the motion from states in double-double.
        pub(crate) fn exact[exact_fused, exact_native, exact_with](
            system: &'a Linear<N>, x: Doubles<N>, f: Doubles<N>
        ) -> Self
    }

    #[inline(always)]
    pub(crate) fn exact_with<P: Product>(system: &'a Linear<N>, x: Doubles<N>, f: Doubles<N>) -> Self {
        Self { system, x, f, w: system.slope::<P>(&x, &f) }
    }

    /// Returns the system.
    pub fn system(&self) -> &'a Linear<N> {
        self.system
    }

    /// Returns the anchor state, rounded.
    pub fn anchor(&self) -> &State<N> {
        &self.x.hi
    }

    /// Returns `x'` at a state of this motion.
    #[inline(always)]
    pub fn slope(&self, x: &State<N>) -> State<N> {
        plus(&self.system.wide.hi.times(x), &self.f.hi)
    }

    /// Returns a bound of the error of the slope up to 2^`dyadic` edges.
    #[inline(always)]
    pub(crate) fn slope_error(&self, dyadic: usize) -> State<N> {
        self.system.slope_error(dyadic).times(&sizes(&self.w.hi))
    }

    /// Returns state and slope at the last multiple of 128 edges: the part that 128 successive edges share.
    #[inline(always)]
    fn prefix(&self, block: u64) -> (State<N>, State<N>) {
        let (x, w) = self.system.prefix::<Array>((Numbers::taken(&self.x.hi), Numbers::taken(&self.w.hi)), block);
        (x.numbers(), w.numbers())
    }

    versions! {
        /// Returns the state after `edges` edges, computed with the high parts. All drivers call this function, so that
        /// they agree to the bit.
        pub fn at[at_fused, at_native, at_with](self: &Self, edges: u64) -> State<N>
    }

    #[inline(always)]
    pub(crate) fn at_with<P: Product>(&self, edges: u64) -> State<N> {
        self.system.state_after::<P>(&self.x.hi, &self.w.hi, edges)
    }

    /// Returns the state at every edge after the anchor, if nothing moves.
    pub(crate) fn still(&self) -> Option<State<N>> {
        // The sum makes the zero below zero the one above, as leaps do.
        (self.w == Doubles::ZERO).then(|| plus(&self.x.hi, &self.w.hi))
    }

    versions! {
        /// Writes the states after `first` edges, `first + stride` edges and so on: each equals [`at`](Self::at) to the
        /// bit.
        pub(crate) fn rows[rows_fused, rows_native, rows_with](
            self: &Self, first: u64, stride: u64, rows: &mut [State<N>]
        )
    }

    #[inline(always)]
    fn rows_with<P: Product>(&self, first: u64, stride: u64, rows: &mut [State<N>]) {
        // Digits of two levels are looked up in tables of a fixed size, where no index needs to be checked.
        let levels = self.system.digits.as_chunks::<RADIX>().0;
        let (fine, coarse) = (&levels[0], levels.get(1).unwrap_or(&levels[0]));
        let leap = |level: u32, digit: u64| -> &Digit<N> {
            let digit = (digit & MASK) as usize;
            match if level == 0 { fine } else { coarse }[digit].get() {
                Some(digit) => digit,
                None => self.system.tabulate(level, digit),
            }
        };
        // Neighbours share all digits but their two lowest.
        let start = (P::blocks(&self.x.hi), P::blocks(&self.w.hi));
        let (mut blocks, mut shared) = (0, start);
        let mut edges = first;
        for row in rows {
            if edges >> (2 * BITS) != blocks {
                blocks = edges >> (2 * BITS);
                shared = match blocks {
                    1..=MASK => self.system.digit(2, blocks as usize).after::<P::Lanes>(start),
                    _ => self.system.coarse::<P::Lanes, 2>(start, blocks),
                };
            }
            let mut moved = shared;
            if edges >> BITS & MASK != 0 {
                moved = leap(1, edges >> BITS).after::<P::Lanes>(moved);
            }
            if edges & MASK != 0 {
                moved.0 = leap(0, edges).state_after::<P::Lanes>(moved);
            }
            *row = moved.0.numbers();
            edges += stride;
        }
    }

    versions! {
        /// Returns state and slope after `edges` edges, computed as in [`at`](Self::at).
        pub(crate) fn at_with_slope[slope_fused, slope_native, slope_with](
            self: &Self, edges: u64
        ) -> (State<N>, State<N>)
    }

    #[inline(always)]
    pub(crate) fn slope_with<P: Product>(&self, edges: u64) -> (State<N>, State<N>) {
        self.system.after::<P>(&self.x.hi, &self.w.hi, edges)
    }

    /// Returns the state for edges asked one after the other; keeps in `cache` the part that neighbours share.
    #[inline(always)]
    pub(crate) fn at_next(&self, edges: u64, cache: &mut (u64, (State<N>, State<N>))) -> State<N> {
        if cache.0 != edges >> BITS {
            *cache = (edges >> BITS, self.prefix(edges >> BITS));
        }
        match edges & MASK {
            0 => cache.1.0,
            digit => plus(&cache.1.0, &self.system.high()[digit as usize].times(&cache.1.1)),
        }
    }

    /// Returns the state after `edges` edges in double-double.
    #[inline(always)]
    pub(crate) fn flow<P: Product>(&self, edges: u64) -> Doubles<N> {
        self.leap::<P, false, false>(edges).1
    }

    /// Returns the exact integrals from the anchor to `edges` edges later, and the state there.
    #[inline(always)]
    pub(crate) fn integrals<P: Product>(&self, edges: u64) -> (Passed<P::Lanes, N>, Doubles<N>) {
        let (total, x, _) = self.leap::<P, true, false>(edges);
        (total, x)
    }

    /// Returns the [`integrals`](Self::integrals) and the state, and the slope there.
    #[inline(always)]
    pub(crate) fn integrals_and_slope<P: Product>(&self, edges: u64) -> (Passed<P::Lanes, N>, Doubles<N>, Doubles<N>) {
        self.leap::<P, true, true>(edges)
    }

    #[inline(always)]
    fn leap<P: Product, const AUDIT: bool, const SLOPE: bool>(
        &self,
        edges: u64,
    ) -> (Passed<P::Lanes, N>, Doubles<N>, Doubles<N>) {
        let (mut x, mut w) = (self.x, self.w);
        let mut total = Quadrature::<N>::nothing::<P::Lanes>();
        let mut rest = edges;
        let mut level = if edges == 0 { 0 } else { edges.ilog2() / BITS + 1 };
        while rest != 0 {
            level -= 1;
            let digit = (rest >> (level * BITS)) as usize;
            rest &= (1 << (level * BITS)) - 1;
            if digit != 0 {
                if AUDIT {
                    self.system.quadrature(level, digit).1.add_lanes::<P::Lanes>(
                        &self.system.squares,
                        &x.hi,
                        &w.hi,
                        &mut total,
                    );
                }
                let Digit { p, turn } = self.system.digit(level, digit);
                x = p.times::<P>(&w, &x);
                if SLOPE || rest != 0 {
                    w = turn.times::<P>(&w, &w);
                }
            }
        }
        (total, x, w)
    }
}
