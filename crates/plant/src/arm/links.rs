//! The interface between an arm's motion and the equations of its links.

use super::Arm;
use super::friction::Hold;
use super::kinematics::Sines;
use super::pose::Pose;
use super::series::{Series, Start};

/// `Links` are the moving parts of an arm, as its motion needs them: [`ArmMotion`](super::ArmMotion) flows by their
/// series, [`SteppedArm`](super::SteppedArm) moves by their terms in a pose. Implemented by
/// [`Recorded`](super::Recorded) for any [`Dynamics`](super::Dynamics), and by [`ArmModel`](super::ArmModel), whose
/// series are written out by hand because they are most of a run's time.
pub trait Links: Clone {
    /// The memory of the recursion.
    type Work: Clone;

    /// Returns a memory to begin with.
    fn work(&self) -> Self::Work;
    /// Returns the tip's position.
    fn tip_m(&self, angles_rad: [f64; 3]) -> [f64; 3];
    /// Returns the mass matrix without rotors.
    fn mass_kg_m2(&self, angles_rad: [f64; 3]) -> [[f64; 3]; 3];
    /// Returns the potential energy.
    fn potential_j(&self, angles_rad: [f64; 3]) -> f64;
    /// Returns the terms of the equations of motion at angles `q` and speeds `v`, without rotors. `near` has the sines
    /// of angles nearby.
    fn pose(&self, near: &Sines, q: [f64; 3], v: [f64; 3]) -> Pose;
    /// Extends the series of a motion to a higher power.
    fn extend(arm: &Arm<Self>, series: &mut Series, work: &mut Self::Work, x: &Start, holds: &[Hold; 3], powers: usize);
    /// Returns the acceleration of each rigid joint per torque, at the start of the series.
    fn ease(arm: &Arm<Self>, work: &Self::Work) -> [f64; 3];
}
