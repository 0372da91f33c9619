//! Position of the tip, and joint torques of forces at the tip.
//!
//! Device frame: x right, y up, z toward the user, origin at the tip of the neutral pose (all angles 0).

/// Lengths of upper link and forearm in m.
pub type Lengths = [f64; 2];

/// The limits within which the links of a Premium 1.5 move freely, in degrees (found in a public model of the device).
const LIMITS_1_5_DEG: [[f64; 2]; 3] = [[-90.0, 90.0], [-124.0, 119.0], [-29.0, 214.0]];
/// Least and greatest difference of joint 2 minus joint 3, in degrees, from the same source.
const DIFFERENCE_1_5_DEG: [f64; 2] = [-55.0, 65.0];

/// The links in a pose: their sines and cosines, and the tip's distance from the vertical axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    lengths_m: Lengths,
    radius_m: f64,
    sine: [f64; 3],
    cosine: [f64; 3],
}

/// Three angles with their sines and cosines, from which those of angles nearby are computed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sines {
    angles_rad: [f64; 3],
    pairs: [(f64, f64); 3],
}

impl Sines {
    /// Computes sines and cosines of these angles.
    pub fn of(angles_rad: [f64; 3]) -> Self {
        Self { angles_rad, pairs: angles_rad.map(libm::sincos) }
    }

    /// Returns sines and cosines of other angles. Differences below 0.03 rad use a series, whose next terms are below
    /// 1e-19.
    #[inline]
    pub fn near(&self, angles_rad: [f64; 3]) -> [(f64, f64); 3] {
        let changes: [f64; 3] = std::array::from_fn(|i| angles_rad[i] - self.angles_rad[i]);
        // NaN is not near.
        if !changes.iter().all(|change| change.abs() < 0.03) {
            return angles_rad.map(libm::sincos);
        }
        std::array::from_fn(|i| {
            let (change, (sine, cosine)) = (changes[i], self.pairs[i]);
            let square = change * change;
            let along = change * (1.0 + square * (-1.0 / 6.0 + square * (1.0 / 120.0 - square * (1.0 / 5040.0))));
            let lost = square * (0.5 + square * (-1.0 / 24.0 + square * (1.0 / 720.0 - square * (1.0 / 40320.0))));
            (sine + (cosine * along - sine * lost), cosine - (sine * along + cosine * lost))
        })
    }
}

impl Pose {
    /// Returns the pose of links of these lengths with the joints at these angles.
    pub fn of(lengths_m: Lengths, angles_rad: [f64; 3]) -> Self {
        Self::by(lengths_m, angles_rad.map(libm::sincos))
    }

    /// Returns the pose from sines and cosines of the angles.
    pub fn by(lengths_m: Lengths, pairs: [(f64, f64); 3]) -> Self {
        let (sine, cosine) = (pairs.map(|pair| pair.0), pairs.map(|pair| pair.1));
        Self { lengths_m, radius_m: lengths_m[0] * cosine[1] + lengths_m[1] * sine[2], sine, cosine }
    }

    /// Returns the tip's position.
    pub fn tip_m(&self) -> [f64; 3] {
        let Self { lengths_m: [upper_m, fore_m], radius_m, sine, cosine } = *self;
        [sine[0] * radius_m, fore_m - fore_m * cosine[2] + upper_m * sine[1], cosine[0] * radius_m - upper_m]
    }

    /// Returns the change of the tip's position per change of each joint; rows x, y, z.
    pub fn jacobian_m(&self) -> [[f64; 3]; 3] {
        let Self { lengths_m: [upper_m, fore_m], radius_m, sine: [s1, s2, s3], cosine: [c1, c2, c3] } = *self;
        [
            [c1 * radius_m, -upper_m * s1 * s2, fore_m * s1 * c3],
            [0.0, upper_m * c2, fore_m * s3],
            [-s1 * radius_m, -upper_m * c1 * s2, fore_m * c1 * c3],
        ]
    }

    /// Returns the joint torques of a force at the tip.
    pub fn torques_nm(&self, force_n: [f64; 3]) -> [f64; 3] {
        let rows = self.jacobian_m();
        std::array::from_fn(|joint| (0..3).map(|axis| rows[axis][joint] * force_n[axis]).sum())
    }
}

/// Returns the tip's position.
pub fn tip_m(lengths_m: Lengths, angles_rad: [f64; 3]) -> [f64; 3] {
    Pose::of(lengths_m, angles_rad).tip_m()
}

/// Returns the change of the tip's position per change of each joint; rows x, y, z.
pub fn jacobian_m(lengths_m: Lengths, angles_rad: [f64; 3]) -> [[f64; 3]; 3] {
    Pose::of(lengths_m, angles_rad).jacobian_m()
}

/// Returns the determinant of the Jacobian, in m³: 0 where the arm is stretched, folded, or reaches its own axis.
pub fn determinant_m3(lengths_m: Lengths, angles_rad: [f64; 3]) -> f64 {
    let [upper_m, fore_m] = lengths_m;
    let Pose { radius_m, .. } = Pose::of(lengths_m, angles_rad);
    upper_m * fore_m * radius_m * libm::cos(angles_rad[1] - angles_rad[2])
}

/// Returns whether these angles bring an arm so near a singular posture that its Jacobian is unusable: the arm is
/// stretched or folded, or the tip lies on the arm's own axis.
pub fn is_singular(lengths_m: Lengths, angles_rad: [f64; 3]) -> bool {
    let [upper_m, fore_m] = lengths_m;
    determinant_m3(lengths_m, angles_rad) < 0.01 * upper_m * fore_m * upper_m
}

/// Returns the joint torques of a force at the tip.
pub fn torques_nm(lengths_m: Lengths, angles_rad: [f64; 3], force_n: [f64; 3]) -> [f64; 3] {
    Pose::of(lengths_m, angles_rad).torques_nm(force_n)
}

/// Returns the angles that bring the tip to a position, elbow up; `None` when the links do not reach it.
pub fn angles_rad(lengths_m: Lengths, tip_m: [f64; 3]) -> Option<[f64; 3]> {
    let [upper_m, fore_m] = lengths_m;
    let [x, y, z] = [tip_m[0], tip_m[1] - fore_m, tip_m[2] + upper_m];
    let ground_m = libm::hypot(x, z);
    let reach_m = libm::hypot(ground_m, y);
    let square = |length_m: f64| length_m * length_m;
    // By the cosine rule: angles at the shoulder and at the elbow.
    let shoulder = (square(upper_m) + square(reach_m) - square(fore_m)) / (2.0 * upper_m * reach_m);
    let elbow = (square(upper_m) + square(fore_m) - square(reach_m)) / (2.0 * upper_m * fore_m);
    if !(shoulder.abs() <= 1.0 && elbow.abs() <= 1.0) {
        return None;
    }
    let upper_rad = libm::atan2(y, ground_m) + libm::acos(shoulder);
    Some([libm::atan2(x, z), upper_rad, upper_rad + libm::acos(elbow) - std::f64::consts::FRAC_PI_2])
}

/// Returns whether the links of a Premium 1.5 can take these angles.
pub fn within_limits_1_5(angles_rad: [f64; 3]) -> bool {
    let degrees = angles_rad.map(f64::to_degrees);
    let inside = |value: f64, [low, high]: [f64; 2]| low <= value && value <= high;
    (0..3).all(|joint| inside(degrees[joint], LIMITS_1_5_DEG[joint]))
        && inside(degrees[1] - degrees[2], DIFFERENCE_1_5_DEG)
}
