//! The device of Pediredla, Chandrasekaran, Annamraju and Thondiyath (2022): a spherical segment on a gimbal, raised by
//! a crank through a connecting rod (the paper's semi-compliant four-bar).
//!
//! Joints: pitch `θ`, roll `φ`, crank `ψ`. The finger lies on the segment's top, at the distance `r` from the centre of
//! the gimbal; y is up.
//!
//! | quantity | formula |
//! |---|---|
//! | radius | `r = l1 cos ψ + √(l2² - l1² sin² ψ) + offset`; greatest at `ψ = 0`, least at `ψ = π` |
//! | tip | `x = -r cos θ sin φ`, `y = r cos θ cos φ`, `z = r sin θ` |
//! | crank's lever | `dr/dψ = -l1 sin ψ (1 + l1 cos ψ / √(l2² - l1² sin² ψ))`; 0 at both dead centres |
//! | kinetic energy | `½ m (r'² + r² θ'² + r² cos² θ φ'²)`, with `r' = dr/dψ ψ'` |
//! | potential | `m g r cos θ cos φ`: upright, the segment falls over by itself |
//!
//! The published energies (equation 5) are `½ m l² (θ'² + cos² θ φ'² + r'²)` and `m g l cos θ cos φ` with a constant
//! `l`. Their third term is in kg·m⁴/s², gravity does not act along `r`, and turning does not couple to `r`.
//! [`Form::Literal`] computes them with the numbers of SI units, to compare; [`Form::Corrected`] is the table above.

use super::dynamics::{Dynamics, Scalar};
use super::joints::{ArmError, positive};

/// The energies of a [`Gimbal`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Form {
    /// A point mass at the tip.
    #[default]
    Corrected,
    /// The published formulas, whose dimensions do not agree.
    Literal,
}

/// The segment, its gimbal and its crank.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gimbal {
    /// Length of the crank in m.
    pub crank_m: f64,
    /// Length of the connecting rod in m.
    pub rod_m: f64,
    /// The part of the radius that the crank does not move, in m.
    pub offset_m: f64,
    /// Mass of the segment in kg.
    pub mass_kg: f64,
    /// `l` of the published energies in m; only [`Form::Literal`] uses it.
    pub length_m: f64,
    /// Gravity, downward along y, in m/s².
    pub gravity_m_per_s2: f64,
    /// The energies.
    pub form: Form,
}

impl Default for Gimbal {
    /// Returns the published lengths. The paper gives neither masses nor the offset: 0.15 kg, an offset of 0 and `l` in
    /// the middle of the radius's range are assumed.
    fn default() -> Self {
        Self {
            crank_m: 12.5e-3,
            rod_m: 58e-3,
            offset_m: 0.0,
            mass_kg: 0.15,
            length_m: 58e-3,
            gravity_m_per_s2: 9.81,
            form: Form::Corrected,
        }
    }
}

impl Gimbal {
    /// The greatest pitch and roll, in either direction: ±55°.
    pub const TILT_RAD: f64 = 55.0 * std::f64::consts::PI / 180.0;

    /// Checks the lengths and the mass.
    ///
    /// # Errors
    ///
    /// A length or the mass is not positive, the offset is negative, or the rod is not longer than the crank.
    pub fn check(&self) -> Result<(), ArmError> {
        let fine = |fine: bool, name| if fine { Ok(()) } else { Err(ArmError::Impossible(name)) };
        fine(positive(self.crank_m), "crank")?;
        fine(positive(self.rod_m) && self.rod_m > self.crank_m, "rod, which must be longer than its crank,")?;
        fine(self.offset_m >= 0.0 && self.offset_m.is_finite(), "offset")?;
        fine(positive(self.mass_kg), "mass")?;
        fine(positive(self.length_m), "length")
    }

    /// Returns the least and the greatest radius in m.
    pub fn radii_m(&self) -> [f64; 2] {
        [self.rod_m - self.crank_m, self.rod_m + self.crank_m].map(|length_m| length_m + self.offset_m)
    }

    /// Returns the radius of a crank angle.
    pub fn radius_m<T: Scalar>(&self, crank_rad: &T) -> T {
        let (sine, cosine) = crank_rad.sin_cos();
        let square = T::from(self.rod_m * self.rod_m) - T::from(self.crank_m * self.crank_m) * sine.clone() * sine;
        T::from(self.crank_m) * cosine + square.sqrt() + T::from(self.offset_m)
    }

    /// Returns the change of the radius per change of the crank's angle, in m/rad; never positive in `0..π`.
    pub fn lever_m<T: Scalar>(&self, crank_rad: &T) -> T {
        let (sine, cosine) = crank_rad.sin_cos();
        let (crank, rod) = (self.crank_m, self.rod_m);
        let root = (T::from(rod * rod) - T::from(crank * crank) * sine.clone() * sine.clone()).sqrt();
        -(T::from(crank) * sine * (T::from(1.0) + T::from(crank) * cosine * root.recip()))
    }

    /// Returns the crank's angle in `0..=π` of a radius; `None` when the crank does not reach it.
    pub fn crank_rad(&self, radius_m: f64) -> Option<f64> {
        let [least, most] = self.radii_m();
        if !(least..=most).contains(&radius_m) {
            return None;
        }
        // Half the angle, by the half-angle form of the cosine rule: no difference of near numbers at the dead centres.
        let height_m = radius_m - self.offset_m;
        let (short, long) = (self.rod_m - self.crank_m, self.rod_m + self.crank_m);
        let inner = (height_m - short).max(0.0) * (height_m + long);
        let outer = (long - height_m).max(0.0) * (height_m + short);
        Some(2.0 * libm::atan2(outer.sqrt(), inner.sqrt()))
    }

    /// Returns the tip at a pitch, a roll and a radius.
    pub fn tip_at_m<T: Scalar>(pitch_rad: &T, roll_rad: &T, radius_m: &T) -> [T; 3] {
        let ((st, ct), (sf, cf)) = (pitch_rad.sin_cos(), roll_rad.sin_cos());
        let ground = radius_m.clone() * ct;
        [-(ground.clone() * sf), ground * cf, radius_m.clone() * st]
    }

    /// Returns pitch, roll and radius of a tip.
    pub fn polar([x, y, z]: [f64; 3]) -> [f64; 3] {
        let ground = libm::hypot(x, y);
        [libm::atan2(z, ground), libm::atan2(-x, y), libm::hypot(ground, z)]
    }

    /// Returns the joints' angles that bring the tip to a position; `None` outside of the crank's reach or beyond the
    /// greatest tilt.
    pub fn angles_rad(&self, tip_m: [f64; 3]) -> Option<[f64; 3]> {
        let [pitch_rad, roll_rad, radius_m] = Self::polar(tip_m);
        let tilted = [pitch_rad, roll_rad].iter().all(|angle_rad| angle_rad.abs() <= Self::TILT_RAD);
        Some([pitch_rad, roll_rad, self.crank_rad(radius_m).filter(|_| tilted)?])
    }

    /// Returns the change of the tip's position per change of each joint; rows x, y, z.
    pub fn jacobian_m(&self, [pitch_rad, roll_rad, crank_rad]: [f64; 3]) -> [[f64; 3]; 3] {
        let ((st, ct), (sf, cf)) = (libm::sincos(pitch_rad), libm::sincos(roll_rad));
        let (r, lever) = (self.radius_m(&crank_rad), self.lever_m(&crank_rad));
        [
            [r * sf * st, -r * cf * ct, -sf * ct * lever],
            [-r * st * cf, -r * sf * ct, cf * ct * lever],
            [r * ct, 0.0, st * lever],
        ]
    }
}

impl Dynamics for Gimbal {
    fn mass_kg_m2<T: Scalar>(&self, [pitch, _, crank]: &[T; 3]) -> [[T; 3]; 3] {
        let (_, cosine) = pitch.sin_cos();
        let (radius, lever) = (self.radius_m(crank), self.lever_m(crank));
        let square = |x: T| x.clone() * x;
        let turning = match self.form {
            Form::Corrected => T::from(self.mass_kg) * square(radius),
            Form::Literal => T::from(self.mass_kg * self.length_m * self.length_m),
        };
        let raising = match self.form {
            Form::Corrected => T::from(self.mass_kg),
            Form::Literal => turning.clone(),
        };
        let zero = || T::from(0.0);
        [
            [turning.clone(), zero(), zero()],
            [zero(), turning * square(cosine), zero()],
            [zero(), zero(), raising * square(lever)],
        ]
    }

    fn potential_j<T: Scalar>(&self, [pitch, roll, crank]: &[T; 3]) -> T {
        let length = match self.form {
            Form::Corrected => self.radius_m(crank),
            Form::Literal => T::from(self.length_m),
        };
        T::from(self.mass_kg * self.gravity_m_per_s2) * length * pitch.sin_cos().1 * roll.sin_cos().1
    }

    fn tip_m<T: Scalar>(&self, [pitch, roll, crank]: &[T; 3]) -> [T; 3] {
        Self::tip_at_m(pitch, roll, &self.radius_m(crank))
    }

    fn surface_m<T: Scalar>(&self, [_, _, crank]: &[T; 3]) -> Option<T> {
        Some(self.radius_m(crank))
    }
}
