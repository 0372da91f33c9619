//! The readings of a segment that a gauge takes.

use super::{ONWARD_S, PmsmDevice};
use crate::flow::gauge::{Extent, Stretch};
use crate::flow::polynomial::{ORDER, Polynomial, Reach};
use crate::pmsm::series::{SPEED, Series};

/// `i_q` and the speed along a segment.
struct Course<'m, 'a>(&'m PmsmDevice<'a>);

impl PmsmDevice<'_> {
    /// Returns what a gauge is told of the present segment.
    pub(super) fn course(&self) -> impl Stretch<2> {
        Course(self)
    }
}

impl Course<'_, '_> {
    fn times(&self, from: Option<u64>, to: Option<u64>) -> [f64; 2] {
        let Self(device) = self;
        [from.map_or(0.0, |edge| device.time_s(edge)), to.map_or(device.end_s, |edge| device.time_s(edge))]
    }

    /// Returns the terms of `i_q` and the speed.
    fn terms(&self) -> [[f64; ORDER + 1]; 2] {
        let Series { x, powers, .. } = &self.0.series;
        let mut terms = [[0.0; ORDER + 1]; 2];
        for k in 0..=*powers {
            terms[0][k] = self.0.series.across_term(k);
            terms[1][k] = x[k][SPEED];
        }
        terms
    }
}

impl Stretch<2> for Course<'_, '_> {
    fn integral(&self, from: Option<u64>, to: Option<u64>) -> [f64; 2] {
        let ends = self.times(from, to);
        self.terms().map(|terms| {
            let [early, late] =
                ends.map(|t| t * (0..=ORDER).rev().fold(0.0, |sum, k| sum * t + terms[k] / (k + 1) as f64));
            late - early
        })
    }

    fn include(&self, from: Option<u64>, to: Option<u64>, extents: &mut [Extent; 2]) {
        let [early, late] = self.times(from, to);
        let powers = self.0.series.powers;
        for (terms, extent) in self.terms().iter().zip(extents) {
            let at = |t: f64| terms[..=powers].iter().rev().fold(0.0, |sum, term| sum * t + term);
            extent.take(at(early));
            extent.take(at(late));
            let mut slopes = [0.0; ORDER + 1];
            (1..=powers).for_each(|k| slopes[k - 1] = k as f64 * terms[k]);
            let slope = Polynomial::of(slopes, powers, late);
            let (mut t, mut sign) = (early, if slope.at(early)[0] < 0.0 { -1.0 } else { 1.0 });
            for _ in 0..2 * ORDER {
                let (Reach::At(turn) | Reach::Until(turn)) = slope.keeps(0.0, sign, t) else { break };
                extent.take(at(turn));
                // The slope has another sign from here on; past the rounding of its zero.
                (t, sign) = (turn + ONWARD_S, -sign);
                if t >= late {
                    break;
                }
            }
        }
    }
}
