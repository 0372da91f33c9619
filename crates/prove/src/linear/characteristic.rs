//! The characteristic function of a scene's linear loop, enclosed over a range of stiffnesses.
//!
//! From sample to sample the plant's states change by `x⁺ = x + E x + Γ u + Γ' u'`. `u` is the effort that begins
//! within the period, `u'` the effort before it. The controller answers the position by `-num(z)/den(z)`, `w` whole
//! samples late. With `δ = z - 1` the loop's poles are the roots of
//!
//! `F(z) = den(z) det(δ - E) + num(z) z^-w c adj(δ - E) (Γ + Γ'/z)`.
//!
//! At the sample rate of a controller `F` is well conditioned in powers of `δ`, but not in powers of `z`. A sampled
//! spring enters `num` and `den` affinely. A live spring is part of the plant, so `E` and `Γ` are matrix exponentials
//! over an interval of stiffnesses, with their derivatives.
//!
//! Every enclosure holds for the scene's parameters as `f64` numbers, whatever is rounded during the computation.

use super::jet::{ALONG, Jet};
use crate::interval::{Complex, Interval};

/// The characteristic function `F`, over all stiffnesses of a range.
pub(super) struct Characteristic {
    pub range: [f64; 2],
    /// Pairs of a lag, in samples, and the coefficients of the powers of `δ` at this lag.
    pub terms: Vec<(u32, Vec<Jet>)>,
    /// Distances from the middle to the ends: of the stiffnesses, then of each side of the box.
    pub away: [Interval; ALONG],
}

/// A function over an arc of the unit circle, and its derivative by the angle.
#[derive(Clone, Copy)]
pub(super) struct OnArc {
    pub value: Complex,
    pub by_angle: Complex,
}

/// Selects which number of each coefficient a value is computed from.
#[derive(Clone, Copy)]
pub(super) enum Of {
    /// `F` at the middle of the range of stiffnesses and of the parameter box.
    Middle,
    /// `F` over all of the range and the box.
    Range,
    /// The derivative of `F` over all of the range and the box: by the stiffness (0), or by a side of the box (from 1
    /// on).
    Slope(usize),
}

impl Of {
    fn pick(self, jet: &Jet) -> Interval {
        match self {
            Self::Middle => jet.middle,
            Self::Range => jet.over,
            Self::Slope(of) => jet.slopes[of],
        }
    }
}

/// Returns `δ` on the unit circle, computed from half of the angle so that it is precise near `z = 1`.
fn delta(half: Interval) -> Complex {
    let (sine, cosine) = (half.sin(), half.cos());
    let product = sine.times(cosine).scaled(2.0);
    Complex { re: Interval::ZERO.minus(sine.times(sine).scaled(2.0)), im: product }
}

fn turn(lag: u32, angle: Interval) -> Complex {
    let turned = angle.times(Interval::exact(f64::from(lag)));
    Complex { re: turned.cos(), im: Interval::ZERO.minus(turned.sin()) }
}

impl Characteristic {
    /// Returns the polynomial of one lag's coefficients, and its derivative by `δ`.
    fn polynomial(coefficients: &[Jet], delta: Complex, of: Of) -> [Complex; 2] {
        let (mut value, mut slope) = (Complex::ZERO, Complex::ZERO);
        for jet in coefficients.iter().rev() {
            slope = slope.times(delta).plus(value);
            value = value.times(delta).plus(Complex { re: of.pick(jet), im: Interval::ZERO });
        }
        [value, slope]
    }

    /// Returns `F` or its slope over an arc.
    pub fn on(&self, angle: Interval, of: Of) -> OnArc {
        let delta = delta(angle.scaled(0.5));
        let z = Complex { re: delta.re.plus(Interval::exact(1.0)), im: delta.im };
        let (mut all, mut by_angle) = (Complex::ZERO, Complex::ZERO);
        for (lag, coefficients) in &self.terms {
            let [value, slope] = Self::polynomial(coefficients, delta, of);
            let turned = turn(*lag, angle);
            all = all.plus(value.times(turned));
            let late = value.scaled(Interval::exact(-f64::from(*lag)));
            by_angle = by_angle.plus(slope.times(z).plus(late).times(turned).turned());
        }
        OnArc { value: all, by_angle }
    }

    /// Whether the coefficients prove that some pole is outside the unit circle at every stiffness of the range: by
    /// Vieta, if all poles are inside, no coefficient exceeds its binomial. `false` proves nothing.
    pub fn is_surely_unstable(&self) -> bool {
        let lags = self.terms.iter().map(|(lag, _)| *lag as usize).max().unwrap_or(0);
        let top = self.terms.iter().map(|(lag, terms)| (terms.len() + lags).saturating_sub(1 + *lag as usize)).max();
        let mut powers = vec![Interval::ZERO; top.unwrap_or(0) + 1];
        for (lag, coefficients) in &self.terms {
            // Expands the powers (z - 1)^k by Horner's scheme, the highest power last.
            let mut polynomial: Vec<Interval> = Vec::new();
            for jet in coefficients.iter().rev() {
                polynomial.insert(0, Interval::ZERO);
                for power in 1..polynomial.len() {
                    polynomial[power - 1] = polynomial[power - 1].minus(polynomial[power]);
                }
                match polynomial.first_mut() {
                    Some(first) => *first = first.plus(jet.over),
                    None => unreachable!("just made longer"),
                }
            }
            for (power, coefficient) in polynomial.into_iter().enumerate() {
                let at = power + lags - *lag as usize;
                powers[at] = powers[at].plus(coefficient);
            }
        }
        let mut most = powers.last().map_or(0.0, |lead| lead.size());
        let degree = powers.len() - 1;
        powers.iter().rev().enumerate().any(|(index, coefficient)| {
            let exceeds = coefficient.lo.max(-coefficient.hi) > most;
            // A billionth is allowed for the rounding of the binomials.
            most *= (1.0 + 1e-9) * (degree - index) as f64 / (index + 1) as f64;
            exceeds
        })
    }

    /// Returns `F` or its slope at `z = 1` or `z = -1`, where it is real.
    pub fn at(&self, minus_one: bool, of: Of) -> Interval {
        let delta = Interval::exact(if minus_one { -2.0 } else { 0.0 });
        self.terms.iter().fold(Interval::ZERO, |sum, (lag, coefficients)| {
            let add = |value: Interval, jet: &Jet| value.times(delta).plus(of.pick(jet));
            let value = coefficients.iter().rev().fold(Interval::ZERO, add);
            if minus_one && lag % 2 == 1 { sum.minus(value) } else { sum.plus(value) }
        })
    }
}

/// Returns the coefficients of the powers of `δ`, the lowest first: of `det(δ - E)`, or, with a column, of
/// `c adj(δ - E) column`, where `c` picks the last state. By Cramer's rule the second is the determinant with its last
/// column replaced.
pub(super) fn minors(change: &[Vec<Jet>], states: usize, column: Option<&[Jet]>) -> Vec<Jet> {
    let last = states - 1;
    let entry = |row: usize, of: usize| match column {
        Some(column) if of == last => column[row],
        _ => change[row][of],
    };
    let own = if column.is_some() { last } else { states };
    let mut coefficients = vec![Jet::ZERO; own + 1];
    for set in 0u32..1 << own {
        let mut kept: Vec<usize> = (0..own).filter(|state| set >> state & 1 == 1).collect();
        let negative = kept.len() % 2 == 1;
        let power = own - kept.len();
        if column.is_some() {
            kept.push(last);
        }
        let minor = determinant(&kept, &entry);
        let sum = coefficients[power];
        coefficients[power] = if negative { sum.minus(minor) } else { sum.plus(minor) };
    }
    coefficients
}

/// Returns the determinant of the kept rows and columns, expanded along the first kept row. A minor of the last rows
/// is computed once for each set of its columns.
fn determinant(kept: &[usize], entry: &impl Fn(usize, usize) -> Jet) -> Jet {
    fn along(kept: &[usize], columns: u32, entry: &impl Fn(usize, usize) -> Jet, known: &mut [Option<Jet>]) -> Jet {
        if columns == 0 {
            return Jet::constant(Interval::exact(1.0));
        }
        if let Some(minor) = known[columns as usize] {
            return minor;
        }
        let row = kept[kept.len() - columns.count_ones() as usize];
        let (mut sum, mut is_odd) = (Jet::ZERO, false);
        for index in (0..kept.len()).filter(|index| columns >> index & 1 == 1) {
            let factor = entry(row, kept[index]);
            if !factor.is_zero() {
                let product = factor.times(along(kept, columns & !(1 << index), entry, known));
                sum = if is_odd { sum.minus(product) } else { sum.plus(product) };
            }
            is_odd = !is_odd;
        }
        known[columns as usize] = Some(sum);
        sum
    }
    along(kept, (1 << kept.len()) - 1, entry, &mut vec![None; 1 << kept.len()])
}
