//! The joints of an arm: friction, motors and transmissions.

use std::fmt;

/// A flexible transmission between a motor and its link.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Transmission {
    /// Stiffness at the joint in N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Damping at the joint in N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
}

/// The joints of an arm, whatever its links are: friction, motors and transmissions. A joint's motor is reflected to
/// the joint.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Joints {
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

/// The reason why an arm was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ArmError {
    /// This parameter is not a number, negative, or 0 where it must not be.
    Impossible(&'static str),
    /// A free joint has zero inertia in all poses, or negative inertia in some pose.
    Massless,
}

impl fmt::Display for ArmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Impossible(name) => write!(f, "the arm's {name} is not possible"),
            Self::Massless => f.write_str("the arm's inertia is not positive in every pose"),
        }
    }
}

impl std::error::Error for ArmError {}

impl Joints {
    /// Checks the joints, and the period of the clock of their arm.
    pub(super) fn check(&self, edge_s: f64) -> Result<(), ArmError> {
        let check = |fine: bool, name| if fine { Ok(()) } else { Err(ArmError::Impossible(name)) };
        check(positive(edge_s), "clock period")?;
        check(self.viscous_nm_s_per_rad.iter().all(|&v| not_negative(v)), "viscous friction")?;
        check(self.coulomb_nm.iter().all(|&v| not_negative(v)), "Coulomb friction")?;
        check(self.rotor_kg_m2.iter().all(|&v| not_negative(v)), "rotor")?;
        check(not_negative(self.amplifier_s), "amplifier's time constant")?;
        for (transmission, rotor_kg_m2) in self.transmission.iter().zip(self.rotor_kg_m2) {
            let Some(flexible) = transmission else { continue };
            check(positive(flexible.stiffness_nm_per_rad), "transmission's stiffness")?;
            check(not_negative(flexible.damping_nm_s_per_rad), "transmission's damping")?;
            check(rotor_kg_m2 > 0.0, "rotor behind a flexible transmission")?;
        }
        Ok(())
    }
}

pub(super) fn positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

fn not_negative(value: f64) -> bool {
    value >= 0.0 && value.is_finite()
}
