//! How far the optimum of a fit may be off, from the differences that it leaves.
//!
//! The differences between a run and a log are no white noise: where the run is too high, it is too high for many rows.
//! An autoregression of each log's differences (Burg's method, its order by Akaike's criterion) makes them innovations,
//! which are nearly independent. The covariance of the keys is the sandwich of the slopes, passed backwards through the
//! same filter, with the squares of the innovations: differences may be larger where the device moves. The quantile is
//! Student's, for as many degrees of freedom as the independent rows allow.

use super::solve::{Matrix, inverse};
use super::{Rows, Slopes, normal};

/// The highest order of an autoregression.
const ORDER: usize = 20;

/// The scatter of the keys that the differences tell, in the unit of the slopes.
pub(super) struct Scatter {
    /// Standard deviations.
    pub sds: Vec<f64>,
    /// Standard deviations if the rows were independent.
    pub naive: Vec<f64>,
    /// Rows that are independent, as far as each key is concerned.
    pub effective: Vec<f64>,
    /// The 95 % quantiles of Student's distribution, both sides.
    pub quantiles: Vec<f64>,
    /// Correlations of the keys.
    pub correlations: Matrix,
}

impl Scatter {
    /// Returns the scatter of the keys around an optimum.
    pub fn new(slopes: &Slopes, rows: &[Rows]) -> Self {
        let keys: Vec<usize> = (0..slopes[0].len()).collect();
        let (mut normal, _) = normal(slopes, rows, &keys);
        let bread = inverse(&normal).unwrap_or_else(|| {
            // Keys that act through one number have an enormous scatter, and the others theirs.
            keys.iter().for_each(|key| normal[*key][*key] *= 1.0 + 1e-9);
            inverse(&normal).unwrap_or_else(|| vec![vec![f64::INFINITY; keys.len()]; keys.len()])
        });
        let mut meat = vec![vec![0.0; keys.len()]; keys.len()];
        let mut at = 0;
        for Rows { off, .. } in rows {
            let coefficients = autoregression(off);
            let innovations = off.iter().enumerate().map(|(row, now)| {
                let before = off[..row].iter().rev().zip(&coefficients);
                now - before.map(|(off, coefficient)| coefficient * off).sum::<f64>()
            });
            let filtered: Vec<Vec<f64>> =
                keys.iter().map(|key| backwards(&slopes[at..at + off.len()], *key, &coefficients)).collect();
            for (row, innovation) in innovations.enumerate() {
                for one in &keys {
                    for other in &keys {
                        meat[*one][*other] += innovation.powi(2) * filtered[*one][row] * filtered[*other][row];
                    }
                }
            }
            at += off.len();
        }
        let count = slopes.len() as f64;
        let covariance = product(&product(&bread, &meat), &bread);
        let power: f64 = rows.iter().flat_map(|rows| &rows.off).map(|off| off * off).sum();
        let variance = power / (count - keys.len() as f64).max(1.0);
        let naive: Vec<f64> = keys.iter().map(|key| (variance * bread[*key][*key]).sqrt()).collect();
        let sd = |key: usize| covariance[key][key].max(0.0).sqrt();
        let effective: Vec<f64> = keys
            .iter()
            .map(|key| {
                let rows = count * (naive[*key] / sd(*key)).powi(2);
                if rows.is_nan() { count } else { rows.clamp(1.0, count) }
            })
            .collect();
        // The fitted keys have taken their share of the differences.
        let share = |key: usize| (effective[key] / (effective[key] - keys.len() as f64).max(1.0)).sqrt();
        let quantile = |rows: &f64| student_95((rows / 2.0 - keys.len() as f64).max(2.0));
        Self {
            sds: keys.iter().map(|key| sd(*key) * share(*key)).collect(),
            quantiles: effective.iter().map(quantile).collect(),
            correlations: keys
                .iter()
                .map(|one| keys.iter().map(|other| covariance[*one][*other] / (sd(*one) * sd(*other))).collect())
                .collect(),
            naive,
            effective,
        }
    }
}

fn product(one: &Matrix, other: &Matrix) -> Matrix {
    let cell = |row: &Vec<f64>, column: usize| row.iter().zip(other).map(|(a, other)| a * other[column]).sum();
    one.iter().map(|row| (0..other.len()).map(|column| cell(row, column)).collect()).collect()
}

/// Returns the slopes of a key, each with all that a difference there does to the later differences.
fn backwards(slopes: &[Vec<f64>], key: usize, coefficients: &[f64]) -> Vec<f64> {
    let mut filtered = vec![0.0; slopes.len()];
    for row in (0..slopes.len()).rev() {
        let later = filtered[row + 1..].iter().zip(coefficients);
        filtered[row] = slopes[row][key] + later.map(|(later, coefficient)| coefficient * later).sum::<f64>();
    }
    filtered
}

/// Returns the coefficients by which a difference follows from the differences before it, the last one first.
///
/// Source: J. P. Burg, *Maximum entropy spectral analysis*, 1975; the criterion is Akaike's.
fn autoregression(off: &[f64]) -> Vec<f64> {
    let count = off.len();
    let (mut forward, mut backward) = (off.to_vec(), off.to_vec());
    let mut variance = off.iter().map(|off| off * off).sum::<f64>() / count as f64;
    let mut coefficients: Vec<f64> = Vec::new();
    let mut best = (count as f64 * libm::log(variance), Vec::new());
    for order in 1..=ORDER.min(count / 10) {
        let pairs = || (order..count).map(|row| (forward[row], backward[row - 1]));
        let power: f64 = pairs().map(|(ahead, behind)| ahead * ahead + behind * behind).sum();
        if power == 0.0 {
            break;
        }
        let reflection = 2.0 * pairs().map(|(ahead, behind)| ahead * behind).sum::<f64>() / power;
        let mirrored: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(mirrored).for_each(|(one, other)| *one -= reflection * other);
        coefficients.push(reflection);
        for row in (order..count).rev() {
            let (ahead, behind) = (forward[row], backward[row - 1]);
            forward[row] = ahead - reflection * behind;
            backward[row] = behind - reflection * ahead;
        }
        variance *= 1.0 - reflection * reflection;
        let criterion = count as f64 * libm::log(variance) + 2.0 * order as f64;
        if criterion < best.0 {
            best = (criterion, coefficients.clone());
        }
    }
    best.1
}

/// Returns the 95 % quantile of Student's distribution, both sides, within 1 % from 2 degrees of freedom on.
///
/// Source: M. Abramowitz, I. A. Stegun, *Handbook of mathematical functions*, 26.7.5.
pub(super) fn student_95(degrees: f64) -> f64 {
    // The polynomials at the quantile 1.959964 of the normal distribution.
    const BY_POWER: [f64; 5] = [1.959_964, 2.372_271, 2.822_500, 2.555_850, 1.589_534];
    BY_POWER.iter().rev().fold(0.0, |sum, part| sum / degrees + part)
}
