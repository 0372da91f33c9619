//! The arm's links, with the recursion of their Taylor series written out by hand: each sum of the equations of
//! motion is one loop over lanes, and products that vanish are left out. A test compares it with the series that
//! [`Recorded`](super::Recorded) makes of the same links' [`Dynamics`](super::Dynamics).
//!
//! The time of a run with an arm goes into its series: a series costs some 24 000 instructions, with its energies and
//! the search for its end. `phantom-flexible` takes 9035 series for 8923 encoder edges, 41 000 instructions an edge, of
//! which Coulomb friction takes an eighth. So the products of series are what is made fast: four lanes at once where
//! there is AVX2, to the same bits elsewhere.

use super::joints::{ArmError, positive};
use super::kinematics::{self, Sines};
use super::links::Pose;
use super::links::{Arm, Links};
use super::model::ArmModel;
use super::series::{Hold, Series, Start, ZERO, moves, onward};
use crate::flow::double::{Product, versions};
use crate::flow::lanes::Lanes as _;
use crate::flow::polynomial::{Coefficients, Lanes, convolved};

/// Intermediate series.
#[derive(Clone)]
pub struct Work {
    /// Rates, sines and cosines of 2θ2, 2θ3, θ2+θ3, θ2-θ3.
    rate: Coefficients,
    sine: Coefficients,
    cosine: Coefficients,
    /// Rates, sines and cosines of θ1 (for gravity), θ2, θ3.
    lean: Coefficients,
    lean_sine: Coefficients,
    lean_cosine: Coefficients,
    /// Lanes e, h, h, and lanes R, sin θ2, cos θ3; their products are gravity's torques.
    pull: Coefficients,
    arm: Coefficients,
    /// Lanes M11, M23, M23, and the speeds that they multiply, ω1, ω3, ω2.
    mass: Coefficients,
    met: Coefficients,
    /// Lanes half of ∂2M11, half of ∂3M11, P/2 cos(θ2-θ3); and ω1², ω1², ω2 ω3.
    bend: Coefficients,
    square: Coefficients,
    /// The next term of the momenta, the forces of the last power, and `M22 M33 - M23²` at the start.
    momentum: [f64; 3],
    before: [f64; 3],
    determinant: f64,
}

/// Returns the term of power `k` of the products, lane by lane, with `j` in `a` starting at `from`.
#[inline(always)]
fn product<P: Product>(a: &Coefficients, b: &Coefficients, from: usize, k: usize) -> Lanes {
    // Two sums, because each addition waits for the one before.
    let (mut one, mut other) = (P::all(0.0), P::all(0.0));
    let (a, b) = (a[from..=k].chunks_exact(2), b[..k + 1 - from].rchunks_exact(2));
    let left = (a.remainder(), b.remainder());
    for (a, b) in a.zip(b) {
        one = one + P::lanes(&a[0]) * P::lanes(&b[1]);
        other = other + P::lanes(&a[1]) * P::lanes(&b[0]);
    }
    if let ([a], [b]) = left {
        one = one + P::lanes(a) * P::lanes(b);
    }
    (one + other).state()
}

/// Writes the terms of power `k + 1` of sines and cosines whose angles have these rates.
#[inline(always)]
fn turn<P: Product>(rate: &Coefficients, sine: &mut Coefficients, cosine: &mut Coefficients, k: usize) {
    let share = 1.0 / (k + 1) as f64;
    let (mut up, mut down) = (P::all(0.0), P::all(0.0));
    let turned = cosine[..=k].iter().zip(&sine[..=k]).rev();
    for (rate, (cosine, sine)) in rate[..=k].iter().zip(turned) {
        let rate = P::lanes(rate);
        up = up + rate * P::lanes(cosine);
        down = down + rate * P::lanes(sine);
    }
    sine[k + 1] = (up * P::all(share)).state();
    cosine[k + 1] = (down * P::all(-share)).state();
}

impl Links for ArmModel {
    type Work = Work;

    fn work(&self) -> Work {
        Work {
            rate: ZERO,
            sine: ZERO,
            cosine: ZERO,
            lean: ZERO,
            lean_sine: ZERO,
            lean_cosine: ZERO,
            pull: ZERO,
            arm: ZERO,
            mass: ZERO,
            met: ZERO,
            bend: ZERO,
            square: ZERO,
            momentum: [0.0; 3],
            before: [0.0; 3],
            determinant: 1.0,
        }
    }

    fn tip_m(&self, angles_rad: [f64; 3]) -> [f64; 3] {
        kinematics::tip_m(self.lengths_m, angles_rad)
    }

    fn mass_kg_m2(&self, angles_rad: [f64; 3]) -> [[f64; 3]; 3] {
        ArmModel::mass_kg_m2(self, angles_rad)
    }

    fn potential_j(&self, angles_rad: [f64; 3]) -> f64 {
        self.gravity_j(angles_rad)
    }

    #[inline]
    fn pose(&self, near: &Sines, q: [f64; 3], v: [f64; 3]) -> Pose {
        let [(s1, c1), (s2, c2), (s3, c3)] = near.near(q);
        let ([a0, a2, a3], p, [a, b], g) =
            (self.turning_kg_m2, self.coupling_kg_m2, self.moments_kg_m, self.gravity_m_per_s2);
        let (away, along) = (g[0] * s1 + g[2] * c1, g[0] * c1 - g[2] * s1);
        let (sine, cosine) = (s2 * c3 - c2 * s3, c2 * c3 + s2 * s3);
        let (d2, d3) = (-2.0 * a2 * s2 * c2 - 0.5 * p * s2 * s3, -2.0 * a3 * s3 * c3 + 0.5 * p * c2 * c3);
        let bias_nm = [
            along * (a * c2 + b * s3) - 2.0 * (d2 * v[1] + d3 * v[2]) * v[0],
            a * (g[1] * c2 - away * s2) + d2 * v[0] * v[0] - 0.5 * p * cosine * v[2] * v[2],
            b * (g[1] * s3 + away * c3) + d3 * v[0] * v[0] + 0.5 * p * cosine * v[1] * v[1],
        ];
        let m11 = a0 + a2 * (c2 * c2 - s2 * s2) + a3 * (c3 * c3 - s3 * s3) + p * c2 * s3;
        let ([m22, m33], m23) = (self.swinging_kg_m2, -0.5 * p * sine);
        Pose { mass_kg_m2: [[m11, 0.0, 0.0], [0.0, m22, m23], [0.0, m23, m33]], bias_nm }
    }

    fn extend(arm: &Arm, series: &mut Series, work: &mut Work, x: &Start, holds: &[Hold; 3], powers: usize) {
        Self::write(arm, series, work, x, holds, powers);
    }

    fn ease(arm: &Arm<Self>, work: &Work) -> [f64; 3] {
        let [_, m22, m33] = arm.diagonal_kg_m2();
        [1.0 / work.mass[0][0], m33 / work.determinant, m22 / work.determinant]
    }
}

impl ArmModel {
    versions! {
        /// Writes the series up to a power, in the lanes of the present processor, to the same bits in any.
        fn write[write_fused, write_native, write_with](
            arm: &Arm, series: &mut Series, work: &mut Work, x: &Start, holds: &[Hold; 3], powers: usize
        )
    }

    #[inline(always)]
    fn write_with<P: Product>(
        arm: &Arm,
        series: &mut Series,
        work: &mut Work,
        x: &Start,
        holds: &[Hold; 3],
        powers: usize,
    ) {
        let (model, joints) = (&arm.links, &arm.joints);
        let flexible = joints.transmission;
        let moves = [0, 1, 2].map(|i| moves(joints, holds, i));
        let done = std::mem::replace(&mut series.powers, powers);
        let (g, [a, b]) = (model.gravity_m_per_s2, model.moments_kg_m);
        let heavy = (a != 0.0 || b != 0.0) && g != [0.0; 3];
        let swings = moves[1] || moves[2];
        let held = |i: usize| holds[i] == Hold::Stuck && flexible[i].is_none();
        // Whether M11 and M23 change with an effect on this motion.
        let shape = swings && (moves[0] || (moves[1] && moves[2]) || held(1) || held(2));
        let spins = moves[0] && (swings || held(1) || held(2));
        let [m1, m22, m33] = arm.diagonal_kg_m2();
        let ([a0, a2, a3], half_p) = (model.turning_kg_m2, 0.5 * model.coupling_kg_m2);

        let Work {
            rate,
            sine,
            cosine,
            lean,
            lean_sine,
            lean_cosine,
            pull,
            arm: lever,
            mass,
            met,
            bend,
            square,
            momentum,
            before,
            determinant,
        } = work;
        if done == 0 {
            let [(s1, c1), (s2, c2), (s3, c3)] = [x.q[0], x.q[1], x.q[2]].map(libm::sincos);
            sine[0] = [2.0 * s2 * c2, 2.0 * s3 * c3, s2 * c3 + c2 * s3, s2 * c3 - c2 * s3];
            cosine[0] = [c2 * c2 - s2 * s2, c3 * c3 - s3 * s3, c2 * c3 - s2 * s3, c2 * c3 + s2 * s3];
            lean_sine[0] = [g[0] * s1 + g[2] * c1, s2, s3, 0.0];
            lean_cosine[0] = [g[0] * c1 - g[2] * s1, c2, c3, 0.0];
        }
        for k in done..powers {
            let share = 1.0 / (k + 1) as f64;
            if k == 0 || shape {
                let (s, c) = (&sine[k], &cosine[k]);
                let m11 = a2 * c[0] + a3 * c[1] + half_p * (s[2] - s[3]);
                let m23 = -half_p * s[3];
                let quarter_p = 0.5 * half_p;
                mass[k] = [m11, m23, m23, 0.0];
                bend[k] = [
                    -a2 * s[0] + quarter_p * (c[2] - c[3]),
                    -a3 * s[1] + quarter_p * (c[2] + c[3]),
                    half_p * c[3],
                    0.0,
                ];
            } else {
                mass[k] = [0.0; 4];
                bend[k] = [0.0; 4];
            }
            // Speeds, computed from momenta.
            let m23 = mass[0][1];
            if k == 0 {
                mass[0][0] += a0 + m1;
                *determinant = m22 * m33 - m23 * m23;
                *momentum = [mass[0][0] * x.v[0], m22 * x.v[1] + m23 * x.v[2], m33 * x.v[2] + m23 * x.v[1]];
            }
            let known = if shape { product::<P>(mass, met, 1, k) } else { [0.0; 4] };
            let v = if k == 0 {
                x.v
            } else {
                let rest = [momentum[0] - known[0], momentum[1] - known[1], momentum[2] - known[2]];
                let (v2, v3) = match (moves[1], moves[2]) {
                    (true, true) => {
                        ((m33 * rest[1] - m23 * rest[2]) / *determinant, (m22 * rest[2] - m23 * rest[1]) / *determinant)
                    }
                    (true, false) => (momentum[1] / m22, 0.0),
                    (false, true) => (0.0, momentum[2] / m33),
                    (false, false) => (0.0, 0.0),
                };
                let mut v = [if moves[0] { rest[0] / mass[0][0] } else { 0.0 }, v2, v3, 0.0];
                if k == 1 {
                    for i in 0..3 {
                        if flexible[i].is_none() {
                            v[i] = onward(holds[i], x.w[i], v[i]);
                        }
                    }
                }
                v
            };
            series.v[k] = v;
            met[k] = [v[0], v[2], v[1], 0.0];
            // The torques that hold the stuck joints, one power behind: their own momentum is all coupling.
            let coupled = [0.0, known[1] + m23 * v[2], known[2] + m23 * v[1]];
            if k > 0 {
                for i in 0..3 {
                    if flexible[i].is_none() {
                        series.hold[k - 1][i] = before[i] - k as f64 * coupled[i];
                    }
                }
            }
            // The forces of motion and gravity.
            let mut force = [0.0; 3];
            if spins || (moves[1] && moves[2]) {
                // ω1, ω2, ω3 times ω1, ω3, ω2.
                let [first, both, ..] = convolved::<P>(&series.v[..=k], &met[..=k]).state();
                square[k] = [first, first, both, 0.0];
                let bent = product::<P>(bend, square, 0, k);
                force = [0.0, bent[0] - bent[2], bent[1] + bent[2]];
            }
            if heavy {
                let (s, c) = (&lean_sine[k], &lean_cosine[k]);
                pull[k] = [c[0], s[0], s[0], 0.0];
                lever[k] = [a * c[1] + b * s[2], s[1], c[2], 0.0];
                let pulled = product::<P>(pull, lever, 0, k);
                force[0] += pulled[0];
                force[1] += a * (g[1] * c[1] - pulled[1]);
                force[2] += b * (g[1] * s[2] + pulled[2]);
            }
            let torque_nm = series.motors(joints, x, holds, k, [v[0], v[1], v[2]]);
            for i in 0..3 {
                force[i] += torque_nm[i];
                momentum[i] = force[i] * share;
            }
            *before = force;
            if shape {
                rate[k] = [2.0 * v[1], 2.0 * v[2], v[1] + v[2], v[1] - v[2]];
                turn::<P>(rate, sine, cosine, k);
            }
            if heavy {
                lean[k] = [v[0], v[1], v[2], 0.0];
                turn::<P>(lean, lean_sine, lean_cosine, k);
            }
        }
        series.close(joints, arm.tolerance);
    }
}

impl Arm {
    /// Creates the arm on a clock of this period.
    ///
    /// # Errors
    /// An impossible parameter, or a free joint without inertia.
    pub fn new(model: ArmModel, edge_s: f64) -> Result<Self, ArmError> {
        let check = |fine: bool, name| if fine { Ok(()) } else { Err(ArmError::Impossible(name)) };
        check(model.lengths_m.iter().all(|&v| positive(v)), "length")?;
        check(model.gravity_m_per_s2.iter().chain(&model.moments_kg_m).all(|v| v.is_finite()), "gravity")?;
        model.joints().check(edge_s)?;
        let arm = Self::with(model, model.joints(), edge_s);
        let [m1, m2, m3] = arm.diagonal_kg_m2();
        let ([a0, a2, a3], p) = (model.turning_kg_m2, model.coupling_kg_m2);
        // A point mass has no inertia in a few poses, in which the arm cannot move; its inertia is never negative.
        let rounding = 1e-12 * (a0.abs() + m1);
        let definite = model.turning_kg_m2.iter().chain(&[p]).all(|v| v.is_finite())
            && model.least_turning_kg_m2() + m1 >= -rounding
            && a0 + a2 + a3 + m1 > rounding
            && positive(m2)
            && positive(m3)
            && m2 * m3 * (1.0 + 1e-12) >= 0.25 * p * p;
        if definite { Ok(arm) } else { Err(ArmError::Massless) }
    }

    /// Returns the parameters.
    pub fn model(&self) -> &ArmModel {
        &self.links
    }

    /// Returns the inertias that the rotors of rigid joints add to `M11`, and `M22` and `M33` with their rotors.
    pub(super) fn diagonal_kg_m2(&self) -> [f64; 3] {
        let ([m2, m3], rotors) = (self.links.swinging_kg_m2, self.rotors_kg_m2);
        [rotors[0], m2 + rotors[1], m3 + rotors[2]]
    }
}

#[cfg(test)]
#[cfg(target_arch = "x86_64")]
mod tests {
    use super::{Arm, ArmModel, Hold, Links, Series, Start};
    use crate::arm::Transmission;
    use crate::flow::polynomial::ORDER;

    /// Models with and without transmissions, an amplifier's lag, gravity and friction.
    fn arms() -> Vec<Arm> {
        let rough = |model: ArmModel| ArmModel {
            viscous_nm_s_per_rad: [1e-3, 2e-3, 3e-3],
            coulomb_nm: [0.01, 0.02, 0.03],
            amplifier_s: 4e-4,
            ..model
        };
        let flexible = Transmission { stiffness_nm_per_rad: 70.0, damping_nm_s_per_rad: 0.01 };
        let rear = ArmModel { transmission: [None, Some(flexible), Some(flexible)], ..ArmModel::premium_1_5() };
        [ArmModel::premium_1_0(), ArmModel::premium_1_5(), rough(ArmModel::premium_1_5()), rough(rear)]
            .map(|model| Arm::new(model, 2e-8).expect("a possible arm"))
            .into()
    }

    #[test]
    fn series_are_the_same_bits_in_the_lanes_of_any_processor() {
        assert!(crate::flow::double::has_fused(), "this test needs a processor with AVX2 and fused multiply-add");
        let start = |size: f64| Start {
            q: [0.1 + size, -0.7, 0.3 * size, 0.0],
            v: [2.0 * size, -1.0, 0.5, 0.0],
            p: [0.1 + size, -0.71, 0.31 * size, 0.0],
            w: [2.0 * size, -1.1, 0.6, 0.0],
            u: [0.1, 0.2 * size, -0.3, 0.0],
            lag: [0.05 * size, -0.02, 0.03, 0.0],
            ..Start::default()
        };
        let kinds = [Hold::Locked, Hold::Stuck, Hold::Slip(1.0), Hold::Slip(-1.0), Hold::Slip(0.0)];
        for (arm, size) in arms().iter().flat_map(|arm| [0.0, 0.4, -3.0].map(|size| (arm, size))) {
            for holds in (0..125).map(|n| [kinds[n % 5], kinds[n / 5 % 5], kinds[n / 25]]) {
                let x = start(size);
                let written = |write: &dyn Fn(&mut Series, &mut super::Work, usize)| {
                    let (mut series, mut work) = (Series::new(), arm.links.work());
                    (series.q[0], series.v[0], series.p[0], series.w[0], series.lag[0]) = (x.q, x.v, x.p, x.w, x.lag);
                    series.powers = 0;
                    // As a motion does: the first powers, and later the others.
                    write(&mut series, &mut work, 5);
                    write(&mut series, &mut work, ORDER);
                    series
                };
                let native = written(&|series, work, powers| {
                    ArmModel::write_native(arm, series, work, &x, &holds, powers);
                });
                let fused = written(&|series, work, powers| {
                    // SAFETY: the processor has just been asked.
                    unsafe { ArmModel::write_fused(arm, series, work, &x, &holds, powers) };
                });
                let all = |series: &Series| {
                    [series.q, series.v, series.p, series.w, series.lag, series.hold]
                        .map(|terms| terms.map(|lanes| lanes.map(f64::to_bits)))
                };
                assert_eq!(all(&native), all(&fused), "{holds:?} {x:?}");
                assert_eq!(native.good_s.to_bits(), fused.good_s.to_bits());
            }
        }
    }
}
