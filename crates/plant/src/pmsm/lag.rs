//! The current of a phase behind the lag of its shunt's amplifier: exact along each segment's series.

use super::circuit::{Circuit, Freedom, PHASES, Path, dot};
use super::series::{ALPHA, BETA, Series};
use crate::Leg;
use crate::device::Drive;
use crate::flow::polynomial::ORDER;

/// A first-order lag of the current of a phase.
#[derive(Clone, Copy)]
pub(super) struct Lag {
    pub leg: usize,
    /// Whether the shunt is below the lower switch: it sees no current while that is open. With mean voltages it sees
    /// the phase's current.
    pub is_low_side: bool,
    pub corner_rad_per_s: f64,
    /// The output at the anchor, in A.
    pub output_a: f64,
}

impl Lag {
    /// Returns the output a time after the anchor: `y' = corner (i - y)`, where `i` is the sum of the series.
    pub fn at(&self, series: &Series, circuit: &Circuit, drive: Drive, t: f64) -> f64 {
        let z = self.corner_rad_per_s * t;
        let is_off = matches!(drive, Drive::Legs(legs) if self.is_low_side && legs[self.leg] != Leg::Low);
        let rests = circuit.freedom == Freedom::None || circuit.paths[self.leg] == Path::Floating;
        let rest = self.output_a * libm::exp(-z);
        if is_off || rests || z == 0.0 {
            return rest;
        }
        let powers = series.powers;
        let shares = shares(z, powers);
        let term = |k: usize| dot(PHASES[self.leg], [series.x[k][ALPHA], series.x[k][BETA]]) * shares[k];
        rest + (0..=powers).rev().fold(0.0, |sum, k| sum * t + term(k))
    }
}

/// The powers beyond the last one from which the recursion downwards begins.
const BEYOND: usize = 64;

/// Returns for each power `k` the integral over `s` from 0 to 1 of `z exp(-z (1 - s)) s^k`: by `1 - k/z` times that of
/// the power below where `k < z`, from above where it is not, so that errors become smaller.
fn shares(z: f64, powers: usize) -> [f64; ORDER + 1] {
    let mut shares = [0.0; ORDER + 1];
    let turn = if z < powers as f64 { z as usize + 1 } else { powers + 1 };
    shares[0] = -libm::expm1(-z);
    for k in 1..turn.min(powers + 1) {
        shares[k] = 1.0 - k as f64 / z * shares[k - 1];
    }
    let mut above = 0.0;
    for k in (turn + 1..=powers + BEYOND).rev() {
        above = z / k as f64 * (1.0 - above);
        if (turn..=powers + 1).contains(&k) && k - 1 <= powers {
            shares[k - 1] = above;
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::{ORDER, shares};

    /// The same integrals by a series of positive terms, `z^n exp(-z) / n!` times `n / (n + k)`, summed where it is
    /// exact.
    #[test]
    fn shares_are_their_integrals() {
        for z in [1e-12, 1e-6, 0.01, 0.5, 0.99, 1.0, 2.5, 7.3, 15.9, 16.0, 16.5, 40.0, 300.0] {
            let got = shares(z, ORDER);
            for (k, got) in got.iter().enumerate() {
                // exp(-z) z Σ z^n / (n! (n + k + 1)), where the largest terms stand for their exponential.
                let (mut term, mut sum) = ((-z).exp() * z, 0.0);
                for n in 0..2000 {
                    sum += term / (n + k + 1) as f64;
                    term *= z / (n + 1) as f64;
                }
                // The rounding of 2000 terms, each of which is a product of as many.
                assert!((got - sum).abs() <= 4e-13 * sum, "{z}, {k}: {got:e} {sum:e}");
            }
        }
    }
}
