//! The energy audit of an arm: every flow integrated in its own right, from the series of the motion.

use super::finger::{FORCE, SPEED, Touch};
use super::links::Links;
use super::series::{Series, Start};
use super::{Arm, Joints};
use crate::flow::double::{Product, versions};
use crate::flow::lanes::Lanes as _;
use crate::flow::polynomial::{Coefficients, Lanes, convolved, value};

/// Energy flows since the start, in J.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ArmEnergy {
    /// Work of the motors' torques.
    pub source_j: f64,
    /// Work of the finger.
    pub finger_j: f64,
    /// Heat of viscous friction.
    pub viscous_j: f64,
    /// Heat of Coulomb friction.
    pub coulomb_j: f64,
    /// Heat of the transmissions' dampers.
    pub transmission_j: f64,
    /// Sum of the sizes of all flows; a residual is measured against it.
    pub exchanged_j: f64,
}

impl ArmEnergy {
    /// Returns the energy dissipated in all ways.
    pub fn dissipated_j(&self) -> f64 {
        self.viscous_j + self.coulomb_j + self.transmission_j
    }

    /// Returns these energies plus a share of others.
    pub(super) fn plus(&self, other: &Self, share: f64) -> Self {
        Self {
            source_j: self.source_j + share * other.source_j,
            finger_j: self.finger_j + share * other.finger_j,
            viscous_j: self.viscous_j + share * other.viscous_j,
            coulomb_j: self.coulomb_j + share * other.coulomb_j,
            transmission_j: self.transmission_j + share * other.transmission_j,
            exchanged_j: self.exchanged_j + share * other.exchanged_j,
        }
    }

    /// Adds the energies of the first `t` seconds of a series.
    pub(super) fn take(&mut self, joints: &Joints, x: &Start, series: &Series, t: f64) {
        if series.powers == 0 {
            return;
        }
        let turned = value(&series.p[1..=series.powers], t).map(|rate| rate * t);
        let mut flows = [0.0; 5];
        flows[0] = turned.iter().zip(&x.u).map(|(turned, torque)| torque * turned).sum();
        flows[2] = turned.iter().zip(&joints.coulomb_nm).map(|(turned, torque)| torque * turned.abs()).sum();
        if joints.viscous_nm_s_per_rad != [0.0; 3] {
            let squares = Self::integral(&series.w, &series.w, series.powers, t);
            flows[1] = squares.iter().zip(&joints.viscous_nm_s_per_rad).map(|(square, rate)| rate * square).sum();
        }
        if x.lag != [0.0; 4] {
            flows[0] += Self::integral(&series.lag, &series.w, series.powers, t).iter().sum::<f64>();
        }
        if joints.transmission.iter().any(Option::is_some) {
            let slips = std::array::from_fn(|k| std::array::from_fn(|i| series.w[k][i] - series.v[k][i]));
            let squares = Self::integral(&slips, &slips, series.powers, t);
            let rates =
                joints.transmission.map(|flexible| flexible.map_or(0.0, |flexible| flexible.damping_nm_s_per_rad));
            flows[3] = squares.iter().zip(rates).map(|(square, rate)| rate * square).sum();
        }
        if x.press.touch == Touch::Pressed {
            let lane = |lane: usize| std::array::from_fn(|k| [series.touch[k][lane], 0.0, 0.0, 0.0]);
            flows[4] = -Self::integral(&lane(FORCE), &lane(SPEED), series.powers, t)[0];
        }
        self.source_j += flows[0];
        self.viscous_j += flows[1];
        self.coulomb_j += flows[2];
        self.transmission_j += flows[3];
        self.finger_j += flows[4];
        self.exchanged_j += flows.iter().map(|flow| flow.abs()).sum::<f64>();
    }
}

impl ArmEnergy {
    versions! {
        /// Returns the integral over `[0, t]` of the product of two series, to the order to which they are known.
        fn integral[integral_fused, integral_native, integral_with](
            a: &Coefficients, b: &Coefficients, powers: usize, t: f64
        ) -> Lanes
    }

    #[inline(always)]
    fn integral_with<P: Product>(a: &Coefficients, b: &Coefficients, powers: usize, t: f64) -> Lanes {
        let mut sum = P::all(0.0);
        for k in (0..powers).rev() {
            sum = sum * P::all(t) + convolved::<P>(&a[..=k], &b[..=k]) * P::all(1.0 / (k + 1) as f64);
        }
        (sum * P::all(t)).state()
    }
}

impl<L: Links> Arm<L> {
    /// Returns the energy, in J, of the motion, in gravity (0 with the joints' first moments at the axis) and in the
    /// transmissions.
    pub(super) fn stored_j(&self, x: &Start) -> f64 {
        let (links, joints) = (&self.links, &self.joints);
        let (q, v) = ([x.q[0], x.q[1], x.q[2]], [x.v[0], x.v[1], x.v[2]]);
        let mass = links.mass_kg_m2(q);
        let mut stored_j = links.potential_j(q);
        for i in 0..3 {
            stored_j += 0.5 * v[i] * (0..3).map(|j| mass[i][j] * v[j]).sum::<f64>();
            stored_j += 0.5 * joints.rotor_kg_m2[i] * x.w[i] * x.w[i];
            if let Some(flexible) = joints.transmission[i] {
                let twist_rad = x.twist_rad(i);
                stored_j += 0.5 * flexible.stiffness_nm_per_rad * twist_rad * twist_rad;
            }
        }
        stored_j
    }
}

#[cfg(test)]
mod tests {
    use super::ArmEnergy;
    use crate::flow::polynomial::{Coefficients, ORDER};

    #[test]
    fn integrals_of_products_are_those_of_polynomials_in_the_lanes_of_any_processor() {
        // Lane n: (1 + n t)(2 - t + n t^2) from 0 to t. The terms beyond are not to be read.
        let mut a: Coefficients = [[f64::NAN; 4]; ORDER + 1];
        a[..4].fill([0.0; 4]);
        let mut b = a;
        for lane in 0..4 {
            let n = lane as f64;
            (a[0][lane], a[1][lane]) = (1.0, n);
            (b[0][lane], b[1][lane], b[2][lane]) = (2.0, -1.0, n);
        }
        for t in [0.0, 0.25, 1.0, -3.0] {
            let is_right = |found: [f64; 4]| {
                (0..4).all(|lane| {
                    let n = lane as f64;
                    let terms = [2.0, (2.0 * n - 1.0) / 2.0, 0.0, n * n / 4.0];
                    let right = terms.iter().rev().fold(0.0, |sum, term| (sum + term) * t);
                    (found[lane] - right).abs() <= 1e-15 * right.abs()
                })
            };
            assert!(is_right(ArmEnergy::integral_native(&a, &b, 4, t)), "{t}");
            #[cfg(target_arch = "x86_64")]
            {
                assert!(
                    crate::flow::double::has_fused(),
                    "this test needs a processor with AVX2 and fused multiply-add"
                );
                // SAFETY: the processor has just been asked.
                let fused = unsafe { ArmEnergy::integral_fused(&a, &b, 4, t) };
                assert!(is_right(fused), "{t}");
                assert_eq!(fused.map(f64::to_bits), ArmEnergy::integral_native(&a, &b, 4, t).map(f64::to_bits));
            }
        }
    }
}
