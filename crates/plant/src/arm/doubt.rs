//! Bounds on the errors of an arm's angles, and the crossings that these errors leave in doubt.
//!
//! Each segment adds the truncation of its series, estimated from the last terms, and the rounding. Anchors keep their
//! low parts and add nothing. Compared with 30 digits, the true error stays below the sum
//! (`tests/all/arm_certified.rs`).

use super::ArmMotion;
use super::links::Links;
use super::series::Series;
use crate::flow::polynomial::{Lanes, derivatives};

/// Rounding of a term, as a share of the greatest number in its sum.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

impl<L: Links> ArmMotion<'_, L> {
    /// Returns a bound on the errors of the angles at an edge, in rad: the truncation and rounding of each segment,
    /// summed as independent errors are. It is an estimate, for it ignores that the motion itself amplifies or damps
    /// errors.
    pub fn error_rad(&self, edge: u64) -> f64 {
        self.error(self.time_s(edge))[0]
    }

    /// Returns the distance of an encoder's angle above a limit near it, in rad, with more digits than the angle itself
    /// has.
    pub fn above_rad(&self, edge: u64, joint: usize, limit_rad: f64) -> f64 {
        let (whole, part) = self.sum(&self.series.p, 2, self.time_s(edge));
        (whole[joint] - limit_rad) + part[joint]
    }

    /// Returns whether an encoder's angle, which has passed a limit at this edge, is or was so near to it that `f64`
    /// alone, with the error of the run, may have put the crossing on another edge.
    pub fn is_near(&self, edge: u64, joint: usize, limit_rad: f64) -> bool {
        let [_, slope, curvature] = derivatives(&self.series.p[..=self.series.powers], self.time_s(edge));
        let (edge_s, now) = (self.arm.edge_s, self.above_rad(edge, joint, limit_rad));
        let before = now - edge_s * (slope[joint] - 0.5 * edge_s * curvature[joint]);
        now.abs().min(before.abs()) <= self.error_rad(edge) + f64::EPSILON * limit_rad.abs()
    }

    /// Returns bounds on the errors of angles and speeds, a time after the anchor.
    pub(super) fn error(&self, t: f64) -> [f64; 2] {
        let (Self { arm, start: x, series, .. }, [mut angle, mut speed]) = (self, self.error);
        let Series { v, w, good_s, powers, .. } = series;
        if *powers == 0 {
            return [angle, 0.0];
        }
        let most = |lanes: [&Lanes; 2]| lanes.into_iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let mut acceleration = most([&v[1], &w[1]]);
        for (i, ease) in arm.ease(&self.work).into_iter().enumerate() {
            acceleration = acceleration.max(ease * (x.u[i].abs() + x.lag[i].abs() + arm.joints.coulomb_nm[i]));
        }
        // The truncation: the terms beyond the last ones, which stay below the tolerance while the series is good.
        let mut tail = arm.tolerance;
        for _ in 1..*powers {
            tail *= t / good_s;
        }
        speed = libm::hypot(speed, tail + ROUNDING * acceleration * t);
        angle = libm::hypot(angle + speed * t, ROUNDING * most([&x.v, &x.w]) * t);
        [angle, speed]
    }
}
