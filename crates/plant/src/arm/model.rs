//! The parameters of the arm, and its dynamics.

use super::dynamics::{Dynamics, Scalar};
use super::joints::{Joints, Transmission};

/// The parameters of the arm. Those of a joint's motor are reflected to the joint.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ArmModel {
    /// Lengths of upper link and forearm in m.
    pub lengths_m: [f64; 2],
    /// `a0`, `a2`, `a3`: the constant part of `M11`, and the factors of the cosines of twice joints 2 and 3, in kg·m².
    pub turning_kg_m2: [f64; 3],
    /// `P`, which couples joints 2 and 3, in kg·m².
    pub coupling_kg_m2: f64,
    /// `M22` and `M33` in kg·m².
    pub swinging_kg_m2: [f64; 2],
    /// `A` and `B`: first moments of mass about joints 2 and 3, in kg·m; 0 when balanced.
    pub moments_kg_m: [f64; 2],
    /// Gravity in the device frame (y up) in m/s².
    pub gravity_m_per_s2: [f64; 3],
    /// Viscous friction of each joint in N·m·s/rad.
    pub viscous_nm_s_per_rad: [f64; 3],
    /// Coulomb friction of each joint in N·m.
    pub coulomb_nm: [f64; 3],
    /// Inertia of each rotor in kg·m².
    pub rotor_kg_m2: [f64; 3],
    /// The transmission of each joint; `None` is rigid.
    pub transmission: [Option<Transmission>; 3],
    /// Time constant of the current amplifiers in s; 0: no lag.
    pub amplifier_s: f64,
    /// Joints that move; the others are locked at their angles.
    pub free: [bool; 3],
}

/// Gravity downward, in m/s².
const DOWN_M_PER_S2: [f64; 3] = [0.0, -9.81, 0.0];

impl ArmModel {
    /// Returns a Premium 1.0: links of 0.140 m (found in a student's answer to a course), an apparent mass of 0.075 kg
    /// at the tip balanced against gravity (assumed: no inertias of a 1.0 are published). The apparent mass includes
    /// the rotors; transmissions are rigid, amplifiers ideal. Friction is 0: its published values are those felt at the
    /// tip, and the caller converts them to the joints.
    pub fn premium_1_0() -> Self {
        let length_m = 0.140;
        let massless = Self {
            lengths_m: [length_m; 2],
            turning_kg_m2: [0.0; 3],
            coupling_kg_m2: 0.0,
            swinging_kg_m2: [0.0; 2],
            moments_kg_m: [0.0; 2],
            gravity_m_per_s2: DOWN_M_PER_S2,
            viscous_nm_s_per_rad: [0.0; 3],
            coulomb_nm: [0.0; 3],
            rotor_kg_m2: [0.0; 3],
            transmission: [None; 3],
            amplifier_s: 0.0,
            free: [true; 3],
        };
        massless.with_tip_mass(0.075).balanced()
    }

    /// Returns a Premium 1.5. Masses, inertias and lengths are those published by Çavuşoğlu, Feygin and Tendick 2002
    /// (found in a public model of the device). The rotors (1.08e-6 kg·m² behind 13.3, 11.2 and 11.2) are found there
    /// too; it is assumed that they add to the published links. Transmissions are rigid, amplifiers ideal. Friction is
    /// 0, as in [`premium_1_0`](Self::premium_1_0).
    pub fn premium_1_5() -> Self {
        let (l1, l2, l3, l5, l6): (f64, f64, f64, f64, f64) = (0.215, 0.170, 0.0325, -0.0368, 0.0527);
        let (fore_kg, parallel_kg, upper_kg, rear_kg) = (0.0202, 0.0249, 0.2359, 0.1906);
        // Inertias about x, y, z.
        let fore = [0.4864e-4, 0.001843e-4, 0.4864e-4];
        let parallel = [0.959e-4, 0.959e-4, 0.0051e-4];
        let upper = [11.09e-4, 10.06e-4, 0.591e-4];
        let rear = [7.11e-4, 0.629e-4, 6.246e-4];
        let base = 11.87e-4;
        let turns = |part: [f64; 3]| 0.5 * (part[1] + part[2]);
        let leans = |part: [f64; 3]| 0.5 * (part[1] - part[2]);
        let upper_arm = l1 * l1 * (0.5 * fore_kg + 0.125 * parallel_kg);
        let forearm = 0.125 * l2 * l2 * fore_kg + 0.5 * l3 * l3 * parallel_kg;
        let ratios: [f64; 3] = [13.3, 11.2, 11.2];
        Self {
            lengths_m: [l1, l2],
            turning_kg_m2: [
                turns(fore) + base + turns(upper) + turns(parallel) + turns(rear) + upper_arm + forearm,
                leans(upper) + leans(parallel) + upper_arm,
                leans(rear) - 0.5 * (fore[2] - fore[1]) - forearm,
            ],
            coupling_kg_m2: l1 * (l2 * fore_kg + l3 * parallel_kg),
            swinging_kg_m2: [upper[0] + parallel[0] + 2.0 * upper_arm, fore[0] + rear[0] + 2.0 * forearm],
            moments_kg_m: [
                l1 * fore_kg + l5 * upper_kg + 0.5 * l1 * parallel_kg,
                0.5 * l2 * fore_kg + l3 * parallel_kg - l6 * rear_kg,
            ],
            gravity_m_per_s2: DOWN_M_PER_S2,
            viscous_nm_s_per_rad: [0.0; 3],
            coulomb_nm: [0.0; 3],
            rotor_kg_m2: ratios.map(|ratio| 1.08e-6 * ratio * ratio),
            transmission: [None; 3],
            amplifier_s: 0.0,
            free: [true; 3],
        }
    }

    /// Returns the arm with its present masses balanced against gravity.
    #[must_use]
    pub fn balanced(self) -> Self {
        Self { moments_kg_m: [0.0; 2], ..self }
    }

    /// Returns the arm with a point mass at its tip, on which gravity acts.
    #[must_use]
    pub fn with_tip_mass(mut self, mass_kg: f64) -> Self {
        let [l1, l2] = self.lengths_m;
        let (upper, fore) = (mass_kg * l1 * l1, mass_kg * l2 * l2);
        self.turning_kg_m2[0] += 0.5 * (upper + fore);
        self.turning_kg_m2[1] += 0.5 * upper;
        self.turning_kg_m2[2] -= 0.5 * fore;
        self.coupling_kg_m2 += 2.0 * mass_kg * l1 * l2;
        self.swinging_kg_m2[0] += upper;
        self.swinging_kg_m2[1] += fore;
        self.moments_kg_m[0] += mass_kg * l1;
        self.moments_kg_m[1] += mass_kg * l2;
        self
    }

    /// Returns the links' mass matrix in kg·m², without rotors.
    pub fn mass_kg_m2(&self, angles_rad: [f64; 3]) -> [[f64; 3]; 3] {
        Dynamics::mass_kg_m2(self, &angles_rad)
    }

    /// Returns the potential energy in gravity, in J.
    pub fn gravity_j(&self, angles_rad: [f64; 3]) -> f64 {
        Dynamics::potential_j(self, &angles_rad)
    }

    /// Returns the joints, without the links.
    pub fn joints(&self) -> Joints {
        Joints {
            viscous_nm_s_per_rad: self.viscous_nm_s_per_rad,
            coulomb_nm: self.coulomb_nm,
            rotor_kg_m2: self.rotor_kg_m2,
            transmission: self.transmission,
            amplifier_s: self.amplifier_s,
            free: self.free,
        }
    }
}

impl ArmModel {
    /// Returns the least `M11` of the links over all poses.
    pub(super) fn least_turning_kg_m2(&self) -> f64 {
        let ([a0, a2, a3], p) = (self.turning_kg_m2, self.coupling_kg_m2);
        // A quadratic form of x = cos θ2 and y = sin θ3 on a square has its least value in the middle, on a side or in
        // a corner.
        let value = |x: f64, y: f64| a0 - a2 + a3 + 2.0 * a2 * x * x - 2.0 * a3 * y * y + p * x * y;
        let side = |square: f64| if square > 0.0 { (-p / (2.0 * square)).clamp(-1.0, 1.0) } else { 1.0 };
        let (x, y) = (side(2.0 * a2), side(-2.0 * a3));
        [value(0.0, 0.0), value(1.0, 1.0), value(1.0, -1.0), value(x, 1.0), value(1.0, y)]
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }
}

impl Dynamics for ArmModel {
    fn mass_kg_m2<T: Scalar>(&self, [_, t2, t3]: &[T; 3]) -> [[T; 3]; 3] {
        let ([a0, a2, a3], p, [m22, m33]) = (self.turning_kg_m2, self.coupling_kg_m2, self.swinging_kg_m2);
        let number = |value: f64| T::from(value);
        let (_, twice2) = (number(2.0) * t2.clone()).sin_cos();
        let (_, twice3) = (number(2.0) * t3.clone()).sin_cos();
        let ((_, c2), (s3, _), (apart, _)) = (t2.sin_cos(), t3.sin_cos(), (t2.clone() - t3.clone()).sin_cos());
        let m11 = number(a0) + number(a2) * twice2 + number(a3) * twice3 + number(p) * c2 * s3;
        let m23 = number(-0.5 * p) * apart;
        let zero = || number(0.0);
        [[m11, zero(), zero()], [zero(), number(m22), m23.clone()], [zero(), m23, number(m33)]]
    }

    fn potential_j<T: Scalar>(&self, angles_rad: &[T; 3]) -> T {
        let [(s1, c1), (s2, c2), (s3, c3)] = angles_rad.each_ref().map(T::sin_cos);
        let ([a, b], g) = (self.moments_kg_m.map(T::from), self.gravity_m_per_s2.map(T::from));
        let radius = a.clone() * c2 + b.clone() * s3;
        let [x, y, z] = g;
        -(x * s1 * radius.clone() + y * (a * s2 - b * c3) + z * c1 * radius)
    }

    fn tip_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> [T; 3] {
        let [(s1, c1), (s2, c2), (s3, c3)] = angles_rad.each_ref().map(T::sin_cos);
        let [upper, fore] = self.lengths_m.map(T::from);
        let radius = upper.clone() * c2 + fore.clone() * s3;
        [s1 * radius.clone(), fore.clone() - fore * c3 + upper.clone() * s2, c1 * radius - upper]
    }
}
